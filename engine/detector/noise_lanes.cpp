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

inline std::uint32_t tile_of(const Place& place, std::size_t tile) noexcept {
  return static_cast<std::uint32_t>(place.first / kTile + tile);
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
// After foreach_target.h: they are included once for each target.
#include "engine/detector/poisson_lanes-inl.h"
#include "engine/detector/random_lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace engine::noise_lanes::HWY_NAMESPACE {

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
