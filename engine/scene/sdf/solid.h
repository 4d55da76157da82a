#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace engine {

/// Signed distance to a surface, in metres: negative inside. Of a plane region: in z = 0.
using DistanceFunction = std::function<double(const Eigen::Vector3d&)>;

/// Its slope by central differences: a unit vector but where the function is not a distance.
[[nodiscard]] Eigen::Vector3d slope(const DistanceFunction& f, const Eigen::Vector3d& p_m,
                                    double step_m);
/// By Newton's method along the slope, at most a few steps of at most `reach_m` in all. False when
/// it does not get there.
[[nodiscard]] bool pull_to_zero(const DistanceFunction& f, double reach_m, double good_m,
                                Eigen::Vector3d& p_m);

/// A body with sharp edges: simple solids, moved, united, cut off each other.
///
/// Distances of the simple ones are exact, outside corners too (Quilez 2019, "3D SDF functions");
/// those of a union are exact outside, of other combinations a bound, with the right sign and a
/// slope of at most 1. Each solid's border is cut from a few smooth surfaces, its faces: what a
/// mesher needs to find edges as places where two of them meet.
class Solid {
 public:
  /// Centred on the origin; the axis of what is round is x. Pre: sizes > 0, finite.
  [[nodiscard]] static Solid box(const Eigen::Vector3d& size_m);
  [[nodiscard]] static Solid sphere(double radius_m);
  [[nodiscard]] static Solid torus(double ring_radius_m, double tube_radius_m);
  [[nodiscard]] static Solid cylinder(double radius_m, double length_m);
  /// From `from_radius_m` at -x to `to_radius_m` at +x; one of them may be 0: a tip.
  [[nodiscard]] static Solid cone(double from_radius_m, double to_radius_m, double length_m);

  [[nodiscard]] Solid moved(const Eigen::Isometry3d& pose) const;
  [[nodiscard]] Solid united(const Solid& other) const;
  [[nodiscard]] Solid cut_by(const Solid& other) const;  ///< without the other
  [[nodiscard]] Solid shared(const Solid& other) const;  ///< what is in both

  [[nodiscard]] double distance_m(const Eigen::Vector3d& p_m) const noexcept;
  [[nodiscard]] bool holds(const Eigen::Vector3d& p_m) const noexcept {
    return distance_m(p_m) < 0.0;
  }
  /// Simple solids and operations together.
  [[nodiscard]] std::size_t nodes() const noexcept { return nodes_.size(); }
  [[nodiscard]] std::size_t faces() const noexcept { return faces_.size(); }
  /// Of the whole smooth surface that a face is cut from; positive where it looks to, outwards.
  [[nodiscard]] double face_distance_m(std::size_t face, const Eigen::Vector3d& p_m) const noexcept;
  /// Unit; zero on an axis or a tip, where there is none.
  [[nodiscard]] Eigen::Vector3d face_normal(std::size_t face,
                                            const Eigen::Vector3d& p_m) const noexcept;
  /// Points that are sharp without an edge, and the face of each.
  struct Tip {
    Eigen::Vector3d place_m = Eigen::Vector3d::Zero();
    std::size_t face = 0;
  };
  [[nodiscard]] std::vector<Tip> tips() const;
  [[nodiscard]] const Eigen::AlignedBox3d& bounds_m() const noexcept { return bounds_m_; }

 private:
  enum class Kind : std::uint8_t { kBox, kSphere, kTorus, kCone, kUnion, kCut, kShared };
  enum class Surface : std::uint8_t { kPlane, kSphere, kTorus, kCone };
  /// In postfix order: an operation's two operands stand before it.
  struct Node {
    Kind kind = Kind::kBox;
    Eigen::Vector3d size_m = Eigen::Vector3d::Zero();
    Eigen::Isometry3d to_own = Eigen::Isometry3d::Identity();
  };
  struct Face {
    Surface surface = Surface::kPlane;
    Eigen::Vector3d size_m = Eigen::Vector3d::Zero();
    Eigen::Isometry3d to_own = Eigen::Isometry3d::Identity();
    double sign = 1.0;
  };
  Solid() = default;
  void add_plane(const Eigen::Vector3d& normal, double offset_m);
  [[nodiscard]] Solid joined(const Solid& other, Kind how) const;
  [[nodiscard]] static double own_distance_m(const Node& node, const Eigen::Vector3d& p_m) noexcept;

  std::vector<Node> nodes_;
  std::vector<Face> faces_;
  Eigen::AlignedBox3d bounds_m_;
};

}  // namespace engine
