#include "hil/command_gate.h"

#include <cmath>
#include <limits>
#include <map>
#include <random>
#include <set>
#include <vector>

#include <gtest/gtest.h>

namespace {

using engine::Duration;
using engine::SimTime;
using hil::Command;
using hil::CommandGate;
using hil::Refusal;

constexpr Duration kSecond = std::chrono::seconds(1);
const SimTime kNow = engine::sim_time(300'000.0);

Command command(std::uint64_t sequence, std::uint32_t sender = 1) {
  Command c;
  c.kind = hil::CommandKind::kTrim;
  c.sequence = sequence;
  c.sender = sender;
  c.made_at = kNow;
  c.reference = kNow;
  return c;
}

TEST(CommandGate, TenThousandCommandsInOrderAllPass) {
  CommandGate gate;
  for (std::uint64_t i = 0; i < 10'000; ++i)
    ASSERT_EQ(gate.admit(command(i * i), kNow), std::nullopt) << i;
  EXPECT_EQ(gate.admitted(), 10'000U);
  EXPECT_EQ(gate.refused().total(), 0U);
}

TEST(CommandGate, OneCommandPassesOnce) {
  CommandGate gate;
  for (const std::uint64_t sequence : {5U, 6U, 9U})
    static_cast<void>(gate.admit(command(sequence), kNow));
  for (const std::uint64_t sequence : {9U, 6U, 5U, 9U})
    EXPECT_EQ(gate.admit(command(sequence), kNow), Refusal::kDuplicate) << sequence;
  EXPECT_EQ(gate.refused()[Refusal::kDuplicate], 4U);
  EXPECT_EQ(gate.admitted(), 3U);
}

TEST(CommandGate, ACommandOvertakenByALaterOneIsRefused) {
  CommandGate gate;
  EXPECT_EQ(gate.admit(command(100), kNow), std::nullopt);
  EXPECT_EQ(gate.admit(command(300), kNow), std::nullopt);
  for (const std::uint64_t sequence : {299U, 237U, 236U, 101U, 0U})
    EXPECT_EQ(gate.admit(command(sequence), kNow), Refusal::kReordered) << sequence;
  EXPECT_EQ(gate.refused()[Refusal::kReordered], 5U);
}

TEST(CommandGate, SequencesDoNotWrap) {
  CommandGate gate;
  constexpr std::uint64_t kLast = std::numeric_limits<std::uint64_t>::max();
  EXPECT_EQ(gate.admit(command(kLast), kNow), std::nullopt);
  EXPECT_EQ(gate.admit(command(kLast), kNow), Refusal::kDuplicate);
  EXPECT_EQ(gate.admit(command(0), kNow), Refusal::kReordered);
}

TEST(CommandGate, EachSenderCountsForItself) {
  CommandGate gate;
  EXPECT_EQ(gate.admit(command(7, 1), kNow), std::nullopt);
  EXPECT_EQ(gate.admit(command(3, 2), kNow), std::nullopt);
  EXPECT_EQ(gate.admit(command(3, 1), kNow), Refusal::kReordered);
  EXPECT_EQ(gate.admit(command(7, 2), kNow), std::nullopt);
}

TEST(CommandGate, ALifeEndsANanosecondAfterItsLastOne) {
  CommandGate gate;
  Command c = command(1);
  c.time_to_live = kSecond;
  EXPECT_EQ(gate.admit(c, kNow + kSecond + Duration(1)), Refusal::kStale);
  EXPECT_EQ(gate.admit(c, kNow + kSecond), std::nullopt);
  c = command(2);  // without a limit
  EXPECT_EQ(gate.admit(c, kNow + 100'000 * kSecond), std::nullopt);
}

TEST(CommandGate, AStampFromTheFutureIsRefused) {
  CommandGate gate(kSecond);
  EXPECT_EQ(gate.admit(command(1), kNow - kSecond - Duration(1)), Refusal::kFuture);
  EXPECT_EQ(gate.admit(command(1), kNow - kSecond), std::nullopt);
}

TEST(CommandGate, NumbersThatAreNoneAreRefusedWhereverTheyStand) {
  const auto nan = std::numeric_limits<double>::quiet_NaN();
  const auto inf = std::numeric_limits<float>::infinity();
  std::vector<Command> bad(9, command(1));
  bad[0].trim_offset_rad[1] = nan;
  bad[1].trim_rate_rad_s[0] = -static_cast<double>(inf);
  bad[2].attitude.j2000_to_camera[3] = nan;
  bad[3].attitude.rate_rad_s[2] = nan;
  bad[4].detection.centroid_px.u = nan;
  bad[5].detection.centroid_px.v = nan;
  bad[6].detection.confidence = inf;
  bad[7].detection.box_px[0] = -inf;
  bad[8].detection.box_px[3] = inf;
  CommandGate gate;
  for (const Command& c : bad) EXPECT_EQ(gate.admit(c, kNow), Refusal::kNotFinite);
  EXPECT_EQ(gate.refused()[Refusal::kNotFinite], bad.size());
  EXPECT_EQ(gate.admit(command(1), kNow), std::nullopt);
}

// Undefined behaviour that a sanitizer reports; here it is the answers that count.
TEST(CommandGate, TheFarthestTimesThereAreDoNotOverflow) {
  CommandGate gate;
  for (const SimTime now : {SimTime::min(), SimTime{}, SimTime::max()}) {
    for (const SimTime stamp : {SimTime::min(), SimTime::max()}) {
      for (const Duration life : {Duration::min(), Duration(1), Duration::max()}) {
        Command c = command(1);
        c.made_at = stamp;
        c.time_to_live = life;
        c.reference = stamp;
        EXPECT_NE(gate.admit(c, now), std::nullopt);
      }
    }
  }
  Command c = command(1);
  for (const SimTime reference : {SimTime::min(), SimTime::max()}) {
    c.reference = reference;
    EXPECT_EQ(gate.admit(c, kNow), Refusal::kReference);
  }
  EXPECT_EQ(gate.admitted(), 0U);
}

TEST(CommandGate, ARefusedCommandChangesNothing) {
  CommandGate gate;
  EXPECT_EQ(gate.admit(command(1), kNow), std::nullopt);
  Command stale = command(10);
  stale.time_to_live = Duration(1);
  EXPECT_EQ(gate.admit(stale, kNow + kSecond), Refusal::kStale);
  Command poison = command(11);
  poison.trim_offset_rad[0] = std::nan("");
  EXPECT_EQ(gate.admit(poison, kNow), Refusal::kNotFinite);
  EXPECT_EQ(gate.admit(command(2), kNow), std::nullopt);
  EXPECT_EQ(gate.admit(command(10), kNow), std::nullopt);
  // Strangers that are refused push nobody out either.
  for (std::uint32_t sender = 100; sender < 200; ++sender) {
    stale.sender = sender;
    EXPECT_EQ(gate.admit(stale, kNow + kSecond), Refusal::kStale);
  }
  EXPECT_EQ(gate.admit(command(10), kNow), Refusal::kDuplicate);
}

TEST(CommandGate, TheSenderHeardLeastRecentlyMakesRoom) {
  CommandGate gate;
  for (std::uint32_t sender = 0; sender < 32; ++sender)
    EXPECT_EQ(gate.admit(command(5, sender), kNow), std::nullopt);
  EXPECT_EQ(gate.admit(command(6, 0), kNow), std::nullopt);  // now 1 was heard least recently
  EXPECT_EQ(gate.admit(command(1, 32), kNow), std::nullopt);
  for (const std::uint32_t sender : {0U, 2U, 31U, 32U})
    EXPECT_NE(gate.admit(command(1, sender), kNow), std::nullopt) << sender;
  EXPECT_EQ(gate.admit(command(1, 1), kNow), std::nullopt);
}

// A quarter of the packets overtaken, a quarter sent twice: against a gate that remembers all.
TEST(CommandGate, OfAShuffledBurstPassesWhatASlowerGateLetsPass) {
  std::mt19937_64 random(3);
  std::vector<Command> burst;
  for (std::uint64_t i = 0; i < 10'000; ++i) {
    burst.push_back(command(i / 3, static_cast<std::uint32_t>(i % 3)));
    if (random() % 4 == 0) burst.push_back(burst.back());
  }
  for (std::size_t i = 0; i + 20 < burst.size(); ++i)
    if (random() % 4 == 0) std::swap(burst[i], burst[i + random() % 20]);
  CommandGate gate;
  std::map<std::uint32_t, std::set<std::uint64_t>> obeyed;
  std::uint64_t duplicates = 0;
  std::uint64_t reordered = 0;
  for (const Command& c : burst) {
    const auto answer = gate.admit(c, kNow);
    std::set<std::uint64_t>& mine = obeyed[c.sender];
    if (mine.empty() || c.sequence > *mine.rbegin()) {
      ASSERT_EQ(answer, std::nullopt);
      mine.insert(c.sequence);
    } else if (mine.contains(c.sequence)) {
      ASSERT_EQ(answer, Refusal::kDuplicate);
      ++duplicates;
    } else {
      ASSERT_EQ(answer, Refusal::kReordered);
      ++reordered;
    }
  }
  EXPECT_GT(duplicates, 1000U);
  EXPECT_GT(reordered, 1000U);
  EXPECT_EQ(gate.refused()[Refusal::kDuplicate], duplicates);
  EXPECT_EQ(gate.refused()[Refusal::kReordered], reordered);
  EXPECT_EQ(gate.admitted() + gate.refused().total(), burst.size());
}

}  // namespace
