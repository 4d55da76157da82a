#include "engine/optics/optics.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "engine/core/constants.h"
#include "engine/optics/pupil.h"

namespace engine {
namespace {

constexpr int kBeyondFrame_px = 64;
constexpr int kSmallestCore_px = 8;
constexpr double kCore_px = 16;  // of the paper's camera: beyond, FarWings are good for even light
constexpr int kLargestCore_px = 64;
// What FarWings know nothing of is the rings: so much of the wing's mean, and with how many
// wavelengths a band is made up, matters there too.
constexpr double kRings = 0.25;
// A smear is cut into pieces no longer than this, so that a window holds each.
constexpr double kLongestPiece_px = 32.0;
constexpr double kLongestSmear_px = 1e6;
// A cell of so much more light than is seen: a transform's rounding, 2^-24 of it, shows.
constexpr double kBright = 1e6;
constexpr int kMostBright = 256;
constexpr int kTableSteps = 4096;
// Of a defocus: a change that keeps the tables, a thousandth of what it does to the OTF.
constexpr double kSameFocus = 5e-4;

std::size_t at(int i) noexcept { return static_cast<std::size_t>(i); }

/// How wide the image of a point is against that of the paper's camera, for which the fine grid's
/// reach and the softness of FarWings are chosen; not less than 1.
double width_of_point(const OpticsSpec& spec) noexcept {
  const double f_number = spec.lens.focal_length_m / spec.lens.aperture_m;
  return std::max(1.0, middle_wavelength_m(spec) * f_number / spec.camera.pixel_pitch_m / 1.25);
}

/// How far geometry sends light astray: by defocus, by the steepest wavefront, and by what shakes.
double defocus_blur_px(const OpticsSpec& spec, double defocus_m) noexcept {
  const double f_number = spec.lens.focal_length_m / spec.lens.aperture_m;
  return 4.0 * f_number * std::abs(defocus_m) / spec.camera.pixel_pitch_m;
}
double still_blur_px(const OpticsSpec& spec) noexcept {
  const double f_number = spec.lens.focal_length_m / spec.lens.aperture_m;
  return 2.0 * f_number * Pupil(spec.lens).steepest_m() / spec.camera.pixel_pitch_m +
         (3.0 * spec.jitter_rad + spec.vibration.amplitude_rad) / spec.camera.ifov_rad();
}

/// The closed form near zero frequency, 1 - 4/pi (nu - nu^3 / 6) for a full disc, averaged over the
/// band: cones and their cubes are what has wings. A hole adds those of its rim; one so small that
/// they begin far out adds none to the cubes.
WingLaw wing_law_of(const OpticsSpec& spec) noexcept {
  constexpr double kSmallHole = 0.2;
  const double hole = spec.lens.obscuration;
  const double to_px =
      spec.lens.focal_length_m / (spec.lens.aperture_m * spec.camera.pixel_pitch_m);
  const double low = spec.lens.band_low_m * to_px;
  const double high = spec.lens.band_high_m * to_px;
  const double mean_cube = (high * high + low * low) * (high + low) / 4.0;
  const double rims = hole > kSmallHole ? (1.0 + 1.0 / hole) / (1.0 - hole * hole) : 1.0;
  // c / r^3 has the cone - 4 pi^2 c f, and c / r^5 the cube 16 pi^4 / 9 c f^3.
  return {0.5 * (low + high) / (std::pow(kPi, 3) * (1.0 - hole)),
          4.0 / kPi / 6.0 * mean_cube * rims * 9.0 / (16.0 * std::pow(kPi, 4))};
}

}  // namespace

Optics::Optics(const OpticsSpec& spec, double faint_w_m2, WorkerPool& pool)
    : spec_(spec),
      oversampling_(spec.oversampling),
      cascade_(spec),
      focused_(cascade_.focused(0.0)),
      wing_law_(wing_law_of(spec)),
      still_blur_px_(still_blur_px(spec)),
      throughput_sr_(engine::throughput_sr(spec)),
      faint_w_m2_(faint_w_m2),
      pool_(pool),
      shading_(spec),
      wings_(wing_law_, width_of_point(spec), longest_px(spec) + 2 * spec.largest_wing_px, pool),
      core_(longest_px(spec) + 2 * kLargestCore_px, spec.oversampling, pool),
      core_otf_(1.0 / spec.oversampling, spec.oversampling > 1 ? 1 : 0,
                spec.oversampling * Blur::fast_length(longest_px(spec) + 2 * kLargestCore_px)),
      least_core_px_(static_cast<int>(std::lround(kCore_px * width_of_point(spec)))),
      splat_(std::make_unique<PointSplat>(spec, cascade_, faint_w_m2, pool)),
      cell_splat_(spec, cascade_, faint_w_m2, pool,
                  {spec.oversampling > 1 ? 1.0 / spec.oversampling : 0.0, &wings_}),
      whole_table_(kTableSteps + 2),
      core_table_(kTableSteps + 2) {
  tabulate();
  const PixelRect most = spec.camera.frame().grown_by(wish().beyond_frame_px);
  net_.reserve(most.width() * oversampling_, most.height() * oversampling_);
  behind_.resize(at(most.width()) * at(most.height()));
  points_.reserve(Radiance::kMostPoints);
  bright_.reserve(at(kMostBright));
  rows_.reserve(at(most.height() * oversampling_));
}

/// Of a picture's side: light from beyond the frame, too, and a piece of smear.
int Optics::longest_px(const OpticsSpec& spec) noexcept {
  return std::max(spec.camera.width_px, spec.camera.height_px) +
         2 * std::min(kBeyondFrame_px, spec.largest_wing_px) +
         2 * static_cast<int>(kLongestPiece_px) + 8;
}

GridWish Optics::wish() const noexcept {
  return {oversampling_, std::min(kBeyondFrame_px, spec_.largest_wing_px)};
}

double Optics::noise_blur_px() const noexcept {
  constexpr int kSteps = 128;  // over a quarter of the plane; a thousandth off at 64
  const double step = cascade_.cutoff_per_px() / kSteps;
  double integral = 0;
  for (int i = 0; i < kSteps; ++i) {
    for (int k = -kSteps; k < kSteps; ++k)
      integral += 2.0 * step * step *
                  std::norm(cascade_.whole((i + 0.5) * step, (k + 0.5) * step, focused_));
  }
  return std::sqrt(1.0 / (4.0 * kPi * integral));
}

void Optics::tabulate() noexcept {
  if (!cascade_.radial()) return;
  const double step = cascade_.cutoff_per_px() / kTableSteps;
  for (int i = 0; i < kTableSteps; ++i) {
    const double otf = cascade_.at_radial(i * step, focused_);
    whole_table_[at(i)] = static_cast<float>(otf);
    core_table_[at(i)] = static_cast<float>(otf - wings_.otf(i * step));
  }
}

double Optics::star_defocus_m(double target_range_m) const noexcept {
  return cascade_.seen_defocus_m(
      spec_.defocus_m(std::numeric_limits<double>::infinity(), target_range_m));
}

/// Where the target is, if it is not where it was.
void Optics::focus(double defocus_m) noexcept {
  const double seen_m = cascade_.seen_defocus_m(defocus_m);
  // A change that nobody sees keeps the tables.
  if (std::abs(seen_m - defocus_m_) <= kSameFocus * std::abs(seen_m)) return;
  defocus_m_ = seen_m;
  cascade_.focus(seen_m, focused_);
  tabulate();
}

OpticsReport Optics::project(const Radiance& in, IrradianceImage& out) noexcept {
  ENSURE(in.oversampling == oversampling_);
  fill_background(in, out);
  const OpticsReport report = spread(in, out);
  shading_.vignette(out, pool_);
  return report;
}

/// The target's light.
OpticsReport Optics::spread(const Radiance& in, IrradianceImage& out) noexcept {
  OpticsReport report;
  if (in.region.empty()) return report;

  focus(spec_.defocus_m(in.range_m, in.range_m));
  splat_->focus(defocus_m_);
  report.defocus_m = defocus_m_;
  const RadianceImage& net = net_light(in);
  const Survey found = survey(net);
  double flux = found.sum * throughput_sr_ / (oversampling_ * oversampling_);
  for (const PointSource& p : in.points)
    flux += p.irradiance_w_m2 * splat_->pixels_per_irradiance();
  const int blur_px =
      static_cast<int>(std::ceil(still_blur_px_ + defocus_blur_px(spec_, defocus_m_)));
  const double least_px = kSmallestCore_px + blur_px;
  const int largest_px =
      wings_apart() ? spec_.largest_wing_px : std::min(spec_.largest_wing_px, kLargestCore_px);
  const double wing_px = std::ceil(std::cbrt(wing_law_.share_px * flux / faint_w_m2_));
  report.wing_px =
      static_cast<int>(std::clamp(wing_px, least_px, std::max(1.0 * largest_px, least_px)));
  report.lost_flux_share = 2.0 * kPi * wing_law_.share_px / report.wing_px;

  const ImageMotion motion{in.motion_px, in.path};
  const PixelPoint moves_px = motion.reach_px();
  // Not a number, or too thin for any detector.
  if (!(std::hypot(moves_px.u, moves_px.v) < 0.5 * kLongestSmear_px)) return report;
  const RadianceImage& whole = without_broken(net, found);
  if (wings_apart()) wings_.gather(whole, in.region, oversampling_);
  const RadianceImage& light = take_bright_cells(in, whole, found);
  points_.assign(in.points.begin(), in.points.end());
  for (PointSource& p : points_) p.motion_px = in.motion_px;
  report.points = static_cast<int>(points_.size() + bright_.size());
  const auto spread = [&](const Stroke& stroke) {
    if (found.sum > 0.0) spread_grid(light, in.region, found, blur_px, stroke, report, out);
  };
  report.segments = 0;
  if (!in.path.bends) {
    spread(straight(in.motion_px, {}, 1.0));
  } else if (std::max(moves_px.u, moves_px.v) <= kLongestPiece_px) {
    spread({motion, {}, {}, 1, 1.0});
  } else {
    for (int i = 0; i < ImagePath::kSteps; ++i)
      spread(straight(motion.step_px(i), motion.middle_of(i), 1.0 / ImagePath::kSteps));
  }
  report.segments = std::max(report.segments, 1);
  splat_->add(points_, in.path, out, report.wing_px);
  cell_splat_.add(bright_, in.path, out);
  const int margin_u = report.wing_px + static_cast<int>(std::ceil(moves_px.u));
  const int margin_v = report.wing_px + static_cast<int>(std::ceil(moves_px.v));
  const PixelRect& r = in.region;
  report.window =
      PixelRect{r.left - margin_u, r.top - margin_v, r.right + margin_u, r.bottom + margin_v}
          .clipped_to(spec_.camera.frame());
  // Of a target beside the frame that has no columns, or no rows.
  if (report.window.empty()) report.window = PixelRect{};
  return report;
}

void Optics::fill_background(const Radiance& in, IrradianceImage& out) noexcept {
  out.resize(spec_.camera.width_px, spec_.camera.height_px);
  std::ranges::fill(out.pixels(), static_cast<float>(in.uniform_w_m2_sr * throughput_sr_));
  if (in.earth.empty()) return;
  pool_.rows(0, out.height(), [&](int v) {
    in.earth.add_row(v, 0, static_cast<float>(throughput_sr_), out.row(v));
  });
}

/// What of the light there is, whatever its sign; what is no number is none.
Optics::Survey Optics::survey(const RadianceImage& light) noexcept {
  const auto limit =
      static_cast<float>(kBright * faint_w_m2_ * oversampling_ * oversampling_ / throughput_sr_);
  rows_.resize(at(light.height()));
  pool_.rows(0, light.height(), [&](int y) { rows_[at(y)] = survey_row(light.row(y), limit); });
  Survey all;
  for (const Survey& row : rows_) all.add(row);
  all.bright_limit = limit;
  return all;
}

Optics::Survey Optics::survey_row(std::span<const float> cells, float bright_limit) noexcept {
  constexpr std::size_t kSums = 16;  // side by side, for the processor has room for them
  std::array<float, kSums> most{};
  std::array<float, kSums> sum{};
  const std::size_t blocks = cells.size() / kSums * kSums;
  for (std::size_t first = 0; first < blocks; first += kSums) {
    for (std::size_t k = 0; k < kSums; ++k) {
      const float here = std::abs(cells[first + k]);
      sum[k] += here;
      most[k] = most[k] > here ? most[k] : here;
    }
  }
  Survey row;
  for (std::size_t k = 0; k < kSums; ++k) {
    row.sum += static_cast<double>(sum[k]);
    row.most = std::max(row.most, most[k]);
  }
  for (const float cell : cells.subspan(blocks)) {
    row.sum += static_cast<double>(std::abs(cell));
    row.most = std::max(row.most, std::abs(cell));
  }
  row.most_dim = row.most;
  // Mostly that is all. What is no number has shown in the sum.
  if (std::isfinite(row.sum) && row.most <= bright_limit) return row;
  row = {};
  for (const float cell : cells) {
    const float here = std::abs(cell);
    if (!std::isfinite(here)) {
      ++row.broken;
      continue;
    }
    row.sum += static_cast<double>(here);
    row.most = std::max(row.most, here);
    if (here > bright_limit) {
      ++row.bright;
    } else {
      row.most_dim = std::max(row.most_dim, here);
    }
  }
  return row;
}

/// The grid less what it hides of the Earth.
const RadianceImage& Optics::net_light(const Radiance& in) noexcept {
  if (in.earth.empty()) return in.grid;
  ENSURE(in.cover.pixels().size() == in.grid.pixels().size());
  net_.resize(in.grid.width(), in.grid.height());
  const std::size_t width = at(in.region.width());
  pool_.rows(0, in.region.height(), [&](int v) {
    const auto behind = std::span(behind_).subspan(at(v) * width, width);
    std::ranges::fill(behind, static_cast<float>(in.uniform_w_m2_sr));
    in.earth.add_row(in.region.top + v, in.region.left, 1.0F, behind);
    for (int y = v * oversampling_; y < (v + 1) * oversampling_; ++y) {
      const auto cells = in.grid.row(y);
      const auto cover = in.cover.row(y);
      const auto net = net_.row(y);
      for (std::size_t i = 0; i < net.size(); ++i)
        net[i] = cells[i] - cover[i] * behind[i / at(oversampling_)];
    }
  });
  return net_;
}

/// Of the light, in a place where it can be changed.
RadianceImage& Optics::own(const RadianceImage& light) noexcept {
  if (&light != &net_) {
    net_.resize(light.width(), light.height());
    std::ranges::copy(light.pixels(), net_.pixels().begin());
  }
  return net_;
}

/// What is no number made dark: one cell's would spread over the whole transform.
const RadianceImage& Optics::without_broken(const RadianceImage& light,
                                            const Survey& found) noexcept {
  if (found.broken == 0) return light;
  for (float& cell : own(light).pixels()) cell = std::isfinite(cell) ? cell : 0.0F;
  return net_;
}

/// Makes points of cells so bright that the rounding of their transform would be seen; of too many
/// none, for then what they light up is as bright; nor out of focus, where their light is thin; nor
/// on the paper's grid, whose faults they would not have.
/// Their wings are FarWings' business.
const RadianceImage& Optics::take_bright_cells(const Radiance& in, const RadianceImage& light,
                                               const Survey& found) noexcept {
  bright_.clear();
  if (found.bright == 0 || found.bright > kMostBright || defocus_m_ != 0.0 || !wings_apart() ||
      oversampling_ == 1)
    return light;
  own(light);
  const double cell_px = 1.0 / oversampling_;
  const double cell_sr = std::pow(spec_.camera.ifov_rad() * cell_px, 2);
  for (int y = 0; y < net_.height(); ++y) {
    for (int x = 0; x < net_.width(); ++x) {
      float& cell = net_.at(x, y);
      if (std::abs(cell) <= found.bright_limit) continue;
      bright_.push_back(
          {{in.region.left + (x + 0.5) * cell_px - 0.5, in.region.top + (y + 0.5) * cell_px - 0.5},
           static_cast<double>(cell) * cell_sr,
           in.motion_px});
      cell = 0.0F;
    }
  }
  return net_;
}

Optics::Stroke Optics::straight(PixelPoint line_px, PixelPoint middle_px, double share) noexcept {
  const double length_px = std::hypot(line_px.u, line_px.v);
  const int pieces = static_cast<int>(std::max(std::ceil(length_px / kLongestPiece_px), 1.0));
  return {{{line_px.u / pieces, line_px.v / pieces}, {}}, line_px, middle_px, pieces, share};
}

/// Up to where the fine grid follows light when FarWings do the rest, which have no rings:
/// `brightest` is the largest radiance, seen as far as two pixels about it.
int Optics::core_margin(double brightest, int blur_px, int reach_px) const noexcept {
  const double light = 4.0 * brightest * throughput_sr_;
  const double rings_px = std::cbrt(kRings * wing_law_.share_px * light / faint_w_m2_);
  const double least_px = std::min(least_core_px_ + 2 * blur_px, kLargestCore_px);
  const double px = wings_apart() ? std::ceil(rings_px) : reach_px;
  return std::min(reach_px, static_cast<int>(std::clamp(px, least_px, 1.0 * kLargestCore_px)));
}

void Optics::spread_grid(const RadianceImage& light, const PixelRect& region, const Survey& found,
                         int blur_px, const Stroke& stroke, OpticsReport& report,
                         IrradianceImage& out) noexcept {
  const float brightest = bright_.empty() ? found.most : found.most_dim;
  report.core_px = core_margin(static_cast<double>(brightest), blur_px, report.wing_px);
  const bool with_wings = wings_apart() && (report.core_px < report.wing_px || !bright_.empty());
  const PixelPoint moves_px = stroke.motion.reach_px();
  const int margin_u = report.core_px + static_cast<int>(std::ceil(moves_px.u));
  const int margin_v = report.core_px + static_cast<int>(std::ceil(moves_px.v));
  const int width_px = Blur::fast_length(region.width() + 2 * margin_u);
  const int height_px = Blur::fast_length(region.height() + 2 * margin_v);
  const PixelRect grid_px{region.left - margin_u, region.top - margin_v,
                          region.left - margin_u + width_px, region.top - margin_v + height_px};
  // The middle cell of a pixel is its centre, and what is sampled: the first of the region lies so
  // much before. Of an even number it is the one before the centre; add_core() moves by the rest.
  const int lead = (oversampling_ - 1) / 2;
  const Blur::Grid grid{width_px * oversampling_, height_px * oversampling_,
                        margin_u * oversampling_ - lead, margin_v * oversampling_ - lead};
  if (cascade_.radial()) {
    const auto& table = with_wings ? core_table_ : whole_table_;
    core_otf_.prepare(RadialOtf{table, kTableSteps / cascade_.cutoff_per_px()}, grid.height,
                      stroke.motion);
  } else {
    core_otf_.prepare(DirectedOtf{cascade_, focused_, with_wings ? wings_.table() : RadialOtf{}},
                      grid.height, stroke.motion);
  }
  const bool once = stroke.pieces == 1;
  if (!once) core_.transform(light, grid, core_otf_);
  const auto sample = [&](double move_x, double move_y) {
    if (once) {
      core_.transform_and_sample(light, grid, core_otf_, move_x, move_y);
    } else {
      core_.sample(move_x, move_y);
    }
  };
  if (with_wings) wings_.transform(report.wing_px, stroke.motion);
  report.segments += stroke.pieces;
  for (int i = 0; i < stroke.pieces; ++i) {
    const double share = stroke.share / stroke.pieces;
    add_core(grid_px, stroke.centre_px(i), share, sample, out);
    if (with_wings) wings_.add(stroke.centre_px(i), throughput_sr_ * share, out);
  }
}

/// What sample(move_x, move_y) makes of the light, in cells.
template <class Sample>
void Optics::add_core(const PixelRect& grid_px, PixelPoint move_px, double share,
                      const Sample& sample, IrradianceImage& out) noexcept {
  // Whole pixels move by moving the window, the rest by turning the waves.
  const double whole_u = std::round(move_px.u);
  const double whole_v = std::round(move_px.v);
  const int left = grid_px.left + static_cast<int>(whole_u);
  const int top = grid_px.top + static_cast<int>(whole_v);
  const PixelRect seen =
      PixelRect{left, top, left + grid_px.width(), top + grid_px.height()}.clipped_to(
          spec_.camera.frame());
  if (seen.empty()) return;
  const double to_centre = oversampling_ % 2 == 0 ? 0.5 : 0.0;
  sample(oversampling_ * (move_px.u - whole_u) - to_centre,
         oversampling_ * (move_px.v - whole_v) - to_centre);
  const auto scale = static_cast<float>(throughput_sr_ * core_.scale() * share);
  pool_.rows(seen.top, seen.bottom, [&](int v) {
    const auto from = core_.row(v - top).subspan(at(seen.left - left));
    const auto to = out.row(v).subspan(at(seen.left), at(seen.width()));
    for (std::size_t i = 0; i < to.size(); ++i) to[i] += scale * from[i];
  });
}

}  // namespace engine
