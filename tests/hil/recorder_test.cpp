#include "hil/recorder.h"

#include <algorithm>
#include <filesystem>
#include <semaphore>
#include <stdexcept>
#include <vector>

#include <gtest/gtest.h>

#include "engine/core/crc32c.h"
#include "tests/support/temp_file.h"

namespace {

using engine::Duration;
using engine::Fault;
using hil::Frame;
using hil::Recorder;
using hil::RecorderReport;
using hil::RecorderSpec;
using hil::Recording;
using hil::WhenBusy;
using test_support::TempFile;

constexpr Duration kLong = std::chrono::seconds(20);

hil::LogStart start_of(std::uint64_t frames) {
  hil::LogStart start;
  start.loop.frames = frames;
  start.loop.width_px = 8;
  start.loop.height_px = 4;
  return start;
}

engine::DnImage image_of(std::uint64_t sequence) {
  engine::DnImage image(8, 4);
  for (std::size_t i = 0; i < 32; ++i)
    image.pixels()[i] = static_cast<std::uint16_t>(sequence * 100 + i);
  return image;
}

Frame frame_of(std::uint64_t sequence, const engine::DnImage& image) {
  Frame frame;
  frame.sequence = sequence;
  frame.shutter_open = engine::SimTime(Duration(static_cast<std::int64_t>(sequence) * 1000));
  frame.pixels = &image;
  return frame;
}

/// Remembers what it was given; fails where it is told to; waits for a gate if there is one.
class Store final : public hil::FrameStore {
 public:
  void put(const Frame& frame) override {
    if (gate != nullptr) gate->acquire();
    if (fails) throw std::runtime_error("no room for frame " + std::to_string(frame.sequence));
    const auto p = frame.pixels->pixels();
    kept.emplace_back(frame.sequence, std::vector<std::uint16_t>(p.begin(), p.end()));
  }
  void finish() override { ++finished; }

