// What goes out of the bulk endpoint, against a host of ours that puts it together as Linux does.

#include "drivers/usb_device/uvc_stream.h"

#include <gtest/gtest.h>

#include "drivers/usb_device/uvc_camera.h"
#include "tests/support/uvc_frames.h"
#include "tests/support/uvc_host.h"

namespace {

using drivers::UvcFormat;
using drivers::UvcSpec;
using uvc_frames::Picture;
using uvc_host::Frame;

constexpr UvcFormat kFormats[] = {UvcFormat::kY16, UvcFormat::kY8, UvcFormat::kYuy2};

/// A camera, attached to a host.
struct Rig {
  explicit Rig(const UvcSpec& s)
      : spec(s),
        camera(s, [](const hil::Command&) { return true; }),
        device(camera),
        host(device) {}
  void offer(std::uint64_t sequence) {
    const Picture picture(spec, sequence);
    EXPECT_TRUE(camera.offer(picture.view));
  }
  /// The frame that such a camera gave, with nothing wrong with it.
  void expect_shows(const Frame& frame, UvcFormat format, std::uint64_t sequence) const {
    EXPECT_FALSE(frame.error) << sequence;
    EXPECT_TRUE(frame.bytes == uvc_frames::expected(spec, format, sequence)) << sequence;
    EXPECT_EQ(frame.time, sequence * static_cast<std::uint64_t>(spec.period.count()) / 1000);
  }
  void expect_counts_add_up() const {
    const drivers::UvcCounts c = camera.counts();
    EXPECT_EQ(c.offered, c.idle + c.sent + c.overtaken + c.cut + c.in_hand);
  }

