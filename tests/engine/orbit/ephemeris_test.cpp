#include "engine/orbit/ephemeris.h"

#include <cmath>
#include <cstdio>
#include <string>

#include <gtest/gtest.h>

#include "engine/core/contract.h"
#include "tests/support/scenes.h"

namespace engine {
namespace {

using test_support::Flyby;

struct Method {
  std::string name = "HERMITE";
  int degree = 7;
  double step_s = 60.0;
  int rows = 100;
};

/// The paper's camera as a file, a row each `step_s`; 12 decimals of a kilometre.
std::string camera_file(const Method& method) {
  const Flyby flyby;
  const auto text_at = [&](int row) { return utc_text(flyby.at(method.step_s * row), 9); };
  std::string text =
      "CCSDS_OEM_VERS = 2.0\nMETA_START\nOBJECT_NAME = CAMERA\nOBJECT_ID = 2022-001A\n"
      "CENTER_NAME = EARTH\nREF_FRAME = EME2000\nTIME_SYSTEM = UTC\nSTART_TIME = " +
      text_at(0) + "\nSTOP_TIME = " + text_at(method.rows - 1) +
      "\nINTERPOLATION = " + method.name +
      "\nINTERPOLATION_DEGREE = " + std::to_string(method.degree) + "\nMETA_STOP\n";
  for (int row = 0; row < method.rows; ++row) {
    const OrbitState s = flyby.camera.at(flyby.at(method.step_s * row));
    char line[300];
    std::snprintf(line, sizeof line, " %.12f %.12f %.12f %.15f %.15f %.15f\n",
                  s.position.m.x() * 1e-3, s.position.m.y() * 1e-3, s.position.m.z() * 1e-3,
                  s.velocity.m_s.x() * 1e-3, s.velocity.m_s.y() * 1e-3, s.velocity.m_s.z() * 1e-3);
    text += text_at(row) + line;
  }
  return text;
}

EphemerisPropagator camera_by(const Method& method) {
  return EphemerisPropagator(read_oem(KvnLines::from_text(camera_file(method), "x.oem")));
}

struct Worst {
  double place_m = 0;
  double velocity_m_s = 0;
};

/// Between all rows but the outermost, at several places.
Worst error_of(const EphemerisPropagator& body, const Method& method, int margin) {
  const Flyby flyby;
  Worst worst;
  for (double row = margin; row <= method.rows - 1 - margin; row += 0.37) {
    const Epoch t = flyby.at(method.step_s * row);
    const OrbitState got = body.at(t);
    const OrbitState want = flyby.camera.at(t);
    worst.place_m = std::max(worst.place_m, (got.position.m - want.position.m).norm());
    worst.velocity_m_s =
        std::max(worst.velocity_m_s, (got.velocity.m_s - want.velocity.m_s).norm());
  }
  return worst;
}

TEST(Ephemeris, InterpolatesAnOrbitAsWellAsItsDegreeAllows) {
  // The remainder of degree d: (n h)^(d + 1) / (d + 1)! times the product of the distances to the
  // nodes in steps, times the axis; n h = .0666 at 60 s. Hermite 7 with nodes at -1, 0, 1, 2:
  // (.5 * 1.5)^4 = .32. Lagrange 7 with nodes at -3 ... 4: (.5 * 1.5 * 2.5 * 3.5)^2 = 43. Twice
  // that, for the harmonics of an ellipse; and the roundings of 7e6 m.
  const auto limit_m = [](double power, double distances, double factorial) {
    return 2.0 * std::pow(0.0666, power) * distances / factorial * 6.9e6 + 5e-9;
  };
  const Method hermite7;
  EXPECT_LT(error_of(camera_by(hermite7), hermite7, 1).place_m, limit_m(8, 0.32, 40320));
  const Method hermite3{"HERMITE", 3};
  EXPECT_LT(error_of(camera_by(hermite3), hermite3, 1).place_m, limit_m(4, 0.0625, 24));
  EXPECT_GT(error_of(camera_by(hermite3), hermite3, 1).place_m, 0.1 * limit_m(4, 0.0625, 24));
  const Method lagrange7{"LAGRANGE", 7};
  EXPECT_LT(error_of(camera_by(lagrange7), lagrange7, 4).place_m, limit_m(8, 43.1, 40320));
  const Method linear{"LINEAR", 1};
  EXPECT_NEAR(error_of(camera_by(linear), linear, 0).place_m, 0.0666 * 0.0666 / 8.0 * 6.87e6, 50.0);
}

TEST(Ephemeris, VelocityIsThatOfThePath) {
  // A derivative loses one power of n h.
  const Method hermite7;
  EXPECT_LT(error_of(camera_by(hermite7), hermite7, 1).velocity_m_s, 1e-8);
  const Method lagrange7{"LAGRANGE", 7};
  EXPECT_LT(error_of(camera_by(lagrange7), lagrange7, 4).velocity_m_s, 1e-7);
}

TEST(Ephemeris, GivesTheRowsThemselves) {
  const Flyby flyby;
  for (const Method& method : {Method{}, Method{"LAGRANGE", 5}, Method{"HERMITE", 1}}) {
    const EphemerisPropagator body = camera_by(method);
    for (int row = 0; row < method.rows; ++row) {
      const Epoch t = flyby.at(method.step_s * row);
      // The file's last digits.
      ASSERT_LT((body.at(t).position.m - flyby.camera.at(t).position.m).norm(), 5e-9) << row;
    }
  }
}

TEST(Ephemeris, LeavingRowsOutBoundsItsError) {
  for (const Method& method : {Method{}, Method{"HERMITE", 3}, Method{"LAGRANGE", 7, 120.0}}) {
    const EphemerisPropagator body = camera_by(method);
    const double between_m = error_of(body, method, 0).place_m;
    EXPECT_LT(between_m, body.interpolation_error_m() + 5e-9) << method.name << method.degree;
  }
  // At twice the distance: 2^4 at degree 3, and not more than the node's own distances add.
  const Method cubic{"HERMITE", 3};
  const double bound_m = camera_by(cubic).interpolation_error_m();
  EXPECT_LT(bound_m, 40.0 * error_of(camera_by(cubic), cubic, 1).place_m);
}

TEST(Ephemeris, IsNeverFasterThanItsBound) {
  const Flyby flyby;
  const EphemerisPropagator body = camera_by({});
  for (int t_s = 0; t_s < 5900; ++t_s)
    ASSERT_LE(body.at(flyby.at(t_s)).velocity.m_s.norm(), body.speed_bound_m_s());
  EXPECT_LT(body.speed_bound_m_s(), 1.1 * flyby.camera.speed_bound_m_s());
}

TEST(Ephemeris, KnowsItsSpanAndStandsStillOutside) {
  const Flyby flyby;
  const EphemerisPropagator body = camera_by({});
  EXPECT_EQ(body.span().begin, flyby.epoch);
  EXPECT_EQ(body.span().end, flyby.at(5940.0));
  EXPECT_FALSE(body.gap_in({flyby.at(0.0), flyby.at(5940.0)}).has_value());
  const auto before = body.gap_in({flyby.at(-1.0), flyby.at(10.0)});
  ASSERT_TRUE(before.has_value());
  EXPECT_EQ(before->end, flyby.epoch);
  const auto after = body.gap_in({flyby.at(0.0), flyby.at(5941.0)});
  ASSERT_TRUE(after.has_value());
  EXPECT_EQ(after->begin, flyby.at(5940.0));
  EXPECT_EQ(body.at(Epoch::max()).position.m, body.at(flyby.at(5940.0)).position.m);
  EXPECT_EQ(body.at(Epoch::min()).position.m, body.at(flyby.epoch).position.m);
}

TEST(Ephemeris, NeverMixesTheRowsOfTwoSegments) {
  // A manoeuvre: the second segment stands still elsewhere.
  const std::string second =
      "META_START\nOBJECT_NAME = CAMERA\nCENTER_NAME = EARTH\nREF_FRAME = ICRF\n"
      "TIME_SYSTEM = UTC\nSTART_TIME = 2022-01-01T02:00:00\nSTOP_TIME = 2022-01-01T03:00:00\n"
      "INTERPOLATION = LINEAR\nMETA_STOP\n2022-01-01T02:00:00 9000 0 0 0 0 0\n"
      "2022-01-01T03:00:00 9000 0 0 0 0 0\n";
  const Flyby flyby;
  const EphemerisPropagator body(read_oem(KvnLines::from_text(camera_file({}) + second, "x.oem")));
  EXPECT_LT(
      (body.at(flyby.at(5939.0)).position.m - flyby.camera.at(flyby.at(5939.0)).position.m).norm(),
      1e-3);
  EXPECT_EQ(body.at(flyby.at(7200.0)).position.m.x(), 9e6);
  EXPECT_EQ(body.at(flyby.at(8000.0)).position.m.x(), 9e6);
  const auto gap = body.gap_in({flyby.at(0.0), flyby.at(8000.0)});
  ASSERT_TRUE(gap.has_value());
  EXPECT_EQ(gap->begin, flyby.at(5940.0));
  EXPECT_EQ(gap->end, flyby.at(7200.0));
  EXPECT_TRUE(std::isfinite(body.at(flyby.at(6500.0)).position.m.x()));
}

}  // namespace
}  // namespace engine
