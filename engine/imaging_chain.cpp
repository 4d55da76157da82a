#include "engine/imaging_chain.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <utility>

namespace engine {
namespace {

struct LightSums {
  double sum = 0;
  double sum_u = 0;
  double sum_v = 0;
  double peak = 0;
};

/// Adds a row of light, `background` taken off it pixel by pixel; returns the most in a pixel,
/// either way. Eight sums side by side, for the processor has room for them.
double add_row(std::span<const float> row, std::span<const float> background, int left, int v,
               LightSums& sums) noexcept {
  constexpr std::size_t kSums = 8;
  std::array<double, kSums> sum{};
  std::array<double, kSums> sum_u{};
  std::array<double, kSums> most{};
  for (std::size_t first = 0; first < row.size(); first += kSums) {
    const std::size_t count = std::min(kSums, row.size() - first);
    for (std::size_t k = 0; k < count; ++k) {
      const std::size_t i = first + k;
      const double light = static_cast<double>(row[i]) - static_cast<double>(background[i]);
      sum[k] += light;
      sum_u[k] += light * static_cast<double>(i);
      most[k] = std::max(most[k], std::abs(light));
    }
  }
  double all = 0;
  double all_u = 0;
  double peak = 0;
  for (std::size_t k = 0; k < kSums; ++k) {
    all += sum[k];
    all_u += sum_u[k];
    peak = std::max(peak, most[k]);
  }
  sums.sum += all;
  sums.sum_u += all_u + all * left;
  sums.sum_v += all * v;
  sums.peak = std::max(sums.peak, peak);
  return peak;
}

FieldLight find_brightest(const IrradianceImage& image) noexcept {
  constexpr std::size_t kLanes = 16;  // side by side, for the processor has room for them
  FieldLight found;
  float most = 0.0F;
  for (int v = 0; v < image.height(); ++v) {
    const auto row = image.row(v);
    std::array<float, kLanes> best{};
    std::size_t u = 0;
    for (; u + kLanes <= row.size(); u += kLanes)
      for (std::size_t k = 0; k < kLanes; ++k) best[k] = std::max(best[k], row[u + k]);
    for (; u < row.size(); ++u) best[0] = std::max(best[0], row[u]);
    const float here = *std::ranges::max_element(best);
    if (!(here > most)) continue;
    most = here;
    const auto place = std::ranges::find(row, here) - row.begin();
    found.brightest_px = {static_cast<double>(place), 1.0 * v};
  }
  found.brightest_w_m2 = static_cast<double>(most);
  return found;
}

/// A run is a rectangle one row high; rows come from the top.
void add_run(const PixelRect& run, FrameTruth& truth, TruthMask& mask) noexcept {
  mask.add({static_cast<std::uint16_t>(run.top), static_cast<std::uint16_t>(run.left),
            static_cast<std::uint16_t>(run.right)});
  truth.mask_px += run.width();
  PixelRect& box = truth.box;
  box = box.empty() ? run
                    : PixelRect{std::min(box.left, run.left), box.top,
                                std::max(box.right, run.right), run.bottom};
}

void tell_parts(const Snapshot& snapshot, FrameTruth& truth) noexcept {
  truth.parts = snapshot.parts;
  for (std::size_t i = 0; i < snapshot.parts; ++i) {
    const PartView& view = snapshot.part[i];
    truth.part[i] = {view.angle_rad, view.second_angle_rad, view.at_limit};
  }
}

void tell_companions(const Snapshot& snapshot, const RenderReport& render,
                     FrameTruth& truth) noexcept {
  truth.companions = snapshot.companions;
  for (std::size_t i = 0; i < snapshot.companions; ++i) {
    const CompanionView& view = snapshot.companion[i];
    truth.companion[i] = {.range_m = view.range_m,
                          .phase_angle_rad = view.phase_angle_rad,
                          .target_px = view.target_px,
                          .smear_px = std::hypot(view.smear_px.u, view.smear_px.v),
                          .visible_fraction = render.visible_fraction_of_companion[i],
                          .sun_irradiance_w_m2 = view.sun.irradiance_w_m2};
  }
}

}  // namespace

ImagingChain::ImagingChain(const SnapshotBuilder& scene, std::unique_ptr<Renderer> renderer,
                           Optics optics, Detector detector, const DetectorSpec& detector_spec,
                           const CameraGeometry& camera, Stopwatch stopwatch,
                           std::unique_ptr<Starlight> stars)
    : scene_(scene),
      renderer_(std::move(renderer)),
      optics_(std::move(optics)),
      detector_(std::move(detector)),
      detector_spec_(detector_spec),
      stopwatch_(stopwatch),
      stars_(std::move(stars)),
      irradiance_(camera.width_px, camera.height_px),
      electrons_(camera.width_px, camera.height_px),
      ifov_rad_(camera.ifov_rad()),
      behind_w_m2_(static_cast<std::size_t>(camera.width_px)) {
  const GridWish wish = optics_.wish();
  const PixelRect most = camera.frame().grown_by(wish.beyond_frame_px);
  radiance_.grid.reserve(most.width() * wish.oversampling, most.height() * wish.oversampling);
  radiance_.cover.reserve(most.width() * wish.oversampling, most.height() * wish.oversampling);
  if (scene_.companions() > 0) {
    radiance_.targets_grid.reserve(most.width() * wish.oversampling,
                                   most.height() * wish.oversampling);
    radiance_.targets_cover.reserve(most.width() * wish.oversampling,
                                    most.height() * wish.oversampling);
  }
  radiance_.points.reserve(Radiance::kMostPoints);
  radiance_.earth.reserve(camera, wish.beyond_frame_px);
}

FrameReport ImagingChain::expose(const Shot& shot, Budget budget, DnImage& out,
                                 TruthMask& mask) noexcept {
  FrameReport report;
  const Duration start = now();
  const Snapshot snapshot = scene_.build(shot);
  const Duration built = now();
  radiance_.earth.draw(snapshot.earth_in_frame, snapshot.background_w_m2_sr);
  report.render = renderer_->render(snapshot, budget, radiance_);
  radiance_.range_m = snapshot.range_m;
  radiance_.path = snapshot.path;
  const Duration rendered = now();
  const bool mixed = radiance_.companions_in_sight;
  if (mixed) measure_past_companions(shot.exposure, report.truth, mask);
  report.optics = optics_.project(radiance_, irradiance_);
  if (!mixed) measure_light(report.optics.window, shot.exposure, report.truth, mask);
  // What was measured is the target's light: the stars come after.
  if (stars_ != nullptr)
    report.stars =
        stars_->add(snapshot, radiance_, radiance_.uniform_w_m2_sr * optics_.throughput_sr(),
                    optics_.star_defocus_m(snapshot.range_m), optics_.shading(), irradiance_);
  const double glare_w_m2 = optics_.veil(irradiance_);
  report.light = find_brightest(irradiance_);
  report.light.sky_w_m2 = radiance_.uniform_w_m2_sr * optics_.throughput_sr() + glare_w_m2;
  const Duration projected = now();
  report.detector =
      detector_.expose(irradiance_, shot.exposure, snapshot.seed, shot.sequence, electrons_);
  detector_.digitize(electrons_, snapshot.seed, shot.sequence, out);
  report.times = {built - start, rendered - built, projected - rendered, now() - projected};

  FrameTruth& truth = report.truth;
  truth.range_m = snapshot.range_m;
  truth.range_rate_m_s = snapshot.range_rate_m_s;
  truth.line_of_sight_rate_rad_s = snapshot.line_of_sight_rate_rad_s;
  truth.phase_angle_rad = snapshot.phase_angle_rad;
  truth.target_px = snapshot.target_px;
  const PixelPoint reach_px = ImageMotion{snapshot.smear_px, snapshot.path}.reach_px();
  truth.smear_px = 2.0 * std::hypot(reach_px.u, reach_px.v);
  truth.visible_fraction = report.render.visible_fraction;
  truth.sun_irradiance_w_m2 = snapshot.sun.irradiance_w_m2;
  truth.earthshine_w_m2 = snapshot.earthshine.irradiance_w_m2;
  truth.earth_behind = snapshot.earth_behind;
  truth.roll_is_fallback = snapshot.roll_is_fallback;
  truth.attitude_is_fallback = snapshot.attitude_is_fallback;
  tell_companions(snapshot, report.render, truth);
  tell_parts(snapshot, truth);
  const auto pixels = out.pixels();
  report.peak_dn = *std::max_element(pixels.begin(), pixels.end());
  return report;
}

void ImagingChain::measure_past_companions(Duration exposure, FrameTruth& truth,
                                           TruthMask& mask) noexcept {
  const auto exchange = [this] {
    std::swap(radiance_.region, radiance_.targets_region);
    std::swap(radiance_.grid, radiance_.targets_grid);
    std::swap(radiance_.cover, radiance_.targets_cover);
  };
  exchange();
  measure_light(optics_.project(radiance_, irradiance_).window, exposure, truth, mask);
  exchange();
}

void ImagingChain::measure_light(const PixelRect& window, Duration exposure, FrameTruth& truth,
                                 TruthMask& mask) noexcept {
  mask.clear();
  const double to_e = detector_spec_.electrons_per_irradiance(exposure);
  const double sky = radiance_.uniform_w_m2_sr * optics_.throughput_sr();
  const double dark_e = detector_spec_.dark_mean_e(exposure);
  const bool before_earth = !radiance_.earth.empty();
  const double sky_noise_e = detector_spec_.noise_e(sky * to_e + dark_e);
  const double least_noise_e =
      optics_.shading().vignettes() ? detector_spec_.noise_e(dark_e) : sky_noise_e;
  LightSums all;
  double in_mask = 0;
  double variance_e2 = 0;
  const auto throughput = static_cast<float>(optics_.throughput_sr());
  const bool even = !before_earth && !optics_.shading().vignettes();
  std::ranges::fill(behind_w_m2_, static_cast<float>(sky));
  for (int v = window.top; v < window.bottom; ++v) {
    const auto row = irradiance_.row(v);
    if (!even) {
      std::ranges::fill(behind_w_m2_, static_cast<float>(sky));
      radiance_.earth.add_row(v, 0, throughput, behind_w_m2_);
      optics_.shading().vignette(v, behind_w_m2_);
    }
    const auto seen = [&](const auto& whole) {
      return whole.subspan(static_cast<std::size_t>(window.left),
                           static_cast<std::size_t>(window.width()));
    };
    const double most =
        add_row(seen(row), seen(std::span<const float>(behind_w_m2_)), window.left, v, all);
    // Noise grows with the Earth's light: no pixel of this row stands out of its own.
    if (most * to_e <= least_noise_e) continue;
    int begin = -1;  // of the run that we are in
    for (int u = window.left; u < window.right; ++u) {
      const double background = static_cast<double>(behind_w_m2_[static_cast<std::size_t>(u)]);
      const double noise_e =
          even ? sky_noise_e : detector_spec_.noise_e(background * to_e + dark_e);
      const double light = static_cast<double>(row[static_cast<std::size_t>(u)]) - background;
      if (std::abs(light) * to_e > noise_e) {
        in_mask += std::abs(light);
        variance_e2 += light * to_e + noise_e * noise_e;
        if (begin < 0) begin = u;
      } else if (begin >= 0) {
        add_run({begin, v, u, v + 1}, truth, mask);
        begin = -1;
      }
    }
    if (begin >= 0) add_run({begin, v, window.right, v + 1}, truth, mask);
  }
  truth.peak_e = all.peak * to_e;
  // Less than one electron in the whole frame is no target: rounding of the transform, at most.
  if (before_earth) {
    find_own_photocentre(to_e, truth);
  } else if (all.sum * to_e > 1.0) {
    truth.photocentre_px = {all.sum_u / all.sum, all.sum_v / all.sum};
  }
  if (truth.mask_px > 0) truth.signal_to_noise = in_mask * to_e / std::sqrt(variance_e2);
}

void ImagingChain::find_own_photocentre(double e_per_irradiance, FrameTruth& truth) const noexcept {
  const PixelRect& region = radiance_.region;
  const int s = radiance_.oversampling;
  LightSums own;
  for (int v = std::max(0, region.top); v < std::min(irradiance_.height(), region.bottom); ++v) {
    for (int line = 0; line < s; ++line) {
      const auto cells = radiance_.grid.row((v - region.top) * s + line);
      double light = 0;
      double moment = 0;
      const int first = std::max(0, -region.left) * s;
      const int end = (std::min(irradiance_.width(), region.right) - region.left) * s;
      for (int i = first; i < end; ++i) {
        const double cell = static_cast<double>(cells[static_cast<std::size_t>(i)]);
        light += cell;
        moment += cell * (i + 0.5);
      }
      own.sum += light;
      own.sum_u += moment / s + light * (region.left - 0.5);
      own.sum_v += light * (v + (line + 0.5) / s - 0.5);
    }
  }
  for (const PointSource& p : radiance_.points) {
    if (p.place.u < -0.5 || p.place.u >= irradiance_.width() - 0.5 || p.place.v < -0.5 ||
        p.place.v >= irradiance_.height() - 0.5)
      continue;
    const double light = p.irradiance_w_m2 * std::pow(s / ifov_rad_, 2);
    own.sum += light;
    own.sum_u += light * p.place.u;
    own.sum_v += light * p.place.v;
  }
  const double to_e = optics_.throughput_sr() * e_per_irradiance / (s * s);
  if (own.sum * to_e > 1.0) truth.photocentre_px = {own.sum_u / own.sum, own.sum_v / own.sum};
}

}  // namespace engine
