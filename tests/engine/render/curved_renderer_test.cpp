#include "engine/render/curved_renderer.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

#include <gtest/gtest.h>

#include "engine/render/render_spec.h"
#include "engine/render/traced_target.h"
#include "tests/support/scenes.h"

namespace engine {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr GridWish kWish{3, 16};

/// A wide lens that bends its image inwards, by 20 px in the corners.
CameraGeometry wide_camera() {
  CameraGeometry camera;
  camera.focal_length_m = 0.02;
  camera.pixel_pitch_m = 40e-6;
  camera.width_px = 320;
  camera.height_px = 240;
  camera.distortion = {.k1 = -0.21, .k2 = 0.13, .k3 = -0.04, .p1 = 0.0012, .p2 = -0.0007};
  return camera;
}

/// What there is in a direction.
double pattern(const Vector3d& direction) {
  const Vector2d at = direction.head<2>() / direction.z();
  return 0.5 + 0.25 * std::cos(60.0 * at.x()) + 0.25 * std::sin(50.0 * at.y());
}

/// Fills the frame and what is beside it with the pattern, as a lens would show it whose distortion
/// is affine.
class Pattern final : public Renderer {
 public:
  explicit Pattern(const CameraGeometry& camera) : camera_(camera) {}
  RenderReport render(const Snapshot& snapshot, Budget /*budget*/,
                      Radiance& out) noexcept override {
    out.region = camera_.frame().grown_by(kWish.beyond_frame_px);
    out.oversampling = kWish.oversampling;
    fill(out.region, snapshot.image_map, out.grid, out.cover);
    out.companions_in_sight = snapshot.companions > 0;
    out.targets_region = {100, 40, 310, 230};
    if (out.companions_in_sight)
      fill(out.targets_region, snapshot.image_map, out.targets_grid, out.targets_cover);
    return {};
  }

