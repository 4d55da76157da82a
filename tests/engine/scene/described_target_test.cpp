#include "engine/scene/described_target.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "engine/core/constants.h"
#include "engine/core/contract.h"
#include "engine/scene/built_in_targets.h"
#include "engine/scene/crinkle.h"
#include "engine/scene/mesh_repair.h"

namespace engine {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;

std::string complaint_of(const std::string& text) {
  try {
    static_cast<void>(described_target_text(text, "t.toml"));
  } catch (const ConfigError& e) {
    return e.what();
  }
  return "no complaint";
}

Vector3d corner(const Mesh& mesh, const Mesh::Triangle& t, std::size_t i) {
  return mesh.vertices[t.corner[i]].cast<double>();
}

Vector3d area_vector(const Mesh& mesh, const Mesh::Triangle& t) {
  return 0.5 *
         (corner(mesh, t, 1) - corner(mesh, t, 0)).cross(corner(mesh, t, 2) - corner(mesh, t, 0));
}

double volume_m3(const Mesh& mesh) {
  double sum = 0;
  for (const Mesh::Triangle& t : mesh.triangles)
    sum += corner(mesh, t, 0).dot(area_vector(mesh, t)) / 3.0;
  return sum;
}

Mesh part(const GroupedMesh& target, std::size_t group) {
  std::vector<bool> wanted(target.group_names.size(), false);
  wanted[group] = true;
  return target.part(wanted);
}

/// Edges that are not walked as often one way as the other; corners in one place are one.
std::size_t open_edges(const Mesh& mesh) {
  using Place = std::array<float, 3>;
  std::map<std::pair<Place, Place>, int> walked;
  const auto place = [&](std::uint32_t v) {
    const Vector3f& p = mesh.vertices[v];
    return Place{p.x() + 0.0F, p.y() + 0.0F, p.z() + 0.0F};
  };
  for (const Mesh::Triangle& t : mesh.triangles) {
    for (std::size_t i = 0; i < 3; ++i) {
      const Place a = place(t.corner[i]);
      const Place b = place(t.corner[(i + 1) % 3]);
      a < b ? ++walked[{a, b}] : --walked[{b, a}];
    }
  }
  return static_cast<std::size_t>(
      std::count_if(walked.begin(), walked.end(), [](const auto& e) { return e.second != 0; }));
}

TEST(DescribedTarget, HasClosedPartsWithOutsideOutsideInAllThatAreBuiltIn) {
  ASSERT_EQ(built_in_targets().size(), 5U);
  for (const std::string& name : built_in_targets()) {
    EXPECT_TRUE(is_described_target(name));
    std::vector<std::string> notes;
    const GroupedMesh target = described_target(name, &notes);
    EXPECT_EQ(notes, std::vector<std::string>{}) << name;
    EXPECT_EQ(target.group.size(), target.mesh.triangles.size());
    EXPECT_EQ(open_edges(target.mesh), 0U) << name;
    EXPECT_GT(volume_m3(target.mesh), 0.0) << name;
    EXPECT_LT(target.mesh.triangles.size(), 16000U) << name;
    for (const Mesh::Triangle& t : target.mesh.triangles)
      ASSERT_GT(area_vector(target.mesh, t).norm(), 0.0) << name;
    for (std::uint32_t g = 0; g < target.group_names.size(); ++g)
      EXPECT_FALSE(part(target, g).triangles.empty()) << name << " " << target.group_names[g];
  }
  EXPECT_FALSE(is_described_target("ship.obj"));
  EXPECT_TRUE(is_described_target("ship.toml"));
}

TEST(DescribedTarget, GivesAWingItsOwnGroup) {
  const GroupedMesh cubesat = described_target("cubesat");
  const std::vector<std::string> names = {"body", "wing_plus_y", "wing_minus_y"};
  EXPECT_EQ(cubesat.group_names, names);
  const Mesh plus = part(cubesat, 1);
  const Mesh minus = part(cubesat, 2);
  ASSERT_EQ(plus.triangles.size(), minus.triangles.size());
  for (const Vector3f& p : plus.vertices) EXPECT_GT(p.y(), 0.0F);
  for (const Vector3f& p : minus.vertices) EXPECT_LT(p.y(), 0.0F);
}

TEST(DescribedTarget, IsAsLargeAsItsShapesSay) {
  // A box, a prism of 72 sides, a frustum of as many: each an outline in closed form.
  const double ngon = 0.5 * 72.0 * std::sin(2.0 * kPi / 72.0);
  const auto volume = [](const std::string& part) {
    return volume_m3(described_target_text("[parts.a]\nmaterial = \"m\"\n" + part, "t").mesh);
  };
  EXPECT_NEAR(volume("shape = \"box\"\nsize_m = [1, 2, 3]"), 6.0, 1e-6);
  EXPECT_NEAR(volume("shape = \"cylinder\"\nradius_m = 0.5\nlength_m = 2"), 0.5 * ngon, 1e-6);
  EXPECT_NEAR(volume("shape = \"rod\"\nradius_m = 0.5\nfrom_m = [1, 1, 1]\nto_m = [1, 1, 3]\n"
                     "segments = 72"),
              0.5 * ngon, 1e-5);
  EXPECT_NEAR(volume("shape = \"cone\"\nradii_m = [1, 0]\nlength_m = 3"), ngon, 1e-5);
  EXPECT_NEAR(volume("shape = \"band\"\nx_m = [0, 1]\nradius_m = [1, 2]"), 3.0 * ngon, 1e-5);
  EXPECT_NEAR(volume("shape = \"band\"\nx_m = [0, 1]\nradius_m = [1, 2]\nfacets = 18"), 0.75 * ngon,
              1e-5);
  EXPECT_NEAR(volume("shape = \"box\"\nsize_m = [1, 1, 1]\ngrid = [2, 3, 1]\npitch_m = [2, 2, 0]\n"
                     "at_m = [5, 0, 0]\nround_z_deg = [0, 90]\nturns = [\"x 30\", \"y 10\"]"),
              12.0, 1e-4);
}

TEST(DescribedTarget, PutsSolidsTogetherAndMeshesThem) {
  const GroupedMesh target = described_target_text(
      "[solids.block]\nshape = \"box\"\nsize_m = [2, 2, 2]\n"
      "[solids.bore]\nshape = \"cylinder\"\nradius_m = 0.5\nlength_m = 3\n"
      "[parts.nut]\nshape = \"difference\"\nmaterial = \"m\"\nof = [\"block\", \"bore\"]\n"
      "edge_m = 0.2\n",
      "t");
  EXPECT_EQ(open_edges(target.mesh), 0U);
  // The bore's facets take a little less than the circle: (h / R)^2 / 6 of it.
  EXPECT_NEAR(volume_m3(target.mesh), 8.0 - 0.5 * kPi, 0.5 * kPi * 0.16 / 6.0);
}

TEST(DescribedTarget, StandsInFramesWithinFrames) {
  const GroupedMesh target = described_target_text(
      "[frames.mast]\nat_m = [0.4, 0, 0]\n"
      "[frames.wing]\nframe = \"mast\"\nround_z_deg = [0, 180]\ngroups = [\"a\", \"b\"]\n"
      "[parts.panel]\nshape = \"box\"\nmaterial = \"m\"\nframe = \"wing\"\nsize_m = [1, 1, 1]\n"
      "at_m = [0, 5, 0]\n[parts.root]\nshape = \"box\"\nmaterial = \"m\"\nframe = \"wing\"\n"
      "group = \"body\"\nsize_m = [0.1, 0.1, 0.1]\n",
      "t");
  EXPECT_EQ(target.group_names, (std::vector<std::string>{"a", "b", "body"}));
  Vector3d middle_b = Vector3d::Zero();
  for (const Vector3f& p : part(target, 1).vertices) middle_b += p.cast<double>() / 8.0;
  EXPECT_NEAR((middle_b - Vector3d(0.4, -5.0, 0.0)).norm(), 0.0, 1e-6);
}

TEST(DescribedTarget, ComplainsWithTheLine) {
  const std::string box = "[parts.a]\nshape = \"box\"\nmaterial = \"m\"\n";
  EXPECT_EQ(complaint_of(""), "t.toml: expected [parts.NAME], found none");
  EXPECT_EQ(complaint_of("[parts.a]\nshape = \"cube\"\nmaterial = \"m\"\n").substr(0, 64),
            "t.toml:2: parts.a.shape must be one of \"box\", \"cylinder\", \"cone\"");
  EXPECT_EQ(
      complaint_of(box + "size_m = [1, 2, -3]"),
      "t.toml:4: parts.a.size_m must be a list of 3 numbers, each > 0 and <= 10000, got in it "
      "-3");
  EXPECT_EQ(complaint_of(box + "size_m = [1, 2, 3]\ncolour = \"red\""),
            "t.toml:5: parts.a.colour is not a key of a target's description");
  EXPECT_EQ(complaint_of(box + "size_m = [1, 2, 3]\nframe = \"wing\""),
            "t.toml:5: parts.a.frame must be the name of a frame above, got \"wing\"");
  EXPECT_EQ(complaint_of(box + "size_m = [1, 2, 3]\nturns = [\"w 90\"]"),
            "t.toml:5: parts.a.turns must be an axis and degrees, like \"x 90\", got \"w 90\"");
  EXPECT_EQ(complaint_of(box + "size_m = [1, 2, 3]\nturns = [\"x nan\"]").substr(0, 8), "t.toml:5");
  EXPECT_NE(
      complaint_of(box + "size_m = [1, 2, 3]\ngrid = [1000, 1000, 1000]\npitch_m = [1, 1, 1]"),
      "no complaint");
  EXPECT_NE(complaint_of("[parts.a]\nshape = \"revolved\"\nmaterial = \"m\"\noutline_m = [[0]]"),
            "no complaint");
  EXPECT_NE(complaint_of("[parts.a]\nshape = \"union\"\nmaterial = \"m\"\nof = [\"x\", \"y\"]\n"
                         "edge_m = 1"),
            "no complaint");
  EXPECT_NE(complaint_of("parts = 3"), "no complaint");
  EXPECT_NE(complaint_of("[parts.\"a.b\"]\nshape = \"box\""), "no complaint");
  EXPECT_NE(complaint_of("[parts.a"), "no complaint");
  EXPECT_THROW(static_cast<void>(described_target("no_such.toml")), ConfigError);
}

TEST(DescribedTarget, OfTheBuiltInOnesNoFaceIsLeftOut) {
  for (const std::string& name : built_in_targets()) {
    GroupedMesh grouped = described_target(name);
    MeshReport report;
    repair(grouped, {}, report);
    EXPECT_EQ(report.left_out(), 0U) << name;
    EXPECT_EQ(report.flipped.count, 0U) << name;
  }
}

TEST(DescribedTarget, SurvivesAnyTextCutShort) {
  const std::string text(built_in_target_text("plate"));
  for (std::size_t n = 0; n <= text.size(); n += 7) {
    try {
      EXPECT_FALSE(described_target_text(text.substr(0, n), "t").mesh.triangles.empty());
    } catch (const ConfigError&) {
    }
  }
}

TEST(Crinkle, HasTheHeightAndTheSlopeItIsAskedForAndStaysClosed) {
  // A square of 80 x 80 folds in one plane, eight vertices to a fold.
  Mesh sheet;
  constexpr std::uint32_t kSide = 480;
  constexpr double kStep_m = 1.0 / 8.0;
  for (std::uint32_t i = 0; i < kSide; ++i)
    for (std::uint32_t k = 0; k < kSide; ++k)
      sheet.vertices.emplace_back(static_cast<float>(i * kStep_m), static_cast<float>(k * kStep_m),
                                  0.0F);
  for (std::uint32_t i = 0; i + 1 < kSide; ++i) {
    for (std::uint32_t k = 0; k + 1 < kSide; ++k) {
      const std::uint32_t a = i * kSide + k;
      sheet.triangles.push_back({{a, a + kSide, a + 1}, 0});
      sheet.triangles.push_back({{a + 1, a + kSide, a + kSide + 1}, 0});
    }
  }
  CrinkleSpec spec;
  spec.height_m = 0.01;
  spec.length_m = 1.0;
  crinkle(sheet, spec);
  double sum = 0;
  double squares = 0;
  for (const Vector3f& p : sheet.vertices) {
    sum += p.z();
    squares += double{p.z()} * p.z();
  }
  const double n = kSide * kSide;
  // 3600 cells of the lattice, a few of which hang together: 2 % to 3 %.
  EXPECT_NEAR(sum / n / spec.height_m, 0.0, 0.1);
  EXPECT_NEAR(std::sqrt(squares / n) / spec.height_m, 1.0, 0.08);
  double slopes = 0;
  for (const Mesh::Triangle& t : sheet.triangles) {
    const Vector3d normal = area_vector(sheet, t).normalized();
    slopes += normal.head<2>().squaredNorm() / (normal.z() * normal.z());
  }
  const double each = 0.5 * slopes / static_cast<double>(sheet.triangles.size());
  EXPECT_NEAR(std::sqrt(each) / spec.slope(), 1.0, 0.1);
}

}  // namespace
}  // namespace engine
