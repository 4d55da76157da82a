// Poisson numbers, as many at once as a processor has lanes; their tails are poisson_tail's.
// Highway's kind of header: what follows the toggle is compiled once for each target.
#ifndef STARLOOP_POISSON_LANES_SHARED
#define STARLOOP_POISSON_LANES_SHARED

#include <algorithm>
#include <array>
#include <cstdint>

#include "engine/detector/noise_lanes.h"

namespace engine::noise_lanes {

/// What is poisson_tail's: of the walk the uniform numbers from here on, 1 - 2^-12; of the
/// expansion so many words from either end, 2^32 times the normal share beyond 4.2 sigma.
inline constexpr float kSearchTail = 1.0F - 0x1p-12F;
inline constexpr std::int32_t kExpansionTail = 57320;

inline bool is_tail(std::uint32_t word, float mean) noexcept {
  if (mean < kExpansionFrom) return word >= 0xFFF00000U;
  return std::min(word, ~word) < static_cast<std::uint32_t>(kExpansionTail);
}

/// 1, 1/2, 1/3 ...: further than the walk goes before the tail's own method takes over.
inline constexpr auto kInverses = [] {
  std::array<float, 40> inverses{};
  for (std::size_t i = 0; i < inverses.size(); ++i) inverses[i] = 1.0F / static_cast<float>(i + 1);
  return inverses;
}();

}  // namespace engine::noise_lanes

#endif  // STARLOOP_POISSON_LANES_SHARED

#if defined(STARLOOP_POISSON_LANES_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef STARLOOP_POISSON_LANES_INL_H
#undef STARLOOP_POISSON_LANES_INL_H
#else
#define STARLOOP_POISSON_LANES_INL_H
#endif

#include "engine/detector/random_lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace engine::noise_lanes::HWY_NAMESPACE {

// --- Poisson numbers ---------------------------------------------------------------------------

/// exp(-x) for 0 <= x <= kExpansionFrom, to 2e-7 of it: Cephes' expf.
HWY_INLINE Float exp_minus(Float x) {
  const F f;
  const I i;
  const Float n = hn::Round(hn::Mul(x, hn::Set(f, 1.44269504F)));
  // ln 2 in two parts, the first of which is exact times n.
  const Float r = hn::Sub(hn::Sub(hn::Mul(n, hn::Set(f, 0.693359375F)), x),
                          hn::Mul(n, hn::Set(f, 2.12194440e-4F)));
  static constexpr float kExp[] = {5.0000001201e-1F, 1.6666665459e-1F, 4.1665795894e-2F,
                                   8.3334519073e-3F, 1.3981999507e-3F, 1.9875691500e-4F};
  const Float y =
      hn::Add(hn::Add(hn::Mul(hn::Mul(r, r), polynomial(kExp, r)), r), hn::Set(f, 1.0F));
  const auto power = hn::ShiftLeft<23>(hn::Sub(hn::Set(i, 127), hn::ConvertTo(i, n)));
  return hn::Mul(y, hn::BitCast(f, power));
}

/// Four vectors walk up their distributions together: the longest way of them all is not much
/// longer than of one.
struct Walk {
  Float mean, u, term, sum, count;
};

/// Lanes that are `away` are done at once.
HWY_INLINE Walk walk_from(Float mean, Float zero_share, Float u, hn::Mask<F> away) {
  const F f;
  return {mean, hn::IfThenZeroElse(away, u), zero_share,
          hn::IfThenElse(away, hn::Set(f, 1.0F), zero_share), hn::Zero(f)};
}

HWY_INLINE void step(Walk& w, Float inverse) {
  const F f;
  w.count = hn::Add(w.count, hn::IfThenElseZero(hn::Ge(w.u, w.sum), hn::Set(f, 1.0F)));
  w.term = hn::Mul(w.term, hn::Mul(w.mean, inverse));
  w.sum = hn::Add(w.sum, w.term);
}

HWY_INLINE void walk(Walk& a, Walk& b, Walk& c, Walk& d) {
  const F f;
  for (std::size_t k = 0; k < kInverses.size(); k += 2) {
    const auto going = hn::Or(hn::Or(hn::Ge(a.u, a.sum), hn::Ge(b.u, b.sum)),
                              hn::Or(hn::Ge(c.u, c.sum), hn::Ge(d.u, d.sum)));
    if (hn::AllFalse(f, going)) return;
    for (std::size_t j = k; j < k + 2; ++j) {
      const Float inverse = hn::Set(f, kInverses[j]);
      step(a, inverse);
      step(b, inverse);
      step(c, inverse);
      step(d, inverse);
    }
  }
}

/// A word's first 24 bits, in [0, 1).
HWY_INLINE Float uniform(Words word) {
  const F f;
  const auto bits = hn::BitCast(I(), hn::ShiftRight<8>(word));
  return hn::Mul(hn::ConvertTo(f, bits), hn::Set(f, 0x1p-24F));
}

/// What the expansion needs of a mean, kExpansionFrom <= mean <= kLargestMean.
struct Root {
  Float root, inverse, whole, rest;
};

HWY_INLINE Root root_of(Float mean) {
  const Float root = hn::Sqrt(mean);
  // From the whole electrons below the mean: at 1e6 single precision resolves no more than .06.
  const Float whole = hn::Floor(mean);
  return {root, hn::Div(hn::Set(F(), 1.0F), root), whole, hn::Sub(mean, whole)};
}

HWY_INLINE Float expanded(const Root& mean, Words word) {
  const F f;
  static constexpr float kA[] = {1.66666679e-1F, -1.38329081e-2F, 3.70979784e-3F, -1.48794528e-3F,
                                 3.61765484e-4F, -2.23434259e-4F, 4.63011153e-4F, -1.59601411e-4F};
  static constexpr float kB[] = {3.33332118e-1F, -2.78715319e-2F, 8.63229163e-3F, -4.34178744e-3F,
                                 3.73470307e-3F, 2.08440853e-3F,  -3.28595999e-3F};
  static constexpr float kC[] = {-1.96985800e-2F, 1.88493838e-2F, -1.71103906e-2F, 6.43853629e-3F};
  const Float w = normal_of(word);
  const Float s = hn::Mul(w, mean.inverse);
  const Float correction =
      hn::Add(hn::Add(hn::Mul(hn::Mul(w, w), polynomial(kA, s)), polynomial(kB, s)),
              hn::Mul(hn::Mul(mean.inverse, mean.inverse), polynomial(kC, s)));
  const Float off = hn::Add(hn::Add(hn::Mul(mean.root, w), correction), mean.rest);
  return hn::Max(hn::Zero(f), hn::Add(mean.whole, hn::Floor(off)));
}

/// Where single precision would show, of the walk and of the expansion.
HWY_INLINE hn::Mask<F> in_last(Float u) { return hn::Ge(u, hn::Set(F(), kSearchTail)); }
HWY_INLINE hn::Mask<F> in_ends(Words word) {
  const I i;
  const auto nearer = hn::BitCast(i, hn::Min(word, hn::Not(word)));
  return hn::RebindMask(F(), hn::Lt(nearer, hn::Set(i, kExpansionTail)));
}

}  // namespace engine::noise_lanes::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // the toggle
