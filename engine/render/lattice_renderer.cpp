#include "engine/render/lattice_renderer.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace engine {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Eigen::Vector3f;

namespace {

// In each four points of a row one asks for the lamps; over four rows, each column once.
constexpr int kAskEvery = 4;
constexpr std::array<int, kAskEvery> kAsks = {0, 2, 1, 3};
constexpr bool asks_first(int x, int y) noexcept {
  return x % kAskEvery == kAsks[static_cast<std::size_t>(y % kAskEvery)];
}
// The nearest a target may be, in its own radii from its centre.
constexpr double kNearest = 2.0;

}  // namespace

LatticeRenderer::LatticeRenderer(const RenderSpec& spec, std::shared_ptr<TracedTarget> target,
                                 WorkerPool& pool)
    : spec_(spec),
      target_(std::move(target)),
      bounced_(*target_, spec.bounces),
      paths_(spec, target_, pool),
      footprint_(spec.camera, spec.grid.beyond_frame_px, target_->mesh.vertices.size()),
      raster_(target_->mesh.vertices.size(), target_->mesh.triangles.size(),
              spec.camera.frame().grown_by(spec.grid.beyond_frame_px).height()),
      pool_(pool),
      corners_(target_->mesh.vertices.size()) {
  const PixelRect all = spec.camera.frame().grown_by(spec.grid.beyond_frame_px);
  row_counts_.resize(static_cast<std::size_t>(all.height()));
  const int s = spec.grid.oversampling;
  const int per_px = s * spec.lattice_side;
  ENSURE(per_px <= TriangleRaster::kMostBandRows && spec.lattice_side % kAskEvery == 0);
  const auto cells = static_cast<std::size_t>(all.width() * s);
  const std::size_t points =
      static_cast<std::size_t>(all.width() * per_px + TriangleRaster::kLanes) *
      static_cast<std::size_t>(per_px);
  for (int i = 0; i < pool.threads(); ++i) {
    benches_.push_back(std::make_unique<Bench>());
    Bench& bench = *benches_.back();
    bench.seen.resize(points);
    bench.nearness.resize(points);
    bench.shares.reserve(cells * static_cast<std::size_t>(spec.lattice_side * spec.lattice_side));
    bench.cells.resize(cells);
  }
}

RenderReport LatticeRenderer::render(const Snapshot& snapshot, Budget budget,
                                     Radiance& out) noexcept {
  const int s = spec_.grid.oversampling;
  footprint_.project(target_->mesh, snapshot);
  const PixelRect region = footprint_.region();
  side_ = budget.samples_per_pixel > 0 && budget.samples_per_pixel <= s * s * kAskEvery * kAskEvery
              ? kAskEvery
              : spec_.lattice_side;
  if (!place(snapshot, region, side_)) return paths_.render(snapshot, budget, out);

  out.region = region;
  out.oversampling = s;
  out.uniform_w_m2_sr = snapshot.background_w_m2_sr;
  out.motion_px = snapshot.smear_px;
  out.points.clear();
  out.grid.resize(region.width() * s, region.height() * s);
  out.cover.resize(out.grid.width(), out.grid.height());
  RenderReport report;
  report.samples_per_pixel = s * s * side_ * side_;
  report.bounces = spec_.bounces;
  report.visible_fraction = footprint_.visible_fraction();
  if (region.empty()) return report;
  const auto lamps = lamps_of(snapshot);
  for (std::size_t k = 0; k < kLamps; ++k) toward_lamp_[k] = lamps[k]->toward.unit.cast<float>();
  target_->facets.light_up(snapshot, pool_);
  pool_.rows(0, region.height(), [&](int row) { shade_pixel_row(snapshot, out, row); });
  for (int row = 0; row < region.height(); ++row) {
    const RowCounts& counts = row_counts_[static_cast<std::size_t>(row)];
    report.hits += counts.hits;
    report.rays += counts.rays.rays;
    report.rejected_rays += counts.rays.rejected;
  }
  report.samples = static_cast<std::uint64_t>(region.width()) *
                   static_cast<std::uint64_t>(region.height()) *
                   static_cast<std::uint64_t>(report.samples_per_pixel);
  return report;
}

