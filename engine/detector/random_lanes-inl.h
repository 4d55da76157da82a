// Random words (Philox) and normal numbers, as many at once as a processor has lanes.
// Highway's kind of header: what follows the toggle is compiled once for each target.
#ifndef STARLOOP_RANDOM_LANES_SHARED
#define STARLOOP_RANDOM_LANES_SHARED

#include <array>
#include <cstdint>

#include "engine/core/random.h"

namespace engine::noise_lanes {

/// Of the ten rounds, each in the low half of a wide word.
using PhiloxKeys = std::array<std::array<std::uint64_t, 2>, 10>;

inline PhiloxKeys keys_of(std::uint64_t seed, Stream stream) noexcept {
  std::array<std::uint32_t, 2> key = Draws::key(seed, stream);
  PhiloxKeys keys;
  for (auto& round : keys) {
    round = {key[0], key[1]};
    key[0] += 0x9E3779B9U;
    key[1] += 0xBB67AE85U;
  }
  return keys;
}

}  // namespace engine::noise_lanes

#endif  // STARLOOP_RANDOM_LANES_SHARED

#if defined(STARLOOP_RANDOM_LANES_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef STARLOOP_RANDOM_LANES_INL_H
#undef STARLOOP_RANDOM_LANES_INL_H
#else
#define STARLOOP_RANDOM_LANES_INL_H
#endif

#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace engine::noise_lanes::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// At most 16 lanes: the map of words has that many places in a row.
using F = hn::CappedTag<float, 16>;
using I = hn::RebindToSigned<F>;
using U = hn::RebindToUnsigned<F>;
using Wide = hn::RepartitionToWide<U>;
using Float = hn::Vec<F>;
using Words = hn::Vec<U>;
using WideWords = hn::Vec<Wide>;

/// By halves (Estrin): a short chain of operations that wait for each other.
template <std::size_t kBegin, std::size_t kEnd, std::size_t kTerms>
HWY_INLINE Float terms(const float (&c)[kTerms], Float x, Float x2, Float x4, Float x8) {
  const F f;
  constexpr std::size_t kCount = kEnd - kBegin;
  if constexpr (kCount == 1) {
    return hn::Set(f, c[kBegin]);
  } else {
    constexpr std::size_t kHalf = kCount > 8 ? 8 : kCount > 4 ? 4 : kCount > 2 ? 2 : 1;
    const Float power = kHalf == 8 ? x8 : kHalf == 4 ? x4 : kHalf == 2 ? x2 : x;
    const Float high = terms<kBegin + kHalf, kEnd>(c, x, x2, x4, x8);
    return hn::Add(terms<kBegin, kBegin + kHalf>(c, x, x2, x4, x8), hn::Mul(high, power));
  }
}

template <std::size_t kTerms>
HWY_INLINE Float polynomial(const float (&c)[kTerms], Float x) {
  const Float x2 = hn::Mul(x, x);
  const Float x4 = hn::Mul(x2, x2);
  return terms<0, kTerms>(c, x, x2, x4, hn::Mul(x4, x4));
}

// --- Words -------------------------------------------------------------------------------------

/// Philox4x32-10 of Random123, one counter in the low half of each wide lane: what is left in the
/// high halves never counts.
struct Counters {
  WideWords w0, w1, w2, w3;
};

HWY_INLINE void philox_round(WideWords key0, WideWords key1, Counters& c) {
  const U u;
  const WideWords p0 = hn::MulEven(hn::BitCast(u, c.w0), hn::Set(u, 0xD2511F53U));
  const WideWords p1 = hn::MulEven(hn::BitCast(u, c.w2), hn::Set(u, 0xCD9E8D57U));
  c.w0 = hn::Xor3(hn::ShiftRight<32>(p1), c.w1, key0);
  c.w1 = p1;
  c.w2 = hn::Xor3(hn::ShiftRight<32>(p0), c.w3, key1);
  c.w3 = p0;
}

HWY_INLINE Words woven(WideWords even, WideWords odd) {
  const U u;
  return hn::OddEven(hn::BitCast(u, hn::ShiftLeft<32>(odd)), hn::BitCast(u, even));
}

