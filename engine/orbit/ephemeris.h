#pragma once

#include <optional>
#include <vector>

#include "engine/orbit/oem.h"

namespace engine {

/// A body on a path that someone else computed, interpolated: by the polynomial through the rows
/// about a time, as each segment of the file asks. Newton's divided differences (Stoer & Bulirsch
/// 2002, section 2.1.5); a row counts twice where its velocity counts, too.
/// Error: interpolation_error_m(), and what the file's maker knew of the body.
class EphemerisPropagator final : public Propagator {
 public:
  /// Pre: as read_oem() leaves them.
  explicit EphemerisPropagator(std::vector<OemSegment> segments);

  /// Where no segment is to be used the body stands still at the end of the last one before:
  /// never asked there by who has asked gap_in().
  [[nodiscard]] OrbitState at(Epoch t) const noexcept override;
  /// From the first time that may be used to the last; there may be gaps in it.
  [[nodiscard]] EpochSpan span() const noexcept override;
  [[nodiscard]] double speed_bound_m_s() const noexcept override { return fastest_m_s_; }

  /// The first part of `wanted` for which the file has nothing.
  [[nodiscard]] std::optional<EpochSpan> gap_in(const EpochSpan& wanted) const noexcept;
  /// The largest miss when each row is left out and interpolated from the others: between the rows,
  /// which are half as far apart, the error is a few thousandths of it at degree 7.
  [[nodiscard]] double interpolation_error_m() const noexcept { return worst_m_; }

 private:
  void measure(const OemSegment& segment);

  std::vector<OemSegment> segments_;
  double worst_m_ = 0;
  double fastest_m_s_ = 0;
};

}  // namespace engine
