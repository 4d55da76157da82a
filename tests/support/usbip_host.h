#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <vector>

/// What a host says over USB/IP, in bytes.
namespace usbip_host {

using Bytes = std::vector<std::byte>;

inline constexpr std::uint32_t kOut = 0;
inline constexpr std::uint32_t kIn = 1;
inline constexpr std::uint32_t kZeroPacket = 0x40;

/// Numbers as the protocol has them.
class Words {
 public:
  Words& word(std::uint32_t v) {
    for (int shift = 24; shift >= 0; shift -= 8)
      bytes_.push_back(static_cast<std::byte>(v >> shift));
    return *this;
  }
  Words& half(std::uint32_t v) {
    for (int shift = 8; shift >= 0; shift -= 8)
      bytes_.push_back(static_cast<std::byte>(v >> shift));
    return *this;
  }
  Words& raw(std::span<const std::byte> more) {
    bytes_.insert(bytes_.end(), more.begin(), more.end());
    return *this;
  }
  [[nodiscard]] const Bytes& bytes() const { return bytes_; }

 private:
  Bytes bytes_;
};

inline Bytes import_request(const char* bus_id) {
  Bytes id(32);
  std::memcpy(id.data(), bus_id, std::strlen(bus_id));
  return Words().half(0x0111).half(0x8003).word(0).raw(id).bytes();
}

inline Bytes submit(std::uint32_t number, std::uint32_t direction, std::uint32_t endpoint,
                    std::uint32_t flags, std::uint32_t length, std::array<unsigned, 8> setup = {},
                    std::span<const std::byte> data = {}) {
  Bytes s;
  for (const unsigned b : setup) s.push_back(static_cast<std::byte>(b));
  return Words()
      .word(1)
      .word(number)
      .word(0x10002)
      .word(direction)
      .word(endpoint)
      .word(flags)
      .word(length)
      .word(0)
      .word(0)
      .word(0)
      .raw(s)
      .raw(data)
      .bytes();
}

inline Bytes unlink(std::uint32_t number, std::uint32_t which) {
  return Words().word(2).word(number).word(0).word(0).word(0).word(which).raw(Bytes(24)).bytes();
}

}  // namespace usbip_host
