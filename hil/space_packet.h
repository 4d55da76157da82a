#pragma once

#include <array>
#include <cstddef>
#include <span>

#include "hil/camera_link.h"
#include "hil/packet_auth.h"

namespace hil {

/// Commands as CCSDS Space Packets (133.0-B-2); protocol.md is the interface control document. All
/// numbers big-endian. Telecommand packets:
///    0  2  version 0, type 1, secondary header 1, APID = 0x100 + kind of command
///    2  2  sequence flags 3, the low 14 bits of the sequence
///    4  2  bytes of the packet less 7
///    6  1  protocol, 1                       36  4  detection: id (unsigned)
///    7  1  flags: 1 more follow, 2 signed    40  8  centroid u, v, px (floats)
///    8  8  sequence (unsigned)               48 16  box left, top, right, bottom, px (floats)
///   16  8  frame it answers; all ones: none  64  4  confidence, 0 to 1; 0: no detection (float)
///   24  8  made at, ns (signed)              68  n  by kind, below
///   32  4  time to live, ms; 0: no limit      .. 32  HMAC-SHA256 of all before, when signed
///                                             ..  4  CRC-32C of all before
/// By kind: 0 report, 5 ping, 6 trigger: nothing.
///   1 trim: offsets x, y, rad; rates x, y, rad/s (doubles); reference, ns: 40 bytes
///   2 rate: rates x, y, rad/s; reference, ns: 24 bytes
///   3 attitude: quaternion w, x, y, z J2000 -> camera; rates x, y, z, rad/s; reference: 64 bytes
///   4 mode: 0 predicted target, 1 nadir, 2 inertial, 3 commanded (unsigned, 4 bytes)
/// Times are simulated nanoseconds after the scenario's epoch.
inline constexpr std::size_t kPrimaryHeaderBytes = 6;
inline constexpr std::size_t kCommandHeaderBytes = 68;
inline constexpr std::size_t kChecksumBytes = 4;
inline constexpr std::size_t kLargestCommandBytes =
    kCommandHeaderBytes + 64 + kSignatureBytes + kChecksumBytes;
inline constexpr unsigned kCommandApid = 0x100;

/// A command in its bytes.
struct CommandPacket {
  std::array<std::byte, kLargestCommandBytes> storage{};
  std::size_t used = 0;

  [[nodiscard]] std::span<const std::byte> bytes() const noexcept {
    return std::span(storage).first(used);
  }
};

/// Unsigned; Command::sender stays at home.
[[nodiscard]] CommandPacket encode_command(const Command& command) noexcept;

/// Adds the signature. Pre: it comes fresh from encode_command().
void sign(CommandPacket& packet, const PacketKey& key) noexcept;

/// What a packet failed at, in the order in which it is looked at.
enum class PacketFault : std::uint8_t { kMalformed, kChecksum, kUnsigned, kSignature, kValue };

/// Without a key only unsigned packets are commands; with one, only packets that it signed.
/// kRejected for anything that is not exactly one whole such command: length, version, type, APID,
/// protocol, checksum, signature, or a number that is not finite or out of its range; error().code
/// is then a PacketFault. A quaternion comes back with length one; one shorter than 0.5 or longer
/// than 2 is refused.
[[nodiscard]] engine::Expected<Command> decode_command(std::span<const std::byte> in,
                                                       const PacketKey* key = nullptr) noexcept;

/// How long the packet that starts here says it is: for streams. Pre: at least 6 bytes.
[[nodiscard]] std::size_t packet_bytes(std::span<const std::byte> in) noexcept;

/// Whether a command can begin like this; false: a stream has lost its place, or never had one.
/// Pre: at least 6 bytes.
[[nodiscard]] bool may_be_command(std::span<const std::byte> in) noexcept;

}  // namespace hil
