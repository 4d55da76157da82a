#include "engine/render/shadow_doubts.h"

#include <utility>

namespace engine {
namespace {

// In each four points of a row one asks for a lamp; over four rows, each column once.
constexpr int kAskEvery = 4;
constexpr std::array<int, kAskEvery> kAsks = {0, 2, 1, 3};
constexpr bool asks_first(int x, int y) noexcept {
  return x % kAskEvery == kAsks[static_cast<std::size_t>(y % kAskEvery)];
}
// Of a cell's points of one facet: so few are asked at once. With 6 of them shadows are a third
// noisier on a lattice of 4 by 4, for a tenth less time.
constexpr int kFewPoints = 32;

std::size_t at(int i) noexcept { return static_cast<std::size_t>(i); }

}  // namespace

ShadowDoubts::ShadowDoubts(const LatticeView& view, const TracedTarget& target, std::size_t most)
    : view_(view), target_(target) {
  doubts_.reserve(most);
}

void ShadowDoubts::start(const Row& row) noexcept {
  row_ = row;
  doubts_.clear();
  counts_ = {};
}

void ShadowDoubts::add(const Doubt& doubt) noexcept {
  doubts_.push_back(doubt);
  ask(doubts_.size() - 1, false);
}

void ShadowDoubts::ask(std::size_t index, bool rest) noexcept {
  Doubt& d = doubts_[index];
  const int side = view_.side();
  const bool all = d.points <= kFewPoints;
  for (int y = 0; y < side; ++y) {
    const int lattice_row = d.cell_row * side + y;
    const std::uint32_t* seen = &row_.seen[at(lattice_row) * view_.stride() + at(d.column * side)];
    for (int x = 0; x < side; ++x) {
      if (seen[x] != d.facet || (!all && asks_first(x, y) == rest)) continue;
      const int i = d.column * side + x;
      const int j = row_.index * view_.points_a_pixel() + lattice_row;
      Eigen::Vector3f direction;
      const SurfacePoint point =
          view_.place_on(d.facet, static_cast<float>(i) + TriangleRaster::x_in_step(j),
                         static_cast<float>(j) + TriangleRaster::y_in_step(i), direction);
      Queue& queue = queues_[d.lamp];
      queue.rays.set(queue.used, point.start(), row_.toward_lamp[d.lamp]);
      queue.who[at(queue.used)] = static_cast<std::uint32_t>(index);
      ++d.asked;
      if (++queue.used == RayPacket::kLanes) send(d.lamp);
    }
  }
}

void ShadowDoubts::send(std::size_t lamp) noexcept {
  Queue& queue = queues_[lamp];
  const std::size_t used = at(std::exchange(queue.used, 0));
  if (used == 0) return;
  for (std::size_t i = used; i < RayPacket::kLanes; ++i) queue.rays.active[i] = false;
  std::array<bool, RayPacket::kLanes> blocked{};
  target_.scene.occluded(queue.rays, blocked, counts_);
  for (std::size_t i = 0; i < used; ++i)
    if (blocked[i]) ++doubts_[queue.who[i]].hidden;
}

std::span<const ShadowDoubts::Doubt> ShadowDoubts::settle() noexcept {
  for (std::size_t k = 0; k < kLamps; ++k) send(k);
  for (std::size_t i = 0; i < doubts_.size(); ++i) {
    const Doubt& d = doubts_[i];
    // None of a few in four may be on the first points.
    if (d.asked < d.points && (d.asked == 0 || (d.hidden > 0 && d.hidden < d.asked))) ask(i, true);
  }
  for (std::size_t k = 0; k < kLamps; ++k) send(k);
  return doubts_;
}

}  // namespace engine
