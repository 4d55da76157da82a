// Surfaces and meshes.

#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include "engine/core/constants.h"
#include "engine/render/sobol.h"
#include "engine/scene/brdf.h"
#include "engine/scene/mesh_repair.h"
#include "engine/scene/sdf_mesher.h"
#include "tools/selftest/corner.h"
#include "tools/selftest/worst.h"

namespace corners {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;
using engine::Brdf;
using engine::BrdfSampler;
using engine::FiveParameters;
using engine::kDegree;
using engine::kPi;

/// Table 3 of Li et al. 2023.
constexpr FiveParameters kPolyimide{0.458, -51.90, 28.38, 0.077, 1.865};

const Brdf& polyimide() {
  static const Brdf brdf(kPolyimide, Brdf::Variant::kPhysical);  // its tables take a while
  return brdf;
}

Vector3d tilted(double deg, double azimuth_deg = 0.0) {
  const double t = deg * kDegree;
  const double a = azimuth_deg * kDegree;
  return {std::sin(t) * std::cos(a), std::sin(t) * std::sin(a), std::cos(t)};
}

/// Eq 7 term by term, alpha and gamma exchanged so that the lobe is at the mirror.
double printed(const Vector3d& in, const Vector3d& out) {
  const FiveParameters& p = kPolyimide;
  const Vector3d h = (in + out).normalized();
  const double cos_alpha = in.dot(h);
  const double masking = std::min(1.0, 2.0 * h.z() * std::min(in.z(), out.z()) / cos_alpha);
  const double fresnel = p.kr * p.kr * cos_alpha / (1.0 + (p.kr * p.kr - 1.0) * cos_alpha);
  const double lobe = std::exp(p.br * std::pow(1.0 - h.z(), p.ar));
  return p.kb * lobe * fresnel * masking / (in.z() * out.z()) + p.kd / in.z();
}

Corner grazing() {
  int plain = 0;
  int ours = 0;
  const auto bad = [](double f) { return !(std::isfinite(f) && f >= 0.0); };
  for (const double in_deg : {0.0, 45.0, 89.9, 89.9999, 90.0}) {
    for (const double out_deg : {0.0, 45.0, 89.9, 89.9999, 90.0}) {
      Vector3d in = tilted(in_deg);
      Vector3d out = tilted(out_deg, 180.0);
      if (in_deg == 90.0) in.z() = 0.0;
      if (out_deg == 90.0) out.z() = 0.0;
      plain += bad(printed(in, out) * in.z()) ? 1 : 0;
      ours += bad(polyimide().eval(in, out) * in.z()) ? 1 : 0;
    }
  }
  return {
      "BRDF, grazing light",
      "1 / (cos cos), as printed",
      static_cast<double>(plain),
      static_cast<double>(ours),
      0,
      "bad",
      "Of 25 pairs of directions up to 90 deg, those whose reflected light is no number or below "
      "0. Li et al. 2023, eq 7, DOI 10.3788/IRLA20230351."};
}

/// The share of light that comes in along `in` and leaves anywhere.
template <class Function>
double furnace(const Function& f, double in_deg) {
  constexpr int kSteps = 400;
  const Vector3d in = tilted(in_deg);
  double sum = 0;
  for (int i = 0; i < kSteps; ++i) {
    // Even in cos^2: cosine and solid angle are in the measure.
    const double z = std::sqrt((i + 0.5) / kSteps);
    for (int k = 0; k < kSteps; ++k) {
      const double azimuth = 2.0 * kPi * (k + 0.5) / kSteps;
      const double r = std::sqrt(1.0 - z * z);
      sum += f(in, Vector3d(r * std::cos(azimuth), r * std::sin(azimuth), z));
    }
  }
  return kPi * sum / (kSteps * kSteps);
}

Corner energy() {
  Worst plain;
  Worst ours;
  for (const double in_deg : {0.0, 30.0, 60.0, 76.0, 80.0, 85.0, 88.0}) {
    plain.add(furnace(printed, in_deg));
    ours.add(furnace([](const auto& i, const auto& o) { return polyimide().eval(i, o); }, in_deg));
  }
  return {"BRDF, light made of nothing",
          "kd / cos, as printed",
          plain.value(),
          ours.value(),
          1.01,
          "of it",
          "Largest share of light that leaves polyimide, from 0 to 88 deg, by a sum over 160000 "
          "directions, good to a hundredth. More than all is too much."};
}

Corner reciprocity() {
  Worst plain;
  Worst ours;
  for (const double a_deg : {10.0, 20.0, 45.0, 80.0}) {
    for (const double b_deg : {15.0, 50.0, 70.0}) {
      const Vector3d a = tilted(a_deg);
      const Vector3d b = tilted(b_deg, 130.0);
      plain.add(std::abs(printed(a, b) / printed(b, a) - 1.0));
      ours.add(std::abs(polyimide().eval(a, b) / polyimide().eval(b, a) - 1.0));
    }
  }
  return {"BRDF, both ways alike",
          "kd / cos, as printed",
          plain.value(),
          ours.value(),
          1e-12,
          "of it",
          "f(in, out) / f(out, in) - 1, Helmholtz's law. The bound is some 4500 roundings: powers "
          "and an exponential of up to 50."};
}

/// The light that a sampler finds, in white surroundings.
double sampled_albedo(BrdfSampler how, double out_deg, std::uint32_t count) {
  const engine::SequenceKind sobol = engine::SequenceKind::kSobol;
  double sum = 0;
  for (std::uint32_t i = 0; i < count; ++i) {
    const engine::SampleNumbers numbers(sobol, 11, i);
    sum += polyimide().sample(tilted(out_deg), how, numbers.pair(0), numbers.pair(1)[0]).weight;
  }
  return sum / count;
}

Corner cone() {
  Worst plain;
  Worst ours;
  for (const double deg : {5.0, 45.0, 70.0}) {
    const double want =
        furnace([](const auto& i, const auto& o) { return polyimide().eval(o, i); }, deg);
    plain.add(std::abs(sampled_albedo(BrdfSampler::kPaperCone, deg, 1 << 14) / want - 1.0));
    ours.add(std::abs(sampled_albedo(BrdfSampler::kMixture, deg, 1 << 14) / want - 1.0));
  }
  return {"bounces by the BRDF's lobe",
          "15 deg round the mirror",
          plain.value(),
          ours.value(),
          0.01,
          "of it",
          "Light that 2^14 draws find in white surroundings, against the sum over all directions, "
          "good to a hundredth: density 0 where the BRDF is not is a bias that no number of draws "
          "takes away. Veach 1997, section 9.2."};
}

engine::GroupedMesh cube() {
  engine::GroupedMesh grouped;
  engine::Mesh& mesh = grouped.mesh;
  for (unsigned i = 0; i < 8; ++i)
    mesh.vertices.emplace_back(static_cast<float>(i & 1U), static_cast<float>(i >> 1U & 1U),
                               static_cast<float>(i >> 2U));
  const std::uint32_t id = mesh.material("white");
  constexpr std::array<std::array<std::uint32_t, 4>, 6> kFaces{
      {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}}};
  for (const auto& f : kFaces) {
    mesh.triangles.push_back({{f[0], f[1], f[2]}, id});
    mesh.triangles.push_back({{f[0], f[2], f[3]}, id});
  }
  return grouped;
}

