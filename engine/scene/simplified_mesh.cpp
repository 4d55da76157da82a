#include "engine/scene/simplified_mesh.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <string>
#include <utility>

#include <meshoptimizer.h>

#include "engine/core/constants.h"
#include "engine/core/contract.h"
#include "engine/scene/nearest_facet.h"

namespace engine {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;

// Faces that meet at more are an edge, as Facets has it.
constexpr double kCrease_rad = 40.0 * kDegree;
// Places on a triangle whose mean is that of any quadratic over it: weights of its corners.
constexpr std::size_t kSamples = 3;
constexpr float kFar = 2.0F / 3.0F;
constexpr float kNear = 1.0F / 6.0F;
// So far is nothing looked for: of the rms distance asked for, or of the mesh's radius.
constexpr double kReach = 50.0;
constexpr double kLeastReach = 1.0 / 400.0;
// Errors that are tried, and how often the range between them is halved.
constexpr double kLeastError = 0.25;
constexpr double kLargestError = 16.0;
constexpr int kHalvings = 5;
// What the fit leaves of the rms distance, about.
constexpr double kLeftByFit = 0.7;
constexpr std::uint32_t kEachOfMany = 8;
constexpr int kMostTries = 4;
constexpr double kFinerBy = 0.8;
constexpr int kFitRounds = 8;
// Of the spread: less is none, and each class is twice the one before; beyond the last are edges.
constexpr double kLeastSpread_rad = 0.5 * kDegree;
constexpr std::size_t kClasses = 5;
constexpr double kMatters = 0.5;  ///< of the lobe's own wrinkles

std::array<float, 3> weights_of(std::size_t sample) noexcept {
  std::array<float, 3> weights{kNear, kNear, kNear};
  weights[sample] = kFar;
  return weights;
}

Vector3f twice_area(const Mesh& mesh, const Mesh::Triangle& t) noexcept {
  const Vector3f& a = mesh.vertices[t.corner[0]];
  return (mesh.vertices[t.corner[1]] - a).cross(mesh.vertices[t.corner[2]] - a);
}

Vector3f place_on(const Mesh& mesh, const NearestFacet::Place& place) noexcept {
  const auto& corner = mesh.triangles[place.triangle].corner;
  const Vector3f& a = mesh.vertices[corner[0]];
  return a + place.second * (mesh.vertices[corner[1]] - a) +
         place.third * (mesh.vertices[corner[2]] - a);
}

Vector3f normal_at(const CornerNormals& n, const std::array<float, 3>& weights) noexcept {
  return (weights[0] * n[0] + weights[1] * n[1] + weights[2] * n[2]).normalized();
}

/// Vertices that no triangle names are left out.
void drop_unused(Mesh& mesh) {
  constexpr std::uint32_t kUnused = 0xFFFFFFFFU;
  std::vector<std::uint32_t> now(mesh.vertices.size(), kUnused);
  std::vector<Vector3f> kept;
  for (Mesh::Triangle& t : mesh.triangles) {
    for (std::uint32_t& corner : t.corner) {
      if (now[corner] == kUnused) {
        now[corner] = static_cast<std::uint32_t>(kept.size());
        kept.push_back(mesh.vertices[corner]);
      }
      corner = now[corner];
    }
  }
  mesh.vertices = std::move(kept);
}

}  // namespace

/// A place of the original, and the nearest on the simplified surface.
struct MeshSimplifier::Sample {
  std::uint32_t triangle = 0;
  std::size_t which = 0;
  double area_m2 = 0;
  NearestFacet::Place nearest;  ///< none: out of reach, and that is its distance
};

struct MeshSimplifier::Distances {
  double rms_m = 0;
  double largest_m = 0;
};

MeshSimplifier::MeshSimplifier(const Mesh& mesh, const std::vector<Material>& materials)
    : mesh_(mesh), normals_(smooth_normals(mesh, kCrease_rad)) {
  for (const std::string& name : mesh.material_names) {
    const auto it = std::ranges::find(materials, name, &Material::name);
    if (it == materials.end()) throw ConfigError("there is no material \"" + name + "\"");
    materials_.push_back(*it);
  }
  std::map<std::array<float, 3>, std::uint32_t> at_place;
  for (const Vector3f& v : mesh.vertices) {
    // -0 and 0 are one place.
    const auto [it, added] = at_place.try_emplace({v.x() + 0.0F, v.y() + 0.0F, v.z() + 0.0F},
                                                  static_cast<std::uint32_t>(places_.size()));
    if (added) places_.push_back(v);
    place_.push_back(it->second);
  }
}

SimplifiedMesh MeshSimplifier::as_it_is() const {
  SimplifiedMesh out;
  out.mesh = mesh_;
  for (std::uint32_t i = 0; i < mesh_.material_names.size(); ++i) out.surfaces.push_back({i, 0.0});
  out.materials = materials_;
  return out;
}

