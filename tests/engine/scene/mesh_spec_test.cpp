#include "engine/scene/mesh_spec.h"

#include <algorithm>
#include <fstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "engine/core/contract.h"
#include "tests/support/obj_text.h"
#include "tests/support/temp_file.h"

namespace engine {
namespace {

using Eigen::Vector3d;
using test_support::TempFile;

MeshSpec spec_of(const std::string& target) {
  const ConfigReader config = ConfigReader::from_text("[target]\n" + target, "x.toml");
  MeshSpec spec = read_mesh_spec(config, "target");
  config.reject_unknown_keys();
  return spec;
}

std::string complaint_of(const std::string& target) {
  try {
    static_cast<void>(spec_of(target));
  } catch (const ConfigError& e) {
    return e.what();
  }
  return {};
}

/// 3 x 2 x 1 in its own units, along its own x, y, z, from its origin.
const std::string kBrick =
    "v 0 0 0\nv 3 0 0\nv 3 2 0\nv 0 2 0\nv 0 0 1\nv 3 0 1\nv 3 2 1\nv 0 2 1\n" +
    std::string(test_support::kCubeFaces);

MeshReport report_of(const std::string& keys, const std::string& obj = kBrick) {
  const TempFile file("brick.obj", obj);
  MeshReport report;
  static_cast<void>(load_mesh(spec_of("mesh = \"" + file.path() + "\"\n" + keys), report));
  return report;
}

TEST(MeshSpec, IsTheTelescopeInMetresUnlessItSaysOtherwise) {
  const MeshSpec spec = spec_of("");
  EXPECT_EQ(spec.name, "telescope");
  EXPECT_EQ(spec.axes, Eigen::Matrix3f::Identity());
  MeshReport report;
  const GroupedMesh grouped = load_mesh(spec, report);
  EXPECT_EQ(grouped.group.size(), grouped.mesh.triangles.size());
  EXPECT_TRUE(report.warnings.empty());
}

TEST(MeshSpec, TakesTheUnitsOfTheFile) {
  EXPECT_NEAR(report_of("units = \"cm\"").volume_m3, 6e-6, 1e-12);
  EXPECT_NEAR(report_of("units = \"in\"").high_m.x(), 3 * 0.0254, 1e-8);
  EXPECT_NEAR(report_of("units = \"ft\"").high_m.y(), 2 * 0.3048, 1e-7);
  EXPECT_NEAR(report_of("units = \"km\"").high_m.z(), 1000.0, 1e-4);
  EXPECT_EQ(
      complaint_of("mesh = \"a.obj\"\nunits = \"yd\"\n"),
      "x.toml:3: target.units must be one of \"m\", \"cm\", \"mm\", \"km\", \"in\", \"ft\", got "
      "\"yd\"");
}

TEST(MeshSpec, TurnsTheFilesAxesToTheBodys) {
  // Body x is the file's z, y its -x, z its -y: a brick from 0 to (3, 2, 1).
  const MeshReport turned = report_of("axes = \"z -x -y\"");
  EXPECT_EQ(turned.low_m, Vector3d(0, -3, -2));
  EXPECT_EQ(turned.high_m, Vector3d(1, 0, 0));
  // It is still the right way out.
  EXPECT_EQ(turned.flipped.count, 0U);
  EXPECT_DOUBLE_EQ(turned.volume_m3, 6.0);
  EXPECT_EQ(report_of("axes = \"+x +y +z\"").high_m, Vector3d(3, 2, 1));
}

TEST(MeshSpec, TakesTheTwentyFourTurnsAndNoMirror) {
  std::vector<char> letters{'x', 'y', 'z'};
  int turns = 0;
  int mirrors = 0;
  do {
    for (int signs = 0; signs < 8; ++signs) {
      std::string text;
      for (int i = 0; i < 3; ++i) {
        if (i > 0) text += " ";
        if ((signs & (1 << i)) != 0) text += "-";
        text += letters[static_cast<std::size_t>(i)];
      }
      const std::string what = complaint_of("mesh = \"a.obj\"\naxes = \"" + text + "\"\n");
      what.empty() ? ++turns : ++mirrors;
      if (!what.empty()) {
        EXPECT_EQ(what, "x.toml:3: target.axes must be a turn, got \"" + text +
                            "\", which mirrors the body: change one sign, or swap two axes");
      }
    }
  } while (std::next_permutation(letters.begin(), letters.end()));
  EXPECT_EQ(turns, 24);
  EXPECT_EQ(mirrors, 24);
}

TEST(MeshSpec, RefusesAxesThatAreNone) {
  for (const char* text : {"", "x y", "x y z x", "x x z", "x y w", "xyz", "- y z", "--x y z"})
    EXPECT_TRUE(complaint_of("mesh = \"a.obj\"\naxes = \"" + std::string(text) + "\"\n")
                    .starts_with("x.toml:3: target.axes must be three axes of the file"))
        << text;
}

TEST(MeshSpec, RefusesUnitsAndAxesOfABuiltInMesh) {
  EXPECT_EQ(
      complaint_of("units = \"mm\"\n"),
      "x.toml:2: target.units is for a mesh from a file: \"telescope\" is in metres, body axes");
  EXPECT_FALSE(complaint_of("mesh = \"telescope\"\naxes = \"x y z\"\n").empty());
}

TEST(MeshSpec, WarnsOfASizeThatNoSpacecraftHas) {
  EXPECT_TRUE(report_of("").warnings.empty());
  const MeshReport small = report_of("units = \"mm\"");
  ASSERT_EQ(small.warnings.size(), 1U);
  EXPECT_EQ(small.warnings[0],
            "the body is 0.003 m long, which no spacecraft is; with units = \"m\" it would be 3 m, "
            "with \"in\" it would be 0.0762 m, with \"ft\" it would be 0.914 m");
  const MeshReport large = report_of("units = \"km\"");
  ASSERT_EQ(large.warnings.size(), 1U);
  EXPECT_TRUE(large.warnings[0].starts_with("the body is 3e+03 m long")) << large.warnings[0];
}

TEST(MeshSpec, WarnsOfAnOriginFarFromTheBody) {
  std::string far = kBrick;
  for (std::size_t at = 0; (at = far.find("v 0", at)) != std::string::npos; at += 3)
    far.replace(at, 3, "v 500");
  for (std::size_t at = 0; (at = far.find("v 3", at)) != std::string::npos; at += 3)
    far.replace(at, 3, "v 503");
  const MeshReport report = report_of("", far);
  ASSERT_EQ(report.warnings.size(), 1U);
  EXPECT_TRUE(report.warnings[0].starts_with("the body's middle is 50")) << report.warnings[0];
}

TEST(MeshSpec, SaysWhereTheMeshIsNamedThatCannotBeRead) {
  MeshReport report;
  try {
    static_cast<void>(load_mesh(spec_of("mesh = \"/nowhere/a.obj\"\n"), report));
    FAIL();
  } catch (const ConfigError& e) {
    EXPECT_STREQ(e.what(),
                 "x.toml:2: target.mesh: /nowhere/a.obj: expected an OBJ mesh, found no file to "
                 "read");
  }
  EXPECT_THROW(static_cast<void>(report_of("", "v 0 0 0\nf 1 1 1\n")), ConfigError);
}

class MeshMaterials : public ::testing::Test {
 protected:
  /// The names that a mesh of these gets in a scenario of silicon and polyimide.
  static std::vector<std::string> given(const std::vector<std::string>& names,
                                        const std::string& keys) {
    Mesh mesh;
    mesh.material_names = names;
    give_materials(mesh, spec_of("mesh = \"a.obj\"\n" + keys),
                   {{"silicon", {}}, {"polyimide", {}}});
    return mesh.material_names;
  }
  static std::string complaint(const std::vector<std::string>& names, const std::string& keys) {
    try {
      static_cast<void>(given(names, keys));
    } catch (const ConfigError& e) {
      return e.what();
    }
    return {};
  }
  using Names = std::vector<std::string>;
};

TEST_F(MeshMaterials, AreTheScenariosByNameByTableOrByDefault) {
  EXPECT_EQ(given({"silicon", "polyimide"}, ""), (Names{"silicon", "polyimide"}));
  EXPECT_EQ(given({"Gold Foil", "Foil.001", "silicon", "?"},
                  "default_material = \"silicon\"\n[target.materials]\n\"Gold Foil\" = "
                  "\"polyimide\"\n\"Foil.001\" = \"polyimide\"\n"),
            (Names{"polyimide", "polyimide", "silicon", "silicon"}));
  // Two names may change places.
  EXPECT_EQ(given({"silicon", "polyimide"},
                  "[target.materials]\nsilicon = \"polyimide\"\npolyimide = \"silicon\"\n"),
            (Names{"polyimide", "silicon"}));
}

TEST_F(MeshMaterials, AreNamedInComplaints) {
  EXPECT_EQ(complaint({"Glass", "silicon"}, ""),
            "x.toml:2: target.mesh has the materials \"Glass\", \"silicon\", the scenario has "
            "\"silicon\", \"polyimide\": nothing says what \"Glass\" is. Name one in "
            "[target.materials], or set target.default_material");
  EXPECT_EQ(complaint({"a"}, "[target.materials]\na = \"gold\"\n"),
            "x.toml:4: target.materials.a must be one of the scenario's materials, \"silicon\", "
            "\"polyimide\", got \"gold\"");
  EXPECT_EQ(complaint({"a"}, "[target.materials]\nb = \"silicon\"\n"),
            "x.toml:4: target.materials.b is for a material that the mesh does not have: it has "
            "\"a\"");
  EXPECT_EQ(complaint({"a"}, "default_material = \"gold\"\n"),
            "x.toml:3: target.default_material must be one of the scenario's materials, "
            "\"silicon\", \"polyimide\", got \"gold\"");
  EXPECT_EQ(complaint({"a"}, "[target.materials]\n\"a.b\" = 3\n"),
            "x.toml:4: target.materials.a.b must be text, got 3");
}

}  // namespace
}  // namespace engine
