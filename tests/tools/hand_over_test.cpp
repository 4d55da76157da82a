// The on-board end of a USB stream: what comes out of shared memory is what the host packed.

#include "tools/usb_device/hand_over.h"

#include <algorithm>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <unistd.h>

#include "drivers/client/starloop_client.h"
#include "tests/support/usb_frames.h"

namespace {

using drivers::PixelFormat;

void give(drivers::FrameIntake& intake, std::uint64_t sequence, PixelFormat format,
          const engine::DnImage& image, std::span<const std::uint16_t> row) {
  hil::Frame frame = usb_frames::frame(sequence, image);
  frame.telemetry_row = row;
  std::vector<std::byte> bytes(
      drivers::kUsbHeaderBytes +
      drivers::usb_payload_bytes(format, image.width(), image.height() + 1));
  bytes.resize(drivers::encode_usb_frame(frame, format, bytes).value());
  intake.take(bytes, true);
}

/// Images that do not end with a whole byte of the packed stream, with a row below and without.
TEST(HandOver, ImagesOfAnySizeKeepEachPixelInBothFormats) {
  for (const auto& [width, height] : {std::pair{7, 5}, {8, 3}, {1, 1}, {3, 1}, {61, 9}}) {
    const usb_device::HandOverSpec spec{"starloop-hand-over-" + std::to_string(getpid()), width,
                                        height, 2};
    usb_device::HandOver hand_over(spec);
    drivers::FrameIntake intake(usb_device::limits_of(spec));
    starloop_client* client = nullptr;
    ASSERT_EQ(starloop_open(&client, spec.shm.c_str(), 10'000), STARLOOP_OK);
    std::vector<std::uint16_t> row(static_cast<std::size_t>(width));
    std::uint64_t sequence = 0;
    for (const PixelFormat format : {PixelFormat::kPacked11, PixelFormat::kPlain16}) {
      for (const bool with_row : {true, false}) {
        engine::DnImage image(width, height);
        numbered_frames::fill(image, ++sequence);
        for (std::size_t u = 0; u < row.size(); ++u) row[u] = static_cast<std::uint16_t>(255 - u);
        give(intake, sequence, format, image,
             with_row ? std::span<const std::uint16_t>(row) : std::span<const std::uint16_t>());
        hand_over.take_frames(intake);
        EXPECT_FALSE(intake.front().has_value());
        starloop_frame seen;
        ASSERT_EQ(starloop_wait_frame(client, &seen, 10'000), STARLOOP_OK);
        EXPECT_EQ(seen.sequence, sequence);
        EXPECT_DOUBLE_EQ(seen.trim_rad[1], -2e-3) << "the news behind the pixels";
        EXPECT_TRUE(std::equal(image.pixels().begin(), image.pixels().end(), seen.pixels))
            << width << " x " << height;
        ASSERT_EQ(seen.telemetry_row != nullptr, with_row);
        if (with_row) {
          EXPECT_TRUE(std::equal(row.begin(), row.end(), seen.telemetry_row))
              << width << " x " << height;
        }
        EXPECT_EQ(starloop_release_frame(client, &seen), STARLOOP_OK);
      }
    }
    EXPECT_EQ(hand_over.counts().taken, sequence);
    starloop_close(client);
  }
}

TEST(HandOver, FramesOfAnotherCameraAndFramesNobodyReadsAreCounted) {
  const usb_device::HandOverSpec spec{"starloop-hand-over-" + std::to_string(getpid()), 16, 8, 2};
  usb_device::HandOver hand_over(spec);
  drivers::FrameIntake intake(usb_device::limits_of(spec));
  give(intake, 1, PixelFormat::kPlain16, engine::DnImage(16, 7), {});
  give(intake, 2, PixelFormat::kPlain16, engine::DnImage(16, 8), {});
  hand_over.take_frames(intake);
  EXPECT_EQ(hand_over.counts().frames, 2U);
  EXPECT_EQ(hand_over.counts().other_sizes, 1U);
  EXPECT_EQ(hand_over.counts().not_taken, 1U);
  EXPECT_EQ(intake.status().credits, 4U) << "their places are free again all the same";
}

}  // namespace
