#include "engine/render/row_tracer.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace engine {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Eigen::Vector3f;

namespace {

std::size_t at(int i) noexcept { return static_cast<std::size_t>(i); }

}  // namespace

TracedFrame::TracedFrame(const BodyView& view, const CameraGeometry& camera,
                         double bounding_radius_m, double sun_radius_rad) noexcept
    : lamps(lamps_with_cap(view, sun_radius_rad)), origin(view.camera.m) {
  const Matrix3d& axes = view.body_from_camera.matrix;
  const LocalCamera local(camera, view.image_map);
  at_zero = axes * local.direction_at({0.0, 0.0});
  per_u = axes * local.direction_per_u();
  per_v = axes * local.direction_per_v();
  advance = std::max(0.0, view.camera.m.norm() - 1.2 * bounding_radius_m);
}

RowTracer::RowTracer(const TracedBodies& bodies, std::span<const BouncedLight> bounced,
                     const Rules& rules, int most_columns, int most_cells, int most_slots)
    : bodies_(bodies),
      bounced_(bounced),
      rules_(rules),
      light_(at(most_columns * most_slots) * (several() ? 2 : 1)),
      covered_(at(most_columns * most_cells) * (several() ? 2 : 1)),
      desks_(bodies.count()),
      looks_(bodies.count()) {
  // Fewer than a packet at each desk, and a packet from the camera: no desk ever holds more than
  // all of them.
  for (Desk& desk : desks_) desk.waiting.resize(kLanes * (bodies.count() + 1));
}

void RowTracer::begin(const TracedFrames& frames, int columns, int side, int replicates) noexcept {
  frames_ = &frames;
  columns_ = columns;
  side_ = side;
  replicates_ = replicates;
  std::fill_n(light_.begin(), (several() ? 2 : 1) * companions_slots(), 0.0);
  std::fill_n(covered_.begin(), (several() ? 2 : 1) * companions_cells(), 0U);
  counts_ = {};
  hits_ = 0;
}

