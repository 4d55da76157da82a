#include "engine/render/texel_light.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <utility>

#include "engine/core/constants.h"

namespace engine {
namespace {

using Eigen::Matrix3f;
using Eigen::Vector3d;
using Eigen::Vector3f;

constexpr int kKeptAShare = 64;
constexpr std::uint32_t kSidesAShare = 1024;
// A texel's width in pixels, and by which factor it may come to be off.
constexpr double kTexelsAPx = 3.0;
constexpr double kMostOff = 1.5;
// Sets that get rays in a frame: some, and a share of all.
constexpr std::size_t kRefinedAFrame = 2048;
constexpr std::size_t kRefinedOf = 64;
constexpr std::uint32_t kMostSets = 8;
// Texels made in a frame: so many first rays take 20 ms of one core.
constexpr std::size_t kMadeAFrame = 8192;
constexpr std::uint32_t kNumberBits = 28;
constexpr float kMostTurned_rad = 8e-3F;
// What is due to be summed up is so in one of so many frames.
constexpr std::uint32_t kSumEvery = 4;
// The camera's turn: lobes kept by bins are some 15 deg wide, and evenly sent light ends at 90 deg.
constexpr auto kLobeTurned_rad = static_cast<float>(1.0 * kDegree);
constexpr auto kEvenTurned_rad = static_cast<float>(3.0 * kDegree);
constexpr std::uint32_t kAwake = 16;  // frames
// Of 8 rays over the distance that they went, and less for more.
constexpr float kReachOfOne = 8.0F * 0.15F;

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

constexpr std::size_t kQuarters = 4;
constexpr std::size_t quarter_of(std::size_t bin) noexcept {
  constexpr std::size_t kHalf = HemisphereBins::kSide / 2;
  return bin / HemisphereBins::kSide / kHalf * 2 + bin % HemisphereBins::kSide / kHalf;
}

}  // namespace

TexelLight::TexelLight(const TracedTarget& target, const BodyLight& body_light, int bounces)
    : target_(target),
      body_light_(body_light),
      further_(bounces > 1),
      grid_(target),
      rays_(target, grid_, further_ ? &body_light.patches() : nullptr),
      first_of_(grid_.most_texels(), kNone),
      asked_(grid_.most_texels(), 0),
      sent_(2 * target.mesh.triangles.size(), 0.0F),
      lamp_turns_(kMostTurned_rad),
      camera_turns_(kLobeTurned_rad),
      camera_even_turns_(kEvenTurned_rad),
      cap_(target) {
  states_.reserve(TexelRays::kMostSets);
  own_.reserve(TexelRays::kMostSets);
  values_.reserve(TexelRays::kMostSets);
  shown_.reserve(TexelRays::kMostSets);
  wanted_.reserve(TexelRays::kMostSets);
  looked_at_.reserve(TexelRays::kMostSets);
}

void TexelLight::start_over(float texel_m) noexcept {
  texel_m_ = grid_.cut(texel_m);
  if (texel_m_ > texel_m) least_m_ = texel_m_;
  rays_.clear();
  cap_.clear();
  states_.clear();
  own_.clear();
  values_.clear();
  shown_.clear();
  wanted_.clear();
  looked_at_.clear();
  refine_from_ = 0;
  std::fill_n(first_of_.begin(), grid_.texels(), kNone);
  std::fill_n(asked_.begin(), grid_.texels(), std::uint8_t{0});
}

/// False: there was no room.
bool TexelLight::make_asked(bool all) noexcept {
  const std::uint8_t* const begin = asked_.data();
  const std::uint8_t* const end = begin + grid_.texels();
  if (rays_.size() + static_cast<std::size_t>(std::count(begin, end, 1)) > TexelRays::kMostSets) {
    least_m_ = static_cast<float>(kMostOff) * texel_m_;
    start_over(least_m_);
    return false;
  }
  std::size_t left = all ? grid_.texels() : kMadeAFrame;
  for (const std::uint8_t* next = begin; next != end && left > 0; ++next, --left) {
    next = static_cast<const std::uint8_t*>(
        std::memchr(next, 1, static_cast<std::size_t>(end - next)));
    if (next == nullptr) break;
    const auto number = static_cast<std::uint32_t>(next - begin);
    asked_[number] = 0;
    first_of_[number] = static_cast<std::uint32_t>(rays_.size());
    keep(grid_.texel(number), number, first_of_[number]);
  }
  return true;
}

void TexelLight::keep(const TexelGrid::Texel& texel, std::uint32_t number,
                      std::uint32_t first) noexcept {
  rays_.add(texel, number);
  cap_.keep(2 * texel.facet + texel.side);
  const std::uint32_t material = target_.facets.on_side(texel.facet, 0, 0, 0).material;
  states_.push_back({.lit_in = frame_,
                     .looked_at_in = frame_,
                     .first = first,
                     .even = body_light_.binned(material).even()});
  own_.push_back({});
  values_.push_back({});
  shown_.push_back({});
  wanted_.push_back(0);
  looked_at_.push_back(0);
}

/// Further sets for texels that have done with theirs, while there is room.
void TexelLight::make_wanted() noexcept {
  const std::size_t n = rays_.size();
  for (std::size_t k = 0; k < n && !rays_.full(); ++k) {
    if (wanted_[k] == 0) continue;
    wanted_[k] = 0;
    std::size_t last = k;
    std::uint32_t sets = 1;
    for (; states_[last].next != kNone; ++sets) last = states_[last].next;
    if (sets == kMostSets || rays_.progress(last).sent != kRays) continue;
    states_[last].next = static_cast<std::uint32_t>(rays_.size());
    const TexelRays::Set& own = rays_.set(k);
    keep(TexelGrid::Texel(own.texel), own.number + (sets << kNumberBits),
         static_cast<std::uint32_t>(k));
  }
}

bool TexelLight::awake(std::size_t first) const noexcept {
  return frame_ - states_[first].looked_at_in <= kAwake;
}

void TexelLight::note_looks(std::size_t first, std::size_t end) noexcept {
  for (std::size_t k = first; k < end; ++k) {
    states_[k].back = false;
    if (std::exchange(looked_at_[k], std::uint8_t{0}) == 0) continue;
    states_[k].back = !awake(k);
    states_[k].looked_at_in = frame_;
  }
}

/// Those that have waited longest.
void TexelLight::choose_due() noexcept {
  const std::size_t n = rays_.size();
  std::size_t left = kRefinedAFrame + n / kRefinedOf;
  for (std::size_t i = 0; i < n && left > 0; ++i) {
    if (refine_from_ >= n) refine_from_ = 0;
    const std::size_t set = refine_from_++;
    TexelRays::Progress& progress = rays_.progress(set);
    if (progress.done() || !awake(states_[set].first)) continue;
    progress.due = true;
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

bool TexelLight::update(const Snapshot& snapshot, const LampInView& lamp, double px_m,
                        bool all_rays, WorkerPool& pool) noexcept {
  const float wished_m = std::max(static_cast<float>(px_m / kTexelsAPx), least_m_);
  if (!(wished_m <= kMostOff * texel_m_ && texel_m_ <= kMostOff * wished_m)) start_over(wished_m);
  const std::size_t before = rays_.size();
  const bool had_room = make_asked(all_rays);
  make_wanted();
  ++frame_;
  const Lamp& light = *lamps_of(snapshot)[lamp.index];
  irradiance_w_m2_ = static_cast<float>(light.irradiance_w_m2);
  // Another lamp is one that has turned.
  if (std::exchange(lamp_, lamp.index) != lamp.index) lamp_turns_.forget();
  lamp_turns_.note(frame_, light.toward.unit.cast<float>());
  light_sides(snapshot, lamp.index, pool);
  cap_.renew(frame_, snapshot.earth, pool);
  const Vector3f to_camera = snapshot.camera.m.normalized().cast<float>();
  camera_turns_.note(frame_, to_camera);
  camera_even_turns_.note(frame_, to_camera);

  const std::size_t n = rays_.size();
  const int shares = static_cast<int>((n + kKeptAShare - 1) / kKeptAShare);
  const auto each_share = [&](const auto& work) {
    pool.rows(0, shares, [&](int share) {
      const std::size_t first = static_cast<std::size_t>(share) * kKeptAShare;
      work(first, std::min(n, first + kKeptAShare));
    });
  };
  each_share([&](std::size_t first, std::size_t end) { note_looks(first, end); });
  choose_due();
  each_share(
      [&](std::size_t first, std::size_t end) { tend(first, end, snapshot, lamp, all_rays); });
  each_share([&](std::size_t first, std::size_t end) { combine(first, end); });
  each_share([&](std::size_t first, std::size_t end) { smooth(first, end, all_rays); });
  counts_ = rays_.take_counts();
  return !had_room || (all_rays && n > before);
}

void TexelLight::tend(std::size_t first, std::size_t end, const Snapshot& snapshot,
                      const LampInView& lamp, bool all_rays) noexcept {
  const std::uint64_t changed = rays_.send(first, end, snapshot.camera, all_rays);
  Reflection reflection;
  for (std::size_t k = first; k < end; ++k)
    renew(k, (changed >> (k - first) & 1U) != 0, snapshot, lamp, reflection);
}

void TexelLight::renew(std::size_t k, bool changed, const Snapshot& snapshot,
                       const LampInView& lamp, Reflection& reflection) noexcept {
  State& state = states_[k];
  state.summed = false;
  if (!changed && !awake(state.first)) return;
  // Neighbours at once: they lie side by side in memory.
  const auto phase = static_cast<std::uint32_t>(k / kKeptAShare) + frame_;
  if (changed || phase % RecentTurns::kFrames == 0 || lamp_turns_.since(state.lit_in)) {
    state.lit_in = frame_;
    rays_.ask_lamp(k, lamp.view, lamp_turns_.now(), sent_);
    changed = true;
  }
  const RecentTurns& turns = state.even ? camera_even_turns_ : camera_turns_;
  const bool turn = phase % kSumEvery == 0 || states_[state.first].back;
  state.summed = changed || (turn && turns.since(state.summed_in));
  if (!state.summed) return;
  state.summed_in = frame_;
  weigh(rays_.set(k).texel, snapshot, reflection);
  own_[k].of_lamp = of_lamp(k, reflection);
  own_[k].of_earth_w_m2_sr = of_earth(k, reflection);
  if (changed) own_[k].noise = noise(k, reflection);
}

/// The mean over a texel's sets, by their rays.
void TexelLight::combine(std::size_t first, std::size_t end) noexcept {
  for (std::size_t k = first; k < end; ++k) {
    if (states_[k].first != k) continue;
    bool summed = false;
    for (std::size_t set = k; set != kNone; set = states_[set].next)
      summed = summed || states_[set].summed;
    states_[k].summed = summed;
    if (!summed) continue;
    values_[k] = own_[k];
    values_[k].noise_of_one = own_[k].noise;
    values_[k].rays = static_cast<float>(rays_.progress(k).sent);
    values_[k].reach_m = kReachOfOne * rays_.distance_m(k) / values_[k].rays;
    if (states_[k].next == kNone) continue;
    float rays = 0.0F;
    Value sum{.sets = 0};
    for (std::size_t set = k; set != kNone; set = states_[set].next) {
      const auto weight = static_cast<float>(rays_.progress(set).sent);
      ++sum.sets;
      if (weight == 0.0F) continue;
      rays += weight;
      sum.of_lamp += weight * own_[set].of_lamp;
      sum.of_earth_w_m2_sr += weight * own_[set].of_earth_w_m2_sr;
      const float noise = weight * own_[set].noise;
      sum.noise += noise * noise;
      sum.noise_of_one += noise;
    }
    values_[k] = {.of_lamp = sum.of_lamp / rays,
                  .noise = std::sqrt(sum.noise) / rays,
                  .of_earth_w_m2_sr = sum.of_earth_w_m2_sr / rays,
                  .noise_of_one = sum.noise_of_one / rays,
                  .sets = sum.sets,
                  .rays = rays,
                  .reach_m = kReachOfOne * rays_.distance_m(k) / rays};
  }
}

/// Of those that were summed up, by their rays.
void TexelLight::smooth(std::size_t first, std::size_t end, bool all) noexcept {
  for (std::size_t k = first; k < end; ++k) {
    if (states_[k].first != k || !(states_[k].summed || all)) continue;
    const Value& own = values_[k];
    shown_[k] = own;
    // Texels of a side stand no closer than half the width that was asked for.
    if (!(own.reach_m > 0.5F * texel_m_)) continue;
    Value sum{.rays = 0};
    float squares = 0.0F;
    const auto add = [&](std::uint32_t texel, float distance2_m2) {
      const std::uint32_t near = first_of_[texel];
      if (near == kNone || !awake(near)) return;
      const Value& value = values_[near];
      // Near to both: what is bright close to a corner would else be added where it is not, and
      // stay where it is. A reach that is no number has no rays either.
      if (!(distance2_m2 <= value.reach_m * value.reach_m)) return;
      const float weight = value.rays;
      sum.rays += weight;
      squares += weight * weight;
      sum.of_lamp += weight * value.of_lamp;
      sum.of_earth_w_m2_sr += weight * value.of_earth_w_m2_sr;
      sum.noise += weight * weight * value.noise * value.noise;
    };
    const TexelRays::Set& set = rays_.set(k);
    grid_.each_near(set.number, set.texel, own.reach_m, add);
    const float averaged = sum.rays * sum.rays / squares;
    // By its own noise alone: what its neighbours get must not depend on theirs, see want_more().
    shown_[k] = {.of_lamp = sum.of_lamp / sum.rays,
                 .noise = std::sqrt(sum.noise) / sum.rays,
                 .of_earth_w_m2_sr = sum.of_earth_w_m2_sr / sum.rays,
                 .noise_of_one = own.noise_of_one / std::sqrt(averaged),
                 .sets = own.sets,
                 .averaged = averaged};
  }
}

/// Over one facet the camera stands in the same direction.
void TexelLight::weigh(const TexelGrid::Texel& texel, const Snapshot& snapshot,
                       Reflection& reflection) const noexcept {
  const std::uint32_t side = 2 * texel.facet + texel.side;
  if (reflection.side == side) return;
  reflection.side = side;
  const SurfacePoint place =
      target_.facets.on_side(texel.facet, 1.0F / 3.0F, 1.0F / 3.0F, texel.side);
  const Vector3f to_camera =
      (snapshot.camera.m - place.place.cast<double>()).normalized().cast<float>();
  const Vector3f out = TexelRays::axes_of(place.normal) * to_camera;
  reflection.facing = out.z() > 0.0F;
  reflection.sees_earth = false;
  if (!reflection.facing) return;
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
  if (earth.dark()) return;
  const CapLight::Kept* const kept = cap_.of(reflection.side);
  if (kept != nullptr && kept->dark) return;
  HemisphereBins::FineValues seen;
  if (kept == nullptr) HemisphereBins::see(earth, TexelRays::axes_of(normal), seen);
  const HemisphereBins::FineValues& light = kept != nullptr ? kept->w_m2_sr : seen;
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
  const TexelRays::Set& set = rays_.set(k);
  const std::uint32_t side = set.sides[bin];
  if (side == kNone) return 0.0F;
  float light = static_cast<float>(set.lit >> bin & 1U) * sent_[side];
  if (further_) light += body_light_.further(lamp_, rays_.patch_met(k, bin));
  return light;
}

float TexelLight::of_lamp(std::size_t k, const Reflection& reflection) const noexcept {
  const TexelRays::Set& set = rays_.set(k);
  if (set.known == 0) return std::numeric_limits<float>::quiet_NaN();
  if (!reflection.facing) return 0.0F;
  float reflected = 0.0F;
  std::array<float, kQuarters> sum{};
  std::array<float, kQuarters> sent{};
  for (std::size_t bin = 0; bin < kRays; ++bin) {
    if ((set.known >> bin & 1U) == 0) continue;
    const float light = arriving(k, bin);
    sent[quarter_of(bin)] += 1.0F;
    sum[quarter_of(bin)] += light;
    reflected += reflection.weights[set.fine[bin]] * light;
  }
  if (set.known == ~std::uint64_t{0}) return reflected;
  // What is not known yet is like what is of the same quarter of the hemisphere: no quarter is
  // without, the first rays have it so.
  for (std::size_t bin = 0; bin < kRays; ++bin) {
    if ((set.known >> bin & 1U) != 0) continue;
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
  const TexelRays::Set& set = rays_.set(k);
  float light = 0.0F;
  std::array<float, kQuarters> open{};
  std::array<float, kQuarters> sent{};
  for (std::size_t bin = 0; bin < kRays; ++bin) {
    if ((set.known >> bin & 1U) == 0) continue;
    sent[quarter_of(bin)] += 1.0F;
    if (set.sides[bin] != kNone) continue;
    open[quarter_of(bin)] += 1.0F;
    light += reflection.earth_w_m2_sr[bin];
  }
  for (std::size_t bin = 0; bin < kRays; ++bin)
    if ((set.known >> bin & 1U) == 0)
      light += reflection.earth_w_m2_sr[bin] * open[quarter_of(bin)] / sent[quarter_of(bin)];
  return light;
}

/// Successive differences stand for the variance within bins: Wolter 2007, Introduction to Variance
/// Estimation, 2nd ed., section 8.2. They have that between neighbours too: an upper bound.
float TexelLight::noise(std::size_t k, const Reflection& reflection) const noexcept {
  const TexelRays::Set& set = rays_.set(k);
  if (!reflection.facing) return 0.0F;
  float squares = 0.0F;
  float last = 0.0F;
  int known = 0;
  for (const std::size_t bin : kNeighbours) {
    if ((set.known >> bin & 1U) == 0) continue;
    const float light = reflection.weights[set.fine[bin]] * arriving(k, bin);
    if (known++ > 0) squares += (light - last) * (light - last);
    last = light;
  }
  if (known < 2) return 0.0F;
  const auto n = static_cast<float>(known);
  return static_cast<float>(kRays) * std::sqrt(squares / (2.0F * (n - 1.0F) * n));
}

}  // namespace engine
