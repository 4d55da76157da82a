#include "engine/scene/star_light.h"

#include <algorithm>
#include <cmath>

#include "engine/core/constants.h"

namespace engine {
namespace {

constexpr double kFirstColour = -0.5;
constexpr double kColourStep = 0.02;
constexpr double kFluxAtZero_w_m2_nm = 3.631e-11;

/// V from 470 to 700 nm in steps of 10; Bessell 1990.
constexpr std::array<double, 24> kV{0.000, 0.030, 0.163, 0.458, 0.780, 0.967, 1.000, 0.973,
                                    0.898, 0.792, 0.684, 0.574, 0.461, 0.359, 0.270, 0.197,
                                    0.135, 0.081, 0.045, 0.025, 0.017, 0.013, 0.009, 0.000};

/// Planck's law a nanometre, up to a factor that is the same for all of one temperature.
double black_body(double wavelength_nm, double temperature_k) noexcept {
  constexpr double kSecondRadiation_nm_k = 1.438776877e7;
  const double l = wavelength_nm / 550.0;
  return 1.0 /
         (std::pow(l, 5) * std::expm1(kSecondRadiation_nm_k / (wavelength_nm * temperature_k)));
}

}  // namespace

double colour_temperature_k(double colour_b_v) noexcept {
  const double c = std::clamp(colour_b_v, kFirstColour, 6.0);
  return 4600.0 * (1.0 / (0.92 * c + 1.7) + 1.0 / (0.92 * c + 0.62));
}

BandLight band_light_at_zero(double colour_b_v) noexcept {
  const double t_k = colour_temperature_k(colour_b_v);
  double in_v = 0;
  double weight_v = 0;
  for (std::size_t i = 0; i < kV.size(); ++i) {
    in_v += kV[i] * black_body(470.0 + 10.0 * static_cast<double>(i), t_k);
    weight_v += kV[i];
  }
  const double scale_w_m2_nm = kFluxAtZero_w_m2_nm * weight_v / in_v;

  // Simpson's rule: steps of 10 nm leave 1e-6.
  constexpr int kIntervals = 40;
  constexpr double kStep_nm = 10.0;
  BandLight light;
  for (int i = 0; i <= kIntervals; ++i) {
    const double share = (i == 0 || i == kIntervals ? 1.0 : (i % 2 == 1 ? 4.0 : 2.0)) / 3.0;
    const double wavelength_nm = 450.0 + kStep_nm * i;
    const double w_m2 = share * kStep_nm * scale_w_m2_nm * black_body(wavelength_nm, t_k);
    light.irradiance_w_m2 += w_m2;
    light.photons_m2_s += w_m2 * wavelength_nm * 1e-9 / (kPlanck_j_s * kSpeedOfLight_m_s);
  }
  return light;
}

StarLight::StarLight(double detector_mean_wavelength_m) {
  const double photon_j = kPlanck_j_s * kSpeedOfLight_m_s / detector_mean_wavelength_m;
  for (std::size_t i = 0; i < at_zero_w_m2_.size(); ++i) {
    const double colour = kFirstColour + kColourStep * static_cast<double>(i);
    at_zero_w_m2_[i] = photon_j * band_light_at_zero(colour).photons_m2_s;
  }
}

double StarLight::irradiance_w_m2(double v_magnitude, double colour_b_v) const noexcept {
  const double place = std::clamp((colour_b_v - kFirstColour) / kColourStep, 0.0, 1.0 * kSteps);
  const auto low = std::min(static_cast<std::size_t>(place), at_zero_w_m2_.size() - 2);
  const double part = place - static_cast<double>(low);
  const double at_zero = (1.0 - part) * at_zero_w_m2_[low] + part * at_zero_w_m2_[low + 1];
  return at_zero * std::pow(10.0, -0.4 * v_magnitude);
}

}  // namespace engine