/// 0: its lobe stays as it is.
std::size_t MeshSimplifier::class_of(std::uint32_t material, double spread_rad) const noexcept {
  const Material& m = materials_[material];
  const double least_rad = std::max(kLeastSpread_rad, kMatters * m.wrinkle_rad);
  if (!(m.shines() && m.table == nullptr && spread_rad >= least_rad)) return 0;
  const auto spread_class = 1 + static_cast<std::size_t>(std::log2(spread_rad / kLeastSpread_rad));
  return spread_class < kClasses ? spread_class : 0;
}

SimplifiedMesh MeshSimplifier::to(double rms_m) const {
  ENSURE(rms_m > 0.0);
  const double reach_m = std::max(kReach * rms_m, kLeastReach * mesh_.bounding_radius_m());
  double error_m = error_for(rms_m, reach_m);
  for (int i = 0; i < kMostTries; ++i, error_m *= kFinerBy) {
    SimplifiedMesh out;
    out.mesh = collapsed(error_m);
    if (out.mesh.triangles.size() >= mesh_.triangles.size()) break;
    fit(out.mesh, samples_on(out.mesh, reach_m, 1));
    const std::vector<Sample> samples = samples_on(out.mesh, reach_m, 1);
    const Distances distances = distances_of(samples);
    if (!(distances.rms_m <= rms_m && distances.largest_m < reach_m)) continue;
    out.rms_m = distances.rms_m;
    out.largest_m = distances.largest_m;
    spread_normals(samples, out);
    return out;
  }
  return as_it_is();
}

/// Of the quadrics: with which the surfaces are likely to differ by so much when they are fitted.
double MeshSimplifier::error_for(double rms_m, double reach_m) const {
  double low_m = kLeastError * rms_m;
  double high_m = kLargestError * rms_m;
  for (int i = 0; i < kHalvings; ++i) {
    const double middle_m = std::sqrt(low_m * high_m);
    const Mesh tried = collapsed(middle_m);
    const Distances d = distances_of(samples_on(tried, reach_m, kEachOfMany));
    (kLeftByFit * d.rms_m > rms_m ? high_m : low_m) = middle_m;
  }
  return low_m;
}

/// Each material for itself. What lies at one place is one vertex: two would be taken for a seam.
Mesh MeshSimplifier::collapsed(double error_m) const {
  Mesh out;
  out.material_names = mesh_.material_names;
  out.vertices = places_;
  if (mesh_.triangles.empty()) return out;
  constexpr std::size_t kStride = sizeof(Vector3f);
  const float* places = places_.front().data();
  const std::size_t count = places_.size();
  const double scale_m = static_cast<double>(meshopt_simplifyScale(places, count, kStride));
  for (std::uint32_t m = 0; m < mesh_.material_names.size(); ++m) {
    std::vector<unsigned> corners;
    for (const Mesh::Triangle& t : mesh_.triangles) {
      if (t.material != m) continue;
      for (const std::uint32_t corner : t.corner) corners.push_back(place_[corner]);
    }
    std::vector<unsigned> left(corners.size());
    const std::size_t used =
        corners.empty() || !(scale_m > 0.0)
            ? 0
            : meshopt_simplify(left.data(), corners.data(), corners.size(), places, count, kStride,
                               0, static_cast<float>(error_m / scale_m), 0, nullptr);
    for (std::size_t k = 0; k + 2 < used; k += 3) {
      const Mesh::Triangle t{{left[k], left[k + 1], left[k + 2]}, m};
      if (twice_area(out, t).norm() > 0.0F) out.triangles.push_back(t);
    }
  }
  drop_unused(out);
  return out;
}

Vector3f MeshSimplifier::place_of(const Sample& sample) const noexcept {
  const auto& corner = mesh_.triangles[sample.triangle].corner;
  const auto weights = weights_of(sample.which);
  return weights[0] * mesh_.vertices[corner[0]] + weights[1] * mesh_.vertices[corner[1]] +
         weights[2] * mesh_.vertices[corner[2]];
}

/// On one triangle of `each`.
std::vector<MeshSimplifier::Sample> MeshSimplifier::samples_on(const Mesh& mesh, double reach_m,
                                                               std::uint32_t each) const {
  const NearestFacet nearest(mesh, reach_m);
  std::vector<Sample> samples;
  samples.reserve(kSamples * mesh_.triangles.size() / each + kSamples);
  for (std::uint32_t i = 0; i < mesh_.triangles.size(); i += each) {
    const Vector3f normal = twice_area(mesh_, mesh_.triangles[i]);
    const double area_m2 = 0.5 * static_cast<double>(normal.norm());
    if (!(area_m2 > 0.0)) continue;
    for (std::size_t k = 0; k < kSamples; ++k) {
      Sample sample{i, k, area_m2 / kSamples, {}};
      sample.nearest = nearest.find(place_of(sample), normal, mesh_.triangles[i].material);
      if (sample.nearest.triangle == NearestFacet::kNone)
        sample.nearest.distance_m = static_cast<float>(reach_m);
      samples.push_back(sample);
    }
  }
  return samples;
}

