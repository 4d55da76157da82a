#pragma once

#include <array>
#include <bit>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <span>
#include <type_traits>

#include "engine/core/time.h"

namespace hil {

namespace detail {
template <class T>
using Bits = std::conditional_t<
    sizeof(T) == 8, std::uint64_t,
    std::conditional_t<sizeof(T) == 4, std::uint32_t,
                       std::conditional_t<sizeof(T) == 2, std::uint16_t, std::uint8_t>>>;
}  // namespace detail

/// Writes numbers one after the other, as Space Packets have them. Pre: they fit.
class BigEndianWriter {
 public:
  explicit BigEndianWriter(std::span<std::byte> out, std::size_t at = 0) noexcept
      : out_(out), at_(at) {}

  template <class T>
  BigEndianWriter& put(T value) noexcept {
    const auto bits = std::bit_cast<detail::Bits<T>>(value);
    for (std::size_t i = sizeof bits; i-- > 0; ++at_)
      out_[at_] = static_cast<std::byte>(static_cast<std::uint64_t>(bits) >> (8 * i));
    return *this;
  }
  BigEndianWriter& put(engine::Duration d) noexcept { return put(std::int64_t{d.count()}); }
  BigEndianWriter& put(engine::SimTime t) noexcept { return put(t.time_since_epoch()); }
  template <class T, std::size_t N>
  BigEndianWriter& put(const std::array<T, N>& values) noexcept {
    for (const T& value : values) put(value);
    return *this;
  }
  [[nodiscard]] std::size_t used() const noexcept { return at_; }

 private:
  std::span<std::byte> out_;
  std::size_t at_;
};

/// Reads numbers one after the other, and remembers whether all of them were finite. Pre: they are
/// there.
class BigEndianReader {
 public:
  explicit BigEndianReader(std::span<const std::byte> in, std::size_t at = 0) noexcept
      : in_(in), at_(at) {}

  template <class T>
  T get() noexcept {
    std::uint64_t bits = 0;
    for (std::size_t i = 0; i < sizeof(T); ++i, ++at_)
      bits = bits << 8 | static_cast<std::uint64_t>(in_[at_]);
    const T value = std::bit_cast<T>(static_cast<detail::Bits<T>>(bits));
    if constexpr (std::floating_point<T>) finite_ = finite_ && std::isfinite(value);
    return value;
  }
  template <class Array>
  void fill(Array& values) noexcept {
    for (auto& value : values) value = get<std::remove_reference_t<decltype(value)>>();
  }
  [[nodiscard]] engine::Duration duration() noexcept {
    return engine::Duration(get<std::int64_t>());
  }
  [[nodiscard]] engine::SimTime time() noexcept { return engine::SimTime(duration()); }
  [[nodiscard]] bool finite() const noexcept { return finite_; }

 private:
  std::span<const std::byte> in_;
  std::size_t at_;
  bool finite_ = true;
};

}  // namespace hil
