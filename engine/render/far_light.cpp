#include "engine/render/far_light.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace engine {
namespace {

using Eigen::Vector3d;

constexpr double kFar_radii = 1e6;
// Of the picture's side; the rest is margin.
constexpr double kFilled = 0.95;
// As the scenario asks of other pictures: so many where that asks for 50 samples a pixel, or for
// the default profile's noise.
constexpr int kSamples = 16;
constexpr double kAsMuchAs = 50.0;
constexpr double kAsGoodAs_rho = 0.19;
constexpr double kMostSamples = 4096;  // a batch
// No fraction of a power of two: of a sequence every second sample lies in the same half of a cell.
constexpr double kBounceShare = 0.618;
// Of a lobe that falls exponentially from its top: what changes by e in a turn of so much of the
// half width of the half vector, half of which is a direction's share.
constexpr double kFlank = 0.35;
constexpr double kMostTurn = 0.33;  // of a lobe's half width
constexpr double kWideLobe_rad = 0.5;
constexpr double kLeastChangePerRad = 1.0;
// Over half the picture's side this shifts a cell by a quarter of itself.
constexpr double kAxesTurn_rad = 0.5 / FarLight::kSide_px;
constexpr double kMostMove_rad = 8e-3;

double radius_of(const TracedTarget& target) noexcept {
  return std::max(target.bounding_radius_m, 1e-3);
}

int samples_for(const RenderSpec& spec) noexcept {
  const double finer = spec.samples_per_pixel > 0
                           ? spec.samples_per_pixel / kAsMuchAs
                           : std::pow(kAsGoodAs_rho / spec.profile.rho_mc, 2);
  return static_cast<int>(std::clamp(std::ceil(kSamples * finer), 1.0 * kSamples, kMostSamples));
}

RenderSpec picture_spec(const RenderSpec& spec) {
  RenderSpec picture = spec;
  picture.method = RenderMethod::kPaths;
  picture.samples_per_pixel = FarLight::kBatches * samples_for(spec);
  picture.bounce_share = std::max(spec.bounce_share, kBounceShare);
  picture.camera = {};  // none of the real one's window
  picture.camera.width_px = picture.camera.height_px = FarLight::kSide_px;
  const double ifov_rad = 2.0 / (kFilled * kFar_radii * FarLight::kSide_px);
  picture.camera.focal_length_m = picture.camera.pixel_pitch_m / ifov_rad;
  picture.grid = {1, 0};
  picture.noise = {};
  picture.clock = nullptr;  // a picture is whole, whatever the time
  return picture;
}

double narrowest_lobe_rad(const TracedTarget& target) noexcept {
  double narrowest = kWideLobe_rad;
  for (std::uint32_t m = 0; m < target.mesh.material_names.size(); ++m) {
    const double width = target.facets.brdf(m).lobe_half_width_rad();
    if (width > 0.0) narrowest = std::min(narrowest, width);
  }
  return narrowest;
}

void add_up(const RenderReport& batch, RenderReport& all) noexcept {
  RenderReport sum = batch;
  sum.samples += all.samples;
  sum.hits += all.hits;
  sum.rays += all.rays;
  sum.rejected_rays += all.rejected_rays;
  sum.rays_by_kind.camera += all.rays_by_kind.camera;
  sum.rays_by_kind.shadow += all.rays_by_kind.shadow;
  sum.rays_by_kind.bounce += all.rays_by_kind.bounce;
  sum.rays_by_kind.bounce_shadow += all.rays_by_kind.bounce_shadow;
  all = sum;
}

}  // namespace

FarLight::FarLight(const RenderSpec& spec, std::shared_ptr<TracedTarget> target, WorkerPool& pool)
    : far_m_(kFar_radii * radius_of(*target)),
      cell_m_(2.0 * radius_of(*target) / (kFilled * kSide_px)),
      narrowest_rad_(narrowest_lobe_rad(*target)),
      samples_(samples_for(spec)),
      batches_at_once_(spec.settled ? kBatches : 1),
      paths_(picture_spec(spec), std::move(target), pool),
      batch_noise_(std::numeric_limits<double>::quiet_NaN()),
      change_per_rad_(kFlank / narrowest_rad_) {
  constexpr auto kCells = static_cast<std::size_t>(kSide_px) * static_cast<std::size_t>(kSide_px);
  for (Picture& picture : pictures_) {
    picture.light.grid.reserve(kSide_px, kSide_px);
    picture.light.cover.reserve(kSide_px, kSide_px);
  }
  cells_.reserve(kCells);
  spots_.reserve(kCells);
}

