#include "engine/render/texel_light.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <utility>

#include "engine/core/constants.h"
#include "engine/core/random.h"

namespace engine {
namespace {

using Eigen::Matrix3f;
using Eigen::Vector3d;
using Eigen::Vector3f;

constexpr std::size_t kMostKept = std::size_t{1} << 17U;
constexpr int kKeptAShare = 64;
constexpr std::uint32_t kSidesAShare = 1024;
// A texel's width in pixels, and by which factor it may come to be off.
constexpr double kTexelsAPx = 3.0;
constexpr double kMostOff = 1.5;
constexpr std::uint32_t kRaysAtOnce = 8;
// Places that may be where a texel's rays start: first so many, and if none is good up to the last.
constexpr std::array<std::size_t, 3> kTriedStarts = {0, 8, 72};
// Sets that get rays in a frame: some, and a share of all.
constexpr std::size_t kRefinedAFrame = 2048;
constexpr std::size_t kRefinedOf = 64;
constexpr std::uint32_t kMostSets = 8;
constexpr std::uint32_t kNumberBits = 28;
constexpr float kMostTurned_rad = 8e-3F;
constexpr std::uint32_t kSumEvery = 4;
constexpr std::uint32_t kSumEvenEvery = 16;
constexpr float kWeightSteps = 65535.0F;

/// The bins in an order of which each first 4 and 16 lie in different quarters and sixteenths.
constexpr std::array<std::uint8_t, HemisphereBins::kBins> kOrder = [] {
  std::array<std::uint8_t, HemisphereBins::kBins> order{};
  for (unsigned i = 0; i < order.size(); ++i) {
    unsigned x = 0;
    unsigned y = 0;
    for (unsigned bit = 0; bit < 3; ++bit) {
      x |= (i >> (2 * bit) & 1U) << (2 - bit);
      y |= (i >> (2 * bit + 1) & 1U) << (2 - bit);
    }
    order[i] = static_cast<std::uint8_t>(y * HemisphereBins::kSide + x);
  }
  return order;
}();

/// The bins in an order of which each is near the one before: along a Z through each four (Morton).
constexpr std::array<std::uint8_t, HemisphereBins::kBins> kNeighbours = [] {
  std::array<std::uint8_t, HemisphereBins::kBins> order{};
  for (unsigned i = 0; i < order.size(); ++i) {
    unsigned x = 0;
    unsigned y = 0;
    for (unsigned bit = 0; bit < 3; ++bit) {
      x |= (i >> (2 * bit) & 1U) << bit;
      y |= (i >> (2 * bit + 1) & 1U) << bit;
    }
    order[i] = static_cast<std::uint8_t>(y * HemisphereBins::kSide + x);
  }
  return order;
}();

/// Two numbers for each ray of a texel: fractional parts of multiples (Roberts 2018, R2).
class RayNumbers {
 public:
  explicit RayNumbers(std::uint32_t texel) noexcept {
    Draws draws(4, Stream::kLight, 0, texel);
    for (double& s : start_) s = static_cast<double>(draws.uniform());
    turned_ = draws.bits() % HemisphereBins::kBins;
  }
  [[nodiscard]] std::size_t bin(std::size_t ray) const noexcept { return kOrder[ray] ^ turned_; }
  [[nodiscard]] std::array<float, 2> at(std::size_t ray) const noexcept {
    constexpr std::array<double, 2> kSteps = {0.7548776662466927, 0.5698402909980532};
    std::array<float, 2> numbers{};
    for (std::size_t i = 0; i < numbers.size(); ++i) {
      const double x = start_[i] + kSteps[i] * static_cast<double>(ray);
      numbers[i] = static_cast<float>(x - std::floor(x));
    }
    return numbers;
  }

