#include "engine/orbit/sun_track.h"

#include <random>

#include <gtest/gtest.h>

#include "tests/support/scenes.h"

namespace engine {
namespace {

TEST(SunTrack, IsTheSunToAThirdOfAMetre) {
  const Epoch start = test_support::epoch_2022();
  for (const SunModel model : {SunModel::kErfa, SunModel::kTable1}) {
    SunTrack track(model);
    for (int i = 0; i < 5000; ++i) {
      const Epoch t = start + i * from_seconds(6311.7);  // a year
      // The header's .15 m holds for the mean motions; the Moon's orbit is an ellipse.
      EXPECT_LT((track.at(t).m - sun_position(model, t).m).norm(), 0.3) << i;
    }
  }
}

TEST(SunTrack, AnswersByTheTimeAloneInAnyOrder) {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> s(-4e8, 4e8);  // before 2000, too
  SunTrack one(SunModel::kErfa);
  for (int i = 0; i < 300; ++i) {
    const Epoch t(from_seconds(s(random)));
    SunTrack fresh(SunModel::kErfa);
    const Eigen::Vector3d there = one.at(t).m;
    EXPECT_EQ(there, fresh.at(t).m);
    EXPECT_LT((there - sun_position(SunModel::kErfa, t).m).norm(), 0.3);
    static_cast<void>(
        one.at(t + std::chrono::hours(3)));  // the next three hours, by one place more
    fresh = SunTrack(SunModel::kErfa);
    EXPECT_EQ(one.at(t + std::chrono::hours(4)).m, fresh.at(t + std::chrono::hours(4)).m);
  }
}

}  // namespace
}  // namespace engine
