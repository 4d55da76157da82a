#include "drivers/pixel_packing.h"

#include <array>
#include <cstring>

#include "engine/core/contract.h"

#if defined(__x86_64__)
#include <immintrin.h>
#endif

namespace drivers {
namespace {

constexpr std::uint16_t kMask = (1U << kPackedBits) - 1;
// Eight pixels are eleven bytes: there the bits of one group end where a byte does.
constexpr std::size_t kGroup = 8;
constexpr std::size_t kGroupBytes = 11;

#if defined(__x86_64__)

/// Sixteen pixels a step. Returns how many it packed, all of whole groups; each store writes five
/// bytes past its group, which the next ones overwrite.
__attribute__((target("avx2"))) std::size_t pack_avx2(std::span<const std::uint16_t> pixels,
                                                      std::span<std::byte> out) noexcept {
  const __m256i pixel_bits = _mm256_set1_epi16(kMask);
  const __m256i low_22 = _mm256_set1_epi64x(0x3FFFFF);
  const __m256i next_22 = _mm256_set1_epi64x(0x3FFFFFLL << 22);
  // Two neighbours as one 22-bit number: a + 2048 b.
  const __m256i join = _mm256_set1_epi32((1 << (16 + 11)) | 1);
  // 44 bits each; those of the upper half begin half a byte on.
  const __m256i half_byte = _mm256_set_epi64x(4, 0, 4, 0);
  const __m256i lower =
      _mm256_setr_epi8(0, 1, 2, 3, 4, 5, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1,  //
                       0, 1, 2, 3, 4, 5, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1);
  const __m256i upper =
      _mm256_setr_epi8(-1, -1, -1, -1, -1, 8, 9, 10, 11, 12, 13, -1, -1, -1, -1, -1,  //
                       -1, -1, -1, -1, -1, 8, 9, 10, 11, 12, 13, -1, -1, -1, -1, -1);
  std::size_t i = 0;
  for (std::size_t at = 0; i + 2 * kGroup <= pixels.size() && at + kGroupBytes + 16 <= out.size();
       i += 2 * kGroup, at += 2 * kGroupBytes) {
    __m256i x = _mm256_loadu_si256(reinterpret_cast<const __m256i*>(pixels.data() + i));
    x = _mm256_madd_epi16(_mm256_and_si256(x, pixel_bits), join);
    x = _mm256_or_si256(_mm256_and_si256(x, low_22),
                        _mm256_and_si256(_mm256_srli_epi64(x, 10), next_22));
    x = _mm256_sllv_epi64(x, half_byte);
    x = _mm256_or_si256(_mm256_shuffle_epi8(x, lower), _mm256_shuffle_epi8(x, upper));
    _mm_storeu_si128(reinterpret_cast<__m128i*>(out.data() + at), _mm256_castsi256_si128(x));
    _mm_storeu_si128(reinterpret_cast<__m128i*>(out.data() + at + kGroupBytes),
                     _mm256_extracti128_si256(x, 1));
  }
  return i;
}

/// A group as eight 32-bit numbers.
__attribute__((target("avx2"))) __m256i unpack_group(const std::byte* in) noexcept {
  // Pixel i begins in byte 11 i / 8, at bit 11 i % 8: 0 3 6 1 4 7 2 5; three bytes hold it.
  const __m256i bytes = _mm256_setr_epi8(0, 1, 2, -1, 1, 2, 3, -1, 2, 3, 4, -1, 4, 5, 6, -1,  //
                                         5, 6, 7, -1, 6, 7, 8, -1, 8, 9, 10, -1, 9, 10, 11, -1);
  const __m256i begins = _mm256_setr_epi32(0, 3, 6, 1, 4, 7, 2, 5);
  const __m256i both =
      _mm256_broadcastsi128_si256(_mm_loadu_si128(reinterpret_cast<const __m128i*>(in)));
  return _mm256_and_si256(_mm256_srlv_epi32(_mm256_shuffle_epi8(both, bytes), begins),
                          _mm256_set1_epi32(kMask));
}

/// Sixteen pixels a step. Returns how many it unpacked, all of whole groups; it reads five bytes
/// past each, where there are some.
__attribute__((target("avx2"))) std::size_t unpack_avx2(std::span<const std::byte> in,
                                                        std::span<std::uint16_t> pixels) noexcept {
  std::size_t i = 0;
  for (std::size_t at = 0; i + 2 * kGroup <= pixels.size() && at + kGroupBytes + 16 <= in.size();
       i += 2 * kGroup, at += 2 * kGroupBytes) {
    const __m256i x = _mm256_packus_epi32(unpack_group(in.data() + at),
                                          unpack_group(in.data() + at + kGroupBytes));
    // Packing works within halves: put the quarters in order.
    _mm256_storeu_si256(reinterpret_cast<__m256i*>(pixels.data() + i),
                        _mm256_permute4x64_epi64(x, _MM_SHUFFLE(3, 1, 2, 0)));
  }
  return i;
}

const bool has_avx2 = __builtin_cpu_supports("avx2") != 0;

#endif

}  // namespace

namespace detail {

std::size_t pack_plain(std::span<const std::uint16_t> pixels, std::span<std::byte> out) noexcept {
  std::uint64_t bits = 0;
  unsigned held = 0;
  std::size_t at = 0;
  for (const std::uint16_t pixel : pixels) {
    bits |= static_cast<std::uint64_t>(pixel & kMask) << held;
    for (held += kPackedBits; held >= 8; held -= 8, bits >>= 8)
      out[at++] = static_cast<std::byte>(bits & 0xFF);
  }
  if (held > 0) out[at++] = static_cast<std::byte>(bits & 0xFF);
  return at;
}

void unpack_plain(std::span<const std::byte> in, std::span<std::uint16_t> pixels) noexcept {
  std::uint64_t bits = 0;
  unsigned held = 0;
  std::size_t at = 0;
  for (std::uint16_t& pixel : pixels) {
    for (; held < kPackedBits; held += 8) bits |= static_cast<std::uint64_t>(in[at++]) << held;
    pixel = static_cast<std::uint16_t>(bits & kMask);
    bits >>= kPackedBits;
    held -= kPackedBits;
  }
}

}  // namespace detail

std::size_t pack_pixels(std::span<const std::uint16_t> pixels, std::span<std::byte> out) noexcept {
  ENSURE(out.size() >= packed_bytes(pixels.size()));
  std::size_t done = 0;
#if defined(__x86_64__)
  if (has_avx2) done = pack_avx2(pixels, out);
#endif
  const std::size_t at = done / kGroup * kGroupBytes;
  return at + detail::pack_plain(pixels.subspan(done), out.subspan(at));
}

void unpack_pixels(std::span<const std::byte> in, std::span<std::uint16_t> pixels) noexcept {
  ENSURE(in.size() >= packed_bytes(pixels.size()));
  std::size_t done = 0;
#if defined(__x86_64__)
  if (has_avx2) done = unpack_avx2(in, pixels);
#endif
  detail::unpack_plain(in.subspan(done / kGroup * kGroupBytes), pixels.subspan(done));
}

}  // namespace drivers
