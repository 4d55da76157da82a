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
    : lamps(lamp_cones(snapshot, sun_radius_rad)), origin(snapshot.camera.m) {
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
  const double share = bounced_.bounces() > 0 ? rules_.bounce_share : 0.0;
  // In double up to the target; what a ray differs by within a pixel is small, and single is
  // enough.
  const Vector3d corner =
      frame_->at_zero + (pixel.u - 0.5) * frame_->per_u + (pixel.v - 0.5) * frame_->per_v;
  const Vector3f start = (frame_->origin + frame_->advance * corner).cast<float>();
  const Vector3f direction = corner.cast<float>();
  const Vector3f start_u = (frame_->advance * frame_->per_u).cast<float>();
  const Vector3f start_v = (frame_->advance * frame_->per_v).cast<float>();
  const Vector3f per_u = frame_->per_u.cast<float>();
  const Vector3f per_v = frame_->per_v.cast<float>();
  const float cell_px = 1.0F / static_cast<float>(side_);
  for (int r = 0; r < replicates_; ++r) {
    const std::uint32_t key = keys[at(r)];
    // Which samples bounce: every (1/share)-th, from a place by chance.
    const double begin = static_cast<double>(fraction(key));
    for (int i = first; i < last; ++i) {
      for (int cell = 0; cell < cells; ++cell) {
        const int sample = i * cells + cell;
        const double rank = std::floor(begin + sample * share);
        const bool bounces = std::floor(begin + (sample + 1) * share) > rank;
        const auto cell_key = static_cast<std::uint32_t>(mixed(key + at(cell)));
        const auto place =
            SampleNumbers(rules_.sequence, cell_key, static_cast<std::uint32_t>(i)).first_pair();
        const float u = (static_cast<float>(cell % side_) + place[0]) * cell_px;
        const float v = (static_cast<float>(cell / side_) + place[1]) * cell_px;
        CameraQueue& q = camera_;
        q.rays.set(q.used, start + u * start_u + v * start_v, direction + u * per_u + v * per_v);
        const std::size_t lane = at(q.used);
        q.slot[lane] = static_cast<std::uint32_t>(slot(column, cell, r));
        q.cell[lane] = static_cast<std::uint32_t>(column * cells + cell);
        q.key[lane] = key;
        q.sample[lane] = static_cast<std::uint32_t>(sample);
        q.bouncing[lane] = bounces ? static_cast<std::int32_t>(rank) : -1;
        if (++q.used == RayPacket::kLanes) send_camera_rays();
      }
    }
  }
}

void RowTracer::send_camera_rays() noexcept {
  const auto used = at(std::exchange(camera_.used, 0));
  for (std::size_t i = used; i < kLanes; ++i) camera_.rays.active[i] = false;
  std::array<MeshHit, kLanes> hits;
  target_.scene.intersect(camera_.rays, hits, counts_[0], RayCoherence::kParallel);
  for (std::size_t i = 0; i < used; ++i) {
    if (hits[i].triangle == MeshHit::kNone) continue;
    ++hits_;
    ++covered_[camera_.cell[i]];
    const auto& light = target_.facets.radiance(hits[i].triangle);
    const bool bounces = camera_.bouncing[i] >= 0;
    if (!bounces && light[0] <= 0.0F && light[1] <= 0.0F) continue;
    const Vector3f direction(camera_.rays.direction_x[i], camera_.rays.direction_y[i],
                             camera_.rays.direction_z[i]);
    const SurfacePoint point = target_.facets.at(hits[i], direction);
    light_directly(i, point, hits[i].triangle);
    if (!bounces) continue;
    waiting_[paths_++] = {{point, direction.normalized(),
                           SampleNumbers(rules_.sequence, camera_.key[i],
                                         static_cast<std::uint32_t>(camera_.bouncing[i]))},
                          camera_.slot[i]};
  }
  while (paths_ >= kLanes) bounce(kLanes);
}

void RowTracer::light_directly(std::size_t lane, const SurfacePoint& point,
                               std::uint32_t facet) noexcept {
  const auto& light = target_.facets.radiance(facet);
  for (std::size_t k = 0; k < kLamps; ++k) {
    if (light[k] <= 0.0F) continue;
    const LampCone& lamp = frame_->lamps[k];
    const Vector3d toward =
        lamp.parallel()
            ? lamp.axis()
            : lamp.sample(SampleNumbers(rules_.sequence, camera_.key[lane], camera_.sample[lane])
                              .pair(BouncedLight::kDirectDisc));
    ask(direct_[k], RayCoherence::kParallel, counts_[1], point, toward.cast<float>(),
        camera_.slot[lane], static_cast<double>(light[k]));
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
    const BouncedLight::Question question =
        bounced_.arrive(frame_->lamps, w.path, target_.facets.at(hits[i], w.path.direction));
    if (question.light_w_m2_sr > 0.0) {
      ask(bounced_shadow_, RayCoherence::kScattered, counts_[3], w.path.from, question.toward,
          w.slot, question.light_w_m2_sr / rules_.bounce_share);
    }
    if (!bounced_.longest(w.path)) waiting_[paths_++] = w;
  }
}

void RowTracer::finish() noexcept {
  if (camera_.used > 0) send_camera_rays();
  while (paths_ > 0) bounce(std::min(paths_, kLanes));
  for (ShadowQueue& queue : direct_) send(queue, RayCoherence::kParallel, counts_[1]);
  send(bounced_shadow_, RayCoherence::kScattered, counts_[3]);
}

}  // namespace engine
