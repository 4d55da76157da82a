#include "hil/telemetry_packet.h"

#include <cstring>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "engine/core/crc32c.h"

namespace {

using engine::Duration;
using engine::SimTime;
using hil::decode_telemetry;
using hil::Telemetry;

using Bytes = std::vector<std::byte>;

hil::LoopCounts counts() {
  hil::LoopCounts c{11, 12, 13, 14, {}};
  return c;
}

/// One of each kind, no field like another.
std::vector<Telemetry> one_of_each() {
  const SimTime t(Duration(309'761'630'162'629));
  hil::Housekeeping housekeeping{21, t, counts(), {}};
  for (std::size_t i = 0; i < hil::kRefusals; ++i)
    housekeeping.counts.refused.by_cause[i] = 0xA000 + i;
  for (std::size_t i = 0; i < hil::kPortCounts; ++i) housekeeping.port.values[i] = 0xB000 + i;
  return {hil::FrameNews{0x0123456789ABCDEFULL, t, Duration(5'000'000), counts()},
          hil::AttitudeNews{22, t, {{0.5, -0.5, 0.5, -0.5}, {1e-3, -2e-3, 3e-3}}, {1e-4, -2e-4}},
          hil::TimeNews{23, t, Duration(987'654'321)}, housekeeping,
          hil::Pong{hil::kNoFrame, t, 24, SimTime(Duration(-25)), Duration(26)}};
}

Bytes encoded(const Telemetry& news, std::uint64_t count = 0) {
  const hil::TelemetryPacket packet = hil::encode_telemetry(news, count);
  return {packet.bytes().begin(), packet.bytes().end()};
}

void mend(Bytes& bytes) {
  const std::size_t end = bytes.size() - 4;
  const std::uint32_t crc = engine::crc32c(std::span(bytes).first(end));
  for (std::size_t i = 0; i < 4; ++i) bytes[end + i] = static_cast<std::byte>(crc >> (24 - 8 * i));
}

TEST(TelemetryPacket, EveryFieldOfEveryKindComesBack) {
  const std::vector<Telemetry> all = one_of_each();
  ASSERT_EQ(all.size(), hil::kTelemetryKinds);
  std::vector<Telemetry> back;
  for (const Telemetry& news : all) {
    const auto got = decode_telemetry(encoded(news));
    ASSERT_TRUE(got.ok()) << news.index() << ": " << got.error().step;
    ASSERT_EQ(got.value().index(), news.index());
    back.push_back(got.value());
  }
  const auto& frame = std::get<hil::FrameNews>(back[0]);
  EXPECT_EQ(frame.frame, 0x0123456789ABCDEFULL);
  EXPECT_EQ(frame.shutter_open, SimTime(Duration(309'761'630'162'629)));
  EXPECT_EQ(frame.exposure, Duration(5'000'000));
  EXPECT_EQ(frame.counts.skipped, 11U);
  EXPECT_EQ(frame.counts.dropped, 12U);
  EXPECT_EQ(frame.counts.late, 13U);
  EXPECT_EQ(frame.counts.commands, 14U);
  const auto& attitude = std::get<hil::AttitudeNews>(back[1]);
  const auto& sent = std::get<hil::AttitudeNews>(all[1]);
  EXPECT_EQ(attitude.frame, 22U);
  EXPECT_EQ(attitude.mid_exposure, sent.mid_exposure);
  EXPECT_EQ(attitude.measured.j2000_to_camera, sent.measured.j2000_to_camera);
  EXPECT_EQ(attitude.measured.rate_rad_s, sent.measured.rate_rad_s);
  EXPECT_EQ(attitude.trim_rad, sent.trim_rad);
  const auto& time = std::get<hil::TimeNews>(back[2]);
  EXPECT_EQ(time.frame, 23U);
  EXPECT_EQ(time.monotonic, Duration(987'654'321));
  const auto& housekeeping = std::get<hil::Housekeeping>(back[3]);
  EXPECT_EQ(housekeeping.counts.commands, 14U);
  EXPECT_EQ(housekeeping.counts.refused.by_cause,
            std::get<hil::Housekeeping>(all[3]).counts.refused.by_cause);
  EXPECT_EQ(housekeeping.port.values, std::get<hil::Housekeeping>(all[3]).port.values);
  const auto& pong = std::get<hil::Pong>(back[4]);
  EXPECT_EQ(pong.frame, hil::kNoFrame);
  EXPECT_EQ(pong.sequence, 24U);
  EXPECT_EQ(pong.made_at, SimTime(Duration(-25)));
  EXPECT_EQ(pong.monotonic, Duration(26));
}

// From CCSDS 133.0-B-2, 4.1, and the table in the header: no code of ours between.
TEST(TelemetryPacket, BytesLieWhereTheDocumentSaysInBigEndian) {
  const std::vector<Telemetry> all = one_of_each();
  const std::vector<std::size_t> sizes{68, 100, 36, 268, 52};
  for (std::size_t kind = 0; kind < all.size(); ++kind) {
    const Bytes b = encoded(all[kind], 0x3FFF + 5);
    const auto at = [&b](std::size_t i) { return static_cast<unsigned>(b[i]); };
    ASSERT_EQ(b.size(), sizes[kind]);
    const std::size_t length = b.size() - 7;
    // Version 000, type 0, secondary header 1, APID 0x200 + kind; flags 11, the count.
    EXPECT_EQ(at(0), 0x0AU);
    EXPECT_EQ(at(1), kind);
    EXPECT_EQ(at(2) << 8 | at(3), 0xC004U);
    EXPECT_EQ(at(4) << 8 | at(5), length);
    EXPECT_EQ(at(6), 1U);
    EXPECT_EQ(at(7), 0U);
  }
  const Bytes frame = encoded(all[0]);
  EXPECT_EQ(static_cast<unsigned>(frame[8]), 0x01U);
  EXPECT_EQ(static_cast<unsigned>(frame[15]), 0xEFU);
  EXPECT_EQ(static_cast<unsigned>(frame[63]), 14U);  // the last of the counts, its last byte
  const Bytes attitude = encoded(all[1]);
  EXPECT_EQ(static_cast<unsigned>(attitude[24]), 0x3FU);  // 0.5
  EXPECT_EQ(static_cast<unsigned>(attitude[32]), 0xBFU);  // -0.5
  const Bytes housekeeping = encoded(all[3]);
  EXPECT_EQ(static_cast<unsigned>(housekeeping[62]), 0xA0U);   // the first refusal
  EXPECT_EQ(static_cast<unsigned>(housekeeping[110]), 0xB0U);  // the first count of the port
  EXPECT_EQ(static_cast<unsigned>(housekeeping[263]), hil::kPortCounts - 1);
}

TEST(TelemetryPacket, EverySingleBitFlippedIsRefused) {
  for (const Telemetry& news : one_of_each()) {
    Bytes bytes = encoded(news);
    for (std::size_t bit = 0; bit < 8 * bytes.size(); ++bit) {
      const auto mask = static_cast<std::byte>(1U << (bit % 8));
      bytes[bit / 8] ^= mask;
      ASSERT_FALSE(decode_telemetry(bytes).ok()) << "bit " << bit;
      bytes[bit / 8] ^= mask;
    }
    EXPECT_TRUE(decode_telemetry(bytes).ok());
  }
}

TEST(TelemetryPacket, EveryOtherLengthIsRefused) {
  for (const Telemetry& news : one_of_each()) {
    Bytes bytes = encoded(news);
    const std::size_t right = bytes.size();
    bytes.resize(400);
    for (std::size_t length = 0; length <= 400; ++length) {
      const Bytes part(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(length));
      ASSERT_EQ(decode_telemetry(part).ok(), length == right) << length;
    }
  }
}

TEST(TelemetryPacket, ForgedHeadersAndNumbersAreRefusedEvenWithARightChecksum) {
  struct Forgery {
    std::size_t at;
    unsigned value;
    const char* step;
  };
  const std::vector<Forgery> forgeries = {{0, 0x1A, "version and type of a packet"},
                                          {1, 5, "kind of telemetry"},
                                          {0, 0x09, "kind of telemetry"},
                                          {1, 0, "length of telemetry"},
                                          {5, 92, "length of telemetry"},
                                          {6, 2, "protocol"},
                                          {7, 1, "flags"}};
  const Bytes good = encoded(one_of_each()[1]);
  for (const Forgery& f : forgeries) {
    Bytes bytes = good;
    bytes[f.at] = static_cast<std::byte>(f.value);
    mend(bytes);
    const auto got = decode_telemetry(bytes);
    ASSERT_FALSE(got.ok()) << f.step;
    EXPECT_STREQ(got.error().step, f.step);
  }
  for (std::size_t at = 24; at < 96; at += 8) {
    Bytes bytes = good;
    bytes[at] = std::byte{0x7F};
    bytes[at + 1] = std::byte{0xF8};
    mend(bytes);
    const auto got = decode_telemetry(bytes);
    ASSERT_FALSE(got.ok()) << at;
    EXPECT_STREQ(got.error().step, "a number that is not finite");
  }
}

TEST(TelemetryPacket, RandomBytesAreRefused) {
  std::mt19937_64 random(7);
  const Bytes good = encoded(one_of_each()[1]);
  for (int i = 0; i < 200'000; ++i) {
    Bytes bytes(random() % 300);
    for (std::byte& b : bytes) b = static_cast<std::byte>(random());
    if (i % 2 == 0) {
      bytes.resize(good.size());
      std::memcpy(bytes.data(), good.data(), 8);
    }
    ASSERT_FALSE(decode_telemetry(bytes).ok());
  }
}

}  // namespace
