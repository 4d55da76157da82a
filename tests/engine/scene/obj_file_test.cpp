#include "engine/scene/obj_file.h"

#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "engine/core/contract.h"
#include "engine/scene/obj_lines.h"
#include "engine/scene/polygon.h"
#include "tests/support/obj_text.h"
#include "tests/support/temp_file.h"

namespace engine {
namespace {

using Eigen::Vector3f;
using test_support::kUnitSquare;
using test_support::load_obj;
using test_support::LoadedObj;

const std::string kSquare = kUnitSquare;

/// What it is refused for; empty: it is not.
std::string complaint_of(const std::string& text) {
  try {
    static_cast<void>(load_obj(text));
  } catch (const ConfigError& e) {
    return e.what();
  }
  return {};
}

TEST(ObjFile, CutsAQuadIntoTwoTriangles) {
  const LoadedObj loaded = load_obj(kSquare + "f 1 2 3 4\n");
  EXPECT_EQ(loaded.mesh().triangles.size(), 2U);
  EXPECT_DOUBLE_EQ(loaded.report.area_m2, 1.0);
  EXPECT_EQ(loaded.report.left_out(), 0U);
}

TEST(ObjFile, CoversADentedPolygonAndNoMore) {
  // A fan from its first corner would cover 3.5 m2 of this arrow, and 8 of this comb.
  EXPECT_DOUBLE_EQ(load_obj("v 1 .5 0\nv 0 2 0\nv -1 .5 0\nv 0 1 0\nf 1 2 3 4\n").report.area_m2,
                   1.0);
  EXPECT_DOUBLE_EQ(load_obj("v 0 1 0\nv 1 .5 0\nv 0 2 0\nv -1 .5 0\nf 1 2 3 4\n").report.area_m2,
                   1.0);
  const LoadedObj comb = load_obj(
      "v 0 0 0\nv 5 0 0\nv 5 3 0\nv 4 3 0\nv 4 1 0\nv 3 1 0\nv 3 3 0\nv 2 3 0\nv 2 1 0\nv 1 1 0\n"
      "v 1 3 0\nv 0 3 0\nf 1 2 3 4 5 6 7 8 9 10 11 12\n");
  EXPECT_EQ(comb.mesh().triangles.size(), 10U);
  EXPECT_NEAR(comb.report.area_m2, 11.0, 1e-12);
  EXPECT_TRUE(comb.report.repairs().empty());
  EXPECT_EQ(comb.report.closed_pieces, 0U);
  EXPECT_EQ(comb.report.open_edges.count, 12U);
}

TEST(ObjFile, CoversADiscOfManyCornersWithoutNeedles) {
  std::string text;
  std::string face = "f";
  const int corners = 720;
  for (int i = 0; i < corners; ++i) {
    const double a = 2.0 * M_PI * i / corners;
    text += "v " + std::to_string(std::cos(a)) + " " + std::to_string(std::sin(a)) + " 0\n";
    face.append(" ").append(std::to_string(i + 1));
  }
  const LoadedObj disc = load_obj(text + face);
  EXPECT_EQ(disc.mesh().triangles.size(), 718U);
  // Inscribed: n/2 sin(2 pi / n); places have six decimals.
  EXPECT_NEAR(disc.report.area_m2, 0.5 * corners * std::sin(2.0 * M_PI / corners), 1e-6 * corners);
  EXPECT_EQ(disc.report.tangled.count, 0U);
}

/// A band that winds outwards, along one side of it and back along the other.
std::vector<Vector3f> spiral(std::size_t corners) {
  constexpr double kPerTurn = 60;
  std::vector<Vector3f> ring;
  for (std::size_t i = 0; i < corners; ++i) {
    const bool out = i < corners / 2;
    const double turns = static_cast<double>(out ? i : corners - 1 - i) / kPerTurn;
    const double r = 1.0 + turns + (out ? 0.5 : 0.0);
    const double a = 2.0 * M_PI * turns;
    ring.emplace_back(Eigen::Vector3d(r * std::cos(a), r * std::sin(a), 0).cast<float>());
  }
  return ring;
}

double twice_area_m2(const Vector3f& a, const Vector3f& b, const Vector3f& c) {
  const Eigen::Vector3d from = a.cast<double>();
  return (b.cast<double>() - from).cross(c.cast<double>() - from).z();
}

TEST(ObjFile, CoversASpiralOfAsManyCornersAsAFaceMayHave) {
  const std::vector<Vector3f> ring = spiral(ObjLines::kMostCornersOfAFace);
  double want_m2 = 0;  // by Gauss's formula
  for (std::size_t i = 0; i < ring.size(); ++i)
    want_m2 += 0.5 * twice_area_m2(Vector3f::Zero(), ring[i], ring[(i + 1) % ring.size()]);
  std::vector<std::array<std::uint32_t, 3>> triangles;
  EXPECT_TRUE(cut_polygon(ring, triangles));
  ASSERT_EQ(triangles.size(), ring.size() - 2);
  double sum_m2 = 0;
  for (const auto& [a, b, c] : triangles) {
    const double one_m2 = 0.5 * twice_area_m2(ring[a], ring[b], ring[c]);
    EXPECT_GE(one_m2 * want_m2, 0.0);  // each runs as the face does
    sum_m2 += one_m2;
  }
  EXPECT_NEAR(sum_m2, want_m2, 1e-9 * std::abs(want_m2));
}

TEST(ObjFile, PassesOverACornerAtThePlaceOfTheNext) {
  // How some exporters pad a triangle to a quad: taken as it is, no diagonal of it lies inside.
  for (const char* face : {"f 1 2 3 3\n", "f 1 1 2 3\n", "f 1 2 2 3\n", "f 1 2 3 1\n",
                           "f 1 1 2 2 3 3 3\n", "v 1 1 0\nf 1 2 3 5\n"}) {
    const LoadedObj padded = load_obj(kSquare + face);
    EXPECT_EQ(padded.report.tangled.count + padded.report.left_out(), 0U) << face;
    EXPECT_EQ(padded.mesh().triangles.size(), 1U) << face;
    EXPECT_DOUBLE_EQ(padded.report.area_m2, 0.5) << face;
  }
}

TEST(ObjFile, TellsAFaceThatCrossesItself) {
  const LoadedObj loaded = load_obj(kSquare + "f 1 3 2 4\n");
  EXPECT_EQ(loaded.report.tangled.count, 1U);
  EXPECT_EQ(loaded.report.tangled.lines, std::vector<std::uint32_t>{5});
}

TEST(ObjFile, CutsAFaceTheSameWayFromWhicheverCornerItBegins) {
  // Both diagonals of a square are as long: the choice must not hang on the order.
  for (const char* again : {"f 2 3 4 1\n", "f 3 4 1 2\n", "f 4 3 2 1\n", "f 1 4 3 2\n"}) {
    const LoadedObj loaded = load_obj(kSquare + "f 1 2 3 4\n" + again);
    EXPECT_EQ(loaded.mesh().triangles.size(), 2U) << again;
    EXPECT_EQ(loaded.report.duplicate.count, 1U) << again;
  }
}

TEST(ObjFile, CountsNegativeIndicesFromTheEnd) {
  EXPECT_DOUBLE_EQ(load_obj(kSquare + "f -4 -3 -2 -1\n").report.area_m2, 1.0);
  // From where the face stands, not from the file's end.
  EXPECT_DOUBLE_EQ(load_obj(kSquare + "f -4 -3 -2 -1\nv 9 9 9\n").report.area_m2, 1.0);
}

TEST(ObjFile, TakesAFaceBeforeItsVertices) {
  EXPECT_DOUBLE_EQ(load_obj("f 1 2 3 4\n" + kSquare).report.area_m2, 1.0);
}

TEST(ObjFile, TakesNormalsAndTextureOrNeither) {
  const std::string with = kSquare + "vn 0 0 1\nvt 0 0\n";
  for (const char* face : {"f 1/1/1 2/1/1 3/1/1 4/1/1\n", "f 1//1 2//1 3//1 4//1\n",
                           "f 1/1 2/1 3/1 4/1\n", "f 1/ 2/ 3/ 4/\n", "f 1//99 2//99 3//99 4//99\n"})
    EXPECT_DOUBLE_EQ(load_obj(with + face).report.area_m2, 1.0) << face;
}

TEST(ObjFile, TakesEverySortOfLineEnd) {
  const std::string unix_text = "\n# square\n\n" + kSquare + "  f 1 2 \\\n 3 4 # whole\n";
  for (const std::string end : {"\n", "\r\n", "\r"}) {
    std::string text;
    for (const char c : unix_text) text += c == '\n' ? end : std::string(1, c);
    EXPECT_DOUBLE_EQ(load_obj(text).report.area_m2, 1.0);
    EXPECT_EQ(load_obj(text + "f 1 2" + end).report.few_corners.lines,
              std::vector<std::uint32_t>{10});
  }
  EXPECT_DOUBLE_EQ(load_obj(kSquare + "f 1 2 3 4").report.area_m2, 1.0);
  EXPECT_DOUBLE_EQ(load_obj("\xEF\xBB\xBF" + kSquare + "f 1 2 3 4 \\").report.area_m2, 1.0);
}

TEST(ObjFile, EndsACommentWithItsLine) {
  const LoadedObj loaded = load_obj("# from C:\\models\\\n" + kSquare +
                                    "f 1 2 3 # D:\\\nf 1 \\\n 3 \\\n4 # E:\\\nf 1 2 4\n");
  EXPECT_EQ(loaded.report.vertices, 4U);
  EXPECT_EQ(loaded.report.faces, 3U);
  EXPECT_EQ(loaded.mesh().triangles.size(), 3U);
}

TEST(ObjFile, KeepsTheOrderOfCornersAndTheNumbers) {
  const LoadedObj loaded = load_obj("v 0 0 0\nv +2.5e-1 0. -.0\nv 0 0 -2.5E+00 1.0\nf 1 2 3\n");
  ASSERT_EQ(loaded.mesh().triangles.size(), 1U);
  const auto& t = loaded.mesh().triangles[0];
  EXPECT_EQ(loaded.mesh().vertices[t.corner[1]], Vector3f(0.25F, 0.0F, 0.0F));
  EXPECT_EQ(loaded.mesh().vertices[t.corner[2]], Vector3f(0.0F, 0.0F, -2.5F));
}

TEST(ObjFile, ReadsNumbersAsTheCLibraryDoes) {
  for (const char* number :
       {"0.1", "-3.14159265358979", "1e-3", "123456.789", "6.8268e+2", "2.1452466e-2", "1e-40",
        "0.000000000000000000000000000000001", "0.33333333333333333333333333333333"}) {
    const std::string vertices = std::string("v 0 ") + number + " 0\nv 1 0 0\nv 0 7 1\nf 1 2 3\n";
    MeshReport report;
    const ObjFile file = obj_from_text(vertices, "mesh.obj", report);
    const float want = std::strtof(number, nullptr);
    const float got = file.grouped.mesh.vertices[0].y();
    // The importer adds up the digits in double: off by its last place, or float's when that tips.
    EXPECT_TRUE(got == want || got == std::nextafterf(want, 2 * got - want))
        << number << " " << got;
  }
}

TEST(ObjFile, NamesGroupsAndMaterialsWithoutALibrary) {
  const LoadedObj loaded = load_obj("mtllib lost.mtl\n" + kSquare +
                                    "f 1 2 3\no The Bus\nusemtl Gold Foil \nf 1 3 4\n"
                                    "g wing left\nusemtl glass\nf 1 2 4\no The Bus\nf 2 3 4\n");
  EXPECT_EQ(loaded.group(0), "default");
  EXPECT_EQ(loaded.material(0), "default");
  EXPECT_EQ(loaded.group(1), "The Bus");
  EXPECT_EQ(loaded.material(1), "Gold Foil");
  EXPECT_EQ(loaded.group(2), "wing left");
  EXPECT_EQ(loaded.group(3), "The Bus");
  EXPECT_EQ(loaded.material(3), "glass");
  EXPECT_EQ(loaded.grouped.group_names.size(), 3U);
  EXPECT_EQ(loaded.grouped.part({false, true, false}).triangles.size(), 2U);
}

TEST(ObjFile, AsksForNoMaterialThatNoFaceIsOf) {
  EXPECT_EQ(load_obj(kSquare + "usemtl a\nusemtl b\nf 1 2 3\nusemtl c\n").mesh().material_names,
            std::vector<std::string>{"b"});
}

TEST(ObjFile, RefusesAnIndexOutsideTheFileAndSaysWhere) {
  // The importer alone takes the last but one modulo 2^32, and the relative ones as they are:
  // TALOS-2020-1212, reports 175 and 358 of tinyobjloader, 4770 and 4923 of assimp.
  for (const auto& [face, found] : std::vector<std::pair<std::string, std::string>>{
           {"f 1 2 9", "9"},
           {"f 1 2 3 4 9", "9"},
           {"f 0 1 2", "0"},
           {"f 1 2 -9", "-9"},
           {"f -5 1 2", "-5"},
           {"f 1 2 2147483647", "2147483647"},
           {"f 1 2 -2147483648", "-2147483648"},
           {"f 1 2 4294967297", "4294967297"},
           {"f 1 2 99999999999999999999999", "99999999999999999999999"}}) {
    const std::string what = complaint_of(kSquare + face + "\n");
    EXPECT_TRUE(what.starts_with("mesh.obj:5: expected the index of ")) << face << ": " << what;
    EXPECT_TRUE(what.ends_with("found \"" + found + "\"")) << face << ": " << what;
  }
  EXPECT_TRUE(complaint_of("f -1 -1 -1\n" + kSquare).starts_with("mesh.obj:1: ")) << "none yet";
}

TEST(ObjFile, RefusesAMalformedStatementAndSaysWhere) {
  EXPECT_EQ(complaint_of("v 1 2\nf 1 1 1\n"),
            "mesh.obj:1: expected a vertex of three numbers, found \"1 2\"");
  EXPECT_EQ(complaint_of("\nv 1,5 2,0 3\n"),
            "mesh.obj:2: expected a vertex of three numbers, found \"1,5 2,0 3\"");
  for (const char* line :
       {"v 0x10 0 0", "v 1e 0 0", "v . 0 0", "v - 0 0", "v 1e+ 0 0", "v 1.2.3 0 0", "v",
        "v 1e99999 0 0", "f 1 2 a", "f 1 2 3.5", "f 1 2 /3", "f 1 2 3/x", "f 1 2 --3", "f 1 2 3-"})
    EXPECT_TRUE(complaint_of(kSquare + line + "\nf 1 2 3").starts_with("mesh.obj:5: expected "))
        << line << ": " << complaint_of(kSquare + line + "\nf 1 2 3");
  EXPECT_EQ(complaint_of(kSquare + "f 1 2 3" + std::string(1, '\0') + "\n"),
            "mesh.obj:5: expected the text of an OBJ mesh, found a zero byte");
  const std::string many = complaint_of(kSquare + "f" + [] {
    std::string corners;
    for (int i = 0; i < 5000; ++i) corners += " 1";
    return corners;
  }());
  EXPECT_EQ(many, "mesh.obj:5: expected a face of at most 4096 corners, found one of more");
  EXPECT_EQ(complaint_of(kSquare + "# " + std::string(ObjLines::kLongestLine, 'x')),
            "mesh.obj:5: expected a line of at most 1 MiB, found a longer one");
}

TEST(ObjFile, RefusesWhatHoldsNoFace) {
  for (const std::string& text :
       {std::string(), std::string("\n\n# nothing\n"), kSquare, kSquare + "l 1 2\np 1\nl 1\n",
        std::string("\0\1\2\xff\xfe binary \0 f v", 18), std::string("\\\\\\\n\\\n\\")})
    EXPECT_TRUE(complaint_of(text).find("expected ") != std::string::npos) << text;
}

TEST(ObjFile, SurvivesOddLinesAndCountsThem) {
  // A line of one vertex, a face of two corners, words out of place, names that are not there.
  const LoadedObj loaded = load_obj(
      kSquare + "l 1\nf 1 2\nf 1\nf\nxyzzy 1\ng\no\nusemtl\ns off\nvp 1\ncurv 0 1 2\nf 1 2 3 4\n");
  EXPECT_DOUBLE_EQ(loaded.report.area_m2, 1.0);
  EXPECT_EQ(loaded.report.few_corners.count, 3U);
  EXPECT_EQ(loaded.report.few_corners.lines, (std::vector<std::uint32_t>{6, 7, 8}));
  EXPECT_EQ(loaded.report.not_faces.count, 2U);
  EXPECT_EQ(loaded.report.unknown.count, 1U);
  EXPECT_EQ(loaded.report.unknown.lines, std::vector<std::uint32_t>{9});
  EXPECT_EQ(loaded.report.faces, 4U);
}

TEST(ObjFile, NamesTheFileThatCannotBeRead) {
  for (const char* path : {"/nowhere/at_all.obj", "/"}) {
    MeshReport report;
    try {
      static_cast<void>(read_obj(path, report));
      FAIL() << path;
    } catch (const ConfigError& e) {
      EXPECT_TRUE(std::string(e.what()).starts_with(std::string(path) + ": expected an OBJ mesh"))
          << e.what();
    }
  }
}

TEST(ObjFile, RefusesAFileWithoutAnEnd) {
  MeshReport report;
  EXPECT_THROW(static_cast<void>(read_obj("/dev/zero", report)), ConfigError);
}

const std::string kSmallFile =
    "# two sheets\r\nmtllib a.mtl\nv 0 0 0\nv 1.5 -2e-1 .25\nv 1 1 0\nv 0 1 nan\n"
    "vn 0 0 1\no a\nusemtl x\nf 1//1 2//1 3//1\ng b c\nf -4 -3 -2\\\n -1\nl 1 2\nf 1 2 4 3";

/// Either good or refused; what comes out holds together.
void expect_sound(const std::string& text) {
  try {
    const LoadedObj loaded = load_obj(text);
    const Mesh& mesh = loaded.mesh();
    ASSERT_EQ(loaded.grouped.group.size(), mesh.triangles.size());
    for (const Mesh::Triangle& t : mesh.triangles) {
      ASSERT_LT(t.material, mesh.material_names.size());
      for (const std::uint32_t corner : t.corner) {
        ASSERT_LT(corner, mesh.vertices.size());
        ASSERT_TRUE(mesh.vertices[corner].allFinite());
      }
    }
  } catch (const ConfigError& e) {
    ASSERT_TRUE(std::string(e.what()).starts_with("mesh.obj:")) << e.what();
  }
}

TEST(ObjFile, IsGoodOrRefusedCutAnywhere) {
  for (std::size_t n = 0; n <= kSmallFile.size(); ++n) expect_sound(kSmallFile.substr(0, n));
}

TEST(ObjFile, IsGoodOrRefusedWithAnyByteReplaced) {
  const std::string hostile = std::string("\0\n\r\t \\#/-+.e019vfglo\x7f\x80\xff", 24);
  for (std::size_t i = 0; i < kSmallFile.size(); ++i) {
    for (const char c : hostile) {
      std::string text = kSmallFile;
      text[i] = c;
      expect_sound(text);
      text.insert(i, 40, c);
      expect_sound(text);
    }
  }
}

}  // namespace
}  // namespace engine
