#include "engine/orbit/orbit_spec.h"

#include <cstdio>
#include <fstream>
#include <string>

#include <gtest/gtest.h>

#include "engine/core/contract.h"
#include "engine/orbit/j2.h"
#include "engine/orbit/kepler.h"
#include "engine/orbit/model_error.h"
#include "tests/support/scenes.h"

namespace engine {
namespace {

using test_support::Flyby;

const std::string kElements =
    "semi_major_axis_km = 7000\neccentricity = 0.01\ninclination_deg = 10\n"
    "argument_of_perigee_deg = 1\nraan_deg = 2\nmean_anomaly_deg = 3\n";

/// Half an hour on a straight line, from the scenario's epoch on.
std::string file_of_half_an_hour() {
  std::string path = testing::TempDir() + "/half_an_hour.oem";
  std::ofstream(path) << "CCSDS_OEM_VERS = 2.0\nMETA_START\nOBJECT_NAME = A\nCENTER_NAME = EARTH\n"
                         "REF_FRAME = GCRF\nTIME_SYSTEM = UTC\nSTART_TIME = 2022-01-01T00:00:00\n"
                         "STOP_TIME = 2022-01-01T00:30:00\nINTERPOLATION = LINEAR\nMETA_STOP\n"
                         "2022-01-01T00:00:00 7000 0 0 0 1 0\n"
                         "2022-01-01T00:30:00 7000 1800 0 0 1 0\n";
  return path;
}

OrbitSpec spec_of(const std::string& text) {
  const ConfigReader config = ConfigReader::from_text("[o]\n" + text, "x.toml");
  OrbitSpec spec = read_orbit(config.table("o"));
  config.reject_unknown_keys();
  return spec;
}

std::string complaint_of(const std::string& text) {
  try {
    static_cast<void>(spec_of(text));
  } catch (const ConfigError& e) {
    return e.what();
  }
  return "";
}

TEST(OrbitSpec, ChoosesTheModelByItsName) {
  const Flyby flyby;
  const EpochSpan span{flyby.epoch, flyby.at(3600.0)};
  const auto is = [&](const std::string& text, auto* kind) {
    const auto body = make_propagator(spec_of(text), flyby.epoch, span);
    return dynamic_cast<decltype(kind)>(body.get()) != nullptr;
  };
  EXPECT_TRUE(is(kElements, static_cast<const KeplerPropagator*>(nullptr)));
  EXPECT_TRUE(
      is(kElements + "propagator = \"two-body\"\n", static_cast<const KeplerPropagator*>(nullptr)));
  EXPECT_TRUE(is(kElements + "propagator = \"j2\"\n", static_cast<const J2Propagator*>(nullptr)));
  const std::string file =
      "propagator = \"ephemeris\"\nfile = \"" + file_of_half_an_hour() + "\"\n";
  EXPECT_TRUE(is(file, static_cast<const EphemerisPropagator*>(nullptr)));
  // Elements may wait beside it for the day that the file is not wanted.
  EXPECT_TRUE(is(file + kElements, static_cast<const EphemerisPropagator*>(nullptr)));
}

TEST(OrbitSpec, AllModelsBeginAtTheSameState) {
  const Flyby flyby;
  OrbitSpec spec;
  spec.elements = test_support::camera_orbit();
  for (const OrbitModel model : {OrbitModel::kTwoBody, OrbitModel::kJ2}) {
    spec.model = model;
    const auto body = make_propagator(spec, flyby.epoch, {flyby.at(100.0), flyby.at(200.0)});
    EXPECT_LT((body->at(flyby.epoch).position.m - flyby.camera.at(flyby.epoch).position.m).norm(),
              1e-8);
  }
}

TEST(OrbitSpec, RefusesWithTheKey) {
  EXPECT_EQ(complaint_of(kElements + "propagator = \"sgp4\"\n"),
            "x.toml:8: o.propagator must be one of \"two-body\", \"j2\", \"ephemeris\", got "
            "\"sgp4\"");
  EXPECT_EQ(complaint_of(kElements + "file = \"a.oem\"\n"),
            "x.toml:8: o.file needs propagator = \"ephemeris\"");
  EXPECT_EQ(complaint_of("propagator = \"ephemeris\"\n"),
            "x.toml: o.file is missing, expected text");
  EXPECT_EQ(complaint_of("propagator = \"ephemeris\"\nfile = \"/nowhere/a.oem\"\n"),
            "x.toml:3: o.file is no ephemeris: /nowhere/a.oem: expected a CCSDS file, found none "
            "to read");
  EXPECT_NE(complaint_of("propagator = \"j2\"\n"), "");
}

TEST(NeedSpan, IsAnErrorWhereAFileHasNothing) {
  const Flyby flyby;
  const OrbitSpec spec =
      spec_of("propagator = \"ephemeris\"\nfile = \"" + file_of_half_an_hour() + "\"\n");
  EXPECT_NO_THROW(need_span(spec, {flyby.epoch, flyby.at(1800.0)}));
  for (const auto& [begin_s, end_s] : {std::pair{-1e-9, 10.0}, std::pair{0.0, 1800.0 + 1e-9}}) {
    try {
      need_span(spec, {flyby.at(begin_s), flyby.at(end_s)});
      ADD_FAILURE() << begin_s;
    } catch (const ConfigError& e) {
      EXPECT_NE(std::string(e.what()).find("x.toml:3: o.file must have the body from"),
                std::string::npos)
          << e.what();
    }
  }
}

TEST(NeedSpan, LetsTwoBodyMotionGoOnAndBoundsIntegrations) {
  const Flyby flyby;
  const EpochSpan centuries{flyby.epoch, flyby.at(6e9)};
  EXPECT_NO_THROW(need_span(spec_of(kElements), centuries));
  EXPECT_THROW(need_span(spec_of(kElements + "propagator = \"j2\"\n"), centuries), ConfigError);
}

TEST(ModelError, OfTwoBodyMotionIsItsDistanceToTheOblateEarths) {
  const Flyby flyby;
  OrbitSpec spec;
  spec.elements = test_support::camera_orbit();
  const ModelError error(spec, flyby.epoch, flyby.at(15 * 86400.0));
  EXPECT_EQ(error.at_m(flyby.epoch), 0.0);
  // As the table of J2Propagator's test has it.
  EXPECT_NEAR(error.at_m(flyby.at(600.0)), 1.56e3, 5.0);
  EXPECT_NEAR(error.at_m(flyby.at(86400.0)), 488e3, 500.0);
  // Nothing of it lies across itself.
  const Epoch t = flyby.at(600.0);
  const auto oblate = std::make_unique<J2Propagator>(flyby.camera.at(flyby.epoch), flyby.epoch,
                                                     EpochSpan{flyby.epoch, t});
  const Eigen::Vector3d off_m = oblate->at(t).position.m - flyby.camera.at(t).position.m;
  EXPECT_LT(error.across_m(t, direction_of<J2000>(off_m)), 1e-3);
  EXPECT_NEAR(error.across_m(t, direction_of<J2000>(off_m.unitOrthogonal())), off_m.norm(), 1e-3);
}

TEST(ModelError, OfJ2IsOfTheOrderOfZonalsAndDrag) {
  // Two independent integrations of the paper's orbits, camera and target, added: km.
  const Flyby flyby;
  OrbitSpec spec;
  spec.model = OrbitModel::kJ2;
  const ModelError error(spec, flyby.epoch, flyby.at(15 * 86400.0));
  EXPECT_NEAR(1e-3 * error.at_m(flyby.at(600.0)), 0.005, 0.005);
  EXPECT_NEAR(1e-3 * error.at_m(flyby.at(86400.0)), 7.6 + 1.4, 1.0);
  EXPECT_NEAR(1e-3 * error.at_m(flyby.at(3 * 86400.0)), 69.0 + 6.0, 3.0);
  EXPECT_NEAR(1e-3 * error.at_m(flyby.at(15 * 86400.0)), 1730.0 + 28.0, 30.0);
}

}  // namespace
}  // namespace engine