/// False: the path tracer's.
bool LatticeRenderer::place(const Snapshot& snapshot, const PixelRect& region, int side) noexcept {
  const double range_m = snapshot.camera.m.norm();
  // Not a number either.
  if (!(range_m > kNearest * target_->bounding_radius_m)) return false;
  const int per_px = spec_.grid.oversampling * side;
  const Matrix3d& axes = snapshot.body_from_camera.matrix;
  const Matrix3d camera_from_body = axes.transpose();
  for (std::size_t i = 0; i < corners_.size(); ++i) {
    const Vector3d p =
        camera_from_body * (target_->mesh.vertices[i].cast<double>() - snapshot.camera.m);
    const auto at = spec_.camera.project(p);
    if (!at) return false;
    // 1/z is linear on the detector; from the target's centre and in its radii it keeps its digits.
    corners_[i] = {(at->u + 0.5 - region.left) * per_px, (at->v + 0.5 - region.top) * per_px,
                   (range_m - p.z()) / p.z() * (range_m / target_->bounding_radius_m)};
  }
  if (!raster_.place(target_->mesh, corners_, region.width() * per_px, region.height() * per_px,
                     per_px))
    return false;
  const double step_rad = spec_.camera.ifov_rad() / per_px;
  const Vector3d at_zero = axes * spec_.camera.direction_at({region.left - 0.5, region.top - 0.5});
  const double advance = range_m - 1.2 * target_->bounding_radius_m;
  view_ = {(snapshot.camera.m + advance * at_zero).cast<float>(),
           (advance * step_rad * axes.col(0)).cast<float>(),
           (advance * step_rad * axes.col(1)).cast<float>(),
           at_zero.cast<float>(),
           (step_rad * axes.col(0)).cast<float>(),
           (step_rad * axes.col(1)).cast<float>()};
  return true;
}

/// There is one for each thread of the pool.
LatticeRenderer::Bench& LatticeRenderer::take_bench() noexcept {
  for (std::size_t i = 0;; i = (i + 1) % benches_.size())
    if (!benches_[i]->taken.exchange(true, std::memory_order_acquire)) return *benches_[i];
}

void LatticeRenderer::shade_pixel_row(const Snapshot& snapshot, Radiance& out, int row) noexcept {
  const int s = spec_.grid.oversampling;
  Bench& bench = take_bench();
  RowCounts& counts = row_counts_[static_cast<std::size_t>(row)] = {};
  raster_.see(row, bench.seen, bench.nearness, {});
  for (int c = 0; c < s; ++c) {
    const Strip strip{
        snapshot, bench, counts, (row * s + c) * side_, c * side_, out.region.width() * s};
    bench.shares.clear();
    for (int cell = 0; cell < strip.cells; ++cell) collect(strip, cell);
    for (std::size_t k = 0; k < kLamps; ++k) send(strip, k);
    // All are judged before one is asked more.
    for (int cell = 0; cell < strip.cells; ++cell)
      bench.cells[static_cast<std::size_t>(cell)].fine = edge_of_shadow_beside(strip, cell);
    for (int cell = 0; cell < strip.cells; ++cell)
      if (bench.cells[static_cast<std::size_t>(cell)].fine) ask_the_rest(strip, cell);
    for (std::size_t k = 0; k < kLamps; ++k) send(strip, k);
    for (int cell = 0; cell < strip.cells; ++cell) {
      out.grid.at(cell, row * s + c) =
          direct_light(strip, cell) +
          bounced_light(strip, cell, {1.0 * out.region.left, 1.0 * out.region.top});
      out.cover.at(cell, row * s + c) =
          static_cast<float>(bench.cells[static_cast<std::size_t>(cell)].points) /
          static_cast<float>(side_ * side_);
    }
  }
  bench.taken.store(false, std::memory_order_release);
}

