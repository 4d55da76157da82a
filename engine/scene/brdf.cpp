#include "engine/scene/brdf.h"

#include <cmath>

#include "engine/core/constants.h"
#include "engine/scene/surface_frame.h"

namespace engine {

using Eigen::Vector3d;

namespace {

// theta_1 = 15 deg of eq 13, as 1 - cos.
constexpr double kPaperCone = 0.034074173710931713;

}  // namespace

double Brdf::lobe_share(const Vector3d& out) const noexcept {
  return ask([&](const auto& model) { return model.lobe_share(out); });
}

const HalfVectorLobe& Brdf::lobe_sampler() const noexcept {
  return *ask([](const auto& model) { return &model.lobe_sampler(); });
}

double Brdf::pdf(const Vector3d& in, const Vector3d& out, BrdfSampler how) const noexcept {
  if (in.z() <= kGrazing || out.z() <= kGrazing) return 0.0;
  if (how == BrdfSampler::kCosine) return in.z() / kPi;
  if (how == BrdfSampler::kUniform) return 0.5 / kPi;
  if (how == BrdfSampler::kPaperCone)
    return one_minus_cos(in, mirrored(out)) <= kPaperCone ? 0.5 / (kPi * kPaperCone) : 0.0;
  const double share = lobe_share(out);
  double density = (1.0 - share) * in.z() / kPi;
  if (share > 0.0) {
    const Vector3d h = (in + out).normalized();
    const double ih = in.dot(h);
    const double x = one_minus_cos(h, Vector3d::UnitZ());
    density += share / lobe_sampler().inverse_density_sr(x) / (4.0 * ih);
  }
  return density;
}

Brdf::Sample Brdf::sample(const Vector3d& out, BrdfSampler how,
                          const std::array<float, 2>& direction, float choice) const noexcept {
  const auto u = static_cast<double>(direction[0]);
  const double azimuth = 2.0 * kPi * static_cast<double>(direction[1]);
  const auto round_z = [&](double z) {
    const double radius = std::sqrt((1.0 - z) * (1.0 + z));
    return Vector3d(radius * std::cos(azimuth), radius * std::sin(azimuth), z);
  };
  Sample s;
  if (how == BrdfSampler::kUniform) {
    s.in = round_z(u);
  } else if (how == BrdfSampler::kPaperCone) {
    const Vector3d mirror = mirrored(out);
    const Vector3d x = mirror.unitOrthogonal();
    const Vector3d in_cone = round_z(1.0 - u * kPaperCone);
    s.in = in_cone.x() * x + in_cone.y() * mirror.cross(x) + in_cone.z() * mirror;
  } else if (how == BrdfSampler::kMixture && static_cast<double>(choice) < lobe_share(out)) {
    const Vector3d h = lobe_sampler().draw(u, azimuth);
    s.in = 2.0 * out.dot(h) * h - out;
  } else {
    s.in = round_z(std::sqrt(1.0 - u));
  }
  s.density = pdf(s.in, out, how);
  if (s.density > 0.0) s.weight = eval(s.in, out) * s.in.z() / s.density;
  return s;
}

}  // namespace engine
