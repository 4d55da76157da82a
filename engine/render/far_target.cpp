#include "engine/render/far_target.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "engine/core/constants.h"

namespace engine {
namespace {

using Eigen::Vector3d;

// Of the spread of light of the paper's camera, 450-850 nm, f/12.5, 6.5 um, in shares of the light
// and in px: its peak; the largest second derivative along an axis; the largest norms of its third
// and fourth derivatives; and the Gaussian that averages noise as it does.
constexpr double kPeak = 0.41;
constexpr double kSecond = 1.20;
constexpr double kThird = 3.55;
constexpr double kFourth = 16.6;
constexpr double kDenser = 2.0;  // than a blot with the same second moments
constexpr double kPaperBlur_px = 0.675;

// A fifth of the variance of all model errors is the form's; the light's change may be as much.
constexpr double kShareOfErrors = 0.447;
// Bounds of that change, as a share of the light.
constexpr double kLeastChange = 5e-4;
constexpr double kMostChange = 5e-3;
// Where the sensor is not known, of the peak.
constexpr double kUnseenUnknown = 1e-3;

constexpr double kStayFar = 1.2;
constexpr double kCoarserBelow = 1.0 / 1.5;
constexpr double kRangeGrown = 1.1;

std::size_t at(int i) noexcept { return static_cast<std::size_t>(i); }

/// A length [low, high) on a row of `count` cells: the first it touches, and shares of the length.
struct Touched {
  int first = 0;
  int end = 0;
  double low = 0;
  double high = 0;
  Touched(double from, double to, int count) noexcept : low(from), high(to) {
    first = static_cast<int>(std::clamp(std::floor(from), 0.0, 1.0 * count));
    end = static_cast<int>(std::clamp(std::ceil(to), 0.0, 1.0 * count));
  }
  [[nodiscard]] double share(int i) const noexcept {
    return (std::min(high, i + 1.0) - std::max(low, 1.0 * i)) / (high - low);
  }
};

}  // namespace

FarTarget::FarTarget(const RenderSpec& spec, std::unique_ptr<Renderer> resolved,
                     std::shared_ptr<TracedTarget> target, WorkerPool& pool)
    : spec_(spec),
      resolved_(std::move(resolved)),
      radius_m_(target->bounding_radius_m),
      light_(spec, std::move(target), pool),
      width_(spec.noise.blur_px > 0.0 ? spec.noise.blur_px / kPaperBlur_px : 1.0) {}

RenderReport FarTarget::render(const Snapshot& snapshot, Budget budget, Radiance& out) noexcept {
  if (!far_enough(snapshot)) {
    light_.interrupt();
    RenderReport report = resolved_->render(snapshot, budget, out);
    report.add({"target", "resolved", 0.0});
    return report;
  }
  const int s = spec_.grid.oversampling;
  out.region = region_of(snapshot);
  out.oversampling = s;
  out.uniform_w_m2_sr = snapshot.background_w_m2_sr;
  out.motion_px = snapshot.smear_px;
  out.points.clear();
  out.grid.resize(out.region.width() * s, out.region.height() * s);
  out.cover.resize(out.grid.width(), out.grid.height());
  if (out.region.empty()) {
    RenderReport report;
    report.add({"target", "outside", 0.0});
    return report;
  }
  std::ranges::fill(out.grid.pixels(), 0.0F);
  std::ranges::fill(out.cover.pixels(), 0.0F);
  const View before = view_of(snapshot);
  light_.update(snapshot,
                std::clamp(unseen_share(before) / peak_share(before), kLeastChange, kMostChange));
  const View view = view_of(snapshot);
  const Form form = choose_form(snapshot, view);
  draw_cells(form == Form::kImage, view, out);
  if (form != Form::kImage) draw_points(form, view, out);

  RenderReport report = light_.report();
  report.samples_per_pixel = report.passes = 0;
  report.rho_mc = {};
  report.visible_fraction = share_in_frame(view, out);
  constexpr double kNotKnown = std::numeric_limits<double>::quiet_NaN();
  const bool known = spec_.noise.e_per_radiance > 0.0;
  report.add({"target",
              form == Form::kPoint   ? "point"
              : form == Form::kImage ? "image"
                                     : "moments",
              known ? error_share(form, view) * light_e(view) : kNotKnown});
  return report;
}

bool FarTarget::far_enough(const Snapshot& snapshot) noexcept {
  if (spec_.far_target == FarTargetForm::kPoint) return true;
  const double range_m = snapshot.camera.m.norm();
  const double size_px = 2.0 * radius_m_ * spec_.camera.pixels_per_radian() / range_m;
  const double margin = far_ ? 1.0 : kStayFar;
  far_ = margin * size_px <= kLargest_px && range_m >= margin * kNearest_radii * radius_m_;
  return far_;
}

PixelRect FarTarget::region_of(const Snapshot& snapshot) const noexcept {
  const Vector3d centre = snapshot.body_from_camera.matrix.transpose() * -snapshot.camera.m;
  const LocalCamera camera(spec_.camera, snapshot.image_map);
  const std::optional<PixelPoint> place = camera.project(centre);
  if (!place) return {};
  // Off the axis an image is longer by the secant of the angle, twice.
  const double stretch = centre.squaredNorm() / (centre.z() * centre.z());
  const double half_px =
      radius_m_ * stretch * camera.stretch() * spec_.camera.pixels_per_radian() / centre.norm() +
      1.0;
  const PixelRect limits = spec_.camera.frame().grown_by(spec_.grid.beyond_frame_px);
  const auto inside = [](double x, int low, int high) {
    return static_cast<int>(std::clamp(x, 1.0 * low, 1.0 * high));
  };
  return {inside(std::floor(place->u - half_px), limits.left, limits.right),
          inside(std::floor(place->v - half_px), limits.top, limits.bottom),
          inside(std::ceil(place->u + half_px) + 1.0, limits.left, limits.right),
          inside(std::ceil(place->v + half_px) + 1.0, limits.top, limits.bottom)};
}

/// Pre: the target is before the camera.
FarTarget::View FarTarget::view_of(const Snapshot& snapshot) const noexcept {
  const Eigen::Matrix3d camera_from_body = snapshot.body_from_camera.matrix.transpose();
  const Vector3d centre = camera_from_body * -snapshot.camera.m;
  const double per_z = spec_.camera.pixels_per_radian() / centre.z();
  const LocalCamera camera(spec_.camera, snapshot.image_map);
  const Eigen::Matrix2d& slope = camera.map().slope;
  const auto per_m = [&](const Vector3d& axis) {
    const Vector3d a = camera_from_body * axis;
    const Eigen::Vector2d straight(per_z * (a.x() - a.z() * centre.x() / centre.z()),
                                   per_z * (a.y() - a.z() * centre.y() / centre.z()));
    return PixelPoint{slope.row(0).dot(straight), slope.row(1).dot(straight)};
  };
  return {camera.project(centre).value_or(PixelPoint{}), per_m(light_.x_axis()),
          per_m(light_.y_axis())};
}

double FarTarget::light_e(const View& view) const noexcept {
  return spec_.noise.e_per_radiance * light_.intensity_w_sr() * view.px2_per_m2();
}

double FarTarget::peak_share(const View& view) const noexcept {
  // A Gaussian of two pi times the mean variance wide, widened by the spread of light.
  return 1.0 / (width_ * width_ / kPeak + kPi * light_.parts().variance() * view.px2_per_m2());
}

double FarTarget::unseen_share(const View& view) const noexcept {
  const double peak = peak_share(view);
  if (!(spec_.noise.e_per_radiance > 0.0)) return kUnseenUnknown * peak;
  const double light = light_e(view);
  if (!(light > 0.0)) return std::numeric_limits<double>::infinity();
  return kShareOfErrors * spec_.profile.rho_total * spec_.noise.sigma_e(peak * light) / light;
}

/// Of the light, at most, in one pixel.
double FarTarget::error_share(Form form, const View& view) const noexcept {
  if (form == Form::kImage) return image_error_share(view);
  const double px2 = view.px2_per_m2() / (width_ * width_);
  const double peak = 1.0 / (width_ * width_);
  const LightParts& parts = light_.parts();
  if (form == Form::kPoint) return peak * 0.5 * kSecond * px2 * parts.variance();
  const LightParts::Mismatch& off =
      parts.mismatch(static_cast<int>(form) - static_cast<int>(Form::kMoments));
  return peak * (kThird / 6.0 * px2 * std::sqrt(px2) * off.third +
                 kFourth / 24.0 * px2 * px2 * off.fourth);
}

/// Each cell's light is spread over it and over those of the grid that it touches: half the second
/// derivative times the variances that this adds, where light is densest, taken as twice what it
/// would be in a blot; and three sigmas of the noise that the picture has there.
double FarTarget::image_error_share(const View& view) const noexcept {
  const double cell_m = light_.cell_m();
  const double cell_u = cell_m * (std::abs(view.per_x.u) + std::abs(view.per_y.u));
  const double cell_v = cell_m * (std::abs(view.per_x.v) + std::abs(view.per_y.v));
  const double grid_px = 1.0 / spec_.grid.oversampling;
  const double added_px2 = (cell_u * cell_u + cell_v * cell_v + 2.0 * grid_px * grid_px) / 12.0;
  const double peak = peak_share(view);
  return kDenser * peak / kPeak * 0.5 * kSecond * added_px2 / (width_ * width_) +
         3.0 * std::sqrt(peak) * light_.noise_share();
}

/// The coarsest that the sensor cannot tell, or the last one.
FarTarget::Form FarTarget::choose_form(const Snapshot& snapshot, const View& view) noexcept {
  if (spec_.far_target == FarTargetForm::kPoint) return Form::kPoint;
  const double unseen = unseen_share(view);
  const double range_m = snapshot.camera.m.norm();
  const auto coarsest = [&](double limit) {
    for (const Form form : {Form::kPoint, Form::kMoments, Form::kMoments4, Form::kMoments16})
      if (error_share(form, view) <= limit) return form;
    return Form::kImage;
  };
  const Form needed = coarsest(unseen);
  if (needed > form_) {
    form_ = needed;
    refined_at_m_ = range_m;
  } else if (range_m > kRangeGrown * refined_at_m_) {
    form_ = std::min(form_, coarsest(kCoarserBelow * unseen));
  }
  return form_;
}

void FarTarget::draw_points(Form form, const View& view, Radiance& out) const noexcept {
  const double per_w_sr = view.px2_per_m2() * std::pow(spec_.camera.ifov_rad(), 2);
  const auto add = [&](const LightSpot& spot) {
    const PixelPoint place = view.at(spot.x, spot.y);
    const PixelRect& r = out.region;
    if (place.u >= r.left - 0.5 && place.u <= r.right - 0.5 && place.v >= r.top - 0.5 &&
        place.v <= r.bottom - 0.5)
      out.points.push_back({place, spot.light * per_w_sr, {}});
  };
  const LightParts& parts = light_.parts();
  if (!(parts.light() > 0.0)) return;
  if (form == Form::kPoint) {
    add({parts.centre_x(), parts.centre_y(), parts.light()});
    return;
  }
  LightParts::Points points;
  const std::size_t count =
      parts.points(static_cast<int>(form) - static_cast<int>(Form::kMoments), points);
  for (std::size_t i = 0; i < count; ++i) add(points[i]);
}

/// Each cell of the picture as a square along the detector's axes.
void FarTarget::draw_cells(bool with_light, const View& view, Radiance& out) const noexcept {
  const int s = out.oversampling;
  const double half_u =
      0.5 * s * light_.cell_m() * (std::abs(view.per_x.u) + std::abs(view.per_y.u));
  const double half_v =
      0.5 * s * light_.cell_m() * (std::abs(view.per_x.v) + std::abs(view.per_y.v));
  const double cells_per_m2 = view.px2_per_m2() * s * s;
  for (const FarLight::Cell& cell : light_.cells()) {
    const PixelPoint place = view.at(static_cast<double>(cell.x_m), static_cast<double>(cell.y_m));
    const double x = (place.u + 0.5 - out.region.left) * s;
    const double y = (place.v + 0.5 - out.region.top) * s;
    const Touched columns(x - half_u, x + half_u, out.grid.width());
    const Touched rows(y - half_v, y + half_v, out.grid.height());
    const double area = static_cast<double>(cell.area_m2) * cells_per_m2;
    const double light = static_cast<double>(cell.light_w_sr) * cells_per_m2;
    for (int row = rows.first; row < rows.end; ++row) {
      for (int column = columns.first; column < columns.end; ++column) {
        const double share = rows.share(row) * columns.share(column);
        out.cover.at(column, row) += static_cast<float>(share * area);
        if (with_light) out.grid.at(column, row) += static_cast<float>(share * light);
      }
    }
  }
}

double FarTarget::share_in_frame(const View& view, const Radiance& out) const noexcept {
  const int s = out.oversampling;
  const double all = light_.area_m2() * view.px2_per_m2() * s * s;
  if (!(all > 0.0)) return 0.0;
  const PixelRect frame = spec_.camera.frame().clipped_to(out.region);
  double inside = 0;
  for (int row = (frame.top - out.region.top) * s; row < (frame.bottom - out.region.top) * s;
       ++row) {
    const auto cover = out.cover.row(row);
    for (int i = (frame.left - out.region.left) * s; i < (frame.right - out.region.left) * s; ++i)
      inside += static_cast<double>(cover[at(i)]);
  }
  return std::min(1.0, inside / all);
}

}  // namespace engine
