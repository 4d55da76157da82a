#include "engine/scene/star_field.h"

#include <cmath>
#include <set>

#include <gtest/gtest.h>

#include "engine/core/constants.h"
#include "engine/core/random.h"
#include "engine/orbit/utc.h"
#include "engine/scene/snapshot_builder.h"
#include "tests/support/scenes.h"

namespace engine {
namespace {

using Eigen::Vector3d;

constexpr double kArcsecond = kDegree / 3600.0;

Vector3d any_direction(Draws& draws) {
  const double z = 2.0 * draws.uniform_double() - 1.0;
  const double ra = 2.0 * kPi * draws.uniform_double();
  const double across = std::sqrt(1.0 - z * z);
  return {across * std::cos(ra), across * std::sin(ra), z};
}

CatalogueStar star_at(const Vector3d& unit, float v = 5.0F) {
  CatalogueStar star;
  star.unit = unit;
  star.v_magnitude = v;
  star.colour_b_v = 0.6F;
  return star;
}

/// A square camera whose field has this half width.
CameraGeometry camera_of(double half_rad, int side_px = 1000) {
  CameraGeometry camera;
  camera.width_px = side_px;
  camera.height_px = side_px;
  camera.pixel_pitch_m = 5e-6;
  camera.focal_length_m = 0.5 * side_px * camera.pixel_pitch_m / std::tan(half_rad);
  return camera;
}

SkyView looking_at(const Vector3d& unit) {
  SkyView sky;
  const CameraAttitude attitude = look_along({unit});
  sky.attitude = {attitude, attitude, attitude};
  sky.camera.m = 7e6 * unit;  // the Earth is behind the camera
  return sky;
}

/// All stars with an image, whatever their light.
constexpr StarLimits kAll{0.0, 0.4, 0.0, 1.0, 8.0};

struct Found {
  StarsFound counts;
  std::vector<PointSource> points;
};
Found find(const std::vector<CatalogueStar>& stars, const CameraGeometry& camera,
           const SkyView& sky, const StarLimits& limits = kAll, std::size_t capacity = 100000) {
  StarCatalogue catalogue;
  catalogue.stars = stars;
  const StarField field(catalogue, camera, StarLight(600e-9));
  Found found;
  found.points.reserve(capacity);
  found.counts = field.find(sky, limits, found.points);
  return found;
}
int sum_of(const StarsFound& f) { return f.drawn + f.faint + f.behind_earth + f.no_room; }

TEST(StarZones, EachCellHoldsWhatItsIndexSays) {
  const StarZones zones;
  Draws draws(3, Stream::kShot, 0, 0);
  for (int i = 0; i < 5000; ++i) {
    const Vector3d unit = any_direction(draws);
    const StarZones::Cell cell = zones.cell(zones.index_of(unit));
    const double ra = std::fmod(std::atan2(unit.y(), unit.x()) + 2.0 * kPi, 2.0 * kPi);
    EXPECT_GE(ra, cell.ra_rad - 1e-12);
    EXPECT_LE(ra, cell.ra_rad + cell.width_rad + 1e-12);
    EXPECT_GE(std::asin(unit.z()), cell.dec_rad - 1e-12);
    EXPECT_LE(std::asin(unit.z()), cell.dec_rad + cell.height_rad + 1e-12);
  }
  for (const Vector3d& pole : {Vector3d(0, 0, 1), Vector3d(0, 0, -1), Vector3d(1, 0, 0),
                               Vector3d(1, -1e-17, 0), Vector3d(-1, 0, 0)})
    EXPECT_LT(zones.index_of(pole), zones.cells());
}

TEST(StarZones, ACircleLosesNothingAndVisitsNothingTwice) {
  const StarZones zones;
  Draws draws(4, Stream::kShot, 0, 0);
  std::vector<Vector3d> centres{{0, 0, 1}, {0, 0, -1}, {1, 0, 0}, {1, 1e-9, 0}, {1, -1e-9, 0}};
  for (int i = 0; i < 200; ++i) centres.push_back(any_direction(draws));
  for (const Vector3d& any : centres) {
    const Vector3d centre = any.normalized();
    for (const double radius : {1e-6, 0.001, 0.02, 0.3, 1.0, 1.6, 3.0, kPi}) {
      std::vector<int> visits(zones.cells());
      zones.near(centre, radius, [&](std::size_t begin, std::size_t end) {
        ASSERT_LE(end, visits.size());
        for (std::size_t c = begin; c < end; ++c) ++visits[c];
      });
      for (int i = 0; i < 20; ++i) {
        // A direction within the circle, its rim too.
        const Vector3d aside = centre.cross(any_direction(draws)).normalized();
        const double angle = radius * (i == 0 ? 1.0 : draws.uniform_double());
        const Vector3d near = std::cos(angle) * centre + std::sin(angle) * aside;
        EXPECT_EQ(visits[zones.index_of(near.normalized())], 1) << radius;
      }
      EXPECT_LE(*std::max_element(visits.begin(), visits.end()), 1);
    }
  }
}

TEST(StarField, FindsJustTheStarsThatTheCameraSees) {
  Draws draws(5, Stream::kShot, 0, 0);
  std::vector<CatalogueStar> stars{star_at({0, 0, 1}), star_at({0, 0, -1}), star_at({1, 0, 0})};
  for (int i = 0; i < 20000; ++i) stars.push_back(star_at(any_direction(draws)));
  const CameraGeometry camera = camera_of(0.1);
  std::vector<Vector3d> pointings{{0, 0, 1}, {0, 0, -1}, {1, 0, 0}, {1, -1e-12, 0}};
  for (int i = 0; i < 30; ++i) pointings.push_back(any_direction(draws));
  for (const Vector3d& boresight : pointings) {
    const SkyView sky = looking_at(boresight.normalized());
    const Found found = find(stars, camera, sky);
    int expected = 0;
    for (const CatalogueStar& star : stars) {
      const auto p = camera.project(sky.attitude.middle.axes.matrix * star.unit);
      const auto inside = [](double x) { return x > -1.5 && x < 1000.5; };  // reach: 1 px
      if (p && inside(p->u) && inside(p->v)) ++expected;
    }
    EXPECT_EQ(found.counts.drawn, expected);
    EXPECT_EQ(found.counts.near, sum_of(found.counts));
    EXPECT_GT(expected, 20);  // .04 sr of 4 pi, of 20 000: 64
  }
}

TEST(StarField, AnEmptyFieldIsEmpty) {
  const Found none = find({}, camera_of(0.1), looking_at({0, 0, 1}));
  EXPECT_EQ(none.counts.near, 0);
  const Found elsewhere = find({star_at({0, 0, -1})}, camera_of(0.1), looking_at({0, 0, 1}));
  EXPECT_EQ(elsewhere.counts.near, 0);
  EXPECT_TRUE(elsewhere.points.empty());
}

TEST(StarField, TheCamerasSpeedTiltsTheLight) {
  const CameraGeometry camera = camera_of(0.01);
  SkyView sky = looking_at({0, 0, 1});
  const PixelPoint still = find({star_at({0, 0, 1})}, camera, sky).points.at(0).place;
  // The constant of aberration, 20.49552" (IAU 1976), is the Earth's 29.7889 km/s over c.
  // 7.6 km/s in low orbit: 5.23".
  for (const auto& [speed_m_s, arcsec] : {std::pair{29788.9, 20.4955}, std::pair{7600.0, 5.229}}) {
    sky.velocity.m_s = sky.attitude.middle.axes.matrix.row(0).transpose() * speed_m_s;
    const PixelPoint moved = find({star_at({0, 0, 1})}, camera, sky).points.at(0).place;
    EXPECT_NEAR((moved.u - still.u) * camera.ifov_rad() / kArcsecond, arcsec, 1e-3);
    EXPECT_NEAR(moved.v, still.v, 1e-9);
  }
}

TEST(StarField, TheSnapshotKnowsTheWholeSpeedUnlessLightGoesStraight) {
  const test_support::Flyby flyby;
  SceneSpec spec;
  spec.epoch = flyby.epoch;
  Shot shot;
  shot.shutter_open = sim_time(1000.0);
  const Snapshot s = SnapshotBuilder(spec, flyby.camera, flyby.target).build(shot);
  const OrbitState camera = flyby.camera.at(flyby.at(1000.0));
  EXPECT_LT((s.sky.camera.m - camera.position.m).norm(), 1e-6);
  // On 1 January the Earth is near its perihelion: 30.29 km/s, of which the Sun's own takes 20 m/s.
  EXPECT_NEAR((s.sky.velocity.m_s - camera.velocity.m_s).norm(), 30290.0, 25.0);
  spec.light_path = LightPath::kGeometric;
  EXPECT_EQ(SnapshotBuilder(spec, flyby.camera, flyby.target).build(shot).sky.velocity.m_s.norm(),
            0.0);
}

TEST(StarField, TheEarthHidesWhatIsBehindItsDisc) {
  const CameraGeometry camera = camera_of(0.5);
  SkyView sky = looking_at({0, 0, 1});
  // Half the Earth's angle from there: 64.6 degrees about +x, and the field reaches 28.6 about +z.
  sky.camera.m = Vector3d(-7.06e6, 0.0, 0.0);
  const double limb = 0.5 * kPi - std::asin(kEarthRadius_m / 7.06e6);  // from +z
  const auto at = [](double from_z) { return star_at({std::sin(from_z), 0.0, std::cos(from_z)}); };
  const Found found = find({at(limb - 1e-4), at(limb + 1e-4), at(0.0), at(-0.4)}, camera, sky);
  EXPECT_EQ(found.counts.behind_earth, 1);
  EXPECT_EQ(found.counts.drawn, 3);
}

TEST(StarField, AStarStreaksByItsOwnMotionAndTheRoll) {
  const CameraGeometry camera = camera_of(0.1);
  SkyView sky = looking_at({1, 0, 0});
  const double roll = 0.01;
  const auto turned = [&](double angle) {
    CameraAttitude a = sky.attitude.middle;
    a.axes.matrix = Eigen::AngleAxisd(angle, Vector3d::UnitZ()).toRotationMatrix() * a.axes.matrix;
    return a;
  };
  sky.attitude.open = turned(-0.5 * roll);
  sky.attitude.close = turned(0.5 * roll);
  const Vector3d aside = sky.attitude.middle.axes.matrix.row(0);
  const Found found =
      find({star_at(Vector3d(Vector3d(1, 0, 0) + 0.08 * aside).normalized()), star_at({1, 0, 0})},
           camera, sky);
  ASSERT_EQ(found.points.size(), 2U);
  // Of the two, one stands in the middle and does not move.
  const bool first = std::abs(found.points[0].place.u - 500.0) > 1.0;
  const PointSource& out = found.points[first ? 0 : 1];
  const PointSource& middle = found.points[first ? 1 : 0];
  EXPECT_NEAR(std::hypot(middle.motion_px.u, middle.motion_px.v), 0.0, 1e-9);
  EXPECT_NEAR(out.motion_px.v, 0.08 * camera.pixels_per_radian() * 2.0 * std::sin(0.5 * roll),
              1e-6);
  EXPECT_NEAR(out.motion_px.u, 0.0, 1e-9);
}

TEST(StarField, AStarThatCrossesTheFrameDuringTheExposureIsFound) {
  const CameraGeometry camera = camera_of(0.1);
  SkyView sky = looking_at({1, 0, 0});
  const auto at = [](double ra) { return Vector3d(std::cos(ra), std::sin(ra), 0.0); };
  sky.attitude.open = look_along({at(-0.4)});
  sky.attitude.close = look_along({at(0.4)});
  // At mid-exposure it stands .3 rad off, three times the half field.
  EXPECT_EQ(find({star_at(at(0.3))}, camera, sky).counts.drawn, 1);
  EXPECT_EQ(find({star_at(at(0.7))}, camera, sky).counts.drawn, 0);
}

TEST(StarField, FaintStarsAreLeftOutAndAddedUp) {
  const CameraGeometry camera = camera_of(0.1);
  const SkyView sky = looking_at({0, 0, 1});
  const StarLight light(600e-9);
  StarLimits limits = kAll;
  limits.faint_w_m2 = light.irradiance_w_m2(8.0, 0.6);
  std::vector<CatalogueStar> stars;
  double left_out = 0;
  for (int i = 0; i < 40; ++i) {
    const double v = 6.05 + 0.1 * i;
    stars.push_back(star_at({0.001 * i, 0, 1}, static_cast<float>(v)));
    stars.back().unit.normalize();
    if (v > 8.0) left_out += light.irradiance_w_m2(v, 0.6);
  }
  const Found found = find(stars, camera, sky, limits);
  EXPECT_EQ(found.counts.drawn, 20);
  EXPECT_EQ(found.counts.faint, 20);
  EXPECT_NEAR(found.counts.left_out_w_m2 / left_out, 1.0, 1e-6);
  EXPECT_LE(found.counts.largest_left_out_w_m2, limits.faint_w_m2);
  EXPECT_NEAR(found.counts.brightest_v, 6.05, 1e-6);
  EXPECT_EQ(found.counts.in_frame, 20);
}

TEST(StarField, WhatIsTooManyIsCountedAndTheFaintestGo) {
  Draws draws(6, Stream::kShot, 0, 0);
  std::vector<CatalogueStar> stars;
  constexpr std::size_t kStars = 200000;
  for (std::size_t i = 0; i < kStars; ++i) {
    const Vector3d unit(0.16 * (draws.uniform_double() - 0.5),
                        0.16 * (draws.uniform_double() - 0.5), 1.0);
    stars.push_back(
        star_at(unit.normalized(), static_cast<float>(5.0 + 6.0 * draws.uniform_double())));
  }
  constexpr std::size_t kRoom = 100000;
  const Found found = find(stars, camera_of(0.1), looking_at({0, 0, 1}), kAll, kRoom);
  EXPECT_LE(found.points.size(), kRoom);
  // One step of the limit is .44 magnitudes of six: a thirteenth of all.
  EXPECT_GT(found.points.size(), kRoom - kStars / 13);
  EXPECT_EQ(found.counts.near, static_cast<int>(kStars));
  EXPECT_EQ(found.counts.near, sum_of(found.counts));
  EXPECT_EQ(found.counts.no_room, static_cast<int>(kStars - found.points.size()));
  for (const PointSource& p : found.points)
    ASSERT_GE(p.irradiance_w_m2, found.counts.largest_left_out_w_m2);
  EXPECT_EQ(found.points.capacity(), kRoom);
}

TEST(StarField, StarsFallWhereDistortionAndARollingShutterPutThem) {
  CameraGeometry camera = camera_of(0.1);
  camera.distortion.k1 = 2.0;
  camera.row_time_s = 10e-6;
  const Vector3d boresight(1, 0, 0);
  SkyView sky = looking_at(boresight);
  sky.exposure_s = 0.02;
  const auto& axes = sky.attitude.middle.axes.matrix;
  // Turning about y: stars move along u, by 40 px over the exposure.
  const auto turned = [&](double rad) {
    CameraAttitude a = sky.attitude.middle;
    a.axes.matrix = Eigen::AngleAxisd(rad, Vector3d::UnitY()).toRotationMatrix() * a.axes.matrix;
    return a;
  };
  const double half_rad = 20.0 * camera.ifov_rad();
  sky.attitude.open = turned(-half_rad);
  sky.attitude.close = turned(half_rad);
  const Vector3d unit =
      (boresight + 0.05 * axes.row(0).transpose() - 0.06 * axes.row(1).transpose()).normalized();
  const Found found = find({star_at(unit)}, camera, sky);
  ASSERT_EQ(found.points.size(), 1U);
  const PointSource& star = found.points.front();
  const auto bent = camera.project(axes * unit);
  const double motion = star.motion_px.u;
  EXPECT_NEAR(std::abs(motion), 40.0, 1.5);
  const double rows = (star.place.v - 500.0) * camera.row_time_s / sky.exposure_s;
  EXPECT_NEAR(star.place.u, bent->u + rows * motion, 0.01);
  EXPECT_NEAR(star.place.v, bent->v + rows * star.motion_px.v, 0.01);
  // An even field's share: as many more pixels as the image is stretched.
  const double k = 2.0 * (0.05 * 0.05 + 0.06 * 0.06);
  const double stretched = (1.0 + k) * (1.0 + 3.0 * k);
  const Found plain = find({star_at(unit)}, camera_of(0.1), sky);
  EXPECT_NEAR(star.irradiance_w_m2 / plain.points.front().irradiance_w_m2, stretched,
              2e-3 * stretched);
}

}  // namespace
}  // namespace engine
