#include "engine/render/facets.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>

#include "engine/core/constants.h"

namespace engine {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Eigen::Vector3f;

constexpr double kCrease_rad = 40.0 * kDegree;
// A spread below this is a flat facet with rounding.
constexpr float kFlat_rad = 1e-3F;
// Beyond so many half widths from its top the lobe is at .2 % (polyimide of table 3), or less.
constexpr double kLobeReach = 11.0;
constexpr int kMostSteps = 48;
// The disc of the Sun shows where the half vector is this near to the lobe, in its half widths, and
// in none so wide, in radii of the disc.
constexpr double kDiscReach = 2.0;
constexpr double kDiscFades = 10.0;
constexpr int kDiscPoints = 32;

/// The i-th of any number of points that fill the square evenly: R2 (Roberts 2018).
std::array<float, 2> even_point(int i) noexcept {
  const double u = 0.5 + 0.7548776662466927 * i;
  const double v = 0.5 + 0.5698402909980532 * i;
  return {static_cast<float>(u - std::floor(u)), static_cast<float>(v - std::floor(v))};
}

}  // namespace

// Duff et al. 2017, Building an orthonormal basis, revisited, JCGT 6(1).
Matrix3d basis_round(const Vector3d& n) noexcept {
  const double sign = std::copysign(1.0, n.z());
  const double a = -1.0 / (sign + n.z());
  const double b = n.x() * n.y() * a;
  Matrix3d basis;
  basis.row(0) = Vector3d(1.0 + sign * n.x() * n.x() * a, sign * b, -sign * n.x());
  basis.row(1) = Vector3d(b, sign + n.y() * n.y() * a, -n.y());
  basis.row(2) = n;
  return basis;
}

Facets::Facets(const Mesh& mesh, std::vector<Brdf> brdfs)
    : brdfs_(std::move(brdfs)), known_(mesh.triangles.size()) {
  facets_.reserve(mesh.triangles.size());
  const std::vector<CornerNormals> normals = smooth_normals(mesh, kCrease_rad);
  for (const Mesh::Triangle& t : mesh.triangles) {
    const Vector3f& a = mesh.vertices[t.corner[0]];
    const Vector3f& b = mesh.vertices[t.corner[1]];
    const Vector3f& c = mesh.vertices[t.corner[2]];
    // gamma_7 of Pharr, Jakob & Humphreys 2016, section 3.9.4, on the largest coordinate, twice:
    // once for the place itself, once for the tracer's own rounding of the ray.
    const float size =
        std::max({a.cwiseAbs().maxCoeff(), b.cwiseAbs().maxCoeff(), c.cwiseAbs().maxCoeff()});
    const float offset_m = 2.0F * 3.0F * 7.0F * std::numeric_limits<float>::epsilon() * size;
    const Vector3d normal = (b - a).cast<double>().cross((c - a).cast<double>()).normalized();
    Facet facet{a, b - a, c - a, normal.cast<float>(), offset_m, t.material, {}, 0.0F};
    facet.normals = normals[facets_.size()];
    for (const Vector3f& n : facet.normals)
      facet.spread_rad = std::max(facet.spread_rad,
                                  static_cast<float>(angle_between_rad(n.cast<double>(), normal)));
    facets_.push_back(facet);
  }
}

void Facets::light_up(const BodyView& view, double sun_radius_rad) noexcept {
  ++view_;
  camera_ = view.camera.m;
  lamps_ = lamp_cones(view, sun_radius_rad);
}

std::array<float, kLamps> Facets::radiance(std::uint32_t triangle) const noexcept {
  constexpr auto kRelaxed = std::memory_order_relaxed;
  Known& known = known_[triangle];
  const std::atomic_ref view(known.view);
  std::array<float, kLamps> light{};
  // Acquire: the light was written before the view that it is of.
  if (view.load(std::memory_order_acquire) == view_) {
    for (std::size_t k = 0; k < kLamps; ++k)
      light[k] = std::atomic_ref(known.radiance[k]).load(kRelaxed);
    return light;
  }
  light = light_of(facets_[triangle]);
  for (std::size_t k = 0; k < kLamps; ++k)
    std::atomic_ref(known.radiance[k]).store(light[k], kRelaxed);
  view.store(view_, std::memory_order_release);
  return light;
}