  std::counting_semaphore<>* gate = nullptr;
  bool fails = false;
  int finished = 0;
  std::vector<std::pair<std::uint64_t, std::vector<std::uint16_t>>> kept;
};

TEST(Recorder, LogsEveryFramesChecksumAndKeepsThePixelsOfEveryNth) {
  const TempFile file("record.slog");
  Store store;
  RecorderSpec spec{.log_path = file.path(), .record_every = 3, .when_busy = WhenBusy::kWait};
  Recorder recorder(spec, start_of(20), &store);
  for (std::uint64_t k = 0; k < 20; ++k) {
    const engine::DnImage image = image_of(k);
    ASSERT_TRUE(recorder.send(frame_of(k, image), kLong).ok());
  }
  const RecorderReport report = recorder.finish({});
  EXPECT_EQ(report.records, 22U);  // a start, twenty frames and an end
  EXPECT_EQ(report.records_lost, 0U);
  EXPECT_EQ(report.kept, 7U);
  EXPECT_EQ(report.left_out, 0U);
  EXPECT_EQ(store.finished, 1);
  ASSERT_EQ(store.kept.size(), 7U);
  for (std::size_t i = 0; i < 7; ++i) {
    EXPECT_EQ(store.kept[i].first, 3 * i);
    EXPECT_TRUE(std::ranges::equal(store.kept[i].second, image_of(3 * i).pixels()));
  }
  const Recording log = hil::load_recording(file.path());
  EXPECT_EQ(log.fault, "");
  ASSERT_TRUE(log.end);
  EXPECT_EQ(log.end->log_lost, 0U);
  ASSERT_EQ(log.frames.size(), 20U);
  for (std::uint64_t k = 0; k < 20; ++k) {
    EXPECT_EQ(log.frames[k].sequence, k);
    EXPECT_EQ(log.frames[k].width_px, 8);
    const engine::DnImage image = image_of(k);
    EXPECT_EQ(log.frames[k].pixels_crc32c, engine::crc32c(std::as_bytes(image.pixels())));
  }
}

TEST(Recorder, InRealTimeASlowStoreCostsPixelsAndNotTheLog) {
  const TempFile file("record.slog");
  std::counting_semaphore<> gate{0};
  Store store;
  store.gate = &gate;
  Recorder recorder({.log_path = file.path()}, start_of(50), &store);
  std::uint64_t refused = 0;
  for (std::uint64_t k = 0; k < 50; ++k) {
    const engine::DnImage image = image_of(k);
    const engine::Status status = recorder.send(frame_of(k, image), kLong);
    if (status.ok()) continue;
    EXPECT_EQ(status.error().fault, Fault::kBusy);
    ++refused;
  }
  gate.release(50);
  const RecorderReport report = recorder.finish({});
  EXPECT_EQ(refused, 46U);  // four buffers, and nobody empties them
  EXPECT_EQ(report.left_out, 46U);
  EXPECT_EQ(report.kept, 4U);
  EXPECT_EQ(report.records_lost, 0U);
  EXPECT_EQ(hil::load_recording(file.path()).frames.size(), 50U);
}

TEST(Recorder, ARehearsalWaitsForItsStore) {
  const TempFile file("record.slog");
  std::counting_semaphore<> gate{0};
  Store store;
  store.gate = &gate;
  Recorder recorder({.log_path = file.path(), .when_busy = WhenBusy::kWait}, start_of(50), &store);
  std::jthread opener([&gate] { gate.release(50); });
  for (std::uint64_t k = 0; k < 50; ++k) {
    const engine::DnImage image = image_of(k);
    EXPECT_TRUE(recorder.send(frame_of(k, image), kLong).ok());
  }
  EXPECT_EQ(recorder.finish({}).kept, 50U);
}

TEST(Recorder, AStoreThatFailsIsCountedAndAskedAgain) {
  const TempFile file("record.slog");
  Store store;
  store.fails = true;
  Recorder recorder({.log_path = file.path(), .when_busy = WhenBusy::kWait}, start_of(6), &store);
  for (std::uint64_t k = 0; k < 6; ++k) {
    const engine::DnImage image = image_of(k);
    EXPECT_TRUE(recorder.send(frame_of(k, image), kLong).ok());
  }
  const RecorderReport report = recorder.finish({});
  EXPECT_EQ(report.failed, 6U);
  EXPECT_EQ(report.kept, 0U);
  EXPECT_EQ(report.failure, "no room for frame 0");
}

TEST(Recorder, ALogOnAFullDiskIsCountedAndTheFramesGoOn) {
  Store store;
  Recorder recorder({.log_path = "/dev/full", .when_busy = WhenBusy::kWait}, start_of(5), &store);
  for (std::uint64_t k = 0; k < 5; ++k) {
    const engine::DnImage image = image_of(k);
    EXPECT_TRUE(recorder.send(frame_of(k, image), kLong).ok());
  }
  recorder.log(hil::CommandRecord{});
  recorder.log(hil::FrameRecord{});
  const RecorderReport report = recorder.finish({});
  EXPECT_EQ(report.records, 0U);
  EXPECT_EQ(report.records_lost, 9U);  // a start, five frames, two of the observer, an end
  EXPECT_EQ(report.log_fault.code, ENOSPC);
  EXPECT_EQ(report.kept, 5U);
}

TEST(Recorder, RawPixelsComeBackAndAWrongOneIsNotBelieved) {
  const TempFile file("frames.slog");
  {
    hil::RawStore store(file.path(), Duration{});
    for (std::uint64_t k = 0; k < 5; ++k) {
      const engine::DnImage image = image_of(k);
      store.put(frame_of(k, image));
    }
  }
  for (std::uint64_t k = 0; k < 5; ++k) {
    const auto got = hil::recorded_pixels(file.path(), k);
    ASSERT_TRUE(got);
    EXPECT_EQ(got->width(), 8);
    EXPECT_TRUE(std::ranges::equal(got->pixels(), image_of(k).pixels()));
  }
  EXPECT_FALSE(hil::recorded_pixels(file.path(), 5));
  EXPECT_FALSE(hil::recorded_pixels("/nowhere/frames.slog", 0));
  const TempFile forged("forged.slog");
  {
    hil::RawLog log(forged.path(), Duration{});
    const engine::DnImage image = image_of(0);
    hil::LogFrame note = hil::log_frame(frame_of(0, image));
    note.flags = hil::LogFrame::kPixelsFollow;
    note.width_px = 1 << 30;
    hil::LogBytes head;
    hil::encode(note, head);
    ASSERT_TRUE(log.append(2, head, std::as_bytes(image.pixels())).ok());
  }
  EXPECT_FALSE(hil::recorded_pixels(forged.path(), 0));
  hil::RawStore full("/dev/full", Duration{});
  const engine::DnImage image = image_of(0);
  EXPECT_THROW(full.put(frame_of(0, image)), std::runtime_error);
}

TEST(Recorder, FitsFilesAreNamedByFrameAndSayWhatItKnows) {
  const TempFile marker("fits");
  const std::filesystem::path folder = marker.path() + "_folder";
  std::filesystem::create_directory(folder);
  hil::FitsStore store(folder.string(), {{"SCENARIO", std::string("small"), ""}});
  const engine::DnImage image = image_of(12);
  Frame frame = frame_of(12, image);
  frame.measured.j2000_to_camera = {0.5, -0.5, 0.5, -0.5};
  store.put(frame);
  const std::filesystem::path file = folder / "frame_000012.fits";
  EXPECT_TRUE(std::ranges::equal(engine::read_fits(file.string()).pixels(), image.pixels()));
  std::ifstream in(file, std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(in), {}};
  EXPECT_NE(bytes.find("SCENARIO= 'small"), std::string::npos);
  EXPECT_NE(bytes.find("FRAMENO =                   12"), std::string::npos);
  EXPECT_NE(bytes.find("TIMENS  =                12000"), std::string::npos);
  EXPECT_NE(bytes.find("QUATX   =                 -0.5"), std::string::npos);
  std::filesystem::remove_all(folder);
}

}  // namespace
