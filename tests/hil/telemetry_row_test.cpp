#include "hil/telemetry_row.h"

#include <algorithm>
#include <cstring>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "engine/core/crc32c.h"

namespace {

using engine::Duration;
using engine::SimTime;
using hil::decode_telemetry_row;
using hil::encode_telemetry_row;
using hil::kTelemetryRowPixels;
using hil::TelemetryRow;

using Row = std::vector<std::uint16_t>;

SimTime at_ns(std::int64_t ns) { return SimTime(Duration(ns)); }

TelemetryRow example() {
  return {.frame_id = 0xFEDCBA9876543210ULL,
          .exposure_start = at_ns(-5),
          .exposure_middle = at_ns(309'761'630'162'629),
          .exposure_end = at_ns(std::numeric_limits<std::int64_t>::max()),
          .link_sequence = 42,
          .image_crc32c = 0xC0DEC0DE};
}

Row encoded(const TelemetryRow& telemetry, std::size_t width) {
  Row row(width, 0xFFFF);
  EXPECT_TRUE(encode_telemetry_row(telemetry, row).ok());
  return row;
}

std::string refusal(const Row& row) {
  const auto decoded = decode_telemetry_row(row);
  return decoded.ok() ? "" : decoded.error().step;
}

TEST(TelemetryRow, EveryFieldComesBackAtEveryWidth) {
  for (const std::size_t width : {kTelemetryRowPixels, std::size_t{57}, std::size_t{1024}}) {
    const auto decoded = decode_telemetry_row(encoded(example(), width));
    ASSERT_TRUE(decoded.ok()) << decoded.error().step;
    EXPECT_EQ(decoded.value(), example());
  }
}

TEST(TelemetryRow, NoPixelNeedsMoreThanEightBitsAndTheRestIsZero) {
  const Row row = encoded(example(), 200);
  EXPECT_LE(*std::max_element(row.begin(), row.end()), 255);
  EXPECT_TRUE(std::all_of(row.begin() + kTelemetryRowPixels, row.end(),
                          [](std::uint16_t dn) { return dn == 0; }));
}

// The header's comment is the interface.
TEST(TelemetryRow, FieldsLieWhereTheHeaderSays) {
  TelemetryRow telemetry;
  telemetry.frame_id = 0x0102030405060708ULL;
  telemetry.exposure_start = at_ns(0x11);
  telemetry.exposure_middle = at_ns(0x22);
  telemetry.exposure_end = at_ns(0x33);
  telemetry.link_sequence = 0x44;
  telemetry.image_crc32c = 0x55;
  const Row row = encoded(telemetry, 60);
  EXPECT_EQ(Row(row.begin(), row.begin() + 8), (Row{'S', 'L', 'T', 'R', 2, 56, 0, 0}));
  EXPECT_EQ(Row(row.begin() + 8, row.begin() + 16), (Row{8, 7, 6, 5, 4, 3, 2, 1}));
  EXPECT_EQ(row[16], 0x11);
  EXPECT_EQ(row[24], 0x22);
  EXPECT_EQ(row[32], 0x33);
  EXPECT_EQ(row[40], 0x44);
  EXPECT_EQ(row[48], 0x55);
  std::vector<std::byte> bytes(52);
  std::transform(row.begin(), row.begin() + 52, bytes.begin(),
                 [](std::uint16_t dn) { return static_cast<std::byte>(dn); });
  const std::uint32_t crc = engine::crc32c(bytes);
  for (std::size_t i = 0; i < 4; ++i) EXPECT_EQ(row[52 + i], crc >> (8 * i) & 0xFFU);
}

TEST(TelemetryRow, ACameraTooNarrowIsRefusedByBothSides) {
  for (const std::size_t width : {std::size_t{0}, std::size_t{1}, kTelemetryRowPixels - 1}) {
    Row row(width);
    const auto status = encode_telemetry_row(example(), row);
    ASSERT_FALSE(status.ok()) << width;
    EXPECT_STREQ(status.error().step, "a telemetry row needs a camera at least 56 pixels wide");
    EXPECT_EQ(refusal(row), "width of a telemetry row");
  }
}

TEST(TelemetryRow, EverySingleBitFlippedIsRefused) {
  Row row = encoded(example(), 64);
  for (std::size_t bit = 0; bit < 16 * row.size(); ++bit) {
    const auto mask = static_cast<std::uint16_t>(1U << (bit % 16));
    row[bit / 16] ^= mask;
    ASSERT_NE(refusal(row), "") << "bit " << bit;
    row[bit / 16] ^= mask;
  }
  EXPECT_EQ(refusal(row), "");
}

TEST(TelemetryRow, RowsOfAnImageAreNoTelemetry) {
  std::mt19937 random(3);
  for (int i = 0; i < 20'000; ++i) {
    Row row(64);
    for (std::size_t k = 0; k < kTelemetryRowPixels; ++k)
      row[k] = static_cast<std::uint16_t>(random() % 256);
    // Half of them get past the magic.
    if (i % 2 == 0) std::copy_n(encoded(example(), 64).begin(), 8, row.begin());
    ASSERT_NE(refusal(row), "");
  }
  EXPECT_EQ(refusal(Row(64, 0)), "magic of the row");
  EXPECT_EQ(refusal(Row(64, 2047)), "a pixel that no telemetry row has");
}

TEST(TelemetryRow, AFrameSaysItsStartMiddleAndEnd) {
  hil::Frame frame;
  frame.sequence = 9;
  frame.shutter_open = at_ns(1'000);
  frame.exposure = Duration(500);
  engine::DnImage nothing(0, 0);
  frame.pixels = &nothing;
  EXPECT_EQ(hil::telemetry_of(frame, 7), (TelemetryRow{.frame_id = 9,
                                                       .exposure_start = at_ns(1'000),
                                                       .exposure_middle = at_ns(1'250),
                                                       .exposure_end = at_ns(1'500),
                                                       .link_sequence = 7}));
}

TEST(TelemetryRow, TheChecksumOfTheImageIsOfItsBytesAndOfEachOfThem) {
  engine::DnImage image(9, 1);
  // The check value of CRC-32C is that of the text "123456789", here with zeros between.
  std::vector<std::byte> bytes;
  for (std::uint16_t i = 0; i < 9; ++i) {
    image.pixels()[i] = static_cast<std::uint16_t>('1' + i);
    bytes.push_back(static_cast<std::byte>('1' + i));
    bytes.push_back(std::byte{0});
  }
  hil::Frame frame;
  frame.pixels = &image;
  EXPECT_EQ(hil::telemetry_of(frame, 0).image_crc32c, engine::crc32c(bytes));
  for (std::uint16_t& dn : image.pixels()) {
    dn ^= 0x400U;
    EXPECT_NE(hil::telemetry_of(frame, 0).image_crc32c, engine::crc32c(bytes));
    dn ^= 0x400U;
  }
}

}  // namespace