/// The words of the tile.
HWY_INLINE void fill(const PhiloxKeys& keys, std::uint64_t frame, std::uint32_t tile,
                     std::uint32_t* HWY_RESTRICT out) {
  const U u;
  const Wide d;
  const std::size_t lanes = hn::Lanes(u);
  const WideWords even =
      hn::And(hn::BitCast(d, hn::Iota(u, tile * 16U)), hn::Set(d, std::uint64_t{0xFFFFFFFFU}));
  for (std::size_t at = 0; at < 16; at += lanes) {
    const WideWords place = hn::Add(even, hn::Set(d, std::uint64_t{at}));
    const WideWords low = hn::Set(d, frame & 0xFFFFFFFFU);
    const WideWords high = hn::Set(d, frame >> 32);
    Counters a{place, low, high, hn::Zero(d)};
    Counters b{hn::Add(place, hn::Set(d, std::uint64_t{1})), low, high, hn::Zero(d)};
    for (const auto& key : keys) {
      const WideWords key0 = hn::Set(d, key[0]);
      const WideWords key1 = hn::Set(d, key[1]);
      philox_round(key0, key1, a);
      philox_round(key0, key1, b);
    }
    hn::Store(woven(a.w0, b.w0), u, out + at);
    hn::Store(woven(a.w1, b.w1), u, out + at + 16);
    hn::Store(woven(a.w2, b.w2), u, out + at + 32);
    hn::Store(woven(a.w3, b.w3), u, out + at + 48);
  }
}

// --- Normal numbers ----------------------------------------------------------------------------

/// The binary logarithm of a normal x > 0, to 4e-7.
HWY_INLINE Float log2_of(Float x) {
  const F f;
  const I i;
  // The mantissa into [sqrt(1/2), sqrt(2)).
  const auto bits = hn::BitCast(i, x);
  const auto e = hn::ShiftRight<23>(hn::Sub(bits, hn::Set(i, 0x3F3504F3)));
  const Float m = hn::BitCast(f, hn::Sub(bits, hn::ShiftLeft<23>(e)));
  const Float a = hn::Sub(m, hn::Set(f, 1.0F));
  static constexpr float kLog2[] = {1.4426992F,   -0.721375065F, 0.480486932F, -0.358986757F,
                                    0.297041995F, -0.272490179F, 0.171073146F};
  return hn::Add(hn::ConvertTo(f, e), hn::Mul(a, polynomial(kLog2, a)));
}

/// The normal quantile w of u = (word + 1/2) / 2^32 as a polynomial in v = -log2(4 u (1 - u)), or
/// in its root, times x = 2 u - 1.
HWY_INLINE Float normal_of(Words word) {
  const F f;
  const I i;
  // From the nearer end, so that what is small keeps its digits.
  const auto nearer = hn::BitCast(i, hn::Min(word, hn::Not(word)));
  const Float twice_u =
      hn::Mul(hn::Add(hn::ConvertTo(f, nearer), hn::Set(f, 0.5F)), hn::Set(f, 0x1p-31F));
  const Float x = hn::Sub(hn::Set(f, 1.0F), twice_u);
  const Float y = hn::Mul(twice_u, hn::Sub(hn::Set(f, 2.0F), twice_u));
  const Float l = log2_of(y);
  static constexpr float kNear[] = {2.12772761F,     0.241667276F,   -0.00286987858F,
                                    -5.85195167e-4F, 7.08770339e-5F, -1.06782142e-6F,
                                    -4.96456326e-7F, 3.844094e-8F};
  static constexpr float kFar[] = {4.59385744F,     1.18535171F,    0.00379597808F,
                                   -0.00198829456F, 9.54992739e-4F, -6.11557233e-4F,
                                   3.13421911e-4F,  -6.85552012e-5F};
  Float p = polynomial(kNear, hn::Sub(hn::Set(f, -3.625F), l));
  const auto far = hn::Lt(l, hn::Set(f, -7.25F));
  if (HWY_UNLIKELY(!hn::AllFalse(f, far))) {
    const Float root = hn::Sqrt(hn::Neg(l));
    p = hn::IfThenElse(far, polynomial(kFar, hn::Sub(root, hn::Set(f, 4.1F))), p);
  }
  // The word's first bit is set where the number is positive.
  return hn::Mul(p, hn::CopySign(x, hn::BitCast(f, hn::Not(word))));
}

}  // namespace engine::noise_lanes::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // the toggle
