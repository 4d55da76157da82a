#include "drivers/client/starloop_client.h"

#include <algorithm>
#include <cstring>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "drivers/client/space_packet.h"
#include "engine/core/crc32c.h"
#include "hil/space_packet.h"

namespace {

using engine::Duration;
using engine::SimTime;

static_assert(STARLOOP_LARGEST_COMMAND == hil::kLargestCommandBytes - hil::kSignatureBytes);

/// The same command, in the words of the camera.
hil::Command in_camera_words(const starloop_command& c) {
  hil::Command command;
  command.kind = static_cast<hil::CommandKind>(c.kind);
  command.sequence = c.sequence;
  command.answers_frame = c.answer.answers_frame;
  command.made_at = SimTime(Duration(c.answer.made_at_ns));
  command.time_to_live = Duration(c.answer.time_to_live_ns);
  command.more_follow = c.answer.more_follow != 0;
  command.detection.centroid_px = {c.answer.detection.centroid_px[0],
                                   c.answer.detection.centroid_px[1]};
  command.detection.confidence = c.answer.detection.confidence;
  command.detection.id = c.answer.detection.id;
  std::copy_n(c.answer.detection.box_px, 4, command.detection.box_px.begin());
  std::copy_n(c.trim_offset_rad, 2, command.trim_offset_rad.begin());
  std::copy_n(c.trim_rate_rad_s, 2, command.trim_rate_rad_s.begin());
  command.reference = SimTime(Duration(c.reference_ns));
  std::copy_n(c.j2000_to_camera, 4, command.attitude.j2000_to_camera.begin());
  std::copy_n(c.rate_rad_s, 3, command.attitude.rate_rad_s.begin());
  command.mode = static_cast<hil::GuidanceMode>(c.mode);
  return command;
}

TEST(StarloopClient, EveryKindOfCommandIsTheSameBytesAsTheCamerasOwn) {
  std::mt19937_64 random(9);
  const auto some = [&random] { return std::normal_distribution<double>()(random); };
  const auto any = [&random] { return static_cast<std::int64_t>(random()); };
  for (int i = 0; i < 7000; ++i) {
    starloop_command c;
    std::memset(&c, 0, sizeof c);
    c.kind = static_cast<starloop_kind>(i % 7);
    c.sequence = random();
    c.answer.answers_frame = random();
    c.answer.made_at_ns = any();
    c.answer.time_to_live_ns = i % 3 == 0 ? i : any();
    c.answer.more_follow = i / 7 % 2;
    for (float& x : c.answer.detection.centroid_px) x = static_cast<float>(some());
    for (float& x : c.answer.detection.box_px) x = static_cast<float>(some());
    c.answer.detection.confidence = 0.5F;
    c.answer.detection.id = static_cast<std::uint32_t>(random());
    for (double& x : c.trim_offset_rad) x = some();
    for (double& x : c.trim_rate_rad_s) x = some();
    for (double& x : c.j2000_to_camera) x = some();
    for (double& x : c.rate_rad_s) x = some();
    c.reference_ns = any();
    c.mode = static_cast<starloop_mode>(i % 4);
    std::vector<std::uint8_t> bytes(STARLOOP_LARGEST_COMMAND);
    bytes.resize(starloop_encode(&c, bytes.data()));
    const hil::CommandPacket expected = hil::encode_command(in_camera_words(c));
    ASSERT_EQ(bytes.size(), expected.used) << "kind " << c.kind;
    ASSERT_EQ(std::memcmp(bytes.data(), expected.storage.data(), bytes.size()), 0)
        << "kind " << c.kind;
  }
}

TEST(StarloopClient, AKindThatIsNoneIsNoBytes) {
  starloop_command c;
  std::memset(&c, 0, sizeof c);
  for (const unsigned kind : {7U, 200U}) {
    c.kind = static_cast<starloop_kind>(kind);
    std::uint8_t bytes[STARLOOP_LARGEST_COMMAND];
    EXPECT_EQ(starloop_encode(&c, bytes), 0U);
  }
}

TEST(StarloopClient, TheChecksumIsTheCameras) {
  EXPECT_EQ(starloop_crc32c("123456789", 9), 0xE3069283U);
  std::mt19937 random(2);
  std::vector<std::byte> bytes(70);
  for (std::byte& b : bytes) b = static_cast<std::byte>(random());
  for (std::size_t n = 0; n <= bytes.size(); ++n)
    EXPECT_EQ(starloop_crc32c(bytes.data(), n), engine::crc32c(std::span(bytes).first(n)));
}

TEST(StarloopClient, NullAndClosedAreErrorsAndNoCrash) {
  starloop_frame frame;
  std::memset(&frame, 0, sizeof frame);
  starloop_client* client = nullptr;
  EXPECT_EQ(starloop_open(nullptr, "x", 0), STARLOOP_REJECTED);
  EXPECT_EQ(starloop_open(&client, nullptr, 0), STARLOOP_REJECTED);
  EXPECT_EQ(starloop_wait_frame(nullptr, &frame, 0), STARLOOP_REJECTED);
  EXPECT_EQ(starloop_release_frame(nullptr, &frame), STARLOOP_REJECTED);
  EXPECT_EQ(starloop_check_frame(nullptr), STARLOOP_REJECTED);
  EXPECT_EQ(starloop_check_frame(&frame), STARLOOP_REJECTED);
  EXPECT_EQ(starloop_send_ping(nullptr, nullptr), STARLOOP_REJECTED);
  starloop_detach(nullptr);
  starloop_close(nullptr);
  EXPECT_EQ(starloop_open(&client, "starloop-nobody-has-this", 0), STARLOOP_DISCONNECTED);
  EXPECT_NE(std::strstr(starloop_last_error(), "no camera has opened this link"), nullptr);
}

}  // namespace
