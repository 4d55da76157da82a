// The link through libusb itself, against a device and a usbfs of ours (usb_device_model.h).

#include "drivers/usb_link.h"

#include <cerrno>
#include <functional>
#include <stdexcept>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "hil/space_packet.h"
#include "tests/support/usb_device_model.h"
#include "tests/support/usb_frames.h"

namespace {

using drivers::UsbLink;
using engine::Duration;
using engine::Fault;
using engine::Status;
using test_support::UsbDeviceModel;

constexpr Duration kPatient{20'000'000'000};  // only a link that is wrong waits this long
constexpr Duration kShort{100'000'000};
constexpr int kRows = usb_frames::kHeight_px + 1;

Status send(UsbLink& link, std::uint64_t sequence, Duration timeout = kPatient) {
  const auto image = usb_frames::image(sequence);
  return link.send(usb_frames::frame(sequence, image), timeout);
}

std::vector<std::byte> command_bytes(std::uint64_t sequence) {
  hil::Command command;
  command.sequence = sequence;
  const hil::CommandPacket packet = hil::encode_command(command);
  return {packet.bytes().begin(), packet.bytes().end()};
}

class UsbLinkTest : public testing::Test {
 protected:
  [[nodiscard]] UsbLink make_link(bool packed = true) const {
    drivers::UsbSpec spec;
    spec.packed = packed;
    return UsbLink(spec, usb_frames::kWidth_px, kRows, 11);
  }
  void expect_next(std::uint64_t sequence) {
    device_.with([&](drivers::FrameIntake& intake) {
      const auto frame = intake.front();
      ASSERT_TRUE(frame.has_value()) << sequence;
      EXPECT_TRUE(usb_frames::shows(*frame, sequence)) << sequence;
      intake.pop();
    });
  }
  [[nodiscard]] drivers::UsbStatus device_status() {
    drivers::UsbStatus status;
    device_.with([&](drivers::FrameIntake& intake) { status = intake.status(); });
    return status;
  }
  /// Until it is so; what never is ends with the test's own limit.
  static void wait_until(const std::function<bool()>& so) {
    while (!so()) std::this_thread::yield();
  }

  UsbDeviceModel device_{usb_frames::limits()};
};

TEST_F(UsbLinkTest, FramesArriveWholeInBothFormats) {
  device_.plug();
  for (const bool packed : {true, false}) {
    UsbLink link = make_link(packed);
    EXPECT_TRUE(link.has_reader());
    for (std::uint64_t k = 1; k <= 20; ++k) {
      const Status sent = send(link, k);
      ASSERT_TRUE(sent.ok()) << sent.error().step;
      device_.with([&](drivers::FrameIntake& intake) {
        EXPECT_EQ(intake.front()->header.format,
                  packed ? drivers::PixelFormat::kPacked11 : drivers::PixelFormat::kPlain16);
      });
      expect_next(k);
    }
    EXPECT_EQ(device_status().good, 20U);
    EXPECT_EQ(link.counts().resets, 1U);
  }
}

TEST_F(UsbLinkTest, CommandsComeBackInOrderAndWrongMessagesAreCounted) {
  device_.plug();
  UsbLink link = make_link();
  ASSERT_TRUE(send(link, 1).ok());
  // What the device said before the session began may be one already.
  const std::uint64_t before = link.counts().bad_messages;
  device_.say(std::vector<std::byte>(40, std::byte{0x55}));
  device_.with([](drivers::FrameIntake& intake) {
    for (std::uint64_t k = 1; k <= 10; ++k) ASSERT_TRUE(intake.command(command_bytes(k)));
    ASSERT_TRUE(intake.command(std::vector<std::byte>(30, std::byte{1})));  // no Space Packet
  });
  for (std::uint64_t k = 1; k <= 10; ++k) {
    const auto command = link.receive(kPatient);
    ASSERT_TRUE(command.ok()) << k;
    EXPECT_EQ(command.value().sequence, k);
    EXPECT_EQ(command.value().sender, 1U);
  }
  EXPECT_EQ(link.receive(kPatient).error().fault, Fault::kRejected);
  EXPECT_EQ(link.receive(Duration{}).error().fault, Fault::kTimeout);
  EXPECT_EQ(link.counts().bad_messages, before + 1);
}

TEST_F(UsbLinkTest, WithoutACreditNothingIsSentAndTheSenderIsBusy) {
  device_.plug();
  UsbLink link = make_link();
  ASSERT_TRUE(send(link, 1).ok());
  ASSERT_TRUE(send(link, 2).ok());
  const Status third = send(link, 3, kShort);
  ASSERT_FALSE(third.ok());
  EXPECT_EQ(third.error().fault, Fault::kBusy);
  const drivers::UsbStatus status = device_status();
  EXPECT_EQ(status.good, 2U);
  EXPECT_EQ(status.not_taken + status.short_frames + status.bad_headers, 0U);
  expect_next(1);
  ASSERT_TRUE(send(link, 4).ok());
  expect_next(2);
  expect_next(4);
  EXPECT_EQ(device_.resets(), 1) << "a device without room is in step";
}

TEST_F(UsbLinkTest, ACreditWhoseMessageWasLostIsAskedFor) {
  device_.plug();
  UsbLink link = make_link();
  ASSERT_TRUE(send(link, 1).ok());
  ASSERT_TRUE(send(link, 2).ok());
  device_.lose_messages(true);
  expect_next(1);
  expect_next(2);
  wait_until([&] { return device_.messages_lost() > 0; });
  device_.lose_messages(false);
  EXPECT_EQ(send(link, 3, kShort).error().fault, Fault::kBusy);
  for (std::uint64_t k = 4; k <= 6; ++k) {
    const Status sent = send(link, k);
    ASSERT_TRUE(sent.ok()) << k << ": " << sent.error().step;
    expect_next(k);
  }
  EXPECT_EQ(link.counts().status_requests, 1U);
  EXPECT_EQ(device_.resets(), 1);
}

TEST_F(UsbLinkTest, ADeviceThatHasNoRoomIsAskedOnceAFrameAndNoFrameIsBegun) {
  device_.plug();
  UsbLink link = make_link();
  ASSERT_TRUE(send(link, 1).ok());
  ASSERT_TRUE(send(link, 2).ok());
  for (std::uint64_t k = 3; k <= 6; ++k) {
    EXPECT_EQ(send(link, k, kShort).error().fault, Fault::kBusy);
    EXPECT_EQ(link.counts().status_requests, k - 3);
  }
  EXPECT_EQ(device_status().good, 2U);
  EXPECT_EQ(device_.resets(), 1);
}

TEST_F(UsbLinkTest, ADeviceThatForgotTheSessionGetsANewOne) {
  device_.plug();
  UsbLink link = make_link();
  ASSERT_TRUE(send(link, 1).ok());
  ASSERT_TRUE(send(link, 2).ok());
  // Its software was started anew, and its place on the bus is the same.
  device_.with([](drivers::FrameIntake& intake) { intake.reset(0); });
  EXPECT_EQ(send(link, 3, kShort).error().fault, Fault::kBusy);
  const Status next = send(link, 4);
  ASSERT_TRUE(next.ok()) << next.error().step;
  expect_next(4);
  EXPECT_EQ(link.counts().resets, 2U);
}

TEST_F(UsbLinkTest, AfterAStallInAFrameTheNextOneArrives) {
  device_.plug();
  UsbLink link = make_link();
  ASSERT_TRUE(send(link, 1).ok());
  expect_next(1);
  for (const std::size_t at : {0U, 64U, 512U, 3000U}) {
    device_.stall_after(at);
    const Status stalled = send(link, 2);
    ASSERT_FALSE(stalled.ok()) << at;
    EXPECT_EQ(stalled.error().fault, Fault::kRejected);
    const Status next = send(link, 3);
    ASSERT_TRUE(next.ok()) << next.error().step;
    expect_next(3);
  }
  EXPECT_EQ(link.counts().halts, 4U);
  EXPECT_EQ(link.counts().resets, 5U);
}

TEST_F(UsbLinkTest, AfterAFrameThatDidNotGoOutInTimeTheNextOneArrives) {
  device_.plug();
  UsbLink link = make_link();
  ASSERT_TRUE(send(link, 1).ok());
  expect_next(1);
  for (const std::size_t at : {0U, 65U, 2000U}) {
    device_.stop_after(at);
    const Status late = send(link, 2, kShort);
    ASSERT_FALSE(late.ok()) << at;
    EXPECT_EQ(late.error().fault, Fault::kTimeout);
    device_.go_on();
    const Status next = send(link, 3);
    ASSERT_TRUE(next.ok()) << next.error().step;
    expect_next(3);
  }
}

TEST_F(UsbLinkTest, ADeviceThatIsUnpluggedIsTakenUpAgainWhenItComesBack) {
  device_.plug();
  UsbLink link = make_link();
  for (std::uint64_t round = 1; round <= 5; ++round) {
    ASSERT_TRUE(send(link, round).ok());
    expect_next(round);
    // In the middle of a frame, every other time.
    if (round % 2 == 0) {
      device_.stop_after(1000);
      std::thread cable([this] {
        wait_until([this] { return device_status().good > 0; });
        device_.unplug();
      });
      EXPECT_FALSE(send(link, 100).ok());
      cable.join();
    } else {
      device_.unplug();
    }
    device_.go_on();
    wait_until([&] { return !link.has_reader(); });
    EXPECT_EQ(send(link, 101).error().fault, Fault::kDisconnected);
    device_.plug();
    wait_until([&] { return link.has_reader(); });
    EXPECT_EQ(link.counts().connections, round + 1);
  }
  ASSERT_TRUE(send(link, 50).ok());
  expect_next(50);
}

TEST_F(UsbLinkTest, ADeviceThatWentAndCameBetweenTwoFramesGetsASessionOfItsOwn) {
  device_.plug();
  UsbLink link = make_link();
  for (std::uint64_t k = 1; k <= 5; ++k) {
    ASSERT_TRUE(send(link, k).ok());
    expect_next(k);
  }
  device_.unplug();
  wait_until([&] { return !link.has_reader(); });
  device_.plug();
  wait_until([&] { return link.has_reader(); });
  for (std::uint64_t k = 6; k <= 20; ++k) {
    const Status sent = send(link, k);
    ASSERT_TRUE(sent.ok()) << k << ": " << sent.error().step;
    expect_next(k);
  }
  EXPECT_EQ(link.counts().resets, 2U);
}

TEST_F(UsbLinkTest, ADeviceThatComesLaterIsWaitedFor) {
  UsbLink link = make_link();
  EXPECT_FALSE(link.has_reader());
  EXPECT_EQ(send(link, 1).error().fault, Fault::kDisconnected);
  device_.plug();
  wait_until([&] { return link.has_reader(); });
  ASSERT_TRUE(send(link, 2).ok());
  expect_next(2);
}

TEST_F(UsbLinkTest, ErrorsOfTheReturnPathAreCountedAndCommandsGoOnComing) {
  device_.plug();
  UsbLink link = make_link();
  ASSERT_TRUE(send(link, 1).ok());
  expect_next(1);
  std::uint64_t sequence = 0;
  for (const int error : {EPIPE, EOVERFLOW, EPROTO}) {
    for (int i = 0; i < 4; ++i) device_.fail_next_in(error);
    device_.with([&](drivers::FrameIntake& intake) {
      ASSERT_TRUE(intake.command(command_bytes(++sequence)));
    });
    const auto command = link.receive(kPatient);
    ASSERT_TRUE(command.ok()) << error;
    EXPECT_EQ(command.value().sequence, sequence);
  }
  EXPECT_EQ(link.counts().in_errors, 8U);
  EXPECT_GE(link.counts().halts, 1U);
  ASSERT_TRUE(send(link, 2).ok());
}

TEST(UsbLinkLimits, ADeviceThatIsTooSmallIsRefusedWithBothSizes) {
  drivers::UsbLimits small = usb_frames::limits();
  small.width_px = 64;
  UsbDeviceModel device(small);
  device.plug();
  try {
    const UsbLink link({}, usb_frames::kWidth_px, kRows, 11);
    FAIL() << "taken";
  } catch (const std::runtime_error& e) {
    EXPECT_NE(std::string(e.what()).find("64 x 51"), std::string::npos) << e.what();
    EXPECT_NE(std::string(e.what()).find("72 x 51"), std::string::npos) << e.what();
  }
}

TEST(UsbLinkLimits, ADeviceWithoutTheFormatGetsTheOther) {
  drivers::UsbLimits plain = usb_frames::limits();
  plain.formats = 1;
  UsbDeviceModel device(plain);
  device.plug();
  UsbLink link({}, usb_frames::kWidth_px, kRows, 11);
  ASSERT_TRUE(send(link, 1).ok());
  device.with([](drivers::FrameIntake& intake) {
    ASSERT_TRUE(intake.front().has_value());
    EXPECT_EQ(intake.front()->header.format, drivers::PixelFormat::kPlain16);
  });
}

}  // namespace
