#pragma once

#include <vector>

#include "engine/core/time.h"

namespace hil {

/// What was put in comes out in order, each at its own time; a fixed number at most is under way.
/// Thread: one. Loop-safe once built.
template <class Value>
class DelayLine {
 public:
  struct Entry {
    engine::SimTime due{};
    Value value{};
  };

  explicit DelayLine(std::size_t most) : entries_(most) {}

  /// False: full, and the value is lost. Pre: `due` never decreases.
  [[nodiscard]] bool push(const Value& value, engine::SimTime due) noexcept {
    if (used_ == entries_.size()) return false;
    entries_[(first_ + used_++) % entries_.size()] = {due, value};
    return true;
  }
  [[nodiscard]] bool has_due(engine::SimTime t) const noexcept {
    return used_ > 0 && entries_[first_].due <= t;
  }
  /// Pre: something is under way.
  Entry pop() noexcept {
    const Entry entry = entries_[first_];
    first_ = (first_ + 1) % entries_.size();
    --used_;
    return entry;
  }

 private:
  std::vector<Entry> entries_;
  std::size_t first_ = 0;
  std::size_t used_ = 0;
};

}  // namespace hil
