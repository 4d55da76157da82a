#include "engine/scene/sdf/solid.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "engine/core/constants.h"
#include "engine/core/random.h"
#include "engine/scene/sdf/polygon_distance.h"

namespace engine {
namespace {

using Eigen::Vector3d;

Vector3d place(std::uint32_t i, double reach) {
  Draws draws(5, Stream::kLight, 0, i);
  Vector3d p;
  for (int k = 0; k < 3; ++k) p[k] = reach * (2.0 * draws.uniform_double() - 1.0);
  return p;
}

/// The distance to many places on the surface, which one finds by following the slope: an exact
/// distance is right about how far it is, and no step along its slope is in vain.
void expect_distance(const Solid& solid, const char* name) {
  const DistanceFunction f = [&](const Vector3d& p) { return solid.distance_m(p); };
  for (std::uint32_t i = 0; i < 400; ++i) {
    const Vector3d p = place(i, 2.0);
    const double d = f(p);
    const Vector3d g = slope(f, p, 1e-6);
    if (std::abs(g.norm() - 1.0) > 1e-6) continue;  // on the ridge between two nearest places
    EXPECT_NEAR(f(p - d * g), 0.0, 1e-8) << name << " " << p.transpose();
    // Nobody is nearer: places on a ball of that radius are on the same side.
    for (std::uint32_t k = 0; k < 20; ++k) {
      const Vector3d q = p + 0.999 * std::abs(d) * place(1000 + k, 1.0).normalized();
      EXPECT_EQ(f(q) < 0.0, d < 0.0) << name;
    }
  }
}

TEST(Solid, KnowsExactlyHowFarItsSurfaceIs) {
  expect_distance(Solid::box({1.0, 2.0, 0.5}), "box");
  expect_distance(Solid::sphere(0.8), "sphere");
  expect_distance(Solid::torus(1.0, 0.3), "torus");
  expect_distance(Solid::cylinder(0.5, 1.5), "cylinder");
  expect_distance(Solid::cone(0.9, 0.2, 1.2), "frustum");
  expect_distance(Solid::cone(0.0, 0.7, 1.2), "cone");
  const Eigen::Isometry3d pose =
      Eigen::Translation3d(0.3, -0.2, 0.1) * Eigen::AngleAxisd(0.7, Vector3d(1, 2, 3).normalized());
  expect_distance(Solid::box({1.0, 2.0, 0.5}).moved(pose), "box, moved");
}

TEST(Solid, IsInsideWhereItsPartsSay) {
  const Solid a = Solid::box({2, 2, 2});
  const Solid b = Solid::sphere(1.2);
  for (std::uint32_t i = 0; i < 1000; ++i) {
    const Vector3d p = place(i, 1.5);
    EXPECT_EQ(a.united(b).holds(p), a.holds(p) || b.holds(p));
    EXPECT_EQ(a.shared(b).holds(p), a.holds(p) && b.holds(p));
    EXPECT_EQ(a.cut_by(b).holds(p), a.holds(p) && !b.holds(p));
  }
}

TEST(Solid, HasFacesThatLookOutwards) {
  // Of a box with a ball cut out of it, the ball's face looks to its middle.
  const Solid solid = Solid::box({2, 2, 2}).cut_by(Solid::sphere(0.5));
  const Vector3d p(0.3, 0.1, 0.0);
  EXPECT_NEAR(solid.face_normal(6, p).dot(p.normalized()), -1.0, 1e-12);
  EXPECT_NEAR(solid.face_distance_m(6, p), 0.5 - p.norm(), 1e-12);
  for (std::size_t face = 0; face < solid.faces(); ++face) {
    const DistanceFunction f = [&](const Vector3d& q) { return solid.face_distance_m(face, q); };
    EXPECT_NEAR((slope(f, p, 1e-5) - solid.face_normal(face, p)).norm(), 0.0, 1e-8) << face;
  }
}

TEST(PolygonDistance, IsExactAndKnowsHoles) {
  const DistanceFunction f =
      polygon_distance({{{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}},
                        {{-0.5, -0.5, 0}, {-0.5, 0.5, 0}, {0.5, 0.5, 0}, {0.5, -0.5, 0}}});
  EXPECT_DOUBLE_EQ(f({2, 2, 0}), std::sqrt(2.0));
  EXPECT_DOUBLE_EQ(f({0.75, 0, 0}), -0.25);
  EXPECT_DOUBLE_EQ(f({0, 0.1, 0}), 0.4);
  EXPECT_DOUBLE_EQ(f({-3, 1, 0}), 2.0);  // beside a corner, at its height
}

}  // namespace
}  // namespace engine
