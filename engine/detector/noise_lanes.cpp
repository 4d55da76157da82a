#include "engine/detector/noise_lanes.h"

#ifndef STARLOOP_NOISE_LANES_SHARED
#define STARLOOP_NOISE_LANES_SHARED

#include <algorithm>
#include <array>
#include <cmath>

#include "engine/core/contract.h"
#include "engine/detector/poisson_tail.h"

// What all targets share; the rest of the file is compiled once for each.
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

inline std::uint32_t tile_of(const Place& place, std::size_t tile) noexcept {
  return static_cast<std::uint32_t>(place.first / kTile + tile);
}

/// What is poisson_tail's: of the walk the uniform numbers from here on, 1 - 2^-12; of the
/// expansion so many words from either end, 2^32 times the normal share beyond 4.2 sigma.
inline constexpr float kSearchTail = 1.0F - 0x1p-12F;
inline constexpr std::int32_t kExpansionTail = 57320;

inline bool is_tail(std::uint32_t word, float mean) noexcept {
  if (mean < kExpansionFrom) return word >= 0xFFF00000U;
  return std::min(word, ~word) < static_cast<std::uint32_t>(kExpansionTail);
}

/// Whether no draw of 85 bits reaches the full well.
inline bool far_below(float mean, float full_well) noexcept {
  return mean + 12.0F * std::sqrt(mean) + 100.0F < full_well;
}

inline int count_no_light(const float* light) noexcept {
  int count = 0;
  for (std::size_t i = 0; i < kTile; ++i) count += light[i] >= 0.0F ? 0 : 1;
  return count;
}

/// 1, 1/2, 1/3 ...: further than the walk goes before the tail's own method takes over.
inline constexpr auto kInverses = [] {
  std::array<float, 40> inverses{};
  for (std::size_t i = 0; i < inverses.size(); ++i) inverses[i] = 1.0F / static_cast<float>(i + 1);
  return inverses;
}();

inline float tail_electrons(const Place& place, std::uint32_t pixel, std::uint32_t word,
                            float mean) noexcept {
  if (!(mean > 0.0F) || mean > kLargestMean) return 0.0F;
  const double detail = Draws(place.seed, Stream::kShotDetail, place.frame, pixel).uniform_double();
  return static_cast<float>(poisson_tail(word, detail, static_cast<double>(mean)));
}

}  // namespace engine::noise_lanes

#endif  // STARLOOP_NOISE_LANES_SHARED

// The fallback for processors older than SSSE3. GCC 12.2 miscompiles its 16-bit products only
// (https://gcc.gnu.org/PR106322); there are none here.
#define HWY_BROKEN_EMU128 0
// Vectors without a size cannot be members; NEON is there wherever SVE is.
#define HWY_DISABLED_TARGETS (HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128)
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "engine/detector/noise_lanes.cpp"
#include <hwy/foreach_target.h>
// After foreach_target.h: it is included once for each target.
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

// --- A tile of light -----------------------------------------------------------------------------

/// All of an even sky has one mean.
struct EvenTile {
  float mean = -1.0F;
  float zero_share = 0.0F;  ///< of pixels that collect nothing
};

HWY_INLINE Float mean_of(const Means& means, Float light, std::size_t pixel) {
  const F f;
  Float photo = hn::Mul(light, hn::Set(f, means.e_per_w_m2));
  if (!means.response.empty()) photo = hn::Mul(photo, hn::LoadU(f, means.response.data() + pixel));
  const Float dark = means.dark_e_s.empty() ? hn::Set(f, means.dark_e)
                                            : hn::Mul(hn::LoadU(f, means.dark_e_s.data() + pixel),
                                                      hn::Set(f, means.exposure_s));
  // Not a number compares as false.
  return hn::Add(hn::IfThenElseZero(hn::Gt(photo, hn::Zero(f)), photo), dark);
}

HWY_INLINE bool is_even(const Means& means, const float* HWY_RESTRICT light) {
  const F f;
  if (!means.response.empty() || !means.dark_e_s.empty()) return false;
  const Float first = hn::Set(f, light[0]);
  auto other = hn::MaskFromVec(hn::Zero(f));
  for (std::size_t i = 0; i < kTile; i += hn::Lanes(f))
    // Not equal, rather than unequal: what is no number is that too.
    other = hn::Or(other, hn::Not(hn::Eq(hn::LoadU(f, light + i), first)));
  return hn::AllFalse(f, other);
}

