#include "engine/render/row_tracer.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace engine {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Eigen::Vector3f;

namespace {

std::size_t at(int i) noexcept { return static_cast<std::size_t>(i); }

}  // namespace

TracedFrame::TracedFrame(const Snapshot& snapshot, const CameraGeometry& camera,
                         double bounding_radius_m, double sun_radius_rad) noexcept
    : lamps(lamps_with_cap(snapshot, sun_radius_rad)), origin(snapshot.camera.m) {
  const Matrix3d& axes = snapshot.body_from_camera.matrix;
  at_zero = axes * camera.direction_at({0.0, 0.0});
  per_u = axes.col(0) * camera.ifov_rad();
  per_v = axes.col(1) * camera.ifov_rad();
  advance = std::max(0.0, snapshot.camera.m.norm() - 1.2 * bounding_radius_m);
}

RowTracer::RowTracer(const TracedTarget& target, const BouncedLight& bounced, const Rules& rules,
                     int most_columns, int most_cells, int most_slots)
    : target_(target),
      bounced_(bounced),
      rules_(rules),
      light_(at(most_columns * most_slots)),
      covered_(at(most_columns * most_cells)) {}

void RowTracer::begin(const TracedFrame& frame, int columns, int side, int replicates) noexcept {
  frame_ = &frame;
  columns_ = columns;
  side_ = side;
  replicates_ = replicates;
  std::fill_n(light_.begin(), columns * side * side * replicates, 0.0);
  std::fill_n(covered_.begin(), columns * side * side, 0U);
  counts_ = {};
  hits_ = 0;
}

void RowTracer::trace(int column, PixelPoint pixel, std::span<const std::uint32_t> keys, int first,
                      int last) noexcept {
  const int cells = side_ * side_;
  // In 2^-32, so that no rounding makes the share another one.
  const bool follows = bounced_.bounces() > 0 || frame_->lamps.earth != nullptr;
  const auto share =
      static_cast<std::uint64_t>(std::llround(0x1p32 * (follows ? rules_.bounce_share : 0.0)));
  CameraQueue& q = camera_;
  for (int r = 0; r < replicates_; ++r) {
    const std::uint32_t key = keys[at(r)];
    // Which samples bounce: every (1/share)-th, from a place by chance.
    const std::uint64_t begin = mixed32(key);
    for (int cell = 0; cell < cells; ++cell) {
      const std::uint32_t place_key = mixed32(key + 0x9E3779B9U * static_cast<std::uint32_t>(cell));
      for (int i = first; i < last; ++i) {
        const auto sample = static_cast<std::uint32_t>(i * cells + cell);
        const std::uint64_t rank = (begin + sample * share) >> 32U;
        const bool bounces = (begin + (sample + 1U) * share) >> 32U > rank;
        if (q.used == 0) q.corner = {pixel.u - 0.5, pixel.v - 0.5};
        const std::size_t lane = at(q.used);
        q.place_key[lane] = place_key;
        q.place[lane] = static_cast<std::uint32_t>(i);
        q.cell_u[lane] = static_cast<float>((pixel.u - 0.5 - q.corner.u) * side_ + cell % side_);
        q.cell_v[lane] = static_cast<float>(cell / side_);
        q.slot[lane] = static_cast<std::uint32_t>(slot(column, cell, r));
        q.cell[lane] = static_cast<std::uint32_t>(column * cells + cell);
        q.key[lane] = key;
        q.sample[lane] = sample;
        q.bouncing[lane] = bounces ? static_cast<std::int32_t>(rank) : -1;
        if (++q.used == RayPacket::kLanes) send_camera_rays();
      }
    }
  }
}

