#include "drivers/shm_link.h"

#include <cstring>
#include <limits>
#include <random>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>
#include <sys/mman.h>
#include <sys/stat.h>

#include "drivers/client/shm_layout.h"
#include "drivers/client/shm_sync.h"
#include "drivers/client/starloop_client.h"
#include "tests/support/numbered_frames.h"

namespace {

using drivers::ShmLink;
using drivers::WhenFull;
using engine::DnImage;
using engine::Duration;
using engine::Fault;
using hil::Frame;
using numbered_frames::kHeight_px;
using numbered_frames::kWidth_px;

constexpr Duration kAtOnce{};
constexpr Duration kShort{1'000'000};
constexpr Duration kLong{60'000'000'000};  // only a link that is wrong waits this long
constexpr int kLong_ms = 60'000;

std::string link_name() {
  return "starloop-test-" + std::to_string(getpid()) + "-" +
         testing::UnitTest::GetInstance()->current_test_info()->name();
}

/// A link and the camera in front of it.
class Camera {
 public:
  explicit Camera(WhenFull when_full = WhenFull::kDropOldest, int slots = 4)
      : link({.name = link_name(), .slots = slots, .when_full = when_full}, kWidth_px, kHeight_px) {
  }

  engine::Status send(std::uint64_t sequence, Duration timeout = kAtOnce) {
    numbered_frames::fill(pixels_, sequence);
    frame.sequence = sequence;
    frame.pixels = &pixels_;
    return link.send(frame, timeout);
  }

  ShmLink link;
  Frame frame;

 private:
  DnImage pixels_{kWidth_px, kHeight_px};
};

/// The software under test.
class Reader {
 public:
  explicit Reader(const std::string& name = link_name()) {
    if (starloop_open(&client_, name.c_str(), kLong_ms) != STARLOOP_OK)
      throw std::runtime_error(starloop_last_error());
  }
  ~Reader() { starloop_close(client_); }
  Reader(const Reader&) = delete;
  Reader& operator=(const Reader&) = delete;
  operator starloop_client*() const { return client_; }

  starloop_status wait(starloop_frame& frame, int timeout_ms = 0) {
    return starloop_wait_frame(client_, &frame, timeout_ms);
  }

 private:
  starloop_client* client_ = nullptr;
};

void expect_as_sent(const starloop_frame& frame, std::uint64_t sequence) {
  EXPECT_EQ(frame.sequence, sequence);
  EXPECT_EQ(starloop_check_frame(&frame), STARLOOP_OK);
  for (std::size_t i = 0; i < static_cast<std::size_t>(kWidth_px * kHeight_px); ++i)
    ASSERT_EQ(frame.pixels[i], numbered_frames::pixel(sequence, i)) << i;
}

void expect_next(Reader& reader, std::uint64_t sequence) {
  starloop_frame frame;
  ASSERT_EQ(reader.wait(frame), STARLOOP_OK) << sequence << ": " << starloop_last_error();
  expect_as_sent(frame, sequence);
  EXPECT_EQ(starloop_release_frame(reader, &frame), STARLOOP_OK);
}

void expect_fault(const engine::Status& status, Fault fault) {
  ASSERT_FALSE(status.ok());
  EXPECT_EQ(status.error().fault, fault) << status.error().step;
}

std::string complaint_of_a_camera() {
  try {
    const Camera camera;
  } catch (const std::runtime_error& e) {
    return e.what();
  }
  return "";
}

/// What a peer that obeys no rule sees.
class Scribbler {
 public:
  Scribbler() : fd_(shm_open(("/" + link_name()).c_str(), O_RDWR, 0)) {
    struct stat status {};
    if (fd_ < 0 || fstat(fd_, &status) != 0) throw std::runtime_error("no object");
    bytes_ = static_cast<std::size_t>(status.st_size);
    memory_ = mmap(nullptr, bytes_, PROT_READ | PROT_WRITE, MAP_SHARED, fd_, 0);
  }
  ~Scribbler() {
    munmap(memory_, bytes_);
    close(fd_);
  }
  Scribbler(const Scribbler&) = delete;
  Scribbler& operator=(const Scribbler&) = delete;
  [[nodiscard]] starloop_shm& shared() const { return *static_cast<starloop_shm*>(memory_); }
  [[nodiscard]] int fd() const { return fd_; }

 private:
  int fd_;
  std::size_t bytes_ = 0;
  void* memory_ = nullptr;
};

TEST(ShmLink, EveryFieldOfAFrameArrivesAndThePixelsAreReadWhereTheyLie) {
  Camera camera;
  Reader reader;
  std::vector<std::uint16_t> row(kWidth_px);
  row[0] = 77;
  camera.frame.shutter_open = engine::SimTime(Duration(-5));
  camera.frame.exposure = Duration(1'000'001);
  camera.frame.bits = 12;
  camera.frame.trim_rad = {1e-6, -2e-6};
  camera.frame.measured = {.j2000_to_camera = {0.5, -0.5, 0.5, -0.5}, .rate_rad_s = {1, 2, 3}};
  camera.frame.counts = {.skipped = 1, .dropped = 2, .late = 3, .commands = 4};
  camera.frame.telemetry_row = row;
  ASSERT_TRUE(camera.send(0xFEDCBA9876543210ULL).ok());
  starloop_frame frame;
  ASSERT_EQ(reader.wait(frame), STARLOOP_OK);
  expect_as_sent(frame, 0xFEDCBA9876543210ULL);
  EXPECT_EQ(frame.shutter_open_ns, -5);
  EXPECT_EQ(frame.exposure_ns, 1'000'001);
  EXPECT_EQ(frame.width_px, kWidth_px);
  EXPECT_EQ(frame.height_px, kHeight_px);
  EXPECT_EQ(frame.bits, 12);
  EXPECT_EQ(frame.trim_rad[1], -2e-6);
  EXPECT_EQ(frame.j2000_to_camera[3], -0.5);
  EXPECT_EQ(frame.rate_rad_s[2], 3);
  EXPECT_EQ(frame.skipped, 1U);
  EXPECT_EQ(frame.dropped, 2U);
  EXPECT_EQ(frame.late, 3U);
  EXPECT_EQ(frame.commands, 4U);
  ASSERT_NE(frame.telemetry_row, nullptr);
  EXPECT_EQ(frame.telemetry_row[0], 77);
  EXPECT_EQ(reinterpret_cast<std::uintptr_t>(frame.pixels) % 64, 0U);
}

TEST(ShmLink, WithoutAReaderAFrameIsDisconnectedAndOneIsSeenToComeAndGo) {
  Camera camera;
  EXPECT_FALSE(camera.link.has_reader());
  expect_fault(camera.send(0, kLong), Fault::kDisconnected);
  {
    Reader reader;
    EXPECT_TRUE(camera.link.has_reader());
    EXPECT_TRUE(camera.send(1).ok());
    expect_next(reader, 1);
  }
  EXPECT_FALSE(camera.link.has_reader());
  expect_fault(camera.send(2, kLong), Fault::kDisconnected);
  EXPECT_EQ(camera.link.published(), 1U);
}

TEST(ShmLink, ASlowReaderLosesTheOldestFramesAndBothSidesCountThem) {
  Camera camera;
  Reader reader;
  starloop_frame held;
  ASSERT_TRUE(camera.send(0).ok());
  ASSERT_EQ(reader.wait(held), STARLOOP_OK);
  for (std::uint64_t k = 1; k <= 100; ++k) ASSERT_TRUE(camera.send(k).ok()) << k;
  expect_as_sent(held, 0);  // nobody writes to what is claimed
  EXPECT_EQ(starloop_release_frame(reader, &held), STARLOOP_OK);
  EXPECT_EQ(camera.link.lost(), 97U);
  starloop_frame next;
  ASSERT_EQ(reader.wait(next), STARLOOP_OK);
  expect_as_sent(next, 98);
  EXPECT_EQ(next.link_lost, 97U);
  EXPECT_EQ(starloop_release_frame(reader, &next), STARLOOP_OK);
  expect_next(reader, 99);
  expect_next(reader, 100);
  EXPECT_EQ(reader.wait(next), STARLOOP_TIMEOUT);
  EXPECT_EQ(camera.link.published(), 4U + camera.link.lost());
}

TEST(ShmLink, AReaderThatClaimsEverySlotMakesTheCameraBusyUntilItReleasesOne) {
  for (const WhenFull when_full : {WhenFull::kDropOldest, WhenFull::kWait}) {
    Camera camera(when_full, 3);
    Reader reader;
    std::vector<starloop_frame> held(3);
    for (std::uint64_t k = 0; k < 3; ++k) {
      ASSERT_TRUE(camera.send(k).ok());
      ASSERT_EQ(reader.wait(held[k]), STARLOOP_OK);
    }
    for (const Duration timeout : {kAtOnce, kShort})
      expect_fault(camera.send(9, timeout), Fault::kBusy);
    for (std::uint64_t k = 0; k < 3; ++k) expect_as_sent(held[k], k);
    EXPECT_EQ(starloop_release_frame(reader, &held[1]), STARLOOP_OK);
    EXPECT_EQ(starloop_release_frame(reader, &held[1]), STARLOOP_REJECTED);
    EXPECT_TRUE(camera.send(3).ok());
    expect_next(reader, 3);
    EXPECT_EQ(camera.link.lost(), 0U);
  }
}

TEST(ShmLink, AWaitingCameraLosesNothingAndGoesOnWhenASlotIsFree) {
  constexpr std::uint64_t kFrames = 500;
  Camera camera(WhenFull::kWait, 2);
  std::jthread software([] {
    Reader reader;
    for (std::uint64_t k = 0; k < kFrames; ++k) {
      starloop_frame frame;
      ASSERT_EQ(reader.wait(frame, kLong_ms), STARLOOP_OK);
      expect_as_sent(frame, k);
      ASSERT_EQ(starloop_release_frame(reader, &frame), STARLOOP_OK);
    }
  });
  for (std::uint64_t k = 0; k < kFrames; ++k) ASSERT_TRUE(camera.send(k, kLong).ok());
  software.join();
  EXPECT_EQ(camera.link.lost(), 0U);
  EXPECT_EQ(camera.link.published(), kFrames);
}

// Whoever waits first is woken: in every round one side or the other does.
TEST(ShmLink, BothSidesWakeWhenTheyWaitBeforeThereIsAnything) {
  constexpr std::uint64_t kRounds = 1000;
  Camera camera(WhenFull::kWait);
  std::jthread software([] {
    Reader reader;
    for (std::uint64_t k = 0; k < kRounds; ++k) {
      starloop_frame frame;
      ASSERT_EQ(reader.wait(frame, kLong_ms), STARLOOP_OK);
      const starloop_answer answer = starloop_answer_to(&frame);
      ASSERT_EQ(starloop_send_report(reader, &answer), STARLOOP_OK);
      ASSERT_EQ(starloop_release_frame(reader, &frame), STARLOOP_OK);
    }
  });
  for (std::uint64_t k = 0; k < kRounds; ++k) {
    ASSERT_TRUE(camera.send(k, kLong).ok());
    const auto command = camera.link.receive(kLong);
    ASSERT_TRUE(command.ok()) << command.error().step;
    ASSERT_EQ(command.value().answers_frame, k);
    ASSERT_EQ(command.value().sequence, k);
  }
}

TEST(ShmLink, TheSecondReaderIsToldWhoHasTheLinkAndGetsItAfterwards) {
  Camera camera;
  starloop_client* second = nullptr;
  {
    Reader first;
    EXPECT_EQ(starloop_open(&second, link_name().c_str(), 1), STARLOOP_BUSY);
    EXPECT_EQ(second, nullptr);
    EXPECT_NE(std::string(starloop_last_error()).find("process " + std::to_string(getpid())),
              std::string::npos)
        << starloop_last_error();
    ASSERT_TRUE(camera.send(0).ok());
    expect_next(first, 0);
  }
  ASSERT_EQ(starloop_open(&second, link_name().c_str(), 0), STARLOOP_OK);
  starloop_close(second);
}

TEST(ShmLink, TheSecondCameraIsToldWhoHasTheNameAndTheFirstGoesOn) {
  Camera camera;
  Reader reader;
  EXPECT_NE(complaint_of_a_camera().find("is in use by process " + std::to_string(getpid())),
            std::string::npos);
  ASSERT_TRUE(camera.send(5).ok());
  expect_next(reader, 5);
}

TEST(ShmLink, AnObjectThatIsNoLinkOfOursIsLeftAlone) {
  const std::string path = "/" + link_name();
  const int fd = shm_open(path.c_str(), O_RDWR | O_CREAT | O_EXCL, 0600);
  ASSERT_GE(fd, 0);
  for (const off_t bytes : {0, 1, 100'000}) {
    ASSERT_EQ(ftruncate(fd, bytes), 0);
    EXPECT_NE(complaint_of_a_camera().find("is no link of ours"), std::string::npos) << bytes;
    starloop_client* client = nullptr;
    EXPECT_EQ(starloop_open(&client, path.c_str(), 0), STARLOOP_REJECTED);
  }
  EXPECT_EQ(shm_unlink(path.c_str()), 0) << "somebody removed it";
  close(fd);
}

TEST(ShmLink, TheEndOfACameraRemovesItsOwnObjectAndNoOther) {
  const std::string path = "/" + link_name();
  { const Camera camera; }
  EXPECT_EQ(shm_open(path.c_str(), O_RDWR, 0), -1);
  int other = -1;
  {
    const Camera camera;
    ASSERT_EQ(shm_unlink(path.c_str()), 0);
    other = shm_open(path.c_str(), O_RDWR | O_CREAT | O_EXCL, 0600);
    ASSERT_GE(other, 0);
  }
  EXPECT_EQ(shm_unlink(path.c_str()), 0) << "somebody removed it";
  close(other);
}

TEST(ShmLink, NobodyElseMayOpenTheObject) {
  const Camera camera;
  struct stat status {};
  ASSERT_EQ(stat(("/dev/shm/" + link_name()).c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 0777U, 0600U);
}

TEST(ShmLink, TheEndOfACameraWakesItsReaderAndWhatWasSentIsStillRead) {
  auto camera = std::make_unique<Camera>();
  Reader reader;
  ASSERT_TRUE(camera->send(0).ok());
  std::jthread software([&reader] {
    starloop_frame frame;
    ASSERT_EQ(reader.wait(frame, kLong_ms), STARLOOP_OK);
    expect_as_sent(frame, 0);
    EXPECT_EQ(reader.wait(frame, kLong_ms), STARLOOP_DISCONNECTED);
    const starloop_answer answer = starloop_answer_to(&frame);
    EXPECT_EQ(starloop_send_report(reader, &answer), STARLOOP_DISCONNECTED);
  });
  camera.reset();
}

TEST(ShmLink, ANewReaderStartsWithTheNextFrameAndInLockstepWithTheUnansweredOne) {
  for (const WhenFull when_full : {WhenFull::kDropOldest, WhenFull::kWait}) {
    Camera camera(when_full);
    {
      Reader first;
      ASSERT_TRUE(camera.send(0).ok());
    }
    Reader second;
    starloop_frame frame;
    if (when_full == WhenFull::kWait) {
      expect_next(second, 0);
    } else {
      EXPECT_EQ(second.wait(frame), STARLOOP_TIMEOUT);
    }
    ASSERT_TRUE(camera.send(1).ok());
    expect_next(second, 1);
  }
}

// ---- commands ---------------------------------------------------------------------------------

TEST(ShmLink, CommandsArriveInOrderAndThe65thIsBusyUntilOneIsTaken) {
  Camera camera;
  Reader reader;
  for (int i = 0; i < 64; ++i) ASSERT_EQ(starloop_send_ping(reader, nullptr), STARLOOP_OK);
  EXPECT_EQ(starloop_send_ping(reader, nullptr), STARLOOP_BUSY);
  for (std::uint64_t i = 0; i < 64; ++i) {
    const auto command = camera.link.receive(kAtOnce);
    ASSERT_TRUE(command.ok());
    EXPECT_EQ(command.value().sequence, i);
    EXPECT_EQ(command.value().kind, hil::CommandKind::kPing);
  }
  const auto none = camera.link.receive(kShort);
  ASSERT_FALSE(none.ok());
  EXPECT_EQ(none.error().fault, Fault::kTimeout);
  EXPECT_EQ(starloop_send_ping(reader, nullptr), STARLOOP_OK);
  EXPECT_TRUE(camera.link.receive(kAtOnce).ok());
}

TEST(ShmLink, EachAttachmentIsASenderOfItsOwn) {
  Camera camera;
  std::vector<std::uint32_t> senders;
  for (int i = 0; i < 3; ++i) {
    Reader reader;
    ASSERT_EQ(starloop_send_ping(reader, nullptr), STARLOOP_OK);
  }
  for (std::uint32_t i = 1; i <= 3; ++i) {
    const auto command = camera.link.receive(kAtOnce);
    ASSERT_TRUE(command.ok());
    EXPECT_EQ(command.value().sequence, 0U);
    EXPECT_EQ(command.value().sender, i);
  }
}

// ---- a peer that obeys no rule ----------------------------------------------------------------

TEST(ShmLink, GarbageAllOverTheHeaderNeitherCrashesNorHangsTheCameraAndANewReaderIsServed) {
  Camera camera;
  const Scribbler scribbler;
  std::mt19937_64 random(5);
  std::vector<unsigned char> fixed(64);
  std::memcpy(fixed.data(), &scribbler.shared(), fixed.size());
  {
    Reader reader;
    auto* words = reinterpret_cast<std::uint64_t*>(&scribbler.shared());
    const std::size_t count = sizeof(starloop_shm) / 8;
    for (std::uint64_t round = 0; round < 3000; ++round) {
      for (int i = 0; i < 100; ++i) {
        // Small numbers are the cunning ones: states, and counts that are nearly right.
        const std::uint64_t value = i % 2 == 0 ? random() : random() % 300;
        starloop_store64(&words[i % 4 == 0 ? random() % count : random() % 160], value);
      }
      static_cast<void>(camera.send(round));
      static_cast<void>(camera.link.receive(kAtOnce));
    }
    std::memcpy(&scribbler.shared(), fixed.data(), fixed.size());
  }
  while (camera.link.receive(kAtOnce).ok() ||
         scribbler.shared().packets_made != scribbler.shared().packets_taken) {
  }
  Reader next;
  for (std::uint64_t k = 0; k < 20; ++k) {
    ASSERT_TRUE(camera.send(k).ok());
    expect_next(next, k);
    ASSERT_EQ(starloop_send_ping(next, nullptr), STARLOOP_OK);
    EXPECT_TRUE(camera.link.receive(kAtOnce).ok());
  }
}

TEST(ShmLink, PacketsOfAbsurdLengthOrContentAreRejectedAndTheNextIsGood) {
  Camera camera;
  Reader reader;
  const Scribbler scribbler;
  for (const std::uint32_t used : {0U, 1U, 71U, 248U, 249U, 0xFFFFFFFFU}) {
    ASSERT_EQ(starloop_send_ping(reader, nullptr), STARLOOP_OK);
    const std::uint64_t made = scribbler.shared().packets_made;
    scribbler.shared().packet[(made - 1) % STARLOOP_SHM_PACKETS].used = used;
    const auto command = camera.link.receive(kAtOnce);
    ASSERT_FALSE(command.ok());
    EXPECT_EQ(command.error().fault, Fault::kRejected) << used;
  }
  ASSERT_EQ(starloop_send_ping(reader, nullptr), STARLOOP_OK);
  EXPECT_TRUE(camera.link.receive(kAtOnce).ok());
}

TEST(ShmLink, AnObjectCutShortIsDisconnectedAndNoSignal) {
  Camera camera;
  Reader reader;
  const Scribbler scribbler;
  ASSERT_EQ(ftruncate(scribbler.fd(), 100), 0);
  expect_fault(camera.send(0), Fault::kDisconnected);
  EXPECT_EQ(camera.link.receive(kAtOnce).error().fault, Fault::kDisconnected);
  EXPECT_FALSE(camera.link.has_reader());
  ASSERT_EQ(ftruncate(scribbler.fd(), 100'000'000), 0);  // the reader's own end needs its memory
}

TEST(ShmLink, NamesThatAreNoneAndFramesOfAnotherCameraAreRefused) {
  for (const std::string name : {"", "/", "a/b", ".", "..", "/../a"}) {
    EXPECT_THROW(ShmLink({.name = name}, 4, 4), std::runtime_error) << name;
    starloop_client* client = nullptr;
    EXPECT_EQ(starloop_open(&client, name.c_str(), 0), STARLOOP_REJECTED) << name;
  }
  Camera camera;
  Reader reader;
  const DnImage other(kWidth_px - 1, kHeight_px);
  Frame frame;
  expect_fault(camera.link.send(frame, kAtOnce), Fault::kRejected);
  frame.pixels = &other;
  expect_fault(camera.link.send(frame, kAtOnce), Fault::kRejected);
}

}  // namespace