double Facets::reflected(const Facet& facet, double side, const LampCone& lamp,
                         const Vector3d& to_camera) const noexcept {
  const Brdf& brdf = brdfs_[facet.material];
  const auto with = [&](const Vector3d& normal, const Vector3d& to_lamp) {
    const Matrix3d local = basis_round(normal);
    const Vector3d in = local * to_lamp;
    return in.z() > 0.0 ? brdf.eval(in, local * to_camera) * in.z() : 0.0;
  };
  const Vector3d normal = side * facet.normal.cast<double>();
  const double width_rad = brdf.lobe_half_width_rad();
  if (width_rad == 0.0) return with(normal, lamp.axis());
  const double off_mirror = angle_between_rad(normal, lamp.axis() + to_camera);
  const auto spread = static_cast<double>(facet.spread_rad);
  const bool curved =
      facet.spread_rad >= kFlat_rad && off_mirror <= spread + kLobeReach * width_rad;
  const double radius_rad = lamp.half_angle_rad();
  const bool disc = width_rad < kDiscFades * radius_rad &&
                    off_mirror <= spread + 0.5 * radius_rad + kDiscReach * width_rad;
  if (!curved && !disc) return with(normal, lamp.axis());
  // The mean over the middles of n^2 small triangles that the facet is cut into, and over points of
  // the disc: each triangle has its own, the more the fewer there are.
  const double steps = curved ? 2.0 * spread / width_rad : 1.0;
  const int n = static_cast<int>(std::clamp(std::ceil(steps), 1.0, 1.0 * kMostSteps));
  const int each = disc ? (kDiscPoints + n * n - 1) / (n * n) : 1;
  double sum = 0;
  int point = 0;
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < 2 * (n - i) - 1; ++j) {
      const int column = j / 2;
      const double middle = (j % 2 == 0 ? 1.0 : 2.0) / 3.0;  // of the two triangles of a square
      const double third = (i + middle) / n;
      const double second = (column + middle) / n;
      Vector3d smooth = normal;
      if (curved) {
        smooth = side * ((1.0 - second - third) * facet.normals[0].cast<double>() +
                         second * facet.normals[1].cast<double>() +
                         third * facet.normals[2].cast<double>())
                            .normalized();
      }
      for (int k = 0; k < each; ++k)
        sum += with(smooth,
                    disc ? Vector3d(lamp.sample(even_point(point++)).cast<double>()) : lamp.axis());
    }
  }
  return sum / (n * n * each);
}

std::array<float, kLamps> Facets::light_of(const Facet& facet) const noexcept {
  std::array<float, kLamps> light{};
  const Vector3d middle = (facet.corner + (facet.edge1 + facet.edge2) / 3.0F).cast<double>();
  const Vector3d to_camera = (camera_ - middle).normalized();
  const double side = facet.normal.cast<double>().dot(to_camera) >= 0.0 ? 1.0 : -1.0;
  for (std::size_t k = 0; k < kLamps; ++k) {
    if (!(lamps_[k].irradiance_w_m2() > 0.0)) continue;
    light[k] = static_cast<float>(lamps_[k].irradiance_w_m2() *
                                  reflected(facet, side, lamps_[k], to_camera));
  }
  return light;
}

SurfacePoint Facets::at(const MeshHit& hit, const Vector3f& direction) const noexcept {
  const Facet& facet = facets_[hit.triangle];
  return facet.seen_along(direction,
                          facet.corner + hit.second * facet.edge1 + hit.third * facet.edge2);
}

SurfacePoint Facets::on_plane(std::uint32_t triangle, const Vector3f& start,
                              const Vector3f& direction) const noexcept {
  const Facet& facet = facets_[triangle];
  const float along = facet.normal.dot(facet.corner - start) / facet.normal.dot(direction);
  return facet.seen_along(direction, start + along * direction);
}

std::array<float, 2> Facets::weights_at(std::uint32_t triangle,
                                        const Vector3f& place) const noexcept {
  const Facet& facet = facets_[triangle];
  const Vector3f from_corner = place - facet.corner;
  const float scale = 1.0F / facet.edge1.cross(facet.edge2).dot(facet.normal);
  return {scale * from_corner.cross(facet.edge2).dot(facet.normal),
          scale * facet.edge1.cross(from_corner).dot(facet.normal)};
}

SurfacePoint Facets::Facet::seen_along(const Vector3f& direction,
                                       const Vector3f& place) const noexcept {
  return {place, normal.dot(direction) > 0.0F ? Vector3f(-normal) : normal, material, offset_m};
}

}  // namespace engine
