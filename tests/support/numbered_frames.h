#pragma once

#include <cstdint>

#include "engine/core/image.h"

/// Images that show which frame they are: every pixel follows from the sequence.
namespace numbered_frames {

inline constexpr int kWidth_px = 72;
inline constexpr int kHeight_px = 50;

[[nodiscard]] inline std::uint16_t pixel(std::uint64_t sequence, std::size_t i) noexcept {
  return static_cast<std::uint16_t>((sequence * 31 + i) & 0x7FFU);
}

inline void fill(engine::DnImage& image, std::uint64_t sequence) noexcept {
  std::size_t i = 0;
  for (std::uint16_t& dn : image.pixels()) dn = pixel(sequence, i++);
}

}  // namespace numbered_frames
