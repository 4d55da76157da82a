#include "engine/render/bounced_light.h"

#include <algorithm>
#include <array>
#include <string_view>

#include "engine/core/constants.h"

namespace engine {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Eigen::Vector3f;

BouncedLight::BouncedLight(const TracedTarget& target, const BounceRules& rules)
    : target_(target), rules_(rules) {
  rules_.bounces = std::clamp(rules_.bounces, 0, kMostBounces);
}

bool BouncedLight::go_on(Path& path) const noexcept {
  if (!may_go_on(path)) return false;
  const Matrix3d local = basis_round(path.from.normal.cast<double>());
  const auto choice = path.numbers.pair(pair_of(path, kChoice));
  const Brdf::Sample next = target_.facets.brdf(path.from.material)
                                .sample(local * -path.direction.cast<double>(), rules_.sampler,
                                        path.numbers.pair(pair_of(path, kDirection)), choice[0]);
  if (!(next.weight > 0.0)) return false;
  path.weight *= static_cast<float>(next.weight);
  if (path.bounces > 0) {
    const float chance = std::min(1.0F, path.weight);
    if (choice[1] >= chance) return false;
    path.weight /= chance;
  }
  path.direction = (local.transpose() * next.in).cast<float>();
  path.density = static_cast<float>(next.density);
  return true;
}

double BouncedLight::escaped(const LampCones& lamps, const Path& path) const noexcept {
  const Vector3d direction = path.direction.cast<double>();
  const auto met = static_cast<double>(path.density);
  double light_w_m2_sr = 0;
  const LampCone& sun = lamps[0];
  // Where the path began the lamps' light is Facets', and where it may be longest nobody runs into
  // the Sun.
  if (rules_.exact_caustics && !sun.parallel() && path.sun_chance > 0.0F && !longest(path)) {
    const double asked = static_cast<double>(path.sun_chance) * sun.density(direction);
    if (asked > 0.0) light_w_m2_sr = sun.radiance_w_m2_sr() * met / (met + asked);
  }
  if (lamps.earth != nullptr && path.earth_asked > 0.0F) {
    const double asked = static_cast<double>(path.earth_asked) * lamps.earth->pdf(direction);
    if (asked > 0.0)
      light_w_m2_sr += lamps.earth->radiance_w_m2_sr(direction) * met / (met + asked);
  }
  return static_cast<double>(path.weight) * light_w_m2_sr;
}

double BouncedLight::earthshine(const EarthLight::Sample& sample, const SurfacePoint& place,
                                const Vector3f& direction, double asked) const noexcept {
  if (!(sample.radiance_w_m2_sr > 0.0)) return 0.0;
  const Brdf& brdf = target_.facets.brdf(place.material);
  const Matrix3d local = basis_round(place.normal.cast<double>());
  const Vector3d in = local * sample.direction;
  if (!(in.z() > 0.0)) return 0.0;
  const Vector3d out = local * -direction.cast<double>();
  const double met = brdf.pdf(in, out, rules_.sampler);
  return sample.radiance_w_m2_sr * in.z() * brdf.eval(in, out) * asked / (asked * sample.pdf + met);
}

/// From where the path is, in the share of cases that are not the Sun's.
BouncedLight::Question BouncedLight::ask_earth(const EarthLight& earth, Path& path,
                                               const std::array<float, 2>& numbers) const noexcept {
  const EarthLight::Sample sample =
      earth.sample(static_cast<double>(numbers[0]), static_cast<double>(numbers[1]));
  const Vector3f toward = sample.direction.cast<float>();
  const double chance = 1.0 - static_cast<double>(path.sun_chance);
  if (rules_.exact_caustics) {
    return {toward, earthshine(sample, path.from, path.direction, chance) / chance *
                        static_cast<double>(path.weight)};
  }
  const double cos_in = path.from.normal.cast<double>().dot(sample.direction);
  if (!(cos_in > 0.0) || !(sample.pdf > 0.0)) return {};
  const double evenly = target_.facets.brdf(path.from.material).albedo(cos_in) / kPi;
  return {toward, sample.radiance_w_m2_sr * cos_in * evenly / (sample.pdf * chance) *
                      static_cast<double>(path.weight)};
}

BouncedLight::Question BouncedLight::arrive(const LampCones& lamps, Path& path,
                                            const SurfacePoint& place) const noexcept {
  path.from = place;
  const Brdf& brdf = target_.facets.brdf(place.material);
  const Vector3d normal = place.normal.cast<double>();
  std::array<double, kLamps> light{};
  for (std::size_t k = 0; k < kLamps; ++k) {
    const double cos_in = normal.dot(lamps[k].axis());
    if (cos_in > 0.0) light[k] = lamps[k].irradiance_w_m2() * cos_in * brdf.albedo(cos_in) / kPi;
  }
  if (lamps.earth != nullptr) {
    // What the Earth sends at most, in round numbers: more than nothing wherever it can be seen.
    const double most_w_m2 = lamps.earth->irradiance_w_m2(normal) +
                             EarthLight::kHarmonicsError * lamps.earth->scalar_irradiance_w_m2();
    light[1] = most_w_m2 * brdf.albedo(0.5) / kPi;
  }
  const double both = light[0] + light[1];
  path.sun_chance = both > 0.0 ? static_cast<float>(light[0] / both) : 0.0F;
  path.earth_asked =
      rules_.exact_caustics && lamps.earth != nullptr ? 1.0F - path.sun_chance : 0.0F;
  const std::uint32_t lamp_pair = pair_of(path, kLamp);
  const std::uint32_t disc_pair = pair_of(path, kDisc);
  ++path.bounces;
  if (!(both > 0.0)) return {};
  const std::size_t lamp = path.numbers.pair(lamp_pair)[0] < path.sun_chance ? 0 : 1;
  if (lamp == 1 && lamps.earth != nullptr)
    return ask_earth(*lamps.earth, path, path.numbers.pair(disc_pair));
  const LampCone& cone = lamps[lamp];
  const Vector3d toward = cone.parallel()
                              ? cone.axis()
                              : Vector3d(cone.sample(path.numbers.pair(disc_pair)).cast<double>());
  if (!rules_.exact_caustics)
    return {toward.cast<float>(), both * static_cast<double>(path.weight)};

  const Matrix3d local = basis_round(normal);
  const Vector3d in = local * toward;
  if (!(in.z() > 0.0)) return {};
  const Vector3d out = local * -path.direction.cast<double>();
  double value = cone.irradiance_w_m2() * in.z() * brdf.eval(in, out) * both / light[lamp];
  // The last place of a path asks, and nobody runs into the lamp from there.
  if (!cone.parallel() && !longest(path)) {
    const double asked = static_cast<double>(path.sun_chance) * cone.density(cone.axis());
    value *= asked / (asked + brdf.pdf(in, out, rules_.sampler));
  }
  return {toward.cast<float>(), value * static_cast<double>(path.weight)};
}

double BouncedLight::radiance(const LampCones& lamps, const SurfacePoint& from,
                              const Vector3f& direction, const SampleNumbers& numbers,
                              RayCounts& counts) const noexcept {
  Path path{from, direction, numbers};
  double radiance = 0;
  while (go_on(path)) {
    const MeshHit hit = target_.scene.intersect(path.from.start(), path.direction, counts);
    if (hit.triangle == MeshHit::kNone) return radiance + escaped(lamps, path);
    if (longest(path)) return radiance;
    const Question question = arrive(lamps, path, target_.facets.at(hit, path.direction));
    if (question.light_w_m2_sr > 0.0 &&
        !target_.scene.occluded(path.from.start(), question.toward, counts))
      radiance += question.light_w_m2_sr;
  }
  return radiance;
}

Rung bounces_rung(int bounces, double left_out_e) noexcept {
  static constexpr std::array<std::string_view, BouncedLight::kMostBounces + 1> kNames = {
      "0", "1", "2", "3", "4", "5", "6", "7", "8", "9", "10", "11", "12", "13", "14", "15", "16"};
  return {"bounces", kNames[static_cast<std::size_t>(bounces)], left_out_e};
}

}  // namespace engine
