#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "engine/core/vec.h"
#include "engine/scene/brdf_points.h"
#include "engine/scene/five_parameter_brdf.h"

namespace engine {

/// What is fitted, in the order of every list here.
enum class FitParameter : std::uint8_t { kAr, kBr, kKb, kKd, kKr };
inline constexpr std::size_t kFitParameters = 5;
inline constexpr std::array<std::string_view, kFitParameters> kFitNames{"ar", "br", "kb", "kd",
                                                                        "kr"};

struct BrdfFitSpec {
  FiveParameterBrdf::Variant variant = FiveParameterBrdf::Variant::kPhysical;
  std::array<std::optional<double>, kFitParameters> fixed;  ///< by FitParameter
};

/// The five parameters that measured points ask for, and how well they know them.
///
/// Least squares by Levenberg's and Marquardt's method (Marquardt 1963, DOI 10.1137/0111030) in the
/// logarithms of the parameters, which are all positive but br, from the best of a fixed grid of
/// starts. What is fitted is eq 7 with alpha and gamma exchanged, without wrinkles and without the
/// limit of its energy: the diffuse term is kd (physical), or kd/cos_i (paper).
/// Points that state their sigma weigh by it. Others are taken to be off by one share of the
/// model's value at each, which the fit finds: weights are worked out anew until they stand (quasi-
/// likelihood, Wedderburn 1974, DOI 10.1093/biomet/61.3.439). Logarithms of the readings would be
/// pulled down by half their variance.
/// Uncertainties are one standard deviation, from the curvature at the best fit and the scatter of
/// the points about it: chi squared over the degrees of freedom; stated sigmas are scaled up by it,
/// never down. They do not know of a surface that eq 7 cannot describe.
struct BrdfFit {
  using Correlation = Eigen::Matrix<double, kFitParameters, kFitParameters>;

  FiveParameters parameters;
  std::array<double, kFitParameters> sigma{};  ///< 0 of what was held
  Correlation correlation = Correlation::Identity();
  std::size_t points = 0;   ///< that count: not those on the horizon
  std::size_t degrees = 0;  ///< of freedom
  double reduced_chi2 = 0;  ///< without stated sigmas 1 by construction
  /// Of what points are off, as a share of the model: where it is above three stated sigmas, or of
  /// all points without them. Finite; 0 when there are none.
  double relative_rms = 0;
  bool converged = false;
  std::vector<double> model_per_sr;  ///< by point; 0 on the horizon

  [[nodiscard]] double value(FitParameter which) const noexcept;
  /// Not by these data: off by half of itself or more.
  [[nodiscard]] bool undetermined(FitParameter which) const noexcept;
};

/// What is fitted, in 1/sr. Pre: both directions above the horizon.
[[nodiscard]] double fitted_per_sr(const FiveParameters& parameters,
                                   FiveParameterBrdf::Variant variant, const Eigen::Vector3d& in,
                                   const Eigen::Vector3d& out) noexcept;

/// Throws ConfigError with the file's path for too few points or directions.
[[nodiscard]] BrdfFit fit_brdf(const BrdfPoints& points, const BrdfFitSpec& spec);

}  // namespace engine
