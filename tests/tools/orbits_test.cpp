// What `starloop orbits` writes, and what the other subcommands say of the models of motion.

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <starloop_test_paths.h>

#include "tests/tools/program.h"

namespace {

namespace fs = std::filesystem;
using program::Outcome;
using program::starloop;

const std::string kFlyby = STARLOOP_SOURCE_DIR "/config/flyby.toml";

/// Of each "body,model" the errors until a time, in the table's order.
std::map<std::string, std::vector<double>> errors_until(const fs::path& csv, double last_s) {
  std::istringstream lines(program::content_of(csv));
  std::map<std::string, std::vector<double>> errors;
  std::string line;
  std::getline(lines, line);
  EXPECT_EQ(line, "body,model,t_s,error_m");
  while (std::getline(lines, line)) {
    const std::size_t second = line.find(',', line.find(',') + 1);
    std::size_t used = 0;
    const double t_s = std::stod(line.substr(second + 1), &used);
    std::vector<double>& all = errors[line.substr(0, second)];
    if (t_s <= last_s) all.push_back(std::stod(line.substr(second + used + 2)));
  }
  return errors;
}

double worst(const std::vector<double>& errors) {
  return *std::max_element(errors.begin(), errors.end());
}

TEST(Orbits, TwoBodyMotionIsTheReferencesWithinTheModelsRequirement) {
  const program::TemporaryFolder folder;
  const Outcome run = starloop({"orbits", kFlyby, "--reference",
                                STARLOOP_SOURCE_DIR "/tests/data/orbits_reference.csv", "-o",
                                (folder.path() / "o").string()});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const fs::path csv = folder.path() / "o" / "orbits.csv";
  const auto day = errors_until(csv, 86400.0);
  const auto all = errors_until(csv, 1e9);
  for (const std::string body : {"camera", "target"}) {
    EXPECT_LT(worst(day.at(body + ",two-body")), 1e-5);
    EXPECT_LT(worst(all.at(body + ",two-body")), 1e-4);
    EXPECT_GT(worst(all.at(body + ",j2")), 1e6);
  }
  EXPECT_TRUE(fs::exists(folder.path() / "o" / "orbits.png") ||
              run.out.find("no picture") != std::string::npos);
}

TEST(Orbits, WithoutAReferenceTheModelsAreComparedWithTheScenarios) {
  const program::TemporaryFolder folder;
  const Outcome run = starloop({"orbits", kFlyby, "--set", "orbit.camera.propagator=j2", "--set",
                                "visibility.span_days=3", "-o", folder.path().string()});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const auto errors = errors_until(folder.path() / "orbits.csv", 1e9);
  ASSERT_EQ(errors.size(), 2U);
  // Computed independently for this project, after three days.
  EXPECT_NEAR(errors.at("camera,two-body").back(), 1497e3, 500.0);
  EXPECT_NEAR(errors.at("target,j2").back(), 837e3, 500.0);
}

TEST(Orbits, ABadReferenceIsRefusedWithItsLine) {
  const program::TemporaryFolder folder;
  const fs::path table = folder.path() / "r.csv";
  const auto said = [&](const std::string& text) {
    std::ofstream(table) << text;
    const Outcome run = starloop(
        {"orbits", kFlyby, "--reference", table.string(), "-o", (folder.path() / "o").string()});
    EXPECT_EQ(run.exit_code, 2) << run.out;
    return run.err;
  };
  const std::string names = "body,t_s,x_km,y_km,z_km\n";
  EXPECT_NE(said("").find(":1: expected a column body"), std::string::npos);
  EXPECT_NE(said("body,t_s,x_km,y_km\n").find("expected a column z_km"), std::string::npos);
  EXPECT_NE(said(names + "camera,0,1,2\n").find(":2: expected 5 cells"), std::string::npos);
  EXPECT_NE(said(names + "moon,0,1,2,3\n").find(":2: expected body to be"), std::string::npos);
  EXPECT_NE(said(names + "camera,0,1,2,nan\n").find(":2: expected a number"), std::string::npos);
  EXPECT_NE(said(names + "camera,-1,1,2,3\n").find(":2: expected a time"), std::string::npos);
  EXPECT_NE(said(names + "camera,1e8,1,2,3\n").find(":2: expected a time"), std::string::npos);
}

TEST(OrbitNotes, SayWhatTheModelsLeaveOut) {
  const Outcome two_body = starloop({"passes", kFlyby});
  EXPECT_NE(two_body.out.find("camera: two-body motion, "), std::string::npos) << two_body.out;
  EXPECT_NE(two_body.out.find("7186 km at the end: the Earth's oblateness"), std::string::npos)
      << two_body.out;
  EXPECT_NE(two_body.out.find("2899 km at the end"), std::string::npos) << two_body.out;
  const Outcome j2 = starloop({"passes", kFlyby, "--set", "orbit.camera.propagator=j2"});
  EXPECT_NE(j2.out.find("camera: j2 motion"), std::string::npos) << j2.out;
}

TEST(OrbitNotes, WarnWhenTheTableOfLeapSecondsIsTooOld) {
  EXPECT_EQ(starloop({"passes", kFlyby}).err, "");
  const Outcome late = starloop({"passes", kFlyby, "--set", "scenario.epoch=2100-01-01T00:00:00",
                                 "--set", "visibility.span_days=0.01"});
  EXPECT_NE(late.err.find("table of leap seconds"), std::string::npos) << late.err;
}

}  // namespace
