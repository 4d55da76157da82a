#pragma once

#include <cstdint>
#include <vector>

#include "engine/scene/material.h"
#include "engine/scene/mesh.h"

namespace engine {

/// A mesh in fewer triangles, and how rough the surface is that they stand for.
struct SimplifiedMesh {
  /// What a material of the simplified mesh stands for.
  struct Surface {
    std::uint32_t original = 0;  ///< material of the mesh that was simplified
    /// Of its normals round the simplified ones, rms in each direction; 0: not worth telling.
    double spread_rad = 0;
  };
  Mesh mesh;
  std::vector<Surface> surfaces;    ///< by the simplified mesh's material
  std::vector<Material> materials;  ///< the same, with lobes as wide as they have become; measured
                                    ///< ones cannot be widened
  /// How far the surface that was simplified is from this one, by its area.
  double rms_m = 0;
  double largest_m = 0;  ///< the same, of the furthest place
};

/// Makes a mesh coarser, as often as asked: what a camera far away need not tell apart.
///
/// Edges collapse in the order of their quadric error (meshoptimizer; Garland and Heckbert 1997,
/// DOI 10.1145/258734.258849), each material for itself. Then vertices move along the normals to
/// where the surface fits the original best (after Hoppe et al. 1993, DOI 10.1145/166117.166119):
/// one that is simply kept would stand for all round it with its own wrinkle.
///
/// What is lost are normals. A facet knows how those of the smooth surface that the original stands
/// for (smooth_normals) spread round its own, and its material's lobe becomes as much wider: the
/// mean of a lobe over normally distributed normals is, to second order, the lobe of the sum of the
/// variances (Toksvig 2005, DOI 10.1080/2151237X.2005.10129203; Olano and Baker 2010,
/// DOI 10.1145/1730804.1730834). Each material becomes a few, by classes of this spread. Lobes that
/// wrinkles have made twice as wide stay as they are, and so do all where the spread is above
/// 8 deg: there normals lie on both sides of an edge, and no lobe stands for them.
/// Leaves out: that normals are not spread normally, nor alike in all directions: at the top of a
/// lobe much narrower than the spread light is off by tens of per cent; what the spread does to
/// diffuse light, a change by spread^2 (tan in tan out cos azimuth - 1), .3 % at 3 deg in upright
/// light; cracks between materials as wide as the change.
class MeshSimplifier {
 public:
  /// `materials` must name every material of the mesh: ConfigError otherwise. The mesh outlives it.
  MeshSimplifier(const Mesh& mesh, const std::vector<Material>& materials);

  /// The surfaces differ by no more than `rms_m`, by area, and nowhere by more than fifty times
  /// that or, if it is more, a four hundredth of the radius; the mesh as it is where that cannot be
  /// had in fewer triangles. The same bits each time. Pre: rms_m > 0.
  [[nodiscard]] SimplifiedMesh to(double rms_m) const;

 private:
  struct Sample;
  struct Distances;
  [[nodiscard]] Mesh collapsed(double error_m) const;
  [[nodiscard]] std::vector<Sample> samples_on(const Mesh& mesh, double reach_m,
                                               std::uint32_t each) const;
  [[nodiscard]] static Distances distances_of(const std::vector<Sample>& samples) noexcept;
  [[nodiscard]] double error_for(double rms_m, double reach_m) const;
  [[nodiscard]] Eigen::Vector3f place_of(const Sample& sample) const noexcept;
  void fit(Mesh& mesh, const std::vector<Sample>& samples) const;
  void spread_normals(const std::vector<Sample>& samples, SimplifiedMesh& out) const;

  [[nodiscard]] SimplifiedMesh as_it_is() const;
  [[nodiscard]] std::size_t class_of(std::uint32_t material, double spread_rad) const noexcept;

  const Mesh& mesh_;
  std::vector<Material> materials_;      ///< by the mesh's material
  std::vector<CornerNormals> normals_;   ///< of the smooth surface, by triangle
  std::vector<Eigen::Vector3f> places_;  ///< of vertices, each once
  std::vector<std::uint32_t> place_;     ///< by vertex
};

}  // namespace engine
