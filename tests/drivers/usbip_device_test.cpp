// The device against a host of ours that speaks USB/IP as the kernel's vhci-hcd does.

#include "drivers/usb_device/usbip_device.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <vector>

#include <gtest/gtest.h>

#include "drivers/usb_device/injection_device.h"
#include "engine/core/random.h"
#include "hil/big_endian.h"
#include "tests/support/usb_frames.h"
#include "tests/support/usbip_host.h"

namespace {

using drivers::InjectionDevice;
using drivers::UsbIpDevice;
using drivers::UsbMessage;
using usbip_host::Bytes;
using usbip_host::import_request;
using usbip_host::kIn;
using usbip_host::kOut;
using usbip_host::kZeroPacket;
using usbip_host::submit;
using usbip_host::unlink;
using usbip_host::Words;

struct Reply {
  std::uint32_t command = 0;
  std::uint32_t number = 0;
  int status = 0;
  std::uint32_t bytes = 0;
  Bytes data;
};

/// Replies to transfers, of which those in `with_data` bring data.
std::vector<Reply> replies_of(UsbIpDevice& device, const std::vector<std::uint32_t>& with_data) {
  const Bytes all = device.replies();
  std::vector<Reply> replies;
  std::size_t at = 0;
  const auto word = [&all](std::size_t place) {
    return hil::BigEndianReader(all, place).get<std::uint32_t>();
  };
  while (at + 48 <= all.size()) {
    Reply r;
    r.command = word(at);
    r.number = word(at + 4);
    r.status = static_cast<int>(word(at + 20));
    r.bytes = r.command == 3 ? word(at + 24) : 0;
    at += 48;
    if (std::find(with_data.begin(), with_data.end(), r.number) != with_data.end()) {
      r.data.assign(all.begin() + static_cast<std::ptrdiff_t>(at),
                    all.begin() + static_cast<std::ptrdiff_t>(at + r.bytes));
      at += r.bytes;
    }
    replies.push_back(std::move(r));
  }
  EXPECT_EQ(at, all.size());
  return replies;
}

class UsbIp : public testing::Test {
 protected:
  void attach() {
    ASSERT_TRUE(device_.take(import_request("1-1")));
    ASSERT_TRUE(device_.attached());
    static_cast<void>(device_.replies());
  }
  InjectionDevice function_{usb_frames::limits()};
  UsbIpDevice device_{function_};
};

Bytes frame_bytes(std::uint64_t sequence) {
  const auto image = usb_frames::image(sequence);
  Bytes out(drivers::kUsbHeaderBytes + drivers::usb_payload_bytes(drivers::PixelFormat::kPacked11,
                                                                  usb_frames::kWidth_px,
                                                                  usb_frames::kHeight_px));
  out.resize(drivers::encode_usb_frame(usb_frames::frame(sequence, image),
                                       drivers::PixelFormat::kPacked11, out)
                 .value());
  return out;
}

TEST_F(UsbIp, ListsOneDeviceWithItsInterface) {
  ASSERT_TRUE(device_.take(Words().half(0x0111).half(0x8005).word(0).bytes()));
  const Bytes reply = device_.replies();
  ASSERT_EQ(reply.size(), 8U + 4 + 312 + 4);
  const auto at = [&](std::size_t i) { return std::to_integer<unsigned>(reply[i]); };
  EXPECT_EQ(at(3), 0x05U);            // the answer to 8005
  EXPECT_EQ(at(11), 1U);              // one device
  EXPECT_EQ(at(12 + 256), '1' + 0U);  // bus id
  EXPECT_EQ(at(12 + 288 + 11), 3U);   // high speed
  EXPECT_EQ(at(12 + 300), 0x12U);     // vendor
  EXPECT_EQ(at(324), 0xFFU);          // interface
  EXPECT_EQ(at(325), 0x53U);
  EXPECT_FALSE(device_.attached());
}

TEST_F(UsbIp, ImportsItsOwnBusIdAndNoOther) {
  ASSERT_TRUE(device_.take(import_request("3-2")));
  EXPECT_FALSE(device_.attached());
  EXPECT_EQ(device_.replies(), Words().half(0x0111).half(0x0003).word(1).bytes());
  ASSERT_TRUE(device_.take(import_request("1-1")));
  EXPECT_TRUE(device_.attached());
  EXPECT_EQ(device_.replies().size(), 8U + 312);
}

TEST_F(UsbIp, AKernelCanEnumerateIt) {
  attach();
  ASSERT_TRUE(device_.take(submit(1, kIn, 0, 0, 64, {0x80, 6, 0, 1, 0, 0, 64, 0})));  // device
  ASSERT_TRUE(device_.take(submit(2, kIn, 0, 0, 9, {0x80, 6, 0, 2, 0, 0, 9, 0})));  // configuration
  ASSERT_TRUE(device_.take(submit(3, kIn, 0, 0, 255, {0x80, 6, 0, 2, 0, 0, 255, 0})));
  ASSERT_TRUE(device_.take(submit(4, kIn, 0, 0, 255, {0x80, 6, 2, 3, 9, 4, 255, 0})));  // string
  ASSERT_TRUE(device_.take(submit(5, kIn, 0, 0, 10, {0x80, 6, 0, 6, 0, 0, 10, 0})));    // qualifier
  ASSERT_TRUE(device_.take(submit(6, kOut, 0, 0, 0, {0, 9, 1, 0, 0, 0, 0, 0})));
  const auto r = replies_of(device_, {1, 2, 3, 4});
  ASSERT_EQ(r.size(), 6U);
  EXPECT_EQ(r[0].bytes, 18U);
  EXPECT_EQ(r[1].bytes, 9U);
  ASSERT_EQ(r[2].bytes, 32U);
  EXPECT_EQ(std::to_integer<unsigned>(r[2].data[2]), r[2].bytes);  // it says its own length
  EXPECT_EQ(std::to_integer<unsigned>(r[3].data[0]), r[3].bytes);
  EXPECT_EQ(r[4].status, -EPIPE);
  EXPECT_EQ(r[5].status, 0);
}

TEST_F(UsbIp, LimitsResetAndStatusAreThoseOfTheProtocol) {
  attach();
  const Bytes session = {std::byte{4}, std::byte{3}, std::byte{2}, std::byte{1}};
  ASSERT_TRUE(device_.take(submit(1, kIn, 0, 0, 32, {0xC1, 1, 0, 0, 0, 0, 32, 0})));
  ASSERT_TRUE(device_.take(submit(2, kOut, 0, 0, 4, {0x41, 2, 0, 0, 0, 0, 4, 0}, session)));
  ASSERT_TRUE(device_.take(submit(3, kIn, 0, 0, 512, {0xC1, 3, 0, 0, 0, 0, 0, 2})));
  ASSERT_TRUE(device_.take(submit(4, kIn, 0, 0, 8, {0xC1, 9, 0, 0, 0, 0, 8, 0})));
  ASSERT_TRUE(device_.take(submit(5, kOut, 0, 0, 0, {0x41, 2, 0, 0, 0, 0, 0, 0})));
  const auto r = replies_of(device_, {1, 3});
  ASSERT_EQ(r.size(), 5U);
  EXPECT_EQ(drivers::decode_limits(r[0].data).value().width_px, usb_frames::kWidth_px);
  EXPECT_EQ(r[1].bytes, 4U);
  EXPECT_EQ(drivers::decode_usb_message(r[2].data).value().session, 0x01020304U);
  EXPECT_EQ(r[3].status, -EPIPE);
  EXPECT_EQ(r[4].status, -EPIPE) << "a reset without a session";
}

TEST_F(UsbIp, FramesComeWholeInOneOrSeveralTransfersAndCreditsGoBack) {
  attach();
  ASSERT_TRUE(device_.take(submit(1, kIn, 2, 0, 1024)));
  ASSERT_TRUE(device_.take(submit(2, kIn, 2, 0, 1024)));
  EXPECT_EQ(replies_of(device_, {1}).size(), 1U);  // the first status; the second one waits
  for (std::uint32_t k = 10; k < 16; ++k) {
    const Bytes bytes = frame_bytes(k);
    const std::span<const std::byte> all(bytes);
    const std::size_t cut = k % 2 == 0 ? 1024 : 2048;
    ASSERT_TRUE(device_.take(
        submit(100 + k, kOut, 1, 0, static_cast<std::uint32_t>(cut), {}, all.first(cut))));
    EXPECT_FALSE(function_.intake().front().has_value());
    ASSERT_TRUE(
        device_.take(submit(200 + k, kOut, 1, kZeroPacket,
                            static_cast<std::uint32_t>(bytes.size() - cut), {}, all.subspan(cut))));
    const auto frame = function_.intake().front();
    ASSERT_TRUE(frame.has_value()) << k;
    EXPECT_TRUE(usb_frames::shows(*frame, k));
    function_.intake().pop();
    ASSERT_TRUE(device_.take(submit(300 + k, kIn, 2, 0, 1024)));
  }
  const auto r = replies_of(device_, {2, 310, 311, 312, 313, 314, 315});
  std::uint32_t credits = 0;
  for (const Reply& reply : r)
    if (!reply.data.empty())
      credits = drivers::decode_usb_message(reply.data).value().status.credits;
  EXPECT_EQ(credits, 2U + 6);
}

TEST_F(UsbIp, CommandsAnswerTheTransfersThatWait) {
  attach();
  for (std::uint32_t n = 1; n <= 3; ++n) ASSERT_TRUE(device_.take(submit(n, kIn, 2, 0, 1024)));
  static_cast<void>(device_.replies());
  const Bytes packet(40, std::byte{7});
  ASSERT_TRUE(function_.intake().command(packet));
  device_.serve();
  const auto r = replies_of(device_, {2});
  ASSERT_EQ(r.size(), 1U);
  const auto m = drivers::decode_usb_message(r[0].data).value();
  EXPECT_EQ(m.kind, UsbMessage::Kind::kCommand);
  EXPECT_TRUE(std::equal(m.command.begin(), m.command.end(), packet.begin(), packet.end()));
}

TEST_F(UsbIp, ATransferThatIsTakenBackIsTakenBackOnce) {
  attach();
  for (std::uint32_t n = 1; n <= 2; ++n) ASSERT_TRUE(device_.take(submit(n, kIn, 2, 0, 1024)));
  static_cast<void>(device_.replies());
  ASSERT_TRUE(device_.take(unlink(10, 2)));
  ASSERT_TRUE(device_.take(unlink(11, 2)));
  const auto r = replies_of(device_, {});
  ASSERT_EQ(r.size(), 2U);
  EXPECT_EQ(r[0].command, 4U);
  EXPECT_EQ(r[0].status, -ECONNRESET);
  EXPECT_EQ(r[1].status, 0);
  const Bytes packet(40, std::byte{7});
  ASSERT_TRUE(function_.intake().command(packet));
  device_.serve();
  EXPECT_TRUE(device_.replies().empty()) << "nobody waits any more";
}

TEST_F(UsbIp, AReaderWithTooSmallABufferIsToldSo) {
  attach();
  ASSERT_TRUE(device_.take(submit(1, kIn, 2, 0, 10)));
  EXPECT_EQ(replies_of(device_, {})[0].status, -EOVERFLOW);
}

TEST_F(UsbIp, BytesInAnyPiecesAreTheSame) {
  const Bytes frame = frame_bytes(3);
  Bytes all = import_request("1-1");
  for (const Bytes& part :
       {submit(1, kIn, 0, 0, 64, {0x80, 6, 0, 1, 0, 0, 64, 0}),
        submit(2, kOut, 1, kZeroPacket, static_cast<std::uint32_t>(frame.size()), {}, frame),
        submit(3, kIn, 2, 0, 1024), unlink(4, 77)})
    all.insert(all.end(), part.begin(), part.end());
  ASSERT_TRUE(device_.take(all));
  const Bytes expected = device_.replies();
  for (const std::size_t piece : {1U, 7U, 47U, 48U, 49U, 1000U}) {
    InjectionDevice function(usb_frames::limits());
    UsbIpDevice other(function);
    Bytes seen;
    for (std::size_t at = 0; at < all.size(); at += piece) {
      ASSERT_TRUE(other.take(std::span(all).subspan(at, std::min(piece, all.size() - at))));
      const Bytes some = other.replies();
      seen.insert(seen.end(), some.begin(), some.end());
    }
    EXPECT_TRUE(seen == expected) << piece;
  }
}

TEST_F(UsbIp, WhatIsNotTheProtocolEndsTheConnection) {
  EXPECT_FALSE(device_.take(Words().half(0x0106).half(0x8003).word(0).bytes()));
  UsbIpDevice other(function_);
  EXPECT_FALSE(other.take(Words().half(0x0111).half(0x8004).word(0).bytes()));
  UsbIpDevice third(function_);
  ASSERT_TRUE(third.take(import_request("1-1")));
  EXPECT_FALSE(third.take(submit(1, kOut, 1, 0, 0x7FFFFFFF)));
  // Random bytes: whatever they do, they do not crash.
  engine::Draws draws(9, engine::Stream::kLight, 0, 3);
  for (int i = 0; i < 3000; ++i) {
    UsbIpDevice victim(function_);
    if (i % 2 == 0) {
      ASSERT_TRUE(victim.take(import_request("1-1")));
    }
    Bytes noise(draws.bits() % 400);
    for (std::byte& b : noise) b = static_cast<std::byte>(draws.bits() % (i % 3 == 0 ? 5 : 256));
    static_cast<void>(victim.take(noise));
  }
}

}  // namespace
