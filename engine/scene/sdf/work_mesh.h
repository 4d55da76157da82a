#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <unordered_set>
#include <vector>

#include <Eigen/Core>

#include "engine/scene/sdf/delaunay.h"

namespace engine {

/// How long edges should be at a place, in metres, > 0.
using SizeFunction = std::function<double(const Eigen::Vector3d&)>;

/// Twice the radius of the circle in a triangle over that of the circle round it: 1 when it is
/// even, 0 when it is flat.
[[nodiscard]] double radius_ratio(const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                                  const Eigen::Vector3d& c) noexcept;
/// Along the normal, as long as the area.
[[nodiscard]] Eigen::Vector3d area_vector(const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                                          const Eigen::Vector3d& c) noexcept;

/// A triangle mesh while it is being made: edges are flipped, split and collapsed, and it stays as
/// closed and as connected as it was. Every edge belongs to two triangles, or to one: a rim.
class WorkMesh {
 public:
  enum class Hold : std::uint8_t {
    kFree,
    kSlides,  ///< stays where it is, but may be collapsed along its crease
    kFixed,   ///< a corner
  };
  struct Vertex {
    Eigen::Vector3d place_m = Eigen::Vector3d::Zero();
    std::uint32_t sheet = 0;  ///< the smooth surface that it lies on
    Hold hold = Hold::kFree;
  };
  struct Edge {
    std::uint32_t a = 0;
    std::uint32_t b = 0;
  };

  std::uint32_t add_vertex(const Vertex& vertex);
  void add_triangle(const Corners& corners, std::uint32_t sheet = 0);
  /// Another mesh's triangles, all free, on one sheet.
  void append(const WorkMesh& other, std::uint32_t sheet);
  /// An edge that may not be flipped: a crease.
  void lock(std::uint32_t a, std::uint32_t b) { locked_.insert(key(a, b)); }
  [[nodiscard]] bool locked(std::uint32_t a, std::uint32_t b) const {
    return locked_.contains(key(a, b));
  }
  /// Holds every vertex of a rim, and locks its edges.
  void hold_rims();

  [[nodiscard]] std::size_t vertices() const noexcept { return vertices_.size(); }
  [[nodiscard]] Vertex& vertex(std::uint32_t v) noexcept { return vertices_[v]; }
  [[nodiscard]] const Vertex& vertex(std::uint32_t v) const noexcept { return vertices_[v]; }
  [[nodiscard]] const Eigen::Vector3d& place(std::uint32_t v) const noexcept {
    return vertices_[v].place_m;
  }
  /// Some are dead: see alive().
  [[nodiscard]] const std::vector<Corners>& triangles() const noexcept { return triangles_; }
  [[nodiscard]] bool alive(std::uint32_t t) const noexcept {
    return triangles_[t][0] != triangles_[t][1];
  }
  [[nodiscard]] const std::vector<std::uint32_t>& round(std::uint32_t v) const noexcept {
    return round_[v];
  }
  [[nodiscard]] double quality(std::uint32_t t) const noexcept;
  /// The smallest at a vertex; 1 where there is no triangle.
  [[nodiscard]] double worst_round(std::uint32_t v) const noexcept;
  [[nodiscard]] std::vector<Edge> edges() const;
  [[nodiscard]] std::vector<std::uint32_t> neighbours(std::uint32_t v) const;

  /// Of a triangle there: what a new vertex in the middle of the edge lies on. Pre: it is an edge.
  [[nodiscard]] std::uint32_t sheet_at(const Edge& edge) const {
    return sheet_[at_edge(edge.a, edge.b)[0]];
  }
  /// The worst quality among the triangles that a collapse would leave at `to`.
  [[nodiscard]] double worst_after_collapse(std::uint32_t from, std::uint32_t to) const;

  /// Moves a vertex unless a triangle would fold, or look away from `up`.
  bool move(std::uint32_t v, const Eigen::Vector3d& place_m, const Eigen::Vector3d& up);

  /// These three do nothing, and say false, where the mesh would fold or change its topology.
  /// Only by the criterion of Delaunay: the angles across the edge add up to over half a turn; or,
  /// `for_quality`, where the worse of two triangles gets better.
  bool flip(const Edge& edge, bool for_quality);
  /// `from` goes; its triangles hang on `to`.
  bool collapse(std::uint32_t from, std::uint32_t to);
  /// At `place_m`, near its middle. Not for rims.
  bool split(const Edge& edge, const Eigen::Vector3d& place_m);

 private:
  [[nodiscard]] static std::uint64_t key(std::uint32_t a, std::uint32_t b) noexcept;
  /// The triangles at an edge; more than two where the mesh is not a surface.
  [[nodiscard]] std::vector<std::uint32_t> at_edge(std::uint32_t a, std::uint32_t b) const;
  [[nodiscard]] std::uint32_t across(std::uint32_t t, std::uint32_t a,
                                     std::uint32_t b) const noexcept;
  /// Whether a triangle at v would, were v moved.
  [[nodiscard]] bool turns_over(std::uint32_t v, const Corners& old,
                                const Eigen::Vector3d& place_m) const;
  [[nodiscard]] bool folds(std::uint32_t from, std::uint32_t to) const;
  void attach(std::uint32_t t);
  void detach(std::uint32_t t);

  std::vector<Vertex> vertices_;
  std::vector<Corners> triangles_;
  std::vector<std::uint32_t> sheet_;  ///< by triangle
  std::vector<std::vector<std::uint32_t>> round_;
  std::unordered_set<std::uint64_t> locked_;
};

}  // namespace engine
