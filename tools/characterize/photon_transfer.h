#pragma once

#include <cstddef>
#include <vector>

#include "tools/characterize/line_fit.h"

namespace characterize {

/// The variance of rounding to whole numbers.
inline constexpr double kQuantisingVariance_dn2 = 1.0 / 12.0;
/// A temporal variance below this is dominated by the quantiser, and tells of the noise only that
/// it is less (EMVA 1288 release 4, section 6.7).
inline constexpr double kLeastVariance_dn2 = 0.24;

/// From here on a quantiser adds kQuantisingVariance_dn2 wherever between two DN the mean lies, to
/// 4 exp(-2 pi^2 variance), a few thousandths of a per cent.
inline constexpr double kEvenVariance_dn2 = 0.5;

/// What the frames at one level of light say, the exposure time being the same at all.
struct LightLevel {
  double irradiance_w_m2 = 0;  ///< on the detector
  double photons = 0;          ///< that fall on a pixel over the exposure
  Quantity mean_dn;
  Quantity variance_dn2;  ///< temporal
  Quantity spatial_variance_dn2;
};

/// EMVA 1288 release 4, linear model, sections 6 and 7: gain, responsivity, saturation, linearity.
///
/// We differ in two things: lines are fitted from 5 % of saturation on, not from 0, and with an
/// intercept, so that a dark image cut off at 0 DN, or a quantiser that rounds down, tips no line.
/// Levels whose variance the quantiser distorts have no part in the gain.
struct PhotonTransfer {
  static constexpr double kFitFrom = 0.05;  ///< of the signal at saturation
  static constexpr double kFitTo = 0.70;
  static constexpr double kLinearTo = 0.95;

  std::size_t saturation = 0;  ///< the level whose temporal variance is the largest
  Line transfer;               ///< temporal variance in DN^2 against mean in DN
  Line response;               ///< mean in DN against photons
  Quantity quantum_efficiency;
  Quantity saturation_photons;
  Quantity saturation_e;
  /// Of the mean from the line that relative deviations are least from, between kFitFrom and
  /// kLinearTo: the mean of their sizes.
  Quantity linearity_error;
  std::vector<double> deviation;  ///< of each level, relative; not a number outside that range

  [[nodiscard]] Quantity gain_dn_e() const noexcept { return transfer.slope; }
  [[nodiscard]] Quantity gain_e_dn() const noexcept { return ratio_of({1.0, 0.0}, gain_dn_e()); }
};

/// Levels in order of light, the first of them dark. Throws std::runtime_error when no line can be
/// fitted: too few levels, noise that the quantiser hides, none at saturation, or light that makes
/// no signal.
[[nodiscard]] PhotonTransfer photon_transfer(const std::vector<LightLevel>& levels);

/// rms of the noise in electrons that does not come from quantising. Pre: the variance is
/// kLeastVariance_dn2 or more.
[[nodiscard]] Quantity noise_e(const Quantity& variance_dn2, const Quantity& gain_dn_e) noexcept;

/// The photons at which the signal is as large as the noise (section 6.7).
[[nodiscard]] Quantity sensitivity_threshold(const Quantity& dark_variance_dn2,
                                             const Quantity& gain_dn_e,
                                             const Quantity& quantum_efficiency) noexcept;

}  // namespace characterize
