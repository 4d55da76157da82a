#include "engine/render/bounced_light.h"

#include "engine/core/constants.h"

namespace engine {

using Eigen::Matrix3d;
using Eigen::Vector3d;

double BouncedLight::radiance(const Snapshot& snapshot, SurfacePoint from, Vector3d direction,
                              Draws& draws, RayCounts& counts) const noexcept {
  double radiance = 0;
  double throughput = 1;
  Matrix3d local = basis_round(from.normal.cast<double>());
  Vector3d out = local * -direction;
  for (int bounce = 1;; ++bounce) {
    const Brdf::Sample next = target_.facets.brdf(from.material).sample(out, draws);
    if (!(next.weight > 0.0)) break;
    throughput *= next.weight;
    direction = local.transpose() * next.in;
    const MeshHit hit = target_.scene.intersect(from.start(), direction.cast<float>(), counts);
    if (hit.triangle == MeshHit::kNone) break;
    from = target_.facets.at(hit, direction.cast<float>());
    radiance += throughput * scattered(snapshot, from, draws, counts);
    if (bounce == bounces_) break;
    local = basis_round(from.normal.cast<double>());
    out = local * -direction;
  }
  return radiance;
}

double BouncedLight::scattered(const Snapshot& snapshot, const SurfacePoint& at, Draws& draws,
                               RayCounts& counts) const noexcept {
  const auto lamps = lamps_of(snapshot);
  const Vector3d normal = at.normal.cast<double>();
  std::array<double, kLamps> light{};
  for (std::size_t k = 0; k < kLamps; ++k) {
    const double cos_in = normal.dot(lamps[k]->toward.unit);
    if (cos_in <= 0.0) continue;
    light[k] =
        lamps[k]->irradiance_w_m2 * cos_in * target_.facets.brdf(at.material).albedo(cos_in) / kPi;
  }
  const double both = light[0] + light[1];
  if (!(both > 0.0)) return 0.0;
  const std::size_t lamp = static_cast<double>(draws.uniform()) * both < light[0] ? 0 : 1;
  const bool hidden =
      target_.scene.occluded(at.start(), lamps[lamp]->toward.unit.cast<float>(), counts);
  return hidden ? 0.0 : both;
}

}  // namespace engine