HWY_INLINE void fill_means(const Means& means, const float* HWY_RESTRICT light, std::size_t pixel,
                           float* HWY_RESTRICT out, int& no_light) {
  const F f;
  auto none = hn::MaskFromVec(hn::Zero(f));
  for (std::size_t i = 0; i < kTile; i += hn::Lanes(f)) {
    const Float here = hn::LoadU(f, light + i);
    hn::Store(mean_of(means, here, pixel + i), f, out + i);
    none = hn::Or(none, hn::Not(hn::Ge(here, hn::Zero(f))));
  }
  if (HWY_UNLIKELY(!hn::AllFalse(f, none))) no_light += count_no_light(light);
}

/// Overwrites the pixels of the tile whose words are in a tail of their distribution.
HWY_NOINLINE void mend_tails(const Place& place, std::uint32_t pixel,
                             const std::uint32_t* HWY_RESTRICT word, const float* HWY_RESTRICT mean,
                             std::size_t mean_step, float* HWY_RESTRICT out) {
  for (std::size_t i = 0; i < kTile; ++i)
    if (is_tail(word[i], mean[i * mean_step]))
      out[i] = tail_electrons(place, pixel + static_cast<std::uint32_t>(i), word[i],
                              mean[i * mean_step]);
}

/// One mean below kExpansionFrom. The return value says whether there are tails to mend.
HWY_INLINE bool draw_even_small(float one_mean, float one_share,
                                const std::uint32_t* HWY_RESTRICT word, float* HWY_RESTRICT out) {
  const F f;
  const U u;
  const std::size_t lanes = hn::Lanes(f);
  const Float mean = hn::Set(f, one_mean);
  const Float share = hn::Set(f, one_share);
  auto tails = hn::MaskFromVec(hn::Zero(f));
  const auto begin = [&](std::size_t at) HWY_ATTR {
    const Float x = uniform(hn::Load(u, word + at));
    const auto tail = in_last(x);
    tails = hn::Or(tails, tail);
    return walk_from(mean, share, x, tail);
  };
  for (std::size_t at = 0; at < kTile; at += 4 * lanes) {
    Walk a = begin(at);
    Walk b = begin(at + lanes);
    Walk c = begin(at + 2 * lanes);
    Walk d = begin(at + 3 * lanes);
    walk(a, b, c, d);
    hn::StoreU(a.count, f, out + at);
    hn::StoreU(b.count, f, out + at + lanes);
    hn::StoreU(c.count, f, out + at + 2 * lanes);
    hn::StoreU(d.count, f, out + at + 3 * lanes);
  }
  return !hn::AllFalse(f, tails);
}

/// One mean from kExpansionFrom on.
HWY_INLINE bool draw_even_large(float one_mean, const std::uint32_t* HWY_RESTRICT word,
                                float* HWY_RESTRICT out) {
  const F f;
  const U u;
  const Root mean = root_of(hn::Set(f, one_mean));
  auto tails = hn::MaskFromVec(hn::Zero(f));
  for (std::size_t i = 0; i < kTile; i += hn::Lanes(f)) {
    const Words bits = hn::Load(u, word + i);
    hn::StoreU(expanded(mean, bits), f, out + i);
    tails = hn::Or(tails, in_ends(bits));
  }
  return !hn::AllFalse(f, tails);
}

/// Means of all sizes: those below kExpansionFrom.
HWY_INLINE hn::Mask<F> draw_small(const float* HWY_RESTRICT mean,
                                  const std::uint32_t* HWY_RESTRICT word, float* HWY_RESTRICT out) {
  const F f;
  const U u;
  const std::size_t lanes = hn::Lanes(f);
  auto tails = hn::MaskFromVec(hn::Zero(f));
  const auto begin = [&](std::size_t at) HWY_ATTR {
    const Float m = hn::Load(f, mean + at);
    const Float x = uniform(hn::Load(u, word + at));
    const auto large = hn::Ge(m, hn::Set(f, kExpansionFrom));
    const auto tail = hn::AndNot(large, in_last(x));
    tails = hn::Or(tails, tail);
    const Float small = hn::Min(m, hn::Set(f, kExpansionFrom));
    return walk_from(small, exp_minus(small), x, hn::Or(large, tail));
  };
  for (std::size_t at = 0; at < kTile; at += 4 * lanes) {
    Walk a = begin(at);
    Walk b = begin(at + lanes);
    Walk c = begin(at + 2 * lanes);
    Walk d = begin(at + 3 * lanes);
    walk(a, b, c, d);
    hn::StoreU(a.count, f, out + at);
    hn::StoreU(b.count, f, out + at + lanes);
    hn::StoreU(c.count, f, out + at + 2 * lanes);
    hn::StoreU(d.count, f, out + at + 3 * lanes);
  }
  return tails;
}

