#include "engine/scene/telescope.h"

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <span>
#include <utility>
#include <vector>

#include <Eigen/Geometry>

#include "engine/core/constants.h"

namespace engine {
namespace {

using Eigen::Vector3d;
using Pose = Eigen::Isometry3d;

// Where the outline changes, along x and from the axis.
constexpr double kAft_m = -6.6;
constexpr double kShroudEnd_m = -3.1;
constexpr double kEquipmentEnd_m = -1.5;
constexpr double kShellStart_m = -1.1;
constexpr double kShieldStart_m = 2.6;
constexpr double kAperture_m = 6.6;
constexpr double kStop_m = 1.0;  ///< the disc that closes the tube inside

constexpr double kLargestRadius_m = 2.1;  ///< over the shroud's doors and bands
constexpr double kShroudRadius_m = 2.06;
constexpr double kEquipmentRadius_m = 1.93;  ///< between the bays
constexpr double kShellRadius_m = 1.55;
constexpr double kShieldRadius_m = 1.51;
constexpr double kInnerRadius_m = 1.45;

constexpr double kDoorOpen_rad = 90.0 * kDegree;

constexpr double kWingTip_m = 6.85;
constexpr double kWingWidth_m = 2.6;
constexpr double kWingLength_m = 7.1;
constexpr double kWingGap_m = 0.2;  ///< between the two halves of a wing; the mast runs in it
constexpr double kPanelThickness_m = 0.04;
constexpr double kMastX_m = 0.4;

constexpr double kAntennaX_m = -0.6;
constexpr double kAntennaReach_m = 4.4;  ///< of the dish's back, from the axis
constexpr double kDishRadius_m = 0.65;

constexpr int kRoundSegments = 72;
constexpr double kSegment_rad = 2.0 * kPi / kRoundSegments;
constexpr int kRodSegments = 12;

Pose moved(double x, double y, double z) { return Pose(Eigen::Translation3d(x, y, z)); }

Pose turned(double angle_rad, const Vector3d& axis) {
  return Pose(Eigen::AngleAxisd(angle_rad, axis));
}

/// A corner of an outline that is turned about x, and what the stretch after it is made of.
struct Ring {
  double x_m = 0;
  double radius_m = 0;  ///< >= 0
  std::uint32_t material = 0;
};

/// How far an outline is turned: from +y towards +z, in steps.
struct Sweep {
  double from_rad = 0;
  double step_rad = kSegment_rad;
  int segments = kRoundSegments;
  bool closed = true;  ///< the last step ends where the first began
};

constexpr Sweep whole_turn(int segments) { return {0.0, 2.0 * kPi / segments, segments, true}; }

/// Part of a turn about `middle_rad` whose facets are as wide as those of the tube.
constexpr Sweep part_turn(double middle_rad, int segments) {
  return {middle_rad - 0.5 * segments * kSegment_rad, kSegment_rad, segments, false};
}

struct Between {
  double from_m = 0;
  double to_m = 0;
};

/// Adds solids to a mesh, each placed by a pose.
class Builder {
 public:
  [[nodiscard]] Mesh mesh() && { return std::move(mesh_); }
  [[nodiscard]] std::uint32_t silicon() const { return silicon_; }
  [[nodiscard]] std::uint32_t polyimide() const { return polyimide_; }
  [[nodiscard]] std::uint32_t black() const { return black_; }

  /// Centred on the pose's origin.
  void box(const Pose& pose, const Vector3d& size_m, std::uint32_t material);
  /// Turns an outline about x. Walked to +x with the radius upwards, the solid is on the right.
  void revolve(const Pose& pose, std::span<const Ring> outline, const Sweep& sweep);
  /// A band about x, or a part of one with its two ends closed.
  void band(const Pose& pose, Between x, Between radius, const Sweep& sweep,
            std::uint32_t material);
  void disc(const Pose& pose, double thickness_m, double radius_m, int segments);
  void rod(const Pose& pose, const Vector3d& from_m, const Vector3d& to_m, double radius_m);

