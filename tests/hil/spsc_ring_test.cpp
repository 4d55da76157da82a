#include "hil/spsc_ring.h"

#include <cstdint>
#include <thread>

#include <gtest/gtest.h>

namespace {

using hil::SpscRing;

TEST(SpscRing, GivesBackWhatItTookInTheSameOrder) {
  SpscRing<int, 8> ring;
  for (int i = 0; i < 8; ++i) ASSERT_TRUE(ring.push(i));
  for (int i = 0; i < 8; ++i) {
    int got = -1;
    ASSERT_TRUE(ring.pop(got));
    EXPECT_EQ(got, i);
  }
}

TEST(SpscRing, EmptyRingGivesNothingAndLeavesTheValueAlone) {
  SpscRing<int, 2> ring;
  int got = 42;
  EXPECT_FALSE(ring.pop(got));
  ASSERT_TRUE(ring.push(1));
  ASSERT_TRUE(ring.pop(got));
  got = 42;
  EXPECT_FALSE(ring.pop(got));
  EXPECT_EQ(got, 42);
}

TEST(SpscRing, FullRingTakesNothingAndKeepsWhatItHas) {
  SpscRing<int, 3> ring;
  for (int i = 0; i < 3; ++i) ASSERT_TRUE(ring.push(i));
  EXPECT_FALSE(ring.push(99));
  for (int i = 0; i < 3; ++i) {
    int got = -1;
    ASSERT_TRUE(ring.pop(got));
    EXPECT_EQ(got, i);
  }
  int got = -1;
  EXPECT_FALSE(ring.pop(got));
}

TEST(SpscRing, KeepsItsOrderAroundTheEndAtEveryFillLevel) {
  // Capacity 5 is no power of two: head and tail go around the array at 5, not at 8.
  SpscRing<int, 5> ring;
  for (int fill = 0; fill < 5; ++fill) {
    int pushed = 0;
    int popped = 0;
    while (pushed < fill) ASSERT_TRUE(ring.push(pushed++));
    for (int turn = 0; turn < 23; ++turn) {
      ASSERT_TRUE(ring.push(pushed++));
      int got = -1;
      ASSERT_TRUE(ring.pop(got));
      ASSERT_EQ(got, popped++);
    }
    for (int got = -1; ring.pop(got);) ASSERT_EQ(got, popped++);
    EXPECT_EQ(popped, pushed);
  }
}

// An item wide enough to be torn, if a slot were read before it is written.
struct Wide {
  std::uint64_t first = 0;
  std::uint64_t middle[6] = {};
  std::uint64_t last = 0;
};

TEST(SpscRing, TwoThreadsPassAMillionItemsInOrderAndWhole) {
  constexpr std::uint64_t kItems = 1'000'000;
  SpscRing<Wide, 64> ring;
  std::jthread producer([&ring] {
    for (std::uint64_t i = 0; i < kItems;) {
      if (ring.push({i, {}, ~i})) {
        ++i;
      } else {
        std::this_thread::yield();
      }
    }
  });
  std::uint64_t wrong = 0;
  for (std::uint64_t i = 0; i < kItems;) {
    Wide item;
    if (!ring.pop(item)) {
      std::this_thread::yield();
      continue;
    }
    if (item.first != i || item.last != ~i) ++wrong;
    ++i;
  }
  producer.join();
  EXPECT_EQ(wrong, 0U);
  Wide item;
  EXPECT_FALSE(ring.pop(item));
}

}  // namespace