/// Those from kExpansionFrom on, over what the walk has left there.
HWY_INLINE hn::Mask<F> draw_large(const float* HWY_RESTRICT mean,
                                  const std::uint32_t* HWY_RESTRICT word, float* HWY_RESTRICT out) {
  const F f;
  const U u;
  auto tails = hn::MaskFromVec(hn::Zero(f));
  for (std::size_t i = 0; i < kTile; i += hn::Lanes(f)) {
    const Float m = hn::Load(f, mean + i);
    const auto large = hn::Ge(m, hn::Set(f, kExpansionFrom));
    const Words bits = hn::Load(u, word + i);
    const Float bounded = hn::Min(hn::Max(m, hn::Set(f, kExpansionFrom)), hn::Set(f, kLargestMean));
    const Float x = expanded(root_of(bounded), bits);
    hn::StoreU(hn::IfThenElse(large, x, hn::LoadU(f, out + i)), f, out + i);
    tails = hn::Or(tails, hn::And(large, in_ends(bits)));
  }
  return tails;
}

HWY_INLINE bool draw_uneven(const float* HWY_RESTRICT mean, const std::uint32_t* HWY_RESTRICT word,
                            float* HWY_RESTRICT out) {
  const F f;
  auto any_small = hn::MaskFromVec(hn::Zero(f));
  auto any_large = any_small;
  for (std::size_t i = 0; i < kTile; i += hn::Lanes(f)) {
    const auto large = hn::Ge(hn::Load(f, mean + i), hn::Set(f, kExpansionFrom));
    any_large = hn::Or(any_large, large);
    any_small = hn::Or(any_small, hn::Not(large));
  }
  auto tails = hn::MaskFromVec(hn::Zero(f));
  if (!hn::AllFalse(f, any_small)) tails = draw_small(mean, word, out);
  if (!hn::AllFalse(f, any_large)) tails = hn::Or(tails, draw_large(mean, word, out));
  return !hn::AllFalse(f, tails);
}

HWY_INLINE void clip(const Means& means, const float* HWY_RESTRICT mean, std::size_t mean_step,
                     float* HWY_RESTRICT electrons, int& full_well) {
  const F f;
  const Float well = hn::Set(f, means.full_well_e);
  const Float most = means.clip ? well : hn::Set(f, means.brim_e);
  for (std::size_t i = 0; i < kTile; i += hn::Lanes(f)) {
    const Float m = mean_step == 0 ? hn::Set(f, *mean) : hn::Load(f, mean + i);
    const Float e = hn::IfThenElse(hn::Gt(m, hn::Set(f, kLargestMean)), hn::Set(f, means.brim_e),
                                   hn::LoadU(f, electrons + i));
    const auto over = hn::Gt(e, well);
    if (HWY_UNLIKELY(!hn::AllFalse(f, over))) full_well += static_cast<int>(hn::CountTrue(f, over));
    hn::StoreU(hn::Min(e, most), f, electrons + i);
  }
}

/// `light` and `out` hold a whole tile, which `pixel` of the span begins.
HWY_INLINE void expose_tile(const Place& place, const PhiloxKeys& keys, const Means& means,
                            const float* HWY_RESTRICT light, std::size_t pixel, EvenTile& sky,
                            float* HWY_RESTRICT out, Counts& counts) {
  const F f;
  alignas(64) std::uint32_t word[kTile];
  alignas(64) float mean[kTile];
  fill(keys, place.frame, tile_of(place, pixel / kTile), word);
  const bool even = is_even(means, light);
  const std::size_t mean_step = even ? 0 : 1;
  bool tails = false;
  if (even) {
    mean[0] = hn::GetLane(mean_of(means, hn::Set(f, light[0]), pixel));
    if (!(light[0] >= 0.0F)) counts.no_light_px += static_cast<int>(kTile);
    if (mean[0] >= kExpansionFrom) {
      tails = draw_even_large(std::min(mean[0], kLargestMean), word, out);
    } else {
      if (mean[0] != sky.mean) sky = {mean[0], hn::GetLane(exp_minus(hn::Set(f, mean[0])))};
      tails = draw_even_small(sky.mean, sky.zero_share, word, out);
    }
  } else {
    fill_means(means, light, pixel, mean, counts.no_light_px);
    tails = draw_uneven(mean, word, out);
  }
  if (HWY_UNLIKELY(tails))
    mend_tails(place, place.first + static_cast<std::uint32_t>(pixel), word, mean, mean_step, out);
  if (!even || !far_below(mean[0], means.full_well_e))
    clip(means, mean, mean_step, out, counts.full_well_px);
}

