#include "engine/detector/blooming.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <bitset>
#include <cmath>
#include <cstdint>

#include "engine/core/contract.h"

namespace engine {
namespace {

constexpr int kMostRows = 8192;
constexpr int kStrip = 32;  ///< columns that a thread takes at a time

struct Column {
  std::array<double, kMostRows> room;    ///< before anything has run
  std::array<double, kMostRows> excess;  ///< over the full well
};

/// Runs down or up, filling `room`, into `taken`. Returns what leaves the frame.
double run(const Column& column, int rows, bool down, std::array<double, kMostRows>& taken) {
  double carry = 0;
  for (int i = 0; i < rows; ++i) {
    const auto v = static_cast<std::size_t>(down ? i : rows - 1 - i);
    const double takes = std::min(carry, column.room[v] - taken[v]);
    taken[v] += takes;
    carry += 0.5 * column.excess[v] - takes;
  }
  return carry;
}

double bloom_column(ElectronImage& electrons, int u, double full_well_e,
                    std::span<const float> response) noexcept {
  const int rows = electrons.height();
  Column column;
  std::array<double, kMostRows> down_first;
  std::array<double, kMostRows> up_first;
  const auto pixels = electrons.pixels();
  const auto width = static_cast<std::size_t>(electrons.width());
  for (std::size_t v = 0; v < static_cast<std::size_t>(rows); ++v) {
    const std::size_t at = v * width + static_cast<std::size_t>(u);
    const auto e = static_cast<double>(pixels[at]);
    const bool dead = !response.empty() && response[at] <= 0.0F;
    column.room[v] = dead ? 0.0 : std::max(0.0, full_well_e - e);
    column.excess[v] = std::max(0.0, e - full_well_e);
    down_first[v] = 0.0;
    up_first[v] = 0.0;
  }
  double lost = run(column, rows, true, down_first) + run(column, rows, false, down_first);
  lost += run(column, rows, false, up_first) + run(column, rows, true, up_first);
  for (std::size_t v = 0; v < static_cast<std::size_t>(rows); ++v) {
    float& e = pixels[v * width + static_cast<std::size_t>(u)];
    const double kept = std::min(static_cast<double>(e), full_well_e);
    e = static_cast<float>(kept + 0.5 * (down_first[v] + up_first[v]));
  }
  return 0.5 * lost;
}

}  // namespace

double bloom(ElectronImage& electrons, float full_well_e, std::span<const float> response,
             WorkerPool& pool) noexcept {
  ENSURE(electrons.height() <= kMostRows);
  const int strips = (electrons.width() + kStrip - 1) / kStrip;
  // In quarters of an electron, whole numbers: their sum does not depend on the order.
  std::atomic<std::int64_t> lost_quarters{0};
  pool.rows(0, strips, [&](int strip) {
    const int left = strip * kStrip;
    const int right = std::min(left + kStrip, electrons.width());
    std::bitset<kStrip> over;
    for (int v = 0; v < electrons.height(); ++v) {
      const auto row = electrons.row(v);
      for (int u = left; u < right; ++u)
        if (row[static_cast<std::size_t>(u)] > full_well_e)
          over.set(static_cast<std::size_t>(u - left));
    }
    for (int u = left; u < right; ++u) {
      if (!over.test(static_cast<std::size_t>(u - left))) continue;
      const double lost = bloom_column(electrons, u, static_cast<double>(full_well_e), response);
      lost_quarters.fetch_add(std::llround(4.0 * lost), std::memory_order_relaxed);
    }
  });
  return 0.25 * static_cast<double>(lost_quarters.load());
}

}  // namespace engine
