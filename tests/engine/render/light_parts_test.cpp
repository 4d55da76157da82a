#include "engine/render/light_parts.h"

#include <cmath>
#include <vector>

#include <gtest/gtest.h>

namespace engine {
namespace {

struct Moments {
  double light = 0, x = 0, y = 0, xx = 0, xy = 0, yy = 0;
};

template <class Spots>
Moments moments_of(const Spots& spots, std::size_t count) {
  Moments m;
  for (std::size_t i = 0; i < count; ++i) {
    m.light += spots[i].light;
    m.x += spots[i].light * spots[i].x;
    m.y += spots[i].light * spots[i].y;
    m.xx += spots[i].light * spots[i].x * spots[i].x;
    m.xy += spots[i].light * spots[i].x * spots[i].y;
    m.yy += spots[i].light * spots[i].y * spots[i].y;
  }
  return m;
}

/// Bright at one end, bent, and with a hole.
std::vector<LightSpot> odd_picture() {
  std::vector<LightSpot> spots;
  for (int i = -20; i <= 20; ++i)
    for (int j = -8; j <= 8; ++j)
      if (i * i + j * j > 30)
        spots.push_back({0.1 * i, 0.1 * j + 0.01 * i * i, 1.0 + 0.04 * i + 0.2 * (j > 2 ? 1 : 0)});
  return spots;
}

TEST(LightParts, PointsOfEveryLevelHaveThePicturesMomentsUpToTheSecond) {
  const std::vector<LightSpot> spots = odd_picture();
  const Moments want = moments_of(spots, spots.size());
  LightParts parts;
  std::vector<LightSpot> reordered = spots;
  parts.cut(reordered);
  std::size_t most = 4;
  for (int level = 0; level < LightParts::kLevels; ++level, most *= 4) {
    LightParts::Points points;
    const std::size_t count = parts.points(level, points);
    ASSERT_EQ(count, most);
    const Moments got = moments_of(points, count);
    // Hundreds of terms of order 1 in double precision.
    const double tolerance = 1e-12 * want.light;
    EXPECT_NEAR(got.light, want.light, tolerance) << level;
    EXPECT_NEAR(got.x, want.x, tolerance) << level;
    EXPECT_NEAR(got.y, want.y, tolerance) << level;
    EXPECT_NEAR(got.xx, want.xx, tolerance) << level;
    EXPECT_NEAR(got.xy, want.xy, tolerance) << level;
    EXPECT_NEAR(got.yy, want.yy, tolerance) << level;
  }
}

TEST(LightParts, MismatchFallsWithTheSizeOfTheParts) {
  std::vector<LightSpot> spots;  // an even triangle
  for (int i = 0; i <= 80; ++i)
    for (int j = -i / 2; j <= i / 2; ++j) spots.push_back({0.1 * i, 0.1 * j, 1.0});
  LightParts parts;
  parts.cut(spots);
  // Parts are about half as large on each level, which is an eighth and a sixteenth; a third and a
  // fifth are enough for the points to be worth their number.
  for (int level = 1; level < LightParts::kLevels; ++level) {
    EXPECT_LT(parts.mismatch(level).third, parts.mismatch(level - 1).third / 3.0) << level;
    EXPECT_LT(parts.mismatch(level).fourth, parts.mismatch(level - 1).fourth / 5.0) << level;
  }
}

TEST(LightParts, MismatchOfTwoSpotsIsTheirs) {
  // Two equal spots 2 apart: fourth moment 1; a pair on the axis at sqrt(2) and two points in the
  // middle: 2. No third.
  std::vector<LightSpot> spots{{1, 0, 3}, {-1, 0, 3}};
  LightParts parts;
  parts.cut(spots);
  EXPECT_NEAR(parts.mismatch(0).third, 0.0, 1e-12);
  EXPECT_NEAR(parts.mismatch(0).fourth, 1.0, 1e-12);
  EXPECT_NEAR(parts.mismatch(1).fourth, 0.0, 1e-12);
  EXPECT_NEAR(parts.variance(), 1.0, 1e-12);
}

TEST(LightParts, DarknessHasNoPoints) {
  LightParts parts;
  std::vector<LightSpot> spots{{1, 2, 0.0}, {3, 4, -1e-9}};
  LightParts::Points points;
  for (int level = 0; level < LightParts::kLevels; ++level) {
    parts.cut(spots);
    EXPECT_EQ(parts.points(level, points), 0U);
    parts.cut({});
    EXPECT_EQ(parts.points(level, points), 0U);
  }
  EXPECT_EQ(parts.light(), 0.0);
}

}  // namespace
}  // namespace engine
