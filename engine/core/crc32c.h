#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace engine {

/// CRC-32C (Castagnoli), as iSCSI (RFC 3720, B.4) defines it: "123456789" gives 0xE3069283.
/// `so_far` is that of the bytes before, for what does not lie in one piece.
[[nodiscard]] std::uint32_t crc32c(std::span<const std::byte> bytes,
                                   std::uint32_t so_far = 0) noexcept;

}  // namespace engine
