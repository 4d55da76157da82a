#include "tools/starloop/soak_verdict.h"

#include <functional>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace {

using engine::Duration;
using starloop::judge_soak;
using starloop::SoakCheck;
using starloop::SoakRound;

constexpr std::uint64_t kMiB = 1024 * 1024;

SoakRound good_round(bool slow_reader = false) {
  SoakRound r;
  r.slow_reader = slow_reader;
  r.loop.due = 1000;
  r.loop.skipped = 3;
  r.loop.dropped = 2;
  r.loop.faults = slow_reader ? 895 : 0;
  r.loop.sent = r.loop.due - r.loop.skipped - r.loop.dropped - r.loop.faults;
  r.late_s.assign(995, 50e-6);
  for (int i = 0; i < 10'000; ++i) r.machine.add(Duration(60'000));
  r.audited = true;
  r.read = r.loop.sent;
  r.logged = 995;
  r.heap_bytes = 6 * kMiB;
  r.resident_bytes = 100 * kMiB;
  r.descriptors = 6;
  r.threads = 2;
  return r;
}

std::vector<SoakRound> good_rounds() {
  return {good_round(), good_round(), good_round(), good_round(true), good_round(), good_round()};
}

std::vector<std::string> not_good(const std::vector<SoakRound>& rounds, double hours = 0.1) {
  std::vector<std::string> names;
  for (const SoakCheck& c : judge_soak(rounds, hours))
    if (!c.good) names.push_back(c.name);
  return names;
}

TEST(SoakVerdict, GoodRoundsAreGood) {
  EXPECT_EQ(not_good(good_rounds()), std::vector<std::string>{});
  // Both cadences are among what was judged.
  EXPECT_EQ(judge_soak(good_rounds(), 0.1).size(), 14U);
}

TEST(SoakVerdict, NothingFlownIsNotGood) {
  EXPECT_EQ(not_good({}), std::vector<std::string>{"rounds"});
}

TEST(SoakVerdict, EachDefectIsSeenByItsOwnCheck) {
  const struct {
    const char* check;
    std::function<void(SoakRound&)> plant;
  } defects[] = {
      {"accounted for", [](SoakRound& r) { ++r.loop.due, ++r.logged; }},
      {"accounted for", [](SoakRound& r) { --r.loop.due, --r.logged; }},
      {"read whole", [](SoakRound& r) { --r.read; }},
      {"read whole", [](SoakRound& r) { ++r.read; }},
      {"read whole", [](SoakRound& r) { r.torn = 1; }},
      {"read whole", [](SoakRound& r) { r.out_of_order = 1; }},
      {"logs", [](SoakRound& r) { --r.logged; }},
      {"logs", [](SoakRound& r) { r.log_fault = "torn"; }},
      {"records", [](SoakRound& r) { r.records_lost = 1; }},
      {"commands", [](SoakRound& r) { r.loop.command_faults = 1; }},
      {"commands", [](SoakRound& r) { r.loop.commands_lost = 1; }},
      {"commands", [](SoakRound& r) { r.loop.refused.by_cause[0] = 1; }},
      {"cadence", [](SoakRound& r) { r.late_s.assign(995, 1.1e-3); }},
      {"causes",
       [](SoakRound& r) {
         r.loop.late_by_cause[static_cast<std::size_t>(hil::LateCause::kUnknown)] = 1;
       }},
      {"numbers", [](SoakRound& r) { r.not_finite = 1; }},
      {"descriptors", [](SoakRound& r) { ++r.descriptors; }},
      {"threads", [](SoakRound& r) { ++r.threads; }},
  };
  for (const auto& defect : defects) {
    std::vector<SoakRound> rounds = good_rounds();
    defect.plant(rounds[4]);
    EXPECT_EQ(not_good(rounds), std::vector<std::string>{defect.check});
  }
}

TEST(SoakVerdict, ACadenceBesideASlowReaderIsJudgedForItself) {
  std::vector<SoakRound> rounds = good_rounds();
  rounds[3].late_s.assign(995, 2e-3);
  EXPECT_EQ(not_good(rounds), std::vector<std::string>{"cadence beside a slow reader"});
}

TEST(SoakVerdict, AMachineThatStallsIsNotTheLoopsDoing) {
  std::vector<SoakRound> rounds = good_rounds();
  for (SoakRound& r : rounds) {
    r.late_s.assign(995, 5e-3);
    for (int i = 0; i < 100; ++i) r.machine.add(Duration(2'000'000));
  }
  EXPECT_EQ(not_good(rounds), std::vector<std::string>{});  // 5 ms are under three times 2 ms
}

TEST(SoakVerdict, InLockstepThereIsNoCadence) {
  std::vector<SoakRound> rounds = good_rounds();
  for (SoakRound& r : rounds) {
    r.in_realtime = false;
    r.late_s.assign(995, 1.0);
  }
  EXPECT_EQ(not_good(rounds), std::vector<std::string>{});
}

TEST(SoakVerdict, WhatGrowsRoundByRoundIsSeenAndWhatOnlyFluctuatesIsNot) {
  std::vector<SoakRound> leaks = good_rounds();
  std::vector<SoakRound> fluctuates = good_rounds();
  for (std::size_t i = 0; i < leaks.size(); ++i) {
    leaks[i].heap_bytes += i * kMiB / 4;
    fluctuates[i].heap_bytes += (i % 2) * kMiB;
  }
  EXPECT_EQ(not_good(leaks), std::vector<std::string>{"heap"});
  EXPECT_EQ(not_good(fluctuates), std::vector<std::string>{});
  std::vector<SoakRound> swells = good_rounds();
  for (std::size_t i = 0; i < swells.size(); ++i) swells[i].resident_bytes += i * 10 * kMiB;
  EXPECT_EQ(not_good(swells), std::vector<std::string>{"resident memory"});
  // A library's cache of a megabyte in an hour is no leak.
  leaks = good_rounds();
  leaks[4].heap_bytes += kMiB;
  leaks[5].heap_bytes += kMiB;
  EXPECT_EQ(not_good(leaks, 1.0), std::vector<std::string>{});
  EXPECT_EQ(not_good(leaks, 0.1), std::vector<std::string>{"heap"});
}

TEST(SoakVerdict, JsonHasEveryRoundAndEveryCheck) {
  const auto rounds = good_rounds();
  const auto checks = judge_soak(rounds, 0.1);
  const auto json = starloop::soak_json(rounds, checks, 0.1);
  EXPECT_EQ(json["rounds"].size(), rounds.size());
  EXPECT_EQ(json["checks"].size(), checks.size());
  EXPECT_EQ(json["rounds"][3]["slow_reader"], true);
  EXPECT_EQ(json["rounds"][0]["sent"], 995);
}

}  // namespace