  UvcSpec spec;
  drivers::UvcCamera camera;
  drivers::UsbIpDevice device;
  uvc_host::Host host;
};

TEST(UvcStream, EveryFormatAndSizeArrivesBitForBit) {
  struct Size {
    int width_px, height_px, rows_below, bits;
  };
  for (const Size& z : {Size{72, 50, 0, 11}, Size{1, 1, 0, 11}, Size{53, 7, 1, 11},
                        Size{127, 3, 1, 16}, Size{64, 64, 1, 8}, Size{3, 9, 0, 5}}) {
    for (const UvcFormat format : kFormats) {
      UvcSpec spec = uvc_frames::spec(z.width_px, z.height_px, z.rows_below);
      spec.bits = z.bits;
      Rig rig(spec);
      ASSERT_TRUE(rig.host.start(static_cast<unsigned>(format)));
      for (std::uint64_t k = 5; k < 8; ++k) {
        rig.offer(k);
        rig.host.hear();
        const auto frames = rig.host.frames();
        ASSERT_EQ(frames.size(), 1U) << z.width_px << " x " << z.height_px;
        rig.expect_shows(frames[0], format, k);
        EXPECT_EQ(frames[0].sequence, k - 5);
      }
      EXPECT_EQ(rig.camera.counts().sent, 3U);
    }
  }
}

TEST(UvcStream, FramesThatEndWithAPayloadATransferOrAPacketAreWhole) {
  constexpr int kHeader = 6;
  constexpr std::uint32_t kPacket = 512;
  // Widths that make the frame a payload to the byte, one more, one less; and payloads that fill
  // transfers to the byte before they are as long as payloads may be.
  for (const std::uint32_t payload : {2 * kPacket, 4 * kPacket, 3 * kPacket + 100}) {
    for (const std::size_t packets : {1U, 2U, 3U, 32U}) {
      for (const int bytes :
           {static_cast<int>(payload) - kHeader, 2 * (static_cast<int>(payload) - kHeader),
            static_cast<int>(payload) - kHeader + 1, static_cast<int>(payload) - kHeader - 1,
            static_cast<int>(payload) - kHeader + static_cast<int>(kPacket) - kHeader,
            static_cast<int>(kPacket) - kHeader, 2 * static_cast<int>(kPacket) - kHeader}) {
        UvcSpec spec = uvc_frames::spec(bytes, 1);
        spec.payload_bytes = payload;
        Rig rig(spec);
        ASSERT_TRUE(rig.host.start(static_cast<unsigned>(UvcFormat::kY8), packets, kPacket));
        for (std::uint64_t k = 0; k < 3; ++k) {
          rig.offer(k);
          rig.host.hear();
          const auto frames = rig.host.frames();
          ASSERT_EQ(frames.size(), 1U) << payload << ' ' << packets << ' ' << bytes;
          rig.expect_shows(frames[0], UvcFormat::kY8, k);
        }
      }
    }
  }
}

TEST(UvcStream, AStreamThatIsStoppedInAFrameBeginsAgainWithAWholeNewOne) {
  const UvcSpec spec = uvc_frames::spec(640, 200);  // eight payloads
  for (std::size_t transfers = 0; transfers < 24; ++transfers) {
    Rig rig(spec);
    // Transfers as long as payloads, and a quarter of them.
    ASSERT_TRUE(rig.host.start(1, transfers % 2 == 0 ? 32 : 8));
    rig.offer(1);
    rig.host.hear(transfers / 2);
    static_cast<void>(rig.host.frames());
    ASSERT_TRUE(rig.host.stop());
    rig.offer(2);  // nobody streams
    ASSERT_TRUE(rig.host.start(2));
    rig.host.hear();
    EXPECT_TRUE(rig.host.frames().empty()) << "a frame from before";
    rig.offer(3);
    rig.host.hear();
    const auto frames = rig.host.frames();
    ASSERT_EQ(frames.size(), 1U) << transfers;
    rig.expect_shows(frames[0], UvcFormat::kY8, 3);
    EXPECT_EQ(frames[0].sequence, 0U);
    EXPECT_EQ(rig.camera.counts().idle, 1U);
    rig.expect_counts_add_up();
  }
}

TEST(UvcStream, TheNewestFrameWinsAndAFrameThatHasBegunIsFinished) {
  const UvcSpec spec = uvc_frames::spec(640, 400);
  Rig rig(spec);
  ASSERT_TRUE(rig.host.start(1));
  rig.offer(0);
  rig.host.hear(2);  // a slow reader: in the middle of frame 0
  for (std::uint64_t k = 1; k <= 20; ++k) rig.offer(k);
  EXPECT_EQ(rig.camera.counts().overtaken, 19U);
  EXPECT_EQ(rig.camera.counts().in_hand, 2U);
  rig.host.hear();
  const auto frames = rig.host.frames();
  ASSERT_EQ(frames.size(), 21U);
  rig.expect_shows(frames.front(), UvcFormat::kY16, 0);
  for (std::size_t i = 1; i < 20; ++i) EXPECT_TRUE(frames[i].error) << i;
  rig.expect_shows(frames.back(), UvcFormat::kY16, 20);
  EXPECT_EQ(frames.back().sequence, 20U) << "the host counts what the camera counts";
  EXPECT_EQ(rig.camera.counts().sent, 2U);
  rig.expect_counts_add_up();
}

TEST(UvcStream, TheHostsCountAndTheFirstSequenceGiveTheCamerasSequence) {
  const UvcSpec spec = uvc_frames::spec();
  Rig rig(spec);
  ASSERT_TRUE(rig.host.start(1));
  // Gaps, a long one (told of in part), and a source that begins anew.
  for (const std::uint64_t k : {100U, 101U, 105U, 106U, 1000U, 1001U, 7U, 8U, 12U}) {
    rig.offer(k);
    rig.host.hear();
    const auto frames = rig.host.frames();
    ASSERT_FALSE(frames.empty());
    EXPECT_LE(frames.size(), 64U);
    rig.expect_shows(frames.back(), UvcFormat::kY16, k);
    EXPECT_EQ(rig.camera.counts().first_sequence + frames.back().sequence, k);
  }
  EXPECT_EQ(rig.camera.counts().missed, 3U + 893U + 3U);
}

TEST(UvcStream, NothingGoesOutBeforeAFormatIsCommitted) {
  drivers::UvcStream stream(uvc_frames::spec());
  EXPECT_FALSE(stream.give(32768).has_value());
  const Picture picture(uvc_frames::spec(), 1);
  stream.offer(picture.view);
  EXPECT_FALSE(stream.give(32768).has_value());
  EXPECT_EQ(stream.counts().idle, 1U);
}

TEST(UvcStream, TransfersOfAnyLengthMakeTheSamePayloads) {
  const UvcSpec spec = uvc_frames::spec(53, 7, 1);
  const Picture picture(spec, 4);
  std::vector<std::byte> expected;
  for (const std::size_t room : {32768U, 1U, 2U, 3U, 5U, 6U, 7U, 100U}) {
    drivers::UvcStream stream(spec);
    stream.commit(UvcFormat::kY16);
    EXPECT_FALSE(stream.give(room).has_value());
    stream.offer(picture.view);
    std::vector<std::byte> all;
    for (auto answer = stream.give(room); answer; answer = stream.give(room)) {
      all.insert(all.end(), answer->head.begin(), answer->head.end());
      all.insert(all.end(), answer->data.begin(), answer->data.end());
      ASSERT_LE(answer->head.size() + answer->data.size(), room);
    }
    if (expected.empty()) expected = all;
    EXPECT_EQ(all.size(), 6U + 53 * 8 * 2);
    EXPECT_TRUE(all == expected) << room;
  }
}

}  // namespace