 private:
  std::array<double, 2> start_{};
  std::size_t turned_ = 0;
};

constexpr std::size_t kQuarters = 4;
constexpr std::size_t quarter_of(std::size_t bin) noexcept {
  constexpr std::size_t kHalf = HemisphereBins::kSide / 2;
  return bin / HemisphereBins::kSide / kHalf * 2 + bin % HemisphereBins::kSide / kHalf;
}

Matrix3f axes_of(const Vector3f& normal) noexcept {
  return basis_round(normal.cast<double>()).cast<float>();
}

std::uint16_t rounded(float weight) noexcept {
  return static_cast<std::uint16_t>(std::clamp(weight, 0.0F, 1.0F) * kWeightSteps + 0.5F);
}

}  // namespace

TexelLight::TexelLight(const TracedTarget& target, const BodyLight& body_light, int bounces)
    : target_(target),
      body_light_(body_light),
      further_(bounces > 1),
      grid_(target),
      kept_of_(grid_.most_texels(), kNone),
      asked_(grid_.most_texels(), 0),
      sent_(2 * target.mesh.triangles.size(), 0.0F) {
  kept_.reserve(kMostKept);
  states_.reserve(kMostKept);
  own_.reserve(kMostKept);
  values_.reserve(kMostKept);
  wanted_.reserve(kMostKept);
  if (further_) patches_.reserve(kMostKept);
  toward_lamp_.fill(Vector3f::Zero());
}

void TexelLight::start_over(float texel_m) noexcept {
  texel_m_ = grid_.cut(texel_m);
  if (texel_m_ > texel_m) least_m_ = texel_m_;
  kept_.clear();
  states_.clear();
  own_.clear();
  values_.clear();
  wanted_.clear();
  patches_.clear();
  refine_from_ = 0;
  std::fill_n(kept_of_.begin(), grid_.texels(), kNone);
  std::fill_n(asked_.begin(), grid_.texels(), std::uint8_t{0});
}

/// False: there was no room.
bool TexelLight::make_asked() noexcept {
  const std::uint8_t* const begin = asked_.data();
  const std::uint8_t* const end = begin + grid_.texels();
  for (const std::uint8_t* next = begin; next != end; ++next) {
    next = static_cast<const std::uint8_t*>(
        std::memchr(next, 1, static_cast<std::size_t>(end - next)));
    if (next == nullptr) break;
    const auto number = static_cast<std::uint32_t>(next - begin);
    asked_[number] = 0;
    if (kept_.size() == kMostKept) {
      least_m_ = static_cast<float>(kMostOff) * texel_m_;
      start_over(least_m_);
      return false;
    }
    kept_of_[number] = static_cast<std::uint32_t>(kept_.size());
    keep(grid_.texel(number), number);
  }
  return true;
}

void TexelLight::keep(const TexelGrid::Texel& texel, std::uint32_t number) noexcept {
  Kept& kept = kept_.emplace_back();
  kept.texel = texel;
  kept.number = number;
  kept.sides.fill(kNone);
  const std::uint32_t material = target_.facets.on_side(texel.facet, 0, 0, 0).material;
  states_.push_back({.lit_in = frame_, .even = body_light_.binned(material).even()});
  own_.push_back({});
  values_.push_back({});
  wanted_.push_back(0);
  if (further_) patches_.emplace_back();
}

/// Further sets for texels that have done with theirs, while there is room.
void TexelLight::make_wanted() noexcept {
  const std::size_t n = kept_.size();
  for (std::size_t k = 0; k < n && kept_.size() < kMostKept; ++k) {
    if (wanted_[k] == 0) continue;
    wanted_[k] = 0;
    std::size_t last = k;
    std::uint32_t sets = 1;
    for (; states_[last].next != kNone; ++sets) last = states_[last].next;
    if (sets == kMostSets || states_[last].rays != kRays) continue;
    states_[last].next = static_cast<std::uint32_t>(kept_.size());
    keep(TexelGrid::Texel(kept_[k].texel), kept_[k].number + (sets << kNumberBits));
    states_.back().first = false;
  }
}

/// Those that have waited longest.
void TexelLight::choose_due() noexcept {
  const std::size_t n = kept_.size();
  std::size_t left = kRefinedAFrame + n / kRefinedOf;
  for (std::size_t i = 0; i < n && left > 0; ++i) {
    if (refine_from_ >= n) refine_from_ = 0;
    State& state = states_[refine_from_++];
    if (state.done()) continue;
    state.due = true;
    --left;
  }
}

void TexelLight::light_sides(const Snapshot& snapshot, std::size_t lamp,
                             WorkerPool& pool) noexcept {
  const Vector3d toward = lamps_of(snapshot)[lamp]->toward.unit;
  const auto sides = static_cast<std::uint32_t>(sent_.size());
  pool.rows(0, static_cast<int>((sides + kSidesAShare - 1) / kSidesAShare), [&](int share) {
    const std::uint32_t first = static_cast<std::uint32_t>(share) * kSidesAShare;
    for (std::uint32_t s = first; s < std::min(sides, first + kSidesAShare); ++s) {
      const SurfacePoint corner = target_.facets.on_side(s / 2, 0, 0, s % 2);
      const double c = corner.normal.cast<double>().dot(toward);
      sent_[s] = c > 0.0
                     ? static_cast<float>(c * target_.facets.brdf(corner.material).albedo(c) / kPi)
                     : 0.0F;
    }
  });
}

void TexelLight::count(const RayCounts& counts) noexcept {
  rays_.fetch_add(counts.rays, std::memory_order_relaxed);
  rejected_.fetch_add(counts.rejected, std::memory_order_relaxed);
}

bool TexelLight::update(const Snapshot& snapshot, const LampInView& lamp, double px_m,
                        bool all_rays, WorkerPool& pool) noexcept {
  const float wished_m = std::max(static_cast<float>(px_m / kTexelsAPx), least_m_);
  if (!(wished_m <= kMostOff * texel_m_ && texel_m_ <= kMostOff * wished_m)) start_over(wished_m);
  const std::size_t before = kept_.size();
  const bool had_room = make_asked();
  make_wanted();
  choose_due();
  rays_ = rejected_ = 0;
  ++frame_;
  const Lamp& light = *lamps_of(snapshot)[lamp.index];
  irradiance_w_m2_ = static_cast<float>(light.irradiance_w_m2);
  // Another lamp is one that has turned.
  if (std::exchange(lamp_, lamp.index) != lamp.index) toward_lamp_.fill(Vector3f::Zero());
  toward_lamp_[frame_ % kTurns] = light.toward.unit.cast<float>();
  light_sides(snapshot, lamp.index, pool);
  note_turned();

  const std::size_t n = kept_.size();
  const int shares = static_cast<int>((n + kKeptAShare - 1) / kKeptAShare);
  const auto each_share = [&](const auto& work) {
    pool.rows(0, shares, [&](int share) {
      const std::size_t first = static_cast<std::size_t>(share) * kKeptAShare;
      work(first, std::min(n, first + kKeptAShare));
    });
  };
  each_share(
      [&](std::size_t first, std::size_t end) { tend(first, end, snapshot, lamp, all_rays); });
  each_share([&](std::size_t first, std::size_t end) { combine(first, end); });
  return !had_room || (all_rays && n > before);
}

void TexelLight::note_turned() noexcept {
  for (std::size_t f = 0; f < kTurns; ++f) {
    const float turned = (toward_lamp_[f] - toward_lamp_[frame_ % kTurns]).squaredNorm();
    // A direction that is no number has turned.
    turned_[f] = !(turned < kMostTurned_rad * kMostTurned_rad);
  }
}

void TexelLight::tend(std::size_t first, std::size_t end, const Snapshot& snapshot,
                      const LampInView& lamp, bool all_rays) noexcept {
  find_starts(first, end, snapshot);
  const std::uint64_t changed = send_rays(first, end, all_rays);
  Reflection reflection;
  for (std::size_t k = first; k < end; ++k)
    renew(k, (changed >> (k - first) & 1U) != 0, snapshot, lamp, reflection);
}

/// Bit i of the result: the texel `first` + i has further ones.
std::uint64_t TexelLight::send_rays(std::size_t first, std::size_t end, bool all_rays) noexcept {
  std::uint64_t changed = 0;
  RayPacket packet;
  std::array<std::pair<Kept*, std::size_t>, RayPacket::kLanes> who{};
  std::size_t lanes = 0;
  const auto send = [&] {
    follow(packet, std::span(who).first(lanes));
    packet = {};
    lanes = 0;
  };
  for (std::size_t k = first; k < end; ++k) {
    State& state = states_[k];
    const bool due = std::exchange(state.due, false) || state.rays == 0 || all_rays;
    if (state.done() || !due) continue;
    Kept& kept = kept_[k];
    changed |= std::uint64_t{1} << (k - first);
    const RayNumbers numbers(kept.number);
    const std::size_t last = all_rays ? kRays : state.rays + kRaysAtOnce;
    for (std::size_t ray = state.rays; ray < last; ++ray) {
      const std::size_t bin = numbers.bin(ray);
      const auto [c, d] = numbers.at(ray);
      const auto [a, b] = kept.starts[ray % kept.starts_known];
      const SurfacePoint from = grid_.place(kept.texel, a, b);
      packet.set(static_cast<int>(lanes), from.start(),
                 axes_of(from.normal).transpose() * HemisphereBins::direction(bin, c, d));
      kept.known |= std::uint64_t{1} << bin;
      kept.fine[bin] = static_cast<std::uint8_t>(HemisphereBins::fine(bin, c, d));
      who[lanes++] = {&kept, bin};
      if (lanes == RayPacket::kLanes) send();
    }
    state.rays = static_cast<std::uint8_t>(last);
  }
  if (lanes > 0) send();
  return changed;
}

/// Places that the camera sees: parts of a mesh may reach into one another, and a facet's hidden
/// part sees nothing.
void TexelLight::find_starts(std::size_t first, std::size_t end,
                             const Snapshot& snapshot) noexcept {
  RayPacket packet;
  struct Asker {
    Kept* kept = nullptr;
    std::array<float, 2> place{};
  };
  std::array<Asker, RayPacket::kLanes> who{};
  std::size_t lanes = 0;
  RayCounts counts;
  const auto send = [&] {
    std::array<bool, RayPacket::kLanes> blocked{};
    target_.scene.occluded(packet, blocked, counts);
    for (std::size_t l = 0; l < lanes; ++l) {
      Kept& kept = *who[l].kept;
      if (!blocked[l] && kept.starts_known < kStarts)
        kept.starts[kept.starts_known++] = who[l].place;
    }
    packet = {};
    lanes = 0;
  };
  for (std::size_t round = 0; round + 1 < kTriedStarts.size(); ++round) {
    for (std::size_t k = first; k < end; ++k) {
      if (states_[k].tried) continue;
      Kept& kept = kept_[k];
      if (kept.starts_known != 0) continue;
      const RayNumbers numbers(~kept.number);
      for (std::size_t i = kTriedStarts[round]; i < kTriedStarts[round + 1]; ++i) {
        const auto [a, b] = numbers.at(i);
        const SurfacePoint from = grid_.place(kept.texel, a, b);
        packet.set(static_cast<int>(lanes), from.start(),
                   (snapshot.camera.m.cast<float>() - from.place).normalized());
        who[lanes++] = {&kept, {a, b}};
        if (lanes == RayPacket::kLanes) send();
      }
    }
    if (lanes > 0) send();
  }
  for (std::size_t k = first; k < end; ++k) {
    if (std::exchange(states_[k].tried, true)) continue;
    states_[k].startless = kept_[k].starts_known == 0;
  }
  if (counts.rays + counts.rejected > 0) count(counts);
}

/// A packet's rays to where they end.
void TexelLight::follow(const RayPacket& packet,
                        std::span<const std::pair<Kept*, std::size_t>> who) noexcept {
  std::array<MeshHit, RayPacket::kLanes> hits;
  RayCounts counts;
  target_.scene.intersect(packet, hits, counts, RayCoherence::kScattered);
  count(counts);
  for (std::size_t l = 0; l < who.size(); ++l) {
    const auto [kept, bin] = who[l];
    kept->sides[bin] = kNone;
    if (hits[l].triangle == MeshHit::kNone) continue;
    const Vector3f d(packet.direction_x[l], packet.direction_y[l], packet.direction_z[l]);
    const SurfacePoint hit = target_.facets.at(hits[l], d);
    const SurfacePoint front = target_.facets.on_side(hits[l].triangle, 0, 0, 0);
    kept->sides[bin] = 2 * hits[l].triangle + (hit.normal.dot(front.normal) > 0.0F ? 0U : 1U);
    kept->weights[bin] = {rounded(hits[l].second), rounded(hits[l].third)};
    if (further_)
      patches_[static_cast<std::size_t>(kept - kept_.data())][bin] = body_light_.patches().at(hit);
  }
}

/// Which of the places met are in the light: of the lamp's map, and of rays where it cannot tell.
void TexelLight::ask_lamp(Kept& kept, const LampInView& lamp) noexcept {
  kept.lit = 0;
  RayPacket packet;
  std::array<std::size_t, RayPacket::kLanes> bin_of{};
  std::size_t lanes = 0;
  RayCounts counts;
  const auto send = [&] {
    std::array<bool, RayPacket::kLanes> blocked{};
    target_.scene.occluded(packet, blocked, counts);
    for (std::size_t l = 0; l < lanes; ++l)
      if (!blocked[l]) kept.lit |= std::uint64_t{1} << bin_of[l];
    packet = {};
    lanes = 0;
  };
  for (std::size_t bin = 0; bin < kRays; ++bin) {
    const std::uint32_t side = kept.sides[bin];
    if (side == kNone || !(sent_[side] > 0.0F)) continue;
    const std::uint32_t facet = side / 2;
    const SurfacePoint place =
        target_.facets.on_side(facet, static_cast<float>(kept.weights[bin][0]) / kWeightSteps,
                               static_cast<float>(kept.weights[bin][1]) / kWeightSteps, side % 2);
    const Eigen::Vector2f on_map = lamp.view.on_map(place.place);
    const Lit lit = lamp.view.places(facet, on_map, on_map);
    if (lit == Lit::kYes) kept.lit |= std::uint64_t{1} << bin;
    if (lit != Lit::kUnknown) continue;
    packet.set(static_cast<int>(lanes), place.start(), toward_lamp_[frame_ % kTurns]);
    bin_of[lanes++] = bin;
    if (lanes == RayPacket::kLanes) send();
  }
  if (lanes > 0) send();
  if (counts.rays + counts.rejected > 0) count(counts);
}

void TexelLight::renew(std::size_t k, bool changed, const Snapshot& snapshot,
                       const LampInView& lamp, Reflection& reflection) noexcept {
  State& state = states_[k];
  // Neighbours at once: they lie side by side in memory.
  const auto phase = static_cast<std::uint32_t>(k / kKeptAShare) + frame_;
  if (changed || phase % kTurns == 0 || turned_[state.lit_in % kTurns]) {
    state.lit_in = frame_;
    ask_lamp(kept_[k], lamp);
    changed = true;
  }
  if (!changed && phase % (state.even ? kSumEvenEvery : kSumEvery) != 0) return;
  weigh(kept_[k], snapshot, reflection);
  own_[k].of_lamp = of_lamp(k, reflection);
  own_[k].of_earth_w_m2_sr = of_earth(k, reflection);
  if (changed) own_[k].noise = noise(k, reflection);
}

/// The mean over a texel's sets, by their rays.
void TexelLight::combine(std::size_t first, std::size_t end) noexcept {
  for (std::size_t k = first; k < end; ++k) {
    if (!states_[k].first) continue;
    values_[k] = own_[k];
    values_[k].noise_of_one = own_[k].noise;
    if (states_[k].next == kNone) continue;
    float rays = 0.0F;
    Value sum{.sets = 0};
    for (std::size_t set = k; set != kNone; set = states_[set].next) {
      const auto weight = static_cast<float>(states_[set].rays);
      ++sum.sets;
      if (weight == 0.0F) continue;
      rays += weight;
      sum.of_lamp += weight * own_[set].of_lamp;
      sum.of_earth_w_m2_sr += weight * own_[set].of_earth_w_m2_sr;
      const float noise = weight * own_[set].noise;
      sum.noise += noise * noise;
      sum.noise_of_one += noise;
    }
    values_[k] = {sum.of_lamp / rays, std::sqrt(sum.noise) / rays, sum.of_earth_w_m2_sr / rays,
                  sum.noise_of_one / rays, sum.sets};
  }
}

/// Over one facet the camera stands in the same direction.
void TexelLight::weigh(const Kept& kept, const Snapshot& snapshot,
                       Reflection& reflection) const noexcept {
  const std::uint32_t side = 2 * kept.texel.facet + kept.texel.side;
  if (reflection.side == side) return;
  reflection.side = side;
  const SurfacePoint place =
      target_.facets.on_side(kept.texel.facet, 1.0F / 3.0F, 1.0F / 3.0F, kept.texel.side);
  const Vector3f to_camera =
      (snapshot.camera.m - place.place.cast<double>()).normalized().cast<float>();
  const Vector3f out = axes_of(place.normal) * to_camera;
  reflection.facing = out.z() > 0.0F;
  const BinnedBrdf& brdf = body_light_.binned(place.material);
  if (brdf.even()) {
    reflection.weights.fill(brdf.even_share());
  } else {
    brdf.weigh(out, reflection.weights);
  }
  reflect_earth(snapshot.earth, place.normal, reflection);
}

/// Over a body all look at the same Earth.
void TexelLight::reflect_earth(const EarthLight& earth, const Vector3f& normal,
                               Reflection& reflection) const noexcept {
  reflection.sees_earth = false;
  if (earth.dark() || !reflection.facing) return;
  HemisphereBins::FineValues light;
  HemisphereBins::see(earth, axes_of(normal), light);
  for (std::size_t bin = 0; bin < kRays; ++bin) {
    float sum = 0.0F;
    for (const float a : {0.0F, 0.5F}) {
      for (const float b : {0.0F, 0.5F}) {
        const std::size_t fine = HemisphereBins::fine(bin, a, b);
        sum += 0.25F * light[fine] * reflection.weights[fine];
      }
    }
    reflection.earth_w_m2_sr[bin] = sum;
    reflection.sees_earth = reflection.sees_earth || sum > 0.0F;
  }
}

/// What a known bin's ray brings, for 1 W/m^2 of the lamp.
float TexelLight::arriving(std::size_t k, std::size_t bin) const noexcept {
  const Kept& kept = kept_[k];
  const std::uint32_t side = kept.sides[bin];
  if (side == kNone) return 0.0F;
  float light = static_cast<float>(kept.lit >> bin & 1U) * sent_[side];
  if (further_) light += body_light_.further(lamp_, patches_[k][bin]);
  return light;
}

float TexelLight::of_lamp(std::size_t k, const Reflection& reflection) const noexcept {
  const Kept& kept = kept_[k];
  if (kept.known == 0) return std::numeric_limits<float>::quiet_NaN();
  if (!reflection.facing) return 0.0F;
  float reflected = 0.0F;
  std::array<float, kQuarters> sum{};
  std::array<float, kQuarters> sent{};
  for (std::size_t bin = 0; bin < kRays; ++bin) {
    if ((kept.known >> bin & 1U) == 0) continue;
    const float light = arriving(k, bin);
    sent[quarter_of(bin)] += 1.0F;
    sum[quarter_of(bin)] += light;
    reflected += reflection.weights[kept.fine[bin]] * light;
  }
  if (kept.known == ~std::uint64_t{0}) return reflected;
  // What is not known yet is like what is of the same quarter of the hemisphere: no quarter is
  // without, the first rays have it so.
  for (std::size_t bin = 0; bin < kRays; ++bin) {
    if ((kept.known >> bin & 1U) != 0) continue;
    float weight = 0.0F;
    for (const float a : {0.0F, 0.5F})
      for (const float b : {0.0F, 0.5F})
        weight += 0.25F * reflection.weights[HemisphereBins::fine(bin, a, b)];
    reflected += weight * sum[quarter_of(bin)] / sent[quarter_of(bin)];
  }
  return reflected;
}

/// By the bins that the sky is open to.
float TexelLight::of_earth(std::size_t k, const Reflection& reflection) const noexcept {
  if (!reflection.sees_earth) return 0.0F;
  const Kept& kept = kept_[k];
  float light = 0.0F;
  std::array<float, kQuarters> open{};
  std::array<float, kQuarters> sent{};
  for (std::size_t bin = 0; bin < kRays; ++bin) {
    if ((kept.known >> bin & 1U) == 0) continue;
    sent[quarter_of(bin)] += 1.0F;
    if (kept.sides[bin] != kNone) continue;
    open[quarter_of(bin)] += 1.0F;
    light += reflection.earth_w_m2_sr[bin];
  }
  for (std::size_t bin = 0; bin < kRays; ++bin)
    if ((kept.known >> bin & 1U) == 0)
      light += reflection.earth_w_m2_sr[bin] * open[quarter_of(bin)] / sent[quarter_of(bin)];
  return light;
}

/// Successive differences stand for the variance within bins: Wolter 2007, Introduction to Variance
/// Estimation, 2nd ed., section 8.2. They have that between neighbours too: an upper bound.
float TexelLight::noise(std::size_t k, const Reflection& reflection) const noexcept {
  const Kept& kept = kept_[k];
  if (!reflection.facing) return 0.0F;
  float squares = 0.0F;
  float last = 0.0F;
  int known = 0;
  for (const std::size_t bin : kNeighbours) {
    if ((kept.known >> bin & 1U) == 0) continue;
    const float light = reflection.weights[kept.fine[bin]] * arriving(k, bin);
    if (known++ > 0) squares += (light - last) * (light - last);
    last = light;
  }
  if (known < 2) return 0.0F;
  const auto n = static_cast<float>(known);
  return static_cast<float>(kRays) * std::sqrt(squares / (2.0F * (n - 1.0F) * n));
}

}  // namespace engine