std::uint32_t LatticeRenderer::seen(const Strip& strip, int i, int y) const noexcept {
  return strip.bench.seen[static_cast<std::size_t>(strip.first_bench_row + y) * raster_.stride() +
                          static_cast<std::size_t>(i)];
}

/// The facets of a cell, and a part of its points asked for the lamps.
void LatticeRenderer::collect(const Strip& strip, int cell) const noexcept {
  std::vector<Share>& shares = strip.bench.shares;
  const std::size_t first = shares.size();
  std::size_t share = first;
  int points = 0;
  for (int y = 0; y < side_; ++y) {
    for (int x = 0; x < side_; ++x) {
      const std::uint32_t facet = seen(strip, cell * side_ + x, y);
      if (facet == TriangleRaster::kNone) continue;
      ++points;
      const auto& light = target_->facets.radiance(facet);
      if (light[0] <= 0.0F && light[1] <= 0.0F) continue;
      if (share >= shares.size() || shares[share].facet != facet) {
        for (share = first; share < shares.size() && shares[share].facet != facet;) ++share;
        if (share == shares.size())
          shares.push_back({facet, static_cast<std::uint16_t>(y * side_ + x), 0, 0, {}});
      }
      ++shares[share].points;
      if (asks_first(x, y)) ask(strip, share, cell * side_ + x, y);
    }
  }
  for (share = first; share < shares.size(); ++share) {
    // One that no point of the pattern falls on.
    Share& s = shares[share];
    if (s.asked == 0) {
      ask(strip, share, cell * side_ + s.first_point % side_, s.first_point / side_);
      s.asks_at_first_point = true;
    }
  }
  strip.counts.hits += static_cast<std::uint64_t>(points);
  strip.bench.cells[static_cast<std::size_t>(cell)] = {
      points, static_cast<std::uint32_t>(first), static_cast<std::uint32_t>(shares.size()), false};
}

/// Whether a lamp reaches a part of what was asked in the cells to the left and right.
bool LatticeRenderer::edge_of_shadow_beside(const Strip& strip, int cell) const noexcept {
  std::array<unsigned, kLamps> asked{};
  std::array<unsigned, kLamps> hidden{};
  for (const int beside : {cell - 1, cell + 1}) {
    if (beside < 0 || beside >= strip.cells) continue;
    const Cell& c = strip.bench.cells[static_cast<std::size_t>(beside)];
    for (std::uint32_t i = c.first_share; i < c.end_share; ++i) {
      const Share& share = strip.bench.shares[i];
      const auto& light = target_->facets.radiance(share.facet);
      for (std::size_t k = 0; k < kLamps; ++k) {
        if (light[k] <= 0.0F) continue;
        asked[k] += share.asked;
        hidden[k] += share.hidden[k];
      }
    }
  }
  bool edge = false;
  for (std::size_t k = 0; k < kLamps; ++k) edge = edge || (hidden[k] > 0 && hidden[k] < asked[k]);
  return edge;
}

void LatticeRenderer::ask_the_rest(const Strip& strip, int cell) const noexcept {
  const Cell& c = strip.bench.cells[static_cast<std::size_t>(cell)];
  for (int y = 0; y < side_; ++y) {
    for (int x = 0; x < side_; ++x) {
      if (asks_first(x, y)) continue;
      const std::uint32_t facet = seen(strip, cell * side_ + x, y);
      for (std::uint32_t i = c.first_share; i < c.end_share; ++i) {
        const Share& share = strip.bench.shares[i];
        if (share.facet != facet) continue;
        if (!share.asks_at_first_point || share.first_point != y * side_ + x)
          ask(strip, i, cell * side_ + x, y);
        break;
      }
    }
  }
}

/// Pre: the facet is one that the point sees.
SurfacePoint LatticeRenderer::point_at(std::uint32_t facet, int i, int j,
                                       Vector3f& direction) const noexcept {
  const float x = static_cast<float>(i) + TriangleRaster::x_in_step(j);
  const float y = static_cast<float>(j) + TriangleRaster::y_in_step(i);
  direction = view_.direction + x * view_.direction_per_x + y * view_.direction_per_y;
  const Vector3f start = view_.start + x * view_.start_per_x + y * view_.start_per_y;
  return target_->facets.on_plane(facet, start, direction);
}

