#include "engine/scene/sdf/features.h"

#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "engine/core/constants.h"

namespace engine {
namespace {

using Eigen::Vector3d;

Eigen::Isometry3d moved(double x, double y, double z) {
  return Eigen::Isometry3d(Eigen::Translation3d(x, y, z));
}

double length_m(const FeatureGraph& graph) {
  double sum = 0;
  for (const FeatureGraph::Crease& crease : graph.creases) {
    for (std::size_t i = 1; i < crease.path_m.size(); ++i)
      sum += (crease.path_m[i] - crease.path_m[i - 1]).norm();
    if (crease.closed) sum += (crease.path_m.front() - crease.path_m.back()).norm();
  }
  return sum;
}

TEST(Features, OfACubeAreEightCornersAndTwelveEdges) {
  const FeatureGraph graph = features_of(Solid::box({2, 2, 2}), 0.3);
  EXPECT_EQ(graph.missing, "");
  ASSERT_EQ(graph.corners_m.size(), 8U);
  for (const Vector3d& p : graph.corners_m)
    EXPECT_NEAR((p.cwiseAbs() - Vector3d::Ones()).norm(), 0.0, 1e-15);
  EXPECT_EQ(graph.creases.size(), 12U);
  EXPECT_NEAR(length_m(graph), 24.0, 1e-12);
}

TEST(Features, OfAThinPlateAreAllTwelveEdgesToo) {
  const FeatureGraph graph = features_of(Solid::box({2, 2, 0.02}), 0.2);
  EXPECT_EQ(graph.missing, "");
  EXPECT_EQ(graph.corners_m.size(), 8U);
  EXPECT_EQ(graph.creases.size(), 12U);
}

TEST(Features, WhereACylinderLeavesABoxAreOneCircle) {
  const Solid both = Solid::box({2, 2, 2}).united(Solid::cylinder(0.5, 2).moved(moved(1, 0, 0)));
  const FeatureGraph graph = features_of(both, 0.1);
  EXPECT_EQ(graph.missing, "");
  EXPECT_EQ(graph.corners_m.size(), 8U);
  EXPECT_EQ(graph.creases.size(), 14U);  // the cube's, and the cylinder's two circles
  // Chords of an eighth of the mesh's edge: s^2 / 24 R^2 short, and the last of 251 is a longer
  // one.
  EXPECT_NEAR(length_m(graph), 24.0 + 2.0 * kPi, 1.02 * 2.0 * kPi * 0.0125 * 0.0125 / 6.0);
}

TEST(Features, WhereTwoCylindersCrossLieOnBoth) {
  const Solid a = Solid::cylinder(0.5, 3);
  const Solid b =
      Solid::cylinder(0.4, 3).moved(Eigen::Isometry3d(Eigen::AngleAxisd(1.1, Vector3d::UnitZ())));
  const Solid both = a.united(b);
  const FeatureGraph graph = features_of(both, 0.1);
  EXPECT_EQ(graph.missing, "");
  EXPECT_EQ(graph.creases.size(), 6U);  // four rims, and where the thinner one goes in and out
  EXPECT_TRUE(graph.corners_m.empty());
  for (const FeatureGraph::Crease& crease : graph.creases) {
    EXPECT_TRUE(crease.closed);
    for (const Vector3d& p : crease.path_m)
      for (const std::size_t face : crease.faces)
        EXPECT_NEAR(both.face_distance_m(face, p), 0.0, 1e-12);
  }
}

TEST(Features, OfBoxesThatStandFlushHaveNoSeam) {
  const Solid both = Solid::box({2, 2, 2}).united(Solid::box({2, 2, 2}).moved(moved(2, 0, 0)));
  const FeatureGraph graph = features_of(both, 0.3);
  EXPECT_EQ(graph.missing, "");
  EXPECT_EQ(graph.corners_m.size(), 8U);
  EXPECT_NEAR(length_m(graph), 8.0 * 2.0 + 4.0 * 4.0, 1e-12);
}

TEST(Features, SayWhenTwoFacesOnlyTouch) {
  // A cylinder that lies in a box's face along a line.
  const Solid both = Solid::box({2, 2, 2}).united(Solid::cylinder(0.5, 3).moved(moved(0, 0.5, 0)));
  EXPECT_NE(features_of(both, 0.1).missing, "");
}

TEST(Features, AreDividedAsTheSizeWantsAndEndAtTheirCorners) {
  const FeatureGraph graph = features_of(Solid::box({2, 2, 2}), 0.3);
  const SizeFunction size = [](const Vector3d&) { return 0.3; };
  for (const FeatureGraph::Crease& crease : graph.creases) {
    const std::vector<Vector3d> places = divided(graph, crease, nullptr, size);
    EXPECT_EQ(places.size(), 8U);  // 2 / .3 is nearest to 7
    EXPECT_EQ(places.front(), graph.corners_m[crease.corner[0]]);
    EXPECT_EQ(places.back(), graph.corners_m[crease.corner[1]]);
    for (std::size_t i = 1; i < places.size(); ++i)
      EXPECT_NEAR((places[i] - places[i - 1]).norm(), 2.0 / 7.0, 1e-9);
  }
}

}  // namespace
}  // namespace engine
