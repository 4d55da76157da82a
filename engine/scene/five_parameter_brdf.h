#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "engine/core/vec.h"
#include "engine/scene/half_vector_lobe.h"

namespace engine {

/// The five parameters of eq 7 of Li et al. 2023, table 3.
struct FiveParameters {
  double ar = 0.557;
  double br = -261.6;
  double kb = 15.42;
  double kd = 0.047;
  double kr = 0.717;
  [[nodiscard]] bool operator==(const FiveParameters&) const = default;
};

/// What the specular term of eq 7 asks of two directions, both above the horizon, in a frame whose
/// z is the normal: kb fresnel_like exp(br x^ar) masking / cosines.
struct FacetGeometry {
  double cos_alpha = 1;
  double x = 0;  ///< 1 - cos gamma
  double masking = 1;
  double cosines = 1;  ///< cos_i cos_r

  FacetGeometry(const Eigen::Vector3d& in, const Eigen::Vector3d& out) noexcept;
  [[nodiscard]] double fresnel_like(double kr) const noexcept;
};

/// Five-parameter model, eq 7 of Li et al. 2023. All vectors are unit, in a frame whose z is the
/// normal. We differ from the print:
///  - alpha and gamma are exchanged: gamma = angle(n, h) and alpha = angle(i, h), where h is the
///    half vector. As printed both of its materials send the light back to its source.
///  - `physical` (default): the diffuse term is the constant kd, a Lambert surface of albedo pi kd,
///    and the specular term is scaled, alike for both directions, so that the two together never
///    send back more than came in. Reciprocal. The printed kd/cos_i passes albedo 1 at 76 deg.
///  - `paper` keeps the printed terms, clamped so that the albedo stays 1 at most.
///  - `wrinkle_rad` > 0 blurs the lobe by the normals of a crinkled foil, normally distributed with
///    this rms in each direction: a goniometer's sample lies flat, a blanket on a spacecraft does
///    not. Our own assumption; neither the shape nor any rms is measured. The lobe keeps its
///    integral; polyimide's albedo changes by 1 % at 3 deg of wrinkles, at 15 deg by -7 % in near
///    normal light and +11 % at 80 deg.
/// A Lambert surface is kb = 0. Leaves out colour and polarisation.
///
/// Thread: any. Loop-safe but for the constructor, which takes a tenth of a second.
class FiveParameterBrdf {
 public:
  enum class Variant : std::uint8_t { kPhysical, kPaper };

  FiveParameterBrdf(const FiveParameters& parameters, Variant variant, double wrinkle_rad);

  /// 1/sr; 0 below the horizon. Finite everywhere.
  [[nodiscard]] double eval(const Eigen::Vector3d& in, const Eigen::Vector3d& out) const noexcept;
  /// Eq 7 with alpha and gamma exchanged and nothing else changed, but for wrinkles.
  [[nodiscard]] double as_printed(const Eigen::Vector3d& in,
                                  const Eigen::Vector3d& out) const noexcept;

  /// The share of light from `cos_in` that goes anywhere at all.
  [[nodiscard]] double albedo(double cos_in) const noexcept;
  /// The same of as_printed(), and of this variant before it is limited: above 1 where that makes
  /// light.
  [[nodiscard]] double albedo_as_printed(double cos_in) const noexcept;
  [[nodiscard]] double albedo_before_limit(double cos_in) const noexcept;
  /// Of the albedo, the part that goes everywhere alike; of the printed variant, in normal light.
  [[nodiscard]] double diffuse_albedo() const noexcept;
  /// Of the specular lobe, in angles of the half vector: where it has fallen to a half; 0 without
  /// one.
  [[nodiscard]] double lobe_half_width_rad() const noexcept { return lobe_half_width_rad_; }

  /// Of the draws, how many should go by the lobe: in [0, 1].
  [[nodiscard]] double lobe_share(const Eigen::Vector3d& out) const noexcept;
  [[nodiscard]] const HalfVectorLobe& lobe_sampler() const noexcept { return lobe_sampler_; }

  [[nodiscard]] const FiveParameters& parameters() const noexcept { return p_; }
  [[nodiscard]] Variant variant() const noexcept { return variant_; }

 private:
  static constexpr int kAngles = 128;
  static constexpr int kLobeSteps = 2048;

  [[nodiscard]] double specular(const Eigen::Vector3d& in,
                                const Eigen::Vector3d& out) const noexcept;
  [[nodiscard]] double lobe(double one_minus_cos) const noexcept;
  [[nodiscard]] double printed_lobe(double one_minus_cos) const noexcept;
  [[nodiscard]] double specular_limit(double cos_in) const noexcept;
  [[nodiscard]] double specular_albedo(double cos_in) const noexcept;
  void blur_lobe(double wrinkle_rad);
  void tabulate_lobe();
  void tabulate_albedo();

  FiveParameters p_;
  Variant variant_;
  double lobe_half_width_rad_ = 0;
  std::vector<float> blurred_lobe_;  ///< by sqrt(1 - cos gamma), 0 to 1; empty without wrinkles
  HalfVectorLobe lobe_sampler_;      ///< none without a lobe
  std::array<float, kAngles> specular_albedo_{};  ///< by the cosine: cell centres
};

}  // namespace engine