void LatticeRenderer::ask(const Strip& strip, std::size_t share, int i, int y) const noexcept {
  Share& s = strip.bench.shares[share];
  Vector3f direction;
  const Vector3f start = point_at(s.facet, i, strip.first_point_row + y, direction).start();
  ++s.asked;
  const auto& light = target_->facets.radiance(s.facet);
  for (std::size_t k = 0; k < kLamps; ++k) {
    if (light[k] <= 0.0F) continue;
    ShadowQueue& queue = strip.bench.queues[k];
    queue.rays.set(queue.used, start, toward_lamp_[k]);
    queue.share[static_cast<std::size_t>(queue.used)] = static_cast<std::uint32_t>(share);
    if (++queue.used == RayPacket::kLanes) send(strip, k);
  }
}

void LatticeRenderer::send(const Strip& strip, std::size_t lamp) const noexcept {
  ShadowQueue& queue = strip.bench.queues[lamp];
  const auto used = static_cast<std::size_t>(std::exchange(queue.used, 0));
  if (used == 0) return;
  for (std::size_t i = used; i < RayPacket::kLanes; ++i) queue.rays.active[i] = false;
  std::array<bool, RayPacket::kLanes> blocked{};
  target_->scene.occluded(queue.rays, blocked, strip.counts.rays);
  for (std::size_t i = 0; i < used; ++i)
    if (blocked[i]) ++strip.bench.shares[queue.share[i]].hidden[lamp];
}

float LatticeRenderer::direct_light(const Strip& strip, int cell) const noexcept {
  const Cell& c = strip.bench.cells[static_cast<std::size_t>(cell)];
  float sum = 0.0F;
  for (std::uint32_t i = c.first_share; i < c.end_share; ++i) {
    const Share& share = strip.bench.shares[i];
    const auto& light = target_->facets.radiance(share.facet);
    const float each = static_cast<float>(share.points) / static_cast<float>(share.asked);
    for (std::size_t k = 0; k < kLamps; ++k)
      sum += light[k] * each * static_cast<float>(share.asked - share.hidden[k]);
  }
  return sum / static_cast<float>(side_ * side_);
}

/// From points of the cell that chance chooses: where they see nothing they bring nothing.
float LatticeRenderer::bounced_light(const Strip& strip, int cell,
                                     PixelPoint place) const noexcept {
  if (spec_.bounces == 0 || spec_.bounce_paths == 0) return 0.0F;
  // By the cell's place on the detector, so that a moving region does not move the noise.
  const int s = spec_.grid.oversampling;
  const auto u = static_cast<std::uint32_t>(static_cast<int>(place.u) * s + cell);
  const auto v = static_cast<std::uint32_t>(static_cast<int>(place.v) * s) +
                 static_cast<std::uint32_t>(strip.first_point_row / side_);
  Draws draws(strip.snapshot.seed, Stream::kLight, strip.snapshot.sequence,
              (v & 0xFFFFU) << 16U | (u & 0xFFFFU));
  const auto points = static_cast<std::uint32_t>(side_ * side_);
  double sum = 0;
  for (int path = 0; path < spec_.bounce_paths; ++path) {
    const int point = static_cast<int>(draws.bits() % points);
    const int i = cell * side_ + point % side_;
    const int y = point / side_;
    const std::uint32_t facet = seen(strip, i, y);
    if (facet == TriangleRaster::kNone) continue;
    Vector3f direction;
    const SurfacePoint from = point_at(facet, i, strip.first_point_row + y, direction);
    sum += bounced_.radiance(strip.snapshot, from, direction.cast<double>().normalized(), draws,
                             strip.counts.rays);
  }
  return static_cast<float>(sum / spec_.bounce_paths);
}

}  // namespace engine
