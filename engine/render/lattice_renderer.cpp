#include "engine/render/lattice_renderer.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "engine/core/constants.h"

namespace engine {

using Eigen::Vector2f;
using Eigen::Vector3f;

namespace {

// A frame is made again for texels that it asked for: once, where they had to be made coarser, and
// if all is to be complete for each further set of rays.
constexpr int kMostRounds = 4;
constexpr int kMostSettledRounds = 10;
// Of light by patches, rms, which a patch's cells have in common: of a telescope .2, of a
// Lambert mesh .1.
constexpr float kPatchError = 0.2F;
constexpr float kAllAlike = std::numeric_limits<float>::infinity();

constexpr std::size_t at(int i) noexcept { return static_cast<std::size_t>(i); }

}  // namespace

LatticeRenderer::LatticeRenderer(const RenderSpec& spec, std::shared_ptr<TracedTarget> target,
                                 WorkerPool& pool)
    : spec_(spec),
      target_(std::move(target)),
      view_(spec, target_),
      lamp_views_{LampView(target_->mesh), LampView(target_->mesh)},
      body_light_(*target_, spec.bounces, pool),
      texels_(*target_, body_light_, spec.bounces),
      paths_(spec, target_, pool),
      noise_(spec.camera.frame().grown_by(spec.grid.beyond_frame_px), spec.noise),
      pool_(pool) {
  const PixelRect all = spec.camera.frame().grown_by(spec.grid.beyond_frame_px);
  row_counts_.resize(at(all.height()));
  static_assert(kMostCells == at(RenderSpec::kMostOfLattice * RenderSpec::kMostOfLattice));
  ENSURE(spec.grid.oversampling <= RenderSpec::kMostOfLattice);
  const std::size_t points = LatticeView::most_points(spec);
  for (int i = 0; i < pool.threads(); ++i) {
    benches_.push_back(std::make_unique<Bench>(view_, *target_, points));
    Bench& bench = *benches_.back();
    bench.seen.resize(points);
    bench.nearness.resize(points);
    bench.tallies.resize(at(all.width()));
    bench.mirrors.reserve(points);
  }
}

/// There is one for each thread of the pool.
LatticeRenderer::Bench& LatticeRenderer::take_bench() noexcept {
  for (std::size_t i = 0;; i = (i + 1) % benches_.size())
    if (!benches_[i]->taken.exchange(true, std::memory_order_acquire)) return *benches_[i];
}

RenderReport LatticeRenderer::render(const Snapshot& snapshot, Budget budget,
                                     Radiance& out) noexcept {
  const int s = spec_.grid.oversampling;
  const int most_points = budget.shed >= Shed::kSamples ? 1 : budget.samples_per_pixel;
  if (!view_.place(snapshot, spec_.lattice_side, most_points))
    return paths_.render(snapshot, budget, out);

  const PixelRect region = view_.region();
  out.region = region;
  out.oversampling = s;
  out.uniform_w_m2_sr = snapshot.background_w_m2_sr;
  out.motion_px = snapshot.smear_px;
  out.points.clear();
  out.grid.resize(region.width() * s, region.height() * s);
  out.cover.resize(out.grid.width(), out.grid.height());
  RenderReport report;
  report.samples_per_pixel = view_.points_a_pixel() * view_.points_a_pixel();
  bounces_ = budget.shed >= Shed::kBounces ? 0 : spec_.bounces;
  report.bounces = bounces_;
  shadows_by_map_ = budget.shed >= Shed::kShadows;
  report.visible_fraction = view_.footprint().visible_fraction();
  constexpr double kNotKnown = std::numeric_limits<double>::quiet_NaN();
  report.add({"method", "lattice", kNotKnown});
  report.add(bounces_rung(std::min(bounces_, BouncedLight::kMostBounces),
                          bounces_ == spec_.bounces ? spec_.bounces_left_out_e : kNotKnown));
  if (region.empty()) return report;
  report.add({"sun disc", spec_.sun_disc == SunDisc::kOff ? "none" : "glints", kNotKnown});
  cap_ = !snapshot.earth.dark() && bounces_ > 0;
  // Harmonics stand for the cap; without bounces there are no texels for it.
  const bool is_lamp = snapshot.earth.dark();
  const EarthshineModel taken = is_lamp ? snapshot.earthshine_rung.model
                                : cap_  ? EarthshineModel::kCap
                                        : EarthshineModel::kVector;
  report.add(
      {"earthshine", name_of(taken), is_lamp ? snapshot.earthshine_rung.error_e : kNotKnown});
  if (snapshot.earthshine_rung.albedo != AlbedoModel::kEven)
    report.add({"earthshine's albedo", name_of(snapshot.earthshine_rung.albedo),
                snapshot.earthshine_rung.albedo_error_e});
  texel_lamp_ = snapshot.sun.irradiance_w_m2 > 0.0 || cap_ ? 0 : 1;
  const double limit = budget.rho_mc > 0.0 ? budget.rho_mc : spec_.profile.rho_mc;
  using Renewal = BodyLight::Renewal;
  const bool hurried = budget.shed >= Shed::kUpkeep;
  light_up(snapshot, spec_.settled ? Renewal::kAtOnce
                     : hurried     ? Renewal::kInShares
                                   : Renewal::kAsNeeded);
  const bool as_it_stands = hurried && kept_lamp_ == texel_lamp_;
  if (bounces_ > 0 && !as_it_stands) {
    kept_lamp_ = texel_lamp_;
    const TexelLight::LampInView lamp{texel_lamp_, lamp_views_[texel_lamp_]};
    const double px_m = snapshot.camera.m.norm() * spec_.camera.ifov_rad();
    const auto cell_m = static_cast<float>(px_m / s);
    const auto update = [&] {
      const bool again = texels_.update(snapshot, lamp, px_m, spec_.settled, pool_);
      const float across = texels_.texel_m() / cell_m;
      cells_alike_ = across * across;
      const RayCounts counts = texels_.rays();
      report.rays += counts.rays;
      report.rejected_rays += counts.rejected;
      return again;
    };
    const int most = spec_.settled ? kMostSettledRounds : kMostRounds;
    // Where texels begin anew later on, patches do for a frame.
    bool again = update() || !std::exchange(begun_, true) || spec_.settled;
    for (int round = 0; round < most && again; ++round) {
      noise_.start(region, view_.points_a_pixel(), limit);
      pool_.rows(0, region.height(), [&](int row) { shade_row(snapshot, out, row); });
      again = update();
    }
  }
  noise_.start(region, view_.points_a_pixel(), limit);
  pool_.rows(0, region.height(), [&](int row) { shade_row(snapshot, out, row); });
  report.rho_mc = noise_.reached();
  for (int row = 0; row < region.height(); ++row) {
    const RowCounts& counts = row_counts_[at(row)];
    report.hits += counts.hits;
    report.rays += counts.rays.rays;
    report.rejected_rays += counts.rays.rejected;
  }
  report.samples = static_cast<std::uint64_t>(region.width()) *
                   static_cast<std::uint64_t>(region.height()) *
                   static_cast<std::uint64_t>(report.samples_per_pixel);
  return report;
}

void LatticeRenderer::light_up(const Snapshot& snapshot, BodyLight::Renewal renewal) noexcept {
  BodyView direct = snapshot;
  if (cap_) direct.earthshine.irradiance_w_m2 = 0.0;
  target_->facets.light_up(direct, spec_.sun_disc == SunDisc::kOff ? 0.0 : kSunAngularRadius_rad);
  const auto lamps = lamps_of(snapshot);
  for (std::size_t k = 0; k < kLamps; ++k) {
    toward_lamp_[k] = lamps[k]->toward.unit.cast<float>();
    const bool asked = lamps_of(direct)[k]->irradiance_w_m2 > 0.0 || k == texel_lamp_;
    if (asked) lamp_views_[k].update(lamps[k]->toward.unit, pool_);
  }
  if (bounces_ > 0) body_light_.light_up(snapshot, renewal, pool_);
}

void LatticeRenderer::shade_row(const Snapshot& snapshot, Radiance& out, int index) noexcept {
  Bench& bench = take_bench();
  bench.counts = {};
  bench.last_texel = {};
  bench.mirrors.clear();
  const Row row{snapshot, out, bench, index};
  view_.see(index, bench.seen, bench.nearness);
  bench.doubts.start({bench.seen, index, toward_lamp_});
  const int s = spec_.grid.oversampling;
  for (int r = index * s; r < (index + 1) * s; ++r) {
    std::ranges::fill(out.grid.row(r), 0.0F);
    std::ranges::fill(out.cover.row(r), 0.0F);
  }
  const PixelRect region = out.region;
  for (int column = 0; column < region.width(); ++column) {
    bench.tallies[at(column)] = {};
    if (view_.footprint().marked(region.left + column, region.top + index))
      for (const Tone& tone : bench.tones.find(bench.seen, column)) shade(row, column, tone);
  }
  settle(row);
  tell_noise(row);
  row_counts_[at(index)] = bench.counts;
  bench.taken.store(false, std::memory_order_release);
}

/// Light of `points` of a cell's.
void LatticeRenderer::add(const Row& row, int column, std::size_t cell, float points,
                          float radiance) const noexcept {
  const int s = spec_.grid.oversampling;
  const auto all = static_cast<float>(view_.side() * view_.side());
  row.out.grid.at(column * s + static_cast<int>(cell) % s,
                  row.index * s + static_cast<int>(cell) / s) += radiance * points / all;
}

void LatticeRenderer::shade(const Row& row, int column, const Tone& tone) noexcept {
  const int s = spec_.grid.oversampling;
  const int n = view_.points_a_pixel();
  const auto all = static_cast<float>(view_.side() * view_.side());
  row.bench.counts.hits += tone.points;
  unsigned sum_x = 0;
  unsigned sum_y = 0;
  for (std::size_t cell = 0; cell < at(s * s); ++cell) {
    if (tone.in_cell[cell] == 0) continue;
    sum_x += tone.sum_x[cell];
    sum_y += tone.sum_y[cell];
    row.out.cover.at(column * s + static_cast<int>(cell) % s,
                     row.index * s + static_cast<int>(cell) / s) +=
        static_cast<float>(tone.in_cell[cell]) / all;
  }
  const float half_steps = 2.0F * static_cast<float>(tone.points);
  Vector3f direction;
  const SurfacePoint middle = view_.place_on(
      tone.facet, static_cast<float>(column * n) + static_cast<float>(sum_x) / half_steps,
      static_cast<float>(row.index * n) + static_cast<float>(sum_y) / half_steps, direction);
  const PixelOnFacet pixel = pixel_on(tone.facet, column, row.index);
  CellLight light{};
  if (bounces_ > 0) add_kept(row, column, tone, middle, pixel, light);
  for (std::size_t k = 0; k < kLamps; ++k)
    if (target_->facets.radiance(tone.facet)[k] > 0.0F)
      add_lamp(row, column, tone, k, pixel, light);
  LatticeNoise::Tally& tally = row.bench.tallies[at(column)];
  for (std::size_t cell = 0; cell < at(s * s); ++cell) {
    if (tone.in_cell[cell] == 0) continue;
    const auto points = static_cast<float>(tone.in_cell[cell]);
    add(row, column, cell, points, light[cell]);
    tally.squares += points * light[cell] * light[cell];
  }

  if (bounces_ == 0 && spec_.bounces > 0) return;  // what mirrors see was not lit
  const float share =
      body_light_.mirror_share(middle.material, -middle.normal.dot(direction) / direction.norm());
  if (share <= 0.0F) return;
  Queue& queue = row.bench.mirror_rays;
  queue.rays.set(queue.used, middle.start(),
                 direction - 2.0F * direction.dot(middle.normal) * middle.normal);
  queue.who[at(queue.used)] = static_cast<std::uint32_t>(row.bench.mirrors.size());
  row.bench.mirrors.push_back({column, tone.facet, share, tone.in_cell});
  if (++queue.used == RayPacket::kLanes) send_mirror_rays(row);
}

LatticeRenderer::PixelOnFacet LatticeRenderer::pixel_on(std::uint32_t facet, int column,
                                                        int row) const noexcept {
  const int n = view_.points_a_pixel();
  Vector3f direction;
  const auto place = [&](int x, int y) {
    return view_
        .place_on(facet, static_cast<float>(column * n + x), static_cast<float>(row * n + y),
                  direction)
        .place;
  };
  const Vector3f corner = place(0, 0);
  return {corner, place(n, 0) - corner, place(0, n) - corner};
}

/// What is kept on the body, by texels.
void LatticeRenderer::add_kept(const Row& row, int column, const Tone& tone,
                               const SurfacePoint& middle, const PixelOnFacet& pixel,
                               CellLight& light) noexcept {
  const int s = spec_.grid.oversampling;
  const float per_half_step = 0.5F / static_cast<float>(view_.points_a_pixel());
  const auto weights = [&](const Vector3f& place) {
    const auto [second, third] = target_->facets.weights_at(tone.facet, place);
    return Vector2f(second, third);
  };
  const Vector2f corner = weights(pixel.corner);
  const Vector2f per_half_x = per_half_step * (weights(pixel.corner + pixel.across) - corner);
  const Vector2f per_half_y = per_half_step * (weights(pixel.corner + pixel.down) - corner);
  const SurfacePoint front = target_->facets.on_side(tone.facet, 0, 0, 0);
  const unsigned side = middle.normal.dot(front.normal) > 0.0F ? 0 : 1;
  const bool both = row.snapshot.earthshine.irradiance_w_m2 > 0.0 && texel_lamp_ == 0;
  const float other = both ? kept_by_patch(1, middle) : 0.0F;
  const auto all = static_cast<float>(view_.points_a_pixel() * view_.points_a_pixel());
  float variance = 0.0F;
  const auto& lamps = target_->facets.radiance(tone.facet);
  const float brightest = std::max(lamps[0], lamps[1]);
  if (std::exchange(row.bench.last_material, middle.material) != middle.material)
    row.bench.last_texel = {};
  TexelLight::Light& last = row.bench.last_texel;
  for (std::size_t cell = 0; cell < at(s * s); ++cell) {
    if (tone.in_cell[cell] == 0) continue;
    const auto points = static_cast<float>(tone.in_cell[cell]);
    const Vector2f place = corner + static_cast<float>(tone.sum_x[cell]) / points * per_half_x +
                           static_cast<float>(tone.sum_y[cell]) / points * per_half_y;
    const TexelLight::Light kept = texels_.at(tone.facet, side, place.x(), place.y());
    const bool known = !std::isnan(kept.w_m2_sr);
    const float bounced = known ? kept.w_m2_sr : without_texel(row, middle);
    light[cell] = other + bounced;
    const float noise = points / all * (known ? kept.noise_w_m2_sr : kPatchError * bounced);
    const float alike = noise_.alike(known ? cells_alike_ * kept.averaged : kAllAlike, s * s);
    variance += alike * noise * noise;
    if (kept.kept == TexelLight::kNone || kept.kept == last.kept) continue;
    // By the texel before of the same stuff.
    const auto sets = static_cast<float>(kept.sets);
    if (last.sets > 0 && noise_.too_noisy(last.noise_of_one, brightest + light[cell],
                                          sets * static_cast<float>(s * s) / alike))
      texels_.want_more(kept);
    last = kept;
  }
  row.bench.tallies[at(column)].variance += variance;
}

float LatticeRenderer::kept_by_patch(std::size_t lamp, const SurfacePoint& place) const noexcept {
  const std::uint32_t patch = body_light_.patches().at(place);
  return patch == SurfacePatches::kNone ? 0.0F : body_light_.to_camera(lamp, patch);
}

/// By patches; and the cap as if nothing stood before it.
float LatticeRenderer::without_texel(const Row& row, const SurfacePoint& place) const noexcept {
  const float bounced = kept_by_patch(texel_lamp_, place);
  if (!cap_) return bounced;
  const double received_w_m2 = row.snapshot.earth.irradiance_w_m2(place.normal.cast<double>());
  const double albedo = target_->facets.brdf(place.material).diffuse_albedo();
  return bounced + static_cast<float>(received_w_m2 * albedo / kPi);
}

void LatticeRenderer::add_lamp(const Row& row, int column, const Tone& tone, std::size_t lamp,
                               const PixelOnFacet& pixel, CellLight& light) const noexcept {
  const LampView& view = lamp_views_[lamp];
  const int s = spec_.grid.oversampling;
  const Vector2f corner = view.on_map(pixel.corner);
  const Vector2f across = view.on_map(pixel.corner + pixel.across) - corner;
  const Vector2f down = view.on_map(pixel.corner + pixel.down) - corner;
  // A parallelogram from `from`, `size` pixels wide: ask(low, high) of the box about it.
  const auto of_box = [&](const Vector2f& from, float size, const auto& ask) {
    const Vector2f b = from + size * across;
    const Vector2f c = from + size * down;
    const Vector2f d = b + size * down;
    return ask(from.cwiseMin(b).cwiseMin(c).cwiseMin(d), from.cwiseMax(b).cwiseMax(c).cwiseMax(d));
  };
  const auto ask_map = [&](const Vector2f& from, float size) {
    return of_box(from, size, [&](const Vector2f& low, const Vector2f& high) {
      return view.places(tone.facet, low, high);
    });
  };
  const Lit whole = ask_map(corner, 1.0F);
  if (whole == Lit::kNo) return;
  const float cell_px = 1.0F / static_cast<float>(s);
  const float direct = target_->facets.radiance(tone.facet)[lamp];
  for (std::size_t cell = 0; cell < at(s * s); ++cell) {
    if (tone.in_cell[cell] == 0) continue;
    const auto x = static_cast<int>(cell) % s;
    const auto y = static_cast<int>(cell) / s;
    Lit lit = whole;
    if (lit == Lit::kUnknown) {
      const Vector2f from = corner + static_cast<float>(x) * cell_px * across +
                            static_cast<float>(y) * cell_px * down;
      if (shadows_by_map_) {
        const float share = of_box(from, cell_px, [&](const Vector2f& low, const Vector2f& high) {
          return view.lit_share(tone.facet, low, high);
        });
        if (!std::isnan(share)) {
          light[cell] += share * direct;
          continue;
        }
      }
      lit = ask_map(from, cell_px);
    }
    if (lit == Lit::kYes) light[cell] += direct;
    if (lit == Lit::kUnknown)
      row.bench.doubts.add({.lamp = lamp,
                            .facet = tone.facet,
                            .column = column * s + x,
                            .cell_row = y,
                            .points = tone.in_cell[cell],
                            .beside_w_m2_sr = light[cell]});
  }
}

void LatticeRenderer::send_mirror_rays(const Row& row) const noexcept {
  Bench& bench = row.bench;
  Queue& queue = bench.mirror_rays;
  const std::size_t used = at(std::exchange(queue.used, 0));
  if (used == 0) return;
  for (std::size_t i = used; i < RayPacket::kLanes; ++i) queue.rays.active[i] = false;
  std::array<MeshHit, RayPacket::kLanes> hits;
  target_->scene.intersect(queue.rays, hits, bench.counts.rays);
  for (std::size_t i = 0; i < used; ++i) {
    const Vector3f direction(queue.rays.direction_x[i], queue.rays.direction_y[i],
                             queue.rays.direction_z[i]);
    const Mirror& mirror = bench.mirrors[queue.who[i]];
    float light = 0.0F;
    if (hits[i].triangle != MeshHit::kNone) {
      light = body_light_.leaving(target_->facets.at(hits[i], direction));
    } else if (cap_) {
      light = static_cast<float>(
          row.snapshot.earth.radiance_w_m2_sr(direction.cast<double>().normalized()));
    }
    for (std::size_t cell = 0; cell < kMostCells; ++cell)
      if (mirror.in_cell[cell] > 0)
        add(row, mirror.column, cell, static_cast<float>(mirror.in_cell[cell]),
            mirror.share * light);
  }
}

/// What is still open when the row's pixels are done.
void LatticeRenderer::settle(const Row& row) noexcept {
  Bench& bench = row.bench;
  send_mirror_rays(row);
  const int s = spec_.grid.oversampling;
  for (const ShadowDoubts::Doubt& d : bench.doubts.settle()) {
    const int cell = d.cell_row * s + d.column % s;
    const float light = target_->facets.radiance(d.facet)[d.lamp];
    add(row, d.column / s, at(cell), d.lit(), light);
    bench.tallies[at(d.column / s)].squares += d.lit() * light * (light + 2.0F * d.beside_w_m2_sr);
  }
  bench.counts.rays.rays += bench.doubts.rays().rays;
  bench.counts.rays.rejected += bench.doubts.rays().rejected;
}

void LatticeRenderer::tell_noise(const Row& row) noexcept {
  const int s = spec_.grid.oversampling;
  const int width = row.out.region.width();
  for (int column = 0; column < width; ++column) {
    const LatticeNoise::Tally& tally = row.bench.tallies[at(column)];
    if (!(tally.squares > 0.0F)) continue;
    float sum = 0.0F;
    for (int y = row.index * s; y < (row.index + 1) * s; ++y)
      for (int x = column * s; x < (column + 1) * s; ++x) sum += row.out.grid.at(x, y);
    noise_.set(at(row.index) * at(width) + at(column), sum / static_cast<float>(s * s), tally);
  }
}

}  // namespace engine
