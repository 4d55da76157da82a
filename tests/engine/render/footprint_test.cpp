#include "engine/render/footprint.h"

#include <gtest/gtest.h>

#include "engine/render/embree_scene.h"
#include "engine/scene/telescope.h"
#include "tests/support/scenes.h"

namespace engine {
namespace {

using Eigen::Vector3d;
using test_support::look_at_origin;
using test_support::small_camera;

constexpr int kBeyond_px = 16;

TEST(Footprint, MarksEveryPixelThatSeesTheTarget) {
  // Sixteen rays through each pixel of the frame and its border, whatever the footprint says.
  const Mesh mesh = telescope_mesh();
  const EmbreeScene scene(mesh);
  const CameraGeometry camera = small_camera(96);
  Footprint footprint(camera, kBeyond_px, mesh.vertices.size());
  const PixelRect all = camera.frame().grown_by(kBeyond_px);
  struct View {
    Vector3d from;
    Vector3d aim;
  };
  for (const View& view :
       {View{{60e3, 70e3, -40e3}, {0, 0, 0}}, View{{0, 0, -130e3}, {4.0, 2.0, 0}},
        View{{90e3, 1e3, 0}, {0, 9.0, -6.0}}}) {
    const Snapshot snapshot =
        test_support::view_from(view.from, view.aim - view.from, Vector3d(0.1, 0.2, 1.0));
    footprint.project(mesh, snapshot);
    const PixelRect region = footprint.region();
    ASSERT_FALSE(region.empty());
    RayCounts counts;
    int seen = 0;
    for (int v = all.top; v < all.bottom; ++v) {
      for (int u = all.left; u < all.right; ++u) {
        RayPacket rays;
        for (int lane = 0; lane < RayPacket::kLanes; ++lane) {
          const PixelPoint p{u - 0.5 + (lane % 4 + 0.5) / 4.0, v - 0.5 + (lane / 4 + 0.5) / 4.0};
          const Vector3d along =
              (snapshot.body_from_camera.matrix * camera.direction_at(p)).normalized();
          const Vector3d start = snapshot.camera.m + (snapshot.camera.m.norm() - 12.0) * along;
          rays.set(lane, start.cast<float>(), along.cast<float>());
        }
        std::array<MeshHit, RayPacket::kLanes> hits;
        scene.intersect(rays, hits, counts);
        const bool hit = std::any_of(hits.begin(), hits.end(),
                                     [](const MeshHit& h) { return h.triangle != MeshHit::kNone; });
        if (!hit) continue;
        ++seen;
        const bool inside =
            u >= region.left && u < region.right && v >= region.top && v < region.bottom;
        ASSERT_TRUE(inside && footprint.marked(u, v)) << u << " " << v;
      }
    }
    EXPECT_GT(seen, 100);
    EXPECT_EQ(counts.rejected, 0U);
  }
}

TEST(Footprint, IsEmptyWhenTheTargetIsOutOfSight) {
  const Mesh mesh = test_support::sphere(2.0F, 8, 12, "white");
  Footprint footprint(small_camera(64), kBeyond_px, mesh.vertices.size());
  // Beside the field, behind the camera.
  footprint.project(mesh, test_support::view_from({0, 0, 1e5}, {0.01, 0, -1}, {0, 1, 0}));
  EXPECT_TRUE(footprint.region().empty());
  footprint.project(mesh, test_support::view_from({0, 0, 1e5}, {0, 0, 1}, {0, 1, 0}));
  EXPECT_TRUE(footprint.region().empty());
  footprint.project(mesh, look_at_origin({0, 0, 1e5}, {0, 1, 0}));
  EXPECT_FALSE(footprint.region().empty());
}

TEST(Footprint, ForgetsTheFrameBefore) {
  const Mesh mesh = test_support::sphere(2.0F, 8, 12, "white");
  Footprint footprint(small_camera(64), kBeyond_px, mesh.vertices.size());
  const auto marks = [&](Footprint& f) {
    int count = 0;
    const PixelRect r = f.region();
    for (int v = r.top; v < r.bottom; ++v)
      for (int u = r.left; u < r.right; ++u) count += f.marked(u, v) ? 1 : 0;
    return count;
  };
  footprint.project(mesh, look_at_origin({0, 0, 3e5}, {0, 1, 0}));
  const int fresh = marks(footprint);
  footprint.project(mesh, look_at_origin({0, 0, 5e4}, {0, 1, 0}));
  EXPECT_GT(marks(footprint), 3 * fresh);
  footprint.project(mesh, look_at_origin({0, 0, 3e5}, {0, 1, 0}));
  EXPECT_EQ(marks(footprint), fresh);
}

TEST(Footprint, HoldsATriangleThatIsPartlyBehindTheCamera) {
  // A plate through the camera's own plane: the part ahead must be marked.
  Mesh mesh;
  test_support::add_plate(mesh, "white", {-50, 1e-4F, -50}, {100, 0, 0}, {0, 0, 100});
  const CameraGeometry camera = small_camera(64);
  Footprint footprint(camera, kBeyond_px, mesh.vertices.size());
  const Snapshot snapshot = look_at_origin({0, 0, 10}, {0, 1, 0});
  footprint.project(mesh, snapshot);
  const EmbreeScene scene(mesh);
  RayCounts counts;
  int seen = 0;
  for (int v = 0; v < 64; ++v) {
    for (int u = 0; u < 64; ++u) {
      const Vector3d along = (snapshot.body_from_camera.matrix *
                              camera.direction_at({static_cast<double>(u), static_cast<double>(v)}))
                                 .normalized();
      if (scene.intersect(snapshot.camera.m.cast<float>(), along.cast<float>(), counts).triangle ==
          MeshHit::kNone)
        continue;
      ++seen;
      const PixelRect r = footprint.region();
      ASSERT_TRUE(u >= r.left && u < r.right && v >= r.top && v < r.bottom &&
                  footprint.marked(u, v))
          << u << " " << v;
    }
  }
  EXPECT_GT(seen, 0);
}

/// A plate of so many pixels' side that faces a camera of 64 x 64 pixels, its middle at a place.
double visible_fraction_of_plate(double side_px, PixelPoint middle) {
  const CameraGeometry camera = small_camera(64);
  constexpr double kRange_m = 1e5;
  const double m_per_px = kRange_m * camera.ifov_rad();
  // Seen from +z with y up, u grows with x and v against y.
  const Vector3d corner((middle.u - 32.0 - 0.5 * side_px) * m_per_px,
                        -(middle.v - 32.0 + 0.5 * side_px) * m_per_px, 0.0);
  const auto side_m = static_cast<float>(side_px * m_per_px);
  Mesh mesh;
  test_support::add_plate(mesh, "white", corner.cast<float>(), {side_m, 0, 0}, {0, side_m, 0});
  Footprint footprint(camera, kBeyond_px, mesh.vertices.size());
  footprint.project(mesh, look_at_origin({0, 0, kRange_m}, {0, 1, 0}));
  return footprint.visible_fraction();
}

TEST(Footprint, TellsWhichShareOfThePlateLiesInTheFrame) {
  // The frame reaches from -0.5 to 63.5. Floats carry corners to 1e-6 px here.
  EXPECT_EQ(visible_fraction_of_plate(20, {32, 32}), 1.0);
  EXPECT_NEAR(visible_fraction_of_plate(20, {-0.5, 32}), 0.5, 1e-5);
  EXPECT_NEAR(visible_fraction_of_plate(20, {32, 63.5}), 0.5, 1e-5);
  EXPECT_NEAR(visible_fraction_of_plate(20, {63.5, -0.5}), 0.25, 1e-5);
  EXPECT_NEAR(visible_fraction_of_plate(20, {-7.5, 68.5}), 0.15 * 0.25, 1e-5);
  // Cut by all four edges, and no corner inside.
  EXPECT_NEAR(visible_fraction_of_plate(200, {32, 32}), 0.32 * 0.32, 1e-5);
  EXPECT_EQ(visible_fraction_of_plate(20, {80, 32}), 0.0);
  EXPECT_EQ(visible_fraction_of_plate(20, {-300, -300}), 0.0);
}

TEST(Footprint, SeesNothingOfWhatIsBehindTheCamera) {
  const Mesh mesh = test_support::sphere(2.0F, 8, 12, "white");
  Footprint footprint(small_camera(64), kBeyond_px, mesh.vertices.size());
  footprint.project(mesh, test_support::view_from({0, 0, 1e5}, {0, 0, 1}, {0, 1, 0}));
  EXPECT_EQ(footprint.visible_fraction(), 0.0);
}

}  // namespace
}  // namespace engine
