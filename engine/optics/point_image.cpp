#include "engine/optics/point_image.h"

#include <cmath>

#include "engine/core/constants.h"

namespace engine {
namespace {

constexpr int kPeriod_px = 128;

int waves_of(const PointImageSpec& spec) noexcept {
  return static_cast<int>(spec.cutoff_per_px * kPeriod_px) + 1;
}

/// Twice for all waves but the first: for those of the other sign.
double share_of(int wave) noexcept { return (wave == 0 ? 1.0 : 2.0) / kPeriod_px; }

}  // namespace

Eigen::MatrixXd even_point_image(const PointImageSpec& spec,
                                 const std::function<double(double, double)>& otf) {
  const int waves = waves_of(spec);
  const int half = spec.half_places;
  Eigen::MatrixXd cosines(half + 1, waves);
  Eigen::MatrixXd values(waves, waves);
  for (int k = 0; k < waves; ++k) {
    const double f = static_cast<double>(k) / kPeriod_px;
    for (int i = 0; i <= half; ++i)
      cosines(i, k) = share_of(k) * std::cos(2.0 * kPi * f * i * spec.step_px);
    for (int j = 0; j < waves; ++j) values(k, j) = otf(static_cast<double>(j) / kPeriod_px, f);
  }
  const Eigen::MatrixXd quarter = cosines * values * cosines.transpose();
  Eigen::MatrixXd image(2 * half + 1, 2 * half + 1);
  for (int v = -half; v <= half; ++v)
    for (int u = -half; u <= half; ++u)
      image(v + half, u + half) = quarter(std::abs(v), std::abs(u));
  return image;
}

Eigen::MatrixXd point_image(const PointImageSpec& spec,
                            const std::function<std::complex<double>(double, double)>& otf) {
  const int waves = waves_of(spec);
  const int half = spec.half_places;
  const int places = 2 * half + 1;
  Eigen::MatrixXcd across(waves, places);        // waves along u, from 0 on
  Eigen::MatrixXcd down(places, 2 * waves - 1);  // along v, of either sign
  Eigen::MatrixXcd values(2 * waves - 1, waves);
  const auto turned = [&](double f, int i) {
    return std::polar(1.0, 2.0 * kPi * f * (i - half) * spec.step_px);
  };
  for (int k = 0; k < waves; ++k) {
    const double fu = static_cast<double>(k) / kPeriod_px;
    for (int i = 0; i < places; ++i) across(k, i) = share_of(k) * turned(fu, i);
    for (int j = 0; j < 2 * waves - 1; ++j)
      values(j, k) = otf(fu, static_cast<double>(j - waves + 1) / kPeriod_px);
  }
  for (int j = 0; j < 2 * waves - 1; ++j)
    for (int i = 0; i < places; ++i)
      down(i, j) = turned(static_cast<double>(j - waves + 1) / kPeriod_px, i) / double{kPeriod_px};
  return (down * (values * across)).real();
}

}  // namespace engine
