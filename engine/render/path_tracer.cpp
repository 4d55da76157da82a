#include "engine/render/path_tracer.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "engine/core/random.h"

namespace engine {
namespace {

std::size_t at(int i) noexcept { return static_cast<std::size_t>(i); }
std::ptrdiff_t to_offset(std::size_t i) noexcept { return static_cast<std::ptrdiff_t>(i); }

// No pixel gets more: a rare light must not take all of a frame's time.
constexpr int kMostSamples = 1 << 16;
// A pilot knows the noise to come this well; rare light it has not seen.
constexpr double kPilotTrust = 0.9;
// A shadow's edge narrower than this, in pixels, is as good as hard.
constexpr double kHardEdge_px = 0.2;

/// By the pixel's place on the detector, so that a moving region does not move the noise. The first
/// four words are the image's, the next the pilot's.
Draws draws_of(const Snapshot& snapshot, int u, int v) noexcept {
  const auto place = static_cast<std::uint32_t>((v & 0xFFFF) << 16 | (u & 0xFFFF));
  return {snapshot.seed, Stream::kLight, snapshot.sequence, place};
}

std::vector<BouncedLight> at_each(const TracedBodies& bodies, const BounceRules& rules) {
  std::vector<BouncedLight> bounced;
  for (std::size_t i = 0; i < bodies.count(); ++i) bounced.emplace_back(bodies.shape(i), rules);
  return bounced;
}

/// The mean so far, with what a pass adds.
void mix_in(double old_share, double added, float& mean) noexcept {
  mean =
      static_cast<float>((old_share > 0.0 ? old_share * static_cast<double>(mean) : 0.0) + added);
}

/// Samples of each cell and replicate, from samples of a pixel.
std::uint32_t each_of(int samples, int side, int replicates) noexcept {
  const int parts = side * side * replicates;
  return static_cast<std::uint32_t>((samples + parts - 1) / parts);
}

}  // namespace

PathTracer::PathTracer(const RenderSpec& spec, std::shared_ptr<TracedTarget> target,
                       WorkerPool& pool, const OtherBodies& others)
    : spec_(spec),
      bodies_(std::move(target), others),
      bounced_(at_each(bodies_, BounceRules{spec.bounces, spec.sampler, spec.exact_caustics})),
      footprint_(spec.camera, spec.grid.beyond_frame_px, bodies_.most_vertices()),
      noise_(spec.camera.frame().grown_by(spec.grid.beyond_frame_px), spec.noise),
      pool_(pool) {
  const int side = spec.grid.oversampling;
  ENSURE(side <= RowTracer::kMostSide);
  const PixelRect all = spec.camera.frame().grown_by(spec.grid.beyond_frame_px);
  const std::size_t pixels = at(all.width()) * at(all.height());
  row_counts_.resize(at(all.height()));
  wanted_.resize(pixels);
  replicates_.resize(pixels);
  mean_.resize(pixels);
  variance_.resize(pixels);
  const RowTracer::Rules rules{spec.sequence, spec.bounce_share};
  const int slots = std::max(side * side * kReplicates, kPilotReplicates);
  for (int i = 0; i < pool.threads(); ++i)
    benches_.push_back(
        std::make_unique<Bench>(bodies_, bounced_, rules, all.width(), side * side, slots));
}

RenderReport PathTracer::render(const Snapshot& snapshot, Budget budget, Radiance& out) noexcept {
  const Duration start = reads_clock(budget) ? spec_.clock() : Duration{};
  RenderReport report;
  const bool goes_on = budget.samples_done > 0;
  if (!goes_on) find_bodies(snapshot, report);
  out.region = footprint_.region();
  out.uniform_w_m2_sr = snapshot.background_w_m2_sr;
  out.motion_px = snapshot.smear_px;
  out.points.clear();
  size_images(out);

  report.bounces = bounced_[0].bounces();
  report.add({"method", "paths", std::numeric_limits<double>::quiet_NaN()});
  report.add(bounces_rung(report.bounces, spec_.bounces_left_out_e));
  if (out.region.empty()) return report;
  if (!goes_on) light_up(snapshot, report);
  // Samples know the cap; what harmonics leave out they find.
  const bool cap = frames_[0].lamps.earth != nullptr;
  report.add({"earthshine", name_of(cap ? EarthshineModel::kCap : snapshot.earthshine_rung.model),
              cap ? 0.0 : snapshot.earthshine_rung.error_e});
  if (snapshot.earthshine_rung.albedo != AlbedoModel::kEven)
    report.add({"earthshine's albedo", name_of(snapshot.earthshine_rung.albedo),
                snapshot.earthshine_rung.albedo_error_e});
  std::fill(row_counts_.begin(), row_counts_.end(), RowCounts{});
  choose_samples(snapshot, budget, out.region);
  run_passes(snapshot, budget, start, out, report);
  count_up(report);
  return report;
}

/// footprint_, and of each of frames_ the pixels.
void PathTracer::find_bodies(const Snapshot& snapshot, RenderReport& report) noexcept {
  footprint_.clear();
  std::array<Footprint::ImageArea, 1 + kMostCompanions> area_of_owner{};
  for (std::size_t i = 0; i < bodies_.count(); ++i) {
    frames_[i].seen = footprint_.add(bodies_.shape(i).mesh, bodies_.view(snapshot, i));
    area_of_owner[bodies_.owner(i)] += footprint_.image_area();
  }
  report.visible_fraction = area_of_owner[0].visible_fraction();
  for (std::size_t i = 0; i < kMostCompanions; ++i)
    report.visible_fraction_of_companion[i] = area_of_owner[i + 1].visible_fraction();
}

void PathTracer::size_images(Radiance& out) const noexcept {
  const int s = out.oversampling = spec_.grid.oversampling;
  out.grid.resize(out.region.width() * s, out.region.height() * s);
  out.cover.resize(out.grid.width(), out.grid.height());
  PixelRect targets;
  out.companions_in_sight = false;
  for (std::size_t i = 0; i < bodies_.count(); ++i) {
    const PixelRect& seen = frames_[i].seen;
    if (bodies_.owner(i) == 0) {
      targets = targets.joined_with(seen);
    } else {
      out.companions_in_sight = out.companions_in_sight || !seen.empty();
    }
  }
  out.targets_region = out.companions_in_sight ? targets : PixelRect{};
  out.targets_grid.resize(out.targets_region.width() * s, out.targets_region.height() * s);
  out.targets_cover.resize(out.targets_grid.width(), out.targets_grid.height());
}

/// The facets that are seen, and the rest of frames_.
void PathTracer::light_up(const Snapshot& snapshot, RenderReport& report) noexcept {
  bodies_.place(snapshot);
  const double glint_radius_rad = spec_.sun_disc == SunDisc::kOff ? 0.0 : kSunAngularRadius_rad;
  const double sun_radius_rad = sun_radius_for(snapshot, report);
  for (std::size_t i = 0; i < bodies_.count(); ++i) {
    const BodyView& view = bodies_.view(snapshot, i);
    const PixelRect seen = frames_[i].seen;
    frames_[i] =
        TracedFrame(view, spec_.camera, bodies_.shape(i).bounding_radius_m, sun_radius_rad);
    frames_[i].seen = seen;
    if (!seen.empty()) bodies_.light_up(i, view, glint_radius_rad);
  }
}

void PathTracer::count_up(RenderReport& report) const noexcept {
  for (const RowCounts& counts : row_counts_) {
    report.samples += counts.samples;
    report.hits += counts.hits;
    report.rejected_rays += counts.rejected;
    report.rays_by_kind.camera += counts.rays.camera;
    report.rays_by_kind.shadow += counts.rays.shadow;
    report.rays_by_kind.bounce += counts.rays.bounce;
    report.rays_by_kind.bounce_shadow += counts.rays.bounce_shadow;
  }
  const RaysByKind& kinds = report.rays_by_kind;
  report.rays = kinds.camera + kinds.shadow + kinds.bounce + kinds.bounce_shadow;
}

bool PathTracer::reads_clock(const Budget& budget) const noexcept {
  return budget.passes == 0 && budget.time > Duration{} && spec_.clock != nullptr;
}

/// Of the disc that shadow rays are spread over: an edge is as wide as the disc at the distance of
/// what throws it, and that is no further than the target is wide, or another body is away.
double PathTracer::sun_radius_for(const Snapshot& snapshot, RenderReport& report) const noexcept {
  const double widest_m = 2.0 * kSunAngularRadius_rad * bodies_.longest_shadow_m(snapshot);
  double range_m = snapshot.camera.m.norm();
  for (std::size_t i = 1; i < bodies_.count(); ++i)
    range_m = std::min(range_m, bodies_.view(snapshot, i).camera.m.norm());
  const double pixel_m = range_m * spec_.camera.ifov_rad();
  const bool shows = widest_m > kHardEdge_px * pixel_m;
  constexpr double kNotKnown = std::numeric_limits<double>::quiet_NaN();
  if (spec_.sun_disc == SunDisc::kOff) {
    report.add({"sun disc", "none", kNotKnown});
    return 0.0;
  }
  const bool soft = spec_.sun_disc == SunDisc::kOn || shows;
  report.add({"sun disc", soft ? "glints and shadows" : "glints", soft ? 0.0 : kNotKnown});
  return soft ? kSunAngularRadius_rad : 0.0;
}

/// wanted_: by the budget, by the scenario, or by a pilot; and less where time is short.
void PathTracer::choose_samples(const Snapshot& snapshot, const Budget& budget,
                                const PixelRect& region) noexcept {
  plan_samples(snapshot, budget, region);
  const unsigned quarters = budget.shed < Shed::kSamples    ? 0U
                            : budget.shed == Shed::kSamples ? 1U
                                                            : 2U;
  if (quarters == 0) return;
  const std::size_t pixels = at(region.width()) * at(region.height());
  for (std::size_t i = 0; i < pixels; ++i) wanted_[i] = std::max(1U, wanted_[i] >> 2 * quarters);
}

void PathTracer::plan_samples(const Snapshot& snapshot, const Budget& budget,
                              const PixelRect& region) noexcept {
  const int side = spec_.grid.oversampling;
  const std::size_t pixels = at(region.width()) * at(region.height());
  const int fixed = budget.samples_per_pixel > 0 ? budget.samples_per_pixel
                    : budget.rho_mc > 0.0        ? 0
                                                 : spec_.samples_per_pixel;
  if (fixed > 0) {
    replicates_used_ = fixed <= side * side ? 1 : kReplicates;
    std::fill_n(wanted_.begin(), pixels, each_of(fixed, side, replicates_used_));
    return;
  }
  replicates_used_ = kReplicates;
  pool_.rows(0, region.height(), [&](int row) { pilot_row(snapshot, region, row); });
  const double limit = kPilotTrust * (budget.rho_mc > 0.0 ? budget.rho_mc : spec_.profile.rho_mc);
  const int least = side * side * kReplicates;
  noise_.plan({limit, least, kMostSamples}, region, mean_, variance_, wanted_);
  for (std::size_t i = 0; i < pixels; ++i)
    wanted_[i] = each_of(static_cast<int>(wanted_[i]), side, kReplicates);
}

/// mean_, and variance_ of one sample.
void PathTracer::pilot_row(const Snapshot& snapshot, const PixelRect& region, int row) noexcept {
  Bench& bench = take_bench();
  RowTracer& tracer = bench.tracer;
  const int v = region.top + row;
  const Footprint::Span& span = footprint_.span(v);
  std::fill_n(mean_.begin() + to_offset(pixel(region, 0, row)), region.width(), 0.0F);
  std::fill_n(variance_.begin() + to_offset(pixel(region, 0, row)), region.width(), 0.0F);
  tracer.begin(frames_, span.end - span.begin, 1, kPilotReplicates);
  for (int u = span.begin; u < span.end; ++u) {
    if (!footprint_.marked(u, v)) continue;
    Draws draws = draws_of(snapshot, u, v);
    static_cast<void>(draws.block());  // the image's
    const auto keys = draws.block();
    tracer.trace(u - span.begin, {1.0 * u, 1.0 * v}, keys, 0, kPilotEach);
    row_counts_[at(row)].samples += static_cast<std::uint64_t>(kPilotReplicates) * kPilotEach;
  }
  tracer.finish();
  for (int u = span.begin; u < span.end; ++u) {
    double sum = 0;
    double squares = 0;
    for (int r = 0; r < kPilotReplicates; ++r) {
      const double mean = tracer.light(u - span.begin, 0, r) / kPilotEach;
      sum += mean;
      squares += mean * mean;
    }
    const std::size_t i = pixel(region, u - region.left, row);
    const double variance =
        std::max(0.0, squares - sum * sum / kPilotReplicates) / (kPilotReplicates - 1);
    mean_[i] = static_cast<float>(sum / kPilotReplicates);
    variance_[i] = static_cast<float>(variance * kPilotEach);
  }
  count(tracer, row);
  bench.taken.store(false, std::memory_order_release);
}

void PathTracer::run_passes(const Snapshot& snapshot, const Budget& budget, Duration start,
                            Radiance& out, RenderReport& report) noexcept {
  const std::size_t pixels = at(out.region.width()) * at(out.region.height());
  const std::uint32_t most =
      *std::max_element(wanted_.begin(), wanted_.begin() + static_cast<std::ptrdiff_t>(pixels));
  const bool by_clock = reads_clock(budget);
  const bool in_passes = budget.passes > 0 || by_clock;
  const std::uint32_t done =
      budget.samples_done > 0
          ? std::min(each_of(budget.samples_done, spec_.grid.oversampling, replicates_used_), most)
          : 0U;
  Pass pass{done, in_passes ? std::min(std::max(1U, done), most) : most};
  for (;;) {
    const Duration before = by_clock ? spec_.clock() : Duration{};
    pool_.rows(0, out.region.height(), [&](int row) { trace_row(snapshot, pass, out, row); });
    ++report.passes;
    if (pass.to == most || report.passes == budget.passes) break;
    const Pass next{pass.to, std::min(most, 2 * pass.to)};
    if (by_clock) {
      const Duration now = spec_.clock();
      const double each_s =
          seconds(now - before) / static_cast<double>(samples_of(pass, out.region));
      const double next_s = each_s * static_cast<double>(samples_of(next, out.region));
      if (seconds(now - start) + next_s > seconds(budget.time)) break;
    }
    pass = next;
  }
  report_noise(out.region, pass.to, report);
}

std::uint64_t PathTracer::samples_of(const Pass& pass, const PixelRect& region) const noexcept {
  std::uint64_t samples = 1;
  const std::size_t pixels = at(region.width()) * at(region.height());
  for (std::size_t i = 0; i < pixels; ++i)
    samples += std::min(wanted_[i], pass.to) - std::min(wanted_[i], pass.from);
  return samples;
}

void PathTracer::trace_row(const Snapshot& snapshot, const Pass& pass, Radiance& out,
                           int row) noexcept {
  Bench& bench = take_bench();
  RowTracer& tracer = bench.tracer;
  const PixelRect& region = out.region;
  const int side = out.oversampling;
  const int v = region.top + row;
  const Footprint::Span& span = footprint_.span(v);
  if (pass.from == 0) clear_row(out, row);
  tracer.begin(frames_, span.end - span.begin, side, replicates_used_);
  for (int u = span.begin; u < span.end; ++u) {
    const std::uint32_t to = std::min(pass.to, wanted_[pixel(region, u - region.left, row)]);
    if (!footprint_.marked(u, v) || to <= pass.from) continue;
    const auto keys = draws_of(snapshot, u, v).block();
    tracer.trace(u - span.begin, {1.0 * u, 1.0 * v}, keys, static_cast<int>(pass.from),
                 static_cast<int>(to));
    row_counts_[at(row)].samples +=
        static_cast<std::uint64_t>(side * side * replicates_used_) * (to - pass.from);
  }
  tracer.finish();
  for (int u = span.begin; u < span.end; ++u) {
    if (!footprint_.marked(u, v)) continue;
    take_pixel(tracer, pass, out, u - span.begin, u - region.left, row);
    const PixelRect& targets = out.targets_region;
    if (u >= targets.left && u < targets.right && v >= targets.top && v < targets.bottom)
      take_targets_part(tracer, pass, out, u - span.begin, u - region.left, row);
  }
  count(tracer, row);
  bench.taken.store(false, std::memory_order_release);
}

/// Where nothing is to be seen nothing is traced.
void PathTracer::clear_row(Radiance& out, int row) noexcept {
  for (int line = row * out.oversampling; line < (row + 1) * out.oversampling; ++line) {
    std::ranges::fill(out.grid.row(line), 0.0F);
    std::ranges::fill(out.cover.row(line), 0.0F);
    const int targets_line = line - (out.targets_region.top - out.region.top) * out.oversampling;
    if (targets_line < 0 || targets_line >= out.targets_grid.height()) continue;
    std::ranges::fill(out.targets_grid.row(targets_line), 0.0F);
    std::ranges::fill(out.targets_cover.row(targets_line), 0.0F);
  }
  std::fill_n(replicates_.begin() + to_offset(pixel(out.region, 0, row)), out.region.width(),
              std::array<float, kReplicates>{});
}

/// The means so far, with what the pass has added.
void PathTracer::take_pixel(const RowTracer& tracer, const Pass& pass, Radiance& out, int traced,
                            int column, int row) noexcept {
  const int side = out.oversampling;
  const std::size_t i = pixel(out.region, column, row);
  const std::uint32_t to = std::min(pass.to, wanted_[i]);
  if (pass.from > 0 && to <= pass.from) return;
  const double old_share = static_cast<double>(pass.from) / to;
  std::array<double, kReplicates> sums{};
  for (int cell = 0; cell < side * side; ++cell) {
    double light = 0;
    for (int r = 0; r < replicates_used_; ++r) {
      const double part = tracer.light(traced, cell, r);
      sums[at(r)] += part;
      light += part;
    }
    const double samples = 1.0 * replicates_used_ * to;
    float& grid = out.grid.at(column * side + cell % side, row * side + cell / side);
    float& cover = out.cover.at(column * side + cell % side, row * side + cell / side);
    mix_in(old_share, light / samples, grid);
    mix_in(old_share, tracer.covered(traced, cell) / samples, cover);
  }
  for (int r = 0; r < replicates_used_; ++r)
    mix_in(old_share, sums[at(r)] / (1.0 * side * side * to), replicates_[i][at(r)]);
}

void PathTracer::take_targets_part(const RowTracer& tracer, const Pass& pass, Radiance& out,
                                   int traced, int column, int row) const noexcept {
  const int side = out.oversampling;
  const std::uint32_t to = std::min(pass.to, wanted_[pixel(out.region, column, row)]);
  if (pass.from > 0 && to <= pass.from) return;
  const double old_share = static_cast<double>(pass.from) / to;
  const double samples = 1.0 * replicates_used_ * to;
  const int left = (out.region.left + column - out.targets_region.left) * side;
  const int top = (out.region.top + row - out.targets_region.top) * side;
  for (int cell = 0; cell < side * side; ++cell) {
    const int x = left + cell % side;
    const int y = top + cell / side;
    double light = 0;
    for (int r = 0; r < replicates_used_; ++r) light += tracer.targets_light(traced, cell, r);
    mix_in(old_share, light / samples, out.targets_grid.at(x, y));
    mix_in(old_share, tracer.covered_by_target(traced, cell) / samples, out.targets_cover.at(x, y));
  }
}

/// `reached`: the largest number of samples of a cell and replicate.
void PathTracer::report_noise(const PixelRect& region, std::uint32_t reached,
                              RenderReport& report) noexcept {
  static_assert(kReplicates == 2);
  const int side = spec_.grid.oversampling;
  double samples = 0;
  std::uint64_t lit = 0;
  for (int row = 0; row < region.height(); ++row) {
    for (int column = 0; column < region.width(); ++column) {
      const std::size_t i = pixel(region, column, row);
      if (replicates_used_ == 1) replicates_[i][1] = replicates_[i][0];
      const auto& [a, b] = replicates_[i];
      mean_[i] = 0.5F * (a + b);
      // Of the mean of two: half of the variance of one, which is half their squared difference.
      variance_[i] = 0.25F * (a - b) * (a - b);
      if (!(mean_[i] > 0.0F)) continue;
      ++lit;
      samples += std::min(wanted_[i], reached);
    }
  }
  const int parts = side * side * replicates_used_;
  report.samples_per_pixel =
      lit > 0 ? static_cast<int>(std::lround(samples / static_cast<double>(lit) * parts))
              : static_cast<int>(std::min(reached, wanted_[0])) * parts;
  report.rho_mc = noise_.measure(region, mean_, variance_);
  if (replicates_used_ == 1)
    report.rho_mc.rms = report.rho_mc.worst = std::numeric_limits<double>::quiet_NaN();
}

void PathTracer::count(const RowTracer& tracer, int row) noexcept {
  RowCounts& counts = row_counts_[at(row)];
  counts.rays.camera += tracer.camera_rays().rays;
  counts.rays.shadow += tracer.shadow_rays().rays;
  counts.rays.bounce += tracer.bounce_rays().rays;
  counts.rays.bounce_shadow += tracer.bounce_shadow_rays().rays;
  counts.rejected += tracer.camera_rays().rejected + tracer.shadow_rays().rejected +
                     tracer.bounce_rays().rejected + tracer.bounce_shadow_rays().rejected;
  counts.hits += tracer.hits();
}

/// There is one for each thread of the pool.
PathTracer::Bench& PathTracer::take_bench() noexcept {
  for (std::size_t i = 0;; i = (i + 1) % benches_.size())
    if (!benches_[i]->taken.exchange(true, std::memory_order_acquire)) return *benches_[i];
}

}  // namespace engine
