#include "engine/core/crc32c.h"

#include <array>
#include <bit>
#include <cstring>

namespace engine {
namespace {

static_assert(std::endian::native == std::endian::little);

using Table = std::array<std::array<std::uint32_t, 256>, 8>;

/// Slicing by eight: table k steps a byte over k more bytes of zeros.
constexpr Table make_table() noexcept {
  constexpr std::uint32_t kReversedPolynomial = 0x82F63B78U;
  Table table{};
  for (std::uint32_t i = 0; i < 256; ++i) {
    std::uint32_t c = i;
    for (int bit = 0; bit < 8; ++bit) c = (c >> 1) ^ ((c & 1U) != 0 ? kReversedPolynomial : 0U);
    table[0][i] = c;
  }
  for (std::size_t k = 1; k < 8; ++k)
    for (std::size_t i = 0; i < 256; ++i)
      table[k][i] = (table[k - 1][i] >> 8) ^ table[0][table[k - 1][i] & 0xFFU];
  return table;
}

constexpr Table kTable = make_table();

}  // namespace

std::uint32_t crc32c(std::span<const std::byte> bytes, std::uint32_t so_far) noexcept {
  std::uint32_t c = ~so_far;
  while (bytes.size() >= 8) {
    std::uint64_t word = 0;
    std::memcpy(&word, bytes.data(), 8);
    word ^= c;
    c = 0;
    for (std::size_t k = 0; k < 8; ++k) c ^= kTable[7 - k][(word >> (8 * k)) & 0xFFU];
    bytes = bytes.subspan(8);
  }
  for (const std::byte b : bytes)
    c = (c >> 8) ^ kTable[0][(c ^ static_cast<std::uint32_t>(b)) & 0xFFU];
  return ~c;
}

}  // namespace engine
