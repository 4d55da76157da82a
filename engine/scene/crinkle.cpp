#include "engine/scene/crinkle.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include <Eigen/Geometry>

#include "engine/core/constants.h"
#include "engine/core/random.h"

namespace engine {
namespace {

using Eigen::Vector3d;

// Of the folded noise, |n| over all space, measured: what makes its mean 0 and its rms 1.
constexpr double kMean = 0.1563;
constexpr double kRms = 0.1096;

double fade(double t) noexcept { return t * t * t * (t * (t * 6.0 - 15.0) + 10.0); }

Vector3d gradient_at(const Eigen::Array3i& cell, std::uint64_t seed) {
  const auto xy = static_cast<std::uint32_t>(cell.x()) * 73856093U ^
                  static_cast<std::uint32_t>(cell.y()) * 19349663U;
  Draws draws(seed, Stream::kCrinkle, xy, static_cast<std::uint32_t>(cell.z()));
  const double z = 2.0 * draws.uniform_double() - 1.0;
  const double angle = 2.0 * kPi * draws.uniform_double();
  const double r = std::sqrt(std::max(0.0, 1.0 - z * z));
  return {r * std::cos(angle), r * std::sin(angle), z};
}

double gradient_noise(const Vector3d& p, std::uint64_t seed) {
  const Eigen::Array3i cell = p.array().floor().cast<int>();
  const Vector3d in = p - cell.cast<double>().matrix();
  double sum = 0;
  for (int i = 0; i < 8; ++i) {
    const Eigen::Array3i corner(i & 1, (i >> 1) & 1, i >> 2);
    const Vector3d from = in - corner.cast<double>().matrix();
    double weight = 1.0;
    for (int k = 0; k < 3; ++k) weight *= fade(1.0 - std::abs(from[k]));
    sum += weight * gradient_at(cell + corner, seed).dot(from);
  }
  return sum;
}

}  // namespace

void crinkle(Mesh& mesh, const CrinkleSpec& spec) {
  std::vector<Vector3d> normal(mesh.vertices.size(), Vector3d::Zero());
  const auto place = [&](std::uint32_t v) -> Vector3d { return mesh.vertices[v].cast<double>(); };
  for (const Mesh::Triangle& t : mesh.triangles) {
    const Vector3d area =
        (place(t.corner[1]) - place(t.corner[0])).cross(place(t.corner[2]) - place(t.corner[0]));
    for (const std::uint32_t c : t.corner) normal[c] += area;
  }
  // Flat sheets stand along the axes; the noise is weak on its lattice's own planes.
  const Eigen::Matrix3d oblique =
      Eigen::AngleAxisd(1.0, Vector3d(1.0, 2.0, 3.0).normalized()).toRotationMatrix();
  for (std::uint32_t v = 0; v < mesh.vertices.size(); ++v) {
    const double length = normal[v].norm();
    if (!(length > 0.0)) continue;
    const Vector3d p = place(v);
    const Vector3d at = oblique * p / spec.length_m;
    const double folded = (std::abs(gradient_noise(at, spec.seed)) - kMean) / kRms;
    mesh.vertices[v] = (p + spec.height_m * folded / length * normal[v]).cast<float>();
  }
}

}  // namespace engine
