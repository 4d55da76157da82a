#include "drivers/usb_packet.h"

#include <algorithm>
#include <numeric>
#include <vector>

#include <gtest/gtest.h>

#include "drivers/frame_packet.h"
#include "drivers/pixel_packing.h"
#include "engine/core/random.h"
#include "hil/telemetry_packet.h"
#include "tests/support/usb_frames.h"

namespace {

using drivers::PixelFormat;
using drivers::UsbMessage;
using drivers::UsbStatus;

std::vector<std::byte> encoded(const hil::Frame& frame, PixelFormat format) {
  const int rows = frame.pixels->height() + (frame.telemetry_row.empty() ? 0 : 1);
  std::vector<std::byte> out(drivers::kUsbHeaderBytes +
                             drivers::usb_payload_bytes(format, frame.pixels->width(), rows));
  const auto used = drivers::encode_usb_frame(frame, format, out);
  EXPECT_TRUE(used.ok());
  out.resize(used.ok() ? used.value() : 0);
  return out;
}

TEST(UsbPacket, HeaderSaysWhatTheFrameIs) {
  const auto image = usb_frames::image(7);
  for (const PixelFormat format : {PixelFormat::kPlain16, PixelFormat::kPacked11}) {
    const auto bytes = encoded(usb_frames::frame(7, image), format);
    const auto header = drivers::decode_usb_header(bytes);
    ASSERT_TRUE(header.ok()) << header.error().step;
    const drivers::UsbFrameHeader& h = header.value();
    EXPECT_EQ(h.format, format);
    EXPECT_EQ(h.bits, 11);
    EXPECT_EQ(h.width_px, usb_frames::kWidth_px);
    EXPECT_EQ(h.height_px, usb_frames::kHeight_px);
    EXPECT_EQ(h.rows_below, 0);
    EXPECT_EQ(h.sequence, 7U);
    EXPECT_EQ(h.shutter_open, engine::SimTime(engine::Duration(1'700'000'000)));
    EXPECT_EQ(h.exposure, engine::Duration(1'000'000));
    EXPECT_EQ(drivers::kUsbHeaderBytes + h.payload_bytes, bytes.size());
  }
}

TEST(UsbPacket, NewsBehindThePixelsAreTelemetryPackets) {
  const auto image = usb_frames::image(3);
  const auto bytes = encoded(usb_frames::frame(3, image), PixelFormat::kPacked11);
  const auto h = drivers::decode_usb_header(bytes).value();
  auto news = std::span<const std::byte>(bytes).last(h.news_bytes);
  std::vector<hil::Telemetry> all;
  while (!news.empty()) {
    // A Space Packet says its own length.
    ASSERT_GE(news.size(), 6U);
    const std::size_t n =
        7 + (static_cast<std::size_t>(news[4]) << 8 | static_cast<std::size_t>(news[5]));
    const auto one = hil::decode_telemetry(news.first(n));
    ASSERT_TRUE(one.ok());
    all.push_back(one.value());
    news = news.subspan(n);
  }
  ASSERT_EQ(all.size(), 2U);
  EXPECT_EQ(std::get<hil::FrameNews>(all[0]).frame, 3U);
  EXPECT_EQ(std::get<hil::AttitudeNews>(all[1]).trim_rad, (hil::TrimAngles{1e-3, -2e-3}));
  EXPECT_EQ(std::get<hil::AttitudeNews>(all[1]).measured.rate_rad_s,
            (std::array<double, 3>{1e-6, 2e-6, 3e-6}));
}

/// The row begins in the middle of a byte, at every place it can.
TEST(UsbPacket, ATelemetryRowFollowsTheImageWithoutAGap) {
  for (int width = 52; width < 70; ++width) {
    for (const int height : {1, 3, 4}) {
      engine::DnImage image(width, height);
      std::iota(image.pixels().begin(), image.pixels().end(), std::uint16_t{100});
      std::vector<std::uint16_t> row(static_cast<std::size_t>(width));
      std::iota(row.begin(), row.end(), std::uint16_t{1});
      hil::Frame frame = usb_frames::frame(1, image);
      frame.telemetry_row = row;
      const auto bytes = encoded(frame, PixelFormat::kPacked11);
      const auto h = drivers::decode_usb_header(bytes).value();
      EXPECT_EQ(h.rows_below, 1);
      std::vector<std::uint16_t> expected(image.pixels().begin(), image.pixels().end());
      expected.insert(expected.end(), row.begin(), row.end());
      std::vector<std::uint16_t> seen(expected.size());
      drivers::unpack_pixels(std::span<const std::byte>(bytes).subspan(
                                 drivers::kUsbHeaderBytes, h.payload_bytes - h.news_bytes),
                             seen);
      ASSERT_EQ(seen, expected) << width << " x " << height;
    }
  }
}

TEST(UsbPacket, WhatTheFormatCannotHoldIsRefused) {
  const auto image = usb_frames::image(1);
  hil::Frame frame = usb_frames::frame(1, image);
  std::vector<std::byte> out(100'000);
  frame.bits = 12;
  EXPECT_FALSE(drivers::encode_usb_frame(frame, PixelFormat::kPacked11, out).ok());
  EXPECT_TRUE(drivers::encode_usb_frame(frame, PixelFormat::kPlain16, out).ok());
  EXPECT_FALSE(
      drivers::encode_usb_frame(frame, PixelFormat::kPlain16, std::span(out).first(500)).ok());
  frame.pixels = nullptr;
  EXPECT_FALSE(drivers::encode_usb_frame(frame, PixelFormat::kPlain16, out).ok());
}

TEST(UsbPacket, AHeaderWithAnyBitWrongIsNone) {
  const auto image = usb_frames::image(1);
  auto bytes = encoded(usb_frames::frame(1, image), PixelFormat::kPacked11);
  for (std::size_t bit = 0; bit < 8 * drivers::kUsbHeaderBytes; ++bit) {
    bytes[bit / 8] ^= std::byte{1} << static_cast<int>(bit % 8);
    EXPECT_FALSE(drivers::decode_usb_header(bytes).ok()) << bit;
    bytes[bit / 8] ^= std::byte{1} << static_cast<int>(bit % 8);
  }
  for (std::size_t n = 0; n < drivers::kUsbHeaderBytes; ++n)
    EXPECT_FALSE(drivers::decode_usb_header(std::span(bytes).first(n)).ok());
  EXPECT_TRUE(drivers::decode_usb_header(bytes).ok());
}

TEST(UsbPacket, MessagesComeBackAndWrongOnesDoNot) {
  UsbMessage status;
  status.count = 9;
  status.session = 0xA1B2C3D4;
  status.status = {.credits = 5,
                   .good = 4,
                   .last_sequence = 77,
                   .bad_headers = 1,
                   .bad_checksums = 2,
                   .short_frames = 3,
                   .long_frames = 6,
                   .not_taken = 8};
  const std::vector<std::byte> packet(41, std::byte{0x5A});
  UsbMessage command;
  command.kind = UsbMessage::Kind::kCommand;
  command.command = packet;
  for (const UsbMessage& m : {status, command}) {
    std::array<std::byte, drivers::kLargestUsbMessage> storage{};
    const auto used = drivers::encode_usb_message(m, storage);
    ASSERT_TRUE(used.ok());
    const std::span<std::byte> bytes = std::span(storage).first(used.value());
    const auto back = drivers::decode_usb_message(bytes);
    ASSERT_TRUE(back.ok());
    EXPECT_EQ(back.value().kind, m.kind);
    EXPECT_EQ(back.value().count, m.count);
    EXPECT_EQ(back.value().session, m.session);
    EXPECT_EQ(back.value().status, m.status);
    EXPECT_TRUE(std::equal(back.value().command.begin(), back.value().command.end(),
                           m.command.begin(), m.command.end()));
    for (std::size_t bit = 0; bit < 8 * bytes.size(); ++bit) {
      bytes[bit / 8] ^= std::byte{1} << static_cast<int>(bit % 8);
      EXPECT_FALSE(drivers::decode_usb_message(bytes).ok()) << bit;
      bytes[bit / 8] ^= std::byte{1} << static_cast<int>(bit % 8);
    }
    for (std::size_t n = 0; n < bytes.size(); ++n)
      EXPECT_FALSE(drivers::decode_usb_message(bytes.first(n)).ok()) << n;
  }
  const std::vector<std::byte> too_long(drivers::kLargestUsbMessage);
  command.command = too_long;
  std::array<std::byte, 2 * drivers::kLargestUsbMessage> storage{};
  EXPECT_FALSE(drivers::encode_usb_message(command, storage).ok());
}

TEST(UsbPacket, LimitsComeBackAndWrongOnesDoNot) {
  const drivers::UsbLimits l = usb_frames::limits();
  auto bytes = drivers::encode_limits(l);
  const auto back = drivers::decode_limits(bytes);
  ASSERT_TRUE(back.ok());
  EXPECT_EQ(back.value().formats, l.formats);
  EXPECT_EQ(back.value().width_px, l.width_px);
  EXPECT_EQ(back.value().height_px, l.height_px);
  EXPECT_EQ(back.value().payload_bytes, l.payload_bytes);
  EXPECT_EQ(back.value().frames, l.frames);
  for (std::size_t bit = 0; bit < 8 * bytes.size(); ++bit) {
    bytes[bit / 8] ^= std::byte{1} << static_cast<int>(bit % 8);
    EXPECT_FALSE(drivers::decode_limits(bytes).ok()) << bit;
    bytes[bit / 8] ^= std::byte{1} << static_cast<int>(bit % 8);
  }
}

TEST(UsbPacket, RandomBytesAreNothing) {
  engine::Draws draws(5, engine::Stream::kLight, 0, 1);
  std::vector<std::byte> bytes(128);
  for (int i = 0; i < 100'000; ++i) {
    for (std::byte& b : bytes) b = static_cast<std::byte>(draws.bits());
    const auto n = static_cast<std::size_t>(draws.bits() % 129);
    ASSERT_FALSE(drivers::decode_usb_header(std::span(bytes).first(n)).ok());
    ASSERT_FALSE(drivers::decode_usb_message(std::span(bytes).first(n)).ok());
    ASSERT_FALSE(drivers::decode_limits(std::span(bytes).first(n)).ok());
  }
}

}  // namespace
