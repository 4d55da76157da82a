#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace engine {

/// CRC-32C (Castagnoli), as iSCSI (RFC 3720, B.4) defines it: "123456789" gives 0xE3069283.
[[nodiscard]] std::uint32_t crc32c(std::span<const std::byte> bytes) noexcept;

}  // namespace engine
