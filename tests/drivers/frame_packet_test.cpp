#include "drivers/frame_packet.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "engine/core/crc32c.h"

namespace {

using drivers::decode_frame;
using drivers::encode_frame;
using drivers::frame_bytes;
using drivers::kFrameHeaderBytes;
using engine::DnImage;
using engine::Duration;
using engine::Fault;
using engine::SimTime;
using hil::Frame;

using Bytes = std::vector<std::byte>;

DnImage numbered(int width, int height) {
  DnImage image(width, height);
  std::uint16_t value = 0;
  for (std::uint16_t& pixel : image.pixels()) pixel = static_cast<std::uint16_t>(value++ & 0x7FF);
  return image;
}

Bytes encoded(const Frame& frame) {
  Bytes bytes(frame_bytes(frame.pixels->width(), frame.pixels->height(),
                          frame.telemetry_row.empty() ? 0 : 1));
  const auto used = encode_frame(frame, bytes);
  EXPECT_TRUE(used.ok());
  EXPECT_EQ(used.value(), bytes.size());
  return bytes;
}

Frame plain_frame(const DnImage& pixels) {
  Frame frame;
  frame.pixels = &pixels;
  return frame;
}

template <class T>
T read_at(std::span<const std::byte> bytes, std::size_t at) {
  T value{};
  std::memcpy(&value, bytes.data() + at, sizeof value);
  return value;
}

/// Changes a field and makes the header's checksum right again: what only the other checks catch.
template <class T>
void forge(std::span<std::byte> bytes, std::size_t at, const T& value) {
  std::memcpy(bytes.data() + at, &value, sizeof value);
  const std::uint32_t crc = engine::crc32c(bytes.first(188));
  std::memcpy(bytes.data() + 188, &crc, sizeof crc);
}

void expect_refused(std::span<const std::byte> bytes, const std::string& step) {
  const auto decoded = decode_frame(bytes);
  ASSERT_FALSE(decoded.ok());
  EXPECT_EQ(decoded.error().fault, Fault::kRejected);
  EXPECT_EQ(decoded.error().step, step);
}

TEST(FramePacket, EveryFieldOfAFrameComesBack) {
  const DnImage pixels = numbered(5, 3);
  Frame frame;
  frame.sequence = 0xFEDCBA9876543210ULL;
  frame.shutter_open = SimTime(Duration(309'761'630'162'629));
  frame.exposure = Duration(1'000'001);
  frame.bits = 14;
  frame.trim_rad = {-1.25e-6, 3.0e-300};
  frame.measured.j2000_to_camera = {0.5, -0.5, 0.5, -0.5};
  frame.measured.rate_rad_s = {1e-3, -2e-3, 3e-3};
  frame.counts = {1, 0xFFFFFFFFFFFFFFFFULL, 3, 4};
  frame.pixels = &pixels;
  const Bytes bytes = encoded(frame);
  const auto view = decode_frame(bytes);
  ASSERT_TRUE(view.ok());
  const drivers::FrameView& v = view.value();
  EXPECT_EQ(v.frame.sequence, frame.sequence);
  EXPECT_EQ(v.frame.shutter_open, frame.shutter_open);
  EXPECT_EQ(v.frame.exposure, frame.exposure);
  EXPECT_EQ(v.frame.bits, frame.bits);
  EXPECT_EQ(v.frame.trim_rad, frame.trim_rad);
  EXPECT_EQ(v.frame.measured.j2000_to_camera, frame.measured.j2000_to_camera);
  EXPECT_EQ(v.frame.measured.rate_rad_s, frame.measured.rate_rad_s);
  EXPECT_EQ(v.frame.counts.skipped, frame.counts.skipped);
  EXPECT_EQ(v.frame.counts.dropped, frame.counts.dropped);
  EXPECT_EQ(v.frame.counts.late, frame.counts.late);
  EXPECT_EQ(v.frame.counts.commands, frame.counts.commands);
  EXPECT_EQ(v.frame.pixels, nullptr);
  EXPECT_TRUE(v.telemetry_row.empty());
  EXPECT_EQ(v.width_px, 5);
  EXPECT_EQ(v.height_px, 3);
  ASSERT_EQ(v.pixels.size(), 30U);
  EXPECT_EQ(std::memcmp(v.pixels.data(), pixels.pixels().data(), 30), 0);
}

TEST(FramePacket, TimesBeforeTheEpochComeBack) {
  const DnImage pixels = numbered(1, 1);
  Frame frame = plain_frame(pixels);
  frame.shutter_open = SimTime(Duration(std::numeric_limits<std::int64_t>::min()));
  frame.exposure = Duration(-1);
  const auto view = decode_frame(encoded(frame));
  ASSERT_TRUE(view.ok());
  EXPECT_EQ(view.value().frame.shutter_open, frame.shutter_open);
  EXPECT_EQ(view.value().frame.exposure, frame.exposure);
}

// The header's comment is the interface: this is what somebody else's software reads.
TEST(FramePacket, FieldsLieWhereTheHeaderSaysInLittleEndian) {
  const DnImage pixels = numbered(7, 2);
  Frame frame;
  frame.sequence = 0x0102030405060708ULL;
  frame.shutter_open = SimTime(Duration(1'234'567'890'123));
  frame.exposure = Duration(5'000'000);
  frame.bits = 11;
  frame.trim_rad = {1.5, -2.5};
  frame.measured = {.j2000_to_camera = {1, 2, 3, 4}, .rate_rad_s = {5, 6, 7}};
  frame.counts = {.skipped = 8, .dropped = 9, .late = 10, .commands = 11};
  frame.pixels = &pixels;
  const Bytes bytes = encoded(frame);
  ASSERT_EQ(bytes.size(), 192U + 28U);
  EXPECT_EQ(std::memcmp(bytes.data(), "SLF2", 4), 0);
  EXPECT_EQ(read_at<std::uint16_t>(bytes, 4), 192);
  EXPECT_EQ(bytes[8], std::byte{8});
  EXPECT_EQ(bytes[15], std::byte{1});
  EXPECT_EQ(read_at<std::int64_t>(bytes, 16), 1'234'567'890'123);
  EXPECT_EQ(read_at<std::int64_t>(bytes, 24), 5'000'000);
  EXPECT_EQ(read_at<std::uint16_t>(bytes, 32), 7);
  EXPECT_EQ(read_at<std::uint16_t>(bytes, 34), 2);
  EXPECT_EQ(read_at<std::uint8_t>(bytes, 36), 11);
  EXPECT_EQ(read_at<std::uint8_t>(bytes, 37), 0);
  EXPECT_EQ(read_at<double>(bytes, 40), 1.5);
  EXPECT_EQ(read_at<double>(bytes, 48), -2.5);
  for (std::size_t i = 0; i < 7; ++i)
    EXPECT_EQ(read_at<double>(bytes, 56 + 8 * i), static_cast<double>(i + 1));
  for (std::size_t i = 0; i < 4; ++i) EXPECT_EQ(read_at<std::uint64_t>(bytes, 112 + 8 * i), 8 + i);
  EXPECT_EQ(read_at<std::uint32_t>(bytes, 144), 28U);
  EXPECT_EQ(read_at<std::uint32_t>(bytes, 148), engine::crc32c(std::span(bytes).subspan(192)));
  EXPECT_EQ(read_at<std::uint32_t>(bytes, 188), engine::crc32c(std::span(bytes).first(188)));
  EXPECT_EQ(read_at<std::uint16_t>(bytes, 192 + 2 * 13), 13);
  for (const auto& [from, to] : {std::pair{6, 8}, {38, 40}, {152, 188}})
    for (int i = from; i < to; ++i)
      EXPECT_EQ(bytes[static_cast<std::size_t>(i)], std::byte{0}) << "reserved byte " << i;
}

TEST(FramePacket, ATelemetryRowComesBackApartFromTheImage) {
  const DnImage pixels = numbered(5, 3);
  const std::vector<std::uint16_t> row{2047, 0, 1, 1024, 7};
  Frame frame = plain_frame(pixels);
  frame.telemetry_row = row;
  const Bytes bytes = encoded(frame);
  ASSERT_EQ(bytes.size(), frame_bytes(5, 3) + 10);
  ASSERT_EQ(bytes.size(), drivers::largest_frame_bytes(5, 3));
  EXPECT_EQ(read_at<std::uint8_t>(bytes, 37), 1);
  const auto view = decode_frame(bytes);
  ASSERT_TRUE(view.ok());
  EXPECT_EQ(view.value().height_px, 3);
  ASSERT_EQ(view.value().pixels.size(), 30U);
  EXPECT_EQ(std::memcmp(view.value().pixels.data(), pixels.pixels().data(), 30), 0);
  ASSERT_EQ(view.value().telemetry_row.size(), 10U);
  EXPECT_EQ(std::memcmp(view.value().telemetry_row.data(), row.data(), 10), 0);
}

TEST(FramePacket, ATelemetryRowOfAnotherWidthIsRefusedByBothSides) {
  const DnImage pixels = numbered(5, 3);
  for (const std::size_t width : {1U, 4U, 6U}) {
    const std::vector<std::uint16_t> row(width);
    Frame frame = plain_frame(pixels);
    frame.telemetry_row = row;
    Bytes bytes(1000);
    EXPECT_FALSE(encode_frame(frame, bytes).ok()) << width;
  }
  Bytes bytes = encoded(plain_frame(pixels));
  forge(bytes, 37, std::uint8_t{1});
  expect_refused(bytes, "length of the payload");
  for (const int rows : {2, 255}) {
    forge(bytes, 37, static_cast<std::uint8_t>(rows));
    expect_refused(bytes, "rows below the image");
  }
}

TEST(FramePacket, All2048CodesOfElevenBitsComeBack) {
  const DnImage pixels = numbered(64, 32);
  const Bytes bytes = encoded(plain_frame(pixels));
  const auto view = decode_frame(bytes);
  ASSERT_TRUE(view.ok());
  for (std::size_t i = 0; i < 2048; ++i)
    ASSERT_EQ(read_at<std::uint16_t>(view.value().pixels, 2 * i), i);
}

TEST(FramePacket, OddSizesComeBack) {
  for (const auto& [width, height] :
       {std::pair{1, 1}, {1, 7}, {7, 1}, {3, 5}, {1023, 3}, {4096, 1}, {1, 4096}}) {
    const DnImage pixels = numbered(width, height);
    const Bytes bytes = encoded(plain_frame(pixels));
    const auto view = decode_frame(bytes);
    ASSERT_TRUE(view.ok()) << width << " x " << height;
    EXPECT_EQ(view.value().width_px, width);
    EXPECT_EQ(view.value().height_px, height);
    EXPECT_EQ(
        std::memcmp(view.value().pixels.data(), pixels.pixels().data(), view.value().pixels.size()),
        0);
  }
}

TEST(FramePacket, ABufferLargerThanTheFrameIsUsedOnlyAsFarAsNeeded) {
  const DnImage pixels = numbered(4, 4);
  Bytes bytes(1000, std::byte{0xAA});
  const auto used = encode_frame(plain_frame(pixels), bytes);
  ASSERT_TRUE(used.ok());
  EXPECT_EQ(used.value(), frame_bytes(4, 4));
  EXPECT_TRUE(std::all_of(bytes.begin() + static_cast<std::ptrdiff_t>(used.value()), bytes.end(),
                          [](std::byte b) { return b == std::byte{0xAA}; }));
  EXPECT_TRUE(decode_frame(std::span(bytes).first(used.value())).ok());
}

TEST(FramePacket, ABufferTooSmallOrAFrameWithoutPixelsIsRefused) {
  const DnImage pixels = numbered(4, 4);
  Bytes bytes(frame_bytes(4, 4) - 1);
  const auto used = encode_frame(plain_frame(pixels), bytes);
  ASSERT_FALSE(used.ok());
  EXPECT_EQ(used.error().fault, Fault::kRejected);
  EXPECT_FALSE(encode_frame(Frame{}, bytes).ok());
  EXPECT_FALSE(encode_frame(plain_frame(pixels), {}).ok());
}

TEST(FramePacket, EverySingleBitFlippedInTheHeaderIsRefused) {
  const DnImage pixels = numbered(8, 8);
  Bytes bytes = encoded(plain_frame(pixels));
  for (std::size_t bit = 0; bit < 8 * kFrameHeaderBytes; ++bit) {
    const auto mask = static_cast<std::byte>(1U << (bit % 8));
    bytes[bit / 8] ^= mask;
    ASSERT_FALSE(decode_frame(bytes).ok()) << "bit " << bit;
    bytes[bit / 8] ^= mask;
  }
  EXPECT_TRUE(decode_frame(bytes).ok());
}

TEST(FramePacket, EverySingleBitFlippedInThePayloadIsRefused) {
  const DnImage pixels = numbered(9, 7);
  Bytes bytes = encoded(plain_frame(pixels));
  for (std::size_t bit = 8 * kFrameHeaderBytes; bit < 8 * bytes.size(); ++bit) {
    const auto mask = static_cast<std::byte>(1U << (bit % 8));
    bytes[bit / 8] ^= mask;
    ASSERT_NO_FATAL_FAILURE(expect_refused(bytes, "payload checksum")) << "bit " << bit;
    bytes[bit / 8] ^= mask;
  }
  EXPECT_TRUE(decode_frame(bytes).ok());
}

TEST(FramePacket, AFrameTruncatedAtAnyLengthOrOneByteTooLongIsRefused) {
  const DnImage pixels = numbered(9, 7);
  Bytes bytes = encoded(plain_frame(pixels));
  for (std::size_t length = 0; length < bytes.size(); ++length) {
    // A copy of exactly that length, so that a sanitizer sees a read past its end.
    const Bytes part(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(length));
    ASSERT_FALSE(decode_frame(part).ok()) << length;
  }
  bytes.push_back(std::byte{0});
  expect_refused(bytes, "length of the payload");
}

TEST(FramePacket, WrongMagicIsRefusedEvenWithARightChecksum) {
  const DnImage pixels = numbered(4, 4);
  for (const char* magic : {"SLC1", "SLF1", "slf1", "\0\0\0"}) {
    Bytes bytes = encoded(plain_frame(pixels));
    std::array<char, 4> four{};
    std::copy_n(magic, 4, four.begin());
    forge(bytes, 0, four);
    expect_refused(bytes, "magic");
  }
}

TEST(FramePacket, AbsurdSizesAreRefusedEvenWithARightChecksum) {
  const DnImage pixels = numbered(4, 4);
  for (const std::size_t at : {32U, 34U}) {
    for (const int side : {0, 4097, 32768, 65535}) {
      Bytes bytes = encoded(plain_frame(pixels));
      forge(bytes, at, static_cast<std::uint16_t>(side));
      expect_refused(bytes, "size of the image");
    }
    for (const int side : {1, 3, 5, 4096}) {
      Bytes bytes = encoded(plain_frame(pixels));
      forge(bytes, at, static_cast<std::uint16_t>(side));
      expect_refused(bytes, "length of the payload");
    }
  }
  // The same number of pixels in another shape is a frame: of another camera, for its reader to
  // see.
  Bytes bytes = encoded(plain_frame(pixels));
  forge(bytes, 32, std::uint16_t{8});
  forge(bytes, 34, std::uint16_t{2});
  EXPECT_TRUE(decode_frame(bytes).ok());
}

TEST(FramePacket, WrongLengthsInTheHeaderAreRefusedEvenWithARightChecksum) {
  const DnImage pixels = numbered(4, 4);
  for (const int length : {0, 96, 191, 193, 65535}) {
    Bytes bytes = encoded(plain_frame(pixels));
    forge(bytes, 4, static_cast<std::uint16_t>(length));
    expect_refused(bytes, "header length");
  }
  for (const std::uint32_t length : {0U, 31U, 33U, 0xFFFFFFFFU}) {
    Bytes bytes = encoded(plain_frame(pixels));
    forge(bytes, 144, length);
    expect_refused(bytes, "length of the payload");
  }
}

TEST(FramePacket, ATrimAttitudeOrRateThatIsNotFiniteIsRefused) {
  const DnImage pixels = numbered(4, 4);
  for (std::size_t at = 40; at < 112; at += 8) {
    for (const double bad : {std::nan(""), std::numeric_limits<double>::infinity()}) {
      Bytes bytes = encoded(plain_frame(pixels));
      forge(bytes, at, bad);
      EXPECT_FALSE(decode_frame(bytes).ok()) << "byte " << at << ": " << bad;
    }
  }
}

TEST(FramePacket, PixelBitsOutsideOneToSixteenAreRefused) {
  const DnImage pixels = numbered(4, 4);
  for (const int bits : {0, 17, 255}) {
    Bytes bytes = encoded(plain_frame(pixels));
    forge(bytes, 36, static_cast<std::uint8_t>(bits));
    EXPECT_FALSE(decode_frame(bytes).ok()) << bits;
  }
}

// ---- noise ----------------------------------------------------------------------------------

TEST(FramePacket, AHundredThousandRandomDatagramsAreRefused) {
  std::mt19937_64 random(7);
  int taken = 0;
  for (int i = 0; i < 100'000; ++i) {
    // Exactly as long as its bytes: a sanitizer sees a read past the end.
    Bytes bytes(random() % 500);
    for (std::byte& b : bytes) b = static_cast<std::byte>(random());
    // Half of them get as far as the checksum; a quarter past it, to the fields.
    if (bytes.size() >= 192 && i % 2 == 0) {
      std::memcpy(bytes.data(), "SLF2", 4);
      if (i % 4 == 0) forge(std::span(bytes), 6, std::uint16_t{0});
    }
    if (decode_frame(bytes).ok()) ++taken;
  }
  EXPECT_EQ(taken, 0);
}

TEST(FramePacket, RandomHeadersWithARightChecksumNeverMakeAFrameOfAnotherLength) {
  std::mt19937_64 random(11);
  const DnImage pixels = numbered(8, 4);
  const Bytes good = encoded(plain_frame(pixels));
  for (int i = 0; i < 100'000; ++i) {
    Bytes bytes = good;
    const std::size_t at = random() % 188;
    forge(std::span(bytes), at, static_cast<std::byte>(random()));
    const auto view = decode_frame(bytes);
    if (!view.ok()) continue;
    ASSERT_EQ(frame_bytes(view.value().width_px, view.value().height_px), bytes.size());
    ASSERT_EQ(view.value().pixels.size(), 2U * 8U * 4U);
  }
}

}  // namespace
