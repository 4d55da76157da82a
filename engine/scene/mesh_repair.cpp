#include "engine/scene/mesh_repair.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <iterator>
#include <limits>

#include <Eigen/Geometry>

#include "engine/scene/mesh_facing.h"
#include "engine/scene/mesh_junctions.h"
#include "engine/scene/mesh_topology.h"
#include "engine/scene/vertex_places.h"

namespace engine {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;

constexpr float kLargestCoordinate_m = 1e6F;
constexpr double kWeldShare = 1e-6;
constexpr double kFinestWeld_m = 1e-12;  // below it cells of a grid could not be numbered
constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

double median(std::vector<double>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::ranges::nth_element(values, middle);
  return *middle;
}

/// The median distance from the median vertex, of vertices that are numbers; 0: there are none.
double size_m(const std::vector<Vector3f>& vertices) {
  std::vector<double> values;
  values.reserve(vertices.size());
  Vector3d centre = Vector3d::Zero();
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    values.clear();
    for (const Vector3f& v : vertices)
      if (v.allFinite()) values.push_back(v[axis]);
    if (values.empty()) return 0;
    centre[axis] = median(values);
  }
  values.clear();
  for (const Vector3f& v : vertices)
    if (v.allFinite()) values.push_back((v.cast<double>() - centre).norm());
  return median(values);
}

class Repair {
 public:
  Repair(GroupedMesh& grouped, std::vector<std::uint32_t> line, MeshReport& report)
      : grouped_(grouped), mesh_(grouped.mesh), line_(std::move(line)), report_(report) {
    line_.resize(mesh_.triangles.size(), 0);
    grouped_.group.resize(mesh_.triangles.size(), 0);
  }

  void drop_unusable() {
    for (Vector3f& v : mesh_.vertices)
      if (!v.allFinite() || v.cwiseAbs().maxCoeff() >= kLargestCoordinate_m)
        v.setConstant(std::numeric_limits<float>::quiet_NaN());
    std::vector<bool> wrong(mesh_.triangles.size());
    for (std::size_t t = 0; t < wrong.size(); ++t)
      wrong[t] = std::ranges::any_of(mesh_.triangles[t].corner, [this](std::uint32_t corner) {
        return !mesh_.vertices[corner].allFinite();
      });
    spread_over_faces(wrong);
    count_faces(report_.not_finite, wrong);
    leave_out(wrong);
  }

  void weld() {
    report_.weld_m = kWeldShare * size_m(mesh_.vertices);
    if (!(report_.weld_m >= kFinestWeld_m)) report_.weld_m = 0;
    const std::vector<std::uint32_t> first = first_at_place(mesh_.vertices, report_.weld_m);
    for (std::uint32_t i = 0; i < first.size(); ++i)
      if (first[i] != i) ++report_.welded;
    for (Mesh::Triangle& t : mesh_.triangles)
      for (std::uint32_t& corner : t.corner) corner = first[corner];
    leave_out_flat([this](std::size_t t) {
      const auto& [a, b, c] = mesh_.triangles[t].corner;
      return a == b || b == c || c == a;
    });
  }

  void drop_duplicates() {
    std::vector<std::uint32_t> chains(std::bit_ceil(mesh_.triangles.size() + 1), kNone);
    std::vector<std::uint32_t> next(mesh_.triangles.size(), kNone);
    std::vector<bool> wrong(mesh_.triangles.size(), false);
    std::vector<bool> of_other_material(mesh_.triangles.size(), false);
    for (std::uint32_t t = 0; t < wrong.size(); ++t) {
      const auto corners = sorted_corners(t);
      std::uint64_t hash = 0;
      for (const std::uint32_t corner : corners)
        hash = ((hash ^ corner) * 0x9E3779B97F4A7C15U) ^ (hash >> 29);
      std::uint32_t& chain = chains[(hash ^ hash >> 32) & (chains.size() - 1)];
      std::uint32_t first = chain;
      while (first != kNone && sorted_corners(first) != corners) first = next[first];
      wrong[t] = first != kNone;
      if (wrong[t]) {
        of_other_material[t] = mesh_.triangles[first].material != mesh_.triangles[t].material;
      } else {
        next[t] = chain;
        chain = t;
      }
    }
    count_faces(report_.duplicate, wrong);
    MeshDefect other_material;
    count_faces(other_material, of_other_material);
    report_.duplicate_of_other_material = other_material.count;
    leave_out(wrong);
  }

