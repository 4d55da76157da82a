#pragma once

#include <bit>
#include <cstddef>
#include <cstring>
#include <span>

namespace drivers {

static_assert(std::endian::native == std::endian::little,
              "the wire formats are written as they lie");

/// Pre: `at` and the bytes from there on are in the span, for both.
template <class T>
void put(std::span<std::byte> out, std::size_t at, const T& value) noexcept {
  std::memcpy(out.data() + at, &value, sizeof value);
}

template <class T>
[[nodiscard]] T get(std::span<const std::byte> in, std::size_t at) noexcept {
  T value{};
  std::memcpy(&value, in.data() + at, sizeof value);
  return value;
}

}  // namespace drivers
