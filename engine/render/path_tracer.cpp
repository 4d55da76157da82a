#include "engine/render/path_tracer.h"

#include <algorithm>
#include <cmath>

#include "engine/core/constants.h"

namespace engine {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Eigen::Vector3f;

constexpr std::size_t kLanes = RayPacket::kLanes;
constexpr int kMostCells = 64;

/// The i-th point of a sequence that fills the square evenly: R2 (Roberts 2018), randomly shifted.
PixelPoint spread_point(int i, float shift_u, float shift_v) noexcept {
  constexpr double kPlastic1 = 0.7548776662466927;
  constexpr double kPlastic2 = 0.5698402909980532;
  const double u = static_cast<double>(shift_u) + kPlastic1 * i;
  const double v = static_cast<double>(shift_v) + kPlastic2 * i;
  return {u - std::floor(u), v - std::floor(v)};
}

std::string material_missing(const std::string& name) {
  return "the target's mesh has a material \"" + name + "\", the scenario has no table materials." +
         name;
}

std::vector<Brdf> in_mesh_order(const Mesh& mesh, const std::vector<Material>& materials) {
  std::vector<Brdf> brdfs;
  for (const std::string& name : mesh.material_names) {
    const auto it = std::find_if(materials.begin(), materials.end(),
                                 [&](const Material& m) { return m.name == name; });
    if (it == materials.end()) throw ConfigError(material_missing(name));
    brdfs.push_back(it->brdf());
  }
  return brdfs;
}

}  // namespace

RenderSpec read_render(const ConfigTable& table) {
  RenderSpec spec;
  spec.samples_per_pixel =
      static_cast<int>(table.integer_or("samples_per_pixel", 50, between(1, 100000)));
  spec.bounces = static_cast<int>(table.integer_or("bounces", 1, between(0, 16)));
  spec.bounce_share = table.number_or("bounce_share", 0.15, between(0.001, 1.0));
  return spec;
}

PathTracer::PathTracer(const RenderSpec& spec, Mesh mesh, const std::vector<Material>& materials,
                       WorkerPool& pool)
    : spec_(spec),
      mesh_(std::move(mesh)),
      bounding_radius_m_(mesh_.bounding_radius_m()),
      scene_(mesh_),
      facets_(mesh_, in_mesh_order(mesh_, materials)),
      footprint_(spec.camera, spec.grid.beyond_frame_px, mesh_.vertices.size()),
      pool_(pool) {
  ENSURE(spec.grid.oversampling * spec.grid.oversampling <= kMostCells);
  const PixelRect all = spec.camera.frame().grown_by(spec.grid.beyond_frame_px);
  row_counts_.resize(static_cast<std::size_t>(all.height()));
}

RenderReport PathTracer::render(const Snapshot& snapshot, Budget budget, Radiance& out) noexcept {
  const int s = spec_.grid.oversampling;
  footprint_.project(mesh_, snapshot);
  out.region = footprint_.region();
  out.oversampling = s;
  out.uniform_w_m2_sr = snapshot.background_w_m2_sr;
  out.motion_px = snapshot.smear_px;
  out.points.clear();
  out.grid.resize(out.region.width() * s, out.region.height() * s);

  const int wanted =
      budget.samples_per_pixel > 0 ? budget.samples_per_pixel : spec_.samples_per_pixel;
  const int per_cell = (wanted + s * s - 1) / (s * s);
  const Matrix3d& axes = snapshot.body_from_camera.matrix;
  View view;
  view.origin = snapshot.camera.m;
  view.at_zero = axes * spec_.camera.direction_at({0.0, 0.0});
  view.per_u = axes.col(0) * spec_.camera.ifov_rad();
  view.per_v = axes.col(1) * spec_.camera.ifov_rad();
  view.advance = std::max(0.0, snapshot.camera.m.norm() - 1.2 * bounding_radius_m_);

  RenderReport report;
  report.samples_per_pixel = per_cell * s * s;
  report.bounces = spec_.bounces;
  report.visible_fraction = footprint_.visible_fraction();
  if (out.region.empty()) return report;
  facets_.light_up(snapshot, pool_);
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
  std::array<float, kMostCells> cells;
  for (int column = 0; column < out.region.width(); ++column) {
    const int u = out.region.left + column;
    cells.fill(0.0F);
    if (footprint_.marked(u, v)) {
      // By the pixel's place on the detector, so that a moving region does not move the noise.
      const auto place = static_cast<std::uint32_t>((v & 0xFFFF) << 16 | (u & 0xFFFF));
      const Draws draws(snapshot.seed, Stream::kLight, snapshot.sequence, place);
      trace_pixel(snapshot, view, samples_per_cell,
                  {static_cast<double>(u), static_cast<double>(v)}, draws,
                  std::span(cells).first(static_cast<std::size_t>(s) * static_cast<std::size_t>(s)),
                  counts);
    }
    auto cell = cells.begin();
    for (int y = 0; y < s; ++y)
      for (int x = 0; x < s; ++x) out.grid.at(column * s + x, row * s + y) = *cell++;
  }
}

