#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include <Eigen/Core>

namespace engine {

/// How often something was found, and where first.
struct MeshDefect {
  static constexpr std::size_t kMostLines = 5;
  std::size_t count = 0;
  std::vector<std::uint32_t> lines;  ///< of the file, of the first few; none for a built-in mesh

  void add(std::uint32_t line);  ///< 0: no file
  [[nodiscard]] bool operator==(const MeshDefect&) const = default;
};

/// What a mesh was like and what was done about it: every defect is left out, mended or told.
///
/// Counts are of faces as the file has them: a quad is one, in however many triangles.
struct MeshReport {
  std::size_t vertices = 0;  ///< in the file
  std::size_t faces = 0;     ///< in the file, polygons of any number of corners

  // Left out: the image has nothing to lose.
  MeshDefect few_corners;  ///< faces of one or two
  MeshDefect not_finite;   ///< faces with a corner that is no number, or 1000 km away
  MeshDefect zero_area;    ///< faces of which a triangle or all are lower than the weld
  MeshDefect duplicate;    ///< faces on the corners of an earlier one, either side up
  std::size_t duplicate_of_other_material = 0;  ///< of these: the first face's material stays

  // Mended.
  std::size_t welded = 0;  ///< vertices that became one with an earlier vertex
  double weld_m = 0;       ///< as close as that
  MeshDefect flipped;      ///< faces turned round to face as their neighbours, or outwards
  MeshDefect tangled;      ///< polygons that cross themselves, cut as well as they can be

  // Told.
  MeshDefect open_edges;          ///< of one face only
  MeshDefect non_manifold_edges;  ///< of more than two
  MeshDefect t_junctions;         ///< vertices in the middle of another face's open edge: its line
  bool t_junctions_complete = true;  ///< or there may be more: too many edges to look
  MeshDefect slivers;                ///< triangles kSliver times as long as they are high
  MeshDefect not_faces;              ///< lines, points, curves: statements without a surface
  MeshDefect unknown;                ///< statements that are none of an OBJ file
  std::size_t not_looked = 0;        ///< open pieces that were not turned outwards: too many
  std::size_t one_sided = 0;         ///< pieces that no side can be told of (a Moebius strip)
  static constexpr double kSliver = 1000.0;

  // How it hangs together, with those triangles lower than the weld that have three corners: such
  // a one may close a gap. So `edges` is not that of the triangles that are left.
  std::size_t edges = 0;
  std::int64_t euler_characteristic = 0;  ///< vertices - edges + triangles: 2 for each ball
  std::size_t pieces = 0;                 ///< joined by edges of two faces
  std::size_t closed_pieces = 0;
  double volume_m3 = 0;  ///< of closed pieces; where two overlap it counts twice

  // What is left.
  std::size_t kept_vertices = 0;
  std::size_t triangles = 0;
  double area_m2 = 0;
  Eigen::Vector3d low_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d high_m = Eigen::Vector3d::Zero();

  /// What a user should look at: an implausible size, an origin far from the body.
  std::vector<std::string> warnings;

  /// An edge that is no part of a closed surface, for a picture.
  struct EdgePlace {
    std::array<Eigen::Vector3f, 2> end_m;
    bool open = true;  ///< or of more than two faces
  };
  static constexpr std::size_t kMostPlaces = 100'000;
  std::vector<EdgePlace> edge_places;  ///< the first kMostPlaces

  [[nodiscard]] std::size_t left_out() const noexcept {
    return few_corners.count + not_finite.count + zero_area.count + duplicate.count;
  }
  /// Nothing left out, turned, open, or of too many faces. Welding does not count: most exporters
  /// give each face corners of its own.
  [[nodiscard]] bool clean() const noexcept;
  /// A line for each thing that was left out or mended; empty: none.
  [[nodiscard]] std::vector<std::string> repairs() const;
  /// A line for each thing that is only told.
  [[nodiscard]] std::vector<std::string> remarks() const;
};

}  // namespace engine
