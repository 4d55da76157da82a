#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace drivers {

// Pixels of 11 bits without gaps: pixel i is bits 11 i to 11 i + 10 of the stream, bit 0 of a byte
// first. Rows follow each other without padding, and zeros fill the last byte. What is above bit 10
// of a pixel is cut off. Loop-safe.

inline constexpr unsigned kPackedBits = 11;

[[nodiscard]] constexpr std::size_t packed_bytes(std::size_t pixels) noexcept {
  return (pixels * kPackedBits + 7) / 8;
}

/// Returns packed_bytes(pixels). Pre: `out` has room for them.
std::size_t pack_pixels(std::span<const std::uint16_t> pixels, std::span<std::byte> out) noexcept;

/// Pre: `in` has packed_bytes(pixels).
void unpack_pixels(std::span<const std::byte> in, std::span<std::uint16_t> pixels) noexcept;

namespace detail {
// One rung each; the functions above take the fastest that the processor has.
std::size_t pack_plain(std::span<const std::uint16_t> pixels, std::span<std::byte> out) noexcept;
void unpack_plain(std::span<const std::byte> in, std::span<std::uint16_t> pixels) noexcept;
}  // namespace detail

}  // namespace drivers
