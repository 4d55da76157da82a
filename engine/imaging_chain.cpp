#include "engine/imaging_chain.h"

#include <algorithm>
#include <cmath>

namespace engine {
namespace {

struct LightSums {
  double sum = 0;
  double sum_u = 0;
  double sum_v = 0;
  double peak = 0;
  void add(double light, int u, int v) noexcept {
    sum += light;
    sum_u += light * u;
    sum_v += light * v;
    peak = std::max(peak, light);
  }
};

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

}  // namespace

ImagingChain::ImagingChain(const SnapshotBuilder& scene, std::unique_ptr<Renderer> renderer,
                           Optics optics, const Detector& detector,
                           const DetectorSpec& detector_spec, const CameraGeometry& camera,
                           Stopwatch stopwatch, std::unique_ptr<Starlight> stars)
    : scene_(scene),
      renderer_(std::move(renderer)),
      optics_(std::move(optics)),
      detector_(detector),
      detector_spec_(detector_spec),
      stopwatch_(stopwatch),
      stars_(std::move(stars)),
      irradiance_(camera.width_px, camera.height_px),
      electrons_(camera.width_px, camera.height_px) {
  const GridWish wish = optics_.wish();
  const PixelRect most = camera.frame().grown_by(wish.beyond_frame_px);
  radiance_.grid.reserve(most.width() * wish.oversampling, most.height() * wish.oversampling);
  radiance_.cover.reserve(most.width() * wish.oversampling, most.height() * wish.oversampling);
}

FrameReport ImagingChain::expose(const Shot& shot, Budget budget, DnImage& out,
                                 TruthMask& mask) noexcept {
  FrameReport report;
  const Duration start = now();
  const Snapshot snapshot = scene_.build(shot);
  const Duration built = now();
  report.render = renderer_->render(snapshot, budget, radiance_);
  const Duration rendered = now();
  report.optics = optics_.project(radiance_, irradiance_);
  measure_light(report.optics.window, shot.exposure, report.truth, mask);
  // What was measured is the target's light: the stars come after.
  if (stars_ != nullptr)
    report.stars = stars_->add(snapshot, radiance_,
                               radiance_.uniform_w_m2_sr * optics_.throughput_sr(), irradiance_);
  const Duration projected = now();
  detector_.expose(irradiance_, shot.exposure, snapshot.seed, shot.sequence, electrons_);
  detector_.digitize(electrons_, snapshot.seed, shot.sequence, out);
  report.times = {built - start, rendered - built, projected - rendered, now() - projected};

  FrameTruth& truth = report.truth;
  truth.range_m = snapshot.range_m;
  truth.range_rate_m_s = snapshot.range_rate_m_s;
  truth.line_of_sight_rate_rad_s = snapshot.line_of_sight_rate_rad_s;
  truth.phase_angle_rad = snapshot.phase_angle_rad;
  truth.target_px = snapshot.target_px;
  truth.smear_px = std::hypot(snapshot.smear_px.u, snapshot.smear_px.v);
  truth.visible_fraction = report.render.visible_fraction;
  truth.sun_irradiance_w_m2 = snapshot.sun.irradiance_w_m2;
  truth.earthshine_w_m2 = snapshot.earthshine.irradiance_w_m2;
  truth.earth_behind = snapshot.earth_behind;
  truth.roll_is_fallback = snapshot.roll_is_fallback;
  const auto pixels = out.pixels();
  report.peak_dn = *std::max_element(pixels.begin(), pixels.end());
  return report;
}

void ImagingChain::measure_light(const PixelRect& window, Duration exposure, FrameTruth& truth,
                                 TruthMask& mask) const noexcept {
  mask.clear();
  const double to_e = detector_spec_.electrons_per_irradiance(exposure);
  const double background = radiance_.uniform_w_m2_sr * optics_.throughput_sr();
  const double noise_e =
      detector_spec_.noise_e(background * to_e + detector_spec_.dark_e_s * seconds(exposure));
  const double faint = noise_e / to_e;
  LightSums all;
  double in_mask = 0;
  for (int v = window.top; v < window.bottom; ++v) {
    const auto row = irradiance_.row(v);
    int begin = -1;  // of the run that we are in
    for (int u = window.left; u < window.right; ++u) {
      const double light = static_cast<double>(row[static_cast<std::size_t>(u)]) - background;
      all.add(light, u, v);
      if (light > faint) {
        in_mask += light;
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
  if (all.sum * to_e > 1.0) truth.photocentre_px = {all.sum_u / all.sum, all.sum_v / all.sum};
  if (truth.mask_px == 0) return;
  const double signal_e = in_mask * to_e;
  truth.signal_to_noise = signal_e / std::sqrt(signal_e + truth.mask_px * noise_e * noise_e);
}

}  // namespace engine