void finish(engine::GroupedMesh& grouped) {
  grouped.group_names = {"all"};
  grouped.group.assign(grouped.mesh.triangles.size(), 0);
}

/// By the theorem of divergence.
double volume_m3(const engine::Mesh& mesh) {
  double sum = 0;
  for (const auto& t : mesh.triangles) {
    const auto place = [&](int i) {
      return mesh.vertices[t.corner[static_cast<std::size_t>(i)]].cast<double>().eval();
    };
    sum += place(0).dot(place(1).cross(place(2))) / 6.0;
  }
  return sum;
}

Corner mended(const char* regime, const char* why, engine::GroupedMesh grouped) {
  finish(grouped);
  const double plain = volume_m3(grouped.mesh);
  engine::MeshReport report;
  engine::repair(grouped, {}, report);
  return {regime,
          "taken as it comes",
          std::abs(plain - 1.0),
          std::abs(volume_m3(grouped.mesh) - 1.0),
          1e-6,
          "m3",
          why};
}

Corner flipped_faces() {
  engine::GroupedMesh grouped = cube();
  for (std::size_t i = 0; i < grouped.mesh.triangles.size(); i += 3)
    std::swap(grouped.mesh.triangles[i].corner[1], grouped.mesh.triangles[i].corner[2]);
  return mended("a mesh with faces inside out",
                "Volume of a cube of 1 m, every third face turned over, less its own. The bound is "
                "eight roundings of single precision.",
                grouped);
}

Corner broken_faces() {
  engine::GroupedMesh grouped = cube();
  engine::Mesh& mesh = grouped.mesh;
  mesh.vertices.emplace_back(std::numeric_limits<float>::quiet_NaN(), 0.0F, 0.0F);
  mesh.triangles.push_back({{0, 1, 8}, 0});     // a corner that is no number
  mesh.triangles.push_back(mesh.triangles[4]);  // there twice
  mesh.triangles.push_back({{1, 1, 2}, 0});     // no area
  return mended(
      "a mesh with a nan, a face twice",
      "Volume of a cube of 1 m with three faces that are none, less its own. The bound is "
      "eight roundings of single precision.",
      grouped);
}

/// How far the nearest vertex is from a corner of a box, at the worst of the eight.
double corner_miss_m(const engine::SdfMesh& mesh, const Vector3d& half_m) {
  Worst worst;
  for (unsigned i = 0; i < 8; ++i) {
    const Vector3d corner((i & 1U) != 0 ? half_m.x() : -half_m.x(),
                          (i & 2U) != 0 ? half_m.y() : -half_m.y(),
                          (i & 4U) != 0 ? half_m.z() : -half_m.z());
    double nearest = HUGE_VAL;
    for (const Vector3d& p : mesh.places_m) nearest = std::min(nearest, (p - corner).norm());
    worst.add(nearest);
  }
  return worst.value();
}

Corner sharp_corners() {
  const Vector3d half_m(1.0, 0.7, 0.5);
  const engine::Solid box = engine::Solid::box(2.0 * half_m);
  const auto meshed = [&](engine::SdfMethod method) {
    return corner_miss_m(
        engine::mesh_shape(engine::surface_of(box), engine::even_edges(0.3, method)), half_m);
  };
  return {"corners of a signed distance",
          "marching tetrahedra",
          meshed(engine::SdfMethod::kLattice),
          meshed(engine::SdfMethod::kAuto),
          1e-9,
          "m",
          "How far the mesh of a box of 2 m, edges of .3 m, stays away from its eight corners: a "
          "lattice cuts them off. Ours goes from edges inwards; the bound is what Newton's method "
          "leaves. Persson and Strang 2004, DOI 10.1137/S0036144503429121."};
}

}  // namespace

Room scene_corners() {
  return {"Surfaces and meshes",
          {grazing(), energy(), reciprocity(), cone(), flipped_faces(), broken_faces(),
           sharp_corners()}};
}

}  // namespace corners