void expose_lanes(const Place& place, const Means& means, const float* light, float* electrons,
                  std::size_t tiles, Counts& counts) {
  const PhiloxKeys keys = keys_of(place.seed, Stream::kShot);
  EvenTile sky;
  for (std::size_t tile = 0; tile < tiles; ++tile)
    expose_tile(place, keys, means, light + tile * kTile, tile * kTile, sky,
                electrons + tile * kTile, counts);
}

// --- Reading out ---------------------------------------------------------------------------------

HWY_INLINE Float quantised(const ReadOut& r, Float electrons) {
  const F f;
  const Float dn = hn::Add(hn::Mul(electrons, hn::Set(f, r.dn_per_e)), hn::Set(f, r.offset_dn));
  return hn::Min(hn::Max(hn::Floor(dn), hn::Zero(f)), hn::Set(f, r.largest_dn));
}

HWY_INLINE void store_dn(Float dn, std::uint16_t* out) {
  const I i;
  const hn::Rebind<std::uint16_t, I> d;
  hn::StoreU(hn::DemoteTo(d, hn::ConvertTo(i, dn)), d, out);
}

/// Whether a draw can move a pixel of the tile; if not, `out` is filled.
HWY_INLINE bool moved_by(const ReadOut& r, const float* HWY_RESTRICT e,
                         std::uint16_t* HWY_RESTRICT out) {
  const F f;
  const Float furthest = hn::Set(f, r.noise_e * kLargestNormal);
  for (std::size_t i = 0; i < kTile; i += hn::Lanes(f)) {
    const Float here = hn::LoadU(f, e + i);
    const Float least = quantised(r, hn::Sub(here, furthest));
    if (!hn::AllTrue(f, hn::Eq(least, quantised(r, hn::Add(here, furthest))))) return true;
    store_dn(least, out + i);
  }
  return false;
}

void digitize_lanes(const Place& place, const ReadOut& r, const float* electrons, std::uint16_t* dn,
                    std::size_t tiles) {
  const F f;
  const U u;
  const PhiloxKeys keys = keys_of(place.seed, Stream::kRead);
  for (std::size_t tile = 0; tile < tiles; ++tile) {
    const float* HWY_RESTRICT e = electrons + tile * kTile;
    std::uint16_t* HWY_RESTRICT out = dn + tile * kTile;
    if (!moved_by(r, e, out)) continue;
    alignas(64) std::uint32_t word[kTile];
    fill(keys, place.frame, tile_of(place, tile), word);
    for (std::size_t i = 0; i < kTile; i += hn::Lanes(f)) {
      const Float noise = hn::Mul(normal_of(hn::Load(u, word + i)), hn::Set(f, r.noise_e));
      store_dn(quantised(r, hn::Add(hn::LoadU(f, e + i), noise)), out + i);
    }
  }
}

// --- Bare numbers --------------------------------------------------------------------------------

void words_lanes(const Place& place, Stream stream, std::uint32_t* out, std::size_t tiles) {
  const PhiloxKeys keys = keys_of(place.seed, stream);
  for (std::size_t tile = 0; tile < tiles; ++tile) {
    alignas(64) std::uint32_t word[kTile];
    fill(keys, place.frame, tile_of(place, tile), word);
    std::copy_n(word, kTile, out + tile * kTile);
  }
}

void normals_lanes(const Place& place, Stream stream, float* out, std::size_t tiles) {
  const F f;
  const U u;
  const PhiloxKeys keys = keys_of(place.seed, stream);
  for (std::size_t tile = 0; tile < tiles; ++tile) {
    alignas(64) std::uint32_t word[kTile];
    fill(keys, place.frame, tile_of(place, tile), word);
    for (std::size_t i = 0; i < kTile; i += hn::Lanes(f))
      hn::StoreU(normal_of(hn::Load(u, word + i)), f, out + tile * kTile + i);
  }
}