 private:
  std::uint32_t vertex(const Vector3d& p_m);
  void triangle(std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t material) {
    mesh_.triangles.push_back({{a, b, c}, material});
  }
  void quad(std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d,
            std::uint32_t material) {
    triangle(a, b, c, material);
    triangle(a, c, d, material);
  }

  Mesh mesh_;
  std::uint32_t silicon_ = mesh_.material("silicon");
  std::uint32_t polyimide_ = mesh_.material("polyimide");
  std::uint32_t black_ = mesh_.material("black");
};

std::uint32_t Builder::vertex(const Vector3d& p_m) {
  mesh_.vertices.emplace_back(p_m.cast<float>());
  return static_cast<std::uint32_t>(mesh_.vertices.size() - 1);
}

void Builder::box(const Pose& pose, const Vector3d& size_m, std::uint32_t material) {
  std::array<std::uint32_t, 8> v{};  // bit 0: +x, bit 1: +y, bit 2: +z
  for (std::size_t i = 0; i < 8; ++i) {
    const Vector3d side((i & 1U) != 0 ? 0.5 : -0.5, (i & 2U) != 0 ? 0.5 : -0.5,
                        (i & 4U) != 0 ? 0.5 : -0.5);
    v[i] = vertex(pose * side.cwiseProduct(size_m));
  }
  quad(v[0], v[4], v[6], v[2], material);
  quad(v[1], v[3], v[7], v[5], material);
  quad(v[0], v[1], v[5], v[4], material);
  quad(v[2], v[6], v[7], v[3], material);
  quad(v[0], v[2], v[3], v[1], material);
  quad(v[4], v[5], v[7], v[6], material);
}

void Builder::revolve(const Pose& pose, std::span<const Ring> outline, const Sweep& sweep) {
  const int columns = sweep.closed ? sweep.segments : sweep.segments + 1;
  const auto first = static_cast<std::uint32_t>(mesh_.vertices.size());
  for (const Ring& ring : outline) {
    for (int k = 0; k < columns; ++k) {
      const double angle = sweep.from_rad + k * sweep.step_rad;
      vertex(pose *
             Vector3d(ring.x_m, ring.radius_m * std::cos(angle), ring.radius_m * std::sin(angle)));
    }
  }
  const auto width = static_cast<std::uint32_t>(columns);
  for (std::uint32_t i = 0; i + 1 < outline.size(); ++i) {
    const std::uint32_t near = first + i * width;
    const std::uint32_t far = near + width;
    for (std::uint32_t k = 0; k < static_cast<std::uint32_t>(sweep.segments); ++k) {
      const std::uint32_t next = (k + 1) % width;
      // On the axis one of the two triangles has no area.
      if (outline[i].radius_m > 0.0)
        triangle(near + k, near + next, far + next, outline[i].material);
      if (outline[i + 1].radius_m > 0.0)
        triangle(near + k, far + next, far + k, outline[i].material);
    }
  }
}

void Builder::band(const Pose& pose, Between x, Between radius, const Sweep& sweep,
                   std::uint32_t material) {
  const std::vector<Ring> outline = {{x.from_m, radius.from_m, material},
                                     {x.from_m, radius.to_m, material},
                                     {x.to_m, radius.to_m, material},
                                     {x.to_m, radius.from_m, material},
                                     {x.from_m, radius.from_m, material}};
  const auto first = static_cast<std::uint32_t>(mesh_.vertices.size());
  revolve(pose, outline, sweep);
  if (sweep.closed) return;
  const auto last = static_cast<std::uint32_t>(sweep.segments);
  const std::uint32_t width = last + 1;
  const auto corner = [&](std::uint32_t ring, std::uint32_t k) { return first + ring * width + k; };
  quad(corner(0, 0), corner(1, 0), corner(2, 0), corner(3, 0), material);
  quad(corner(3, last), corner(2, last), corner(1, last), corner(0, last), material);
}

void Builder::disc(const Pose& pose, double thickness_m, double radius_m, int segments) {
  const double half_m = 0.5 * thickness_m;
  const std::vector<Ring> outline = {{-half_m, 0.0, polyimide_},
                                     {-half_m, radius_m, polyimide_},
                                     {half_m, radius_m, polyimide_},
                                     {half_m, 0.0, polyimide_}};
  revolve(pose, outline, whole_turn(segments));
}

void Builder::rod(const Pose& pose, const Vector3d& from_m, const Vector3d& to_m, double radius_m) {
  const Vector3d along_m = to_m - from_m;
  const Vector3d middle_m = 0.5 * (from_m + to_m);
  const auto turn = Eigen::Quaterniond::FromTwoVectors(Vector3d::UnitX(), along_m);
  disc(pose * moved(middle_m.x(), middle_m.y(), middle_m.z()) * Pose(turn), along_m.norm(),
       radius_m, kRodSegments);
}

/// x stays, +y turns outwards: what is built at y = radius stands on the tube at that angle.
Pose around(double angle_rad) { return turned(angle_rad, Vector3d::UnitX()); }

/// One closed outline: up the aft bulkhead, along the outside, over the rim and down the inside.
void add_body(Builder& b) {
  const std::vector<Ring> outline = {{kAft_m, 0.0, b.polyimide()},
                                     {kAft_m, kShroudRadius_m - 0.08, b.polyimide()},
                                     {kAft_m + 0.08, kShroudRadius_m, b.polyimide()},
                                     {kShroudEnd_m, kShroudRadius_m, b.polyimide()},
                                     {kShroudEnd_m, kEquipmentRadius_m, b.polyimide()},
                                     {kEquipmentEnd_m, kEquipmentRadius_m, b.polyimide()},
                                     {kShellStart_m, kShellRadius_m, b.polyimide()},
                                     {kShieldStart_m, kShellRadius_m, b.polyimide()},
                                     {kShieldStart_m, kShieldRadius_m, b.polyimide()},
                                     {kAperture_m, kShieldRadius_m, b.polyimide()},
                                     {kAperture_m, kInnerRadius_m, b.black()},
                                     {kStop_m, kInnerRadius_m, b.black()},
                                     {kStop_m, 0.0, b.black()}};
  b.revolve(Pose::Identity(), outline, whole_turn(kRoundSegments));
  const auto ring = [&](Between x, Between radius, std::uint32_t material) {
    b.band(Pose::Identity(), x, radius, whole_turn(kRoundSegments), material);
  };
  for (const double x_m : {1.9, 3.4, 4.9})
    ring({x_m, x_m + 0.02}, {1.15, kInnerRadius_m + 0.02}, b.black());
  for (const double x_m : {kAft_m + 0.3, -4.85, kShroudEnd_m - 0.12})
    ring({x_m, x_m + 0.12}, {kShroudRadius_m - 0.03, kLargestRadius_m}, b.polyimide());
  for (const double x_m : {kShieldStart_m - 0.14, 3.9, 5.2, kAperture_m - 0.16})
    ring({x_m, x_m + 0.12}, {kShieldRadius_m - 0.03, kShellRadius_m + 0.04}, b.polyimide());
}

void add_bays_and_doors(Builder& b) {
  // Twelve equipment bays, a facet's width between them.
  for (int i = 0; i < 12; ++i) {
    b.band(Pose::Identity(), {kShroudEnd_m + 0.1, kEquipmentEnd_m - 0.1},
           {kEquipmentRadius_m - 0.03, kShroudRadius_m}, part_turn(i * kPi / 6.0, 5),
           b.polyimide());
  }
  // Doors of the guidance sensors (three) and of the instruments behind them (four).
  for (const double angle_deg : {0.0, 90.0, 180.0}) {
    b.band(Pose::Identity(), {-4.6, -3.35}, {kShroudRadius_m - 0.03, kLargestRadius_m},
           part_turn(angle_deg * kDegree, 10), b.polyimide());
  }
  for (const double angle_deg : {45.0, 135.0, 225.0, 315.0}) {
    b.band(Pose::Identity(), {-6.05, -4.95}, {kShroudRadius_m - 0.03, kLargestRadius_m},
           part_turn(angle_deg * kDegree, 9), b.polyimide());
  }
}

/// Three berthing pins, the umbilical plate and ports.
void add_aft_bulkhead(Builder& b) {
  for (const double angle_deg : {90.0, 210.0, 330.0})
    b.rod(around(angle_deg * kDegree), {kAft_m + 0.1, 1.1, 0}, {kAft_m - 0.22, 1.1, 0}, 0.07);
  b.band(Pose::Identity(), {kAft_m - 0.06, kAft_m + 0.02}, {0.8, 0.9}, whole_turn(kRoundSegments),
         b.polyimide());
  b.box(moved(kAft_m, 0.0, -1.45), {0.3, 0.9, 0.5}, b.polyimide());
  b.box(moved(kAft_m, 1.35, 0.45), {0.2, 0.5, 0.7}, b.polyimide());
  b.box(moved(kAft_m, -1.35, 0.45), {0.2, 0.5, 0.7}, b.polyimide());
  b.box(moved(kAft_m, 0.0, 0.1), {0.16, 0.5, 0.35}, b.polyimide());
}

/// A bar parallel to the tube, held off its surface by two feet.
void add_bar(Builder& b, double angle_rad, Between x, double surface_m, double radius_m) {
  const Pose pose = around(angle_rad);
  const double y_m = surface_m + 0.07 + radius_m;
  b.rod(pose, {x.from_m, y_m, 0}, {x.to_m, y_m, 0}, radius_m);
  for (const double foot_m : {x.from_m + 0.15, x.to_m - 0.15}) {
    b.box(pose * moved(foot_m, 0.5 * (surface_m - 0.05 + y_m), 0),
          {0.08, y_m - surface_m + 0.05, 1.6 * radius_m}, b.polyimide());
  }
}

void add_outfit(Builder& b) {
  // Magnetic torquers on the forward shell; handrails on the light shield.
  for (const double angle_deg : {45.0, 135.0, 225.0, 315.0})
    add_bar(b, angle_deg * kDegree, {-0.9, 1.6}, kShellRadius_m, 0.07);
  for (const double angle_deg : {30.0, 70.0, 110.0, 150.0, 210.0, 330.0})
    add_bar(b, angle_deg * kDegree, {2.85, 6.2}, kShieldRadius_m, 0.025);
  for (const double angle_deg : {70.0, 110.0})
    b.box(around(angle_deg * kDegree) * moved(2.1, kShellRadius_m + 0.1, 0), {0.5, 0.3, 0.4},
          b.polyimide());
  // Magnetometers, near the aperture.
  for (const double angle_deg : {250.0, 290.0})
    b.box(around(angle_deg * kDegree) * moved(5.6, kShieldRadius_m + 0.1, 0), {0.3, 0.25, 0.25},
          b.polyimide());
}

/// The hinge is at the rim on the -z side, so that the open door stands between Sun and aperture.
void add_door(Builder& b) {
  constexpr double kThickness_m = 0.08;
  constexpr double kFromHinge_m = kShieldRadius_m + 0.12;
  const Pose hinge = moved(kAperture_m + 0.5 * kThickness_m, 0, -kFromHinge_m);
  const Pose door = hinge * turned(kDoorOpen_rad, Vector3d::UnitY());
  b.disc(door * moved(0, 0, kFromHinge_m), kThickness_m, kShieldRadius_m + 0.02, kRoundSegments);
  b.band(door * moved(0, 0, kFromHinge_m), {-0.06, 0.06},
         {kShieldRadius_m - 0.06, kShieldRadius_m + 0.03}, whole_turn(kRoundSegments),
         b.polyimide());
  b.rod(hinge, {0, -0.55, 0}, {0, 0.55, 0}, 0.06);
  for (const double y_m : {-0.4, 0.4}) {
    b.box(hinge * moved(-0.3, y_m, 0.06), {0.6, 0.14, 0.16}, b.polyimide());
    b.box(door * moved(0.05, y_m, 0.3), {0.08, 0.14, 0.6}, b.polyimide());
  }
}

/// Half a wing, centred: a stiff panel with cells in modules on its -z face.
void add_panel(Builder& b, const Pose& pose, double length_m) {
  constexpr int kModulesAlong = 4;
  constexpr int kModulesAcross = 2;
  constexpr double kMargin_m = 0.05;
  constexpr double kCellThickness_m = 0.01;
  b.box(pose, {length_m, kWingWidth_m, kPanelThickness_m}, b.polyimide());
  const double pitch_x_m = (length_m - kMargin_m) / kModulesAlong;
  const double pitch_y_m = (kWingWidth_m - kMargin_m) / kModulesAcross;
  for (int i = 0; i < kModulesAlong; ++i) {
    for (int j = 0; j < kModulesAcross; ++j) {
      b.box(pose * moved((i - 0.5 * (kModulesAlong - 1)) * pitch_x_m,
                         (j - 0.5 * (kModulesAcross - 1)) * pitch_y_m, -0.5 * kPanelThickness_m),
            {pitch_x_m - kMargin_m, pitch_y_m - kMargin_m, kCellThickness_m}, b.silicon());
    }
  }
}

/// In a frame whose +y points along the mast; x to -x changes nothing, so half a turn about z
/// mirrors it.
void add_wing(Builder& b, const Pose& pose) {
  constexpr double kHalf_m = 0.5 * (kWingLength_m - kWingGap_m);
  constexpr double kMiddle_m = kWingTip_m - 0.5 * kWingWidth_m;
  b.rod(pose, {0, kShellRadius_m - 0.1, 0}, {0, kWingTip_m - 0.02, 0}, 0.065);
  b.rod(pose, {0, kShellRadius_m - 0.1, 0}, {0, kShellRadius_m + 0.45, 0}, 0.2);
  b.box(pose * moved(0, kShellRadius_m, 0), {0.7, 0.3, 0.6}, b.polyimide());
  for (const double side : {-1.0, 1.0})
    add_panel(b, pose * moved(side * 0.5 * (kHalf_m + kWingGap_m), kMiddle_m, 0), kHalf_m);
  for (const double across_m : {-1.2, 0.0, 1.2})
    b.box(pose * moved(0, kMiddle_m + across_m, 0.02), {kWingGap_m + 0.3, 0.12, 0.1},
          b.polyimide());
}

/// A paraboloid of even thickness along its axis, opening towards +x.
void add_dish(Builder& b, const Pose& pose) {
  constexpr int kSteps = 6;
  constexpr int kSegments = 36;
  constexpr double kDepth_m = 0.22;
  constexpr double kThickness_m = 0.03;
  std::vector<Ring> outline;
  const auto add = [&](int step, double offset_m) {
    const double s = static_cast<double>(step) / kSteps;
    outline.push_back({offset_m + kDepth_m * s * s, kDishRadius_m * s, b.polyimide()});
  };
  for (int i = 0; i <= kSteps; ++i) add(i, 0.0);
  for (int i = kSteps; i >= 0; --i) add(i, kThickness_m);
  b.revolve(pose, outline, whole_turn(kSegments));
  b.rod(pose, {0, 0, 0}, {0.42, 0, 0}, 0.03);
  b.disc(pose * moved(0.42, 0, 0), 0.05, 0.1, kRodSegments);
}

/// In a frame whose +z points along the boom.
void add_antenna(Builder& b, const Pose& pose) {
  b.box(pose * moved(0, 0, kShellRadius_m), {0.4, 0.4, 0.3}, b.polyimide());
  b.rod(pose, {0, 0, kShellRadius_m - 0.1}, {0, 0, kAntennaReach_m}, 0.05);
  b.box(pose * moved(0, 0, kAntennaReach_m - 0.15), {0.22, 0.22, 0.3}, b.polyimide());
  add_dish(b, pose * moved(0, 0, kAntennaReach_m) * turned(-0.5 * kPi, Vector3d::UnitY()));
}

}  // namespace

Mesh telescope_mesh() {
  Builder b;
  add_body(b);
  add_bays_and_doors(b);
  add_aft_bulkhead(b);
  add_outfit(b);
  add_door(b);
  for (const double side_rad : {0.0, kPi}) {
    add_wing(b, moved(kMastX_m, 0, 0) * turned(side_rad, Vector3d::UnitZ()));
    add_antenna(b, moved(kAntennaX_m, 0, 0) * turned(side_rad, Vector3d::UnitX()));
  }
  return std::move(b).mesh();
}

}  // namespace engine
