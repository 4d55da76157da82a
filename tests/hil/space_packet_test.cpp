#include "hil/space_packet.h"

#include <cmath>
#include <cstring>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "engine/core/crc32c.h"

namespace {

using engine::Duration;
using engine::Fault;
using engine::SimTime;
using hil::Command;
using hil::CommandKind;
using hil::decode_command;
using hil::GuidanceMode;

using Bytes = std::vector<std::byte>;

constexpr CommandKind kAllKinds[] = {CommandKind::kReport,   CommandKind::kTrim, CommandKind::kRate,
                                     CommandKind::kAttitude, CommandKind::kMode, CommandKind::kPing,
                                     CommandKind::kTrigger};

Command full_command(CommandKind kind = CommandKind::kTrim) {
  Command c;
  c.sequence = 0xFEDCBA9876543210ULL;
  c.answers_frame = 0x0123456789ABCDEFULL;
  c.kind = kind;
  c.more_follow = true;
  c.made_at = SimTime(Duration(309'761'630'162'629));
  c.time_to_live = Duration(1'500'000'000);
  c.trim_offset_rad = {1.25e-4, -3.5e-300};
  c.trim_rate_rad_s = {-5e-5, 1e-9};
  c.reference = SimTime(Duration(-309'761'630'162'629));
  c.attitude = {{0.5, -0.5, 0.5, -0.5}, {1e-3, -2e-3, 3e-3}};
  c.mode = GuidanceMode::kInertial;
  c.detection.centroid_px = {512.25, -0.5};  // exact in single precision
  c.detection.confidence = 0.75F;
  c.detection.id = 0xDEADBEEFU;
  c.detection.box_px = {-0.5F, 1.5F, 1023.5F, 7.25F};
  return c;
}

Bytes encoded(const Command& command) {
  const hil::CommandPacket packet = hil::encode_command(command);
  return {packet.bytes().begin(), packet.bytes().end()};
}

/// Changes bytes and makes the checksum right again: what only the other checks catch.
void forge(Bytes& bytes, std::size_t at, std::initializer_list<unsigned> values) {
  for (const unsigned value : values) bytes[at++] = static_cast<std::byte>(value);
  const std::size_t end = bytes.size() - 4;
  const std::uint32_t crc = engine::crc32c(std::span(bytes).first(end));
  for (std::size_t i = 0; i < 4; ++i) bytes[end + i] = static_cast<std::byte>(crc >> (24 - 8 * i));
}

void expect_refused(const Bytes& bytes, const char* step) {
  const auto got = decode_command(bytes);
  ASSERT_FALSE(got.ok()) << step;
  EXPECT_EQ(got.error().fault, Fault::kRejected);
  EXPECT_STREQ(got.error().step, step);
}

TEST(SpacePacket, EveryFieldOfEveryKindComesBack) {
  for (const CommandKind kind : kAllKinds) {
    const Command sent = full_command(kind);
    const auto got = decode_command(encoded(sent));
    ASSERT_TRUE(got.ok()) << static_cast<int>(kind) << ": " << got.error().step;
    const Command& c = got.value();
    EXPECT_EQ(c.kind, kind);
    EXPECT_EQ(c.sequence, sent.sequence);
    EXPECT_EQ(c.answers_frame, sent.answers_frame);
    EXPECT_TRUE(c.more_follow);
    EXPECT_EQ(c.made_at, sent.made_at);
    EXPECT_EQ(c.time_to_live, sent.time_to_live);
    EXPECT_EQ(c.detection.centroid_px.u, 512.25);
    EXPECT_EQ(c.detection.centroid_px.v, -0.5);
    EXPECT_EQ(c.detection.confidence, 0.75F);
    EXPECT_EQ(c.detection.id, sent.detection.id);
    EXPECT_EQ(c.detection.box_px, sent.detection.box_px);
    if (kind == CommandKind::kTrim) {
      EXPECT_EQ(c.trim_offset_rad, sent.trim_offset_rad);
    }
    if (kind == CommandKind::kTrim || kind == CommandKind::kRate) {
      EXPECT_EQ(c.trim_rate_rad_s, sent.trim_rate_rad_s);
      EXPECT_EQ(c.reference, sent.reference);
    }
    if (kind == CommandKind::kAttitude) {
      EXPECT_EQ(c.attitude.j2000_to_camera, sent.attitude.j2000_to_camera);
      EXPECT_EQ(c.attitude.rate_rad_s, sent.attitude.rate_rad_s);
      EXPECT_EQ(c.reference, sent.reference);
    }
    if (kind == CommandKind::kMode) {
      EXPECT_EQ(c.mode, sent.mode);
    }
  }
}

// Byte for byte from CCSDS 133.0-B-2, 4.1, and the table in the header: no code of ours between.
TEST(SpacePacket, BytesLieWhereTheDocumentSaysInBigEndian) {
  const Bytes b = encoded(full_command(CommandKind::kTrim));
  ASSERT_EQ(b.size(), 112U);
  const auto at = [&b](std::size_t i) { return static_cast<unsigned>(b[i]); };
  // Version 000, type 1, secondary header 1, APID 00100000001; flags 11, 0x3210 & 0x3FFF; 112 - 7.
  const std::vector<unsigned> head{0x19, 0x01, 0xF2, 0x10, 0x00, 105, 1, 1, 0xFE, 0xDC, 0xBA, 0x98};
  for (std::size_t i = 0; i < head.size(); ++i) EXPECT_EQ(at(i), head[i]) << i;
  EXPECT_EQ(at(16), 0x01U);
  EXPECT_EQ(at(23), 0xEFU);
  EXPECT_EQ(at(34) << 8 | at(35), 1500U);
  EXPECT_EQ(at(36), 0xDEU);
  EXPECT_EQ(at(40) << 24 | at(41) << 16 | at(42) << 8 | at(43), 0x44001000U);  // 512.25F
  EXPECT_EQ(at(64) << 24 | at(65) << 16, 0x3F400000U);                         // .75F
  EXPECT_EQ(at(68) << 8 | at(69), 0x3F20U);  // 1.25e-4 begins so in double precision
  EXPECT_EQ(at(108) << 24 | at(109) << 16 | at(110) << 8 | at(111),
            engine::crc32c(std::span(b).first(108)));
}

TEST(SpacePacket, AnAnswerToNoFrameAndALifeWithoutEndComeBack) {
  Command c;
  const auto got = decode_command(encoded(c));
  ASSERT_TRUE(got.ok());
  EXPECT_EQ(got.value().answers_frame, std::numeric_limits<std::uint64_t>::max());
  EXPECT_EQ(got.value().time_to_live, Duration{});
  // A short life must not become an endless one.
  c.time_to_live = Duration(1);
  EXPECT_EQ(decode_command(encoded(c)).value().time_to_live, Duration(1'000'000));
  c.time_to_live = Duration::max();
  EXPECT_EQ(decode_command(encoded(c)).value().time_to_live, Duration{});
}

TEST(SpacePacket, EverySingleBitFlippedIsRefused) {
  for (const CommandKind kind : kAllKinds) {
    Bytes bytes = encoded(full_command(kind));
    for (std::size_t bit = 0; bit < 8 * bytes.size(); ++bit) {
      const auto mask = static_cast<std::byte>(1U << (bit % 8));
      bytes[bit / 8] ^= mask;
      ASSERT_FALSE(decode_command(bytes).ok()) << "bit " << bit;
      bytes[bit / 8] ^= mask;
    }
    EXPECT_TRUE(decode_command(bytes).ok());
  }
}

TEST(SpacePacket, EveryOtherLengthIsRefused) {
  for (const CommandKind kind : kAllKinds) {
    Bytes bytes = encoded(full_command(kind));
    const std::size_t right = bytes.size();
    bytes.resize(300);
    for (std::size_t length = 0; length <= 300; ++length) {
      // Exactly as long as its bytes: a sanitizer sees a read past the end.
      const Bytes part(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(length));
      ASSERT_EQ(decode_command(part).ok(), length == right) << length;
    }
  }
}

TEST(SpacePacket, APacketOfOneKindWithTheLengthOfAnotherIsRefused) {
  for (const CommandKind kind : kAllKinds) {
    for (unsigned other = 0; other < 256; ++other) {
      Bytes bytes = encoded(full_command(kind));
      forge(bytes, 1, {other});
      const auto got = decode_command(bytes);
      // APIDs 0x100 on; report, ping and trigger are of one length.
      if (other >= hil::kCommandKinds) {
        ASSERT_FALSE(got.ok());
        EXPECT_STREQ(got.error().step, "kind of command");
      } else if (got.ok()) {
        EXPECT_EQ(encoded(full_command(static_cast<CommandKind>(other))).size(), bytes.size());
      }
    }
  }
}

TEST(SpacePacket, ForgedHeadersAreRefusedEvenWithARightChecksum) {
  const Bytes good = encoded(full_command());
  Bytes bytes = good;
  forge(bytes, 0, {0x09});  // telemetry
  expect_refused(bytes, "version and type of a packet");
  bytes = good;
  forge(bytes, 0, {0x39});  // version 1
  expect_refused(bytes, "version and type of a packet");
  bytes = good;
  forge(bytes, 5, {104});
  expect_refused(bytes, "length of a command");
  bytes = good;
  forge(bytes, 6, {2});
  expect_refused(bytes, "protocol");
  for (const unsigned flags : {4U, 128U}) {
    bytes = good;
    forge(bytes, 7, {flags});
    expect_refused(bytes, "flags");
  }
  bytes = good;
  forge(bytes, 7, {2});  // says that it is signed, and has no signature
  expect_refused(bytes, "length of a command");
}

TEST(SpacePacket, NumbersThatAreNotFiniteAreRefusedWhereverTheyStand) {
  const std::vector<std::pair<CommandKind, std::vector<std::size_t>>> doubles_at = {
      {CommandKind::kTrim, {68, 76, 84, 92}},
      {CommandKind::kRate, {68, 76}},
      {CommandKind::kAttitude, {68, 76, 84, 92, 100, 108, 116}}};
  for (const auto& [kind, places] : doubles_at) {
    for (const std::size_t at : places) {
      for (const unsigned sign : {0x7FU, 0xFFU}) {
        Bytes bytes = encoded(full_command(kind));
        forge(bytes, at, {sign, 0xF0, 0, 0, 0, 0, 0, 0});  // infinity
        ASSERT_FALSE(decode_command(bytes).ok()) << at;
        forge(bytes, at, {sign, 0xF8, 0, 0, 0, 0, 0, 1});  // not a number
        ASSERT_FALSE(decode_command(bytes).ok()) << at;
      }
    }
  }
  for (const std::size_t at : {40U, 44U, 48U, 52U, 56U, 60U, 64U}) {
    Bytes bytes = encoded(full_command());
    forge(bytes, at, {0x7F, 0xC0, 0, 0});
    expect_refused(bytes, "a number that is not finite");
  }
}

TEST(SpacePacket, ValuesOutOfTheirRangeAreRefused) {
  for (const float confidence : {-0.01F, 1.01F, 1e30F}) {
    Command c = full_command();
    c.detection.confidence = confidence;
    expect_refused(encoded(c), "a confidence outside 0 to 1");
  }
  Bytes mode = encoded(full_command(CommandKind::kMode));
  forge(mode, 68, {0, 0, 0, 4});
  expect_refused(mode, "mode");
  for (const double length : {0.0, 0.4, 2.1, 1e300}) {
    Command c = full_command(CommandKind::kAttitude);
    c.attitude.j2000_to_camera = {0, length, 0, 0};
    expect_refused(encoded(c), "a quaternion without length one");
  }
  Command c = full_command(CommandKind::kAttitude);
  c.attitude.j2000_to_camera = {0, 0, 1.01, 0};
  EXPECT_EQ(decode_command(encoded(c)).value().attitude.j2000_to_camera,
            (hil::Quaternion{0, 0, 1, 0}));
}

TEST(SpacePacket, AMillionRandomDatagramsAreRefused) {
  std::mt19937_64 random(7);
  const Bytes good = encoded(full_command(CommandKind::kAttitude));
  int taken = 0;
  for (int i = 0; i < 1'000'000; ++i) {
    Bytes bytes(random() % 200);
    for (std::byte& b : bytes) b = static_cast<std::byte>(random());
    // Half of them get as far as the checksum.
    if (i % 2 == 0) {
      bytes.resize(good.size());
      std::memcpy(bytes.data(), good.data(), 8);
    }
    if (decode_command(bytes).ok()) ++taken;
  }
  EXPECT_EQ(taken, 0);
}

}  // namespace
