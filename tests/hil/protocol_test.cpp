#include <fstream>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <starloop_test_paths.h>

#include "hil/space_packet.h"
#include "hil/telemetry_packet.h"

// hil/protocol.md against the code: its examples were packed by hand, not by our encoders.
namespace {

using engine::Duration;
using engine::SimTime;

using Bytes = std::vector<std::byte>;

constexpr Duration kMillisecond{1'000'000};

std::vector<std::string> document() {
  std::ifstream file(STARLOOP_SOURCE_DIR "/hil/protocol.md");
  std::vector<std::string> lines;
  for (std::string line; std::getline(file, line);) lines.push_back(line);
  return lines;
}

/// The bytes of each block that begins with "```hex name".
std::map<std::string, Bytes> examples() {
  const std::string fence = "```";
  std::map<std::string, Bytes> found;
  Bytes* block = nullptr;
  for (const std::string& line : document()) {
    if (line.starts_with(fence + "hex ")) {
      block = &found[line.substr(7)];
    } else if (line.starts_with(fence)) {
      block = nullptr;
    } else if (block != nullptr) {
      std::istringstream words(line);
      for (std::string word; words >> word;)
        block->push_back(static_cast<std::byte>(std::stoul(word, nullptr, 16)));
    }
  }
  return found;
}

Bytes bytes_of(std::span<const std::byte> bytes) { return {bytes.begin(), bytes.end()}; }
SimTime at_ms(std::int64_t t) { return SimTime(t * kMillisecond); }

hil::Command trim() {
  hil::Command c;
  c.kind = hil::CommandKind::kTrim;
  c.sequence = 7;
  c.answers_frame = 42;
  c.made_at = at_ms(1'000'250);
  c.time_to_live = 500 * kMillisecond;
  c.detection.id = 3;
  c.detection.centroid_px = {511.5, 300.25};
  c.detection.box_px = {508.0F, 297.0F, 515.0F, 303.5F};
  c.detection.confidence = 0.875F;
  c.trim_offset_rad = {1.25e-4, -2.5e-5};
  c.trim_rate_rad_s = {1e-6, 0.0};
  c.reference = at_ms(1'000'200);
  return c;
}

TEST(Protocol, TheExamplesAreWhatTheEncodersSay) {
  const auto example = examples();
  ASSERT_EQ(example.size(), 4U);
  hil::CommandPacket packet = hil::encode_command(trim());
  EXPECT_EQ(bytes_of(packet.bytes()), example.at("trim"));
  Bytes secret;
  for (unsigned i = 0; i < 32; ++i) secret.push_back(static_cast<std::byte>(i));
  hil::sign(packet, hil::PacketKey(secret));
  EXPECT_EQ(bytes_of(packet.bytes()), example.at("signed"));
  const hil::FrameNews frame{42, at_ms(1'000'200), 5 * kMillisecond, {1, 0, 2, 40, {}}};
  EXPECT_EQ(bytes_of(hil::encode_telemetry(frame, 43).bytes()), example.at("frame"));
  const hil::Pong pong{42, at_ms(1'000'200), 8, at_ms(1'000'260), Duration(123'456'789'012'345)};
  EXPECT_EQ(bytes_of(hil::encode_telemetry(pong, 0).bytes()), example.at("pong"));
}

TEST(Protocol, TheExamplesAreUnderstood) {
  const auto example = examples();
  const auto command = hil::decode_command(example.at("trim"));
  ASSERT_TRUE(command.ok());
  EXPECT_EQ(command.value().trim_offset_rad, trim().trim_offset_rad);
  EXPECT_EQ(command.value().made_at, trim().made_at);
  const auto pong = hil::decode_telemetry(example.at("pong"));
  ASSERT_TRUE(pong.ok());
  EXPECT_EQ(std::get<hil::Pong>(pong.value()).sequence, 8U);
}

/// Whether a table has a row that begins with this number and this name.
bool has_row(const std::vector<std::string>& lines, std::size_t number, const std::string& name) {
  const std::string row = "| " + std::to_string(number) + " | `" + name + "` |";
  for (const std::string& line : lines)
    if (line.starts_with(row)) return true;
  return false;
}

TEST(Protocol, EveryCountAndEveryRefusalStandsUnderItsNumber) {
  const auto lines = document();
  for (std::size_t i = 0; i < hil::kPortCounts; ++i)
    EXPECT_TRUE(has_row(lines, i, hil::name(static_cast<hil::PortCount>(i)))) << i;
  for (std::size_t i = 0; i < hil::kRefusals; ++i)
    EXPECT_TRUE(has_row(lines, i, hil::name(static_cast<hil::Refusal>(i)))) << i;
}

/// The last cell of the row that begins with this APID.
std::size_t bytes_in_all(const std::vector<std::string>& lines, unsigned apid) {
  std::ostringstream row;
  row << "| 0x" << std::hex << apid << " |";
  for (const std::string& line : lines) {
    if (!line.starts_with(row.str())) continue;
    const std::size_t end = line.rfind(" |");
    return std::stoul(line.substr(line.rfind("| ", end - 1) + 2));
  }
  return 0;
}

TEST(Protocol, EveryPacketIsAsLongAsItsRowSays) {
  const auto lines = document();
  for (unsigned kind = 0; kind < hil::kCommandKinds; ++kind) {
    hil::Command c;
    c.kind = static_cast<hil::CommandKind>(kind);
    EXPECT_EQ(bytes_in_all(lines, 0x100 + kind), hil::encode_command(c).used) << kind;
  }
  const std::vector<hil::Telemetry> all = {hil::FrameNews{}, hil::AttitudeNews{}, hil::TimeNews{},
                                           hil::Housekeeping{}, hil::Pong{}};
  for (unsigned kind = 0; kind < all.size(); ++kind)
    EXPECT_EQ(bytes_in_all(lines, 0x200 + kind), hil::encode_telemetry(all[kind], 0).used) << kind;
}

}  // namespace
