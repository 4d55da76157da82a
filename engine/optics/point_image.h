#pragma once

#include <Eigen/Core>

#include <complex>
#include <functional>

namespace engine {

/// The image of a point of light on an even lattice of places about it.
struct PointImageSpec {
  double cutoff_per_px = 0;  ///< the OTF is 0 from there on
  int half_places = 0;       ///< on either side of the point, along each axis
  double step_px = 0;
};

/// Shares of a point's light by displacement: [v][u], the middle at no displacement. The sum over
/// all waves of a period of 128 px: 80 px from a neighbour 8e-8 of its light is left.
/// Slow: for tables at set-up.
/// Of an OTF that is real and the same for either sign of either frequency:
[[nodiscard]] Eigen::MatrixXd even_point_image(const PointImageSpec& spec,
                                               const std::function<double(double, double)>& otf);
/// Of any OTF that belongs to an image: its value at -f is conjugate to that at f.
[[nodiscard]] Eigen::MatrixXd point_image(
    const PointImageSpec& spec, const std::function<std::complex<double>(double, double)>& otf);

}  // namespace engine
