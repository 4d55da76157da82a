#include "engine/render/facets.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace engine {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Eigen::Vector3f;

constexpr int kFacetsAShare = 256;

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
    : radiance_(mesh.triangles.size()), brdfs_(std::move(brdfs)) {
  facets_.reserve(mesh.triangles.size());
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
    facets_.push_back({a, b - a, c - a, normal.cast<float>(), offset_m, t.material});
  }
}

void Facets::light_up(const Snapshot& snapshot, WorkerPool& pool) noexcept {
  const int count = static_cast<int>(facets_.size());
  pool.rows(0, (count + kFacetsAShare - 1) / kFacetsAShare, [&](int share) {
    const int last = std::min(count, (share + 1) * kFacetsAShare);
    for (int i = share * kFacetsAShare; i < last; ++i)
      light_facet(snapshot, static_cast<std::size_t>(i));
  });
}

void Facets::light_facet(const Snapshot& snapshot, std::size_t index) noexcept {
  const Facet& facet = facets_[index];
  radiance_[index] = {};
  const Vector3d middle = (facet.corner + (facet.edge1 + facet.edge2) / 3.0F).cast<double>();
  const Vector3d to_camera = (snapshot.camera.m - middle).normalized();
  const Vector3d normal = facet.normal.cast<double>();
  const double side = normal.dot(to_camera) >= 0.0 ? 1.0 : -1.0;
  const Matrix3d local = basis_round(side * normal);
  const auto lamps = lamps_of(snapshot);
  for (std::size_t k = 0; k < kLamps; ++k) {
    const Vector3d in = local * lamps[k]->toward.unit;
    if (!(lamps[k]->irradiance_w_m2 > 0.0) || in.z() <= 0.0) continue;
    const double reflected = brdfs_[facet.material].eval(in, local * to_camera) * in.z();
    radiance_[index][k] = static_cast<float>(lamps[k]->irradiance_w_m2 * reflected);
  }
}

SurfacePoint Facets::at(const MeshHit& hit, const Vector3f& direction) const noexcept {
  const Facet& facet = facets_[hit.triangle];
  SurfacePoint point;
  point.place = facet.corner + hit.second * facet.edge1 + hit.third * facet.edge2;
  point.normal = facet.normal.dot(direction) > 0.0F ? Vector3f(-facet.normal) : facet.normal;
  point.material = facet.material;
  point.offset_m = facet.offset_m;
  return point;
}

}  // namespace engine
