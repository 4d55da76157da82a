#include "engine/scene/target_builder.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "engine/core/constants.h"

namespace engine {
namespace {

using Eigen::Vector3d;
using Pose = Eigen::Isometry3d;

}  // namespace

void TargetBuilder::choose(const std::string& material, const std::string& group) {
  material_ = target_.mesh.material(material);
  std::vector<std::string>& names = target_.group_names;
  const auto it = std::find(names.begin(), names.end(), group);
  group_ = static_cast<std::uint32_t>(it - names.begin());
  if (it == names.end()) names.push_back(group);
}

std::uint32_t TargetBuilder::vertex(const Vector3d& p_m) {
  target_.mesh.vertices.emplace_back(p_m.cast<float>());
  return static_cast<std::uint32_t>(target_.mesh.vertices.size() - 1);
}

void TargetBuilder::triangle(std::uint32_t a, std::uint32_t b, std::uint32_t c) {
  target_.mesh.triangles.push_back({{a, b, c}, material_});
  target_.group.push_back(group_);
}

void TargetBuilder::box(const Pose& pose, const Vector3d& size_m) {
  std::array<std::uint32_t, 8> v{};  // bit 0: +x, bit 1: +y, bit 2: +z
  for (std::size_t i = 0; i < 8; ++i) {
    const Vector3d side((i & 1U) != 0 ? 0.5 : -0.5, (i & 2U) != 0 ? 0.5 : -0.5,
                        (i & 4U) != 0 ? 0.5 : -0.5);
    v[i] = vertex(pose * side.cwiseProduct(size_m));
  }
  quad(v[0], v[4], v[6], v[2]);
  quad(v[1], v[3], v[7], v[5]);
  quad(v[0], v[1], v[5], v[4]);
  quad(v[2], v[6], v[7], v[3]);
  quad(v[0], v[2], v[3], v[1]);
  quad(v[4], v[5], v[7], v[6]);
}

void TargetBuilder::revolve(const Pose& pose, const std::vector<Ring>& outline,
                            const Sweep& sweep) {
  const double step_rad = 2.0 * kPi / sweep.segments;
  const int facets = sweep.part ? sweep.part->facets : sweep.segments;
  const double from_rad = sweep.part ? sweep.part->middle_rad - 0.5 * facets * step_rad : 0.0;
  const int columns = sweep.part ? facets + 1 : facets;
  const auto first = static_cast<std::uint32_t>(target_.mesh.vertices.size());
  for (const Ring& ring : outline) {
    for (int k = 0; k < columns; ++k) {
      const double angle = from_rad + k * step_rad;
      vertex(pose *
             Vector3d(ring.x_m, ring.radius_m * std::cos(angle), ring.radius_m * std::sin(angle)));
    }
  }
  const auto width = static_cast<std::uint32_t>(columns);
  for (std::uint32_t i = 0; i + 1 < outline.size(); ++i) {
    const std::uint32_t near = first + i * width;
    const std::uint32_t far = near + width;
    for (std::uint32_t k = 0; k < static_cast<std::uint32_t>(facets); ++k) {
      const std::uint32_t next = (k + 1) % width;
      // On the axis one of the two triangles has no area.
      if (outline[i].radius_m > 0.0) triangle(near + k, near + next, far + next);
      if (outline[i + 1].radius_m > 0.0) triangle(near + k, far + next, far + k);
    }
  }
}

void TargetBuilder::band(const Pose& pose, const Ring& low, const Ring& high, const Sweep& sweep) {
  const auto first = static_cast<std::uint32_t>(target_.mesh.vertices.size());
  revolve(pose,
          {{low.x_m, low.radius_m},
           {low.x_m, high.radius_m},
           {high.x_m, high.radius_m},
           {high.x_m, low.radius_m},
           {low.x_m, low.radius_m}},
          sweep);
  if (!sweep.part) return;
  const auto last = static_cast<std::uint32_t>(sweep.part->facets);
  const auto corner = [&](std::uint32_t ring, std::uint32_t k) {
    return first + ring * (last + 1) + k;
  };
  quad(corner(0, 0), corner(1, 0), corner(2, 0), corner(3, 0));
  quad(corner(3, last), corner(2, last), corner(1, last), corner(0, last));
}

void TargetBuilder::rod(const Pose& pose, const Vector3d& from_m, const Vector3d& to_m,
                        double radius_m, int segments) {
  const Vector3d along_m = to_m - from_m;
  const auto turn = Eigen::Quaterniond::FromTwoVectors(Vector3d::UnitX(), along_m);
  const double half_m = 0.5 * along_m.norm();
  Sweep sweep;
  sweep.segments = segments;
  revolve(pose * Pose(Eigen::Translation3d(0.5 * (from_m + to_m))) * Pose(turn),
          {{-half_m, 0.0}, {-half_m, radius_m}, {half_m, radius_m}, {half_m, 0.0}}, sweep);
}

void TargetBuilder::add(const Pose& pose, const Mesh& mesh) {
  const auto first = static_cast<std::uint32_t>(target_.mesh.vertices.size());
  for (const Eigen::Vector3f& p : mesh.vertices) vertex(pose * p.cast<double>());
  for (const Mesh::Triangle& t : mesh.triangles)
    triangle(first + t.corner[0], first + t.corner[1], first + t.corner[2]);
}

}  // namespace engine