FarLight::Kept FarLight::seen_in(const Snapshot& snapshot) noexcept {
  Kept seen;
  seen.any = true;
  seen.toward_camera = snapshot.camera.m.normalized();
  const Vector3d x = snapshot.body_from_camera.matrix.col(0);
  seen.x_axis = (x - seen.toward_camera * seen.toward_camera.dot(x)).normalized();
  seen.y_axis = seen.x_axis.cross(seen.toward_camera);
  seen.sun = snapshot.sun;
  seen.earthshine = snapshot.earthshine;
  if (snapshot.earthshine_rung.model == EarthshineModel::kCap && !snapshot.earth.dark()) {
    const EarthDisc<BodyFrame>& disc = snapshot.earth.disc();
    seen.earths_centre = disc.to_centre.unit;
    seen.earths_sun = disc.to_sun.unit;
    // Facets that see little of the vector may see much of the cap.
    seen.earthshine.irradiance_w_m2 = snapshot.earth.scalar_irradiance_w_m2();
  }
  return seen;
}

FarLight::Moved FarLight::Moved::between(const Kept& a, const Kept& b) noexcept {
  const double camera_rad = (a.toward_camera - b.toward_camera).norm();
  const double sun_rad = (a.sun.toward.unit - b.sun.toward.unit).norm();
  const double earth_rad =
      std::max({(a.earthshine.toward.unit - b.earthshine.toward.unit).norm(),
                (a.earths_centre - b.earths_centre).norm(), (a.earths_sun - b.earths_sun).norm()});
  const double all = std::max(a.irradiance_w_m2(), b.irradiance_w_m2());
  Moved moved;
  moved.turn_rad = (a.x_axis - b.x_axis).norm();
  moved.angle_rad = moved.largest_rad = camera_rad;
  if (!(all > 0.0)) return moved;
  const auto share = [&](double first, double second) { return std::max(first, second) / all; };
  const double sun = share(a.sun.irradiance_w_m2, b.sun.irradiance_w_m2);
  const double earth = share(a.earthshine.irradiance_w_m2, b.earthshine.irradiance_w_m2);
  moved.angle_rad += sun * sun_rad + earth * earth_rad;
  moved.largest_rad = std::max({camera_rad, sun * sun_rad, earth * earth_rad});
  moved.lamps = (std::abs(a.sun.irradiance_w_m2 - b.sun.irradiance_w_m2) +
                 std::abs(a.earthshine.irradiance_w_m2 - b.earthshine.irradiance_w_m2)) /
                all;
  return moved;
}

/// By directions, axes and the light's change: more than so much of what is allowed.
bool FarLight::beyond(const Kept& a, const Kept& b, double change, double part) const noexcept {
  const Moved moved = Moved::between(a, b);
  const double most_rad = std::min(kMostMove_rad, kMostTurn * narrowest_rad_);
  return moved.largest_rad > part * most_rad || moved.turn_rad > part * kAxesTurn_rad ||
         moved.angle_rad * change_per_rad_ + moved.lamps > part * change;
}

void FarLight::update(const Snapshot& snapshot, double change) noexcept {
  const Kept seen = seen_in(snapshot);
  const Kept before = shown().kept;
  const double intensity_before = intensity_w_sr();
  report_.samples = report_.hits = report_.rays = report_.rejected_rays = 0;
  report_.rays_by_kind = {};
  if (!before.any || beyond(before, seen, change, 1.0)) {
    if (making_ == shown_ || !facets_are_ours_ ||
        beyond(pictures_[making_].kept, seen, change, 1.0))
      begin(snapshot, seen);
    shown_ = making_;
    ++pictures_shown_;
    add_batch();
    show();
    learn_change(before, intensity_before);
  } else if (pictures_[making_].batches < kBatches) {
    if (!facets_are_ours_) begin(snapshot, seen);
    add_batch();
    if (making_ == shown_) {
      show();
    } else if (pictures_[making_].batches == kBatches) {
      shown_ = making_;
      ++pictures_shown_;
      show();
      learn_change(before, intensity_before);
    }
  } else if (beyond(before, seen, change, 0.5)) {
    begin(snapshot, seen);
    add_batch();
  }
}

