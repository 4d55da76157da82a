#include <algorithm>
#include <map>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "hil/faults/faulty_sink.h"
#include "tests/support/faulty_line.h"

namespace {

using namespace faulty_line;
using engine::Error;
using engine::SimTime;
using engine::Status;
using hil::FaultKind;
using hil::Frame;

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

}  // namespace
