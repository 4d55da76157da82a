#include "hil/packet_auth.h"

#include <openssl/core_names.h>
#include <openssl/crypto.h>
#include <openssl/evp.h>
#include <openssl/params.h>

#include <cctype>
#include <fstream>
#include <optional>
#include <vector>

#include "engine/core/contract.h"

namespace hil {
namespace {

using Bytes = std::vector<std::byte>;

const unsigned char* uchars(std::span<const std::byte> bytes) noexcept {
  return reinterpret_cast<const unsigned char*>(bytes.data());
}

std::optional<unsigned> hex_digit(unsigned char c) noexcept {
  if (c >= '0' && c <= '9') return c - '0';
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  if (c >= 'A' && c <= 'F') return c - 'A' + 10;
  return std::nullopt;
}

/// Nothing unless all of it is pairs of hexadecimal digits and white space.
std::optional<Bytes> from_hex(const std::string& text) {
  std::vector<unsigned> digits;
  for (const char c : text) {
    const auto letter = static_cast<unsigned char>(c);
    if (std::isspace(letter) != 0) continue;
    const auto digit = hex_digit(letter);
    if (!digit) return std::nullopt;
    digits.push_back(*digit);
  }
  if (digits.empty() || digits.size() % 2 != 0) return std::nullopt;
  Bytes bytes;
  for (std::size_t i = 0; i < digits.size(); i += 2)
    bytes.push_back(static_cast<std::byte>(digits[i] << 4 | digits[i + 1]));
  return bytes;
}

Bytes raw(const std::string& text) {
  Bytes bytes;
  for (const char c : text) bytes.push_back(static_cast<std::byte>(c));
  return bytes;
}

}  // namespace

void PacketKey::Free::operator()(evp_mac_ctx_st* context) const noexcept {
  EVP_MAC_CTX_free(context);
}

PacketKey::PacketKey(std::span<const std::byte> secret) {
  EVP_MAC* mac = EVP_MAC_fetch(nullptr, "HMAC", nullptr);
  ENSURE(mac != nullptr);
  context_.reset(EVP_MAC_CTX_new(mac));
  EVP_MAC_free(mac);
  ENSURE(context_ != nullptr);
  char digest[] = "SHA256";
  const OSSL_PARAM parameters[] = {
      OSSL_PARAM_construct_utf8_string(OSSL_MAC_PARAM_DIGEST, digest, 0),
      OSSL_PARAM_construct_end()};
  ENSURE(EVP_MAC_init(context_.get(), uchars(secret), secret.size(), parameters) == 1);
}

PacketKey::~PacketKey() = default;
PacketKey::PacketKey(PacketKey&&) noexcept = default;
PacketKey& PacketKey::operator=(PacketKey&&) noexcept = default;

PacketKey PacketKey::from_file(const std::string& path, const std::string& where) {
  std::ifstream file(path, std::ios::binary);
  // Twice the limit in hexadecimal digits, and as much white space: more is no key.
  std::string text(4 * kMostBytes + 1, '\0');
  file.read(text.data(), static_cast<std::streamsize>(text.size()));
  if (file.bad() || !file.is_open() || (file.fail() && !file.eof()))
    throw engine::ConfigError(where + " cannot read the key file " + path);
  text.resize(static_cast<std::size_t>(file.gcount()));
  const std::optional<Bytes> hex = from_hex(text);
  const Bytes bytes = hex ? *hex : raw(text);
  if (bytes.size() < kFewestBytes || bytes.size() > kMostBytes)
    throw engine::ConfigError(where + " must be a key of " + std::to_string(kFewestBytes) + " to " +
                              std::to_string(kMostBytes) + " bytes, got " +
                              std::to_string(bytes.size()) + " in " + path);
  return PacketKey(bytes);
}

Signature PacketKey::sign(std::span<const std::byte> message) const noexcept {
  Signature out{};
  std::size_t used = 0;
  // A null key starts over with the one that is already there.
  const bool done = EVP_MAC_init(context_.get(), nullptr, 0, nullptr) == 1 &&
                    EVP_MAC_update(context_.get(), uchars(message), message.size()) == 1 &&
                    EVP_MAC_final(context_.get(), reinterpret_cast<unsigned char*>(out.data()),
                                  &used, out.size()) == 1;
  ENSURE(done && used == out.size());
  return out;
}

bool PacketKey::matches(std::span<const std::byte> message,
                        std::span<const std::byte> signature) const noexcept {
  if (signature.size() != kSignatureBytes) return false;
  const Signature right = sign(message);
  return CRYPTO_memcmp(right.data(), signature.data(), right.size()) == 0;
}

}  // namespace hil
