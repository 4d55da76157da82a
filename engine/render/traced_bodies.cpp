#include "engine/render/traced_bodies.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "engine/core/contract.h"

namespace engine {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Eigen::Vector3f;

namespace {

// Spheres are met a little before they are: a ray starts an offset off its surface.
constexpr double kMargin = 1.001;

Vector3d origin_of(const RayPacket& rays, std::size_t i) noexcept {
  return Vector3f(rays.origin_x[i], rays.origin_y[i], rays.origin_z[i]).cast<double>();
}

Vector3d direction_of_lane(const RayPacket& rays, std::size_t i) noexcept {
  return Vector3f(rays.direction_x[i], rays.direction_y[i], rays.direction_z[i]).cast<double>();
}

/// Whether a ray reaches the sphere round the origin. False for what is not a number.
bool reaches(const Vector3d& origin, const Vector3d& direction, double radius_m) noexcept {
  const double squared_m2 = radius_m * radius_m;
  return origin.cross(direction).squaredNorm() <= squared_m2 * direction.squaredNorm() &&
         (origin.dot(direction) <= 0.0 || origin.squaredNorm() <= squared_m2);
}

}  // namespace

TracedBodies::TracedBodies(std::shared_ptr<TracedTarget> target, const OtherBodies& others)
    : companions_(others.companions.size()) {
  ENSURE(companions_ <= kMostCompanions);
  ENSURE(others.parts.size() <= kMostParts);
  Facets* const targets = &target->facets;
  bodies_.push_back({std::move(target), nullptr, targets, 0});
  const auto add = [this](const std::shared_ptr<TracedTarget>& shape, std::size_t owner) {
    auto own = std::make_unique<Facets>(shape->facets);
    Facets* const facets = own.get();
    bodies_.push_back({shape, std::move(own), facets, owner});
  };
  for (const auto& shape : others.companions) add(shape, count());
  for (const OtherBodies::Part& part : others.parts) {
    ENSURE(part.owner <= companions_);
    add(part.shape, part.owner);
  }
  poses_.resize(count() * count());
}

std::size_t TracedBodies::most_vertices() const noexcept {
  std::size_t most = 0;
  for (const Body& body : bodies_) most = std::max(most, body.shape->mesh.vertices.size());
  return most;
}

void TracedBodies::place(const Snapshot& snapshot) noexcept {
  if (count() == 1) return;
  ENSURE(snapshot.companions >= companions_);
  ENSURE(snapshot.parts + 1 + companions_ >= count());
  const auto centre = [&](std::size_t body) -> Vector3d {
    return body == 0 ? Vector3d::Zero() : other(snapshot, body).centre.m;
  };
  const auto turn = [&](std::size_t body) -> Matrix3d {
    return body == 0 ? Matrix3d::Identity() : other(snapshot, body).from_target.matrix;
  };
  for (std::size_t from = 0; from < count(); ++from) {
    for (std::size_t to = 0; to < count(); ++to) {
      poses_[from * count() + to] = {turn(to) * turn(from).transpose(),
                                     turn(from) * (centre(to) - centre(from))};
    }
  }
}

double TracedBodies::longest_shadow_m(const Snapshot& snapshot) const noexcept {
  double longest_m = 0;
  for (std::size_t on = 0; on < count(); ++on) {
    const double own_m = shape(on).bounding_radius_m;
    longest_m = std::max(longest_m, 2.0 * own_m);
    const Vector3d& to_sun = view(snapshot, on).sun.toward.unit;
    for (std::size_t by = 0; by < count(); ++by) {
      if (by == on) continue;
      const Vector3d& centre = pose(on, by).centre;
      const double both_m = own_m + shape(by).bounding_radius_m;
      // A shadow widens by the Sun's disc.
      const double wide_m = both_m + kSunAngularRadius_rad * centre.norm();
      if (reaches(-centre, to_sun, kMargin * wide_m))
        longest_m = std::max(longest_m, centre.norm() + both_m);
    }
  }
  return longest_m;
}

/// The rays that can meet body `to`, in its axes, from where they are near it. False: none can.
bool TracedBodies::carry(std::size_t from, std::size_t to, const RayPacket& rays, RayPacket& out,
                         Lengths& skipped) const noexcept {
  const Pose& there = pose(from, to);
  const double radius_m = shape(to).bounding_radius_m;
  const double both_m = kMargin * (radius_m + shape(from).bounding_radius_m);
  bool any = false;
  for (std::size_t i = 0; i < RayPacket::kLanes; ++i) {
    if (!rays.active[i]) continue;
    const Vector3d along = direction_of_lane(rays, i);
    // By the direction alone: wherever on its body the ray starts.
    if (!reaches(-there.centre, along, both_m)) continue;
    const Vector3d origin = there.turn * (origin_of(rays, i) - there.centre);
    const Vector3d direction = there.turn * along;
    if (!reaches(origin, direction, kMargin * radius_m)) continue;
    const double nearest = -origin.dot(direction) / direction.squaredNorm();
    skipped[i] = std::max(0.0, nearest - 1.2 * radius_m / direction.norm());
    out.set(static_cast<int>(i), (origin + skipped[i] * direction).cast<float>(),
            direction.cast<float>());
    any = true;
  }
  return any;
}

double TracedBodies::lengths_to(std::size_t body, const RayPacket& rays, std::size_t lane,
                                const MeshHit& hit) const noexcept {
  const Vector3d along = direction_of_lane(rays, lane);
  const Vector3d place = facets(body).at(hit, along.cast<float>()).place.cast<double>();
  return (place - origin_of(rays, lane)).dot(along) / along.squaredNorm();
}

void TracedBodies::intersect(std::size_t from, const RayPacket& rays, BodyHits& hits,
                             RayCounts& counts, RayCoherence coherence) const noexcept {
  shape(from).scene.intersect(rays, hits.hit, counts, coherence);
  hits.body.fill(static_cast<std::uint8_t>(from));
  if (count() == 1) return;
  Lengths nearest;
  for (std::size_t i = 0; i < nearest.size(); ++i) {
    nearest[i] = hits.hit[i].triangle == MeshHit::kNone ? std::numeric_limits<double>::infinity()
                                                        : lengths_to(from, rays, i, hits.hit[i]);
  }
  for (std::size_t to = 0; to < count(); ++to) {
    RayPacket there;
    Lengths skipped{};
    if (to == from || !carry(from, to, rays, there, skipped)) continue;
    std::array<MeshHit, RayPacket::kLanes> met;
    shape(to).scene.intersect(there, met, counts, coherence);
    for (std::size_t i = 0; i < met.size(); ++i) {
      if (met[i].triangle == MeshHit::kNone) continue;
      const double lengths = skipped[i] + lengths_to(to, there, i, met[i]);
      if (!(lengths < nearest[i])) continue;
      nearest[i] = lengths;
      hits.hit[i] = met[i];
      hits.body[i] = static_cast<std::uint8_t>(to);
    }
  }
}

void TracedBodies::occluded(std::size_t from, const RayPacket& rays,
                            std::array<bool, RayPacket::kLanes>& blocked, RayCounts& counts,
                            RayCoherence coherence) const noexcept {
  shape(from).scene.occluded(rays, blocked, counts, coherence);
  for (std::size_t to = 0; to < count(); ++to) {
    RayPacket there;
    Lengths skipped{};
    if (to == from || !carry(from, to, rays, there, skipped)) continue;
    std::array<bool, RayPacket::kLanes> met{};
    shape(to).scene.occluded(there, met, counts, coherence);
    for (std::size_t i = 0; i < met.size(); ++i) blocked[i] = blocked[i] || met[i];
  }
}

}  // namespace engine
