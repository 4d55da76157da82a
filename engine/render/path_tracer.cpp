#include "engine/render/path_tracer.h"

#include <algorithm>
#include <cmath>

namespace engine {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Eigen::Vector3f;

constexpr std::size_t kLanes = RayPacket::kLanes;

std::size_t at(int i) noexcept { return static_cast<std::size_t>(i); }

/// The i-th point of a sequence that fills the square evenly: R2 (Roberts 2018), randomly shifted.
PixelPoint spread_point(int i, float shift_u, float shift_v) noexcept {
  constexpr double kPlastic1 = 0.7548776662466927;
  constexpr double kPlastic2 = 0.5698402909980532;
  const double u = static_cast<double>(shift_u) + kPlastic1 * i;
  const double v = static_cast<double>(shift_v) + kPlastic2 * i;
  return {u - std::floor(u), v - std::floor(v)};
}

}  // namespace

PathTracer::PathTracer(const RenderSpec& spec, std::shared_ptr<TracedTarget> target,
                       WorkerPool& pool)
    : spec_(spec),
      target_(std::move(target)),
      bounced_(*target_, spec.bounces),
      footprint_(spec.camera, spec.grid.beyond_frame_px, target_->mesh.vertices.size()),
      pool_(pool) {
  ENSURE(at(spec.grid.oversampling * spec.grid.oversampling) <= Cells::kMost);
  const PixelRect all = spec.camera.frame().grown_by(spec.grid.beyond_frame_px);
  row_counts_.resize(static_cast<std::size_t>(all.height()));
}

RenderReport PathTracer::render(const Snapshot& snapshot, Budget budget, Radiance& out) noexcept {
  const int s = spec_.grid.oversampling;
  footprint_.project(target_->mesh, snapshot);
  out.region = footprint_.region();
  out.oversampling = s;
  out.uniform_w_m2_sr = snapshot.background_w_m2_sr;
  out.motion_px = snapshot.smear_px;
  out.points.clear();
  out.grid.resize(out.region.width() * s, out.region.height() * s);
  out.cover.resize(out.grid.width(), out.grid.height());

  const int wanted =
      budget.samples_per_pixel > 0 ? budget.samples_per_pixel : spec_.samples_per_pixel;
  const int per_cell = (wanted + s * s - 1) / (s * s);
  const Matrix3d& axes = snapshot.body_from_camera.matrix;
  View view;
  view.origin = snapshot.camera.m;
  view.at_zero = axes * spec_.camera.direction_at({0.0, 0.0});
  view.per_u = axes.col(0) * spec_.camera.ifov_rad();
  view.per_v = axes.col(1) * spec_.camera.ifov_rad();
  view.advance = std::max(0.0, snapshot.camera.m.norm() - 1.2 * target_->bounding_radius_m);

  RenderReport report;
  report.samples_per_pixel = per_cell * s * s;
  report.bounces = spec_.bounces;
  report.visible_fraction = footprint_.visible_fraction();
  if (out.region.empty()) return report;
  target_->facets.light_up(snapshot, pool_);
  pool_.rows(0, out.region.height(),
             [&](int row) { trace_pixel_row(snapshot, view, per_cell, out, row); });
  for (int row = 0; row < out.region.height(); ++row) {
    const RowCounts& counts = row_counts_[static_cast<std::size_t>(row)];
    report.samples += counts.samples;
    report.hits += counts.hits;
    report.rays += counts.rays.rays;
    report.rejected_rays += counts.rays.rejected;
  }
  return report;
}

void PathTracer::trace_pixel_row(const Snapshot& snapshot, const View& view, int samples_per_cell,
                                 Radiance& out, int row) noexcept {
  const int s = out.oversampling;
  RowCounts& counts = row_counts_[static_cast<std::size_t>(row)] = {};
  const int v = out.region.top + row;
  for (int column = 0; column < out.region.width(); ++column) {
    const int u = out.region.left + column;
    Cells cells;
    if (footprint_.marked(u, v)) {
      // By the pixel's place on the detector, so that a moving region does not move the noise.
      const auto place = static_cast<std::uint32_t>((v & 0xFFFF) << 16 | (u & 0xFFFF));
      const Draws draws(snapshot.seed, Stream::kLight, snapshot.sequence, place);
      trace_pixel(snapshot, view, samples_per_cell,
                  {static_cast<double>(u), static_cast<double>(v)}, draws, cells, counts);
    }
    for (int y = 0; y < s; ++y) {
      for (int x = 0; x < s; ++x) {
        out.grid.at(column * s + x, row * s + y) = cells.radiance[at(y * s + x)];
        out.cover.at(column * s + x, row * s + y) = cells.cover[at(y * s + x)];
      }
    }
  }
}

