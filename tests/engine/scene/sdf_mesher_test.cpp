#include "engine/scene/sdf_mesher.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "engine/core/constants.h"

namespace engine {
namespace {

using Eigen::AlignedBox3d;
using Eigen::Vector3d;
using Loops = std::vector<std::vector<Vector3d>>;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

AlignedBox3d plane_box(double reach) {
  return {Vector3d(-reach, -reach, 0), Vector3d(reach, reach, 0)};
}
AlignedBox3d space_box(double reach) {
  return {Vector3d::Constant(-reach), Vector3d::Constant(reach)};
}
Eigen::Isometry3d moved(double x, double y, double z) {
  return Eigen::Isometry3d(Eigen::Translation3d(x, y, z));
}

double disc(const Vector3d& p) { return std::hypot(p.x(), p.y()) - 1.0; }
double ring(const Vector3d& p) { return std::max(disc(p), 0.5 - std::hypot(p.x(), p.y())); }
double ball(const Vector3d& p) { return p.norm() - 1.0; }
/// No distance beyond a corner: a maximum of planes.
double max_square(const Vector3d& p) { return std::max(std::abs(p.x()), std::abs(p.y())) - 1.0; }
double max_cube(const Vector3d& p) { return p.cwiseAbs().maxCoeff() - 1.0; }

Loops square() { return {{{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}}}; }
Loops wedge(double angle_deg) {
  const double a = angle_deg * kDegree;
  return {{{0, 0, 0}, {1, 0, 0}, {std::cos(a), std::sin(a), 0}}};
}
Loops square_with_holes() {
  Loops loops = square();
  loops.push_back({{-0.5, -0.5, 0}, {-0.5, 0.2, 0}, {0.1, 0.2, 0}, {0.1, -0.5, 0}});
  loops.push_back({{0.4, 0.4, 0}, {0.6, 0.8, 0}, {0.8, 0.4, 0}});
  return loops;
}

/// What every mesh keeps, whatever the shape was.
void expect_sound(const SdfMesh& mesh, const std::string& name) {
  const MeshFigures& f = mesh.figures;
  EXPECT_EQ(f.tangled, 0U) << name;
  EXPECT_LE(mesh.iterations, 300) << name;
  for (const Vector3d& p : mesh.places_m) ASSERT_TRUE(p.allFinite()) << name;
  for (const Corners& t : mesh.triangles)
    for (const std::uint32_t c : t) ASSERT_LT(c, mesh.places_m.size()) << name;
}

/// How far the nearest vertex is.
double miss(const SdfMesh& mesh, const Vector3d& corner) {
  double nearest = std::numeric_limits<double>::infinity();
  for (const Vector3d& p : mesh.places_m) nearest = std::min(nearest, (p - corner).norm());
  return nearest;
}

/// The furthest that the middle of an edge of a region's rim is off its border.
double rim_off(const SdfMesh& mesh, const DistanceFunction& f) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> uses;
  for (const Corners& t : mesh.triangles)
    for (std::size_t i = 0; i < 3; ++i) ++uses[std::minmax(t[i], t[(i + 1) % 3])];
  double off = 0;
  for (const auto& [edge, count] : uses)
    if (count == 1)
      off = std::max(off,
                     std::abs(f(0.5 * (mesh.places_m[edge.first] + mesh.places_m[edge.second]))));
  return off;
}

struct Row {
  const char* name;
  SdfShape shape;
  double edge_m;
  SdfMethod asked;
  SdfMethod made_by;  ///< the method that must have done it in the end
  int euler;
  double area_m2;  ///< in closed form; 0: not known
};

/// The shapes on which a plain truss is known to fail, and those on which it is not.
std::vector<Row> regions() {
  constexpr auto kAuto = SdfMethod::kAuto;
  constexpr auto kTruss = SdfMethod::kTruss;
  constexpr auto kFront = SdfMethod::kFront;
  const double wedge_m2 = 0.5 * std::sin(5.0 * kDegree);
  std::vector<Row> rows;
  for (const double h : {0.2, 0.1, 0.05}) {
    rows.push_back({"disc", region_of(disc, plane_box(1.2)), h, kAuto, kTruss, 1, kPi});
    rows.push_back({"ring", region_of(ring, plane_box(1.2)), h, kAuto, kTruss, 0, 0.75 * kPi});
    rows.push_back(
        {"square, a maximum", region_of(max_square, plane_box(1.2)), h, kAuto, kTruss, 1, 4.0});
    rows.push_back({"square by truss", region_of(square()), h, kTruss, kTruss, 1, 4.0});
    rows.push_back({"square", region_of(square()), h, kAuto, kFront, 1, 4.0});
    rows.push_back({"5 deg wedge by truss", region_of(wedge(5)), h, kTruss, kFront, 1, wedge_m2});
    rows.push_back({"5 deg wedge", region_of(wedge(5)), h, kAuto, kFront, 1, wedge_m2});
    rows.push_back({"holes", region_of(square_with_holes()), h, kAuto, kFront, -1, 3.5});
  }
  return rows;
}

TEST(SdfMesher, MeshesRegionsOnWhichATrussComesToRestOrNot) {
  for (const Row& row : regions()) {
    const std::string name = row.name + std::string(", h ") + std::to_string(row.edge_m);
    const SdfMesh mesh = mesh_shape(row.shape, even_edges(row.edge_m, row.asked));
    expect_sound(mesh, name);
    EXPECT_STREQ(name_of(mesh.method), name_of(row.made_by)) << name << mesh.fell_back;
    EXPECT_EQ(mesh.method == row.asked || row.asked == SdfMethod::kAuto, mesh.fell_back.empty())
        << name;
    EXPECT_EQ(mesh.figures.euler, row.euler) << name;
    EXPECT_GE(mesh.figures.smallest_quality, 0.1) << name;
    EXPECT_NEAR(mesh.figures.area_m2, row.area_m2, row.edge_m * row.edge_m) << name;
    EXPECT_TRUE(mesh.settled || !mesh.notes.empty()) << name;
    for (const auto& loop : row.shape.loops_m)
      for (const Vector3d& corner : loop) EXPECT_EQ(miss(mesh, corner), 0.0) << name;
    // A chord is h^2 / 8 R off its arc, R at least .5; the longest is 1.45 h.
    if (row.shape.loops_m.empty() && row.area_m2 != 4.0) {
      EXPECT_LE(rim_off(mesh, row.shape.distance_m), 2.1 * row.edge_m * row.edge_m / 4.0) << name;
    }
  }
}

std::vector<Row> surfaces() {
  constexpr auto kAuto = SdfMethod::kAuto;
  constexpr auto kTruss = SdfMethod::kTruss;
  constexpr auto kFront = SdfMethod::kFront;
  const Solid cube = Solid::box({2, 2, 2});
  const Solid pipe = Solid::cylinder(0.5, 3);
  const Eigen::Isometry3d across(Eigen::AngleAxisd(0.5 * kPi, Vector3d::UnitZ()));
  const double cone_m2 = kPi * 0.8 * (0.8 + std::hypot(0.8, 1.5));
  const double bored_m2 = 24.0 - 2.0 * kPi * 0.25 + 2.0 * kPi;
  return {
      {"sphere", surface_of(ball, space_box(1.2)), 0.1, kAuto, kTruss, 2, 4.0 * kPi},
      {"torus", surface_of(Solid::torus(1, 0.4)), 0.15, kAuto, kFront, 0, 1.6 * kPi * kPi},
      {"cube", surface_of(cube), 0.2, kAuto, kFront, 2, 24.0},
      {"cylinder", surface_of(Solid::cylinder(0.5, 2)), 0.15, kAuto, kFront, 2, 2.5 * kPi},
      {"cone", surface_of(Solid::cone(0.8, 0, 1.5)), 0.15, kAuto, kFront, 2, cone_m2},
      {"bored box", surface_of(cube.cut_by(pipe)), 0.2, kAuto, kFront, 0, bored_m2},
      // Two holes of one size only touch where they cross: one is thinner.
      {"box with crossing holes",
       surface_of(cube.cut_by(pipe).cut_by(Solid::cylinder(0.4, 3).moved(across))), 0.2, kAuto,
       kFront, -4, 0.0},
      {"box and ball", surface_of(cube.united(Solid::sphere(0.7).moved(moved(1, 0.1, 0.2)))), 0.2,
       kAuto, kFront, 2, 0.0},
      {"flush boxes", surface_of(cube.united(cube.moved(moved(2, 0, 0)))), 0.25, kAuto, kFront, 2,
       40.0},
      {"overhang", surface_of(cube.united(Solid::box({1, 3, 1}).moved(moved(0, 0, 1.5)))), 0.2,
       kAuto, kFront, 2, 34.0},
      {"thin plate", surface_of(Solid::box({2, 2, 0.02})), 0.2, kAuto, kFront, 2, 8.16},
      {"half a shell",
       surface_of(Solid::sphere(1)
                      .cut_by(Solid::sphere(0.8))
                      .cut_by(Solid::box({2, 3, 3}).moved(moved(1, 0, 0)))),
       0.15, kAuto, kFront, 2, 2.0 * kPi * (1.0 + 0.64) + kPi * 0.36},
      {"cavity", surface_of(cube.cut_by(Solid::sphere(0.6))), 0.25, kAuto, kFront, 4,
       24.0 + 4.0 * kPi * 0.36},
      {"boxes h/4 apart", surface_of(cube.united(cube.moved(moved(2.05, 0, 0)))), 0.2, kAuto,
       kFront, 4, 48.0},
  };
}

TEST(SdfMesher, MeshesSurfacesClosedWithTheirEdges) {
  for (const Row& row : surfaces()) {
    const SdfMesh mesh = mesh_shape(row.shape, even_edges(row.edge_m, row.asked));
    const MeshFigures& f = mesh.figures;
    expect_sound(mesh, row.name);
    EXPECT_EQ(mesh.fell_back, "") << row.name;
    EXPECT_STREQ(name_of(mesh.method), name_of(row.made_by)) << row.name;
    EXPECT_TRUE(f.closed()) << row.name << ": " << f.rims << " rims";
    EXPECT_EQ(f.euler, row.euler) << row.name;
    EXPECT_GE(f.smallest_quality, 0.1) << row.name;
    EXPECT_GT(f.volume_m3, 0.0) << row.name;
    // What is round loses an area of some h^2 / 6 R^2 to its facets; the thinnest has R .4.
    if (row.area_m2 > 0.0) {
      EXPECT_NEAR(f.area_m2 / row.area_m2, 1.0, row.edge_m * row.edge_m) << row.name;
    }
  }
}

TEST(SdfMesher, KeepsSmoothSurfacesWithinAFiftiethOfAnEdge) {
  // The middle of an even triangle is h^2 / 6 R off; some are a fifth larger.
  const SdfMesh mesh = mesh_shape(surface_of(ball, space_box(1.2)), even_edges(0.08));
  EXPECT_EQ(mesh.fell_back, "");
  EXPECT_LE(mesh.figures.off_m, 0.02 * 0.08);
  EXPECT_GT(mesh.figures.mean_quality, 0.95);
}

TEST(SdfMesher, HasEveryCornerOfACubeExactlyAndItsArea) {
  const SdfMesh mesh = mesh_shape(surface_of(Solid::box({2, 2, 2})), even_edges(0.2));
  for (int i = 0; i < 8; ++i) {
    const Vector3d corner((i & 1) != 0 ? 1 : -1, (i & 2) != 0 ? 1 : -1, (i & 4) != 0 ? 1 : -1);
    EXPECT_LE(miss(mesh, corner), 1e-15);
  }
  EXPECT_NEAR(mesh.figures.area_m2, 24.0, 1e-12);
  EXPECT_NEAR(mesh.figures.volume_m3, 8.0, 1e-12);
}

TEST(SdfMesher, SeesATrussFailAtACubesEdgesAndSaysSo) {
  // The first method of the two: nothing keeps a vertex on an edge, so that facets cut them off.
  for (const auto& cube :
       {DistanceFunction(max_cube), surface_of(Solid::box({2, 2, 2})).distance_m}) {
    const SdfMesh mesh = mesh_shape(surface_of(cube, space_box(1.2)), even_edges(0.2));
    expect_sound(mesh, "cube");
    EXPECT_FALSE(mesh.settled);
    EXPECT_NE(mesh.fell_back.find("off the border"), std::string::npos) << mesh.fell_back;
    EXPECT_EQ(mesh.method, SdfMethod::kLattice);
    EXPECT_TRUE(mesh.figures.closed());
    EXPECT_EQ(mesh.figures.euler, 2);
    EXPECT_GE(mesh.figures.smallest_quality, 0.1);
    double nearest = std::numeric_limits<double>::infinity();
    for (int i = 0; i < 8; ++i)
      nearest = std::min(nearest, miss(mesh, Vector3d((i & 1) != 0 ? 1 : -1, (i & 2) != 0 ? 1 : -1,
                                                      (i & 4) != 0 ? 1 : -1)));
    EXPECT_GT(nearest, 0.01 * 0.2) << "no corner is met";
  }
}

TEST(SdfMesher, DoesNotNeedADistanceToBeOne) {
  const SdfMesh good = mesh_shape(surface_of(ball, space_box(1.2)), even_edges(0.2));
  const SdfMesh scaled =
      mesh_shape(surface_of([](const Vector3d& p) { return 10.0 * ball(p); }, space_box(1.2)),
                 even_edges(0.2));
  EXPECT_EQ(scaled.fell_back, "");
  EXPECT_EQ(scaled.figures.euler, 2);
  EXPECT_NEAR(scaled.figures.area_m2, good.figures.area_m2, 1e-3);
  ASSERT_FALSE(scaled.notes.empty());
  EXPECT_NE(scaled.notes[0].find("slope is 10"), std::string::npos) << scaled.notes[0];
}

TEST(SdfMesher, TakesNoNumberForOutside) {
  for (const bool is_region : {false, true}) {
    const DistanceFunction f = [is_region](const Vector3d& p) {
      return p.x() > 0.5 ? kNan : is_region ? disc(p) : ball(p);
    };
    const SdfMesh mesh = mesh_shape(
        is_region ? region_of(f, plane_box(1.2)) : surface_of(f, space_box(1.2)), even_edges(0.2));
    expect_sound(mesh, "not a number");
    EXPECT_EQ(mesh.figures.closed(), !is_region);
    EXPECT_GE(mesh.figures.smallest_quality, 0.1);
    ASSERT_FALSE(mesh.notes.empty());
    EXPECT_NE(mesh.notes[0].find("not a number"), std::string::npos);
    for (const Vector3d& p : mesh.places_m) EXPECT_LE(p.x(), 0.51);
  }
}

TEST(SdfMesher, LeavesAnEmptyShapeEmptyAndSaysSo) {
  const DistanceFunction nothing = [](const Vector3d&) { return 1.0; };
  const DistanceFunction no_number = [](const Vector3d&) { return kNan; };
  const AlignedBox3d beside(Vector3d(2, 2, 2), Vector3d(3, 3, 3));
  const AlignedBox3d flat(Vector3d(2, 2, 0), Vector3d(3, 3, 0));
  for (const SdfShape& shape :
       {surface_of(nothing, space_box(1)), surface_of(no_number, space_box(1)),
        surface_of(ball, beside), region_of(nothing, plane_box(1)), region_of(disc, flat)}) {
    const SdfMesh mesh = mesh_shape(shape, even_edges(0.1));
    EXPECT_TRUE(mesh.triangles.empty());
    ASSERT_FALSE(mesh.notes.empty());
    EXPECT_NE(mesh.notes.back().find("no place in its box"), std::string::npos);
  }
  for (const double edge_m : {0.0, -1.0, kNan, std::numeric_limits<double>::infinity()})
    EXPECT_TRUE(mesh_shape(surface_of(ball, space_box(1.2)), even_edges(edge_m)).triangles.empty());
  EXPECT_TRUE(mesh_shape(SdfShape{}, even_edges(0.1)).triangles.empty());
}

TEST(SdfMesher, CutsAShapeOffAtItsBox) {
  const AlignedBox3d quarter(Vector3d(0, 0, -1.2), Vector3d(1.2, 1.2, 1.2));
  const SdfMesh mesh = mesh_shape(surface_of(ball, quarter), even_edges(0.2));
  EXPECT_TRUE(mesh.figures.closed());
  ASSERT_FALSE(mesh.notes.empty());
  EXPECT_NE(mesh.notes[0].find("cut off"), std::string::npos);
}

TEST(SdfMesher, KeepsSomethingOfABodySmallerThanAnEdge) {
  for (const SdfShape& shape : {surface_of(ball, space_box(1.2)), surface_of(Solid::sphere(1)),
                                surface_of(Solid::box({1, 1, 1}))}) {
    const SdfMesh mesh = mesh_shape(shape, even_edges(5.0));
    EXPECT_EQ(mesh.figures.euler, 2);
    EXPECT_TRUE(mesh.figures.closed());
    EXPECT_GE(mesh.figures.smallest_quality, 0.1);
    ASSERT_FALSE(mesh.notes.empty());
    EXPECT_NE(mesh.notes[0].find("a third of the body"), std::string::npos);
  }
}

TEST(SdfMesher, BoundsItsWorkWhateverTheEdge) {
  SdfMeshSpec spec = even_edges(1e-7);
  spec.most_triangles = 4000;
  const SdfMesh mesh = mesh_shape(surface_of(Solid::box({1, 1, 1})), spec);
  EXPECT_LE(mesh.figures.triangles, 20000U);
  EXPECT_TRUE(mesh.figures.closed());
  ASSERT_FALSE(mesh.notes.empty());
}

TEST(SdfMesher, KeepsTwoBallsAQuarterOfAnEdgeApart) {
  const DistanceFunction two = [](const Vector3d& p) {
    return std::min(ball(p - Vector3d(1.025, 0, 0)), ball(p + Vector3d(1.025, 0, 0)));
  };
  const AlignedBox3d box(Vector3d(-2.1, -1.1, -1.1), Vector3d(2.1, 1.1, 1.1));
  const SdfMesh mesh = mesh_shape(surface_of(two, box), even_edges(0.2));
  EXPECT_TRUE(mesh.figures.closed());
  EXPECT_EQ(mesh.figures.euler, 4);
}

TEST(SdfMesher, GradesEdgesAsItsSizeFunctionWants) {
  SdfMeshSpec spec = even_edges(0.05);
  spec.size_m = [](const Vector3d& p) { return 0.05 + 0.15 * p.norm(); };
  const SdfMesh mesh = mesh_shape(region_of(disc, plane_box(1.2)), spec);
  EXPECT_GE(mesh.figures.smallest_quality, 0.1);
  double near_sum = 0;
  double far_sum = 0;
  int near = 0;
  int far = 0;
  for (const Corners& t : mesh.triangles) {
    const double edge = (mesh.places_m[t[0]] - mesh.places_m[t[1]]).norm();
    const double r = mesh.places_m[t[0]].norm();
    if (r < 0.2) {
      near_sum += edge;
      ++near;
    }
    if (r > 0.8) {
      far_sum += edge;
      ++far;
    }
  }
  // Sizes there are .06 and .185 on average.
  EXPECT_NEAR((far_sum / far) / (near_sum / near), 0.185 / 0.06, 1.0);
}

TEST(SdfMesher, MakesTheSameBitsEachTime) {
  for (const SdfShape& shape : {surface_of(ball, space_box(1.2)), surface_of(Solid::box({2, 2, 2})),
                                region_of(ring, plane_box(1.2))}) {
    const SdfMesh a = mesh_shape(shape, even_edges(0.25));
    const SdfMesh b = mesh_shape(shape, even_edges(0.25));
    EXPECT_EQ(a.triangles, b.triangles);
    EXPECT_EQ(a.places_m, b.places_m);
  }
}

}  // namespace
}  // namespace engine
