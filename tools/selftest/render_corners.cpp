// Rays in single precision, and samples of an edge.

#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include "engine/core/constants.h"
#include "engine/core/random.h"
#include "engine/render/embree_scene.h"
#include "engine/render/facets.h"
#include "engine/render/sobol.h"
#include "tools/selftest/corner.h"
#include "tools/selftest/paper_orbits.h"
#include "tools/selftest/worst.h"

namespace corners {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;
using engine::EmbreeScene;
using engine::Mesh;
using engine::MeshHit;
using engine::RayCounts;

constexpr double kRadius_m = 5;
constexpr double kRange_m = 100e3;
constexpr int kRays = 20000;

/// A ball of triangles of .2 m, convex: rings of flat quadrangles, each cut in two.
Mesh make_ball() {
  constexpr int kRings = 80;
  constexpr int kSectors = 160;
  Mesh mesh;
  const std::uint32_t id = mesh.material("white");
  for (int i = 0; i <= kRings; ++i) {
    const double theta = engine::kPi * i / kRings;
    for (int k = 0; k < kSectors; ++k) {
      const double phi = 2.0 * engine::kPi * k / kSectors;
      const double across = i == 0 || i == kRings ? 0.0 : std::sin(theta);  // a pole is one place
      const Vector3d unit(across * std::cos(phi), across * std::sin(phi), std::cos(theta));
      mesh.vertices.push_back((kRadius_m * unit).cast<float>());
    }
  }
  const auto at = [](int i, int k) {
    return static_cast<std::uint32_t>(i * kSectors + k % kSectors);
  };
  for (int i = 0; i < kRings; ++i) {
    for (int k = 0; k < kSectors; ++k) {
      if (i > 0) mesh.triangles.push_back({{at(i, k), at(i + 1, k), at(i, k + 1)}, id});
      if (i + 1 < kRings)
        mesh.triangles.push_back({{at(i, k + 1), at(i + 1, k), at(i + 1, k + 1)}, id});
    }
  }
  return mesh;
}
const Mesh& ball() {
  static const Mesh mesh = make_ball();
  return mesh;
}

Mesh moved(const Vector3d& to_m) {
  Mesh mesh = ball();
  for (Vector3f& v : mesh.vertices) v = (v.cast<double>() + to_m).cast<float>();
  return mesh;
}

engine::Facets facets_of(const Mesh& mesh) {
  return {mesh, {engine::Brdf({1.0, -1.0, 0.0, 0.1, 1.0}, engine::Brdf::Variant::kPhysical)}};
}

Vector3d random_unit(engine::Draws& draws) {
  const double z = 2.0 * draws.uniform_double() - 1.0;
  const double turn = 2.0 * engine::kPi * draws.uniform_double();
  const double r = std::sqrt(1.0 - z * z);
  return {r * std::cos(turn), r * std::sin(turn), z};
}

/// A ray from 100 km away to some place in the ball.
struct Aim {
  Vector3d from;
  Vector3d along;
  explicit Aim(engine::Draws& draws) : from(kRange_m * random_unit(draws)) {
    const Vector3d at = 0.98 * kRadius_m * std::cbrt(draws.uniform_double()) * random_unit(draws);
    along = (at - from).normalized();
  }
};

engine::Draws draws_of(int i) {
  return {9, engine::Stream::kCharts, 2, static_cast<std::uint32_t>(i)};
}

/// The mesh stands at `place_m`; rays start where the camera is, or as near as `rebased`.
double furthest_px(const Vector3d& place_m, bool rebased) {
  const Mesh mesh = moved(place_m);
  const EmbreeScene scene(mesh);
  const engine::Facets facets = facets_of(mesh);
  RayCounts counts;
  double furthest = 0;
  for (int i = 0; i < kRays; ++i) {
    engine::Draws draws = draws_of(i);
    const Aim aim(draws);
    const Vector3d start = rebased ? Vector3d(aim.from + (kRange_m - 6.0) * aim.along) : aim.from;
    const Vector3f along = aim.along.cast<float>();
    const MeshHit hit = scene.intersect((start + place_m).cast<float>(), along, counts);
    if (hit.triangle == MeshHit::kNone) return HUGE_VAL;  // a closed body loses none
    const Vector3d off = facets.at(hit, along).place.cast<double>() - place_m - aim.from;
    const double aside_m = (off - off.dot(aim.along) * aim.along).norm();
    furthest = std::fmax(furthest, aside_m / (kRange_m * kIfov_rad));
  }
  return furthest;
}

/// 687 km: an orbit's own 7000 km our tracer does not take.
const Vector3d kFarOrigin_m(4e5, 5e5, 2.5e5);

Corner ray_places(double plain, double ours) {
  return {
      "rays in single precision",
      "an origin 700 km away",
      plain,
      ours,
      1e-4,
      "px",
      "How far a hit is off its ray, 100 km from the camera: at 700 km a float resolves 6 cm. Ours "
      "goes up to the body in double, its origin in the body. The bound is 1.4e-5 m, 30 units in "
      "the last place of 5 m; a lost ray is infinitely far off. Pharr et al. 2016, Physically "
      "Based Rendering, section 3.9."};
}

Corner from_camera(double plain, double ours) {
  return {
      "rays over 100 km",
      "from the camera, as a float",
      plain,
      ours,
      1e-4,
      "px",
      "The same, the mesh about the origin and rays that start where the camera is: 7.8 mm to a "
      "float. The bound is as before."};
}

Corner self_shadow() {
  const EmbreeScene scene(ball());
  const engine::Facets facets = facets_of(ball());
  RayCounts counts;
  int asked = 0;
  int plain = 0;
  int ours = 0;
  for (int i = 0; i < kRays; ++i) {
    engine::Draws draws = draws_of(i);
    const Aim aim(draws);
    const Vector3f near = (aim.from + (kRange_m - 6.0) * aim.along).cast<float>();
    const MeshHit hit = scene.intersect(near, aim.along.cast<float>(), counts);
    if (hit.triangle == MeshHit::kNone) continue;
    const engine::SurfacePoint point = facets.at(hit, aim.along.cast<float>());
    Vector3f lamp = random_unit(draws).cast<float>();
    if (lamp.dot(point.normal) < 0.0F) lamp = -lamp;
    if (lamp.dot(point.normal) < 1e-3F) continue;
    ++asked;
    plain += scene.occluded(point.place, lamp, counts) ? 1 : 0;
    ours += scene.occluded(point.start(), lamp, counts) ? 1 : 0;
  }
  return {"a convex body's own shadow",
          "rays from the hit itself",
          static_cast<double>(plain) / asked,
          static_cast<double>(ours) / asked,
          0,
          "dark",
          "Share of places that their own facet hides from a lamp above it: the hit is below it as "
          "often as above. Ours starts off by a bound of the rounding. Pharr et al. 2016, 3.9.4."};
}

/// Two sheets, the upper one 1 mm over the lower.
Mesh two_sheets() {
  Mesh mesh;
  const std::uint32_t id = mesh.material("white");
  for (const float z : {0.0F, 1e-3F}) {
    const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
    for (const auto& [x, y] : {std::pair{-5.0F, -5.0F}, {5.0F, -5.0F}, {5.0F, 5.0F}, {-5.0F, 5.0F}})
      mesh.vertices.emplace_back(x, y, z);
    mesh.triangles.push_back({{first, first + 1, first + 2}, id});
    mesh.triangles.push_back({{first, first + 2, first + 3}, id});
  }
  return mesh;
}

Corner thin_gap() {
  const Mesh mesh = two_sheets();
  const EmbreeScene scene(mesh);
  const engine::Facets facets = facets_of(mesh);
  const Vector3f lamp = Vector3f(0.1F, 0.2F, 1.0F).normalized();
  RayCounts counts;
  int plain = 0;
  int ours = 0;
  for (int i = 0; i < kRays; ++i) {
    engine::Draws draws = draws_of(i);
    const auto second = 0.9F * draws.uniform();
    const engine::SurfacePoint point =
        facets.on_side(0, second, (0.9F - second) * draws.uniform(), 0);
    const Vector3f far = point.place + 1e-3F * static_cast<float>(kRadius_m) * point.normal;
    plain += scene.occluded(far, lamp, counts) ? 0 : 1;
    ours += scene.occluded(point.start(), lamp, counts) ? 0 : 1;
  }
  return {
      "a sheet 1 mm behind another",
      "offset .1 % of the size",
      static_cast<double>(plain) / kRays,
      static_cast<double>(ours) / kRays,
      0,
      "lit",
      "Share of places behind a sheet that a lamp shines on through it: an offset for the whole "
      "scene jumps over it. No light may leak."};
}

Corner no_rays() {
  const EmbreeScene scene(two_sheets());
  const float nan = std::numeric_limits<float>::quiet_NaN();
  RayCounts counts;
  int plain = 0;
  int given = 0;
  for (const float bad : {nan, -nan, HUGE_VALF, 1e30F, -1e30F}) {
    for (int axis = 0; axis < 6; ++axis) {
      Vector3f from(0.1F, 0.2F, 5.0F);
      Vector3f along(0.0F, 0.0F, -1.0F);
      (axis < 3 ? from : along)[axis % 3] = bad;
      ++given;
      const bool too_far = from.norm() > 1e9F || along.norm() > 1e9F || along.norm() < 1e-9F;
      plain += too_far ? 0 : 1;
      static_cast<void>(scene.intersect(from, along, counts));
    }
  }
  return {"rays that are no numbers",
          "refused if norm > 1e9",
          static_cast<double>(plain),
          static_cast<double>(given) - static_cast<double>(counts.rejected),
          0,
          "traced",
          "Of 30 rays with a nan, an infinity or 1e30, those that reach the tracer: a nan is not "
          "larger than anything, and Embree with assertions ends the program for it."};
}

/// rms error of the share of a pixel beyond a straight edge, over many edges.
double edge_error(engine::SequenceKind kind) {
  constexpr int kEdges = 400;
  constexpr std::uint32_t kSamples = 64;
  double sum2 = 0;
  for (int i = 0; i < kEdges; ++i) {
    engine::Draws draws = draws_of(i);
    const double turn = 2.0 * engine::kPi * draws.uniform_double();
    const double c = std::cos(turn);
    const double s = std::sin(turn);
    const double at = 0.4 * (2.0 * draws.uniform_double() - 1.0);
    const auto beyond = [&](double x, double y) {
      return c * (x - 0.5) + s * (y - 0.5) > at ? 1.0 : 0.0;
    };
    double want = 0;
    constexpr int kFine = 200;
    for (int k = 0; k < kFine * kFine; ++k)
      want += beyond((k % kFine + 0.5) / kFine, (k / kFine + 0.5) / kFine) / (kFine * kFine);
    const engine::PlaceSequence places(kind, static_cast<std::uint32_t>(i));
    double got = 0;
    for (std::uint32_t k = 0; k < kSamples; ++k)
      got += beyond(static_cast<double>(places.at(k)[0]), static_cast<double>(places.at(k)[1])) /
             kSamples;
    sum2 += (got - want) * (got - want) / kEdges;
  }
  return std::sqrt(sum2);
}

Corner edges() {
  return {
      "an edge through a pixel",
      "64 random samples",
      edge_error(engine::SequenceKind::kIndependent),
      edge_error(engine::SequenceKind::kSobol),
      std::sqrt(15.0 * 0.25) / 64.0,
      "of 1",
      "Share of a pixel beyond a line, rms of 400 lines. The bound is that of one sample in each "
      "of 8 x 8 cells: a line cuts 15 at most, each with a variance of 1/4. Owen 1995."};
}

}  // namespace

Room render_corners() {
  const double far_origin = furthest_px(kFarOrigin_m, false);
  const double at_camera = furthest_px(Vector3d::Zero(), false);
  const double ours = furthest_px(Vector3d::Zero(), true);
  return {"Rays and samples",
          {ray_places(far_origin, ours), from_camera(at_camera, ours), self_shadow(), thin_gap(),
           no_rays(), edges()}};
}

}  // namespace corners
