#include "engine/orbit/elements.h"

#include <algorithm>
#include <cmath>
#include <string>

#include <gtest/gtest.h>

#include "engine/orbit/kepler.h"
#include "tests/support/scenes.h"

namespace engine {
namespace {

using Eigen::Vector3d;

OrbitState state_of(const KeplerElements& elements, double t_s = 0.0) {
  return KeplerPropagator(elements, Epoch{}).at(Epoch{from_seconds(t_s)});
}

/// The requirement: a micrometre and a nanometre per second; of a long axis, nine roundings.
void expect_comes_back(const OrbitState& state) {
  const auto found = elements_of(state);
  ASSERT_TRUE(found.has_value());
  for (const double x : {found->semi_major_axis_m, found->eccentricity, found->inclination_rad,
                         found->argument_of_perigee_rad, found->raan_rad, found->mean_anomaly_rad})
    ASSERT_TRUE(std::isfinite(x));
  const OrbitState back = state_of(*found);
  const double limit_m = std::max(
      1e-6, 9.0 * 0x1p-53 * std::max(state.position.m.norm(), std::abs(found->semi_major_axis_m)));
  EXPECT_LT((back.position.m - state.position.m).norm(), limit_m);
  EXPECT_LT((back.velocity.m_s - state.velocity.m_s).norm(), 1e-9);
}

TEST(ElementsOf, GiveTheStateBackFromCirclesToHyperbolasInAnyPlane) {
  for (const double e : {0.0, 1e-16, 1e-12, 1e-8, 0.01, 0.5, 0.9, 0.999, 1.001, 1.5, 5.0}) {
    for (const double i_deg : {0.0, 1e-12, 1e-6, 51.6, 90.0, 179.9999999, 180.0 - 1e-12, 180.0}) {
      for (const double m : {-3.0, -0.4, 0.0, 1e-9, 2.0, kPi}) {
        SCOPED_TRACE(testing::Message() << "e " << e << " i " << i_deg << " M " << m);
        expect_comes_back(state_of(
            {7e6 / (1.0 - e), e, i_deg * kDegree, 1.0, 2.0, e < 1.0 ? m : m * std::abs(e - 1.0)}));
      }
    }
  }
}

TEST(ElementsOf, AreThoseThatMadeTheState) {
  const KeplerElements made = test_support::camera_orbit();
  const auto found = elements_of(state_of(made));
  ASSERT_TRUE(found.has_value());
  EXPECT_NEAR(found->semi_major_axis_m, made.semi_major_axis_m, 1e-7);
  EXPECT_NEAR(found->eccentricity, made.eccentricity, 1e-14);
  EXPECT_NEAR(found->inclination_rad, made.inclination_rad, 1e-14);
  const auto off = [](double a, double b) { return std::remainder(a - b, 2.0 * kPi); };
  EXPECT_NEAR(off(found->raan_rad, made.raan_rad), 0.0, 1e-14);
  // The perigee of so round an orbit is known to rounding / e.
  EXPECT_NEAR(off(found->argument_of_perigee_rad, made.argument_of_perigee_rad), 0.0, 1e-12);
  EXPECT_NEAR(off(found->mean_anomaly_rad, made.mean_anomaly_rad), 0.0, 1e-12);
}

TEST(ElementsOf, MoveAsTheStateDoesALongTimeAfter) {
  // States with angles that mean nothing: there a wrong split shows as a wrong speed of the angle.
  for (const double e : {0.0, 1e-12, 0.3}) {
    for (const double i : {0.0, kPi}) {
      const KeplerElements made{7e6 / (1.0 - e), e, i, 1.0, 2.0, 0.5};
      const auto found = elements_of(state_of(made));
      ASSERT_TRUE(found.has_value());
      // Ten periods: roundings of the axis, times 1.5 * 63 rad.
      EXPECT_LT((state_of(*found, 6e4).position.m - state_of(made, 6e4).position.m).norm(), 1e-5);
    }
  }
}

TEST(ElementsOf, HasNoneForWhatIsNoConicWithAPlane) {
  const auto none = [](const Vector3d& r, const Vector3d& v) {
    return !elements_of({{r}, {v}}).has_value();
  };
  const Vector3d x(7e6, 0.0, 0.0);
  const double escape = std::sqrt(2.0 * kEarthMu_m3_s2 / 7e6);
  const double inf = HUGE_VAL;
  EXPECT_TRUE(none({0, 0, 0}, {0, 7e3, 0}));           // at the Earth's centre
  EXPECT_TRUE(none(x, {0, 0, 0}));                     // dropped
  EXPECT_TRUE(none(x, {5e3, 0, 0}));                   // straight up
  EXPECT_TRUE(none(x, {-5e3, 1e-7, 0}));               // all but straight down
  EXPECT_TRUE(none(x, {0, escape, 0}));                // a parabola
  EXPECT_TRUE(none(x, {0, escape * (1 + 1e-9), 0}));   // nearly one
  EXPECT_FALSE(none(x, {0, escape * (1 + 1e-7), 0}));  // 1 mm/s more
  EXPECT_TRUE(none({std::nan(""), 0, 0}, {0, 7e3, 0}));
  EXPECT_TRUE(none(x, {0, inf, 0}));
  EXPECT_TRUE(none({inf, 0, 0}, {0, 7e3, 0}));
  EXPECT_TRUE(none({1e200, 0, 0}, {0, 1e200, 0}));
}

ConfigReader orbit_text(const std::string& changed) {
  return ConfigReader::from_text(
      "[o]\nsemi_major_axis_km = 7000\neccentricity = 0.01\ninclination_deg = 10\n"
      "argument_of_perigee_deg = 1\nraan_deg = 2\nmean_anomaly_deg = 3\n" +
          changed,
      "x.toml");
}

ConfigReader state_text() {
  return ConfigReader::from_text("[o]\nposition_km = [7000, 0, 0.0]\nvelocity_km_s = [0, 5, 6.0]\n",
                                 "x.toml");
}

TEST(ReadElements, TakesDegreesAndKilometres) {
  const ConfigReader config = orbit_text("");
  const KeplerElements read = read_elements(config.table("o"));
  EXPECT_DOUBLE_EQ(read.semi_major_axis_m, 7e6);
  EXPECT_DOUBLE_EQ(read.inclination_rad, 10.0 * kDegree);
  EXPECT_DOUBLE_EQ(read.mean_anomaly_rad, 3.0 * kDegree);
}

TEST(ReadElements, TakesAHyperbolaWithItsNegativeAxis) {
  ConfigReader config = orbit_text("");
  config.set("o.semi_major_axis_km=-20000");
  config.set("o.eccentricity=1.4");
  config.set("o.mean_anomaly_deg=-4000");
  const KeplerElements read = read_elements(config.table("o"));
  EXPECT_DOUBLE_EQ(read.semi_major_axis_m, -2e7);
  EXPECT_DOUBLE_EQ(read.perigee_m(), 8e6);
  EXPECT_DOUBLE_EQ(read.mean_anomaly_rad, -4000.0 * kDegree);
}

TEST(ReadElements, TakesAStateInTheirPlace) {
  const ConfigReader config = state_text();
  const OrbitState state = state_of(read_elements(config.table("o")));
  config.reject_unknown_keys();
  EXPECT_LT((state.position.m - Vector3d(7e6, 0.0, 0.0)).norm(), 1e-6);
  EXPECT_LT((state.velocity.m_s - Vector3d(0.0, 5e3, 6e3)).norm(), 1e-9);
}

/// The complaint about one bad value names the key.
void expect_refused(ConfigReader config, const std::string& assignment, const std::string& key) {
  config.set(assignment);
  try {
    static_cast<void>(read_elements(config.table("o")));
    ADD_FAILURE() << assignment << " was taken";
  } catch (const ConfigError& e) {
    EXPECT_NE(std::string(e.what()).find("o." + key + " "), std::string::npos) << e.what();
  }
}

TEST(ReadElements, RefusesWhatIsNoOrbitAboutTheEarthAndNamesTheKey) {
  const auto refuses = [](const std::string& assignment, const std::string& key) {
    expect_refused(orbit_text(""), "o." + assignment, key);
  };
  refuses("eccentricity=1.0", "eccentricity");
  refuses("eccentricity=1.000000001", "eccentricity");
  refuses("eccentricity=-0.1", "eccentricity");
  refuses("eccentricity=nan", "eccentricity");
  refuses("eccentricity=inf", "eccentricity");
  refuses("eccentricity=0.5", "semi_major_axis_km");  // perigee inside the Earth
  refuses("eccentricity=1.4", "semi_major_axis_km");  // a hyperbola's axis is negative
  refuses("semi_major_axis_km=-7000", "semi_major_axis_km");
  refuses("semi_major_axis_km=0", "semi_major_axis_km");
  refuses("semi_major_axis_km=7", "semi_major_axis_km");  // thousands of kilometres
  refuses("semi_major_axis_km=7000000000000000000000e300", "semi_major_axis_km");
  refuses("semi_major_axis_km=nan", "semi_major_axis_km");
  refuses("semi_major_axis_km=[7000]", "semi_major_axis_km");
  refuses("inclination_deg=181", "inclination_deg");
  refuses("inclination_deg=-1", "inclination_deg");
  refuses("raan_deg=361", "raan_deg");
  refuses("argument_of_perigee_deg=1e9", "argument_of_perigee_deg");
  refuses("mean_anomaly_deg=400", "mean_anomaly_deg");  // an ellipse's is an angle
  refuses("mean_anomaly_deg=\"3\"", "mean_anomaly_deg");
  refuses("position_km=[7000,0,0]", "semi_major_axis_km");  // one or the other
}

TEST(ReadElements, RefusesAStateThatIsNoOrbitAndNamesTheKey) {
  const auto refuses = [](const std::string& assignment, const std::string& key) {
    expect_refused(state_text(), "o." + assignment, key);
  };
  refuses("position_km=[0,0,0]", "position_km");
  refuses("position_km=[7,0,0]", "position_km");  // thousands of kilometres
  refuses("position_km=[7000,0]", "position_km");
  refuses("position_km=[7000,0,nan]", "position_km");
  refuses("position_km=[7000,0,\"0\"]", "position_km");
  refuses("position_km=7000", "position_km");
  refuses("position_km=[1e300,0,0]", "position_km");
  refuses("velocity_km_s=[7000,0,0]", "velocity_km_s");  // metres per second
  refuses("velocity_km_s=[0,0,0]", "velocity_km_s");
  refuses("velocity_km_s=[9,0,0]", "velocity_km_s");  // straight up
  refuses("velocity_km_s=[0,3,0]", "velocity_km_s");  // perigee inside the Earth
  refuses("velocity_km_s=[0,10.671730905260,0]", "velocity_km_s");
  refuses("eccentricity=0.1", "eccentricity");
  ConfigReader half = ConfigReader::from_text("[o]\nposition_km = [7000, 0, 0]\n", "x.toml");
  expect_refused(std::move(half), "o.ignored=1", "velocity_km_s");
}

}  // namespace
}  // namespace engine