 private:
  void fill(const PixelRect& region, const AffineMap& map, RadianceImage& grid,
            CoverImage& cover) const {
    const int s = kWish.oversampling;
    const LocalCamera local(camera_, map);
    grid.resize(region.width() * s, region.height() * s);
    cover.resize(grid.width(), grid.height());
    for (int y = 0; y < grid.height(); ++y) {
      for (int x = 0; x < grid.width(); ++x) {
        const PixelPoint p{region.left + (x + 0.5) / s - 0.5, region.top + (y + 0.5) / s - 0.5};
        grid.at(x, y) = static_cast<float>(pattern(local.direction_at(p)));
        cover.at(x, y) = 1.0F;
      }
    }
  }
  CameraGeometry camera_;
};

struct Bent {
  explicit Bent(const CameraGeometry& camera)
      : renderer(camera, kWish, std::make_unique<Pattern>(camera), pool) {}
  const Radiance& render(const Snapshot& snapshot) {
    report = renderer.render(snapshot, {}, image);
    return image;
  }
  WorkerPool pool{2};
  CurvedRenderer renderer;
  RenderReport report;
  Radiance image;
};

/// Of a target in that direction.
Snapshot seen_towards(const CameraGeometry& camera, const Vector3d& direction,
                      PixelPoint motion_px = {}) {
  Snapshot snapshot;
  snapshot.image_map = camera.map_near(direction, motion_px, 0.01).value();
  snapshot.target_px = snapshot.image_map.apply(camera.project_straight(direction).value());
  return snapshot;
}

/// The largest difference from what stands in direction_of(p), where light could come from.
template <class DirectionOf>
double worst(const Radiance& image, const PixelRect& within, const DirectionOf& direction_of) {
  double most = 0;
  const int s = image.oversampling;
  for (int v = within.top; v < within.bottom; ++v) {
    for (int u = within.left; u < within.right; ++u) {
      const int x = (u - image.region.left) * s + 1;  // the cell on the pixel's centre
      const int y = (v - image.region.top) * s + 1;
      const double want = pattern(direction_of(PixelPoint{1.0 * u, 1.0 * v}));
      most = std::max(most, std::abs(static_cast<double>(image.grid.at(x, y)) - want));
    }
  }
  return most;
}

// A place is known to a 512th of a cell, and between nodes to h^2/8 times the second derivative of
// what bends, which is about 1e-3 per px here: .008 px. The pattern changes by .04 a pixel.
constexpr double kGood = 5e-4;

TEST(CurvedRenderer, AFieldIsBentAsTheLensBendsIt) {
  const CameraGeometry camera = wide_camera();
  const Snapshot snapshot = seen_towards(camera, {0.06, -0.03, 1.0});
  Bent bent(camera);
  const Radiance& image = bent.render(snapshot);
  const auto exact = [&](PixelPoint p) { return camera.direction_at(p); };
  EXPECT_EQ(image.region.clipped_to(camera.frame()).width(), camera.width_px);
  EXPECT_LT(worst(image, camera.frame(), exact), kGood);
  EXPECT_EQ(bent.report.rungs[0].ladder, "distortion");
  EXPECT_EQ(bent.report.rungs[0].taken, "curved");
  // Affine about the target it would be wrong by a fifth of all there is.
  Radiance affine;
  Pattern(camera).render(snapshot, {}, affine);
  EXPECT_GT(worst(affine, camera.frame(), exact), 0.15);
}

TEST(CurvedRenderer, ARollingShutterStretchesTheBentImage) {
  CameraGeometry camera = wide_camera();
  camera.row_time_s = 2e-5;
  const PixelPoint motion_px{20.0, -15.0};
  const Snapshot snapshot = seen_towards(camera, {-0.05, 0.08, 1.0}, motion_px);
  Bent bent(camera);
  const Radiance& image = bent.render(snapshot);
  // Row v sees the image as it is so much later than the principal point's row.
  const auto exact = [&](PixelPoint p) {
    const double later = (p.v - camera.principal_point().v) * camera.row_time_s / 0.01;
    return camera.direction_at({p.u - later * motion_px.u, p.v - later * motion_px.v});
  };
  EXPECT_LT(worst(image, camera.frame(), exact), kGood);
}

TEST(CurvedRenderer, WhatIsTheTargetsOwnBendsWithTheRest) {
  const CameraGeometry camera = wide_camera();
  Snapshot snapshot = seen_towards(camera, {0.1, 0.05, 1.0});
  snapshot.companions = 1;
  Bent bent(camera);
  const Radiance& image = bent.render(snapshot);
  const int s = image.oversampling;
  for (int v = 80; v < 160; ++v) {
    for (int u = 150; u < 260; ++u) {
      const int x = s * (u - image.targets_region.left);
      const int y = s * (v - image.targets_region.top);
      ASSERT_NEAR(image.targets_grid.at(x, y),
                  image.grid.at(s * (u - image.region.left), s * (v - image.region.top)), kGood)
          << u << " " << v;
      ASSERT_FLOAT_EQ(image.targets_cover.at(x, y), 1.0F);
    }
  }
}

TEST(CurvedRenderer, ABendThatNobodySeesLeavesEveryBit) {
  CameraGeometry camera = wide_camera();
  // Without a term of even powers nothing but the cube of the field bends: .02 px in the corner.
  camera.distortion = {.k1 = -1e-3};
  const Snapshot snapshot = seen_towards(camera, {0.0, 0.0, 1.0});
  Bent bent(camera);
  Radiance affine;
  Pattern(camera).render(snapshot, {}, affine);
  const Radiance& image = bent.render(snapshot);
  EXPECT_EQ(bent.report.rungs[0].taken, "affine");
  EXPECT_EQ(image.grid.width(), affine.grid.width());
  EXPECT_TRUE(std::ranges::equal(image.grid.pixels(), affine.grid.pixels()));
}

TEST(CurvedRenderer, BeyondTheReachOfTheTermsIsNothing) {
  CameraGeometry camera = wide_camera();
  camera.distortion.reach_tan = 0.3;
  Bent bent(camera);
  const Radiance& image = bent.render(seen_towards(camera, {0.0, 0.0, 1.0}));
  const int s = image.oversampling;
  for (const PixelPoint p : {PixelPoint{2, 2}, PixelPoint{317, 3}, PixelPoint{160, 120}}) {
    const bool seen = (camera.direction_at(p).head<2>().norm() < 0.3);
    const float cell = image.grid.at(s * (static_cast<int>(p.u) - image.region.left),
                                     s * (static_cast<int>(p.v) - image.region.top));
    EXPECT_EQ(seen, cell != 0.0F) << p.u << " " << p.v;
    EXPECT_TRUE(std::isfinite(cell));
  }
}

/// A plate that fills the field, drawn as scenarios draw it: its sides bow as the lens says.
TEST(CurvedRenderer, TheSidesOfAPlateBow) {
  RenderSpec spec;
  spec.camera = wide_camera();
  spec.grid = kWish;
  spec.method = RenderMethod::kLattice;
  spec.bounces = 0;
  Mesh mesh;
  test_support::add_plate(mesh, "white", {-8, -6, 0}, {16, 0, 0}, {0, 12, 0});
  auto plate = std::make_shared<TracedTarget>(
      mesh, std::vector{test_support::lambert_material("white", 0.3)});
  WorkerPool pool(2);
  const auto renderer = make_renderer(spec, std::move(plate), pool);
  Snapshot snapshot = test_support::look_at_origin({0, 0, 28}, {0, 1, 0});
  snapshot.sun = {Direction<BodyFrame>{Vector3d::UnitZ()}, 600.0};
  const Snapshot seen = seen_towards(spec.camera, {0.0, 0.0, 1.0});
  snapshot.image_map = seen.image_map;
  snapshot.target_px = seen.target_px;
  Radiance image;
  (void)renderer->render(snapshot, {}, image);
  const int s = image.oversampling;
  const auto covered = [&](PixelPoint p) {
    return image.cover.at(static_cast<int>(std::lround((p.u - image.region.left) * s)) + 1,
                          static_cast<int>(std::lround((p.v - image.region.top) * s)) + 1);
  };
  for (int i = 1; i < 20; ++i) {
    for (const double side : {-1.0, 1.0}) {
      const double along = -1.0 + i / 10.0;
      // A pixel is .056 m at that range.
      const auto at = [&](double x_m, double y_m) {
        return spec.camera.project({x_m, y_m, 28.0}).value();
      };
      EXPECT_GT(covered(at(side * 7.93, 6.0 * along * 0.98)), 0.99F) << side << " " << along;
      EXPECT_LT(covered(at(side * 8.07, 6.0 * along * 0.98)), 0.01F) << side << " " << along;
      EXPECT_GT(covered(at(8.0 * along * 0.98, side * 5.93)), 0.99F) << side << " " << along;
      EXPECT_LT(covered(at(8.0 * along * 0.98, side * 6.07)), 0.01F) << side << " " << along;
    }
  }
}

}  // namespace
}  // namespace engine
