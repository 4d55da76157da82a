// The controls' bytes, also against drivers/uvc_protocol.md: its examples were packed by hand.

#include "drivers/usb_device/uvc_controls.h"

#include <cmath>
#include <fstream>
#include <limits>
#include <map>
#include <numbers>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <starloop_test_paths.h>

#include "drivers/usb_device/uvc_descriptors.h"

namespace {

using engine::Duration;
using engine::SimTime;

using Bytes = std::vector<std::byte>;
using Int = std::numeric_limits<std::int32_t>;

Bytes bytes_of(std::span<const std::byte> bytes) { return {bytes.begin(), bytes.end()}; }

void put_int(Bytes& bytes, std::size_t at, std::int32_t value) {
  for (std::size_t i = 0; i < 4; ++i)
    bytes[at + i] = static_cast<std::byte>(static_cast<std::uint32_t>(value) >> (8 * i));
}

/// The bytes of each block of the document that begins with "```hex name".
std::map<std::string, Bytes> examples() {
  std::ifstream file(STARLOOP_SOURCE_DIR "/drivers/uvc_protocol.md");
  std::map<std::string, Bytes> found;
  Bytes* block = nullptr;
  for (std::string line; std::getline(file, line);) {
    if (line.starts_with("```hex ")) {
      block = &found[line.substr(7)];
    } else if (line.starts_with("```")) {
      block = nullptr;
    } else if (block != nullptr) {
      std::istringstream words(line);
      for (std::string word; words >> word;)
        block->push_back(static_cast<std::byte>(std::stoul(word, nullptr, 16)));
    }
  }
  return found;
}

hil::Command trim() {
  hil::Command c;
  c.kind = hil::CommandKind::kTrim;
  c.sequence = 7;
  c.answers_frame = 42;
  c.time_to_live = Duration(500'000'000);
  c.made_at = SimTime(Duration(1'000'250'000'000));
  c.reference = SimTime(Duration(1'000'200'000'000));
  c.trim_offset_rad = {1.25e-4, -2.5e-5};
  c.trim_rate_rad_s = {1e-6, -1e-9};
  c.detection.centroid_px = {511.5, 300.25};
  c.detection.id = 3;
  c.detection.confidence = 1;
  return c;
}

TEST(UvcControls, TheDocumentsExamplesAreWhatTheEncodersSay) {
  const auto example = examples();
  ASSERT_EQ(example.size(), 4U);
  EXPECT_EQ(bytes_of(drivers::encode_uvc_command(trim())), example.at("command"));
  drivers::UvcFrameNews news;
  news.sequence = 42;
  news.shutter_open = SimTime(Duration(1'000'200'000'000));
  news.exposure = Duration(5'000'000);
  news.bits = 11;
  news.trim_rad = {1.25e-4, -2.5e-5};
  news.measured.j2000_to_camera = {0.5, -0.5, 0.5, -0.5};
  news.measured.rate_rad_s = {1e-6, 0, -2e-9};
  news.commands = 40;
  EXPECT_EQ(bytes_of(drivers::encode_uvc_frame(news)), example.at("frame"));
  EXPECT_EQ(bytes_of(drivers::encode_pan_tilt({206, -1})), example.at("pan-tilt"));
  EXPECT_EQ(bytes_of(std::as_bytes(std::span(drivers::kUvcExtensionGuid))), example.at("guid"));
}

TEST(UvcControls, TheDocumentsCommandIsUnderstood) {
  const auto command = drivers::decode_uvc_command(examples().at("command"));
  ASSERT_TRUE(command.ok());
  const hil::Command& c = command.value();
  EXPECT_EQ(c.kind, hil::CommandKind::kTrim);
  EXPECT_EQ(c.sequence, 7U);
  EXPECT_EQ(c.answers_frame, 42U);
  EXPECT_EQ(c.time_to_live, trim().time_to_live);
  EXPECT_EQ(c.made_at, trim().made_at);
  EXPECT_EQ(c.reference, trim().reference);
  EXPECT_FALSE(c.more_follow);
  EXPECT_DOUBLE_EQ(c.trim_offset_rad[0], 1.25e-4);
  EXPECT_DOUBLE_EQ(c.trim_offset_rad[1], -2.5e-5);
  EXPECT_DOUBLE_EQ(c.trim_rate_rad_s[1], -1e-9);
  EXPECT_EQ(c.detection.centroid_px.u, 511.5);
  EXPECT_EQ(c.detection.centroid_px.v, 300.25);
  EXPECT_EQ(c.detection.confidence, 1.0F);
  EXPECT_EQ(c.detection.id, 3U);
}

TEST(UvcControls, AnglesReachTheEndsOf32BitsAndNoFurther) {
  for (const std::int32_t parts : {Int::min(), Int::min() + 1, -1, 0, 1, Int::max()}) {
    Bytes bytes = bytes_of(drivers::encode_uvc_command(trim()));
    for (const std::size_t at : {40U, 44U, 48U, 52U}) put_int(bytes, at, parts);
    const auto command = drivers::decode_uvc_command(bytes);
    ASSERT_TRUE(command.ok());
    // A part in 2^53 of 2.147 rad is all that a double may be off.
    EXPECT_NEAR(command.value().trim_offset_rad[0], parts * 1e-9, 3e-16);
    EXPECT_EQ(command.value().trim_rate_rad_s[1], command.value().trim_offset_rad[0]);
    EXPECT_EQ(bytes_of(drivers::encode_uvc_command(command.value())), bytes) << parts;
  }
  drivers::UvcFrameNews news;
  news.trim_rad = {3.0, -3.0};
  news.measured.rate_rad_s = {std::nan(""), HUGE_VAL, 0};
  const auto back = drivers::decode_uvc_frame(drivers::encode_uvc_frame(news));
  EXPECT_DOUBLE_EQ(back.trim_rad[0], 2.147483647);
  EXPECT_DOUBLE_EQ(back.trim_rad[1], -2.147483648);
  EXPECT_EQ(back.measured.rate_rad_s[0], 0);
  EXPECT_DOUBLE_EQ(back.measured.rate_rad_s[1], 2.147483647);
  EXPECT_TRUE(back.cut_off);
  EXPECT_FALSE(drivers::decode_uvc_frame(drivers::encode_uvc_frame({})).cut_off);
}

TEST(UvcControls, WhatIsNoCommandIsRefused) {
  const Bytes good = bytes_of(drivers::encode_uvc_command(trim()));
  ASSERT_TRUE(drivers::decode_uvc_command(good).ok());
  for (const std::size_t size : {0U, 1U, 71U, 73U}) {
    Bytes bytes = good;
    bytes.resize(size);
    EXPECT_FALSE(drivers::decode_uvc_command(bytes).ok()) << size;
  }
  struct Bad {
    std::size_t at;
    unsigned value;
  };
  // Version, kind (attitude and ping have no place, 7 is none), flags, mode, reserved.
  for (const Bad& bad : {Bad{0, 0}, Bad{0, 2}, Bad{1, 3}, Bad{1, 5}, Bad{1, 7}, Bad{1, 255},
                         Bad{2, 2}, Bad{2, 255}, Bad{3, 4}, Bad{70, 1}, Bad{71, 128}}) {
    Bytes bytes = good;
    bytes[bad.at] = static_cast<std::byte>(bad.value);
    EXPECT_FALSE(drivers::decode_uvc_command(bytes).ok()) << bad.at << ' ' << bad.value;
  }
}

TEST(UvcControls, AnArcSecondOfPanIsPiOver648000Radians) {
  const hil::TrimAngles trim_rad = drivers::trim_of({1, -648000});
  EXPECT_NEAR(trim_rad[0], 4848.1368e-9, 1e-13);
  EXPECT_DOUBLE_EQ(trim_rad[1], -std::numbers::pi);
  for (const std::int32_t beyond : {648001, -648001, Int::max(), Int::min()}) {
    EXPECT_FALSE(drivers::decode_pan_tilt(drivers::encode_pan_tilt({beyond, 0})).ok()) << beyond;
    EXPECT_FALSE(drivers::decode_pan_tilt(drivers::encode_pan_tilt({0, beyond})).ok()) << beyond;
  }
  EXPECT_EQ(drivers::decode_pan_tilt(drivers::encode_pan_tilt({-3, 4})).value().tilt_arcsec, 4);
}

TEST(UvcControls, EveryCountHasItsPlace) {
  Bytes bytes(drivers::kUvcCountsBytes);
  for (std::size_t i = 0; i < bytes.size(); ++i) bytes[i] = static_cast<std::byte>(i);
  const drivers::UvcCounts counts = drivers::decode_uvc_counts(bytes);
  EXPECT_EQ(counts.sent, 0x1716151413121110U);
  EXPECT_EQ(bytes_of(drivers::encode_uvc_counts(counts)), bytes);
}

}  // namespace
