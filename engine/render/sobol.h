#pragma once

#include <array>
#include <cstdint>

namespace engine {

/// Points that fill the square more evenly than chance would, randomly scrambled: each point by
/// itself is even over the square, so that what is averaged over them is unbiased.
///
/// The first two dimensions of Sobol 1967, a (0, 2)-sequence: of each 2^k points in a row every
/// elementary interval of area 2^-k holds one. Scrambled as Owen 1995 has it by a hash (Laine and
/// Karras 2011; Burley 2020, Practical Hash-based Owen Scrambling, JCGT 10(4)), which keeps that.
/// Further dimensions are further pairs, each scrambled and put in order anew.
/// Thread: any. Loop-safe.

enum class SequenceKind : std::uint8_t { kSobol, kIndependent };

[[nodiscard]] constexpr std::uint32_t reversed_bits(std::uint32_t x) noexcept {
  x = (x >> 16U) | (x << 16U);
  x = ((x >> 8U) & 0x00FF00FFU) | ((x & 0x00FF00FFU) << 8U);
  x = ((x >> 4U) & 0x0F0F0F0FU) | ((x & 0x0F0F0F0FU) << 4U);
  x = ((x >> 2U) & 0x33333333U) | ((x & 0x33333333U) << 2U);
  return ((x >> 1U) & 0x55555555U) | ((x & 0x55555555U) << 1U);
}

/// Flips each bit or not by what stands below it and the seed: the scramble, lowest bit first.
[[nodiscard]] constexpr std::uint32_t scrambled_upwards(std::uint32_t x,
                                                        std::uint32_t seed) noexcept {
  x += seed;
  x ^= x * 0x6C50B47CU;
  x ^= x * 0xB82F1E52U;
  x ^= x * 0xC7AFE638U;
  x ^= x * 0x8D22F6E6U;
  return x;
}

/// The same, highest bit first: nested, as Owen has it.
[[nodiscard]] constexpr std::uint32_t owen_scrambled(std::uint32_t x, std::uint32_t seed) noexcept {
  return reversed_bits(scrambled_upwards(reversed_bits(x), seed));
}

/// Two fractions in 32 bits, their bits in reverse: the lowest is the half.
[[nodiscard]] constexpr std::array<std::uint32_t, 2> sobol_reversed(std::uint32_t index) noexcept {
  // The second dimension's matrix is Pascal's triangle mod 2: bit i of the result is the sum of all
  // bits of the index whose number holds every bit of i's. One step for each bit of such a number.
  std::uint32_t y = index;
  y ^= (y >> 1U) & 0x55555555U;
  y ^= (y >> 2U) & 0x33333333U;
  y ^= (y >> 4U) & 0x0F0F0F0FU;
  y ^= (y >> 8U) & 0x00FF00FFU;
  y ^= (y >> 16U) & 0x0000FFFFU;
  return {index, y};
}

/// A number in 64 bits of which each bit depends on every bit of `x` (Steele et al. 2014,
/// DOI 10.1145/2660193.2660195).
[[nodiscard]] constexpr std::uint64_t mixed(std::uint64_t x) noexcept {
  x += 0x9E3779B97F4A7C15U;
  x = (x ^ (x >> 30U)) * 0xBF58476D1CE4E5B9U;
  x = (x ^ (x >> 27U)) * 0x94D049BB133111EBU;
  return x ^ (x >> 31U);
}

/// In (0, 1): the middle of one of 2^23 cells, exact in single precision.
[[nodiscard]] constexpr float fraction(std::uint32_t bits) noexcept {
  return (static_cast<float>(static_cast<std::int32_t>(bits >> 9U)) + 0.5F) * 0x1p-23F;
}

/// 32 bits of which each depends on every bit of `x` (the end of MurmurHash3, Appleby 2011).
[[nodiscard]] constexpr std::uint32_t mixed32(std::uint32_t x) noexcept {
  x ^= x >> 16U;
  x *= 0x85EBCA6BU;
  x ^= x >> 13U;
  x *= 0xC2B2AE35U;
  return x ^ (x >> 16U);
}

/// What scrambles a pair: its numbers, and the order of its points.
struct PairSeeds {
  std::uint32_t first = 0;
  std::uint32_t second = 0;
  std::uint32_t order = 0;
};
[[nodiscard]] constexpr PairSeeds seeds_of_pair(std::uint32_t key, std::uint32_t number) noexcept {
  const std::uint32_t seed = mixed32(key + number * 0x9E3779B9U);
  return {seed, (seed ^ (seed >> 15U)) * 0x2C1B3C6DU, (seed ^ (seed >> 14U)) * 0x297A2D39U};
}
[[nodiscard]] constexpr PairSeeds seeds_of_places(std::uint32_t key) noexcept {
  return seeds_of_pair(key, 0xFFFFFFFFU);
}
[[nodiscard]] constexpr std::array<float, 2> scrambled_pair(std::uint32_t index,
                                                            const PairSeeds& seeds) noexcept {
  const auto point = sobol_reversed(index);
  return {fraction(reversed_bits(scrambled_upwards(point[0], seeds.first))),
          fraction(reversed_bits(scrambled_upwards(point[1], seeds.second)))};
}
[[nodiscard]] constexpr std::array<float, 2> independent_pair(std::uint32_t key,
                                                              std::uint32_t sample,
                                                              std::uint32_t number) noexcept {
  const std::uint64_t bits = mixed(mixed(static_cast<std::uint64_t>(key) << 32U | number) ^ sample);
  return {fraction(static_cast<std::uint32_t>(bits)),
          fraction(static_cast<std::uint32_t>(bits >> 32U))};
}

/// Pairs in (0, 1) in Sobol's own order: the first 2^k are a net.
class PlaceSequence {
 public:
  PlaceSequence(SequenceKind kind, std::uint32_t key) noexcept : kind_(kind), key_(key) {}
  [[nodiscard]] std::array<float, 2> at(std::uint32_t sample) const noexcept {
    if (kind_ == SequenceKind::kIndependent) return independent_pair(key_, sample, 0xFFFFFFFFU);
    return scrambled_pair(sample, seeds_of_places(key_));
  }

 private:
  SequenceKind kind_;
  std::uint32_t key_;
};

/// The numbers of one sample of a sequence: pairs in (0, 1), a function of (key, sample, pair).
class SampleNumbers {
 public:
  SampleNumbers() = default;
  SampleNumbers(SequenceKind kind, std::uint32_t key, std::uint32_t sample) noexcept
      : kind_(kind), key_(key), sample_(sample) {}

  [[nodiscard]] std::array<float, 2> pair(std::uint32_t number) const noexcept {
    if (kind_ == SequenceKind::kIndependent) return independent_pair(key_, sample_, number);
    // Another order for each pair: else the n-th points of two pairs would belong together.
    const PairSeeds seeds = seeds_of_pair(key_, number);
    return scrambled_pair(owen_scrambled(sample_, seeds.order), seeds);
  }

 private:
  SequenceKind kind_ = SequenceKind::kSobol;
  std::uint32_t key_ = 0;
  std::uint32_t sample_ = 0;
};

}  // namespace engine
