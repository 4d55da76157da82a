#include "engine/scene/snapshot_builder.h"

#include <cmath>

#include <gtest/gtest.h>

#include "tests/support/csv.h"
#include "tests/support/scenes.h"

namespace engine {
namespace {

using Eigen::Vector3d;
using test_support::Csv;
using test_support::Flyby;
using test_support::kClosestOfPass3_s;

constexpr double kMillisecond_s = 1e-3;

SceneSpec spec_of(const Flyby& flyby, LightPath path = LightPath::kApparent) {
  SceneSpec spec;
  spec.epoch = flyby.epoch;
  spec.seed = 42;
  spec.light_path = path;
  spec.sky_w_m2_sr = 5e-7;
  return spec;
}

CameraAttitude tracking(const Flyby& flyby, SimTime t, LightPath path) {
  return look_along(
      sight_line(flyby.camera, flyby.target, flyby.epoch + t.time_since_epoch(), path).apparent);
}

/// 1 ms about `middle_s`, the target held on the boresight all the time.
Shot tracked_shot(const Flyby& flyby, double middle_s, LightPath path = LightPath::kApparent) {
  Shot shot;
  shot.sequence = 7;
  shot.exposure = from_seconds(kMillisecond_s);
  shot.shutter_open = sim_time(middle_s) - shot.exposure / 2;
  shot.attitude.open = tracking(flyby, shot.shutter_open, path);
  shot.attitude.middle = tracking(flyby, shot.shutter_open + shot.exposure / 2, path);
  shot.attitude.close = tracking(flyby, shot.shutter_open + shot.exposure, path);
  return shot;
}

TEST(SnapshotBuilder, PutsATrackedTargetOnTheBoresightWithoutSmear) {
  const Flyby flyby;
  for (const LightPath path : {LightPath::kGeometric, LightPath::kApparent}) {
    const SnapshotBuilder builder(spec_of(flyby, path), flyby.camera, flyby.target);
    for (double t_s = kClosestOfPass3_s - 15.0; t_s < kClosestOfPass3_s + 16.0; t_s += 3.0) {
      const Snapshot s = builder.build(tracked_shot(flyby, t_s, path));
      // A rounding of the direction, 1e-16 rad, times 7e5 px per rad.
      EXPECT_NEAR(s.target_px.u, 512.0, 1e-9) << t_s;
      EXPECT_NEAR(s.target_px.v, 512.0, 1e-9) << t_s;
      EXPECT_NEAR(s.smear_px.u, 0.0, 1e-9) << t_s;
      EXPECT_NEAR(s.smear_px.v, 0.0, 1e-9) << t_s;
      EXPECT_FALSE(s.roll_is_fallback);
    }
  }
}

TEST(SnapshotBuilder, SmearsWhatIsNotTracked) {
  const Flyby flyby;
  const Csv windows("range_windows_15d.csv");
  const SnapshotBuilder builder(spec_of(flyby), flyby.camera, flyby.target);
  for (const Csv::Row& row : windows.rows()) {
    Shot shot = tracked_shot(flyby, row.number("tca_s"));
    shot.attitude.open = shot.attitude.close = shot.attitude.middle;
    const Snapshot s = builder.build(shot);
    // The reference's rate is geometric; light time makes it slower by range rate over c, nothing
    // at the closest approach, and aberration changes it by v/c, 5e-5. 1 ms is short: 1e-4 of it.
    const double want_px = row.number("pixel_drift_max_px_s") * kMillisecond_s;
    EXPECT_NEAR(std::hypot(s.smear_px.u, s.smear_px.v) / want_px, 1.0, 3e-4) << row.text("idx");
  }
}

TEST(SnapshotBuilder, CameraSeesTheTargetsCentreAlongItsBoresight) {
  // Aberration tilts the camera's view by 17 px and more; the rays must run along the light's path.
  const Flyby flyby;
  const SnapshotBuilder builder(spec_of(flyby), flyby.camera, flyby.target);
  const Snapshot s = builder.build(tracked_shot(flyby, kClosestOfPass3_s));
  EXPECT_NEAR(s.camera.m.norm(), s.range_m, 1e-8);
  const Vector3d boresight = s.body_from_camera.matrix.col(2);
  // In pixels: 1e-9 rad is .0007.
  EXPECT_LT(angle_between_rad(boresight, -s.camera.m), 1e-9);
  EXPECT_NEAR(s.body_from_camera.matrix.determinant(), 1.0, 1e-14);
  EXPECT_EQ(s.sequence, 7U);
  EXPECT_EQ(s.seed, 42U);
  EXPECT_EQ(s.background_w_m2_sr, 5e-7);
}

TEST(SnapshotBuilder, BodyPointsToTheNadir) {
  // Camera and Sun in body axes: their z is minus their height above the target's horizon.
  const Flyby flyby;
  const SnapshotBuilder builder(spec_of(flyby, LightPath::kGeometric), flyby.camera, flyby.target);
  for (double t_s = 0.0; t_s < 6000.0; t_s += 500.0) {
    const Snapshot s = builder.build(tracked_shot(flyby, t_s, LightPath::kGeometric));
    const Epoch now = flyby.at(t_s);
    const OrbitState target = flyby.target.at(now);
    const Vector3d up = target.position.m.normalized();
    const Vector3d to_camera = flyby.camera.at(now).position.m - target.position.m;
    // 14 roundings of 1e7 m.
    EXPECT_NEAR(s.camera.m.z(), -to_camera.dot(up), 2e-8);
    const Vector3d ahead = target.position.m.cross(target.velocity.m_s).cross(target.position.m);
    EXPECT_NEAR(s.camera.m.x(), to_camera.dot(ahead.normalized()), 2e-8);
    const Vector3d to_sun = sun_position(SunModel::kErfa, now).m - target.position.m;
    EXPECT_NEAR(s.sun.toward.unit.z(), -to_sun.normalized().dot(up), 1e-12);
    EXPECT_NEAR(s.phase_angle_rad, angle_between_rad(to_sun, to_camera), 1e-12);
  }
}

TEST(SnapshotBuilder, TurnsTheBodyByItsOffsets) {
  const Flyby flyby;
  SceneSpec spec = spec_of(flyby);
  const Shot shot = tracked_shot(flyby, kClosestOfPass3_s);
  const Snapshot plain = SnapshotBuilder(spec, flyby.camera, flyby.target).build(shot);
  spec.target_attitude.offsets = {0.1, -0.2, 0.3};
  const Snapshot turned = SnapshotBuilder(spec, flyby.camera, flyby.target).build(shot);
  const Eigen::Matrix3d offset = body_offset(spec.target_attitude.offsets).matrix;
  EXPECT_LT((turned.camera.m - offset * plain.camera.m).norm(), 1e-9);
  EXPECT_LT((turned.sun.toward.unit - offset * plain.sun.toward.unit).norm(), 1e-14);
  EXPECT_EQ(turned.target_px.u, plain.target_px.u);
}

TEST(SnapshotBuilder, PhaseAnglesAreThoseOfTheReference) {
  const Flyby flyby;
  const Csv windows("range_windows_15d.csv");
  const SnapshotBuilder builder(spec_of(flyby, LightPath::kGeometric), flyby.camera, flyby.target);
  for (const Csv::Row& row : windows.rows()) {
    const Snapshot s =
        builder.build(tracked_shot(flyby, row.number("tca_s"), LightPath::kGeometric));
    // Four decimals are printed; the time, rounded to a microsecond, turns the line by 2e-5 deg.
    EXPECT_NEAR(s.phase_angle_rad / kDegree, row.number("phase_angle_at_tca_deg"), 1e-4);
  }
}

TEST(SnapshotBuilder, SwitchesTheSunOffInTheShadow) {
  const Flyby flyby;
  const SnapshotBuilder builder(spec_of(flyby), flyby.camera, flyby.target);
  int dark = 0;
  int lit = 0;
  for (double t_s = 0.0; t_s < 6000.0; t_s += 100.0) {
    const Snapshot s = builder.build(tracked_shot(flyby, t_s));
    const Epoch now = flyby.at(t_s);
    const Vector3d target = flyby.target.at(now).position.m;
    const Vector3d to_sun = sun_position(SunModel::kErfa, now).m.normalized();
    const double off_axis_m = (target - target.dot(to_sun) * to_sun).norm();
    if (target.dot(to_sun) < 0.0 && off_axis_m < kEarthRadius_m - 2e4) {
      EXPECT_EQ(s.sun.irradiance_w_m2, 0.0) << t_s;
      ++dark;
    } else if (target.dot(to_sun) > 0.0) {
      // Perihelion: .98336 au, and the target's own 7000 km on top.
      EXPECT_NEAR(s.sun.irradiance_w_m2, 623.677 / (0.98336 * 0.98336), 0.2) << t_s;
      ++lit;
    }
    EXPECT_NEAR(s.sun.toward.unit.norm(), 1.0, 1e-14);
  }
  EXPECT_GT(dark, 10);
  EXPECT_GT(lit, 20);
}

TEST(SnapshotBuilder, LetsTheSunSetByTheShareOfItsDisc) {
  const Flyby flyby;
  // The target's first sunset: the last second in which all of the Sun is seen, and on.
  const auto lit = [&](double t_s) {
    const Epoch now = flyby.at(t_s);
    return lit_fraction(ShadowModel::kOblateCone, flyby.target.at(now).position,
                        sun_position(SunModel::kErfa, now));
  };
  double sunset_s = 0.0;
  while (lit(sunset_s) < 1.0 || lit(sunset_s + 1.0) == 1.0) sunset_s += 1.0;
  SceneSpec spec = spec_of(flyby);
  spec.light_path = LightPath::kGeometric;
  const SnapshotBuilder builder(spec, flyby.camera, flyby.target);
  spec.shadow = ShadowModel::kCylinder;
  const SnapshotBuilder by_cylinder(spec, flyby.camera, flyby.target);
  const double full_w_m2 = builder.build(tracked_shot(flyby, sunset_s)).sun.irradiance_w_m2;
  int fading = 0;
  for (int i = 0; i < 20; ++i) {
    const Shot shot = tracked_shot(flyby, sunset_s + i);
    const Snapshot s = builder.build(shot);
    const double there = lit(sunset_s + i);
    EXPECT_NEAR(s.sun.irradiance_w_m2 / full_w_m2, there, 1e-6) << i;
    fading += there > 0.0 && there < 1.0 ? 1 : 0;
    const double switched = by_cylinder.build(shot).sun.irradiance_w_m2 / full_w_m2;
    EXPECT_NEAR(switched * (1.0 - switched), 0.0, 1e-5) << i;
    // The Earth's own light goes on.
    EXPECT_EQ(s.earthshine.irradiance_w_m2, by_cylinder.build(shot).earthshine.irradiance_w_m2);
  }
  EXPECT_GE(fading, 7);  // it takes eight seconds
}

TEST(SnapshotBuilder, LightsFromBelowOnTheDaySide) {
  const Flyby flyby;
  SceneSpec spec = spec_of(flyby);
  const auto earthshine = [&](EarthshineModel model, double t_s) {
    spec.earth.earthshine = model;
    return SnapshotBuilder(spec, flyby.camera, flyby.target)
        .build(tracked_shot(flyby, t_s))
        .earthshine;
  };
  for (double t_s = 0.0; t_s < 6000.0; t_s += 300.0) {
    EXPECT_EQ(earthshine(EarthshineModel::kNone, t_s).irradiance_w_m2, 0.0);
    const Lamp lamp = earthshine(EarthshineModel::kPaperLamp, t_s);
    EXPECT_NEAR(lamp.toward.unit.z(), 1.0, 1e-12);
    EXPECT_NEAR(lamp.irradiance_w_m2, 0.3 * 623.677 / (0.98336 * 0.98336), 0.06);
    const Lamp vector = earthshine(EarthshineModel::kVector, t_s);
    EXPECT_LE(vector.irradiance_w_m2, lamp.irradiance_w_m2);
    // Light comes from the cap, whose edge is 70 deg from the nadir.
    if (vector.irradiance_w_m2 > 0.0) {
      EXPECT_GT(vector.toward.unit.z(), std::cos(71.0 * kDegree));
    }
  }
}

TEST(SnapshotBuilder, PutsWhatIsBehindTheCameraFarOutsideAndFinite) {
  const Flyby flyby;
  const SnapshotBuilder builder(spec_of(flyby), flyby.camera, flyby.target);
  Shot shot = tracked_shot(flyby, kClosestOfPass3_s);
  for (CameraAttitude* a : {&shot.attitude.open, &shot.attitude.middle, &shot.attitude.close})
    *a = look_along({-a->axes.matrix.row(2).transpose()});
  const Snapshot s = builder.build(shot);
  EXPECT_TRUE(std::isfinite(s.target_px.u) && std::isfinite(s.target_px.v));
  EXPECT_LT(s.target_px.u, -1e6);
  EXPECT_TRUE(std::isfinite(s.smear_px.u) && std::isfinite(s.smear_px.v));
}

TEST(SnapshotBuilder, KnowsTheEarthBehindTheTarget) {
  const Flyby flyby;
  const SnapshotBuilder builder(spec_of(flyby, LightPath::kGeometric), flyby.camera, flyby.target);
  // background_intervals.csv, window 3: Earth from 309773.16 to 309790.44 s.
  EXPECT_FALSE(builder.build(tracked_shot(flyby, 309765.0)).earth_behind);
  EXPECT_TRUE(builder.build(tracked_shot(flyby, 309780.0)).earth_behind);
  EXPECT_FALSE(builder.build(tracked_shot(flyby, 309795.0)).earth_behind);
}

TEST(SnapshotBuilder, TheEarthIsInTheTargetsPixelExactlyInTheIntervalsOfTheReference) {
  const Flyby flyby;
  SceneSpec spec = spec_of(flyby, LightPath::kGeometric);
  spec.earth.air.optical_depth = 0.0;
  const SnapshotBuilder builder(spec, flyby.camera, flyby.target);
  EarthBackground background;
  background.reserve(spec.camera, 0);
  int sunlit = 0;
  const Csv intervals("background_intervals.csv");
  for (const Csv::Row& row : intervals.rows()) {
    const bool earth = row.text("background") == "earth_background";
    const double start_s = row.number("start_s");
    const double end_s = row.number("end_s");
    // The ends to a millisecond: a target's pixel is 6 m of the ground 2700 km away.
    for (const double t_s : {start_s + 1e-3, 0.5 * (start_s + end_s), end_s - 1e-3}) {
      const Snapshot s = builder.build(tracked_shot(flyby, t_s, LightPath::kGeometric));
      EXPECT_EQ(s.earth_behind, earth) << t_s;
      background.draw(s.earth_in_frame, 0.0);
      const double light = background.at(s.target_px);
      if (!earth) {
        EXPECT_EQ(light, 0.0) << t_s;
        continue;
      }
      const EarthDisc<CameraFrame>& disc = s.earth_in_frame.disc;
      const Vector3d unit = spec.camera.direction_at(s.target_px).normalized();
      const double passes_at = disc.passes_at_radii(unit);
      ASSERT_LT(passes_at, 1.0) << t_s;
      const double cos_sun = disc.vertical_at(unit, passes_at).dot(disc.to_sun.unit);
      // At night it is dark; the Sun's disc is .27 deg wide.
      if (cos_sun > 0.005) {
        EXPECT_NEAR(light, 0.3 * disc.sun_irradiance_w_m2 / kPi * cos_sun, 1e-9) << t_s;
        ++sunlit;
      } else if (cos_sun < -0.005) {
        EXPECT_EQ(light, 0.0) << t_s;
      }
    }
  }
  EXPECT_GT(sunlit, 10);
}

TEST(SnapshotBuilder, TheEarthInTheFrameMayBeLeftOut) {
  const Flyby flyby;
  SceneSpec spec = spec_of(flyby);
  const Shot shot = tracked_shot(flyby, 309780.0);
  EXPECT_TRUE(
      SnapshotBuilder(spec, flyby.camera, flyby.target).build(shot).earth_in_frame.disc.seen());
  spec.earth.in_frame = false;
  EXPECT_FALSE(
      SnapshotBuilder(spec, flyby.camera, flyby.target).build(shot).earth_in_frame.disc.seen());
}

TEST(SnapshotBuilder, TheEarthLightIsThatOfTheLampInBodyAxes) {
  const Flyby flyby;
  SceneSpec spec = spec_of(flyby);
  spec.target_attitude.offsets = {0.1, -0.2, 0.3};
  for (const double t_s : {0.0, 1200.0, 309781.0}) {
    const Shot shot = tracked_shot(flyby, t_s);
    spec.earth.earthshine = EarthshineModel::kVector;
    const Snapshot lamp = SnapshotBuilder(spec, flyby.camera, flyby.target).build(shot);
    EXPECT_TRUE(lamp.earth.dark());
    for (const EarthshineModel model : {EarthshineModel::kHarmonics, EarthshineModel::kCap}) {
      spec.earth.earthshine = model;
      const Snapshot s = SnapshotBuilder(spec, flyby.camera, flyby.target).build(shot);
      EXPECT_EQ(s.earthshine_rung.model, model);
      EXPECT_EQ(s.earthshine.irradiance_w_m2, lamp.earthshine.irradiance_w_m2);
      const Vector3d light = s.earthshine.toward.unit * s.earthshine.irradiance_w_m2;
      EXPECT_LE((s.earth.vector_irradiance_w_m2() - light).norm(), 1e-12 * light.norm());
      // Below the target is where the body's z points, turned by its offsets.
      const Vector3d nadir = body_offset(spec.target_attitude.offsets).matrix * Vector3d::UnitZ();
      EXPECT_LT((s.earth.disc().to_centre.unit - nadir).norm(), 1e-12);
      EXPECT_LT((s.earth.disc().to_sun.unit - s.sun.toward.unit).norm(), 1e-4);
    }
  }
}

TEST(SnapshotBuilder, TheCameraSeesTheEarthWhereItsRaysToTheTargetSayItIs) {
  // Aberration is taken out of both in one way.
  const Flyby flyby;
  SceneSpec spec = spec_of(flyby);
  spec.earth.earthshine = EarthshineModel::kCap;
  const SnapshotBuilder builder(spec, flyby.camera, flyby.target);
  for (const double t_s : {kClosestOfPass3_s - 10.0, kClosestOfPass3_s, kClosestOfPass3_s + 10.0}) {
    const Snapshot s = builder.build(tracked_shot(flyby, t_s));
    ASSERT_FALSE(s.earth.dark());
    const EarthDisc<BodyFrame>& below = s.earth.disc();
    const Vector3d centre_m = below.distance_radii * kEarthRadius_m * below.to_centre.unit;
    const Vector3d from_camera = (centre_m - s.camera.m).normalized();
    const EarthDisc<CameraFrame>& seen = s.earth_in_frame.disc;
    const Vector3d by_rays = s.body_from_camera.matrix * seen.to_centre.unit;
    EXPECT_LT((by_rays - from_camera).norm(), 1e-12);  // roundings; a pixel is 1.4e-6
    EXPECT_NEAR(seen.distance_radii, (centre_m - s.camera.m).norm() / kEarthRadius_m, 1e-12);
  }
}

TEST(SnapshotBuilder, PassesTheFallbackOfTheRollOn) {
  const Flyby flyby;
  const SnapshotBuilder builder(spec_of(flyby), flyby.camera, flyby.target);
  Shot shot = tracked_shot(flyby, kClosestOfPass3_s);
  shot.attitude.middle.roll_is_fallback = true;
  EXPECT_TRUE(builder.build(shot).roll_is_fallback);
}

/// Straight up, or by a hair aside.
class Rising final : public Propagator {
 public:
  explicit Rising(double aside_m_s) : aside_m_s_(aside_m_s) {}
  [[nodiscard]] OrbitState at(Epoch /*t*/) const noexcept override {
    return {{{7e6, 1e5, 2e5}}, {{7.0, 0.1, 0.2 + aside_m_s_}}};
  }

