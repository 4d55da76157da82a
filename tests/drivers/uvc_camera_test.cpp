// A camera's controls, against a host of ours that asks as Linux does, and one that asks anything.

#include "drivers/usb_device/uvc_camera.h"

#include <limits>
#include <vector>

#include <gtest/gtest.h>

#include "engine/core/random.h"
#include "tests/support/uvc_frames.h"
#include "tests/support/uvc_host.h"

namespace {

using drivers::UvcFormat;
using drivers::UvcSelector;
using uvc_frames::Picture;
using uvc_host::Bytes;
using uvc_host::Host;

constexpr unsigned kTerminal = drivers::kUvcCameraTerminal;
constexpr unsigned kUnit = drivers::kUvcExtensionUnit;
constexpr unsigned kPanTilt = UVC_CT_PANTILT_ABSOLUTE_CONTROL;

constexpr unsigned number_of(UvcSelector s) { return static_cast<unsigned>(s); }
template <class Array>
Bytes bytes_of(const Array& a) {
  return {a.begin(), a.end()};
}

class UvcCamera : public testing::Test {
 protected:
  void offer(std::uint64_t sequence) {
    const Picture picture(spec_, sequence);
    EXPECT_TRUE(camera_.offer(picture.view));
  }
  drivers::UvcCounts counts() {
    const auto bytes =
        host_.get(UVC_GET_CUR, kUnit, number_of(UvcSelector::kCounts), drivers::kUvcCountsBytes);
    EXPECT_TRUE(bytes.has_value());
    return bytes ? drivers::decode_uvc_counts(*bytes) : drivers::UvcCounts{};
  }
  drivers::UvcFrameNews news() {
    const auto bytes =
        host_.get(UVC_GET_CUR, kUnit, number_of(UvcSelector::kFrame), drivers::kUvcFrameBytes);
    EXPECT_TRUE(bytes.has_value());
    return bytes ? drivers::decode_uvc_frame(*bytes) : drivers::UvcFrameNews{};
  }
  bool select(std::uint64_t sequence) {
    return host_.set(kUnit, number_of(UvcSelector::kSelect), Host::bytes_of(sequence));
  }
  bool command(const hil::Command& c) {
    return host_.set(kUnit, number_of(UvcSelector::kCommand),
                     bytes_of(drivers::encode_uvc_command(c)));
  }
  bool pan_tilt(std::int32_t pan_arcsec, std::int32_t tilt_arcsec) {
    return host_.set(kTerminal, kPanTilt,
                     bytes_of(drivers::encode_pan_tilt({pan_arcsec, tilt_arcsec})));
  }
  /// A frame from here to there, bit for bit.
  void expect_streams(std::uint64_t sequence) {
    ASSERT_TRUE(host_.start(1));
    offer(sequence);
    host_.hear();
    const auto frames = host_.frames();
    ASSERT_EQ(frames.size(), 1U);
    EXPECT_FALSE(frames[0].error);
    EXPECT_TRUE(frames[0].bytes == uvc_frames::expected(spec_, UvcFormat::kY16, sequence));
    ASSERT_TRUE(host_.stop());
  }

