#include "engine/scene/material.h"

#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "engine/core/constants.h"
#include "engine/core/contract.h"
#include "tests/support/surfaces.h"
#include "tests/support/temp_file.h"

namespace engine {
namespace {

using test_support::brdf_of;
using test_support::TempFile;
using test_support::tilted;
using Variant = Brdf::Variant;

TEST(ReadMaterials, TakesEveryTableBelowMaterials) {
  const ConfigReader config = ConfigReader::from_text(
      "[brdf]\nvariant = \"paper\"\n[materials.b]\nkd = 0.1\n[materials.a]\nkd = 0.047\nkb = "
      "15.42\n"
      "ar = 0.557\nbr = -261.6\nkr = 0.717\n",
      "x.toml");
  const std::vector<Material> materials = read_materials(config);
  ASSERT_EQ(materials.size(), 2U);
  EXPECT_EQ(materials[0].name, "a");
  EXPECT_EQ(materials[1].name, "b");
  const Brdf& same = brdf_of("silicon", Variant::kPaper);
  EXPECT_EQ(materials[0].brdf().eval(tilted(20), tilted(-21)), same.eval(tilted(20), tilted(-21)));
  config.reject_unknown_keys();
}

TEST(ReadMaterials, RefusesWhatMakesLight) {
  for (const char* text : {"kd = 0.4", "kd = -0.1", "kd = 0.1\nkb = -1", "kd = 0.1\nkb = 1",
                           "kd = 0.1\nkb = 1\nar = 0.5\nbr = 1\nkr = 1"}) {
    const ConfigReader config = ConfigReader::from_text(std::string("[materials.m]\n") + text, "x");
    EXPECT_THROW(static_cast<void>(read_materials(config)), ConfigError) << text;
  }
}

/// A table of a Lambert surface of albedo .3.
std::string small_table() {
  std::string text = "theta_in_deg,in_plane_deg,out_of_plane_deg,brdf_per_sr\n";
  for (const char* in : {"0", "80"})
    for (const char* p : {"-90", "90"})
      for (const char* o : {"0", "90"})
        text += std::string(in) + "," + p + "," + o + ",0.0954929658551372\n";
  return text;
}

TEST(ReadMaterials, TakesAMeasuredTableInPlaceOfParameters) {
  const TempFile file("foil.csv", small_table());
  const ConfigReader config =
      ConfigReader::from_text("[materials.foil]\ntable = \"" + file.path() + "\"\n", "x.toml");
  const std::vector<Material> materials = read_materials(config);
  config.reject_unknown_keys();
  ASSERT_EQ(materials.size(), 1U);
  EXPECT_TRUE(materials[0].reciprocal);
  EXPECT_NEAR(materials[0].brdf().eval(tilted(30), tilted(50, 70)), 0.3 / kPi, 1e-12);
  EXPECT_TRUE(materials[0].alike(materials[0]));
  Material other = materials[0];
  other.table = nullptr;
  EXPECT_FALSE(materials[0].alike(other));
}

TEST(ReadMaterials, SaysWhereATableIsNamedAndWhatIsWrongInIt) {
  const TempFile file("foil.csv",
                      "theta_in_deg,in_plane_deg,out_of_plane_deg,brdf_per_sr\n0,0,0,-1\n");
  const std::string both = "[materials.foil]\ntable = \"" + file.path() + "\"\nkd = 0.1\n";
  try {
    static_cast<void>(read_materials(ConfigReader::from_text(both, "x.toml")));
    FAIL();
  } catch (const ConfigError& e) {
    EXPECT_EQ(std::string(e.what()), "x.toml:2: materials.foil.table: " + file.path() +
                                         ":2: brdf_per_sr must be >= 0 and <= 1000000000, got -1");
  }
  const TempFile good("foil.csv", small_table());
  const ConfigReader config = ConfigReader::from_text(
      "[materials.foil]\ntable = \"" + good.path() + "\"\nkd = 0.1\n", "x.toml");
  static_cast<void>(read_materials(config));
  EXPECT_THROW(config.reject_unknown_keys(), ConfigError);  // kd: of the parameters
}

}  // namespace
}  // namespace engine
