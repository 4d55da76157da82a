#pragma once

#include <Random123/philox.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

namespace engine {

/// Who draws. Streams never share a number, so a stage that draws one more shifts nobody else.
enum class Stream : std::uint32_t {
  kLight = 1,
  kShot = 2,
  kShotDetail = 3,
  kRead = 4,
  kPrnu = 5,
  kDsnu = 6,
  kHotPixels = 7,
  kDeadPixels = 8,
  kColumns = 9,
  kCosmicRays = 10,
  kJitter = 20,
  kAttitude = 21,
  kFaults = 22,
  kMeshSeeds = 30,
  kCrinkle = 31,
  kMeshSides = 32,
  kCharts = 40
};

/// Random numbers as a function of (seed, stream, frame, place): same bits whatever the threads.
///
/// Philox4x32-10 (Salmon et al. 2011, DOI 10.1145/2063384.2063405), counter-based: nothing is
/// carried from one place to the next. The key is (seed, stream), the counter (place, frame,
/// block).
class Draws {
 public:
  Draws(std::uint64_t seed, Stream stream, std::uint64_t frame, std::uint32_t place) noexcept
      : key_{{key(seed, stream)[0], key(seed, stream)[1]}},
        counter_{{place, static_cast<std::uint32_t>(frame), static_cast<std::uint32_t>(frame >> 32),
                  0}} {}

  /// Philox's key, for those who draw many places at once.
  [[nodiscard]] static constexpr std::array<std::uint32_t, 2> key(std::uint64_t seed,
                                                                  Stream stream) noexcept {
    return {static_cast<std::uint32_t>(seed),
            static_cast<std::uint32_t>(seed >> 32) ^
                (static_cast<std::uint32_t>(stream) * 0x9E3779B9u)};
  }

  /// The next four words at once.
  [[nodiscard]] std::array<std::uint32_t, 4> block() noexcept {
    const auto words = r123::Philox4x32()(counter_, key_);
    counter_[3]++;
    return {words[0], words[1], words[2], words[3]};
  }
  [[nodiscard]] std::uint32_t bits() noexcept {
    if (next_ == 4) {
      block_ = r123::Philox4x32()(counter_, key_);
      counter_[3]++;
      next_ = 0;
    }
    return block_[next_++];
  }
  /// In (0, 1): the middle of one of 2^24 cells, as near as single precision has it. The last
  /// cell's would be rounded to 1.
  [[nodiscard]] float uniform() noexcept {
    return std::min((static_cast<float>(bits() >> 8) + 0.5F) * 0x1p-24F, 0x1.fffffep-1F);
  }
  /// In (0, 1), 2^53 cells.
  [[nodiscard]] double uniform_double() noexcept {
    const std::uint64_t high = bits();
    const std::uint64_t low = bits();
    return (static_cast<double>(((high << 32) | low) >> 11) + 0.5) * 0x1p-53;
  }
  /// Mean 0, variance 1. Box and Muller 1958; single precision ends the tail at 5.8 sigma.
  [[nodiscard]] float normal() noexcept {
    const float radius = std::sqrt(-2.0F * std::log(uniform()));
    return radius * std::cos(6.28318530718F * uniform());
  }
  /// Poisson with this mean; 0 for a mean that is not positive.
  [[nodiscard]] double poisson(double mean) noexcept;
  /// The same for a uniform number in (0, 1) of the caller's. Pre: 0 < mean < kInversionLimit.
  [[nodiscard]] static double poisson_from(double uniform, double mean) noexcept;
  /// Up to this mean one walks up the distribution; above it one rejects from a hat. At 12 both
  /// cost about the same.
  static constexpr double kInversionLimit = 12.0;
  /// No normal() lies further out than this.
  static constexpr float kLargestNormal = 6.0F;

 private:
  r123::Philox4x32::key_type key_;
  r123::Philox4x32::ctr_type counter_;
  r123::Philox4x32::ctr_type block_{};
  std::uint32_t next_ = 4;
};

}  // namespace engine
