#include <memory>
#include <random>
#include <string>

#include <gtest/gtest.h>

#include "drivers/client/starloop_client.h"
#include "drivers/shm_link.h"
#include "tests/support/numbered_frames.h"
#include "tests/support/process.h"

/// Both ends of a link in processes of their own, one of which dies.
namespace {

using drivers::ShmLink;
using drivers::WhenFull;
using engine::Duration;
using engine::Fault;
using numbered_frames::kHeight_px;
using numbered_frames::kWidth_px;
using process::Process;

constexpr Duration kLong{60'000'000'000};  // only a link that is wrong waits this long
constexpr int kLong_ms = 60'000;

std::string link_name() {
  return "starloop-test-" + std::to_string(getpid()) + "-" +
         testing::UnitTest::GetInstance()->current_test_info()->name();
}

class Camera {
 public:
  explicit Camera(WhenFull when_full)
      : link({.name = link_name(), .when_full = when_full}, kWidth_px, kHeight_px) {}

  engine::Status send(Duration timeout = Duration{}) {
    numbered_frames::fill(pixels_, frame_.sequence);
    frame_.pixels = &pixels_;
    const engine::Status status = link.send(frame_, timeout);
    ++frame_.sequence;
    return status;
  }

  ShmLink link;

 private:
  hil::Frame frame_;
  engine::DnImage pixels_{kWidth_px, kHeight_px};
};

std::unique_ptr<Process> peer(const std::string& what) {
  return std::make_unique<Process>(std::vector<std::string>{STARLOOP_SHM_PEER, what, link_name()});
}

TEST(ShmProcess, EveryFrameArrivesCrcExactWhenTheCameraWaits) {
  constexpr int kFrames = 2000;
  auto camera = std::make_unique<Camera>(WhenFull::kWait);
  const auto reader = peer("read");
  ASSERT_EQ(reader->line(), "attached");
  for (int i = 0; i < kFrames; ++i) ASSERT_TRUE(camera->send(kLong).ok()) << i;
  EXPECT_EQ(camera->link.lost(), 0U);
  camera.reset();
  EXPECT_EQ(reader->line(), "reading");
  EXPECT_EQ(reader->line(), std::to_string(kFrames));
  EXPECT_EQ(reader->wait(), 0);
}

TEST(ShmProcess, NoFrameIsUnaccountedForWhenTheCameraDropsTheOldest) {
  constexpr std::uint64_t kFrames = 5000;
  auto camera = std::make_unique<Camera>(WhenFull::kDropOldest);
  const auto reader = peer("read");
  ASSERT_EQ(reader->line(), "attached");
  for (std::uint64_t i = 0; i < kFrames; ++i) ASSERT_TRUE(camera->send().ok()) << i;
  EXPECT_EQ(camera->link.published(), kFrames);
  const std::uint64_t lost = camera->link.lost();
  camera.reset();
  EXPECT_EQ(reader->line(), "reading");
  EXPECT_EQ(reader->line(), std::to_string(kFrames - lost));
  EXPECT_EQ(reader->wait(), 0);
}

// Each of them reads at least a frame whole, in order and as it was sent, or says so by its end.
TEST(ShmProcess, TwoHundredReadersKilledAtRandomMomentsLeaveTheLinkToTheNext) {
  std::mt19937_64 random(1);
  Camera camera(WhenFull::kDropOldest);
  for (int i = 0; i < 200; ++i) {
    const auto reader = peer("answer");
    ASSERT_EQ(reader->line(), "attached");
    ASSERT_TRUE(camera.link.has_reader());
    ASSERT_TRUE(camera.send().ok());
    ASSERT_EQ(reader->line(), "reading") << i;
    for (std::uint64_t k = random() % 30; k > 0; --k) {
      ASSERT_TRUE(camera.send().ok());
      static_cast<void>(camera.link.receive(Duration{}));
    }
    ASSERT_EQ(reader->kill(), 128 + SIGKILL) << i;
    ASSERT_FALSE(camera.link.has_reader());
    const auto status = camera.send(kLong);
    ASSERT_FALSE(status.ok());
    ASSERT_EQ(status.error().fault, Fault::kDisconnected);
  }
}

TEST(ShmProcess, AFrameThatADeadReaderHeldIsGivenToTheNextInLockstep) {
  Camera camera(WhenFull::kWait);
  for (int i = 0; i < 10; ++i) {
    const auto holder = peer("hold");
    ASSERT_EQ(holder->line(), "attached");
    if (i == 0) {
      ASSERT_TRUE(camera.send(kLong).ok());
    }
    ASSERT_EQ(holder->line(), "held");
    ASSERT_EQ(holder->kill(), 128 + SIGKILL);
  }
  starloop_client* client = nullptr;
  starloop_frame frame;
  ASSERT_EQ(starloop_open(&client, link_name().c_str(), kLong_ms), STARLOOP_OK);
  ASSERT_EQ(starloop_wait_frame(client, &frame, 0), STARLOOP_OK);
  EXPECT_EQ(frame.sequence, 0U);
  EXPECT_EQ(starloop_check_frame(&frame), STARLOOP_OK);
  starloop_close(client);
}

TEST(ShmProcess, SlotsThatADeadReaderHeldAreFreeForTheNext) {
  Camera camera(WhenFull::kDropOldest);
  for (int i = 0; i < 10; ++i) {
    const auto holder = peer("hold");
    ASSERT_EQ(holder->line(), "attached");
    ASSERT_TRUE(camera.send().ok());
    ASSERT_EQ(holder->line(), "held");
    holder->kill();
  }
  starloop_client* client = nullptr;
  ASSERT_EQ(starloop_open(&client, link_name().c_str(), kLong_ms), STARLOOP_OK);
  starloop_frame held;
  for (int i = 0; i < 4; ++i) {
    ASSERT_TRUE(camera.send().ok()) << i;
    ASSERT_EQ(starloop_wait_frame(client, &held, 0), STARLOOP_OK) << i;
  }
  EXPECT_FALSE(camera.send().ok());
  starloop_close(client);
}

TEST(ShmProcess, AKilledCameraDisconnectsItsReaderAndItsNameIsTakenOver) {
  for (int i = 0; i < 10; ++i) {
    const auto camera = peer("camera");
    ASSERT_EQ(camera->line(), "open");
    starloop_client* client = nullptr;
    ASSERT_EQ(starloop_open(&client, link_name().c_str(), kLong_ms), STARLOOP_OK)
        << starloop_last_error();
    starloop_frame frame;
    for (int k = 0; k < 10 * i; ++k) {
      ASSERT_EQ(starloop_wait_frame(client, &frame, kLong_ms), STARLOOP_OK);
      ASSERT_EQ(starloop_check_frame(&frame), STARLOOP_OK);
      ASSERT_EQ(starloop_release_frame(client, &frame), STARLOOP_OK);
    }
    ASSERT_EQ(camera->kill(), 128 + SIGKILL);
    // What it had made ready is whole; then it is gone.
    starloop_status status = STARLOOP_OK;
    for (int k = 0; k <= 4 && status == STARLOOP_OK; ++k) {
      status = starloop_wait_frame(client, &frame, kLong_ms);
      if (status == STARLOOP_OK) {
        ASSERT_EQ(starloop_check_frame(&frame), STARLOOP_OK);
      }
    }
    EXPECT_EQ(status, STARLOOP_DISCONNECTED) << starloop_last_error();
    starloop_close(client);
    ASSERT_EQ(starloop_open(&client, link_name().c_str(), 0), STARLOOP_DISCONNECTED);
  }
  Camera heir(WhenFull::kDropOldest);
  const auto reader = peer("read");
  EXPECT_EQ(reader->line(), "attached");
}

TEST(ShmProcess, ALivingCamerasNameIsNotTakenOver) {
  const auto camera = peer("camera");
  ASSERT_EQ(camera->line(), "open");
  EXPECT_THROW(Camera{WhenFull::kDropOldest}, std::runtime_error);
  starloop_client* client = nullptr;
  starloop_frame frame;
  ASSERT_EQ(starloop_open(&client, link_name().c_str(), 0), STARLOOP_OK) << starloop_last_error();
  EXPECT_EQ(starloop_wait_frame(client, &frame, kLong_ms), STARLOOP_OK);
  starloop_close(client);
  camera->kill();
  const Camera heir(WhenFull::kDropOldest);  // and takes away what is left at its end
}

}  // namespace
