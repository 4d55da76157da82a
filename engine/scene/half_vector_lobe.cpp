#include "engine/scene/half_vector_lobe.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "engine/core/constants.h"

namespace engine {

HalfVectorLobe::HalfVectorLobe(const std::function<double(double)>& lobe) {
  // On a grid that is fine at the cusp; then its distribution is inverted at even steps.
  constexpr int kFine = 16384;
  std::vector<double> sum(kFine + 1, 0.0);
  const auto x_at = [](int i) { return std::pow(static_cast<double>(i) / kFine, 4.0); };
  for (int i = 1; i <= kFine; ++i) {
    const double middle = 0.5 * (x_at(i - 1) + x_at(i));
    sum[static_cast<std::size_t>(i)] =
        sum[static_cast<std::size_t>(i - 1)] + lobe(middle) * (x_at(i) - x_at(i - 1));
  }
  int i = 0;
  for (int cell = 0; cell <= kCells; ++cell) {
    const double want = sum.back() * cell / kCells;
    while (i < kFine && sum[static_cast<std::size_t>(i)] < want) ++i;
    edges_[static_cast<std::size_t>(cell)] = static_cast<float>(x_at(cell == kCells ? kFine : i));
  }
  // Two edges on one fine point would make a cell without width.
  for (std::size_t cell = 1; cell < edges_.size(); ++cell)
    edges_[cell] = std::max(edges_[cell], std::nextafter(edges_[cell - 1], 2.0F));
}

Eigen::Vector3d HalfVectorLobe::draw(double u, double azimuth) const noexcept {
  const double cell = u * kCells;
  const auto low = std::min(static_cast<std::size_t>(cell), static_cast<std::size_t>(kCells - 1));
  const double x = edges_[low] + (cell - static_cast<double>(low)) *
                                     (static_cast<double>(edges_[low + 1]) - edges_[low]);
  const double sin_h = std::sqrt(x * (2.0 - x));
  return {sin_h * std::cos(azimuth), sin_h * std::sin(azimuth), 1.0 - x};
}

double HalfVectorLobe::inverse_density_sr(double x) const noexcept {
  const auto edge = std::upper_bound(edges_.begin() + 1, edges_.end() - 1, static_cast<float>(x));
  const double width = static_cast<double>(*edge) - *(edge - 1);
  return kCells * width * 2.0 * kPi;
}

HalfVectorLobe::Cell HalfVectorLobe::cell(std::size_t i) const noexcept {
  const double width = static_cast<double>(edges_[i + 1]) - edges_[i];
  return {edges_[i] + 0.5 * width, width};
}

}  // namespace engine
