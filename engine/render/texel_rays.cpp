#include "engine/render/texel_rays.h"

#include <algorithm>
#include <cmath>

#include "engine/core/random.h"

namespace engine {
namespace {

using Eigen::Vector3f;

constexpr std::uint32_t kRaysAtOnce = 8;
// Places that may be where a texel's rays start: first so many, and if none is good up to the last.
constexpr std::array<std::size_t, 3> kTriedStarts = {0, 8, 72};
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

std::uint16_t rounded(float weight) noexcept {
  return static_cast<std::uint16_t>(std::lround(std::clamp(weight, 0.0F, 1.0F) * kWeightSteps));
}

}  // namespace

TexelRays::TexelRays(const TracedTarget& target, const TexelGrid& grid,
                     const SurfacePatches* patches)
    : target_(target), grid_(grid), patches_(patches) {
  sets_.reserve(kMostSets);
  progress_.reserve(kMostSets);
  if (patches_ != nullptr) met_.reserve(kMostSets);
}

void TexelRays::clear() noexcept {
  sets_.clear();
  progress_.clear();
  met_.clear();
}

void TexelRays::add(const TexelGrid::Texel& texel, std::uint32_t number) noexcept {
  Set& set = sets_.emplace_back();
  set.texel = texel;
  set.number = number;
  set.sides.fill(kNone);
  progress_.push_back({});
  if (patches_ != nullptr) met_.emplace_back();
}

void TexelRays::count(const RayCounts& counts) noexcept {
  rays_.fetch_add(counts.rays, std::memory_order_relaxed);
  rejected_.fetch_add(counts.rejected, std::memory_order_relaxed);
}

std::uint64_t TexelRays::send(std::size_t first, std::size_t end, const Position<BodyFrame>& camera,
                              bool all) noexcept {
  find_starts(first, end, camera.m.cast<float>());
  std::uint64_t changed = 0;
  RayPacket packet;
  std::array<std::pair<std::size_t, std::size_t>, RayPacket::kLanes> who{};  // set and bin
  std::size_t lanes = 0;
  const auto send = [&] {
    follow(packet, std::span(who).first(lanes));
    packet = {};
    lanes = 0;
  };
  for (std::size_t k = first; k < end; ++k) {
    Progress& progress = progress_[k];
    const bool due = std::exchange(progress.due, false) || progress.sent == 0 || all;
    if (progress.done() || !due) continue;
    Set& set = sets_[k];
    changed |= std::uint64_t{1} << (k - first);
    const RayNumbers numbers(set.number);
    const std::size_t last = all ? kRays : progress.sent + kRaysAtOnce;
    for (std::size_t ray = progress.sent; ray < last; ++ray) {
      const std::size_t bin = numbers.bin(ray);
      const auto [c, d] = numbers.at(ray);
      const auto [a, b] = set.starts[ray % set.starts_known];
      const SurfacePoint from = grid_.place(set.texel, a, b);
      packet.set(static_cast<int>(lanes), from.start(),
                 axes_of(from.normal).transpose() * HemisphereBins::direction(bin, c, d));
      set.known |= std::uint64_t{1} << bin;
      set.fine[bin] = static_cast<std::uint8_t>(HemisphereBins::fine(bin, c, d));
      who[lanes++] = {k, bin};
      if (lanes == RayPacket::kLanes) send();
    }
    progress.sent = static_cast<std::uint8_t>(last);
  }
  if (lanes > 0) send();
  return changed;
}

void TexelRays::find_starts(std::size_t first, std::size_t end, const Vector3f& camera) noexcept {
  RayPacket packet;
  struct Asker {
    Set* set = nullptr;
    std::array<float, 2> place{};
  };
  std::array<Asker, RayPacket::kLanes> who{};
  std::size_t lanes = 0;
  RayCounts counts;
  const auto send = [&] {
    std::array<bool, RayPacket::kLanes> blocked{};
    target_.scene.occluded(packet, blocked, counts);
    for (std::size_t l = 0; l < lanes; ++l) {
      Set& set = *who[l].set;
      if (!blocked[l] && set.starts_known < Set::kStarts)
        set.starts[set.starts_known++] = who[l].place;
    }
    packet = {};
    lanes = 0;
  };
  for (std::size_t round = 0; round + 1 < kTriedStarts.size(); ++round) {
    for (std::size_t k = first; k < end; ++k) {
      if (progress_[k].tried) continue;
      Set& set = sets_[k];
      if (set.starts_known != 0) continue;
      const RayNumbers numbers(~set.number);
      for (std::size_t i = kTriedStarts[round]; i < kTriedStarts[round + 1]; ++i) {
        const auto [a, b] = numbers.at(i);
        const SurfacePoint from = grid_.place(set.texel, a, b);
        packet.set(static_cast<int>(lanes), from.start(), (camera - from.place).normalized());
        who[lanes++] = {&set, {a, b}};
        if (lanes == RayPacket::kLanes) send();
      }
    }
    if (lanes > 0) send();
  }
  for (std::size_t k = first; k < end; ++k) {
    if (std::exchange(progress_[k].tried, true)) continue;
    progress_[k].startless = sets_[k].starts_known == 0;
  }
  if (counts.rays + counts.rejected > 0) count(counts);
}

/// A packet's rays to where they end.
void TexelRays::follow(const RayPacket& packet,
                       std::span<const std::pair<std::size_t, std::size_t>> who) noexcept {
  std::array<MeshHit, RayPacket::kLanes> hits;
  RayCounts counts;
  target_.scene.intersect(packet, hits, counts, RayCoherence::kScattered);
  count(counts);
  for (std::size_t l = 0; l < who.size(); ++l) {
    const auto [k, bin] = who[l];
    Set& set = sets_[k];
    set.sides[bin] = kNone;
    if (hits[l].triangle == MeshHit::kNone) continue;
    const Vector3f d(packet.direction_x[l], packet.direction_y[l], packet.direction_z[l]);
    const SurfacePoint hit = target_.facets.at(hits[l], d);
    const SurfacePoint front = target_.facets.on_side(hits[l].triangle, 0, 0, 0);
    set.sides[bin] = 2 * hits[l].triangle + (hit.normal.dot(front.normal) > 0.0F ? 0U : 1U);
    const Vector3f from(packet.origin_x[l], packet.origin_y[l], packet.origin_z[l]);
    // Parts that touch are no nearer than the rays' own start.
    set.crowding_per_m += 1.0F / std::max((hit.place - from).norm(), hit.offset_m);
    set.weights[bin] = {rounded(hits[l].second), rounded(hits[l].third)};
    if (patches_ != nullptr) met_[k][bin] = patches_->at(hit);
  }
}

void TexelRays::ask_lamp(std::size_t k, const LampView& view, const Vector3f& toward,
                         std::span<const float> sent_by_side) noexcept {
  Set& set = sets_[k];
  set.lit = 0;
  RayPacket packet;
  std::array<std::size_t, RayPacket::kLanes> bin_of{};
  std::size_t lanes = 0;
  RayCounts counts;
  const auto send = [&] {
    std::array<bool, RayPacket::kLanes> blocked{};
    target_.scene.occluded(packet, blocked, counts);
    for (std::size_t l = 0; l < lanes; ++l)
      if (!blocked[l]) set.lit |= std::uint64_t{1} << bin_of[l];
    packet = {};
    lanes = 0;
  };
  for (std::size_t bin = 0; bin < kRays; ++bin) {
    const std::uint32_t side = set.sides[bin];
    if (side == kNone || !(sent_by_side[side] > 0.0F)) continue;
    const std::uint32_t facet = side / 2;
    const SurfacePoint place =
        target_.facets.on_side(facet, static_cast<float>(set.weights[bin][0]) / kWeightSteps,
                               static_cast<float>(set.weights[bin][1]) / kWeightSteps, side % 2);
    const Eigen::Vector2f on_map = view.on_map(place.place);
    const Lit lit = view.places(facet, on_map, on_map);
    if (lit == Lit::kYes) set.lit |= std::uint64_t{1} << bin;
    if (lit != Lit::kUnknown) continue;
    packet.set(static_cast<int>(lanes), place.start(), toward);
    bin_of[lanes++] = bin;
    if (lanes == RayPacket::kLanes) send();
  }
  if (lanes > 0) send();
  if (counts.rays + counts.rejected > 0) count(counts);
}

}  // namespace engine
