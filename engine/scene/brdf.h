#pragma once

#include <array>
#include <cstdint>
#include <utility>
#include <variant>

#include "engine/core/vec.h"
#include "engine/scene/five_parameter_brdf.h"
#include "engine/scene/tabulated_brdf.h"

namespace engine {

/// How directions of bounces are drawn.
enum class BrdfSampler : std::uint8_t {
  kMixture,   ///< cosine and lobe, weighed against each other: finds all light, with least noise
  kCosine,    ///< even in projected solid angle
  kUniform,   ///< even over the hemisphere
  kPaperCone  ///< eq 13-14 of the paper: 15 deg round the mirror direction, and nothing else
};

/// How a surface scatters light, whatever model says so. All vectors are unit, in a frame whose z
/// is the normal.
///
/// Thread: any. Loop-safe but for the constructors.
class Brdf {
 private:
  template <class Question>
  auto ask(const Question& question) const noexcept {
    if (const auto* table = std::get_if<TabulatedBrdf>(&model_)) return question(*table);
    return question(*std::get_if<FiveParameterBrdf>(&model_));
  }

 public:
  using Variant = FiveParameterBrdf::Variant;

  Brdf(const FiveParameters& parameters, Variant variant, double wrinkle_rad = 0)
      : model_(std::in_place_type<FiveParameterBrdf>, parameters, variant, wrinkle_rad) {}
  explicit Brdf(TabulatedBrdf table) : model_(std::move(table)) {}

  /// 1/sr; 0 below the horizon. Finite everywhere.
  [[nodiscard]] double eval(const Eigen::Vector3d& in, const Eigen::Vector3d& out) const noexcept {
    return ask([&](const auto& model) { return model.eval(in, out); });
  }
  /// The share of light from `cos_in` that goes anywhere at all.
  [[nodiscard]] double albedo(double cos_in) const noexcept {
    return ask([&](const auto& model) { return model.albedo(cos_in); });
  }
  /// Of that, the part that goes everywhere alike; of the printed variant, in normal light.
  [[nodiscard]] double diffuse_albedo() const noexcept {
    return ask([](const auto& model) { return model.diffuse_albedo(); });
  }
  /// Of the specular lobe, in angles of the half vector: where it has fallen to a half; 0 without
  /// one.
  [[nodiscard]] double lobe_half_width_rad() const noexcept {
    return ask([](const auto& model) { return model.lobe_half_width_rad(); });
  }

  struct Sample {
    Eigen::Vector3d in = Eigen::Vector3d::UnitZ();
    double weight = 0;   ///< eval * cos_in / density; 0 ends the path
    double density = 0;  ///< per steradian of `in`
  };
  /// A direction from which light may come that leaves along `out`. The numbers are even in (0, 1):
  /// two of the direction, and `choice` between the parts of the mixture.
  [[nodiscard]] Sample sample(const Eigen::Vector3d& out, BrdfSampler how,
                              const std::array<float, 2>& direction, float choice) const noexcept;
  /// Of `sample`, per steradian of `in`.
  [[nodiscard]] double pdf(const Eigen::Vector3d& in, const Eigen::Vector3d& out,
                           BrdfSampler how = BrdfSampler::kMixture) const noexcept;

  /// The model; the other one's is null.
  [[nodiscard]] const FiveParameterBrdf* five_parameters() const noexcept {
    return std::get_if<FiveParameterBrdf>(&model_);
  }
  [[nodiscard]] const TabulatedBrdf* table() const noexcept {
    return std::get_if<TabulatedBrdf>(&model_);
  }

 private:
  [[nodiscard]] double lobe_share(const Eigen::Vector3d& out) const noexcept;
  [[nodiscard]] const HalfVectorLobe& lobe_sampler() const noexcept;

  std::variant<FiveParameterBrdf, TabulatedBrdf> model_;
};

}  // namespace engine