/// Through the places of the samples in hand. In double up to the target; what rays of a packet
/// differ by is small, and single precision is enough.
void RowTracer::aim(RayPacket& rays) noexcept {
  const CameraQueue& q = camera_;
  const Vector3d corner = frame_->at_zero + q.corner.u * frame_->per_u + q.corner.v * frame_->per_v;
  const double cell_px = 1.0 / side_;
  const Vector3f start = (frame_->origin + frame_->advance * corner).cast<float>();
  const Vector3f direction = corner.cast<float>();
  const Vector3f start_u = (cell_px * frame_->advance * frame_->per_u).cast<float>();
  const Vector3f start_v = (cell_px * frame_->advance * frame_->per_v).cast<float>();
  const Vector3f per_u = (cell_px * frame_->per_u).cast<float>();
  const Vector3f per_v = (cell_px * frame_->per_v).cast<float>();
  SampleLanes lanes;
  lanes.places(rules_.sequence, q.place_key, q.place);
  for (std::size_t i = 0; i < kLanes; ++i) {
    const float u = q.cell_u[i] + lanes.first[i];
    const float v = q.cell_v[i] + lanes.second[i];
    rays.origin_x[i] = start.x() + u * start_u.x() + v * start_v.x();
    rays.origin_y[i] = start.y() + u * start_u.y() + v * start_v.y();
    rays.origin_z[i] = start.z() + u * start_u.z() + v * start_v.z();
    rays.direction_x[i] = direction.x() + u * per_u.x() + v * per_v.x();
    rays.direction_y[i] = direction.y() + u * per_u.y() + v * per_v.y();
    rays.direction_z[i] = direction.z() + u * per_u.z() + v * per_v.z();
  }
}

void RowTracer::send_camera_rays() noexcept {
  RayPacket rays;
  aim(rays);
  const auto used = at(std::exchange(camera_.used, 0));
  std::fill_n(rays.active.begin(), used, true);
  std::array<MeshHit, kLanes> hits;
  target_.scene.intersect(rays, hits, counts_[0], RayCoherence::kParallel);
  std::array<SurfacePoint, kLanes> points;
  bool any = false;
  for (std::size_t i = 0; i < used; ++i) {
    if (hits[i].triangle == MeshHit::kNone) continue;
    any = true;
    ++hits_;
    ++covered_[camera_.cell[i]];
    const Vector3f direction(rays.direction_x[i], rays.direction_y[i], rays.direction_z[i]);
    points[i] = target_.facets.at(hits[i], direction);
    if (camera_.bouncing[i] < 0) continue;
    waiting_[paths_] = {{points[i], direction.normalized(),
                         SampleNumbers(rules_.sequence, camera_.key[i],
                                       static_cast<std::uint32_t>(camera_.bouncing[i]))},
                        camera_.slot[i]};
    if (frame_->lamps.earth != nullptr)
      waiting_[paths_].path.earth_asked = static_cast<float>(1.0 / rules_.bounce_share);
    ++paths_;
  }
  if (!any) return;
  light_directly(points, hits);
  if (frame_->lamps.earth != nullptr) light_by_earth(rays, points, hits);
  while (paths_ >= kLanes) bounce(kLanes);
}

void RowTracer::light_directly(const std::array<SurfacePoint, kLanes>& points,
                               const std::array<MeshHit, kLanes>& hits) noexcept {
  for (std::size_t k = 0; k < kLamps; ++k) {
    const LampCone& lamp = frame_->lamps[k];
    if (!(lamp.irradiance_w_m2() > 0.0)) continue;
    RayPacket toward;
    if (!lamp.parallel()) {
      SampleLanes lanes;
      lanes.pairs(rules_.sequence, camera_.key, camera_.sample, BouncedLight::kDirectDisc);
      lanes.towards(lamp, toward);
    }
    const Vector3f axis = lamp.axis().cast<float>();
    for (std::size_t i = 0; i < kLanes; ++i) {
      if (hits[i].triangle == MeshHit::kNone) continue;
      const float light = target_.facets.radiance(hits[i].triangle)[k];
      if (light <= 0.0F) continue;
      const Vector3f way = lamp.parallel() ? axis
                                           : Vector3f(toward.direction_x[i], toward.direction_y[i],
                                                      toward.direction_z[i]);
      ask(direct_[k], RayCoherence::kParallel, counts_[1], points[i], way, camera_.slot[i],
          static_cast<double>(light));
    }
  }
}