 private:
  double aside_m_s_;
};

TEST(SnapshotBuilder, SaysWhereTheTargetsAttitudeHasNoAnswerOfItsOwn) {
  const Flyby flyby;
  const Shot shot = tracked_shot(flyby, kClosestOfPass3_s);
  const Rising straight(0.0);
  const Rising aside(1e-6);
  SceneSpec spec = spec_of(flyby);
  EXPECT_FALSE(SnapshotBuilder(spec, flyby.camera, flyby.target).build(shot).attitude_is_fallback);
  EXPECT_FALSE(SnapshotBuilder(spec, flyby.camera, aside).build(shot).attitude_is_fallback);
  EXPECT_TRUE(SnapshotBuilder(spec, flyby.camera, straight).build(shot).attitude_is_fallback);
  // One that is held to the stars needs no orbit.
  spec.target_attitude.kind = AttitudeKind::kInertial;
  EXPECT_FALSE(SnapshotBuilder(spec, flyby.camera, straight).build(shot).attitude_is_fallback);
}

TEST(SnapshotBuilder, AMicrosecondMovesTheImageByItsOwnShare) {
  // A Julian date in one double is 40 us wide: it would step by 6 px here, or not at all.
  const Flyby flyby;
  const SnapshotBuilder builder(spec_of(flyby), flyby.camera, flyby.target);
  Shot shot = tracked_shot(flyby, kClosestOfPass3_s);
  const Snapshot before = builder.build(shot);
  shot.shutter_open += std::chrono::microseconds(1);
  const Snapshot after = builder.build(shot);
  const double moved_px =
      std::hypot(after.target_px.u - before.target_px.u, after.target_px.v - before.target_px.v);
  const double want_px =
      before.line_of_sight_rate_rad_s * 1e-6 * CameraGeometry{}.pixels_per_radian();
  EXPECT_NEAR(want_px, 0.146, 0.001);
  EXPECT_NEAR(moved_px / want_px, 1.0, 0.01);
}

/// The shot of a camera that swings along its x by a sine, so many whole swings in the exposure.
Shot swinging_shot(const Flyby& flyby, double amplitude_rad, double swings) {
  Shot shot = tracked_shot(flyby, kClosestOfPass3_s);
  AttitudeTrack& track = shot.attitude;
  track.known_between = true;
  const auto swing = [&](CameraAttitude& attitude, int step) {
    const Duration after = AttitudeTrack::time_of(step, shot.exposure);
    attitude = tracking(flyby, shot.shutter_open + after, LightPath::kApparent);
    const double turns = swings * (static_cast<double>(step) / AttitudeTrack::kSteps - 0.5);
    // Towards +x the camera looks, and the image moves to smaller u.
    const double tilt = amplitude_rad * std::sin(2.0 * kPi * turns);
    attitude.axes.matrix =
        Eigen::AngleAxisd(-tilt, Vector3d::UnitY()).toRotationMatrix() * attitude.axes.matrix;
  };
  swing(track.open, 0);
  swing(track.middle, AttitudeTrack::kStepsOfHalf);
  swing(track.close, AttitudeTrack::kSteps);
  for (int i = 0; i < AttitudeTrack::kStepsOfHalf - 1; ++i) {
    swing(track.to_middle[static_cast<std::size_t>(i)], i + 1);
    swing(track.to_close[static_cast<std::size_t>(i)], AttitudeTrack::kStepsOfHalf + i + 1);
  }
  return shot;
}

TEST(SnapshotBuilder, KnowsThePathOfAnImageThatSwings) {
  const Flyby flyby;
  const SnapshotBuilder builder(spec_of(flyby), flyby.camera, flyby.target);
  const CameraGeometry camera;
  const double amplitude_px = 4.0;
  const Snapshot s = builder.build(swinging_shot(flyby, amplitude_px * camera.ifov_rad(), 1.0));
  ASSERT_TRUE(s.path.bends);
  ASSERT_TRUE(s.boresight_path.bends);
  EXPECT_NEAR(s.smear_px.u, 0.0, 1e-6);  // it ends where it began
  for (int i = 0; i <= ImagePath::kSteps; ++i) {
    const auto at = static_cast<std::size_t>(i);
    const double turns = static_cast<double>(i) / ImagePath::kSteps - 0.5;
    const double want_px = -amplitude_px * std::sin(2.0 * kPi * turns);
    EXPECT_NEAR(s.path.off_px[at].u, want_px, 1e-6) << i;
    EXPECT_NEAR(s.path.off_px[at].v, 0.0, 1e-6) << i;
    EXPECT_NEAR(s.boresight_path.off_px[at].u, want_px, 1e-3) << i;
  }
}

TEST(SnapshotBuilder, NobodySeesThatAMotionIsEvenButForAFiftiethOfAPixel) {
  const Flyby flyby;
  const SnapshotBuilder builder(spec_of(flyby), flyby.camera, flyby.target);
  const CameraGeometry camera;
  EXPECT_FALSE(builder.build(swinging_shot(flyby, 0.0, 1.0)).path.bends);
  EXPECT_FALSE(builder.build(swinging_shot(flyby, 0.019 * camera.ifov_rad(), 1.0)).path.bends);
  EXPECT_TRUE(builder.build(swinging_shot(flyby, 0.021 * camera.ifov_rad(), 1.0)).path.bends);
  // A smear that is even is no path.
  Shot smeared = swinging_shot(flyby, 0.0, 1.0);
  AttitudeTrack& track = smeared.attitude;
  for (CameraAttitude* a : {&track.open, &track.close}) *a = track.middle;
  for (auto* half : {&track.to_middle, &track.to_close})
    for (CameraAttitude& a : *half) a = track.middle;
  const Snapshot s = builder.build(smeared);
  EXPECT_GT(std::hypot(s.smear_px.u, s.smear_px.v), 30.0);
  EXPECT_FALSE(s.path.bends);
}

TEST(SnapshotBuilder, ATargetIsSeenWhereDistortionAndARollingShutterPutIt) {
  const Flyby flyby;
  SceneSpec spec = spec_of(flyby);
  spec.camera.distortion.k1 = 5e4;
  spec.camera.row_time_s = 5e-6;
  const SnapshotBuilder builder(spec, flyby.camera, flyby.target);
  Shot shot = tracked_shot(flyby, kClosestOfPass3_s);
  // 300 px to the right of the target and 400 px below it, held there.
  const double ifov = spec.camera.ifov_rad();
  const auto& axes = shot.attitude.middle.axes.matrix;
  const Vector3d aside = axes.row(2) + 300.0 * ifov * axes.row(0) + 400.0 * ifov * axes.row(1);
  for (CameraAttitude* a : {&shot.attitude.open, &shot.attitude.middle, &shot.attitude.close})
    *a = look_along(direction_of<J2000>(aside));
  const Snapshot s = builder.build(shot);
  const PixelPoint straight =
      SnapshotBuilder(spec_of(flyby), flyby.camera, flyby.target).build(shot).target_px;
  EXPECT_NEAR(straight.v, 112.0, 1.0);
  const double off_px = std::hypot(straight.u - 512.0, straight.v - 512.0);
  const double bent = 1.0 + 5e4 * std::pow(off_px * ifov, 2);
  EXPECT_GT(bent, 1.02);
  // The rows above the middle are exposed before it is.
  const double rows = (s.target_px.v - 512.0) * 5e-6 / 1e-3;
  EXPECT_NEAR(s.target_px.u, 512.0 + (straight.u - 512.0) * bent + rows * s.smear_px.u, 0.01);
  EXPECT_NEAR(s.target_px.v, 512.0 + (straight.v - 512.0) * bent + rows * s.smear_px.v, 0.01);
  EXPECT_GT(std::abs(rows), 1.5);
}

TEST(SnapshotBuilder, WhatDistortionPutsOutOfSightIsNotDrawnByAPinholeEither) {
  // Strong pincushion: what a pinhole would show in the frame's corner is far outside.
  const Flyby flyby;
  SceneSpec spec = spec_of(flyby);
  const double ifov = spec.camera.ifov_rad();
  spec.camera.distortion.k1 = 2.0 / std::pow(724.0 * ifov, 2);
  spec.camera.distortion.reach_tan = 500.0 * ifov;
  const SnapshotBuilder builder(spec, flyby.camera, flyby.target);
  Shot shot = tracked_shot(flyby, kClosestOfPass3_s);
  const auto& axes = shot.attitude.middle.axes.matrix;
  const Vector3d aside = axes.row(2) + 380.0 * ifov * axes.row(0) + 380.0 * ifov * axes.row(1);
  for (CameraAttitude* a : {&shot.attitude.open, &shot.attitude.middle, &shot.attitude.close})
    *a = look_along(direction_of<J2000>(aside));
  const Snapshot s = builder.build(shot);
  EXPECT_LT(s.target_px.u, -1e8);
  const Vector3d centre = s.body_from_camera.matrix.transpose() * -s.camera.m;
  const auto straight = spec.camera.project_straight(centre);
  ASSERT_TRUE(straight.has_value());
  EXPECT_GT(straight->u, 0.0);  // a pinhole sees it
  EXPECT_LT(LocalCamera(spec.camera, s.image_map).project(centre)->u, -1e8);
}

}  // namespace
}  // namespace engine
