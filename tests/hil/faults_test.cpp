#include <algorithm>
#include <bit>
#include <cmath>
#include <map>
#include <memory>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "hil/faults/faulty_commands.h"
#include "hil/faults/faulty_sink.h"
#include "hil/frame_loop.h"
#include "tests/support/fakes.h"

namespace {

using engine::ConfigError;
using engine::ConfigReader;
using engine::DnImage;
using engine::Duration;
using engine::Error;
using engine::Expected;
using engine::SimTime;
using engine::Status;
using hil::Command;
using hil::FaultKind;
using hil::FaultRecord;
using hil::FaultSpec;
using hil::FaultyCommands;
using hil::FaultySink;
using hil::Frame;

constexpr int kWidth = 24;
constexpr int kHeight = 16;
constexpr int kBits = 11;
constexpr int kFullScale = 2047;
constexpr Duration kPeriod{100'000'000};
const SimTime kStart = engine::sim_time(1000.0);

FaultSpec faults(const std::string& toml, std::uint64_t seed = 1, int width_px = kWidth) {
  const ConfigReader config = ConfigReader::from_text(toml, "faults.toml");
  FaultSpec spec = hil::read_faults(config, seed, width_px, kBits);
  config.reject_unknown_keys();
  return spec;
}

/// What the other end of the cable got.
struct Arrived {
  std::uint64_t sequence = 0;
  SimTime shutter_open{};
  std::vector<std::uint16_t> pixels;
  std::vector<std::uint16_t> telemetry_row;
  const DnImage* address = nullptr;
  const engine::TruthMask* mask = nullptr;
  Duration timeout{};
};

class Cable final : public hil::FrameSink {
 public:
  Status send(const Frame& frame, Duration timeout) noexcept override {
    if (broken) return Error{engine::Fault::kBusy, 0, "cable"};
    const auto pixels = frame.pixels->pixels();
    got.push_back({frame.sequence,
                   frame.shutter_open,
                   {pixels.begin(), pixels.end()},
                   {frame.telemetry_row.begin(), frame.telemetry_row.end()},
                   frame.pixels,
                   frame.truth_mask,
                   timeout});
    return engine::Done{};
  }
  [[nodiscard]] std::vector<std::uint64_t> sequences() const {
    std::vector<std::uint64_t> all;
    for (const Arrived& a : got) all.push_back(a.sequence);
    return all;
  }

  std::vector<Arrived> got;
  bool broken = false;
};

/// What the camera shows in frame k: every pixel and frame another value, none at full scale.
std::uint16_t shown(std::uint64_t k, int u, int v) {
  return static_cast<std::uint16_t>((k * 131 + static_cast<std::uint64_t>(v * kWidth + u) * 7) %
                                    2000);
}

/// A camera head in front of the faults: four slots in turn, as the loop has them.
class Head {
 public:
  explicit Head(const std::string& toml, std::uint64_t seed = 1, hil::Clock* clock = nullptr)
      : spec_(faults(toml, seed)),
        sink_(std::make_unique<FaultySink>(spec_, FaultySink::Shape{kWidth, kHeight}, kStart, cable,
                                           clock)),
        row_(kWidth) {
    for (DnImage& slot : slots_) slot.resize(kWidth, kHeight);
  }

  Status send(std::uint64_t k, Duration timeout = kPeriod) {
    DnImage& slot = slot_of(k);
    for (int v = 0; v < kHeight; ++v)
      for (int u = 0; u < kWidth; ++u) slot.at(u, v) = paint ? paint(k, u, v) : shown(k, u, v);
    const std::vector<std::uint16_t> before(slot.pixels().begin(), slot.pixels().end());
    std::fill(row_.begin(), row_.end(), static_cast<std::uint16_t>(k));
    Frame frame;
    frame.sequence = k;
    frame.shutter_open = kStart + kPeriod * static_cast<std::int64_t>(k);
    frame.bits = kBits;
    frame.pixels = &slot;
    frame.telemetry_row = row_;
    frame.truth_mask = &mask_;
    const Status status = sink_->send(frame, timeout);
    EXPECT_TRUE(std::equal(before.begin(), before.end(), slot.pixels().begin()))
        << "the loop's own slot was written";
    for (FaultRecord r; sink_->records().pop(r);) records.push_back(r);
    return status;
  }
  void send_all(std::uint64_t frames) {
    for (std::uint64_t k = 0; k < frames; ++k) static_cast<void>(send(k));
  }

  [[nodiscard]] DnImage& slot_of(std::uint64_t k) { return slots_[k % slots_.size()]; }
  [[nodiscard]] FaultySink& sink() { return *sink_; }
  [[nodiscard]] const FaultSpec& spec() const { return spec_; }
  [[nodiscard]] const engine::TruthMask* mask() const { return &mask_; }
  [[nodiscard]] std::map<std::uint64_t, FaultRecord> by_frame() const {
    std::map<std::uint64_t, FaultRecord> out;
    for (const FaultRecord& r : records) EXPECT_TRUE(out.emplace(r.frame, r).second) << r.frame;
    return out;
  }

  Cable cable;
  std::function<std::uint16_t(std::uint64_t, int, int)> paint;
  std::vector<FaultRecord> records;

