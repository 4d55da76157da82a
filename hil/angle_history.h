#pragma once

#include <array>

#include "engine/core/time.h"
#include "hil/camera_link.h"

namespace hil {

/// Where the boresight was at the last few instants somebody asked for.
/// Thread: one. Loop-safe.
class AngleHistory {
 public:
  void clear() noexcept { used_ = 0; }
  /// Pre: `t` never decreases.
  void add(engine::SimTime t, const TrimAngles& rad) noexcept {
    if (used_ > 0 && newest().time == t) --used_;
    samples_[used_ % kSamples] = {t, rad};
    ++used_;
  }
  /// Linear between two instants, the nearest one beyond them. Pre: one was added.
  [[nodiscard]] TrimAngles at(engine::SimTime t) const noexcept {
    Sample after = newest();
    const std::size_t oldest = used_ > kSamples ? used_ - kSamples : 0;
    for (std::size_t i = used_; i-- > oldest;) {
      const Sample& s = samples_[i % kSamples];
      if (s.time <= t) {
        if (t >= after.time) return after.rad;
        const double part = engine::seconds(t - s.time) / engine::seconds(after.time - s.time);
        return {s.rad[0] + part * (after.rad[0] - s.rad[0]),
                s.rad[1] + part * (after.rad[1] - s.rad[1])};
      }
      after = s;
    }
    return after.rad;
  }

 private:
  static constexpr std::size_t kSamples = 64;  // four a frame: sixteen frames
  struct Sample {
    engine::SimTime time{};
    TrimAngles rad{};
  };
  [[nodiscard]] const Sample& newest() const noexcept { return samples_[(used_ - 1) % kSamples]; }

  std::array<Sample, kSamples> samples_{};
  std::size_t used_ = 0;
};

}  // namespace hil
