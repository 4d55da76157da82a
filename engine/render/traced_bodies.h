#pragma once

#include <memory>
#include <vector>

#include "engine/render/other_bodies.h"
#include "engine/render/traced_target.h"
#include "engine/scene/snapshot.h"

namespace engine {

/// What the rays of a packet meet, and whose it is.
struct BodyHits {
  std::array<MeshHit, RayPacket::kLanes> hit;
  std::array<std::uint8_t, RayPacket::kLanes> body{};
};

/// The target, its companions and their parts as rays meet them, in this order; body 0 is the
/// target.
///
/// A ray starts at a body and runs in its axes. Where it can meet another body's bounding sphere,
/// it is taken there in double, moved up to the sphere, and traced in single precision in that
/// body's own axes: over kilometres single precision would cost a millimetre, and nothing is lost
/// so. No frame builds a tree, and bodies of one mesh share theirs. Rays that miss all spheres cost
/// a few products; a target alone costs nothing more than before. Thread: any, but for place() and
/// light_up(): loop. Loop-safe but for the constructor.
class TracedBodies {
 public:
  static constexpr std::size_t kMost = 1 + kMostCompanions + kMostParts;

  /// Pre: at most kMostCompanions and kMostParts.
  TracedBodies(std::shared_ptr<TracedTarget> target, const OtherBodies& others);

  [[nodiscard]] std::size_t count() const noexcept { return bodies_.size(); }
  [[nodiscard]] const TracedTarget& shape(std::size_t body) const noexcept {
    return *bodies_[body].shape;
  }
  [[nodiscard]] const Facets& facets(std::size_t body) const noexcept {
    return *bodies_[body].facets;
  }
  /// The body that it is, or is a part of: 0 the target, n companion n - 1.
  [[nodiscard]] std::size_t owner(std::size_t body) const noexcept { return bodies_[body].owner; }
  /// Pre: the snapshot has that body.
  [[nodiscard]] const BodyView& view(const Snapshot& snapshot, std::size_t body) const noexcept {
    return body == 0 ? snapshot : static_cast<const BodyView&>(other(snapshot, body));
  }
  [[nodiscard]] std::size_t most_vertices() const noexcept;

  /// Where the bodies are from now on. Pre: the snapshot has as many companions and parts, or more.
  void place(const Snapshot& snapshot) noexcept;
  /// The facets of one, as Facets has it.
  void light_up(std::size_t body, const BodyView& view, double sun_radius_rad) noexcept {
    bodies_[body].facets->light_up(view, sun_radius_rad);
  }
  /// How far a shadow can fall when the Sun is where the snapshot says: from one side of a body to
  /// the other, or to another body.
  [[nodiscard]] double longest_shadow_m(const Snapshot& snapshot) const noexcept;
  /// Takes directions in the axes of one to those of another.
  [[nodiscard]] Eigen::Vector3f turned(std::size_t from, std::size_t to,
                                       const Eigen::Vector3f& direction) const noexcept {
    return (pose(from, to).turn * direction.cast<double>()).cast<float>();
  }

  /// Rays of one body, in its axes, and the nearest of all bodies that each meets.
  void intersect(std::size_t from, const RayPacket& rays, BodyHits& hits, RayCounts& counts,
                 RayCoherence coherence) const noexcept;
  void occluded(std::size_t from, const RayPacket& rays,
                std::array<bool, RayPacket::kLanes>& blocked, RayCounts& counts,
                RayCoherence coherence) const noexcept;
  /// How many lengths of its direction a lane of a packet goes to its hit.
  [[nodiscard]] double lengths_to(std::size_t body, const RayPacket& rays, std::size_t lane,
                                  const MeshHit& hit) const noexcept;

 private:
  struct Body {
    std::shared_ptr<TracedTarget> shape;
    std::unique_ptr<Facets> own_facets;  ///< of a companion: light falls on it as it lies
    Facets* facets = nullptr;
    std::size_t owner = 0;
  };
  /// Of one body's axes in another's: place' = turn * (place - centre).
  struct Pose {
    Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();
    Eigen::Vector3d centre = Eigen::Vector3d::Zero();  ///< of the other, in the axes of the one
  };
  using Lengths = std::array<double, RayPacket::kLanes>;

  [[nodiscard]] const CompanionView& other(const Snapshot& snapshot,
                                           std::size_t body) const noexcept {
    return body <= companions_ ? snapshot.companion[body - 1]
                               : snapshot.part[body - 1 - companions_];
  }
  [[nodiscard]] const Pose& pose(std::size_t from, std::size_t to) const noexcept {
    return poses_[from * bodies_.size() + to];
  }
  [[nodiscard]] bool carry(std::size_t from, std::size_t to, const RayPacket& rays, RayPacket& out,
                           Lengths& skipped) const noexcept;

  std::vector<Body> bodies_;
  std::size_t companions_ = 0;
  std::vector<Pose> poses_;  ///< from each to each
};

}  // namespace engine
