#include "engine/render/bounce_depth.h"

#include <algorithm>
#include <cmath>

#include "engine/render/bounced_light.h"

namespace engine {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr int kRays = 16384;  // the share is known to .004

/// Even on the sphere.
Vector3d direction_of(const std::array<float, 2>& numbers) noexcept {
  const double z = 1.0 - 2.0 * static_cast<double>(numbers[0]);
  const double radius = std::sqrt(std::max(0.0, 1.0 - z * z));
  const double turn = 2.0 * kPi * static_cast<double>(numbers[1]);
  return {radius * std::cos(turn), radius * std::sin(turn), z};
}

double albedo_for_even_light(const Brdf& brdf) noexcept {
  constexpr int kSteps = 64;
  double sum = 0;
  for (int i = 0; i < kSteps; ++i) {
    const double cos_in = (i + 0.5) / kSteps;
    sum += 2.0 * brdf.albedo(cos_in) * cos_in / kSteps;
  }
  return sum;
}

}  // namespace

SelfVisibility self_visibility(const TracedTarget& target) {
  SelfVisibility seen;
  for (std::uint32_t m = 0; m < target.mesh.material_names.size(); ++m)
    seen.largest_albedo =
        std::max(seen.largest_albedo, albedo_for_even_light(target.facets.brdf(m)));
  RayCounts counts;
  int places = 0;
  int met = 0;
  for (std::uint32_t i = 0; i < kRays; ++i) {
    const SampleNumbers numbers(SequenceKind::kSobol, 1, i);
    const Matrix3d axes = basis_round(direction_of(numbers.pair(0)));
    // A parallel beam as wide as the target.
    const auto across = numbers.pair(1);
    const double radius = target.bounding_radius_m * std::sqrt(static_cast<double>(across[0]));
    const double turn = 2.0 * kPi * static_cast<double>(across[1]);
    const Vector3d start =
        axes.transpose() *
        Vector3d(radius * std::cos(turn), radius * std::sin(turn), 1.2 * target.bounding_radius_m);
    const Eigen::Vector3f along = -axes.row(2).transpose().cast<float>();
    const MeshHit hit = target.scene.intersect(start.cast<float>(), along, counts);
    if (hit.triangle == MeshHit::kNone) continue;
    ++places;
    const SurfacePoint place = target.facets.at(hit, along);
    const auto leaves = numbers.pair(2);
    const double sine = std::sqrt(static_cast<double>(leaves[0]));
    const double azimuth = 2.0 * kPi * static_cast<double>(leaves[1]);
    const Vector3d toward = basis_round(place.normal.cast<double>()).transpose() *
                            Vector3d(sine * std::cos(azimuth), sine * std::sin(azimuth),
                                     std::sqrt(1.0 - static_cast<double>(leaves[0])));
    met += target.scene.occluded(place.start(), toward.cast<float>(), counts) ? 1 : 0;
  }
  seen.share = places > 0 ? static_cast<double>(met) / places : 0.0;
  return seen;
}

double left_out_e(const SelfVisibility& seen, int bounces, double signal_e) noexcept {
  const double each = seen.largest_albedo * seen.share;
  return signal_e * std::pow(each, bounces + 1) / (1.0 - std::min(each, 0.999));
}

RenderSpec with_bounces_settled(const RenderSpec& spec, const TracedTarget& target) {
  RenderSpec settled = spec;
  const SensorNoise& noise = spec.noise;
  if (!(noise.e_per_radiance > 0.0)) return settled;
  const SelfVisibility seen = self_visibility(target);
  const double signal_e = noise.full_well_e;
  const double limit_e = spec.profile.rho_total * noise.sigma_e(signal_e);
  if (spec.bounces_by_need) {
    settled.bounces = 0;
    while (settled.bounces < BouncedLight::kMostBounces &&
           signal_e * std::pow(seen.largest_albedo * seen.share, settled.bounces + 1) > limit_e)
      ++settled.bounces;
  }
  settled.bounces_left_out_e = left_out_e(seen, settled.bounces, signal_e);
  return settled;
}

}  // namespace engine
