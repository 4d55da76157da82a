#pragma once

#include <Eigen/Core>

#include <cmath>

#include "engine/core/constants.h"
#include "engine/optics/mtf.h"
#include "engine/optics/optics_spec.h"
#include "engine/optics/otf_cascade.h"
#include "engine/scene/point_source.h"

namespace test_support {

/// What pixels get of a point of light: the sum over all waves of the OTF times the pixel's square,
/// in double precision, at the point's own place; nothing tabulated, nothing interpolated.
class ExactSpread {
 public:
  /// Images repeat after so many pixels: at half of that a neighbour's wing has 3e-9 of the light.
  static constexpr int kPeriod_px = 512;

  explicit ExactSpread(const engine::OpticsSpec& spec, double defocus_m = 0.0) {
    const engine::OtfCascade cascade(spec);
    const auto focused = cascade.focused(defocus_m);
    const int waves = static_cast<int>(cascade.cutoff_per_px() * kPeriod_px) + 1;
    otf_.resize(waves, waves);
    for (int k = 0; k < waves; ++k)
      for (int j = 0; j < waves; ++j)
        otf_(k, j) = cascade.at_radial(std::hypot(wave(k), wave(j)), focused) *
                     engine::sinc(wave(k)) * engine::sinc(wave(j));
  }

  /// Shares of a point's light in the pixels from `left`, `top` on; `smear`: as it moves.
  [[nodiscard]] Eigen::MatrixXd image(const engine::PixelPoint& place, int left, int top,
                                      int columns, int rows,
                                      const engine::PixelPoint& smear = {}) const {
    const auto waves = static_cast<int>(otf_.rows());
    Eigen::MatrixXd even = otf_;
    Eigen::MatrixXd odd = Eigen::MatrixXd::Zero(waves, waves);
    if (smear.u != 0.0 || smear.v != 0.0) {
      for (int k = 0; k < waves; ++k) {
        for (int j = 0; j < waves; ++j) {
          const double plus = engine::sinc(wave(k) * smear.v + wave(j) * smear.u);
          const double minus = engine::sinc(wave(k) * smear.v - wave(j) * smear.u);
          even(k, j) *= 0.5 * (plus + minus);
          odd(k, j) = 0.5 * otf_(k, j) * (minus - plus);
        }
      }
    }
    const auto [cos_v, sin_v] = waves_at(top - place.v, rows);
    const auto [cos_u, sin_u] = waves_at(left - place.u, columns);
    return cos_v * even * cos_u.transpose() + sin_v * odd * sin_u.transpose();
  }

 private:
  static double wave(int k) { return static_cast<double>(k) / kPeriod_px; }  // cycles per pixel
  [[nodiscard]] std::pair<Eigen::MatrixXd, Eigen::MatrixXd> waves_at(double first,
                                                                     int places) const {
    Eigen::MatrixXd cosines(places, otf_.rows());
    Eigen::MatrixXd sines(places, otf_.rows());
    for (int k = 0; k < otf_.rows(); ++k) {
      const double share = (k == 0 ? 1.0 : 2.0) / kPeriod_px;
      for (int i = 0; i < places; ++i) {
        const double turns = 2.0 * engine::kPi * wave(k) * (first + i);
        cosines(i, k) = share * std::cos(turns);
        sines(i, k) = share * std::sin(turns);
      }
    }
    return {cosines, sines};
  }

  Eigen::MatrixXd otf_;
};

}  // namespace test_support
