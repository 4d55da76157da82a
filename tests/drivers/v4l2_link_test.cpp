// The link against a driver of ours (v4l2_node_model.h): what it asks for, and what it makes of
// wrong answers.

#include "drivers/v4l2_link.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <stdexcept>
#include <vector>

#include <gtest/gtest.h>
#include <linux/videodev2.h>

#include "engine/core/crc32c.h"
#include "hil/telemetry_row.h"
#include "tests/support/usb_frames.h"
#include "tests/support/v4l2_node_model.h"

namespace {

using drivers::V4l2Format;
using drivers::V4l2Link;
using drivers::V4l2Method;
using drivers::V4l2Spec;
using engine::Duration;
using engine::Fault;
using engine::Status;
using test_support::V4l2NodeModel;

constexpr Duration kShort{20'000'000};
constexpr int kWidth = usb_frames::kWidth_px;
constexpr int kHeight = usb_frames::kHeight_px;

Status send(V4l2Link& link, std::uint64_t sequence) {
  const auto image = usb_frames::image(sequence);
  return link.send(usb_frames::frame(sequence, image), kShort);
}

std::vector<std::uint16_t> words(const std::vector<std::byte>& bytes) {
  std::vector<std::uint16_t> w(bytes.size() / 2);
  std::memcpy(w.data(), bytes.data(), 2 * w.size());
  return w;
}

bool shows(const std::vector<std::byte>& bytes, std::uint64_t sequence) {
  const std::vector<std::uint16_t> w = words(bytes);
  if (w.size() != static_cast<std::size_t>(kWidth) * kHeight) return false;
  for (std::size_t i = 0; i < w.size(); ++i)
    if (w[i] != numbered_frames::pixel(sequence, i)) return false;
  return true;
}

std::string refusal(const V4l2Spec& spec) {
  try {
    const V4l2Link link(spec, kWidth, kHeight, 11);
  } catch (const std::runtime_error& e) {
    return e.what();
  }
  return "taken";
}

TEST(V4l2Link, IntoALoopbackByWriteWithTheStreamOnAndNoBuffers) {
  V4l2NodeModel node({});
  node.plug();
  {
    V4l2Spec spec;
    spec.period = Duration(40'000'000);
    V4l2Link link(spec, kWidth, kHeight, 11);
    EXPECT_EQ(link.node(), "/dev/video0");
    for (std::uint64_t k = 1; k <= 10; ++k) ASSERT_TRUE(send(link, k).ok());
  }
  const auto frames = node.frames();
  ASSERT_EQ(frames.size(), 10U);
  for (std::uint64_t k = 1; k <= 10; ++k) EXPECT_TRUE(shows(frames[k - 1], k)) << k;
  EXPECT_EQ(node.fourcc(), V4L2_PIX_FMT_Y16);
  EXPECT_EQ(node.interval_us(), 40'000U);
  auto asked = node.asked();
  // One QUERYCAP to find it, one when it is open.
  EXPECT_EQ(std::count(asked.begin(), asked.end(), "REQBUFS"), 0);
  const auto on = std::find(asked.begin(), asked.end(), "STREAMON");
  const auto first = std::find(asked.begin(), asked.end(), "WRITE");
  EXPECT_LT(std::find(asked.begin(), asked.end(), "S_FMT"), on);
  EXPECT_LT(on, first);
  EXPECT_EQ(asked.back(), "STREAMOFF");
}

TEST(V4l2Link, MappedBuffersOfALoopbackGoRoundWhateverItSays) {
  V4l2NodeModel node({});
  node.plug();
  V4l2Spec spec;
  spec.method = V4l2Method::kMapped;
  V4l2Link link(spec, kWidth, kHeight, 11);
  for (std::uint64_t k = 1; k <= 20; ++k) ASSERT_TRUE(send(link, k).ok()) << k;
  const auto frames = node.frames();
  ASSERT_EQ(frames.size(), 20U);
  for (std::uint64_t k = 1; k <= 20; ++k) EXPECT_TRUE(shows(frames[k - 1], k)) << k;
}

// One that says it takes write(), as vivid does, and does not.
TEST(V4l2Link, AStrictNodeGetsOnlyBuffersThatItGaveBack) {
  V4l2NodeModel node({.loopback = false, .can_write = true});
  node.plug();
  V4l2Link link({}, kWidth, kHeight, 11);
  for (std::uint64_t k = 1; k <= 20; ++k) ASSERT_TRUE(send(link, k).ok()) << k;
  node.hold_buffers(true);
  const Status held = send(link, 21);
  ASSERT_FALSE(held.ok());
  EXPECT_EQ(held.error().fault, Fault::kBusy);
  node.hold_buffers(false);
  ASSERT_TRUE(send(link, 22).ok());
  EXPECT_TRUE(shows(node.frames().back(), 22));
}

TEST(V4l2Link, GreyHasTheHighestBitsAndShiftedY16TheValueOnTop) {
  V4l2NodeModel node({});
  node.plug();
  for (const bool grey : {true, false}) {
    V4l2Spec spec;
    spec.format = grey ? V4l2Format::kGrey : V4l2Format::kY16;
    spec.to_top = true;
    V4l2Link link(spec, kWidth, kHeight, 11);
    ASSERT_TRUE(send(link, 5).ok());
    const auto bytes = node.frames().back();
    const auto w = words(bytes);
    for (std::size_t i = 0; i < static_cast<std::size_t>(kWidth) * kHeight; ++i) {
      const std::uint16_t dn = numbered_frames::pixel(5, i);
      if (grey) {
        ASSERT_EQ(std::to_integer<int>(bytes[i]), dn >> 3) << i;
      } else {
        ASSERT_EQ(w[i], dn << 5) << i;
      }
    }
  }
}

TEST(V4l2Link, ATelemetryRowGoesOutAsItIs) {
  V4l2NodeModel node({});
  node.plug();
  const auto image = usb_frames::image(1);
  std::vector<std::uint16_t> row(kWidth);
  for (std::size_t i = 0; i < row.size(); ++i) row[i] = static_cast<std::uint16_t>(i + 100);
  hil::Frame frame = usb_frames::frame(1, image);
  frame.telemetry_row = row;
  for (const bool grey : {true, false}) {
    V4l2Spec spec;
    spec.format = grey ? V4l2Format::kGrey : V4l2Format::kY16;
    spec.to_top = true;
    V4l2Link link(spec, kWidth, kHeight + 1, 11);
    ASSERT_TRUE(link.send(frame, kShort).ok());
    const auto bytes = node.frames().back();
    for (std::size_t i = 0; i < row.size(); ++i) {
      const std::size_t at = static_cast<std::size_t>(kWidth) * kHeight + i;
      EXPECT_EQ(grey ? std::to_integer<int>(bytes[at]) : words(bytes)[at], row[i]);
    }
    // Without the row it is a frame of another size.
    EXPECT_EQ(send(link, 1).error().fault, Fault::kRejected);
  }
}

// What a reader of the node checks is what lies in the node.
TEST(V4l2Link, ATelemetryRowHasTheChecksumOfTheImageAsItGoesOut) {
  V4l2NodeModel node({});
  node.plug();
  const auto image = usb_frames::image(4);
  hil::Frame frame = usb_frames::frame(4, image);
  std::vector<std::uint16_t> row(kWidth);
  const hil::TelemetryRow telemetry = hil::telemetry_of(frame, 9);
  ASSERT_TRUE(hil::encode_telemetry_row(telemetry, row).ok());
  frame.telemetry_row = row;
  for (const V4l2Format format : {V4l2Format::kGrey, V4l2Format::kY16}) {
    for (const bool to_top : {true, false}) {
      V4l2Spec spec;
      spec.format = format;
      spec.to_top = to_top;
      V4l2Link link(spec, kWidth, kHeight + 1, 11);
      ASSERT_TRUE(link.send(frame, kShort).ok());
      const auto bytes = node.frames().back();
      const std::size_t image_bytes = bytes.size() / (kHeight + 1) * kHeight;
      std::vector<std::uint16_t> below(kWidth);
      for (std::size_t i = 0; i < below.size(); ++i)
        below[i] = format == V4l2Format::kGrey
                       ? std::to_integer<std::uint16_t>(bytes[image_bytes + i])
                       : words(bytes)[image_bytes / 2 + i];
      const auto read = hil::decode_telemetry_row(below);
      ASSERT_TRUE(read.ok()) << read.error().step;
      EXPECT_EQ(read.value().image_crc32c, engine::crc32c(std::span(bytes).first(image_bytes)));
      EXPECT_EQ(read.value().frame_id, 4U);
      EXPECT_EQ(read.value().link_sequence, 9U);
    }
  }
}

TEST(V4l2Link, AnAnswerOtherThanTheQuestionIsNoYes) {
  for (const std::uint32_t wrong : {V4L2_PIX_FMT_BGR32, V4L2_PIX_FMT_GREY}) {
    V4l2NodeModel node({.wrong_fourcc = wrong});
    node.plug();
    const std::string text = refusal({});
    EXPECT_NE(text.find("asked for Y16"), std::string::npos) << text;
    EXPECT_NE(text.find(wrong == V4L2_PIX_FMT_GREY ? "got GREY" : "got BGR4"), std::string::npos)
        << text;
  }
}

TEST(V4l2Link, ANodeThatCannotIsRefusedWithItsReason) {
  {
    V4l2NodeModel node({.loopback = false, .capture_only = true});
    node.plug();
    EXPECT_NE(refusal({}).find("is no output"), std::string::npos);
  }
  {
    V4l2NodeModel node({.loopback = false, .can_write = false});
    node.plug();
    V4l2Spec spec;
    spec.method = V4l2Method::kWrite;
    EXPECT_NE(refusal(spec).find("takes no write()"), std::string::npos);
  }
  for (const char* call : {"S_FMT", "STREAMON"}) {
    V4l2NodeModel node({});
    node.plug();
    node.fail_next(call, EBUSY);
    EXPECT_NE(refusal({}).find("busy"), std::string::npos) << call;
  }
  V4l2Spec mapped;
  mapped.method = V4l2Method::kMapped;
  for (const char* call : {"REQBUFS", "QUERYBUF"}) {
    V4l2NodeModel node({});
    node.plug();
    node.fail_next(call, ENOMEM);
    EXPECT_NE(refusal(mapped).find("buffer"), std::string::npos) << call;
  }
}

TEST(V4l2Link, ALoopbackThatSaysCaptureToASecondOpenerIsTaken) {
  V4l2NodeModel node({.capture_only = true});
  node.plug();
  V4l2Link link({}, kWidth, kHeight, 11);
  EXPECT_TRUE(send(link, 1).ok());
}

TEST(V4l2Link, IsFoundByItsLabelOrItsPath) {
  V4l2NodeModel node({.node = "video3", .card = "cam b"});
  EXPECT_EQ(drivers::find_v4l2_node("cam b"), "");
  node.plug();
  EXPECT_EQ(drivers::find_v4l2_node("cam b"), "/dev/video3");
  EXPECT_EQ(drivers::find_v4l2_node("/dev/video3"), "/dev/video3");
  EXPECT_EQ(drivers::find_v4l2_node("cam"), "");
  EXPECT_EQ(drivers::find_v4l2_node("/dev/video0"), "");
}

TEST(V4l2Link, ANodeThatIsNotThereIsAnswered) {
  V4l2Spec spec;
  spec.device = "nobody";
  const std::string text = refusal(spec);
  EXPECT_NE(text.find("modprobe v4l2loopback card_label=nobody"), std::string::npos) << text;
  spec.device = "/dev/video77";
  EXPECT_NE(refusal(spec).find("/dev/video77"), std::string::npos);
}

TEST(V4l2Link, ShortAndFailedWritesAreFaultsOfThatFrameAlone) {
  V4l2NodeModel node({});
  node.plug();
  V4l2Link link({}, kWidth, kHeight, 11);
  node.cut_next_write(1000);
  EXPECT_EQ(send(link, 1).error().fault, Fault::kRejected);
  node.fail_next("WRITE", EAGAIN);
  EXPECT_EQ(send(link, 2).error().fault, Fault::kBusy);
  node.fail_next("WRITE", EIO);
  EXPECT_EQ(send(link, 3).error().fault, Fault::kSystem);
  node.fail_next("WRITE", EINTR);
  ASSERT_TRUE(send(link, 4).ok());
  EXPECT_TRUE(shows(node.frames().back(), 4));
}

TEST(V4l2Link, ANodeThatGoesAwayIsTakenUpAgain) {
  for (const V4l2Method method : {V4l2Method::kWrite, V4l2Method::kMapped}) {
    V4l2NodeModel node({});
    node.plug();
    V4l2Spec spec;
    spec.method = method;
    V4l2Link link(spec, kWidth, kHeight, 11);
    for (std::uint64_t k = 1; k <= 6; ++k) ASSERT_TRUE(send(link, k).ok());
    node.fail_next("WRITE", ENODEV);
    node.fail_next("DQBUF", ENODEV);
    EXPECT_EQ(send(link, 7).error().fault, Fault::kDisconnected);
    ASSERT_TRUE(send(link, 8).ok());
    EXPECT_TRUE(shows(node.frames().back(), 8));
  }
}

}  // namespace
