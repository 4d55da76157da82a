#include "engine/scene/sdf/delaunay.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "engine/core/constants.h"
#include "engine/core/random.h"
#include "engine/scene/sdf/mesh_figures.h"

namespace engine {
namespace {

using Eigen::Vector3d;

std::vector<Vector3d> scattered(std::uint32_t count) {
  std::vector<Vector3d> points;
  for (std::uint32_t i = 0; i < count; ++i) {
    Draws draws(3, Stream::kLight, 0, i);
    const double x = draws.uniform_double();
    points.emplace_back(x, draws.uniform_double(), 0.0);
  }
  return points;
}

/// Of a square lattice turned by `angle_rad`: rows, and four on every circle.
std::vector<Vector3d> lattice(int side, double angle_rad) {
  std::vector<Vector3d> points;
  const double c = std::cos(angle_rad);
  const double s = std::sin(angle_rad);
  for (int i = 0; i < side; ++i)
    for (int k = 0; k < side; ++k) points.emplace_back(c * i - s * k, s * i + c * k, 0.0);
  return points;
}

TEST(Delaunay, LeavesNoPointInsideATrianglesCircle) {
  const std::vector<Vector3d> points = scattered(400);
  const std::vector<Corners> triangles = delaunay(points);
  for (const Corners& t : triangles) {
    // The circle's middle, from the two equations of equal distance.
    const Vector3d b = points[t[1]] - points[t[0]];
    const Vector3d c = points[t[2]] - points[t[0]];
    const double d = 2.0 * (b.x() * c.y() - b.y() * c.x());
    ASSERT_GT(d, 0.0) << "runs clockwise";
    const Vector3d middle(c.y() * b.squaredNorm() - b.y() * c.squaredNorm(),
                          b.x() * c.squaredNorm() - c.x() * b.squaredNorm(), 0.0);
    const Vector3d centre = points[t[0]] + middle / d;
    const double radius = (middle / d).norm();
    for (const Vector3d& p : points)
      // Places are rounded to 6e-8 of the box, and a flat triangle's circle magnifies that.
      ASSERT_GT((p - centre).norm(), radius * (1.0 - 1e-4) - 1e-4);
  }
}

TEST(Delaunay, CoversTheHullOnceWhateverTheRowsAndCircles) {
  // By Euler, n points of which b are on the hull have 2 n - 2 - b triangles.
  for (const double angle_deg : {0.0, 30.0, 45.0}) {
    const std::vector<Vector3d> points = lattice(20, angle_deg * kDegree);
    const std::vector<Corners> triangles = delaunay(points);
    const MeshFigures figures = figures_of(points, triangles, {});
    // Turned, a hull's row may bend by rounding: flat triangles there are no one's loss.
    EXPECT_NEAR(figures.area_m2, 361.0, 1e-4) << angle_deg;
    EXPECT_EQ(figures.tangled, 0U);
    EXPECT_EQ(figures.euler, 1);
    if (angle_deg == 0.0) {
      EXPECT_EQ(triangles.size(), 2U * 400U - 2U - 76U);
    }
  }
}

TEST(Delaunay, LivesWithPointsThatAreNone) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(delaunay({}).empty());
  EXPECT_TRUE(delaunay({{0, 0, 0}, {1, 0, 0}}).empty());
  EXPECT_TRUE(delaunay({{0, 0, 0}, {0, 0, 0}, {0, 0, 0}}).empty());
  EXPECT_TRUE(delaunay({{0, 0, 0}, {1, 1, 0}, {2, 2, 0}, {3, 3, 0}}).empty()) << "a row";
  const auto triangles =
      delaunay({{0, 0, 0}, {kNan, 0, 0}, {1, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}});
  EXPECT_EQ(triangles.size(), 2U);
  for (const Corners& t : triangles)
    for (const std::uint32_t c : t) EXPECT_NE(c, 1U);
}

}  // namespace
}  // namespace engine
