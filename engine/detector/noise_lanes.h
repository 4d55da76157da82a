#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "engine/core/random.h"

namespace engine {

/// Noise for spans of pixels, by the widest instructions that the processor has: the same bits
/// whichever those are, since nothing here fuses a multiplication with an addition.
///
/// Words: pixel i of the frame in raster order, tile = i / 64, has word (i % 64) / 16 of the block
/// of Draws at place 16 tile + i % 16. No map of lanes and no thread shows in it.
///
/// Normal numbers: the inverse of the distribution by Giles 2012, "Approximating the erfinv
/// function", GPU Computing Gems Jade Edition, ch. 10; at most 6.4 sigma from 32 bits.
///
/// Poisson numbers: below a mean of kExpansionFrom by a search from zero (Devroye 1986, section
/// X.3.3); from there by the inverse of the regularised gamma function Q(x, mean), whose floor is
/// Poisson, as an expansion about the normal quantile w: with s = w / sqrt(mean)
///   x = mean + sqrt(mean) w + w^2 A(s) + B(s) + C(s) / mean,
/// Temme's form (Giles 2016, DOI 10.1145/2699466), with our own A, B and C, fitted to |w| < 4.2 and
/// means from 8 to 6e4: x is right to .0007 there, and a chi-squared at 1e8 draws would grow by
/// 0.1. The last 2^-12 of the search and |w| > 4.2 go to poisson_tail.h. Thread: any. Loop-safe.
namespace noise_lanes {

inline constexpr std::size_t kTile = 64;
/// No normal number lies further out.
inline constexpr float kLargestNormal = 6.4F;
/// The mean from which the expansion holds.
inline constexpr float kExpansionFrom = 8.0F;
/// Above this mean a pixel is `brim_e`: no draw.
inline constexpr float kLargestMean = 1e9F;

/// Which numbers: those of a frame, for the pixels from `first` on. Pre: first % kTile == 0.
struct Place {
  std::uint64_t seed = 0;
  std::uint64_t frame = 0;
  std::uint32_t first = 0;
};

/// What makes the mean of a pixel: light e_per_w_m2 response + dark_e, and where there are maps
/// exposure_s dark_e_s instead of dark_e.
struct Means {
  float e_per_w_m2 = 0;
  float dark_e = 0;
  float exposure_s = 0;
  std::span<const float> response = {};  ///< of each pixel; empty: 1
  std::span<const float> dark_e_s = {};  ///< of each pixel; empty: dark_e
  float full_well_e = 0;
  float brim_e = 0;  ///< what a pixel of more than kLargestMean has
  bool clip = true;  ///< at the full well
};

struct Counts {
  int no_light_px = 0;   ///< not a number or negative
  int full_well_px = 0;  ///< collected more than the full well
};

/// Poisson electrons for each pixel's light.
Counts expose(const Place& place, const Means& means, std::span<const float> light,
              std::span<float> electrons) noexcept;

struct ReadOut {
  float noise_e = 0;  ///< rms
  float dn_per_e = 0;
  float offset_dn = 0;  ///< added before the floor
  float largest_dn = 0;
};

/// Read noise, gain and quantiser. Where no draw moves any pixel of a tile none is made.
void digitize(const Place& place, const ReadOut& read_out, std::span<const float> electrons,
              std::span<std::uint16_t> dn) noexcept;

/// The bare words and normal numbers of a stream. Pre: whole tiles.
void words(const Place& place, Stream stream, std::span<std::uint32_t> out) noexcept;
void normals(const Place& place, Stream stream, std::span<float> out) noexcept;
/// The normal number of each word.
void normals_of(std::span<const std::uint32_t> words, std::span<float> out) noexcept;

}  // namespace noise_lanes
}  // namespace engine
