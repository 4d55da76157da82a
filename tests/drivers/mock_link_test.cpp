#include "drivers/mock_link.h"

#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "hil/space_packet.h"

namespace {

using drivers::MockLink;
using engine::DnImage;
using engine::Duration;
using engine::Fault;
using hil::Command;
using hil::Frame;

constexpr Duration kAtOnce{};
constexpr Duration kShort{1'000'000};
constexpr Duration kLong{20'000'000'000};  // only a link that is wrong waits this long

DnImage grey(std::uint16_t value) {
  DnImage image(6, 4);
  for (std::uint16_t& pixel : image.pixels()) pixel = value;
  return image;
}

Frame frame_of(std::uint64_t sequence, const DnImage& pixels) {
  Frame frame;
  frame.sequence = sequence;
  frame.pixels = &pixels;
  return frame;
}

std::vector<std::byte> command_bytes(std::uint64_t sequence) {
  Command command;
  command.sequence = sequence;
  const hil::CommandPacket packet = hil::encode_command(command);
  return {packet.bytes().begin(), packet.bytes().end()};
}

/// The sequence of the frame that the device sees next, and its first pixel.
void expect_next(MockLink& link, std::uint64_t sequence, std::uint16_t value) {
  const auto bytes = link.next_frame(kAtOnce);
  ASSERT_TRUE(bytes.ok()) << sequence;
  const auto view = drivers::decode_frame(bytes.value());
  ASSERT_TRUE(view.ok()) << view.error().step;
  EXPECT_EQ(view.value().frame.sequence, sequence);
  EXPECT_EQ(view.value().pixels[0], static_cast<std::byte>(value & 0xFF));
  link.release_frame();
}

TEST(MockLink, FramesArriveAsBytesInTheOrderTheyWereSent) {
  MockLink link(6, 4);
  for (std::uint64_t k = 0; k < 20; ++k) {
    const DnImage pixels = grey(static_cast<std::uint16_t>(k));
    ASSERT_TRUE(link.send(frame_of(k, pixels), kAtOnce).ok());
    expect_next(link, k, static_cast<std::uint16_t>(k));
  }
}

TEST(MockLink, TheDeviceTimesOutWhenThereIsNoFrame) {
  MockLink link(6, 4);
  const auto none = link.next_frame(kShort);
  ASSERT_FALSE(none.ok());
  EXPECT_EQ(none.error().fault, Fault::kTimeout);
}

TEST(MockLink, ADeviceThatHoldsItsSlotsGetsBusyAndTheSenderRecovers) {
  MockLink link(6, 4);
  for (std::uint64_t k = 0; k < 3; ++k) ASSERT_TRUE(link.send(frame_of(k, grey(1)), kAtOnce).ok());
  for (const Duration timeout : {kAtOnce, kShort}) {
    const auto status = link.send(frame_of(99, grey(9)), timeout);
    ASSERT_FALSE(status.ok());
    EXPECT_EQ(status.error().fault, Fault::kBusy);
  }
  // Reading alone gives no slot back; releasing does. The refused frames left no trace.
  ASSERT_TRUE(link.next_frame(kAtOnce).ok());
  EXPECT_FALSE(link.send(frame_of(99, grey(9)), kAtOnce).ok());
  link.release_frame();
  ASSERT_TRUE(link.send(frame_of(3, grey(4)), kAtOnce).ok());
  expect_next(link, 1, 1);
  expect_next(link, 2, 1);
  expect_next(link, 3, 4);
  EXPECT_FALSE(link.next_frame(kAtOnce).ok());
}

TEST(MockLink, TheBytesStayTheDevicesUntilItReleasesThem) {
  MockLink link(6, 4);
  ASSERT_TRUE(link.send(frame_of(0, grey(7)), kAtOnce).ok());
  const auto held = link.next_frame(kAtOnce);
  ASSERT_TRUE(held.ok());
  std::uint64_t k = 1;
  while (link.send(frame_of(k, grey(200)), kAtOnce).ok()) ++k;
  EXPECT_EQ(k, 3U);
  const auto view = drivers::decode_frame(held.value());
  ASSERT_TRUE(view.ok());
  EXPECT_EQ(view.value().frame.sequence, 0U);
  EXPECT_EQ(view.value().pixels[0], std::byte{7});
}

TEST(MockLink, AFrameLargerThanTheLinkIsRefusedAndCostsNoSlot) {
  MockLink link(6, 4);
  const DnImage large(7, 5);
  for (int i = 0; i < 10; ++i) {
    const auto status = link.send(frame_of(99, large), kAtOnce);
    ASSERT_FALSE(status.ok());
    EXPECT_EQ(status.error().fault, Fault::kRejected);
  }
  for (std::uint64_t k = 0; k < 3; ++k) EXPECT_TRUE(link.send(frame_of(k, grey(1)), kAtOnce).ok());
  for (std::uint64_t k = 0; k < 3; ++k) expect_next(link, k, 1);
}

TEST(MockLink, RepliesArriveAsCommandsInOrder) {
  MockLink link(6, 4);
  for (std::uint64_t i = 0; i < 10; ++i) ASSERT_TRUE(link.reply(command_bytes(i)).ok());
  for (std::uint64_t i = 0; i < 10; ++i) {
    const auto command = link.receive(kAtOnce);
    ASSERT_TRUE(command.ok());
    EXPECT_EQ(command.value().sequence, i);
  }
  const auto none = link.receive(kShort);
  ASSERT_FALSE(none.ok());
  EXPECT_EQ(none.error().fault, Fault::kTimeout);
}

TEST(MockLink, AReplyOfMoreThan256BytesIsRefusedAtOnce) {
  MockLink link(6, 4);
  const std::vector<std::byte> bytes(257);
  const auto status = link.reply(bytes);
  ASSERT_FALSE(status.ok());
  EXPECT_EQ(status.error().fault, Fault::kRejected);
  EXPECT_FALSE(link.receive(kAtOnce).ok());
  EXPECT_TRUE(link.reply(std::span(bytes).first(256)).ok());
}

TEST(MockLink, GarbageReachesTheReceiverAsRejectedAndTheNextCommandIsGood) {
  MockLink link(6, 4);
  auto damaged = command_bytes(1);
  damaged[20] ^= std::byte{4};
  const std::vector<std::vector<std::byte>> garbage = {{},
                                                       std::vector<std::byte>(1),
                                                       std::vector<std::byte>(71),
                                                       std::vector<std::byte>(72),
                                                       std::vector<std::byte>(73),
                                                       std::vector<std::byte>(256),
                                                       damaged};
  for (const auto& bytes : garbage) {
    ASSERT_TRUE(link.reply(bytes).ok());
    const auto got = link.receive(kAtOnce);
    ASSERT_FALSE(got.ok());
    EXPECT_EQ(got.error().fault, Fault::kRejected) << bytes.size();
  }
  ASSERT_TRUE(link.reply(command_bytes(5)).ok());
  const auto good = link.receive(kAtOnce);
  ASSERT_TRUE(good.ok());
  EXPECT_EQ(good.value().sequence, 5U);
}

TEST(MockLink, RepliesThatNobodyTakesGetBusyAfter64AndNoneOfThoseIsLost) {
  MockLink link(6, 4);
  for (std::uint64_t i = 0; i < 64; ++i) ASSERT_TRUE(link.reply(command_bytes(i)).ok());
  const auto status = link.reply(command_bytes(64));
  ASSERT_FALSE(status.ok());
  EXPECT_EQ(status.error().fault, Fault::kBusy);
  for (std::uint64_t i = 0; i < 64; ++i) {
    const auto command = link.receive(kAtOnce);
    ASSERT_TRUE(command.ok());
    EXPECT_EQ(command.value().sequence, i);
    if (i == 0) {
      ASSERT_TRUE(link.reply(command_bytes(65)).ok());
    }
  }
  const auto last = link.receive(kAtOnce);
  ASSERT_TRUE(last.ok());
  EXPECT_EQ(last.value().sequence, 65U);
  EXPECT_FALSE(link.receive(kAtOnce).ok());
}

TEST(MockLink, ThreeThreadsPassEveryFrameAndEveryAnswerWholeAndInOrder) {
  constexpr std::uint64_t kFrames = 5000;
  MockLink link(6, 4);
  std::uint64_t bad_frames = 0;
  std::jthread device([&] {
    for (std::uint64_t k = 0; k < kFrames; ++k) {
      const auto bytes = link.next_frame(kLong);
      if (!bytes.ok()) return;
      const auto view = drivers::decode_frame(bytes.value());
      if (!view.ok() || view.value().frame.sequence != k) ++bad_frames;
      link.release_frame();
      while (!link.reply(command_bytes(k)).ok()) std::this_thread::yield();
    }
  });
  std::uint64_t bad_commands = 0;
  std::jthread receiver([&] {
    for (std::uint64_t k = 0; k < kFrames; ++k) {
      const auto command = link.receive(kLong);
      if (!command.ok() || command.value().sequence != k) ++bad_commands;
    }
  });
  std::uint64_t not_sent = 0;
  for (std::uint64_t k = 0; k < kFrames; ++k) {
    const DnImage pixels = grey(static_cast<std::uint16_t>(k));
    if (!link.send(frame_of(k, pixels), kLong).ok()) ++not_sent;
  }
  device.join();
  receiver.join();
  EXPECT_EQ(not_sent, 0U);
  EXPECT_EQ(bad_frames, 0U);
  EXPECT_EQ(bad_commands, 0U);
}

}  // namespace
