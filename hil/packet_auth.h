#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <span>
#include <string>

struct evp_mac_ctx_st;

namespace hil {

inline constexpr std::size_t kSignatureBytes = 32;
using Signature = std::array<std::byte, kSignatureBytes>;

/// A secret that two sides share: who holds it may command. HMAC-SHA256 (RFC 2104, FIPS 180-4), by
/// OpenSSL. Thread: one at a time; does not allocate once made, does not throw.
class PacketKey {
 public:
  static constexpr std::size_t kFewestBytes = 16;
  static constexpr std::size_t kMostBytes = 1024;

  /// Of any length: what is too short to be safe is the file's business.
  explicit PacketKey(std::span<const std::byte> secret);
  ~PacketKey();
  PacketKey(PacketKey&&) noexcept;
  PacketKey& operator=(PacketKey&&) noexcept;

  /// Hexadecimal digits with any white space between, or else the bytes as they stand; 16 to 1024
  /// bytes. Throws ConfigError that begins with `where` for what is not.
  [[nodiscard]] static PacketKey from_file(const std::string& path, const std::string& where);

  [[nodiscard]] Signature sign(std::span<const std::byte> message) const noexcept;
  /// In constant time: how long it takes does not say how much was right.
  [[nodiscard]] bool matches(std::span<const std::byte> message,
                             std::span<const std::byte> signature) const noexcept;

 private:
  struct Free {
    void operator()(evp_mac_ctx_st* context) const noexcept;
  };
  std::unique_ptr<evp_mac_ctx_st, Free> context_;
};

}  // namespace hil
