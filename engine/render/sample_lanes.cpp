#include "engine/render/sample_lanes.h"

#include <cmath>

namespace engine {
namespace {

constexpr std::size_t kLanes = SampleLanes::kLanes;

struct Task {
  const std::uint32_t* key = nullptr;
  const std::uint32_t* sample = nullptr;
  std::uint32_t number = 0;
  bool in_order = false;  // PlaceSequence's
};

[[gnu::always_inline]] inline void draw(const Task& task, float* __restrict first,
                                        float* __restrict second) noexcept {
  alignas(64) std::array<std::uint32_t, kLanes> key;
  alignas(64) std::array<std::uint32_t, kLanes> sample;
  for (std::size_t i = 0; i < kLanes; ++i) {
    key[i] = task.key[i];
    sample[i] = task.sample[i];
  }
  if (task.in_order) {
    for (std::size_t i = 0; i < kLanes; ++i) {
      const PairSeeds seeds = seeds_of_places(key[i]);
      const auto pair = scrambled_pair(sample[i], seeds);
      first[i] = pair[0];
      second[i] = pair[1];
    }
    return;
  }
  for (std::size_t i = 0; i < kLanes; ++i) {
    const PairSeeds seeds = seeds_of_pair(key[i], task.number);
    const auto pair = scrambled_pair(owen_scrambled(sample[i], seeds.order), seeds);
    first[i] = pair[0];
    second[i] = pair[1];
  }
}

// Quarter turns: sine and cosine of half pi x, x in [-.5, .5], by the first terms of their series
// (2e-9 and 3e-8 off).
[[gnu::always_inline]] inline void turn(const float* __restrict turns,
                                        const float* __restrict across, float* __restrict x,
                                        float* __restrict y) noexcept {
  for (std::size_t i = 0; i < kLanes; ++i) {
    // lround() keeps no lanes. NOLINTNEXTLINE(bugprone-incorrect-roundings)
    const auto quarter = static_cast<std::int32_t>(4.0F * turns[i] + 0.5F);
    const float r = 1.5707963268F * (4.0F * turns[i] - static_cast<float>(quarter));
    const float r2 = r * r;
    const float sine =
        r * (1.0F + r2 * (-1.0F / 6 + r2 * (1.0F / 120 + r2 * (-1.0F / 5040 + r2 / 362880))));
    const float cosine = 1.0F + r2 * (-0.5F + r2 * (1.0F / 24 + r2 * (-1.0F / 720 + r2 / 40320)));
    const bool odd = (quarter & 1) != 0;
    const float c = odd ? sine : cosine;
    const float s = odd ? cosine : sine;
    const bool left = ((quarter + 1) & 2) != 0;
    const bool down = (quarter & 2) != 0;
    x[i] = across[i] * (left ? -c : c);
    y[i] = across[i] * (down ? -s : s);
  }
}

using Draw = void (*)(const Task&, float*, float*) noexcept;
using Turn = void (*)(const float*, const float*, float*, float*) noexcept;
struct Kernels {
  Draw draw;
  Turn turn;
};

void draw_plain(const Task& t, float* a, float* b) noexcept { draw(t, a, b); }
void turn_plain(const float* t, const float* r, float* x, float* y) noexcept { turn(t, r, x, y); }
#if defined(__x86_64__)
#define STARLOOP_AVX512 \
  __attribute__((target("avx512f,avx512vl,avx512bw,avx512dq,prefer-vector-width=512")))
__attribute__((target("avx2"))) void draw_avx2(const Task& t, float* a, float* b) noexcept {
  draw(t, a, b);
}
__attribute__((target("avx2"))) void turn_avx2(const float* t, const float* r, float* x,
                                               float* y) noexcept {
  turn(t, r, x, y);
}
// NOLINTBEGIN(clang-diagnostic-ignored-attributes): the vectors' width is GCC's own.
STARLOOP_AVX512 void draw_avx512(const Task& t, float* a, float* b) noexcept { draw(t, a, b); }
STARLOOP_AVX512 void turn_avx512(const float* t, const float* r, float* x, float* y) noexcept {
  turn(t, r, x, y);
}
// NOLINTEND(clang-diagnostic-ignored-attributes)
#endif

Kernels best_kernels() noexcept {
#if defined(__x86_64__)
  if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512vl") &&
      __builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512dq"))
    return {draw_avx512, turn_avx512};
  if (__builtin_cpu_supports("avx2")) return {draw_avx2, turn_avx2};
#endif
  return {draw_plain, turn_plain};
}
const Kernels kKernels = best_kernels();

}  // namespace

void SampleLanes::places(SequenceKind kind, const Words& key, const Words& sample) noexcept {
  if (kind == SequenceKind::kSobol) {
    kKernels.draw({key.data(), sample.data(), 0, true}, first.data(), second.data());
    return;
  }
  for (std::size_t i = 0; i < kLanes; ++i) {
    const auto pair = PlaceSequence(kind, key[i]).at(sample[i]);
    first[i] = pair[0];
    second[i] = pair[1];
  }
}

void SampleLanes::pairs(SequenceKind kind, const Words& key, const Words& sample,
                        std::uint32_t number) noexcept {
  if (kind == SequenceKind::kSobol) {
    kKernels.draw({key.data(), sample.data(), number, false}, first.data(), second.data());
    return;
  }
  for (std::size_t i = 0; i < kLanes; ++i) {
    const auto pair = SampleNumbers(kind, key[i], sample[i]).pair(number);
    first[i] = pair[0];
    second[i] = pair[1];
  }
}

void SampleLanes::towards(const LampCone& lamp, RayPacket& rays) const noexcept {
  const auto drop_of_edge = static_cast<float>(lamp.one_minus_cos());
  const Eigen::Vector3f axis = lamp.axis().cast<float>();
  const Eigen::Vector3f side = lamp.side_x().cast<float>();
  const Eigen::Vector3f other = lamp.side_y().cast<float>();
  alignas(64) Numbers across;
  alignas(64) Numbers x;
  alignas(64) Numbers y;
  for (std::size_t i = 0; i < kLanes; ++i) {
    const float drop = drop_of_edge * first[i];
    across[i] = std::sqrt(drop * (2.0F - drop));
  }
  kKernels.turn(second.data(), across.data(), x.data(), y.data());
  for (std::size_t i = 0; i < kLanes; ++i) {
    const float along = 1.0F - drop_of_edge * first[i];
    rays.direction_x[i] = along * axis.x() + x[i] * side.x() + y[i] * other.x();
    rays.direction_y[i] = along * axis.y() + x[i] * side.y() + y[i] * other.y();
    rays.direction_z[i] = along * axis.z() + x[i] * side.z() + y[i] * other.z();
  }
}

}  // namespace engine
