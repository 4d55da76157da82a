#pragma once

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <span>
#include <vector>

#include "hil/steady_clock.h"

namespace guest {

/// The moment at which a frame was ready, in its first six pixels of 11 bits each: measure.sh's
/// clocks are one clock, the guest's.
inline constexpr std::size_t kStampPixels = 6;

inline void write_stamp(std::span<std::uint16_t> pixels) noexcept {
  auto ns = static_cast<std::uint64_t>(hil::SteadyClock::stopwatch().count());
  for (std::size_t i = 0; i < kStampPixels; ++i, ns >>= 11U) pixels[i] = ns & 0x7FFU;
}

/// How old frames were when they were read.
class Ages {
 public:
  Ages() { ages_us_.reserve(100'000); }
  void see(const std::uint16_t* pixels) {
    std::uint64_t ns = 0;
    for (std::size_t i = kStampPixels; i-- > 0;) ns = ns << 11U | pixels[i];
    const auto now = static_cast<std::uint64_t>(hil::SteadyClock::stopwatch().count());
    ages_us_.push_back((now - ns) / 1000);
  }
  void print() {
    std::sort(ages_us_.begin(), ages_us_.end());
    const auto at = [this](std::size_t percent) {
      return ages_us_.empty()
                 ? 0ULL
                 : static_cast<unsigned long long>(ages_us_[(ages_us_.size() - 1) * percent / 100]);
    };
    std::printf("read=%zu age_us_p50=%llu age_us_p95=%llu\n", ages_us_.size(), at(50), at(95));
  }

 private:
  std::vector<std::uint64_t> ages_us_;
};

}  // namespace guest
