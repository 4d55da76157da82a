#include "engine/core/worker_pool.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

namespace engine {
namespace {

TEST(WorkerPool, DoesEveryRowOnceInEveryRound) {
  for (const int threads : {1, 2, 3, 8}) {
    WorkerPool pool(threads);
    EXPECT_EQ(pool.threads(), threads);
    // Plain integers: what a row wrote must be seen when `rows` returns.
    std::vector<int> done(40, 0);
    constexpr int kRounds = 3000;
    for (int round = 1; round <= kRounds; ++round) {
      pool.rows(0, 40, [&](int row) { ++done[static_cast<std::size_t>(row)]; });
      ASSERT_TRUE(std::ranges::all_of(done, [round](int n) { return n == round; }))
          << threads << " threads, round " << round;
    }
  }
}

TEST(WorkerPool, WaitsForTheOtherThreadsRows) {
  WorkerPool pool(2);
  const auto caller = std::this_thread::get_id();
  for (int round = 1; round <= 20; ++round) {
    std::atomic<bool> other_began{false};
    double others = 0;  // not atomic: `rows` itself must make it seen
    int others_rows = 0;
    pool.rows(0, 2, [&](int) {
      if (std::this_thread::get_id() == caller) {
        // Leave the second row to the other thread, and finish long before it does.
        for (int i = 0; i < 1'000'000 && !other_began; ++i) std::this_thread::yield();
        return;
      }
      other_began = true;
      double sum = 1.0;
      for (int i = 0; i < 300'000; ++i) sum = std::sqrt(sum + 1.0);
      others = sum;
      ++others_rows;
    });
    ASSERT_TRUE(other_began) << round;
    ASSERT_GT(others, 1.0) << round;
    ASSERT_GE(others_rows, 1) << round;
  }
}

TEST(WorkerPool, BeginsAndEndsWhereItIsTold) {
  WorkerPool pool(3);
  for (const auto& [begin, end] : {std::pair(-7, 5), {3, 4}, {10, 10}, {10, 3}, {1000, 1100}}) {
    std::vector<std::atomic<int>> seen(1200);
    std::atomic<int> count{0};
    pool.rows(begin, end, [&, low = begin](int row) {
      ++seen[static_cast<std::size_t>(row - low)];
      ++count;
    });
    EXPECT_EQ(count.load(), std::max(0, end - begin));
    for (int row = begin; row < end; ++row)
      EXPECT_EQ(seen[static_cast<std::size_t>(row - begin)].load(), 1);
  }
}

TEST(WorkerPool, ComesAndGoesWithoutWork) {
  for (int i = 0; i < 200; ++i) {
    WorkerPool pool(3);
    if (i % 2 == 0) pool.rows(0, 3, [](int) {});
  }
  SUCCEED();
}

TEST(WorkerPoolDeathTest, NeedsAThread) {
  testing::FLAGS_gtest_death_test_style = "threadsafe";
  EXPECT_DEATH(WorkerPool pool(0), "ENSURE");
}

}  // namespace
}  // namespace engine