void RowTracer::trace(int column, PixelPoint pixel, std::span<const std::uint32_t> keys, int first,
                      int last) noexcept {
  const int cells = side_ * side_;
  // In 2^-32, so that no rounding makes the share another one.
  const auto last_body = frames_->begin() + static_cast<std::ptrdiff_t>(bodies_.count());
  const bool follows = bounced_[0].bounces() > 0 ||
                       std::any_of(frames_->begin(), last_body,
                                   [](const auto& frame) { return frame.lamps.earth != nullptr; });
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
        const int cell_row = cell / side_;
        q.cell_v[lane] = static_cast<float>(cell_row);
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
void RowTracer::aim(const TracedFrame& frame, RayPacket& rays) const noexcept {
  const CameraQueue& q = camera_;
  const Vector3d corner = frame.at_zero + q.corner.u * frame.per_u + q.corner.v * frame.per_v;
  const double cell_px = 1.0 / side_;
  const Vector3f start = (frame.origin + frame.advance * corner).cast<float>();
  const Vector3f direction = corner.cast<float>();
  const Vector3f start_u = (cell_px * frame.advance * frame.per_u).cast<float>();
  const Vector3f start_v = (cell_px * frame.advance * frame.per_v).cast<float>();
  const Vector3f per_u = (cell_px * frame.per_u).cast<float>();
  const Vector3f per_v = (cell_px * frame.per_v).cast<float>();
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

/// Whether the pixel of a sample in hand is one where the body can be.
bool RowTracer::may_see(const TracedFrame& frame, std::size_t lane) const noexcept {
  const auto pixel_at = [](double corner) { return static_cast<int>(std::lround(corner + 0.5)); };
  const int u = pixel_at(camera_.corner.u) + static_cast<int>(camera_.cell_u[lane]) / side_;
  const int v = pixel_at(camera_.corner.v);
  return u >= frame.seen.left && u < frame.seen.right && v >= frame.seen.top &&
         v < frame.seen.bottom;
}

/// looks_: of each body, what is seen of it past all others.
void RowTracer::look_at_all(std::size_t used) noexcept {
  std::array<double, kLanes> nearest;
  std::array<std::size_t, kLanes> whose{};
  nearest.fill(std::numeric_limits<double>::infinity());
  for (std::size_t body = 0; body < bodies_.count(); ++body) {
    const TracedFrame& frame = (*frames_)[body];
    Look& look = looks_[body];
    look.hits.fill({});
    look.rays.active.fill(false);
    bool any = false;
    for (std::size_t i = 0; i < used; ++i) {
      look.rays.active[i] = may_see(frame, i);
      any = any || look.rays.active[i];
    }
    if (!any) continue;
    aim(frame, look.rays);
    bodies_.shape(body).scene.intersect(look.rays, look.hits, counts_[0], RayCoherence::kParallel);
    for (std::size_t i = 0; i < used; ++i) {
      MeshHit& hit = look.hits[i];
      if (hit.triangle == MeshHit::kNone) continue;
      const double lengths = frame.advance + bodies_.lengths_to(body, look.rays, i, hit);
      if (lengths < nearest[i]) {
        if (nearest[i] < std::numeric_limits<double>::infinity()) looks_[whose[i]].hits[i] = {};
        nearest[i] = lengths;
        whose[i] = body;
      } else {
        hit = {};
      }
    }
  }
}

void RowTracer::send_camera_rays() noexcept {
  const auto used = at(std::exchange(camera_.used, 0));
  if (several()) {
    look_at_all(used);
  } else {
    RayPacket& rays = looks_[0].rays;
    aim((*frames_)[0], rays);
    rays.active.fill(false);
    std::fill_n(rays.active.begin(), used, true);
    bodies_.shape(0).scene.intersect(rays, looks_[0].hits, counts_[0], RayCoherence::kParallel);
  }
  for (std::size_t body = 0; body < bodies_.count(); ++body) take_hits(body, looks_[body], used);
  bounce_all_from(kLanes);
}

void RowTracer::take_hits(std::size_t body, const Look& look, std::size_t used) noexcept {
  const RayPacket& rays = look.rays;
  Desk& desk = desks_[body];
  const std::size_t cells = is_targets(body) ? 0 : companions_cells();
  const bool earth = (*frames_)[body].lamps.earth != nullptr;
  std::array<SurfacePoint, kLanes> points;
  bool any = false;
  for (std::size_t i = 0; i < used; ++i) {
    if (look.hits[i].triangle == MeshHit::kNone) continue;
    any = true;
    ++hits_;
    ++covered_[camera_.cell[i] + cells];
    const Vector3f direction(rays.direction_x[i], rays.direction_y[i], rays.direction_z[i]);
    points[i] = bodies_.facets(body).at(look.hits[i], direction);
    if (camera_.bouncing[i] < 0) continue;
    desk.waiting[desk.paths] = {{points[i], direction.normalized(),
                                 SampleNumbers(rules_.sequence, camera_.key[i],
                                               static_cast<std::uint32_t>(camera_.bouncing[i]))},
                                slot_at(body, i)};
    if (earth)
      desk.waiting[desk.paths].path.earth_asked = static_cast<float>(1.0 / rules_.bounce_share);
    ++desk.paths;
  }
  if (!any) return;
  light_directly(body, points, look.hits);
  if (earth) light_by_earth(body, rays, points, look.hits);
}

void RowTracer::light_directly(std::size_t body, const std::array<SurfacePoint, kLanes>& points,
                               const std::array<MeshHit, kLanes>& hits) noexcept {
  for (std::size_t k = 0; k < kLamps; ++k) {
    const LampCone& lamp = (*frames_)[body].lamps[k];
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
      const float light = bodies_.facets(body).radiance(hits[i].triangle)[k];
      if (light <= 0.0F) continue;
      const Vector3f way = lamp.parallel() ? axis
                                           : Vector3f(toward.direction_x[i], toward.direction_y[i],
                                                      toward.direction_z[i]);
      ask(body, desks_[body].direct[k], RayCoherence::kParallel, counts_[1], points[i], way,
          slot_at(body, i), static_cast<double>(light));
    }
  }
}

/// Every sample asks for it once; those that follow a bounce may run into it as well.
void RowTracer::light_by_earth(std::size_t body, const RayPacket& rays,
                               const std::array<SurfacePoint, kLanes>& points,
                               const std::array<MeshHit, kLanes>& hits) noexcept {
  SampleLanes lanes;
  lanes.pairs(rules_.sequence, camera_.key, camera_.sample, BouncedLight::kDirectEarth);
  for (std::size_t i = 0; i < kLanes; ++i) {
    if (hits[i].triangle == MeshHit::kNone) continue;
    const EarthLight::Sample sample = (*frames_)[body].lamps.earth->sample(
        static_cast<double>(lanes.first[i]), static_cast<double>(lanes.second[i]));
    const Vector3f direction(rays.direction_x[i], rays.direction_y[i], rays.direction_z[i]);
    const double light = bounced_[body].earthshine(sample, points[i], direction.normalized(),
                                                   1.0 / rules_.bounce_share);
    if (light > 0.0)
      ask(body, desks_[body].direct[1], RayCoherence::kScattered, counts_[1], points[i],
          sample.direction.cast<float>(), slot_at(body, i), light);
  }
}

void RowTracer::ask(std::size_t body, ShadowQueue& queue, RayCoherence coherence, RayCounts& counts,
                    const SurfacePoint& from, const Vector3f& toward, std::uint32_t slot,
                    double light) noexcept {
  queue.rays.set(queue.used, from.start(), toward);
  queue.slot[at(queue.used)] = slot;
  queue.light[at(queue.used)] = light;
  if (++queue.used == RayPacket::kLanes) send(body, queue, coherence, counts);
}

void RowTracer::send(std::size_t body, ShadowQueue& queue, RayCoherence coherence,
                     RayCounts& counts) noexcept {
  const auto used = at(std::exchange(queue.used, 0));
  if (used == 0) return;
  for (std::size_t i = used; i < kLanes; ++i) queue.rays.active[i] = false;
  std::array<bool, kLanes> blocked{};
  bodies_.occluded(body, queue.rays, blocked, counts, coherence);
  for (std::size_t i = 0; i < used; ++i)
    if (!blocked[i]) light_[queue.slot[i]] += queue.light[i];
}

/// Until nowhere so many paths wait. Those that come to another body wait there.
void RowTracer::bounce_all_from(std::size_t least) noexcept {
  for (bool more = true; more;) {
    more = false;
    for (std::size_t body = 0; body < desks_.size(); ++body) {
      while (desks_[body].paths >= least) {
        bounce(body, std::min(desks_[body].paths, kLanes));
        more = desks_.size() > 1;
      }
    }
  }
}

/// The last `count` of those that wait go on by one place. Pre: count <= desk.paths, kLanes.
void RowTracer::bounce(std::size_t body, std::size_t count) noexcept {
  Desk& desk = desks_[body];
  RayPacket rays;
  const std::size_t first = desk.paths - count;
  std::array<Waiting, kLanes> going;
  std::size_t alive = 0;
  for (std::size_t i = first; i < desk.paths; ++i) {
    Waiting& w = desk.waiting[i];
    if (!bounced_[body].go_on(w.path)) continue;
    rays.set(static_cast<int>(alive), w.path.from.start(), w.path.direction);
    going[alive++] = w;
  }
  desk.paths = first;
  BodyHits met;
  bodies_.intersect(body, rays, met, counts_[2], RayCoherence::kScattered);
  for (std::size_t i = 0; i < alive; ++i) {
    Waiting& w = going[i];
    const std::size_t there = met.body[i];
    if (met.hit[i].triangle == MeshHit::kNone) {
      light_[w.slot] +=
          bounced_[body].escaped((*frames_)[body].lamps, w.path) / rules_.bounce_share;
      continue;
    }
    if (bounced_[there].longest(w.path)) continue;
    if (there != body) w.path.direction = bodies_.turned(body, there, w.path.direction);
    const BouncedLight::Question question = bounced_[there].arrive(
        (*frames_)[there].lamps, w.path, bodies_.facets(there).at(met.hit[i], w.path.direction));
    if (question.light_w_m2_sr > 0.0) {
      ask(there, desks_[there].bounced_shadow, RayCoherence::kScattered, counts_[3], w.path.from,
          question.toward, w.slot, question.light_w_m2_sr / rules_.bounce_share);
    }
    if (bounced_[there].may_go_on(w.path)) desks_[there].waiting[desks_[there].paths++] = w;
  }
}

void RowTracer::finish() noexcept {
  if (camera_.used > 0) send_camera_rays();
  bounce_all_from(1);
  for (std::size_t body = 0; body < desks_.size(); ++body) {
    Desk& desk = desks_[body];
    const bool earth = (*frames_)[body].lamps.earth != nullptr;
    send(body, desk.direct[0], RayCoherence::kParallel, counts_[1]);
    send(body, desk.direct[1], earth ? RayCoherence::kScattered : RayCoherence::kParallel,
         counts_[1]);
    send(body, desk.bounced_shadow, RayCoherence::kScattered, counts_[3]);
  }
}

}  // namespace engine