 private:
  FaultSpec spec_;
  std::unique_ptr<FaultySink> sink_;
  std::array<DnImage, 4> slots_;
  std::vector<std::uint16_t> row_;
  engine::TruthMask mask_;
};

void expect_adds_up(const FaultySink& sink) {
  const hil::FrameFaultCounts& c = sink.counts();
  EXPECT_EQ(c.taken, c.delivered + c.dropped + c.away + c.refused + c.held);
  EXPECT_EQ(c.copies, c.copies_delivered + c.copies_refused + c.copies_held);
}

std::uint16_t pixel(const Arrived& a, int u, int v) {
  return a.pixels[static_cast<std::size_t>(v * kWidth + u)];
}

bool is_clean(const Arrived& a, std::uint64_t k) {
  for (int v = 0; v < kHeight; ++v)
    for (int u = 0; u < kWidth; ++u)
      if (pixel(a, u, v) != shown(k, u, v)) return false;
  return true;
}

/// Half a width of five sigma about what n tries of chance p give.
double five_sigma(double n, double p) { return 5.0 * std::sqrt(n * p * (1.0 - p)); }

// ---- none ---------------------------------------------------------------------------------------

TEST(Faults, WithoutAnyEveryFrameGoesOnAsItIsInTheLoopsOwnMemory) {
  Head head("");
  for (std::uint64_t k = 0; k < 20; ++k) {
    EXPECT_TRUE(head.send(k).ok());
    const Arrived& a = head.cable.got.back();
    EXPECT_EQ(a.address, &head.slot_of(k));
    EXPECT_EQ(a.mask, head.mask());
    EXPECT_EQ(a.sequence, k);
    EXPECT_EQ(a.shutter_open, kStart + kPeriod * static_cast<std::int64_t>(k));
    EXPECT_EQ(a.timeout, kPeriod);
    EXPECT_TRUE(is_clean(a, k));
  }
  EXPECT_EQ(head.cable.got.size(), 20U);
  EXPECT_TRUE(head.records.empty());
  EXPECT_EQ(head.sink().counts().delivered, 20U);
  expect_adds_up(head.sink());
}

TEST(Faults, AFrameThatNoneHappensToIsNotCopied) {
  // Every kind there is, from frame 10 on.
  std::string toml;
  for (const char* keys : {"away]", "dropped]", "late]", "slow]\nms = 1", "duplicated]", "frozen]",
                           "rays]", "blooming]", "hot_column]\ndn = 5", "stuck_column]", "torn]",
                           "flipped]\nbit_error_rate = 0.1", "clock]\nppm = 5", "command_lost]",
                           "command_corrupted]", "command_delayed]", "command_duplicated]"})
    toml += "[faults." + std::string(keys) + "\nfrom_frame = 10\n";
  Head head(toml);
  EXPECT_EQ(head.spec().faults.size(), static_cast<std::size_t>(hil::kFaultKinds));
  head.send_all(10);
  ASSERT_EQ(head.cable.got.size(), 10U);
  for (std::uint64_t k = 0; k < 10; ++k) {
    EXPECT_EQ(head.cable.got[k].address, &head.slot_of(k));
    EXPECT_TRUE(is_clean(head.cable.got[k], k));
  }
  EXPECT_TRUE(head.records.empty());
}

// ---- when ---------------------------------------------------------------------------------------

TEST(Faults, AWindowHoldsFromItsFirstInstantToJustBeforeItsLast) {
  Head head(R"([faults.dropped]
from_s = 0.3
to_s = 0.5
[faults.by_number]
kind = "dropped"
from_frame = 7
to_frame = 9)");
  head.send_all(12);
  EXPECT_EQ(head.cable.sequences(), (std::vector<std::uint64_t>{0, 1, 2, 5, 6, 9, 10, 11}));
  ASSERT_EQ(head.records.size(), 4U);
  EXPECT_EQ(head.spec().faults[head.records[0].fault].name, "dropped");
  EXPECT_EQ(head.spec().faults[head.records[3].fault].name, "by_number");
  EXPECT_EQ(head.records[0].since_start, kPeriod * 3);
}

TEST(Faults, BothWindowsOfATableMustHold) {
  Head head("[faults.dropped]\nfrom_s = 0.3\nto_frame = 5");
  head.send_all(8);
  EXPECT_EQ(head.cable.sequences(), (std::vector<std::uint64_t>{0, 1, 2, 5, 6, 7}));
}

TEST(Faults, AProbabilityIsTheShareOfFramesItHappensTo) {
  constexpr double kFrames = 4000;
  for (const double p : {0.0, 0.02, 0.5, 1.0}) {
    Head head("[faults.dropped]\nprobability = " + std::to_string(p));
    head.send_all(static_cast<std::uint64_t>(kFrames));
    EXPECT_NEAR(static_cast<double>(head.records.size()), kFrames * p, five_sigma(kFrames, p)) << p;
    EXPECT_EQ(head.sink().counts().dropped, head.records.size());
    EXPECT_EQ(head.sink().counts().delivered, head.cable.got.size());
    expect_adds_up(head.sink());
  }
}

std::vector<std::uint64_t> dropped_frames(const std::string& toml, std::uint64_t seed) {
  Head head(toml, seed);
  head.send_all(400);
  std::vector<std::uint64_t> all;
  for (const FaultRecord& r : head.records)
    if (r.kind == FaultKind::kDropped) all.push_back(r.frame);
  return all;
}

TEST(Faults, TheSameSeedGivesTheSameFaultsAndAnotherTableChangesNone) {
  const std::string toml = "[faults.dropped]\nprobability = 0.2\n";
  const auto once = dropped_frames(toml, 7);
  EXPECT_EQ(once, dropped_frames(toml, 7));
  EXPECT_NE(once, dropped_frames(toml, 8));
  EXPECT_EQ(once,
            dropped_frames(toml + "[faults.a_ray]\nkind = \"rays\"\n[faults.clock]\nppm=3", 7));
  // Another name is another fault.
  EXPECT_NE(once, dropped_frames("[faults.other]\nkind = \"dropped\"\nprobability = 0.2\n", 7));
}

TEST(Faults, WhatHappensToAFrameDependsOnItsNumberNotOnThoseBeforeIt) {
  const std::string toml = "[faults.rays]\ntracks = 2\n[faults.flipped]\nbit_error_rate = 0.001";
  Head all(toml);
  Head odd(toml);
  all.send_all(40);
  for (std::uint64_t k = 1; k < 40; k += 2) static_cast<void>(odd.send(k));
  for (std::size_t i = 0; i < odd.cable.got.size(); ++i)
    EXPECT_EQ(odd.cable.got[i].pixels, all.cable.got[2 * i + 1].pixels);
}

// ---- on the wire --------------------------------------------------------------------------------

TEST(Faults, ALinkThatIsAwayIsNotTouchedAndComesBack) {
  Head head("[faults.away]\nfrom_frame = 3\nto_frame = 6");
  for (std::uint64_t k = 0; k < 10; ++k) {
    const Status status = head.send(k);
    EXPECT_EQ(status.ok(), k < 3 || k >= 6) << k;
    if (!status.ok()) {
      EXPECT_EQ(status.error().fault, engine::Fault::kDisconnected);
    }
  }
  EXPECT_EQ(head.cable.sequences(), (std::vector<std::uint64_t>{0, 1, 2, 6, 7, 8, 9}));
  EXPECT_EQ(head.records.size(), 3U);
  EXPECT_EQ(head.sink().counts().away, 3U);
  expect_adds_up(head.sink());
}

TEST(Faults, ALateFrameComesJustBeforeTheOneItIsHeldBackTo) {
  Head head("[faults.late]\nframes = 3\nfrom_frame = 2\nto_frame = 4");
  head.send_all(9);
  EXPECT_EQ(head.cable.sequences(), (std::vector<std::uint64_t>{0, 1, 4, 2, 5, 3, 6, 7, 8}));
  for (const Arrived& a : head.cable.got) {
    EXPECT_TRUE(is_clean(a, a.sequence)) << "held in a slot that another frame took";
    EXPECT_EQ(a.telemetry_row,
              std::vector<std::uint16_t>(kWidth, static_cast<std::uint16_t>(a.sequence)));
    EXPECT_EQ(a.shutter_open, kStart + kPeriod * static_cast<std::int64_t>(a.sequence));
    const bool held = a.sequence == 2 || a.sequence == 3;
    EXPECT_EQ(a.mask, held ? nullptr : head.mask());
  }
  ASSERT_EQ(head.records.size(), 2U);
  EXPECT_EQ(head.records[0].count, 3);
  expect_adds_up(head.sink());
}

TEST(Faults, FramesHeldAtTheEndAreCountedAsHeld) {
  Head head("[faults.late]\nframes = 4");
  head.send_all(10);
  EXPECT_EQ(head.cable.sequences(), (std::vector<std::uint64_t>{0, 1, 2, 3, 4, 5}));
  EXPECT_EQ(head.sink().counts().held, 4U);
  EXPECT_EQ(head.sink().counts().delivered, 6U);
  EXPECT_EQ(head.records.size(), 10U);
  expect_adds_up(head.sink());
}

TEST(Faults, ACopyWaitsForTheNextFrameThatGoesOutItself) {
  Head head(R"([faults.duplicated]
to_frame = 1
[faults.dropped]
from_frame = 1
to_frame = 3
[faults.late]
from_frame = 3
to_frame = 4)");
  head.send_all(6);
  EXPECT_EQ(head.cable.sequences(), (std::vector<std::uint64_t>{0, 0, 3, 4, 5}));
  expect_adds_up(head.sink());
}

TEST(Faults, ADuplicateIsTheSameFrameOnceMoreJustBeforeTheNext) {
  Head head("[faults.duplicated]\nfrom_frame = 1\nto_frame = 3\n[faults.rays]\ntracks = 3");
  head.send_all(5);
  EXPECT_EQ(head.cable.sequences(), (std::vector<std::uint64_t>{0, 1, 1, 2, 2, 3, 4}));
  EXPECT_EQ(head.cable.got[1].pixels, head.cable.got[2].pixels);
  EXPECT_EQ(head.cable.got[3].pixels, head.cable.got[4].pixels);
  EXPECT_EQ(head.cable.got[2].timeout, kPeriod / 2) << "two in the time of one";
  EXPECT_EQ(head.sink().counts().delivered, 5U);
  EXPECT_EQ(head.sink().counts().copies_delivered, 2U);
  expect_adds_up(head.sink());
}

TEST(Faults, WhatTheRealLinkRefusesIsItsFaultNotOurs) {
  Head head(
      "[faults.late]\nfrom_frame = 1\nto_frame = 2\n[faults.duplicated]\nfrom_frame = 0\nto_frame "
      "= 1");
  head.cable.broken = true;
  EXPECT_FALSE(head.send(0).ok());
  EXPECT_TRUE(head.send(1).ok()) << "held back: nobody knows yet";
  EXPECT_FALSE(head.send(2).ok());
  EXPECT_EQ(head.sink().counts().refused, 3U);
  EXPECT_EQ(head.sink().counts().copies_refused, 1U);
  EXPECT_EQ(head.records.size(), 2U);
  expect_adds_up(head.sink());
}

TEST(Faults, ASlowLinkTakesItsTimeAndNeverMoreThanItIsGiven) {
  hil::ManualClock clock(kStart);
  Head head("[faults.slow]\nms = 30\nto_frame = 2", 1, &clock);
  EXPECT_TRUE(head.send(0, Duration(50'000'000)).ok());
  EXPECT_EQ(clock.now(), kStart + Duration(30'000'000));
  EXPECT_EQ(head.cable.got[0].timeout, Duration(20'000'000));
  const Status late = head.send(1, Duration(20'000'000));
  ASSERT_FALSE(late.ok());
  EXPECT_EQ(late.error().fault, engine::Fault::kTimeout);
  EXPECT_EQ(clock.now(), kStart + Duration(50'000'000));
  EXPECT_TRUE(head.send(2).ok());
  EXPECT_EQ(clock.now(), kStart + Duration(50'000'000));
  EXPECT_EQ(head.records.size(), 2U);
  EXPECT_EQ(head.cable.got.size(), 2U);
  expect_adds_up(head.sink());
  Head lockstep("[faults.slow]\nms = 30");
  EXPECT_TRUE(lockstep.send(0).ok());
  EXPECT_TRUE(lockstep.records.empty());
}

TEST(Faults, TogetherTheyStillAddUpAndEveryFrameHasOneRoute) {
  Head head(R"([faults.away]
probability = 0.1
[faults.dropped]
probability = 0.2
[faults.late]
probability = 0.3
frames = 5
[faults.later]
kind = "late"
probability = 0.1
frames = 2
[faults.duplicated]
probability = 0.3
[faults.frozen]
probability = 0.2
[faults.torn]
probability = 0.2
[faults.flipped]
bit_error_rate = 0.0001
[faults.clock]
ppm = 100)");
  constexpr double kFrames = 3000;
  head.send_all(static_cast<std::uint64_t>(kFrames));
  const hil::FrameFaultCounts& c = head.sink().counts();
  EXPECT_EQ(c.taken, 3000U);
  expect_adds_up(head.sink());
  EXPECT_EQ(head.cable.got.size(), c.delivered + c.copies_delivered);
  // Dropped: not away, and then one in five.
  EXPECT_NEAR(static_cast<double>(c.dropped), kFrames * 0.18, five_sigma(kFrames, 0.18));
  std::vector<std::uint64_t> happened(head.spec().faults.size());
  std::map<std::uint64_t, int> routes;
  for (const FaultRecord& r : head.records) {
    ++happened[r.fault];
    if (r.kind <= FaultKind::kDuplicated) ++routes[r.frame];
  }
  EXPECT_EQ(happened, head.sink().happened());
  EXPECT_EQ(c.records_lost, 0U);
  for (const auto& [frame, count] : routes) EXPECT_EQ(count, 1) << frame;
  std::map<std::uint64_t, int> arrivals;
  for (const Arrived& a : head.cable.got) ++arrivals[a.sequence];
  for (const auto& [frame, count] : arrivals) EXPECT_LE(count, 2) << frame;
}

TEST(Faults, RecordsThatNobodyTakesAreCountedAndTheFaultStillHappens) {
  const FaultSpec spec = faults("[faults.dropped]");
  Cable cable;
  FaultySink sink(spec, {kWidth, kHeight}, kStart, cable, nullptr);
  const DnImage image(kWidth, kHeight);
  Frame frame;
  frame.pixels = &image;
  frame.shutter_open = kStart;
  for (; frame.sequence < 5000; ++frame.sequence) static_cast<void>(sink.send(frame, kPeriod));
  EXPECT_EQ(sink.happened()[0], 5000U);
  EXPECT_EQ(sink.counts().records_lost, 5000U - 4096U);
  EXPECT_TRUE(cable.got.empty());
}

// ---- in the header ------------------------------------------------------------------------------

TEST(Faults, AClockThatDriftsIsOffByItsRateTimesItsTimeAndByItsJump) {
  Head head(R"([faults.clock]
from_s = 1.0
to_s = 3.0
ppm = 200.0
jump_ms = -4.0)");
  head.send_all(40);
  const auto records = head.by_frame();
  for (std::uint64_t k = 0; k < 40; ++k) {
    const Arrived& a = head.cable.got[k];
    const SimTime truth = kStart + kPeriod * static_cast<std::int64_t>(k);
    Duration off{};
    // 200 ppm of 100 ms a frame are 20 us.
    if (k >= 10 && k < 30) off = Duration(-4'000'000 + static_cast<std::int64_t>(k - 10) * 20'000);
    EXPECT_EQ(a.shutter_open - truth, off) << k;
    EXPECT_EQ(a.address, &head.slot_of(k)) << "pixels copied for a time";
    EXPECT_EQ(records.contains(k), off != Duration{}) << k;
    if (records.contains(k)) {
      EXPECT_EQ(records.at(k).amount, static_cast<double>(off.count()));
    }
  }
}

// ---- in the pixels ------------------------------------------------------------------------------

TEST(Faults, AFrozenPictureIsTheLastThatWasNotWhileHeadersGoOn) {
  Head head("[faults.frozen]\nfrom_frame = 4\nto_frame = 7");
  head.send_all(10);
  for (std::uint64_t k = 0; k < 10; ++k) {
    const bool frozen = k >= 4 && k < 7;
    EXPECT_TRUE(is_clean(head.cable.got[k], frozen ? 3 : k)) << k;
    EXPECT_EQ(head.cable.got[k].sequence, k);
    EXPECT_EQ(head.cable.got[k].telemetry_row[0], k);
    EXPECT_EQ(head.cable.got[k].address == &head.slot_of(k), !frozen);
  }
  ASSERT_EQ(head.records.size(), 3U);
  for (const FaultRecord& r : head.records) EXPECT_EQ(r.amount, 3.0);
}

TEST(Faults, TheFirstFrameIsNeitherFrozenNorTornForThereIsNoneBefore) {
  Head head("[faults.frozen]\nto_frame = 1\n[faults.torn]\nto_frame = 1");
  head.send_all(2);
  EXPECT_TRUE(is_clean(head.cable.got[0], 0));
  EXPECT_TRUE(is_clean(head.cable.got[1], 1));
  EXPECT_TRUE(head.records.empty());
}

TEST(Faults, ATornPictureEndsInTheWholeFrameBeforeItHoweverManyAreTornInARow) {
  Head head("[faults.torn]\nfrom_frame = 2");
  head.send_all(200);
  const auto records = head.by_frame();
  EXPECT_EQ(records.size(), 198U);
  std::vector<int> torn_at(kHeight);
  for (std::uint64_t k = 2; k < 200; ++k) {
    const int first = static_cast<int>(records.at(k).place);
    ASSERT_GE(first, 1);
    ASSERT_LT(first, kHeight);
    EXPECT_EQ(records.at(k).count, kHeight - first);
    ++torn_at[static_cast<std::size_t>(first)];
    for (int v = 0; v < kHeight; ++v)
      for (int u = 0; u < kWidth; ++u)
        ASSERT_EQ(pixel(head.cable.got[k], u, v), shown(v < first ? k : k - 1, u, v)) << k;
  }
  // 198 tears over 15 rows: none is left out but with a chance of 15 (14/15)^198 = 2e-5.
  for (int v = 1; v < kHeight; ++v) EXPECT_GT(torn_at[static_cast<std::size_t>(v)], 0) << v;
}

TEST(Faults, AFrameThatIsDroppedIsNotTheOneBefore) {
  Head head("[faults.dropped]\nfrom_frame = 3\nto_frame = 4\n[faults.frozen]\nfrom_frame = 4");
  head.send_all(6);
  EXPECT_TRUE(is_clean(head.cable.got.back(), 2));
}

TEST(Faults, StuckColumnsShowOneValueAndNothingElseChanges) {
  Head head("[faults.stuck_column]\ncolumn = 5\ncolumns = 2\ndn = 1234");
  head.send_all(3);
  for (std::uint64_t k = 0; k < 3; ++k)
    for (int v = 0; v < kHeight; ++v)
      for (int u = 0; u < kWidth; ++u)
        EXPECT_EQ(pixel(head.cable.got[k], u, v), u == 5 || u == 6 ? 1234 : shown(k, u, v));
  ASSERT_EQ(head.records.size(), 6U);
  EXPECT_EQ(head.records[0].place, 5);
  EXPECT_EQ(head.records[1].place, 6);
  EXPECT_EQ(head.records[0].amount, 1234.0);
  EXPECT_EQ(head.records[0].count, kHeight);
}

TEST(Faults, HotColumnsAddUpToFullScaleAndNotBeyond) {
  Head head("[faults.hot_column]\ncolumn = 0\ndn = 1000");
  head.send_all(8);
  for (std::uint64_t k = 0; k < 8; ++k)
    for (int v = 0; v < kHeight; ++v)
      for (int u = 0; u < kWidth; ++u)
        EXPECT_EQ(pixel(head.cable.got[k], u, v),
                  u == 0 ? std::min(shown(k, u, v) + 1000, kFullScale) : shown(k, u, v));
  EXPECT_EQ(head.records.size(), 8U);
}

TEST(Faults, ColumnsThatAreDrawnAreDistinctAndStayWhereTheyAre) {
  const FaultSpec spec = faults("[faults.hot_column]\ncolumns = 20\ndn = 9", 3);
  std::vector<int> columns = spec.faults[0].columns;
  ASSERT_EQ(columns.size(), 20U);
  std::sort(columns.begin(), columns.end());
  EXPECT_EQ(std::adjacent_find(columns.begin(), columns.end()), columns.end());
  EXPECT_GE(columns.front(), 0);
  EXPECT_LT(columns.back(), kWidth);
  EXPECT_NE(columns, faults("[faults.hot_column]\ncolumns = 20\ndn = 9", 4).faults[0].columns);
}

TEST(Faults, RaysAreAsManyAsSaidAndWhatTheyAddIsInTheRecords) {
  constexpr std::uint64_t kFrames = 1000;
  Head head("[faults.rays]\ntracks = 2.5\nlength_px = 6\ndn_per_px = 100");
  head.send_all(kFrames);
  // Poisson: the variance is the mean.
  EXPECT_NEAR(static_cast<double>(head.records.size()), 2500.0, 5.0 * 50.0);
  std::vector<std::int64_t> added(kFrames);
  std::vector<int> tracks(kFrames);
  for (const FaultRecord& r : head.records) {
    added[r.frame] += static_cast<std::int64_t>(r.amount);
    ++tracks[r.frame];
    EXPECT_GE(r.count, 1);
    EXPECT_LT(r.place, kWidth * kHeight);
    EXPECT_GE(r.amount, 0.0);
  }
  for (std::uint64_t k = 0; k < kFrames; ++k) {
    std::int64_t sum = 0;
    int lower = 0;
    for (int v = 0; v < kHeight; ++v)
      for (int u = 0; u < kWidth; ++u) {
        const int more = pixel(head.cable.got[k], u, v) - shown(k, u, v);
        sum += more;
        lower += more < 0 ? 1 : 0;
        EXPECT_LE(pixel(head.cable.got[k], u, v), kFullScale);
      }
    EXPECT_EQ(sum, added[k]) << k;
    EXPECT_EQ(lower, 0);
    EXPECT_EQ(head.cable.got[k].address == &head.slot_of(k), tracks[k] == 0);
  }
}

// On a field so large that few tracks reach its edge: length and charge have their means.
TEST(Faults, ARayIsAStraightLineWithItsMeanLengthAndCharge) {
  constexpr int kTracks = 4000;
  DnImage image(1024, 1024);
  double length_px = 0;
  double charge_dn = 0;
  int inside = 0;
  for (std::uint32_t i = 0; i < kTracks; ++i) {
    engine::Draws draws(5, engine::Stream::kFaults, i, 9);
    std::fill(image.pixels().begin(), image.pixels().end(), std::uint16_t{0});
    const hil::RayTrack track = hil::add_ray(draws, 20.0, 300.0, 65535, image);
    const int u = static_cast<int>(track.start % 1024);
    const int v = static_cast<int>(track.start / 1024);
    const int reach = std::min(std::min(u, 1023 - u), std::min(v, 1023 - v));
    if (reach < 250) continue;  // a chance of e^-12.5 to be longer
    ++inside;
    std::int64_t sum = 0;
    int touched = 0;
    for (const std::uint16_t dn : image.pixels()) {
      sum += dn;
      touched += dn > 0 ? 1 : 0;
    }
    ASSERT_EQ(sum, track.added_dn);
    ASSERT_EQ(touched, track.pixels);
    length_px += track.pixels;
    charge_dn += static_cast<double>(track.added_dn) / track.pixels;
    if (inside == 60) break;
  }
  ASSERT_EQ(inside, 60);
  // Steps go along the longer axis: a length l touches l E[max(|cos|, |sin|)] = .9003 l pixels, and
  // the one it starts in, less half of what is cut off: 20 * .9003 + .5 = 18.5. An exponential's
  // sigma is its mean: 5 sigma of 60 are 65 %.
  EXPECT_NEAR(length_px / 60, 18.5, 18.5 * 0.65);
  EXPECT_NEAR(charge_dn / 60, 300.0, 300.0 * 0.65);
}

TEST(Faults, FullScaleBleedsUpAndDownItsColumnAsFarAsTheRunIsLong) {
  Head head("[faults.blooming]\nbleed = 1.5");
  head.paint = [](std::uint64_t k, int u, int v) {
    if (k == 1) return static_cast<std::uint16_t>(100);
    const bool bright = (u == 3 && (v == 7 || v == 8)) || (u == 10 && v == 0) ||
                        (u == 12 && (v == 4 || v == 6)) || (u == 20 && v == 15);
    return static_cast<std::uint16_t>(bright ? kFullScale : 100);
  };
  head.send_all(2);
  const auto wet = [](int u, int v) {
    if (u == 3) return v >= 4 && v < 12;   // a run of two, three each way
    if (u == 10) return v < 3;             // one, at the edge: two down
    if (u == 12) return v >= 2 && v <= 8;  // two runs of one
    if (u == 20) return v >= 13;
    return false;
  };
  int changed = -6;  // were bright before
  for (int v = 0; v < kHeight; ++v)
    for (int u = 0; u < kWidth; ++u) {
      EXPECT_EQ(pixel(head.cable.got[0], u, v), wet(u, v) ? kFullScale : 100) << u << " " << v;
      changed += wet(u, v) ? 1 : 0;
    }
  ASSERT_EQ(head.records.size(), 1U) << "nothing at full scale, nothing happens";
  EXPECT_EQ(head.records[0].place, 6);
  EXPECT_EQ(head.records[0].count, changed);
  EXPECT_EQ(head.cable.got[1].address, &head.slot_of(1));
}

TEST(Faults, EachBitIsWrongAtTheRateAndTheRecordCountsThem) {
  constexpr std::uint64_t kFrames = 200;
  constexpr double kRate = 0.002;
  Head head("[faults.flipped]\nbit_error_rate = 0.002");
  head.send_all(kFrames);
  const auto records = head.by_frame();
  std::vector<double> per_bit(kBits);
  for (std::uint64_t k = 0; k < kFrames; ++k) {
    int wrong = 0;
    std::int64_t first = -1;
    for (int v = 0; v < kHeight; ++v)
      for (int u = 0; u < kWidth; ++u) {
        const unsigned differ =
            static_cast<unsigned>(pixel(head.cable.got[k], u, v)) ^ shown(k, u, v);
        EXPECT_LE(differ, static_cast<unsigned>(kFullScale));
        wrong += std::popcount(differ);
        if (differ != 0 && first < 0) first = v * kWidth + u;
        for (std::size_t bit = 0; bit < kBits; ++bit) per_bit[bit] += (differ >> bit) & 1U;
      }
    EXPECT_EQ(records.contains(k), wrong > 0);
    if (wrong == 0) continue;
    EXPECT_EQ(records.at(k).count, wrong);
    EXPECT_EQ(records.at(k).place, first);
  }
  const double tries = static_cast<double>(kFrames) * kWidth * kHeight;
  for (const double count : per_bit) EXPECT_NEAR(count, tries * kRate, five_sigma(tries, kRate));
}

TEST(Faults, BitsGoWrongInAFrozenPictureTooAndDoNotStay) {
  Head head(
      "[faults.frozen]\nfrom_frame = 1\n[faults.flipped]\nbit_error_rate = 0.01\nto_frame = 3");
  head.send_all(5);
  EXPECT_FALSE(is_clean(head.cable.got[1], 0));
  EXPECT_NE(head.cable.got[1].pixels, head.cable.got[2].pixels);
  EXPECT_TRUE(is_clean(head.cable.got[3], 0));
  EXPECT_TRUE(is_clean(head.cable.got[4], 0));
}

// ---- commands -----------------------------------------------------------------------------------

Command answer(std::uint64_t frame) {
  Command c;
  c.sequence = frame;
  c.answers_frame = frame;
  c.kind = hil::CommandKind::kTrim;
  c.trim_offset_rad = {1e-5 * static_cast<double>(frame + 1), 0.0};
  c.sender = 4;
  return c;
}

/// Hands over one command after the other, and then says that nothing came.
class Script final : public hil::CommandSource {
 public:
  Expected<Command> receive(Duration /*timeout*/) noexcept override {
    if (next >= commands.size()) return Error{engine::Fault::kTimeout, 0, "script"};
    return commands[next++];
  }
  std::vector<Command> commands;
  std::size_t next = 0;
};

class Desk {
 public:
  Desk(const std::string& toml, FaultyCommands::Pace pace, std::uint64_t seed = 1)
      : spec_(faults(toml, seed)),
        news_(std::make_unique<hil::FrameNewsRing>()),
        source_(std::make_unique<FaultyCommands>(spec_, script, *news_, pace)) {}

  /// Frame k went out, its answer comes, and what the loop gets by then is kept.
  void answer_frame(std::uint64_t k, bool withheld = false) {
    EXPECT_TRUE(news_->push(
        {{k, kPeriod * static_cast<std::int64_t>(k)}, withheld, hil::FrameNews::kNothing}));
    if (!withheld) script.commands.push_back(answer(k));
    // Two silent looks: a refused command is followed by what stands in for it.
    for (int silent = 0; silent < 2;) {
      const auto got = source_->receive(kPeriod);
      if (got.ok()) {
        out.push_back(got.value());
      } else if (got.error().fault == engine::Fault::kRejected) {
        ++rejected;
      } else {
        ++silent;
      }
    }
    for (FaultRecord r; source_->records().pop(r);) records.push_back(r);
  }
  void answer_all(std::uint64_t frames) {
    for (std::uint64_t k = 0; k < frames; ++k) answer_frame(k);
  }
  /// The frames answered, in order; stand-ins as minus their frame and one.
  [[nodiscard]] std::vector<int> answered() const {
    std::vector<int> all;
    for (const Command& c : out) {
      const int frame = static_cast<int>(c.answers_frame);
      all.push_back(c.sender == FaultyCommands::kStandIn ? -frame - 1 : frame);
    }
    return all;
  }
  void expect_adds_up() const {
    const hil::CommandFaultCounts& c = source_->counts();
    EXPECT_EQ(c.taken, c.delivered + c.lost + c.refused + c.held);
    EXPECT_EQ(out.size(), c.delivered + c.copies + c.stand_ins);
  }
  [[nodiscard]] const FaultyCommands& source() const { return *source_; }

  Script script;
  std::vector<Command> out;
  std::vector<FaultRecord> records;
  int rejected = 0;

 private:
  FaultSpec spec_;
  std::unique_ptr<hil::FrameNewsRing> news_;
  std::unique_ptr<FaultyCommands> source_;
};

using Pace = FaultyCommands::Pace;

TEST(CommandFaults, WithoutAnyEveryCommandComesThroughAsItIs) {
  Desk desk("", Pace::kLockstep);
  desk.answer_all(5);
  EXPECT_EQ(desk.answered(), (std::vector<int>{0, 1, 2, 3, 4}));
  EXPECT_EQ(desk.out[3].trim_offset_rad, answer(3).trim_offset_rad);
  EXPECT_EQ(desk.out[3].sender, 4U);
  EXPECT_TRUE(desk.records.empty());
  desk.expect_adds_up();
}

TEST(CommandFaults, LostOnesDoNotComeAndInLockstepAnEmptyReportDoesInstead) {
  const std::string toml = "[faults.command_lost]\nfrom_s = 0.2\nto_s = 0.4";
  Desk real(toml, Pace::kRealtime);
  real.answer_all(6);
  EXPECT_EQ(real.answered(), (std::vector<int>{0, 1, 4, 5}));
  ASSERT_EQ(real.records.size(), 2U);
  EXPECT_EQ(real.records[0].frame, 2U);
  EXPECT_EQ(real.records[0].command, 2U);
  real.expect_adds_up();
  Desk lockstep(toml, Pace::kLockstep);
  lockstep.answer_all(6);
  EXPECT_EQ(lockstep.answered(), (std::vector<int>{0, 1, -3, -4, 4, 5}));
  EXPECT_EQ(lockstep.out[2].kind, hil::CommandKind::kReport);
  EXPECT_EQ(lockstep.out[2].detection.confidence, 0.0F);
  EXPECT_EQ(lockstep.records.size(), 2U);
  lockstep.expect_adds_up();
}

TEST(CommandFaults, DelayedOnesComeJustBeforeTheOneTheyAreHeldBackTo) {
  const std::string toml = "[faults.command_delayed]\ncommands = 2\nfrom_frame = 1\nto_frame = 3";
  Desk real(toml, Pace::kRealtime);
  real.answer_all(6);
  EXPECT_EQ(real.answered(), (std::vector<int>{0, 1, 3, 2, 4, 5}));
  EXPECT_EQ(real.out[1].trim_offset_rad, answer(1).trim_offset_rad);
  real.expect_adds_up();
  Desk lockstep(toml, Pace::kLockstep);
  lockstep.answer_all(6);
  EXPECT_EQ(lockstep.answered(), (std::vector<int>{0, -2, -3, 1, 3, 2, 4, 5}));
  lockstep.expect_adds_up();
}

TEST(CommandFaults, AsManyAsCanBeDelayedAreHeldAndTheRestIsCounted) {
  Desk desk("[faults.command_delayed]\ncommands = 64", Pace::kRealtime);
  desk.answer_all(200);
  EXPECT_EQ(desk.out.size(), 200U - 64U);
  EXPECT_EQ(desk.source().counts().held, 64U);
  for (std::size_t i = 0; i < desk.out.size(); ++i) EXPECT_EQ(desk.out[i].answers_frame, i);
  desk.expect_adds_up();
}

TEST(CommandFaults, DuplicatedOnesComeTwice) {
  Desk desk("[faults.command_duplicated]\nfrom_frame = 1\nto_frame = 2", Pace::kLockstep);
  desk.answer_all(3);
  EXPECT_EQ(desk.answered(), (std::vector<int>{0, 1, 1, 2}));
  EXPECT_EQ(desk.records.size(), 1U);
  desk.expect_adds_up();
}

// A CRC of 32 bits sees every error of up to three bits in so short a packet.
TEST(CommandFaults, TheChecksumRefusesEveryCorruptedPacket) {
  for (const int bits : {1, 2, 3, 64}) {
    Desk desk("[faults.command_corrupted]\nprobability = 0.5\nbits = " + std::to_string(bits),
              Pace::kLockstep);
    desk.answer_all(400);
    EXPECT_EQ(static_cast<std::size_t>(desk.rejected), desk.records.size());
    EXPECT_NEAR(desk.rejected, 200.0, five_sigma(400, 0.5));
    EXPECT_EQ(desk.source().counts().stand_ins, desk.records.size());
    EXPECT_EQ(desk.out.size(), 400U) << "each frame has its answer, or what stands in for it";
    for (const Command& c : desk.out) {
      if (c.sender != FaultyCommands::kStandIn) {
        EXPECT_EQ(c.trim_offset_rad, answer(c.answers_frame).trim_offset_rad);
      }
    }
    desk.expect_adds_up();
  }
}

TEST(CommandFaults, AFrameThatNeverWentOutIsAnsweredByAStandInInLockstepOnly) {
  for (const Pace pace : {Pace::kLockstep, Pace::kRealtime}) {
    Desk desk("[faults.dropped]\nprobability = 0.1", pace);
    desk.answer_frame(0);
    desk.answer_frame(1, true);
    desk.answer_frame(2);
    EXPECT_EQ(desk.answered(),
              pace == Pace::kLockstep ? (std::vector<int>{0, -2, 2}) : (std::vector<int>{0, 2}));
    desk.expect_adds_up();
  }
}

// ---- the whole loop -----------------------------------------------------------------------------

/// Software under test on a thread of its own, that takes now longer and now less long.
class BusyDevice final : public hil::FrameSink, public hil::CommandSource {
 public:
  BusyDevice() : thread_([this](const std::stop_token& stop) { answer_frames(stop); }) {}

  Status send(const Frame& frame, Duration /*timeout*/) noexcept override {
    ENSURE(frames_.push(frame.sequence));
    count_.release();
    return engine::Done{};
  }
  Expected<Command> receive(Duration timeout) noexcept override {
    return answers_.receive(timeout);
  }
  /// Answers what has come, and no more after that.
  std::vector<std::uint64_t> finish() {
    thread_.request_stop();
    count_.release();
    thread_.join();
    return seen_;
  }

 private:
  void answer_frames(const std::stop_token& stop) {
    std::uint64_t state = reinterpret_cast<std::uintptr_t>(this);
    for (;;) {
      count_.acquire();
      std::uint64_t frame = 0;
      if (!frames_.pop(frame)) {
        if (stop.stop_requested()) return;
        continue;
      }
      seen_.push_back(frame);
      state = state * 6364136223846793005ULL + 1442695040888963407ULL + frame;
      for (std::uint64_t n = (state >> 33) % 100; n > 0; --n) std::this_thread::yield();
      answers_.give(answer(frame));
    }
  }

  hil::SpscRing<std::uint64_t, 256> frames_;  // sender -> device
  std::counting_semaphore<> count_{0};
  fakes::QueueSource answers_;
  std::vector<std::uint64_t> seen_;
  std::jthread thread_;
};

struct LoopRun {
  hil::LoopReport report;
  std::vector<std::uint64_t> seen;  ///< by the software under test, in order
  std::vector<double> looked;       ///< where the camera pointed, frame by frame
  std::vector<std::string> faults;  ///< frames', then commands', as JSON
};

LoopRun run_lockstep(const std::string& toml) {
  const FaultSpec spec = faults(toml, 1, 8);
  LoopRun run;
  hil::LoopSpec loop_spec;
  loop_spec.start = kStart;
  loop_spec.frames = 60;
  loop_spec.width_px = 8;
  loop_spec.height_px = 2;
  loop_spec.when_busy = hil::WhenBusy::kWait;
  // Only a loop that is wrong waits this long.
  loop_spec.answer_timeout = std::chrono::seconds(20);
  loop_spec.send_timeout = std::chrono::seconds(20);
  hil::ManualClock clock(kStart - loop_spec.period);
  fakes::IdealPointing pointing;
  fakes::PixelGenerator generator;
  BusyDevice device;
  const auto sink =
      std::make_unique<FaultySink>(spec, FaultySink::Shape{8, 2}, kStart, device, nullptr);
  const auto commands =
      std::make_unique<FaultyCommands>(spec, device, sink->news(), Pace::kLockstep);
  const auto loop =
      std::make_unique<hil::FrameLoop>(loop_spec, clock, pointing, generator, *sink, *commands);
  run.report = loop->run({});
  run.seen = device.finish();
  for (const engine::Shot& shot : generator.shots())
    run.looked.push_back(shot.attitude.middle.axes.matrix(0, 0));
  for (FaultRecord r; sink->records().pop(r);) run.faults.push_back(hil::fault_json(spec, r));
  for (FaultRecord r; commands->records().pop(r);) run.faults.push_back(hil::fault_json(spec, r));
  return run;
}

TEST(FaultyLoop, LockstepGoesOnWhateverIsLostAndIsTheSameEveryTime) {
  const std::string toml = R"([faults.away]
from_frame = 20
to_frame = 25
[faults.dropped]
probability = 0.1
[faults.late]
probability = 0.4
frames = 2
[faults.duplicated]
probability = 0.2
[faults.command_lost]
probability = 0.1
[faults.command_corrupted]
probability = 0.1
[faults.command_delayed]
probability = 0.1
commands = 3
[faults.command_duplicated]
probability = 0.1)";
  const LoopRun once = run_lockstep(toml);
  EXPECT_FALSE(once.report.answer_missing);
  EXPECT_EQ(once.report.due, 60U);
  EXPECT_EQ(once.report.faults, 5U) << "away";
  EXPECT_EQ(once.report.sent, 55U);
  EXPECT_EQ(once.looked.size(), 60U);
  EXPECT_GT(once.report.command_faults, 0U);
  EXPECT_GT(once.faults.size(), 20U);
  for (int i = 0; i < 3; ++i) {
    const LoopRun again = run_lockstep(toml);
    EXPECT_EQ(again.seen, once.seen);
    EXPECT_EQ(again.looked, once.looked);
    EXPECT_EQ(again.faults, once.faults);
  }
}

TEST(FaultyLoop, ALostCommandLeavesTheCameraWhereItWas) {
  const LoopRun run = run_lockstep("[faults.command_lost]\nfrom_frame = 10\nto_frame = 13");
  // Frame k + 1 is the first to show the answer to k.
  for (std::size_t k = 1; k < 60; ++k) {
    const std::size_t answered = k - 1 >= 10 && k - 1 < 13 ? 9 : k - 1;
    EXPECT_EQ(run.looked[k], answer(answered).trim_offset_rad[0]) << k;
  }
}

// ---- words --------------------------------------------------------------------------------------

TEST(FaultWords, ARecordReadsAsARowAndAsJson) {
  const FaultSpec spec = faults("[faults.belt]\nkind = \"rays\"\n[faults.command_lost]");
  FaultRecord ray;
  ray.frame = 12;
  ray.since_start = Duration(1'200'000'000);
  ray.fault = 0;
  ray.kind = FaultKind::kRays;
  ray.place = 77;
  ray.count = 5;
  ray.amount = 1234;
  FaultRecord lost;
  lost.frame = 13;
  lost.since_start = Duration(1'300'000'001);
  lost.command = 9;
  lost.fault = 1;
  lost.kind = FaultKind::kCommandLost;
  std::ostringstream csv;
  hil::write_faults_csv(csv, spec, std::vector{ray, lost});
  EXPECT_EQ(csv.str(),
            "frame,since_start_s,fault,kind,command,place,count,amount\n"
            "12,1.2,belt,rays,,77,5,1234\n"
            "13,1.300000001,command_lost,command_lost,9,0,0,0\n");
  EXPECT_EQ(hil::fault_json(spec, ray),
            R"({"frame":12,"since_start_s":1.2,"fault":"belt","kind":"rays",)"
            R"("place":77,"count":5,"amount":1234})");
  EXPECT_EQ(hil::fault_json(spec, lost),
            R"({"frame":13,"since_start_s":1.300000001,"fault":"command_lost",)"
            R"("kind":"command_lost","command":9,"place":0,"count":0,"amount":0})");
}

std::string complaint(const std::string& toml) {
  try {
    static_cast<void>(faults(toml));
  } catch (const ConfigError& e) {
    return e.what();
  }
  return "none";
}

TEST(FaultWords, AWrongScenarioIsToldWhereItIsWrong) {
  EXPECT_EQ(complaint("[faults.dropped]\nprobability = 1.5"),
            "faults.toml:2: faults.dropped.probability must be >= 0 and <= 1, got 1.5");
  EXPECT_EQ(complaint("[faults.dropped]\nfrom_s = 3\nto_s = 3"),
            "faults.toml:3: faults.dropped.to_s must be after from_s");
  EXPECT_EQ(complaint("[faults.late]\nframes = 0"),
            "faults.toml:2: faults.late.frames must be >= 1 and <= 32, got 0");
  EXPECT_EQ(complaint("[faults.hot_column]\ndn = 2048"),
            "faults.toml:2: faults.hot_column.dn must be >= 1 and <= 2047, got 2048");
  EXPECT_EQ(complaint("[faults.stuck_column]\ncolumn = 23\ncolumns = 2"),
            "faults.toml:2: faults.stuck_column.column must be >= 0 and <= 22, got 23");
  EXPECT_EQ(complaint("[faults.dropped]\nframes = 2"),
            "faults.toml:2: faults.dropped.frames is not a key of a scenario");
  EXPECT_EQ(complaint("[faults]\ndropped = 1"),
            "faults.toml:2: faults.dropped is not a key of a scenario");
  EXPECT_NE(complaint("[faults.storm]\nprobability = 1").find("must be one of \"away\", "),
            std::string::npos);
  EXPECT_NE(complaint("[faults.flipped]").find("faults.flipped.bit_error_rate is missing"),
            std::string::npos);
  EXPECT_NE(complaint("[faults.\"a,b\"]\nkind = \"dropped\"").find("letters"), std::string::npos);
}

}  // namespace
