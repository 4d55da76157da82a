#pragma once

#include <cstdint>

namespace engine {

/// The Poisson number of a pixel whose uniform number (word + detail) / 2^32 lies where single
/// precision would show: exact to some 1e-12 of each probability, in double and by sums, up to a
/// mean of 2e6; beyond that the first terms of Cornish and Fisher, good to .0005 sigma.
/// Pre: mean > 0; detail in (0, 1).
/// Thread: any. Loop-safe.
[[nodiscard]] double poisson_tail(std::uint32_t word, double detail, double mean) noexcept;

}  // namespace engine
