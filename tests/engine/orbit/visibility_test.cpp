#include "engine/orbit/visibility.h"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "engine/core/constants.h"
#include "tests/support/csv.h"
#include "tests/support/scenes.h"

namespace engine {
namespace {

using Eigen::Vector3d;
using test_support::Csv;
using test_support::Flyby;

constexpr double kMillisecond_s = 1e-3;

TEST(LineOfSight, ClearsTheEarthByTheHeightOfTheReference) {
  const Csv reference("los_test_vectors.csv");
  for (const Csv::Row& row : reference.rows()) {
    const Position<J2000> camera{
        1e3 * Vector3d(row.number("rc_x_km"), row.number("rc_y_km"), row.number("rc_z_km"))};
    const Position<J2000> target{
        1e3 * Vector3d(row.number("ro_x_km"), row.number("ro_y_km"), row.number("ro_z_km"))};
    // Places and height are printed to a micrometre.
    EXPECT_NEAR(line_of_sight_margin_m(camera, target, 0.0),
                1e3 * row.number("min_height_of_segment_km"), 3e-6)
        << row.text("tag");
    const double margin_m = line_of_sight_margin_m(camera, target, 1e3 * row.number("h0_km"));
    EXPECT_EQ(margin_m > 0.0, row.number("visible_truth") == 1.0) << row.text("tag");
    EXPECT_EQ(margin_m > 0.0, row.number("visible_corrected_Table2") == 1.0) << row.text("tag");
  }
}

TEST(LineOfSight, IsTable2AsCorrectedForRandomPlaces) {
  std::mt19937_64 random(1);
  std::normal_distribution<double> axis;
  std::uniform_real_distribution<double> height_m(200e3, 4e6);
  std::uniform_real_distribution<double> limit_m(0.0, 199e3);
  int blocked = 0;
  for (int i = 0; i < 100000; ++i) {
    const auto place = [&] {
      const Vector3d v(axis(random), axis(random), axis(random));
      return Vector3d(v.normalized() * (kEarthRadius_m + height_m(random)));
    };
    const Vector3d rc = place();
    const Vector3d ro = place();
    const double h0_m = limit_m(random);
    const double beta = angle_between_rad(-rc, ro - rc);
    const double beta0 = std::asin((kEarthRadius_m + h0_m) / rc.norm());
    const double alpha = angle_between_rad(rc, ro);
    const double alpha0 = std::acos((kEarthRadius_m + h0_m) / rc.norm());
    if (std::abs(beta - beta0) < 1e-9) continue;
    const bool clear = beta > beta0 || alpha < alpha0;
    ASSERT_EQ(line_of_sight_margin_m({rc}, {ro}, h0_m) > 0.0, clear) << i;
    blocked += clear ? 0 : 1;
  }
  EXPECT_GT(blocked, 10000);
}

TEST(LineOfSight, IsTable2AsCorrectedWhereItGrazes) {
  // A million triples, every other one within 1e-6 rad of the tangent; angles in long double, whose
  // own rounding is a thousandth of the band that is left out.
  using Wide = Eigen::Matrix<long double, 3, 1>;
  std::mt19937_64 random(5);
  std::normal_distribution<double> axis;
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  const auto direction = [&] {
    return Vector3d(axis(random), axis(random), axis(random)).normalized();
  };
  const auto angle = [](const Wide& a, const Wide& b) {
    return std::atan2(a.cross(b).norm(), a.dot(b));
  };
  int compared = 0;
  for (int i = 0; i < 1'000'000; ++i) {
    const double h0_m = 199e3 * unit(random);
    const double ball_m = kEarthRadius_m + h0_m;
    const Vector3d rc = direction() * (kEarthRadius_m + 200e3 + 4e6 * unit(random));
    Vector3d ro = direction() * (kEarthRadius_m + 200e3 + 4e6 * unit(random));
    if (i % 2 == 0) {
      // Along a ray that passes the ball by next to nothing, before its foot or beyond.
      const double beta = std::asin(ball_m / rc.norm()) + 1e-6 * (2.0 * unit(random) - 1.0);
      const Vector3d down = -rc.normalized();
      const Vector3d side = down.cross(direction()).normalized();
      ro = rc + 2.0 * unit(random) * std::sqrt(rc.squaredNorm() - ball_m * ball_m) *
                    (std::cos(beta) * down + std::sin(beta) * side);
    }
    const Wide wide_c = rc.cast<long double>();
    const Wide wide_o = ro.cast<long double>();
    const long double beta = angle(-wide_c, wide_o - wide_c);
    const long double beta0 = std::asin(static_cast<long double>(ball_m) / wide_c.norm());
    const long double alpha = angle(wide_c, wide_o);
    const long double alpha0 = std::acos(static_cast<long double>(ball_m) / wide_c.norm());
    if (std::abs(beta - beta0) < 1e-9L || ro.norm() < ball_m) continue;
    const bool clear = beta > beta0 || alpha < alpha0;
    ASSERT_EQ(line_of_sight_margin_m({rc}, {ro}, h0_m) > 0.0, clear) << i;
    ++compared;
  }
  EXPECT_GT(compared, 990'000);
}

TEST(LineOfSight, IsFiniteForPlacesThatCoincideOrFaceEachOther) {
  const Position<J2000> here{{7e6, 0, 0}};
  const Position<J2000> there{{-7e6, 0, 0}};
  EXPECT_DOUBLE_EQ(line_of_sight_margin_m(here, here, 0.0), 7e6 - kEarthRadius_m);
  EXPECT_DOUBLE_EQ(line_of_sight_margin_m(here, there, 0.0), -kEarthRadius_m);
  EXPECT_DOUBLE_EQ(line_of_sight_margin_m(here, {{8e6, 0, 0}}, 0.0), 7e6 - kEarthRadius_m);
}

TEST(Background, IsTheEarthWhereTheReferenceSaysSo) {
  const Flyby flyby;
  const Csv reference("background_intervals.csv");
  for (const Csv::Row& row : reference.rows()) {
    const bool earth = row.text("background").starts_with("earth");
    const double start_s = row.number("start_s");
    const double end_s = row.number("end_s");
    // Edges to 1 ms, as for the windows.
    for (const double t_s :
         {start_s + kMillisecond_s, 0.5 * (start_s + end_s), end_s - kMillisecond_s}) {
      const Epoch now = flyby.at(t_s);
      EXPECT_EQ(earth_is_behind(flyby.camera.at(now).position, flyby.target.at(now).position),
                earth)
          << "window " << row.text("range_window") << " at " << t_s;
    }
  }
}

TEST(Background, IsSpaceWhenTheCameraLooksAwayFromTheEarth) {
  EXPECT_FALSE(earth_is_behind({{7e6, 0, 0}}, {{8e6, 0, 0}}));
  EXPECT_TRUE(earth_is_behind({{8e6, 0, 0}}, {{7e6, 0, 0}}));
}

}  // namespace
}  // namespace engine