  void face_alike() {
    const MeshTopology topology(mesh_);
    tell_edges(topology);
    tell_junctions(topology);
    const Facing facing = facing_of(mesh_, topology);
    report_.pieces = topology.pieces().size();
    report_.closed_pieces = facing.closed_pieces;
    report_.one_sided = facing.one_sided;
    report_.not_looked = facing.not_looked;
    report_.volume_m3 = facing.volume_m3;
    count_faces(report_.flipped, facing.turn);
    for (std::size_t t = 0; t < mesh_.triangles.size(); ++t)
      if (facing.turn[t]) std::swap(mesh_.triangles[t].corner[1], mesh_.triangles[t].corner[2]);
  }

  void drop_flat() {
    leave_out_flat([this](std::size_t t) {
      const auto [area_m2, longest_m] = area_and_longest(t);
      return !(2.0 * area_m2 > longest_m * report_.weld_m);
    });
    std::ranges::sort(flat_lines_);
    tell_lines(report_.zero_area, flat_lines_);
    for (std::size_t t = 0; t < mesh_.triangles.size(); ++t) {
      const auto [area_m2, longest_m] = area_and_longest(t);
      report_.area_m2 += area_m2;
      if (longest_m * longest_m > MeshReport::kSliver * 2.0 * area_m2)
        report_.slivers.add(line_[t]);
    }
    report_.triangles = mesh_.triangles.size();
  }

  void drop_unused() {
    std::vector<std::uint32_t> moved_to(mesh_.vertices.size(), kNone);
    for (const Mesh::Triangle& t : mesh_.triangles)
      for (const std::uint32_t corner : t.corner) moved_to[corner] = 0;
    std::uint32_t kept = 0;
    Eigen::AlignedBox3d box;
    for (std::uint32_t i = 0; i < moved_to.size(); ++i) {
      if (moved_to[i] == kNone) continue;
      mesh_.vertices[kept] = mesh_.vertices[i];
      box.extend(mesh_.vertices[i].cast<double>());
      moved_to[i] = kept++;
    }
    mesh_.vertices.resize(kept);
    for (Mesh::Triangle& t : mesh_.triangles)
      for (std::uint32_t& corner : t.corner) corner = moved_to[corner];
    drop_unused_materials();
    report_.kept_vertices = kept;
    if (kept == 0) return;
    report_.low_m = box.min();
    report_.high_m = box.max();
  }

 private:
  [[nodiscard]] Vector3d corner(std::size_t t, std::size_t k) const {
    return mesh_.vertices[mesh_.triangles[t].corner[k]].cast<double>();
  }
  [[nodiscard]] std::array<std::uint32_t, 3> sorted_corners(std::size_t t) const {
    auto corners = mesh_.triangles[t].corner;
    std::ranges::sort(corners);
    return corners;
  }
  [[nodiscard]] std::pair<double, double> area_and_longest(std::size_t t) const {
    const Vector3d ab = corner(t, 1) - corner(t, 0);
    const Vector3d ac = corner(t, 2) - corner(t, 0);
    const double longest2_m2 =
        std::max({ab.squaredNorm(), ac.squaredNorm(), (ac - ab).squaredNorm()});
    return {0.5 * ab.cross(ac).norm(), std::sqrt(longest2_m2)};
  }

  /// Triangles of one face have one line, which is no other's, and stand together: they count once.
  static void tell_lines(MeshDefect& defect, const std::vector<std::uint32_t>& lines) {
    for (std::size_t i = 0; i < lines.size(); ++i)
      if (i == 0 || lines[i] == 0 || lines[i] != lines[i - 1]) defect.add(lines[i]);
  }
  [[nodiscard]] std::vector<std::uint32_t> lines_of(const std::vector<bool>& wrong) const {
    std::vector<std::uint32_t> lines;
    for (std::size_t t = 0; t < wrong.size(); ++t)
      if (wrong[t]) lines.push_back(line_[t]);
    return lines;
  }
  void count_faces(MeshDefect& defect, const std::vector<bool>& wrong) const {
    tell_lines(defect, lines_of(wrong));
  }

