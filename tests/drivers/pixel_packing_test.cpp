#include "drivers/pixel_packing.h"

#include <algorithm>
#include <cstring>
#include <vector>

#include <gtest/gtest.h>

#include "engine/core/random.h"

namespace {

using drivers::packed_bytes;

constexpr std::byte kUntouched{0xA5};

/// The definition, bit by bit.
std::vector<std::byte> packed_by_definition(const std::vector<std::uint16_t>& pixels) {
  std::vector<std::byte> out(packed_bytes(pixels.size()));
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    for (std::size_t bit = 0; bit < 11; ++bit) {
      const std::size_t at = 11 * i + bit;
      if ((pixels[i] >> bit & 1) != 0) out[at / 8] |= std::byte{1} << static_cast<int>(at % 8);
    }
  }
  return out;
}

std::vector<std::uint16_t> random_pixels(std::size_t count, std::uint16_t below = 2048) {
  engine::Draws draws(3, engine::Stream::kLight, 0, static_cast<std::uint32_t>(count));
  std::vector<std::uint16_t> pixels(count);
  for (std::uint16_t& p : pixels) p = static_cast<std::uint16_t>(draws.bits() % below);
  return pixels;
}

/// Packs and unpacks with room for not a byte more, and looks that none is written.
void expect_right(const std::vector<std::uint16_t>& pixels) {
  const std::size_t bytes = packed_bytes(pixels.size());
  std::vector<std::byte> storage(bytes + 8, kUntouched);
  const std::span<std::byte> packed(storage.data(), bytes);
  ASSERT_EQ(drivers::pack_pixels(pixels, packed), bytes);
  const std::vector<std::byte> expected = packed_by_definition(pixels);
  ASSERT_TRUE(std::equal(expected.begin(), expected.end(), packed.begin())) << pixels.size();
  ASSERT_TRUE(std::all_of(storage.begin() + static_cast<std::ptrdiff_t>(bytes), storage.end(),
                          [](std::byte b) { return b == kUntouched; }))
      << pixels.size();
  // A vector of its own that ends where the packed bytes do: a read past them is a sanitizer's.
  const std::vector<std::byte> tight(packed.begin(), packed.end());
  std::vector<std::uint16_t> back(pixels.size() + 1, 0xFFFF);
  drivers::unpack_pixels(tight, std::span(back).first(pixels.size()));
  ASSERT_TRUE(std::equal(pixels.begin(), pixels.end(), back.begin())) << pixels.size();
  ASSERT_EQ(back.back(), 0xFFFF) << pixels.size();
}

TEST(PixelPacking, EveryCodeInEveryPlaceOfAGroup) {
  for (std::size_t place = 0; place < 32; ++place) {
    for (std::uint16_t code = 0; code < 2048; ++code) {
      // Among ones and among zeros: a bit that leaks is seen.
      for (const std::uint16_t others : {std::uint16_t{0}, std::uint16_t{2047}}) {
        std::vector<std::uint16_t> pixels(48, others);
        pixels[place] = code;
        expect_right(pixels);
        if (HasFatalFailure()) return;
      }
    }
  }
}

TEST(PixelPacking, EveryLengthUpToAFewGroups) {
  for (std::size_t n = 0; n <= 200; ++n) {
    expect_right(random_pixels(n));
    if (HasFatalFailure()) return;
  }
}

TEST(PixelPacking, FramesOfOddWidth) {
  for (const std::size_t width : {1U, 3U, 641U, 1023U, 1024U}) {
    expect_right(random_pixels(width * 7));
    if (HasFatalFailure()) return;
  }
}

TEST(PixelPacking, WhatIsAboveTenBitsIsCutOff) {
  const std::vector<std::uint16_t> wide = random_pixels(100, 65535);
  std::vector<std::uint16_t> cut = wide;
  for (std::uint16_t& p : cut) p = static_cast<std::uint16_t>(p & 2047);
  std::vector<std::byte> packed(packed_bytes(wide.size()));
  drivers::pack_pixels(wide, packed);
  EXPECT_EQ(packed, packed_by_definition(cut));
}

TEST(PixelPacking, TheRungsAgree) {
  const std::vector<std::uint16_t> pixels = random_pixels(1024 * 3 + 5);
  std::vector<std::byte> plain(packed_bytes(pixels.size()));
  EXPECT_EQ(drivers::detail::pack_plain(pixels, plain), plain.size());
  EXPECT_EQ(plain, packed_by_definition(pixels));
  std::vector<std::uint16_t> back(pixels.size());
  drivers::detail::unpack_plain(plain, back);
  EXPECT_EQ(back, pixels);
}

TEST(PixelPacking, AFrameOfTheCameraIsElevenSixteenthsOfItself) {
  EXPECT_EQ(packed_bytes(1024 * 1024), 1'441'792U);
  EXPECT_EQ(packed_bytes(0), 0U);
  EXPECT_EQ(packed_bytes(1), 2U);
}

}  // namespace
