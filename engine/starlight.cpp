#include "engine/starlight.h"

#include <algorithm>
#include <cmath>

namespace engine {

double share_beside_target(const Radiance& in, const PointSource& star) noexcept {
  constexpr double kMostSteps = 4096;
  const int cells = in.oversampling;
  if (in.region.empty() || in.cover.width() != in.region.width() * cells ||
      in.cover.height() != in.region.height() * cells)
    return 1.0;
  // The cover is that of mid-exposure, so the star moves against it as it does against the target.
  const double motion_u = star.motion_px.u - in.motion_px.u;
  const double motion_v = star.motion_px.v - in.motion_px.v;
  const double steps =
      std::clamp(std::ceil(std::hypot(motion_u, motion_v) * cells), 1.0, kMostSteps);
  double covered = 0;
  for (double i = 0.5; i < steps; i += 1.0) {
    const double t = i / steps - 0.5;
    const double x = (star.place.u + t * motion_u - in.region.left + 0.5) * cells;
    const double y = (star.place.v + t * motion_v - in.region.top + 0.5) * cells;
    if (x >= 0.0 && y >= 0.0 && x < in.cover.width() && y < in.cover.height())
      covered += static_cast<double>(in.cover.at(static_cast<int>(x), static_cast<int>(y)));
  }
  return std::clamp(1.0 - covered / steps, 0.0, 1.0);
}

Starlight::Starlight(StarField field, PointSplat& splat, const DetectorSpec& detector)
    : field_(std::move(field)), splat_(splat), detector_(detector) {
  drawn_.reserve(std::min(field_.size(), kMostStars));
}

StarReport Starlight::add(const Snapshot& snapshot, const Radiance& in, double background_w_m2,
                          double defocus_m, const FieldShading& shading,
                          IrradianceImage& out) noexcept {
  const double to_e = detector_.electrons_per_irradiance(snapshot.exposure);
  const double dark_e = background_w_m2 * to_e + detector_.dark_mean_e(snapshot.exposure);
  const double e_per_w_m2 = splat_.pixels_per_irradiance() * to_e;
  StarLimits limits;
  limits.faint_w_m2 =
      kUnseenShareOfNoise * detector_.noise_e(dark_e) / (splat_.peak_share() * e_per_w_m2);
  limits.peak_share = splat_.peak_share();
  limits.reach_px3_per_w_m2 = splat_.reach_px3_per_w_m2();
  limits.least_reach_px = PointSplat::kLeastReach_px;
  limits.largest_reach_px = splat_.largest_reach_px();
  drawn_.clear();
  const StarsFound found = field_.find(snapshot.sky, limits, drawn_);

  StarReport report;
  for (PointSource& star : drawn_) {
    const double free = share_beside_target(in, star);
    if (free < 1.0) ++report.dimmed;
    star.irradiance_w_m2 *= free * shading.at(star.place);
  }
  splat_.focus(defocus_m);
  report.lost_flux_share = splat_.add(drawn_, snapshot.boresight_path, out).lost_flux_share;
  report.near = found.near;
  report.drawn = found.drawn;
  report.faint = found.faint;
  report.behind_earth = found.behind_earth;
  report.no_room = found.no_room;
  report.in_frame = found.in_frame;
  report.left_out_e = found.left_out_w_m2 * e_per_w_m2;
  report.left_out_peak_e = found.largest_left_out_w_m2 * e_per_w_m2 * splat_.peak_share();
  report.brightest_px = found.brightest.place;
  report.brightest_v = found.brightest_v;
  report.brightest_e = found.brightest.irradiance_w_m2 * e_per_w_m2;
  return report;
}

}  // namespace engine
