// What `starloop materials` and `starloop fit-brdf` write, and what runs say of materials.

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <starloop_test_paths.h>

#include "tests/support/goniometer.h"
#include "tests/support/surfaces.h"
#include "tests/tools/program.h"

namespace {

namespace fs = std::filesystem;
using program::Outcome;
using program::starloop;

const std::string kFlyby = STARLOOP_SOURCE_DIR "/config/flyby.toml";

/// Silicon's points within the plane of incidence, each off by the same few percent every time.
std::string write_points(const fs::path& path, double share) {
  std::ofstream csv(path);
  csv << "theta_in_deg,in_plane_deg,out_of_plane_deg,brdf_per_sr\n";
  const engine::Brdf& silicon = test_support::brdf_of("silicon", engine::Brdf::Variant::kPhysical);
  int i = 0;
  for (const double theta : {10.0, 30.0, 50.0, 70.0})
    for (const double off :
         {-60.0, -30.0, -10.0, -5.0, -3.0, -2.0, -1.0, -0.4, 0.3, 0.8, 1.5, 2.5, 4.0, 8.0}) {
      engine::BrdfPoint p{0, theta, theta + off, 0.0};
      const double f = silicon.eval(engine::incident_direction(p),
                                    engine::scatter_direction(engine::ScatterAngles::kPlanes, p));
      csv << theta << ',' << theta + off << ",0," << f * (1.0 + share * ((++i * 7 % 11) - 5))
          << '\n';
    }
  return path.string();
}

/// Where there is matplotlib: a script that breaks says "no picture" as well.
void expect_drawn(const fs::path& picture) {
  static const bool can_draw = std::system("/usr/bin/python3 -c 'import matplotlib' 2>&1") == 0;
  if (!can_draw) return;
  ASSERT_TRUE(fs::exists(picture)) << picture;
  EXPECT_GT(fs::file_size(picture), 10'000U) << picture;
}

/// The flyby with another material in place of its silicon.
std::string flyby_with(const fs::path& scenario, const std::string& material) {
  std::string text = program::content_of(kFlyby);
  const std::size_t begin = text.find("[materials.silicon]");
  const std::size_t end = text.find("[materials.polyimide]");
  EXPECT_LT(begin, end);
  text.replace(begin, end - begin, material);
  std::ofstream(scenario) << text;
  return scenario.string();
}

TEST(Materials, AreDescribedAndDrawn) {
  const program::TemporaryFolder folder;
  const fs::path out = folder.path() / "m";
  const Outcome run = starloop({"materials", kFlyby, "-o", out.string()});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_NE(run.out.find("silicon: eq 7, physical"), std::string::npos) << run.out;
  EXPECT_NE(run.out.find("albedo above 1 as printed: from 81.5 deg on"), std::string::npos)
      << run.out;
  EXPECT_NE(run.out.find("black: Lambert"), std::string::npos);
  const std::string table = program::content_of(out / "albedo.csv");
  EXPECT_TRUE(table.starts_with("material,theta_in_deg,albedo,as_it_came\n"));
  EXPECT_NE(table.find("\nblack,0,0.0300"), std::string::npos) << table.substr(0, 500);
  expect_drawn(out / "materials.png");
}

TEST(FitBrdf, WritesABlockThatAScenarioTakes) {
  const program::TemporaryFolder folder;
  const std::string points = write_points(folder.path() / "points.csv", 0.005);
  const fs::path out = folder.path() / "fit";
  const Outcome fit = starloop({"fit-brdf", points, "-o", out.string(), "--name", "silicon"});
  ASSERT_EQ(fit.exit_code, 0) << fit.err;
  EXPECT_NE(fit.out.find("56 points"), std::string::npos) << fit.out;
  EXPECT_NE(fit.out.find("ar and br go together"), std::string::npos) << fit.out;
  expect_drawn(out / "fit.png");
  // The flyby without its silicon, and with this one.
  const std::string scenario =
      flyby_with(folder.path() / "fitted.toml", program::content_of(out / "material.toml"));
  const Outcome shown = starloop({"materials", scenario});
  EXPECT_EQ(shown.exit_code, 0) << shown.err;
  EXPECT_NE(shown.out.find("silicon: eq 7, physical"), std::string::npos) << shown.out;
}

TEST(FitBrdf, QuotesANameThatScenariosAndTheirTablesTake) {
  const program::TemporaryFolder folder;
  const std::string points = write_points(folder.path() / "points.csv", 0.005);
  const Outcome fit = starloop({"fit-brdf", points, "-q", "--name", "gold \"foil\", a"});
  ASSERT_EQ(fit.exit_code, 0) << fit.err;
  EXPECT_EQ(fit.out.find("[materials.\"gold \\\"foil\\\", a\"]"), 0U) << fit.out;
  // Beside the flyby's own, which its mesh names.
  const std::string scenario =
      flyby_with(folder.path() / "named.toml", fit.out + "[materials.silicon]\nkd = 0.1\n");
  const fs::path out = folder.path() / "m";
  const Outcome shown = starloop({"materials", scenario, "-o", out.string()});
  ASSERT_EQ(shown.exit_code, 0) << shown.err;
  EXPECT_NE(program::content_of(out / "albedo.csv").find("\n\"gold \"\"foil\"\", a\",0,"),
            std::string::npos);
  expect_drawn(out / "materials.png");
  EXPECT_EQ(starloop({"fit-brdf", points, "--name", "gold foil.a"}).exit_code, 2);
}

TEST(FitBrdf, SaysWhatAScenarioWouldRefuse) {
  const program::TemporaryFolder folder;
  const std::string points = write_points(folder.path() / "points.csv", 0.005);
  const Outcome fit = starloop({"fit-brdf", points, "--fix", "kd=0.4", "--fix", "br=-2e6", "-q"});
  EXPECT_NE(fit.out.find("# held; a scenario refuses it: above 1/pi"), std::string::npos)
      << fit.out;
  EXPECT_NE(fit.out.find("# held; a scenario refuses it: below -1e6"), std::string::npos);
  // Six digits of 1/pi are above it.
  const Outcome whole = starloop({"fit-brdf", points, "--fix", "kd=0.31830988", "-q"});
  EXPECT_NE(whole.out.find("kd = 0.31830988"), std::string::npos) << whole.out;
}

TEST(FitBrdf, StatedSigmasSayHowGoodAFitIs) {
  // Readings of nothing but noise are off by more than all of the model, and right for all that.
  const program::TemporaryFolder folder;
  const fs::path path = folder.path() / "points.csv";
  static_cast<void>(write_points(path, 0.0));
  std::istringstream plain(program::content_of(path));
  std::ofstream csv(path);
  std::string line;
  std::getline(plain, line);
  csv << line << ",sigma_per_sr\n";
  while (std::getline(plain, line)) csv << line << ",10\n";
  csv.close();
  const Outcome fit = starloop({"fit-brdf", path.string()});
  EXPECT_NE(fit.out.find("56 points, chi squared"), std::string::npos) << fit.out;
  EXPECT_LT(fit.out.find("chi squared"), fit.out.find("% rms"));
}

TEST(FitBrdf, ComplainsAndHoldsWhatItIsTold) {
  const program::TemporaryFolder folder;
  const std::string points = write_points(folder.path() / "points.csv", 0.005);
  const Outcome held = starloop({"fit-brdf", points, "--fix", "kr=0.7", "-q"});
  EXPECT_EQ(held.exit_code, 0) << held.err;
  EXPECT_NE(held.out.find("kr = 0.7         # held"), std::string::npos) << held.out;
  const std::vector<std::vector<std::string>> wrong{
      {"fit-brdf", points, "--fix", "kz=1"},
      {"fit-brdf", points, "--fix", "br=1"},
      {"fit-brdf", points, "--fix", "kd="},
      {"fit-brdf", (folder.path() / "none.csv").string()},
      {"fit-brdf", kFlyby}};
  for (const std::vector<std::string>& arguments : wrong) {
    const Outcome run = starloop(arguments);
    EXPECT_EQ(run.exit_code, 2) << arguments.back();
    EXPECT_NE(run.err.find("starloop: "), std::string::npos) << run.err;
  }
}

}  // namespace
