#include "drivers/usb_device/frame_intake.h"

#include <algorithm>
#include <vector>

#include <gtest/gtest.h>

#include "engine/core/random.h"
#include "hil/space_packet.h"
#include "tests/support/usb_frames.h"

namespace {

using drivers::FrameIntake;
using drivers::PixelFormat;
using drivers::UsbMessage;
using drivers::UsbStatus;

std::vector<std::byte> frame_bytes(std::uint64_t sequence,
                                   PixelFormat format = PixelFormat::kPacked11) {
  const auto image = usb_frames::image(sequence);
  std::vector<std::byte> out(
      drivers::kUsbHeaderBytes +
      drivers::usb_payload_bytes(format, usb_frames::kWidth_px, usb_frames::kHeight_px));
  out.resize(drivers::encode_usb_frame(usb_frames::frame(sequence, image), format, out).value());
  return out;
}

/// As a driver would: in pieces, the last one with the end.
void take(FrameIntake& intake, std::span<const std::byte> bytes, std::size_t piece) {
  while (bytes.size() > piece) {
    intake.take(bytes.first(piece), false);
    bytes = bytes.subspan(piece);
  }
  intake.take(bytes, true);
}

void expect_whole(FrameIntake& intake, std::uint64_t sequence) {
  const auto frame = intake.front();
  ASSERT_TRUE(frame.has_value()) << sequence;
  EXPECT_TRUE(usb_frames::shows(*frame, sequence)) << sequence;
  intake.pop();
}

TEST(FrameIntake, FramesInPiecesOfAnySizeAreWhole) {
  FrameIntake intake(usb_frames::limits());
  std::uint64_t sequence = 0;
  for (const std::size_t piece : {1U, 7U, 63U, 64U, 65U, 512U, 100'000U}) {
    for (const PixelFormat format : {PixelFormat::kPlain16, PixelFormat::kPacked11}) {
      take(intake, frame_bytes(++sequence, format), piece);
      expect_whole(intake, sequence);
    }
  }
  EXPECT_EQ(intake.status().good, sequence);
  EXPECT_EQ(intake.status().last_sequence, sequence);
  EXPECT_EQ(intake.status().credits, 2 + sequence);
}

TEST(FrameIntake, AnEndAnywhereInAFrameCostsThatFrameAlone) {
  FrameIntake intake(usb_frames::limits());
  const auto bytes = frame_bytes(1);
  std::uint32_t cut = 0;
  for (std::size_t n = 1; n < bytes.size(); n += 61) {
    intake.take(std::span(bytes).first(n), true);
    ++cut;
    EXPECT_FALSE(intake.front().has_value()) << n;
    ASSERT_EQ(intake.status().short_frames, cut);
    ASSERT_EQ(intake.status().credits, 2 + cut);
  }
  take(intake, frame_bytes(2), 512);
  expect_whole(intake, 2);
}

TEST(FrameIntake, AZeroLengthPacketEndsAFrameAndBetweenFramesSaysNothing) {
  FrameIntake intake(usb_frames::limits());
  for (int i = 0; i < 5; ++i) intake.take({}, true);
  const auto bytes = frame_bytes(1);
  intake.take(bytes, false);
  EXPECT_FALSE(intake.front().has_value()) << "not over yet";
  intake.take({}, true);
  expect_whole(intake, 1);
  EXPECT_EQ(intake.status().short_frames, 0U);
}

TEST(FrameIntake, AFrameThatGoesOnIsNone) {
  FrameIntake intake(usb_frames::limits());
  auto bytes = frame_bytes(1);
  bytes.push_back(std::byte{0});
  take(intake, bytes, 512);
  EXPECT_FALSE(intake.front().has_value());
  EXPECT_EQ(intake.status().long_frames, 1U);
  EXPECT_EQ(intake.status().credits, 3U);
  take(intake, frame_bytes(2), 512);
  expect_whole(intake, 2);
}

TEST(FrameIntake, TwoFramesWithoutAnEndBetweenThemAreNone) {
  FrameIntake intake(usb_frames::limits());
  auto bytes = frame_bytes(1);
  const auto second = frame_bytes(2);
  bytes.insert(bytes.end(), second.begin(), second.end());
  take(intake, bytes, 512);
  EXPECT_FALSE(intake.front().has_value());
  take(intake, frame_bytes(3), 512);
  expect_whole(intake, 3);
}

TEST(FrameIntake, ABitWrongInThePayloadIsSeen) {
  FrameIntake intake(usb_frames::limits());
  auto bytes = frame_bytes(1);
  for (const std::size_t at : {drivers::kUsbHeaderBytes, bytes.size() / 2, bytes.size() - 1}) {
    bytes[at] ^= std::byte{1};
    take(intake, bytes, 512);
    bytes[at] ^= std::byte{1};
    EXPECT_FALSE(intake.front().has_value());
  }
  EXPECT_EQ(intake.status().bad_checksums, 3U);
  EXPECT_EQ(intake.status().credits, 5U);
}

TEST(FrameIntake, WhatTheDeviceCannotTakeIsABadHeader) {
  drivers::UsbLimits small = usb_frames::limits();
  small.formats = 1;
  FrameIntake plain_only(small);
  take(plain_only, frame_bytes(1, PixelFormat::kPacked11), 512);
  EXPECT_EQ(plain_only.status().bad_headers, 1U);
  small = usb_frames::limits();
  small.width_px = usb_frames::kWidth_px - 1;
  FrameIntake narrow(small);
  take(narrow, frame_bytes(1), 512);
  EXPECT_EQ(narrow.status().bad_headers, 1U);
  small = usb_frames::limits();
  small.payload_bytes = 100;
  FrameIntake tiny(small);
  take(tiny, frame_bytes(1), 512);
  EXPECT_EQ(tiny.status().bad_headers, 1U);
}

TEST(FrameIntake, AFrameWithoutACreditIsNotTakenAndNothingIsOverwritten) {
  FrameIntake intake(usb_frames::limits());
  for (std::uint64_t k = 1; k <= 4; ++k) take(intake, frame_bytes(k), 512);
  EXPECT_EQ(intake.status().good, 2U);
  EXPECT_EQ(intake.status().not_taken, 2U);
  EXPECT_EQ(intake.status().credits, 2U);
  expect_whole(intake, 1);
  take(intake, frame_bytes(5), 512);
  expect_whole(intake, 2);
  expect_whole(intake, 5);
}

TEST(FrameIntake, AResetForgetsTheFrameInHandAndAllCounts) {
  FrameIntake intake(usb_frames::limits());
  take(intake, frame_bytes(1), 512);
  const auto second = frame_bytes(2);
  intake.take(std::span(second).first(900), false);
  intake.reset(77);
  EXPECT_FALSE(intake.front().has_value());
  UsbStatus fresh;
  fresh.credits = 2;
  EXPECT_EQ(intake.status(), fresh);
  take(intake, frame_bytes(3), 512);
  expect_whole(intake, 3);
  std::array<std::byte, drivers::kLargestUsbMessage> out{};
  const std::size_t n = intake.next_message(out);
  EXPECT_EQ(drivers::decode_usb_message(std::span(out).first(n)).value().session, 77U);
}

TEST(FrameIntake, SaysItsStatusWhenThereIsNewsAndCommandsInOrder) {
  FrameIntake intake(usb_frames::limits());
  std::array<std::byte, drivers::kLargestUsbMessage> out{};
  const auto next = [&] {
    const std::size_t n = intake.next_message(out);
    return n == 0 ? std::optional<UsbMessage>()
                  : drivers::decode_usb_message(std::span(out).first(n)).value();
  };
  ASSERT_TRUE(next().has_value());  // the first status tells the credits
  EXPECT_FALSE(next().has_value());
  take(intake, frame_bytes(1), 512);
  for (std::byte b{1}; b < std::byte{20}; b = static_cast<std::byte>(std::to_integer<int>(b) + 1)) {
    const std::array packet{b};
    EXPECT_EQ(intake.command(packet), b <= std::byte{16});
  }
  EXPECT_EQ(next()->status.good, 1U);
  for (int i = 1; i <= 16; ++i) {
    const auto m = next();
    ASSERT_TRUE(m.has_value());
    EXPECT_EQ(m->kind, UsbMessage::Kind::kCommand);
    EXPECT_EQ(std::to_integer<int>(m->command[0]), i);
    EXPECT_EQ(m->count, 1 + i);
  }
  EXPECT_FALSE(next().has_value());
}

TEST(FrameIntake, AStatusThatChangesAllTheTimeDoesNotKeepCommandsBack) {
  FrameIntake intake(usb_frames::limits());
  std::array<std::byte, drivers::kLargestUsbMessage> out{};
  int commands = 0;
  for (std::uint64_t k = 1; k <= 10; ++k) {
    take(intake, frame_bytes(k), 512);
    expect_whole(intake, k);
    const std::array packet{std::byte{7}};
    ASSERT_TRUE(intake.command(packet));
    // One message a frame: half of them are statuses.
    const std::size_t n = intake.next_message(out);
    const auto m = drivers::decode_usb_message(std::span(out).first(n));
    ASSERT_TRUE(m.ok());
    commands += m.value().kind == UsbMessage::Kind::kCommand ? 1 : 0;
  }
  EXPECT_EQ(commands, 5);
}

/// Whatever is on the cable: every frame that comes out is one that went in, unharmed, and after
/// the next end the device is in step again.
TEST(FrameIntake, GarbageOfAnyKindCostsNoFrameButItsOwn) {
  engine::Draws draws(11, engine::Stream::kLight, 0, 2);
  FrameIntake intake(usb_frames::limits());
  std::uint64_t sequence = 0;
  for (int i = 0; i < 2000; ++i) {
    std::vector<std::byte> noise;
    switch (draws.bits() % 4) {
      case 0:  // random bytes
        noise.resize(draws.bits() % 3000);
        for (std::byte& b : noise) b = static_cast<std::byte>(draws.bits());
        break;
      case 1:  // a frame that is cut
        noise = frame_bytes(1'000'000);
        noise.resize(draws.bits() % noise.size());
        break;
      case 2: {  // a frame from its middle on
        const auto whole = frame_bytes(1'000'000);
        const auto from = static_cast<std::ptrdiff_t>(1 + draws.bits() % (whole.size() - 1));
        noise.assign(whole.begin() + from, whole.end());
        break;
      }
      default:  // a bit wrong anywhere
        noise = frame_bytes(1'000'000);
        noise[draws.bits() % noise.size()] ^= std::byte{1} << static_cast<int>(draws.bits() % 8);
    }
    take(intake, noise, 1 + draws.bits() % 700);
    ASSERT_FALSE(intake.front().has_value()) << i;
    take(intake, frame_bytes(++sequence), 512);
    expect_whole(intake, sequence);
    if (HasFatalFailure()) return;
  }
}

}  // namespace