void PathTracer::trace_pixel(const Snapshot& snapshot, const View& view, int samples_per_cell,
                             PixelPoint pixel, Draws draws, std::span<float> cells,
                             RowCounts& counts) const noexcept {
  const int s = spec_.grid.oversampling;
  const int total = samples_per_cell * s * s;
  const float shift_u = draws.uniform();
  const float shift_v = draws.uniform();
  std::array<float, kLanes> radiance;
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
      cell_of[static_cast<std::size_t>(lane)] = static_cast<std::size_t>(cell);
    }
    shade(snapshot, rays, draws, radiance, counts);
    for (std::size_t lane = 0; lane < static_cast<std::size_t>(lanes); ++lane)
      cells[cell_of[lane]] += radiance[lane];
  }
  counts.samples += static_cast<std::uint64_t>(total);
  for (float& cell : cells) cell /= static_cast<float>(samples_per_cell);
}

void PathTracer::shade(const Snapshot& snapshot, const RayPacket& rays, Draws& draws,
                       std::array<float, kLanes>& radiance, RowCounts& counts) const noexcept {
  std::array<MeshHit, kLanes> hits;
  scene_.intersect(rays, hits, counts.rays);
  radiance.fill(0.0F);
  RayPacket shadow;
  const auto lamps = lamps_of(snapshot);
  bool any_lit = false;
  for (std::size_t i = 0; i < kLanes; ++i) {
    if (hits[i].triangle == MeshHit::kNone) continue;
    ++counts.hits;
    const Vector3f direction(rays.direction_x[i], rays.direction_y[i], rays.direction_z[i]);
    const SurfacePoint point = facets_.at(hits[i], direction);
    const auto& light = facets_.radiance(hits[i].triangle);
    const float both = light[0] + light[1];
    if (both > 0.0F) {
      const std::size_t lamp = draws.uniform() * both < light[0] ? 0 : 1;
      shadow.set(static_cast<int>(i), point.start(), lamps[lamp]->toward.unit.cast<float>());
      radiance[i] = both;
      any_lit = true;
    }
  }
  std::array<bool, kLanes> blocked{};
  if (any_lit) scene_.occluded(shadow, blocked, counts.rays);
  for (std::size_t i = 0; i < kLanes; ++i) {
    if (blocked[i]) radiance[i] = 0.0F;
    if (hits[i].triangle == MeshHit::kNone || spec_.bounces == 0) continue;
    if (static_cast<double>(draws.uniform()) >= spec_.bounce_share) continue;
    const Vector3f direction(rays.direction_x[i], rays.direction_y[i], rays.direction_z[i]);
    radiance[i] += static_cast<float>(indirect_light(snapshot, facets_.at(hits[i], direction),
                                                     direction.cast<double>().normalized(), draws,
                                                     counts.rays) /
                                      spec_.bounce_share);
  }
}

double PathTracer::indirect_light(const Snapshot& snapshot, SurfacePoint from, Vector3d direction,
                                  Draws& draws, RayCounts& counts) const noexcept {
  double radiance = 0;
  double throughput = 1;
  Matrix3d local = basis_round(from.normal.cast<double>());
  Vector3d out = local * -direction;
  for (int bounce = 1;; ++bounce) {
    const Brdf::Sample next = facets_.brdf(from.material).sample(out, draws);
    if (!(next.weight > 0.0)) break;
    throughput *= next.weight;
    direction = local.transpose() * next.in;
    const MeshHit hit = scene_.intersect(from.start(), direction.cast<float>(), counts);
    if (hit.triangle == MeshHit::kNone) break;
    from = facets_.at(hit, direction.cast<float>());
    radiance += throughput * scattered_light(snapshot, from, draws, counts);
    if (bounce == spec_.bounces) break;
    local = basis_round(from.normal.cast<double>());
    out = local * -direction;
  }
  return radiance;
}

double PathTracer::scattered_light(const Snapshot& snapshot, const SurfacePoint& at, Draws& draws,
                                   RayCounts& counts) const noexcept {
  const auto lamps = lamps_of(snapshot);
  const Vector3d normal = at.normal.cast<double>();
  std::array<double, kLamps> light{};
  for (std::size_t k = 0; k < kLamps; ++k) {
    const double cos_in = normal.dot(lamps[k]->toward.unit);
    if (cos_in <= 0.0) continue;
    light[k] = lamps[k]->irradiance_w_m2 * cos_in * facets_.brdf(at.material).albedo(cos_in) / kPi;
  }
  const double both = light[0] + light[1];
  if (!(both > 0.0)) return 0.0;
  const std::size_t lamp = static_cast<double>(draws.uniform()) * both < light[0] ? 0 : 1;
  const bool hidden = scene_.occluded(at.start(), lamps[lamp]->toward.unit.cast<float>(), counts);
  return hidden ? 0.0 : both;
}

}  // namespace engine