  drivers::UvcSpec spec_ = uvc_frames::spec(53, 7, 1);
  bool obeys_ = true;
  std::vector<hil::Command> obeyed_;
  drivers::UvcCamera camera_{spec_, [this](const hil::Command& c) {
                               if (obeys_) obeyed_.push_back(c);
                               return obeys_;
                             }};
  drivers::UsbIpDevice device_{camera_};
  Host host_{device_};
};

TEST_F(UvcCamera, AKernelCanEnumerateIt) {
  for (const unsigned type : {1U, 2U}) {
    const auto whole = host_.ask(0x80, 6, type << 8, 0, 1024);
    ASSERT_TRUE(whole.has_value());
    const auto start = host_.ask(0x80, 6, type << 8, 0, 9);
    ASSERT_TRUE(start.has_value());
    EXPECT_EQ(*start, Bytes(whole->begin(), whole->begin() + 9));
  }
  for (unsigned i = 0; i <= 4; ++i) EXPECT_TRUE(host_.ask(0x80, 6, 3U << 8 | i, 0x0409, 255));
  EXPECT_FALSE(host_.ask(0x80, 6, 0x0305, 0x0409, 255)) << "no such string";
  EXPECT_FALSE(host_.ask(0x80, 6, 0x0600, 0, 10)) << "no qualifier: it knows one speed";
  EXPECT_TRUE(host_.tell(0x00, 9, 1, 0, {}));   // set configuration
  EXPECT_TRUE(host_.tell(0x01, 11, 0, 1, {}));  // set interface
  EXPECT_FALSE(host_.tell(0x01, 11, 1, 1, {})) << "it has no second setting";
  EXPECT_FALSE(host_.tell(0x01, 11, 0, 2, {})) << "nor a third interface";
  EXPECT_FALSE(host_.tell(0x02, 1, 0, 0x82, {})) << "nor this endpoint";
}

TEST_F(UvcCamera, AListShowsBothInterfacesAndTheSpeed) {
  drivers::UsbIpDevice device(camera_);
  ASSERT_TRUE(device.take(usbip_host::Words().half(0x0111).half(0x8005).word(0).bytes()));
  const Bytes reply = device.replies();
  ASSERT_EQ(reply.size(), 8U + 4 + 312 + 2 * 4);
  const auto at = [&](std::size_t i) { return std::to_integer<unsigned>(reply[i]); };
  EXPECT_EQ(at(12 + 288 + 11), 5U);  // SuperSpeed
  EXPECT_EQ(at(12 + 306), 0xEFU);    // class of the device
  EXPECT_EQ(at(12 + 311), 2U);       // interfaces
  EXPECT_EQ(at(324) << 8 | at(325), 0x0E01U);
  EXPECT_EQ(at(328) << 8 | at(329), 0x0E02U);
}

TEST_F(UvcCamera, AProbeIsAnsweredWithWhatThereIs) {
  struct Wish {
    unsigned format;
    unsigned becomes;
    unsigned frame_bytes;
  };
  for (const Wish& w : {Wish{1, 1, 53 * 8 * 2}, Wish{2, 2, 53 * 8}, Wish{3, 3, 54 * 8 * 2},
                        Wish{0, 1, 53 * 8 * 2}, Wish{4, 1, 53 * 8 * 2}, Wish{255, 1, 848}}) {
    const auto answer = host_.probe(w.format);
    ASSERT_TRUE(answer.has_value());
    EXPECT_EQ(answer->bFormatIndex, w.becomes);
    EXPECT_EQ(answer->bFrameIndex, 1);
    EXPECT_EQ(answer->bmHint, 1);
    EXPECT_EQ(answer->dwFrameInterval, 1'000'000U);
    EXPECT_EQ(answer->dwMaxVideoFrameSize, w.frame_bytes);
    EXPECT_EQ(answer->dwMaxPayloadTransferSize, 32768U);
    EXPECT_EQ(answer->dwClockFrequency, 1'000'000U);
  }
  // A host of UVC 1.0, and lengths that are nobody's.
  for (const std::size_t bytes : {0U, 1U, 25U, 26U, 27U, 33U, 34U, 35U, 48U}) {
    Bytes wish(bytes);
    if (bytes > 3) wish[2] = wish[3] = std::byte{1};
    for (const unsigned selector : {1U, 2U})  // probe, commit
      EXPECT_EQ(host_.set(0, selector, wish, 1), bytes == 26 || bytes == 34) << bytes;
  }
  const auto old = host_.get(UVC_GET_CUR, 0, UVC_VS_PROBE_CONTROL, 26, 1);
  ASSERT_TRUE(old.has_value());
  EXPECT_EQ(old->size(), 26U);
  // A commit of what there is not.
  Bytes wrong(34);
  wrong[2] = std::byte{4};
  wrong[3] = std::byte{1};
  EXPECT_FALSE(host_.set(0, UVC_VS_COMMIT_CONTROL, wrong, 1));
  EXPECT_EQ(host_.error_code(), 4U);
}

TEST_F(UvcCamera, EveryControlSaysHowLongItIsAndWhatItCan) {
  struct Known {
    unsigned interface, unit, selector, bytes, info;
    bool has_range;
  };
  const Known all[] = {
      {0, 0, UVC_VC_REQUEST_ERROR_CODE_CONTROL, 1, 1, false},
      {0, kTerminal, kPanTilt, 8, 3, true},
      {0, kUnit, 1, drivers::kUvcCommandBytes, 3, true},
      {0, kUnit, 2, drivers::kUvcFrameBytes, 9, true},
      {0, kUnit, 3, 8, 3, true},
      {0, kUnit, 4, drivers::kUvcCountsBytes, 9, true},
      {1, 0, UVC_VS_PROBE_CONTROL, 34, 3, true},
      {1, 0, UVC_VS_COMMIT_CONTROL, 34, 3, false},
  };
  for (const Known& k : all) {
    const std::string where = std::to_string(k.unit) + " " + std::to_string(k.selector);
    const auto length = host_.get(UVC_GET_LEN, k.unit, k.selector, 2, k.interface);
    ASSERT_TRUE(length.has_value()) << where;
    EXPECT_EQ(*length, Host::bytes_of(static_cast<std::uint16_t>(k.bytes))) << where;
    const auto info = host_.get(UVC_GET_INFO, k.unit, k.selector, 1, k.interface);
    ASSERT_TRUE(info.has_value());
    EXPECT_EQ(*info, Host::bytes_of(static_cast<std::uint8_t>(k.info))) << where;
    for (const unsigned request : {0x81U, 0x82U, 0x83U, 0x84U, 0x87U}) {  // current, range, default
      const auto value = host_.get(request, k.unit, k.selector, k.bytes, k.interface);
      ASSERT_EQ(value.has_value(), k.has_range || request == 0x81U) << where << request;
      if (value) {
        EXPECT_EQ(value->size(), k.bytes) << where;
      }
    }
    const bool settable = (k.info & 2U) != 0;
    if (!settable) {
      EXPECT_FALSE(host_.set(k.unit, k.selector, Bytes(k.bytes), k.interface));
    }
    EXPECT_FALSE(host_.get(0x88, k.unit, k.selector, k.bytes, k.interface)) << "no such request";
  }
}

TEST_F(UvcCamera, ARefusalSaysWhyOnce) {
  EXPECT_FALSE(host_.get(UVC_GET_CUR, 9, 1, 8));
  EXPECT_EQ(host_.error_code(), 5U) << "no such unit";
  EXPECT_FALSE(host_.get(UVC_GET_CUR, kUnit, 5, 8));
  EXPECT_EQ(host_.error_code(), 6U) << "no such control";
  EXPECT_FALSE(host_.set(kUnit, number_of(UvcSelector::kFrame), Bytes(72)));
  EXPECT_EQ(host_.error_code(), 7U) << "it cannot be set";
  EXPECT_FALSE(host_.set(kUnit, number_of(UvcSelector::kCommand), Bytes(71)));
  EXPECT_EQ(host_.error_code(), 7U) << "another length";
  EXPECT_FALSE(pan_tilt(648001, 0));
  EXPECT_EQ(host_.error_code(), 4U) << "out of range";
  EXPECT_EQ(host_.error_code(), 4U) << "asking does not change it";
  EXPECT_TRUE(pan_tilt(0, 0));
  EXPECT_EQ(host_.error_code(), 0U);
  EXPECT_EQ(counts().stalled, 5U);
}

TEST_F(UvcCamera, ACommandOfTheExtensionUnitArrivesWithItsNumbers) {
  using Int = std::numeric_limits<std::int32_t>;
  hil::Command c;
  c.kind = hil::CommandKind::kTrim;
  c.sequence = 5;
  c.answers_frame = 1ULL << 60;
  c.time_to_live = engine::Duration(3'000'000);
  c.trim_offset_rad = {Int::max() * 1e-9, Int::min() * 1e-9};
  c.trim_rate_rad_s = {1e-9, -1e-9};
  ASSERT_TRUE(command(c));
  ASSERT_EQ(obeyed_.size(), 1U);
  EXPECT_EQ(obeyed_[0].answers_frame, 1ULL << 60);
  EXPECT_EQ(obeyed_[0].time_to_live, engine::Duration(3'000'000));
  EXPECT_NEAR(obeyed_[0].trim_offset_rad[0], 2.147483647, 1e-15);
  EXPECT_NEAR(obeyed_[0].trim_offset_rad[1], -2.147483648, 1e-15);
  EXPECT_DOUBLE_EQ(obeyed_[0].trim_rate_rad_s[0], 1e-9);
  EXPECT_DOUBLE_EQ(obeyed_[0].trim_rate_rad_s[1], -1e-9);
  EXPECT_EQ(counts().commands, 1U);
  EXPECT_EQ(counts().last_command, 5U);
  const auto current = host_.get(UVC_GET_CUR, kUnit, 1, drivers::kUvcCommandBytes);
  EXPECT_EQ(*current, bytes_of(drivers::encode_uvc_command(c)));
}

TEST_F(UvcCamera, ACommandThatCannotBePassedOnIsNotReadyAndCounted) {
  obeys_ = false;
  hil::Command c;
  c.sequence = 5;
  EXPECT_FALSE(command(c));
  EXPECT_EQ(host_.error_code(), 1U);
  EXPECT_FALSE(pan_tilt(1, 1));
  EXPECT_EQ(counts().commands_lost, 2U);
  EXPECT_EQ(counts().commands, 0U);
  EXPECT_EQ(counts().last_command, std::numeric_limits<std::uint64_t>::max());
  EXPECT_EQ(*host_.get(UVC_GET_CUR, kTerminal, kPanTilt, 8), Bytes(8)) << "nothing was set";
}

TEST_F(UvcCamera, PanAndTiltAreATrimInArcSeconds) {
  offer(30);
  ASSERT_TRUE(pan_tilt(1, -648000));
  ASSERT_EQ(obeyed_.size(), 1U);
  EXPECT_EQ(obeyed_[0].kind, hil::CommandKind::kTrim);
  EXPECT_NEAR(obeyed_[0].trim_offset_rad[0], 4848.1368e-9, 1e-13);
  EXPECT_NEAR(obeyed_[0].trim_offset_rad[1], -3.14159265358979, 1e-13);
  EXPECT_EQ(obeyed_[0].trim_rate_rad_s, (hil::TrimAngles{0, 0}));
  EXPECT_EQ(obeyed_[0].answers_frame, std::numeric_limits<std::uint64_t>::max());
  EXPECT_EQ(obeyed_[0].made_at, engine::SimTime(spec_.period * 30 + engine::Duration(2'000'000)));
  EXPECT_EQ(*host_.get(UVC_GET_CUR, kTerminal, kPanTilt, 8),
            bytes_of(drivers::encode_pan_tilt({1, -648000})));
  for (const std::size_t bytes : {0U, 4U, 7U, 9U})
    EXPECT_FALSE(host_.set(kTerminal, kPanTilt, Bytes(bytes))) << bytes;
  EXPECT_EQ(obeyed_.size(), 1U);
}

TEST_F(UvcCamera, WhatIsKnownOfAFrameIsToldByItsNumber) {
  EXPECT_EQ(news().sequence, std::numeric_limits<std::uint64_t>::max()) << "none yet";
  for (std::uint64_t k = 0; k < 300; ++k) offer(k);
  EXPECT_EQ(news().sequence, 299U) << "the newest, unless told otherwise";
  ASSERT_TRUE(select(250));
  const drivers::UvcFrameNews n = news();
  EXPECT_EQ(n.sequence, 250U);
  EXPECT_EQ(n.shutter_open, engine::SimTime(spec_.period * 250));
  EXPECT_EQ(n.exposure, engine::Duration(2'000'000));
  EXPECT_DOUBLE_EQ(n.trim_rad[0], 250e-6);
  EXPECT_DOUBLE_EQ(n.measured.j2000_to_camera[1], -0.5);
  EXPECT_DOUBLE_EQ(n.measured.rate_rad_s[2], -3e-6);
  EXPECT_EQ(n.commands, 260U);
  EXPECT_EQ(n.bits, 11);
  ASSERT_TRUE(select(299 - 127));
  EXPECT_EQ(news().sequence, 299U - 127) << "the last 128 are remembered";
  ASSERT_TRUE(select(299 - 128));
  EXPECT_EQ(news().sequence, std::numeric_limits<std::uint64_t>::max());
  ASSERT_TRUE(select(300));
  EXPECT_EQ(news().sequence, std::numeric_limits<std::uint64_t>::max()) << "not yet";
  EXPECT_EQ(counts().dropped, 3U);
}

TEST_F(UvcCamera, AFrameOfAnotherSizeIsNotOffered) {
  for (const drivers::UvcSpec& other :
       {uvc_frames::spec(54, 7, 1), uvc_frames::spec(53, 8, 1), uvc_frames::spec(53, 7, 0)}) {
    const Picture picture(other, 1);
    EXPECT_FALSE(camera_.offer(picture.view));
  }
  drivers::UvcSpec bits = spec_;
  bits.bits = 12;
  const Picture picture(bits, 1);
  EXPECT_FALSE(camera_.offer(picture.view));
  EXPECT_EQ(counts().refused, 4U);
  EXPECT_EQ(counts().offered, 0U);
}

TEST_F(UvcCamera, AHostThatComesBeginsAtTheBeginning) {
  ASSERT_TRUE(pan_tilt(5, 6));
  ASSERT_TRUE(select(3));
  ASSERT_TRUE(host_.start(2));
  offer(0);
  host_.hear(0);  // the first host vanishes in the middle of a frame
  drivers::UsbIpDevice again(camera_);
  Host other(again);
  EXPECT_EQ(*other.get(UVC_GET_CUR, kTerminal, kPanTilt, 8), Bytes(8));
  EXPECT_EQ(other.probe(1)->bFormatIndex, 1);
  offer(1);
  ASSERT_TRUE(other.start(1));
  offer(2);
  other.hear();
  const auto frames = other.frames();
  ASSERT_EQ(frames.size(), 1U);
  EXPECT_TRUE(frames[0].bytes == uvc_frames::expected(spec_, UvcFormat::kY16, 2));
}

TEST_F(UvcCamera, ControlsAreAnsweredInTheMiddleOfAFrame) {
  ASSERT_TRUE(host_.start(1));
  for (std::uint64_t k = 0; k < 20; ++k) {
    offer(k);
    EXPECT_EQ(news().sequence, k);
    ASSERT_TRUE(pan_tilt(static_cast<std::int32_t>(k), 0));
  }
  host_.hear();
  const auto frames = host_.frames();
  ASSERT_EQ(frames.size(), 20U);
  for (std::uint64_t k = 0; k < 20; ++k)
    EXPECT_TRUE(frames[k].bytes == uvc_frames::expected(spec_, UvcFormat::kY16, k)) << k;
}

TEST_F(UvcCamera, NoRequestWhateverItsBytesKillsTheStreamOrIsObeyedByAccident) {
  engine::Draws draws(11, engine::Stream::kLight, 0, 4);
  const auto below = [&draws](unsigned n) { return draws.bits() % n; };
  for (int i = 0; i < 12'000; ++i) {
    const bool likely = below(2) == 0;  // what a host could really ask, with wrong contents
    const unsigned type = likely ? (below(2) != 0 ? 0xA1 : 0x21) : below(256);
    const unsigned request = likely ? (type == 0x21 ? 1 : 0x81 + below(7)) : below(256);
    const unsigned value = likely ? below(6) << 8 : below(65536);
    const unsigned index = likely ? below(4) << 8 | below(2) : below(65536);
    const unsigned length = below(8) == 0 ? below(65536) : below(140);
    if ((type & 0x80) != 0) {
      const auto answer = host_.ask(type, request, value, index, length);
      if (answer) {
        EXPECT_LE(answer->size(), length);
      }
    } else {
      Bytes data(length);
      for (std::byte& b : data) b = static_cast<std::byte>(below(256));
      static_cast<void>(host_.tell(type, request, value, index, data));
    }
    if (i % 1000 == 0) offer(static_cast<std::uint64_t>(i));
  }
  EXPECT_GT(camera_.counts().stalled, 1000U);
  for (const hil::Command& c : obeyed_) {
    EXPECT_TRUE(std::isfinite(c.trim_offset_rad[0]) && std::isfinite(c.trim_rate_rad_s[1]));
    EXPECT_LE(std::abs(c.trim_offset_rad[0]), 3.1415927);
  }
  expect_streams(20'000);
}

TEST_F(UvcCamera, AHostMayNotMakeItHoldTransfersWithoutEnd) {
  for (std::uint32_t i = 0; i < 2000; ++i)
    ASSERT_TRUE(device_.take(usbip_host::submit(i, usbip_host::kIn, 1, 0, 1U << 20)));
  // 48 bytes each: those beyond 1024 are given back.
  EXPECT_EQ(device_.replies().size(), 48U * (2000 - 1024));
}

}  // namespace
