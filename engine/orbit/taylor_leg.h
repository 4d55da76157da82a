#pragma once

#include <array>
#include <cmath>
#include <cstddef>

#include <Eigen/Core>

namespace engine {

/// A step of a Taylor integration (Jorba & Zou 2005, Experimental Mathematics 14): what was
/// integrated, as a polynomial of the time since the step's origin.
template <int Dimension, std::size_t Order>
class TaylorLeg {
 public:
  using Vector = Eigen::Matrix<double, Dimension, 1>;

  /// A value and how fast it changes.
  struct Motion {
    Vector value;
    Vector rate;
  };

  TaylorLeg() = default;
  /// Pre: the first term is not zero, and is no smaller than what one wants to know.
  explicit TaylorLeg(const std::array<Vector, Order + 1>& terms) noexcept : terms_(terms) {
    // Their last two are nothing then.
    constexpr double kNothing = 1e-17;
    reach_s_ = HUGE_VAL;
    for (const std::size_t k : {Order - 1, Order})
      reach_s_ = std::fmin(reach_s_, std::pow(kNothing * terms[0].norm() / terms[k].norm(),
                                              1.0 / static_cast<double>(k)));
  }

  /// How far to both sides it is exact to the rounding.
  [[nodiscard]] double reach_s() const noexcept { return reach_s_; }

  [[nodiscard]] Motion at(double t_s) const noexcept {
    Motion out{terms_[Order], Vector::Zero()};
    for (std::size_t k = Order; k-- > 0;) {
      out.rate = out.rate * t_s + out.value;
      out.value = out.value * t_s + terms_[k];
    }
    return out;
  }

 private:
  std::array<Vector, Order + 1> terms_;
  double reach_s_ = 0;
};

}  // namespace engine