MeshSimplifier::Distances MeshSimplifier::distances_of(
    const std::vector<Sample>& samples) noexcept {
  double area_m2 = 0;
  double squares = 0;
  Distances out;
  for (const Sample& sample : samples) {
    const auto distance_m = static_cast<double>(sample.nearest.distance_m);
    area_m2 += sample.area_m2;
    squares += sample.area_m2 * distance_m * distance_m;
    out.largest_m = std::max(out.largest_m, distance_m);
  }
  out.rms_m = area_m2 > 0.0 ? std::sqrt(squares / area_m2) : 0.0;
  return out;
}

/// Least squares by simultaneous corrections: each vertex moves by the mean of what is missing
/// round it, along the facets' normals.
void MeshSimplifier::fit(Mesh& mesh, const std::vector<Sample>& samples) const {
  std::vector<Vector3d> missing(mesh.vertices.size());
  std::vector<double> weight(mesh.vertices.size());
  std::vector<Vector3f> normals(mesh.triangles.size());
  for (int round = 0; round < kFitRounds; ++round) {
    std::fill(missing.begin(), missing.end(), Vector3d::Zero());
    std::fill(weight.begin(), weight.end(), 0.0);
    for (std::size_t i = 0; i < normals.size(); ++i)
      normals[i] = twice_area(mesh, mesh.triangles[i]).normalized();
    for (const Sample& sample : samples) {
      const NearestFacet::Place& at = sample.nearest;
      if (at.triangle == NearestFacet::kNone) continue;
      const Vector3f& normal = normals[at.triangle];
      const auto off = static_cast<double>(normal.dot(place_of(sample) - place_on(mesh, at)));
      const std::array<float, 3> shares{1.0F - at.second - at.third, at.second, at.third};
      for (std::size_t c = 0; c < 3; ++c) {
        const std::uint32_t corner = mesh.triangles[at.triangle].corner[c];
        const double share = sample.area_m2 * static_cast<double>(shares[c]);
        missing[corner] += share * off * normal.cast<double>();
        weight[corner] += share;
      }
    }
    for (std::size_t i = 0; i < mesh.vertices.size(); ++i)
      if (weight[i] > 0.0) mesh.vertices[i] += (missing[i] / weight[i]).cast<float>();
  }
  std::erase_if(mesh.triangles,
                [&](const Mesh::Triangle& t) { return !(twice_area(mesh, t).norm() > 0.0F); });
}

/// The materials of the mesh, by classes of the spread.
void MeshSimplifier::spread_normals(const std::vector<Sample>& samples, SimplifiedMesh& out) const {
  struct Sums {
    double area = 0;
    double squares = 0;
    [[nodiscard]] double rms() const noexcept { return area > 0.0 ? std::sqrt(squares / area) : 0; }
  };
  const std::vector<CornerNormals> smooth = smooth_normals(out.mesh, kCrease_rad);
  std::vector<Sums> of_facet(out.mesh.triangles.size());
  for (const Sample& sample : samples) {
    const NearestFacet::Place& at = sample.nearest;
    if (at.triangle == NearestFacet::kNone) continue;
    const Vector3f was = normal_at(normals_[sample.triangle], weights_of(sample.which));
    const Vector3f is =
        normal_at(smooth[at.triangle], {1.0F - at.second - at.third, at.second, at.third});
    const Vector3f apart = was.dot(is) < 0.0F ? Vector3f(-was - is) : Vector3f(was - is);
    // Two directions share it. Not a number: a fold, which has no normal.
    const double each = 0.5 * static_cast<double>(apart.squaredNorm());
    if (!std::isfinite(each)) continue;
    of_facet[at.triangle].area += sample.area_m2;
    of_facet[at.triangle].squares += sample.area_m2 * each;
  }
  std::vector<std::array<Sums, kClasses>> of_class(mesh_.material_names.size());
  for (std::size_t i = 0; i < of_facet.size(); ++i) {
    Sums& sums = of_class[out.mesh.triangles[i].material]
                         [class_of(out.mesh.triangles[i].material, of_facet[i].rms())];
    sums.area += of_facet[i].area;
    sums.squares += of_facet[i].squares;
  }
  out.mesh.material_names.clear();
  for (std::size_t i = 0; i < of_facet.size(); ++i) {
    std::uint32_t& material = out.mesh.triangles[i].material;
    const std::uint32_t original = material;
    const std::size_t spread = class_of(original, of_facet[i].rms());
    std::string name = mesh_.material_names[original];
    if (spread > 0) name += ", spread " + std::to_string(spread);
    material = out.mesh.material(name);
    if (material < out.surfaces.size()) continue;
    const double spread_rad = spread > 0 ? of_class[original][spread].rms() : 0.0;
    out.surfaces.push_back({original, spread_rad});
    out.materials.push_back(materials_[original]);
    out.materials.back().name = name;
    out.materials.back().wrinkle_rad = std::hypot(materials_[original].wrinkle_rad, spread_rad);
  }
}

}  // namespace engine
