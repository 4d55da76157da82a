#pragma once

#include <array>
#include <cmath>
#include <random>
#include <string>
#include <utility>

#include "engine/core/constants.h"
#include "engine/core/random.h"
#include "engine/scene/brdf.h"
#include "tests/support/scenes.h"

/// Surfaces of both materials, directions, and draws: what tests of the BRDF begin with.
namespace test_support {

[[nodiscard]] inline engine::FiveParameters parameters(const std::string& material) {
  return material == "silicon" ? silicon() : polyimide();
}
inline const std::array<std::string, 2> kMaterials{"silicon", "polyimide"};

/// One object for each surface: its tables take a third of a second.
[[nodiscard]] inline const engine::Brdf& brdf_of(const std::string& material,
                                                 engine::Brdf::Variant variant) {
  using engine::Brdf;
  using Variant = Brdf::Variant;
  static const std::array<Brdf, 4> all{
      Brdf(silicon(), Variant::kPhysical), Brdf(silicon(), Variant::kPaper),
      Brdf(polyimide(), Variant::kPhysical), Brdf(polyimide(), Variant::kPaper)};
  return all[(material == "silicon" ? 0U : 2U) + (variant == Variant::kPaper ? 1U : 0U)];
}

[[nodiscard]] inline Eigen::Vector3d tilted(double from_normal_deg, double azimuth_deg = 0.0) {
  const double t = from_normal_deg * engine::kDegree;
  const double a = azimuth_deg * engine::kDegree;
  return {std::sin(t) * std::cos(a), std::sin(t) * std::sin(a), std::cos(t)};
}

[[nodiscard]] inline Eigen::Vector3d random_direction(std::mt19937_64& random) {
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  const double z = unit(random);
  const double a = 2.0 * engine::kPi * unit(random);
  const double r = std::sqrt(1.0 - z * z);
  return {r * std::cos(a), r * std::sin(a), z};
}

[[nodiscard]] inline engine::Brdf::Sample drawn(
    const engine::Brdf& brdf, const Eigen::Vector3d& out, engine::Draws& draws,
    engine::BrdfSampler how = engine::BrdfSampler::kMixture) {
  const float u = draws.uniform();
  const float v = draws.uniform();
  return brdf.sample(out, how, {u, v}, draws.uniform());
}

/// What one direction scatters to, or gathers from, all others by the specular term alone: over
/// half vectors h, dw = 4 (v.h) dw_h, steps fine where the lobe has its cusp.
template <class Term>
[[nodiscard]] double over_half_vectors(const Eigen::Vector3d& v, const Term& term) {
  constexpr int kSteps = 3000;
  constexpr int kTurns = 96;
  double sum = 0;
  for (int i = 0; i < kSteps; ++i) {
    const double low = std::pow(static_cast<double>(i) / kSteps, 4.0);
    const double high = std::pow((i + 1.0) / kSteps, 4.0);
    const double x = 0.5 * (low + high);  // 1 - cos of the angle between h and the normal
    const double sin_h = std::sqrt(x * (2.0 - x));
    for (int k = 0; k < kTurns; ++k) {
      const double azimuth = 2.0 * engine::kPi * (k + 0.5) / kTurns;
      const Eigen::Vector3d h(sin_h * std::cos(azimuth), sin_h * std::sin(azimuth), 1.0 - x);
      const double vh = v.dot(h);
      const Eigen::Vector3d w = 2.0 * vh * h - v;
      if (vh <= 0.0 || w.z() <= 1e-6) continue;
      sum += term(w) * 4.0 * vh * (high - low) * 2.0 * engine::kPi / kTurns;
    }
  }
  return sum;
}

}  // namespace test_support