/// Every sample asks for it once; those that follow a bounce may run into it as well.
void RowTracer::light_by_earth(const RayPacket& rays,
                               const std::array<SurfacePoint, kLanes>& points,
                               const std::array<MeshHit, kLanes>& hits) noexcept {
  SampleLanes lanes;
  lanes.pairs(rules_.sequence, camera_.key, camera_.sample, BouncedLight::kDirectEarth);
  for (std::size_t i = 0; i < kLanes; ++i) {
    if (hits[i].triangle == MeshHit::kNone) continue;
    const EarthLight::Sample sample = frame_->lamps.earth->sample(
        static_cast<double>(lanes.first[i]), static_cast<double>(lanes.second[i]));
    const Vector3f direction(rays.direction_x[i], rays.direction_y[i], rays.direction_z[i]);
    const double light =
        bounced_.earthshine(sample, points[i], direction.normalized(), 1.0 / rules_.bounce_share);
    if (light > 0.0)
      ask(direct_[1], RayCoherence::kScattered, counts_[1], points[i],
          sample.direction.cast<float>(), camera_.slot[i], light);
  }
}

void RowTracer::ask(ShadowQueue& queue, RayCoherence coherence, RayCounts& counts,
                    const SurfacePoint& from, const Vector3f& toward, std::uint32_t slot,
                    double light) noexcept {
  queue.rays.set(queue.used, from.start(), toward);
  queue.slot[at(queue.used)] = slot;
  queue.light[at(queue.used)] = light;
  if (++queue.used == RayPacket::kLanes) send(queue, coherence, counts);
}

void RowTracer::send(ShadowQueue& queue, RayCoherence coherence, RayCounts& counts) noexcept {
  const auto used = at(std::exchange(queue.used, 0));
  if (used == 0) return;
  for (std::size_t i = used; i < kLanes; ++i) queue.rays.active[i] = false;
  std::array<bool, kLanes> blocked{};
  target_.scene.occluded(queue.rays, blocked, counts, coherence);
  for (std::size_t i = 0; i < used; ++i)
    if (!blocked[i]) light_[queue.slot[i]] += queue.light[i];
}

/// The last `count` of those that wait go on by one place. Pre: count <= paths_, kLanes.
void RowTracer::bounce(std::size_t count) noexcept {
  RayPacket rays;
  const std::size_t first = paths_ - count;
  std::array<Waiting, kLanes> going;
  std::size_t alive = 0;
  for (std::size_t i = first; i < paths_; ++i) {
    Waiting& w = waiting_[i];
    if (!bounced_.go_on(w.path)) continue;
    rays.set(static_cast<int>(alive), w.path.from.start(), w.path.direction);
    going[alive++] = w;
  }
  paths_ = first;
  std::array<MeshHit, kLanes> hits;
  target_.scene.intersect(rays, hits, counts_[2], RayCoherence::kScattered);
  for (std::size_t i = 0; i < alive; ++i) {
    Waiting& w = going[i];
    if (hits[i].triangle == MeshHit::kNone) {
      light_[w.slot] += bounced_.escaped(frame_->lamps, w.path) / rules_.bounce_share;
      continue;
    }
    if (bounced_.longest(w.path)) continue;
    const BouncedLight::Question question =
        bounced_.arrive(frame_->lamps, w.path, target_.facets.at(hits[i], w.path.direction));
    if (question.light_w_m2_sr > 0.0) {
      ask(bounced_shadow_, RayCoherence::kScattered, counts_[3], w.path.from, question.toward,
          w.slot, question.light_w_m2_sr / rules_.bounce_share);
    }
    if (bounced_.may_go_on(w.path)) waiting_[paths_++] = w;
  }
}

void RowTracer::finish() noexcept {
  if (camera_.used > 0) send_camera_rays();
  while (paths_ > 0) bounce(std::min(paths_, kLanes));
  send(direct_[0], RayCoherence::kParallel, counts_[1]);
  send(direct_[1],
       frame_->lamps.earth != nullptr ? RayCoherence::kScattered : RayCoherence::kParallel,
       counts_[1]);
  send(bounced_shadow_, RayCoherence::kScattered, counts_[3]);
}

}  // namespace engine