  /// To the other triangles of the face that one is of.
  void spread_over_faces(std::vector<bool>& wrong) const {
    for (std::size_t t = 0; t < wrong.size();) {
      std::size_t end = t + 1;
      while (end < wrong.size() && line_[t] != 0 && line_[end] == line_[t]) ++end;
      const auto from = wrong.begin() + static_cast<std::ptrdiff_t>(t);
      const auto to = wrong.begin() + static_cast<std::ptrdiff_t>(end);
      if (std::find(from, to, true) != to) std::fill(from, to, true);
      t = end;
    }
  }

  /// Keeps the others, in their order.
  void leave_out(const std::vector<bool>& wrong) {
    std::size_t kept = 0;
    for (std::size_t t = 0; t < wrong.size(); ++t) {
      if (wrong[t]) continue;
      mesh_.triangles[kept] = mesh_.triangles[t];
      grouped_.group[kept] = grouped_.group[t];
      line_[kept++] = line_[t];
    }
    mesh_.triangles.resize(kept);
    grouped_.group.resize(kept);
    line_.resize(kept);
  }

  template <class Flat>
  void leave_out_flat(const Flat& is_flat) {
    std::vector<bool> wrong(mesh_.triangles.size());
    for (std::size_t t = 0; t < wrong.size(); ++t) wrong[t] = is_flat(t);
    std::ranges::copy(lines_of(wrong), std::back_inserter(flat_lines_));
    leave_out(wrong);
  }

  void tell_edges(const MeshTopology& topology) {
    std::vector<bool> used(mesh_.vertices.size(), false);
    for (const Mesh::Triangle& t : mesh_.triangles)
      for (const std::uint32_t corner : t.corner) used[corner] = true;
    report_.edges = topology.edges();
    report_.euler_characteristic = std::ranges::count(used, true) -
                                   static_cast<std::int64_t>(topology.edges()) +
                                   static_cast<std::int64_t>(mesh_.triangles.size());
    std::array<std::vector<std::uint32_t>, 2> lines;
    for (const MeshTopology::Edge& edge : topology.odd_edges()) {
      const bool open = edge.uses == 1;
      lines[open ? 1 : 0].push_back(line_[edge.triangle]);
      if (report_.edge_places.size() < MeshReport::kMostPlaces)
        report_.edge_places.push_back(
            {{mesh_.vertices[edge.vertex[0]], mesh_.vertices[edge.vertex[1]]}, open});
    }
    // Edges come by their vertices; the file's first lines are wanted.
    for (std::vector<std::uint32_t>& some : lines) std::ranges::sort(some);
    for (const std::uint32_t line : lines[0]) report_.non_manifold_edges.add(line);
    for (const std::uint32_t line : lines[1]) report_.open_edges.add(line);
  }

  void tell_junctions(const MeshTopology& topology) {
    const MeshJunctions junctions = junctions_of(mesh_, topology, report_.weld_m);
    report_.t_junctions_complete = junctions.complete;
    std::vector<std::uint32_t> lines;
    for (const MeshJunctions::Junction& junction : junctions.found)
      lines.push_back(line_[junction.triangle]);
    std::ranges::sort(lines);
    for (const std::uint32_t line : lines) report_.t_junctions.add(line);
  }

  void drop_unused_materials() {
    std::vector<std::uint32_t> moved_to(mesh_.material_names.size(), kNone);
    for (const Mesh::Triangle& t : mesh_.triangles) moved_to[t.material] = 0;
    std::uint32_t kept = 0;
    for (std::uint32_t i = 0; i < moved_to.size(); ++i) {
      if (moved_to[i] == kNone) continue;
      if (kept != i) mesh_.material_names[kept] = std::move(mesh_.material_names[i]);
      moved_to[i] = kept++;
    }
    mesh_.material_names.resize(kept);
    for (Mesh::Triangle& t : mesh_.triangles) t.material = moved_to[t.material];
  }

  GroupedMesh& grouped_;
  Mesh& mesh_;
  std::vector<std::uint32_t> line_;
  std::vector<std::uint32_t> flat_lines_;  ///< of triangles without area
  MeshReport& report_;
};

}  // namespace

void repair(GroupedMesh& grouped, std::vector<std::uint32_t> line, MeshReport& report) {
  Repair repair(grouped, std::move(line), report);
  repair.drop_unusable();
  repair.weld();
  repair.drop_duplicates();
  repair.face_alike();
  repair.drop_flat();
  repair.drop_unused();
}

}  // namespace engine
