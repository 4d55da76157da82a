#pragma once

#include <cmath>

namespace corners {

/// The largest of some errors. One that is no number is worse than any.
class Worst {
 public:
  void add(double error) noexcept {
    if (std::isnan(error) || error > worst_) worst_ = error;
  }
  [[nodiscard]] double value() const noexcept { return worst_; }

 private:
  double worst_ = 0;
};

}  // namespace corners