/// In the place of the picture that is not shown.
void FarLight::begin(const Snapshot& snapshot, const Kept& seen) noexcept {
  if (shown().kept.any) making_ = 1 - shown_;
  Picture& picture = pictures_[making_];
  picture.kept = seen;
  picture.batches = 0;
  picture.from_far = snapshot;
  Snapshot& far = picture.from_far;
  far.sequence = 0;  // the same samples each time
  far.camera.m = far_m_ * seen.toward_camera;
  far.body_from_camera.matrix.col(0) = seen.x_axis;
  far.body_from_camera.matrix.col(1) = seen.y_axis;
  far.body_from_camera.matrix.col(2) = -seen.toward_camera;
  far.background_w_m2_sr = 0;
  far.image_map = {};
  facets_are_ours_ = true;  // from its first batch on
  sum_ = sum2_ = last_mean_ = 0;
}

void FarLight::add_batch() noexcept {
  Picture& picture = pictures_[making_];
  for (int i = 0; i < batches_at_once_ && picture.batches < kBatches; ++i) {
    Budget budget;
    budget.samples_done = picture.batches * samples_;
    budget.samples_per_pixel = budget.samples_done + samples_;
    const RenderReport report = paths_.render(picture.from_far, budget, picture.light);
    ++picture.batches;
    double mean = 0;
    for (const float x : picture.light.grid.pixels()) mean += static_cast<double>(x);
    note_batch(mean);
    add_up(report, report_);
  }
}

/// `mean`: of all batches of the picture in the making so far.
void FarLight::note_batch(double mean) noexcept {
  const int n = pictures_[making_].batches;
  const double own = n * mean - (n - 1) * last_mean_;
  last_mean_ = mean;
  sum_ += own;
  sum2_ += own * own;
  if (n < kBatches || !(mean > 0.0)) return;
  const double variance = std::max(0.0, sum2_ - sum_ * sum_ / n) / (n - 1);
  batch_noise_ = std::sqrt(variance) / mean;
}

double FarLight::noise_share() const noexcept {
  return batch_noise_ / std::sqrt(static_cast<double>(std::max(1, batches())));
}

void FarLight::learn_change(const Kept& kept_before, double intensity_before) noexcept {
  const Kept& kept = shown().kept;
  const Moved moved = Moved::between(kept_before, kept);
  const double before = intensity_before / std::max(kept_before.irradiance_w_m2(), 1e-300);
  const double now = intensity_w_sr() / std::max(kept.irradiance_w_m2(), 1e-300);
  if (!(kept_before.any && moved.angle_rad > 0.0 && before > 0.0 && now > 0.0)) return;
  // At the top of a glint there is no change, and beside it much: what was seen is forgotten over
  // the width of one.
  const double remembered =
      knows_change_ ? change_per_rad_ * std::exp(-0.5 * moved.angle_rad / narrowest_rad_) : 0.0;
  change_per_rad_ = std::max(
      {kLeastChangePerRad, remembered, std::abs(std::log(now / before)) / moved.angle_rad});
  knows_change_ = true;
}

void FarLight::show() noexcept {
  const Radiance& picture = shown().light;
  cells_.clear();
  spots_.clear();
  area_m2_ = 0;
  const double cell_m2 = cell_m_ * cell_m_;
  const double middle = 0.5 * kSide_px;  // the pixel that the origin is in the middle of
  for (int row = 0; row < picture.grid.height(); ++row) {
    for (int column = 0; column < picture.grid.width(); ++column) {
      const double light = static_cast<double>(picture.grid.at(column, row)) * cell_m2;
      const double area = static_cast<double>(picture.cover.at(column, row)) * cell_m2;
      if (!(area > 0.0)) continue;
      const double x = (picture.region.left + column - middle) * cell_m_;
      const double y = (picture.region.top + row - middle) * cell_m_;
      cells_.push_back({static_cast<float>(x), static_cast<float>(y), static_cast<float>(light),
                        static_cast<float>(area)});
      spots_.push_back({x, y, light});
      area_m2_ += area;
    }
  }
  parts_.cut(spots_);
}

}  // namespace engine
