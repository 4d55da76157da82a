#include "engine/orbit/ephemeris.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace engine {
namespace {

using Eigen::Vector3d;

constexpr std::size_t kMostNodes = 2 * kHighestDegree + 2;

/// A value and how fast it changes.
struct Interpolated {
  Vector3d value;
  Vector3d rate;
};

/// Newton's polynomial through what is added to it.
class NewtonPolynomial {
 public:
  NewtonPolynomial() noexcept {
    times_.fill(0.0);
    differences_.fill(Vector3d::Zero());
    rates_.fill(Vector3d::Zero());
  }
  /// A node at a time, in seconds.
  void add(double t_s, const Vector3d& value) noexcept {
    times_[count_] = t_s;
    differences_[count_] = value;
    ++count_;
  }
  /// The same with its rate.
  void add(double t_s, const Vector3d& value, const Vector3d& rate) noexcept {
    add(t_s, value);
    rates_[count_] = rate;
    add(t_s, value);
  }
  /// Pre: called once.
  [[nodiscard]] Interpolated at(double t_s) noexcept {
    for (std::size_t order = 1; order < count_; ++order) {
      for (std::size_t i = count_ - 1; i >= order; --i) {
        const double apart_s = times_[i] - times_[i - order];
        differences_[i] = apart_s == 0.0
                              ? rates_[i]
                              : Vector3d((differences_[i] - differences_[i - 1]) / apart_s);
      }
    }
    Interpolated out{differences_[count_ - 1], Vector3d::Zero()};
    for (std::size_t i = count_ - 1; i-- > 0;) {
      out.rate = out.rate * (t_s - times_[i]) + out.value;
      out.value = out.value * (t_s - times_[i]) + differences_[i];
    }
    return out;
  }

 private:
  std::size_t count_ = 0;
  std::array<double, kMostNodes> times_;
  std::array<Vector3d, kMostNodes> differences_;
  std::array<Vector3d, kMostNodes> rates_;  ///< of a node's second entry
};

constexpr std::size_t kNone = ~std::size_t{0};

/// Of the rows from `first` on, but `without`.
OrbitState interpolate(const OemSegment& segment, std::size_t first, std::size_t without,
                       Epoch t) noexcept {
  NewtonPolynomial place;
  NewtonPolynomial velocity;
  const bool hermite = segment.interpolation == Interpolation::kHermite;
  const Epoch origin = segment.times[first];
  for (std::size_t row = first, used = 0; used < segment.window(); ++row) {
    if (row == without) continue;
    const double t_s = seconds(segment.times[row] - origin);
    const OrbitState& state = segment.states[row];
    if (hermite) {
      place.add(t_s, state.position.m, state.velocity.m_s);
    } else {
      place.add(t_s, state.position.m);
      velocity.add(t_s, state.velocity.m_s);
    }
    ++used;
  }
  const double t_s = seconds(t - origin);
  const Interpolated found = place.at(t_s);
  return {{found.value}, {hermite ? found.rate : velocity.at(t_s).value}};
}

/// The first of `count` rows about the one at `row` and the next.
std::size_t window_about(const OemSegment& segment, std::size_t row, std::size_t count) noexcept {
  const std::size_t before = (count - 1) / 2;
  return std::min(row > before ? row - before : 0, segment.times.size() - count);
}

}  // namespace

EphemerisPropagator::EphemerisPropagator(std::vector<OemSegment> segments)
    : segments_(std::move(segments)) {
  for (const OemSegment& segment : segments_) measure(segment);
}

void EphemerisPropagator::measure(const OemSegment& segment) {
  const std::vector<OrbitState>& states = segment.states;
  double fastest = 0;
  double change = 0;  // of the velocity between two rows: it has its largest between them, too
  for (std::size_t i = 0; i < states.size(); ++i) {
    fastest = std::max(fastest, states[i].velocity.m_s.norm());
    if (i > 0)
      change = std::max(change, (states[i].velocity.m_s - states[i - 1].velocity.m_s).norm());
  }
  fastest_m_s_ = std::max(fastest_m_s_, fastest + change);
  const std::size_t rows = segment.window() + 1;
  if (states.size() < rows) return;
  for (std::size_t i = 1; i + 1 < states.size(); ++i) {
    const std::size_t first = window_about(segment, i, rows);
    const OrbitState found = interpolate(segment, first, i, segment.times[i]);
    worst_m_ = std::max(worst_m_, (found.position.m - states[i].position.m).norm());
  }
}

OrbitState EphemerisPropagator::at(Epoch t) const noexcept {
  const OemSegment& segment = segment_at(segments_, t);
  t = std::clamp(t, segment.meta.usable.begin, segment.meta.usable.end);
  const std::size_t row = row_before(segment.times, t);
  return interpolate(segment, window_about(segment, row, segment.window()), kNone, t);
}

EpochSpan EphemerisPropagator::span() const noexcept {
  return {segments_.front().meta.usable.begin, segments_.back().meta.usable.end};
}

std::optional<EpochSpan> EphemerisPropagator::gap_in(const EpochSpan& wanted) const noexcept {
  return engine::gap_in(segments_, wanted);
}

}  // namespace engine
