#pragma once

#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

namespace test_support {

/// One line of a FITS header.
[[nodiscard]] inline std::string fits_card(const std::string& keyword, const std::string& value) {
  std::string card = keyword;
  card.resize(8, ' ');
  card += "= ";
  card.append(value.size() < 20 ? 20 - value.size() : 0, ' ');
  card += value;
  card.resize(80, ' ');
  return card;
}

/// A FITS file by hand: SIMPLE, BITPIX and axes, the other cards, END, and the values as BITPIX has
/// them, big-endian; both parts filled up to blocks of 2880.
[[nodiscard]] inline std::string fits_bytes(int bitpix, const std::vector<int>& axes,
                                            const std::vector<double>& values,
                                            const std::vector<std::string>& cards = {}) {
  std::string header = fits_card("SIMPLE", "T") + fits_card("BITPIX", std::to_string(bitpix)) +
                       fits_card("NAXIS", std::to_string(axes.size()));
  for (std::size_t i = 0; i < axes.size(); ++i)
    header += fits_card("NAXIS" + std::to_string(i + 1), std::to_string(axes[i]));
  for (const std::string& card : cards) header += card;
  header += "END";
  header.resize((header.size() + 2879) / 2880 * 2880, ' ');
  std::string data;
  const auto add = [&data](std::uint64_t bits, int bytes) {
    for (int i = bytes - 1; i >= 0; --i) data += static_cast<char>(bits >> (8 * i));
  };
  for (const double x : values) {
    std::uint64_t bits = 0;
    if (bitpix == -64) {
      std::memcpy(&bits, &x, 8);
    } else if (bitpix == -32) {
      const auto single = static_cast<float>(x);
      std::memcpy(&bits, &single, 4);
    } else {
      bits = static_cast<std::uint64_t>(static_cast<std::int64_t>(x));
    }
    add(bits, (bitpix < 0 ? -bitpix : bitpix) / 8);
  }
  data.resize((data.size() + 2879) / 2880 * 2880, '\0');
  return header + data;
}

}  // namespace test_support