void PathTracer::trace_pixel(const Snapshot& snapshot, const View& view, int samples_per_cell,
                             PixelPoint pixel, Draws draws, Cells& cells,
                             RowCounts& counts) const noexcept {
  const int s = spec_.grid.oversampling;
  const int total = samples_per_cell * s * s;
  const float shift_u = draws.uniform();
  const float shift_v = draws.uniform();
  std::array<std::size_t, kLanes> cell_of{};
  for (int first = 0; first < total; first += RayPacket::kLanes) {
    RayPacket rays;
    const int lanes = std::min(RayPacket::kLanes, total - first);
    for (int lane = 0; lane < lanes; ++lane) {
      const int cell = (first + lane) / samples_per_cell;
      const PixelPoint in_cell = spread_point(first + lane, shift_u, shift_v);
      const int cell_column = cell % s;
      const int cell_row = cell / s;
      const double u = pixel.u - 0.5 + (cell_column + in_cell.u) / s;
      const double v = pixel.v - 0.5 + (cell_row + in_cell.v) / s;
      const Vector3d direction = view.at_zero + u * view.per_u + v * view.per_v;
      rays.set(lane, (view.origin + view.advance * direction).cast<float>(),
               direction.cast<float>());
      cell_of[at(lane)] = at(cell);
    }
    const Seen seen = shade(snapshot, rays, draws, counts);
    for (std::size_t lane = 0; lane < at(lanes); ++lane) {
      cells.radiance[cell_of[lane]] += seen.radiance[lane];
      cells.cover[cell_of[lane]] += seen.target[lane] ? 1.0F : 0.0F;
    }
  }
  counts.samples += static_cast<std::uint64_t>(total);
  const auto samples = static_cast<float>(samples_per_cell);
  for (float& cell : cells.radiance) cell /= samples;
  for (float& cell : cells.cover) cell /= samples;
}

PathTracer::Seen PathTracer::shade(const Snapshot& snapshot, const RayPacket& rays, Draws& draws,
                                   RowCounts& counts) const noexcept {
  std::array<MeshHit, kLanes> hits;
  target_->scene.intersect(rays, hits, counts.rays);
  Seen seen;
  RayPacket shadow;
  const auto lamps = lamps_of(snapshot);
  bool any_lit = false;
  for (std::size_t i = 0; i < kLanes; ++i) {
    if (hits[i].triangle == MeshHit::kNone) continue;
    ++counts.hits;
    seen.target[i] = true;
    const Vector3f direction(rays.direction_x[i], rays.direction_y[i], rays.direction_z[i]);
    const SurfacePoint point = target_->facets.at(hits[i], direction);
    const auto& light = target_->facets.radiance(hits[i].triangle);
    const float both = light[0] + light[1];
    if (both > 0.0F) {
      const std::size_t lamp = draws.uniform() * both < light[0] ? 0 : 1;
      shadow.set(static_cast<int>(i), point.start(), lamps[lamp]->toward.unit.cast<float>());
      seen.radiance[i] = both;
      any_lit = true;
    }
  }
  std::array<bool, kLanes> blocked{};
  if (any_lit) target_->scene.occluded(shadow, blocked, counts.rays);
  for (std::size_t i = 0; i < kLanes; ++i) {
    if (blocked[i]) seen.radiance[i] = 0.0F;
    if (hits[i].triangle == MeshHit::kNone || spec_.bounces == 0) continue;
    if (static_cast<double>(draws.uniform()) >= spec_.bounce_share) continue;
    const Vector3f direction(rays.direction_x[i], rays.direction_y[i], rays.direction_z[i]);
    const double bounced =
        bounced_.radiance(snapshot, target_->facets.at(hits[i], direction),
                          direction.cast<double>().normalized(), draws, counts.rays);
    seen.radiance[i] += static_cast<float>(bounced / spec_.bounce_share);
  }
  return seen;
}

}  // namespace engine