void normals_of_lanes(const std::uint32_t* words, float* out, std::size_t tiles) {
  const F f;
  const U u;
  for (std::size_t i = 0; i < tiles * kTile; i += hn::Lanes(f))
    hn::StoreU(normal_of(hn::LoadU(u, words + i)), f, out + i);
}

}  // namespace engine::noise_lanes::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace engine::noise_lanes {

HWY_EXPORT(expose_lanes);
HWY_EXPORT(digitize_lanes);
HWY_EXPORT(words_lanes);
HWY_EXPORT(normals_lanes);
HWY_EXPORT(normals_of_lanes);

namespace {

Place moved(const Place& place, std::size_t by) noexcept {
  return {place.seed, place.frame, place.first + static_cast<std::uint32_t>(by)};
}

/// What is left behind the whole tiles, made up to one: in front of what is left of the span.
template <class Value>
std::array<Value, kTile> last_tile(std::span<const Value> all) noexcept {
  std::array<Value, kTile> tile{};
  const auto rest = all.subspan(all.size() - all.size() % kTile);
  std::copy(rest.begin(), rest.end(), tile.begin());
  return tile;
}

void expose_rest(const Place& place, Means means, std::span<const float> light,
                 std::span<float> electrons, Counts& counts) noexcept {
  const auto in = last_tile(light);
  const auto response = last_tile(means.response);
  const auto dark_e_s = last_tile(means.dark_e_s);
  if (!means.response.empty()) means.response = response;
  if (!means.dark_e_s.empty()) means.dark_e_s = dark_e_s;
  // The well is looked at here: beside the span nothing counts.
  const float most = means.clip ? means.full_well_e : means.brim_e;
  means.clip = false;
  std::array<float, kTile> out{};
  const std::size_t whole = light.size() - light.size() % kTile;
  Counts with_padding;
  HWY_DYNAMIC_DISPATCH(expose_lanes)
  (moved(place, whole), means, in.data(), out.data(), 1, with_padding);
  counts.no_light_px += with_padding.no_light_px;
  for (std::size_t i = whole; i < light.size(); ++i) {
    counts.full_well_px += out[i - whole] > means.full_well_e ? 1 : 0;
    electrons[i] = std::min(out[i - whole], most);
  }
}

}  // namespace

Counts expose(const Place& place, const Means& means, std::span<const float> light,
              std::span<float> electrons) noexcept {
  Counts counts;
  HWY_DYNAMIC_DISPATCH(expose_lanes)
  (place, means, light.data(), electrons.data(), light.size() / kTile, counts);
  if (light.size() % kTile != 0) expose_rest(place, means, light, electrons, counts);
  return counts;
}

void digitize(const Place& place, const ReadOut& read_out, std::span<const float> electrons,
              std::span<std::uint16_t> dn) noexcept {
  const std::size_t tiles = electrons.size() / kTile;
  HWY_DYNAMIC_DISPATCH(digitize_lanes)(place, read_out, electrons.data(), dn.data(), tiles);
  const std::size_t whole = tiles * kTile;
  if (whole == electrons.size()) return;
  const auto in = last_tile(electrons);
  std::array<std::uint16_t, kTile> out{};
  HWY_DYNAMIC_DISPATCH(digitize_lanes)(moved(place, whole), read_out, in.data(), out.data(), 1);
  std::copy_n(out.begin(), electrons.size() - whole, dn.begin() + static_cast<long>(whole));
}

void words(const Place& place, Stream stream, std::span<std::uint32_t> out) noexcept {
  ENSURE(out.size() % kTile == 0);
  HWY_DYNAMIC_DISPATCH(words_lanes)(place, stream, out.data(), out.size() / kTile);
}

void normals(const Place& place, Stream stream, std::span<float> out) noexcept {
  ENSURE(out.size() % kTile == 0);
  HWY_DYNAMIC_DISPATCH(normals_lanes)(place, stream, out.data(), out.size() / kTile);
}

void normals_of(std::span<const std::uint32_t> words, std::span<float> out) noexcept {
  ENSURE(words.size() % kTile == 0 && out.size() == words.size());
  HWY_DYNAMIC_DISPATCH(normals_of_lanes)(words.data(), out.data(), words.size() / kTile);
}

}  // namespace engine::noise_lanes
#endif  // HWY_ONCE
