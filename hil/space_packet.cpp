#include "hil/space_packet.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "engine/core/crc32c.h"
#include "hil/big_endian.h"

namespace hil {
namespace {

using engine::Duration;
using engine::Error;
using engine::Fault;

constexpr std::uint8_t kProtocol = 1;
constexpr std::uint8_t kMoreFollow = 1;
constexpr std::uint8_t kSigned = 2;
constexpr std::size_t kLengthAt = 4;
constexpr std::size_t kFlagsAt = 7;
constexpr std::uint64_t kMillisecond_ns = 1'000'000;

/// The bytes that follow the header, by kind of command.
constexpr std::array<std::size_t, kCommandKinds> kBodyBytes{0, 40, 24, 64, 4, 0, 0};

Error rejected(PacketFault cause, const char* step) noexcept {
  return {Fault::kRejected, static_cast<int>(cause), step};
}
Error malformed(const char* step) noexcept { return rejected(PacketFault::kMalformed, step); }

void put_body(BigEndianWriter& out, const Command& c) noexcept {
  switch (c.kind) {
    case CommandKind::kTrim:
      out.put(c.trim_offset_rad);
      out.put(c.trim_rate_rad_s);
      out.put(c.reference);
      break;
    case CommandKind::kRate:
      out.put(c.trim_rate_rad_s);
      out.put(c.reference);
      break;
    case CommandKind::kAttitude:
      out.put(c.attitude.j2000_to_camera);
      out.put(c.attitude.rate_rad_s);
      out.put(c.reference);
      break;
    case CommandKind::kMode:
      out.put(static_cast<std::uint32_t>(c.mode));
      break;
    case CommandKind::kReport:
    case CommandKind::kPing:
    case CommandKind::kTrigger:
      break;
  }
}

/// What is wrong with the body, or null.
const char* get_body(BigEndianReader& in, Command& c) noexcept {
  switch (c.kind) {
    case CommandKind::kTrim:
      in.fill(c.trim_offset_rad);
      in.fill(c.trim_rate_rad_s);
      c.reference = in.time();
      break;
    case CommandKind::kRate:
      in.fill(c.trim_rate_rad_s);
      c.reference = in.time();
      break;
    case CommandKind::kAttitude: {
      Quaternion& q = c.attitude.j2000_to_camera;
      in.fill(q);
      in.fill(c.attitude.rate_rad_s);
      c.reference = in.time();
      if (!in.finite()) break;
      const double length = std::hypot(std::hypot(q[0], q[1]), std::hypot(q[2], q[3]));
      if (!(length > 0.5 && length < 2.0)) return "a quaternion without length one";
      for (double& x : q) x /= length;
      break;
    }
    case CommandKind::kMode: {
      const auto mode = in.get<std::uint32_t>();
      if (mode >= kGuidanceModes) return "mode";
      c.mode = static_cast<GuidanceMode>(mode);
      break;
    }
    case CommandKind::kReport:
    case CommandKind::kPing:
    case CommandKind::kTrigger:
      break;
  }
  return nullptr;
}

/// All that follows the flags; what is wrong with it, or null.
const char* get_fields(BigEndianReader& r, Command& c) noexcept {
  c.sequence = r.get<std::uint64_t>();
  c.answers_frame = r.get<std::uint64_t>();
  c.made_at = r.time();
  c.time_to_live = Duration(static_cast<std::int64_t>(r.get<std::uint32_t>() * kMillisecond_ns));
  c.detection.id = r.get<std::uint32_t>();
  c.detection.centroid_px.u = r.get<float>();
  c.detection.centroid_px.v = r.get<float>();
  r.fill(c.detection.box_px);
  c.detection.confidence = r.get<float>();
  if (const char* fault = get_body(r, c); fault != nullptr) return fault;
  if (!r.finite()) return "a number that is not finite";
  if (c.detection.confidence < 0.0F || c.detection.confidence > 1.0F)
    return "a confidence outside 0 to 1";
  return nullptr;
}

/// Of a packet less its checksum: with a key a right signature is a must, without one none is
/// right.
std::optional<Error> check_signature(std::span<const std::byte> in, std::size_t message_bytes,
                                     const PacketKey* key) noexcept {
  const bool is_signed = in.size() > message_bytes;
  if (!is_signed && key == nullptr) return std::nullopt;
  if (!is_signed) return rejected(PacketFault::kUnsigned, "no signature");
  if (key == nullptr)
    return rejected(PacketFault::kSignature, "a signature, and no key to check it with");
  if (!key->matches(in.first(message_bytes), in.subspan(message_bytes)))
    return rejected(PacketFault::kSignature, "signature");
  return std::nullopt;
}

}  // namespace

CommandPacket encode_command(const Command& c) noexcept {
  const auto kind = static_cast<unsigned>(c.kind);
  CommandPacket packet;
  packet.used = kCommandHeaderBytes + kBodyBytes[kind] + kChecksumBytes;
  BigEndianWriter out(packet.storage);
  out.put(static_cast<std::uint16_t>(0x1800U | (kCommandApid + kind)));
  out.put(static_cast<std::uint16_t>(0xC000U | (c.sequence & 0x3FFFU)));
  out.put(static_cast<std::uint16_t>(packet.used - 7));
  out.put(kProtocol);
  out.put(c.more_follow ? kMoreFollow : std::uint8_t{0});
  out.put(c.sequence);
  out.put(c.answers_frame);
  out.put(c.made_at);
  // A life under a millisecond is not "for ever"; one over 49 days is.
  const auto life_ns =
      static_cast<std::uint64_t>(std::max<std::int64_t>(0, c.time_to_live.count()));
  const std::uint64_t life_ms = (life_ns + kMillisecond_ns - 1) / kMillisecond_ns;
  out.put(static_cast<std::uint32_t>(life_ms > 0xFFFFFFFFU ? 0U : life_ms));
  out.put(c.detection.id);
  out.put(static_cast<float>(c.detection.centroid_px.u));
  out.put(static_cast<float>(c.detection.centroid_px.v));
  out.put(c.detection.box_px);
  out.put(c.detection.confidence);
  put_body(out, c);
  out.put(engine::crc32c(std::span(packet.storage).first(out.used())));
  return packet;
}

void sign(CommandPacket& packet, const PacketKey& key) noexcept {
  const std::size_t end = packet.used - kChecksumBytes;
  packet.used += kSignatureBytes;
  BigEndianWriter(packet.storage, kLengthAt).put(static_cast<std::uint16_t>(packet.used - 7));
  packet.storage[kFlagsAt] |= static_cast<std::byte>(kSigned);
  const Signature signature = key.sign(std::span(packet.storage).first(end));
  std::copy(signature.begin(), signature.end(), packet.storage.begin() + end);
  BigEndianWriter out(packet.storage, end + kSignatureBytes);
  out.put(engine::crc32c(std::span(packet.storage).first(out.used())));
}

std::size_t packet_bytes(std::span<const std::byte> in) noexcept {
  return std::size_t{BigEndianReader(in, kLengthAt).get<std::uint16_t>()} + 7;
}

bool may_be_command(std::span<const std::byte> in) noexcept {
  const auto identity = BigEndianReader(in).get<std::uint16_t>();
  const std::size_t bytes = packet_bytes(in);
  return (identity & 0xF800U) == 0x1800U && (identity & 0x07FFU) - kCommandApid < kCommandKinds &&
         bytes >= kCommandHeaderBytes + kChecksumBytes && bytes <= kLargestCommandBytes;
}

engine::Expected<Command> decode_command(std::span<const std::byte> in,
                                         const PacketKey* key) noexcept {
  if (in.size() < kCommandHeaderBytes + kChecksumBytes || in.size() > kLargestCommandBytes)
    return malformed("length of a command");
  BigEndianReader head(in);
  const auto identity = head.get<std::uint16_t>();
  if ((identity & 0xF800U) != 0x1800U) return malformed("version and type of a packet");
  const unsigned kind = (identity & 0x07FFU) - kCommandApid;
  if (kind >= kCommandKinds) return malformed("kind of command");
  if (packet_bytes(in) != in.size()) return malformed("length of a command");
  const std::size_t before_checksum = in.size() - kChecksumBytes;
  if (BigEndianReader(in, before_checksum).get<std::uint32_t>() !=
      engine::crc32c(in.first(before_checksum)))
    return rejected(PacketFault::kChecksum, "checksum");
  BigEndianReader r(in, kPrimaryHeaderBytes);
  if (r.get<std::uint8_t>() != kProtocol) return malformed("protocol");
  const auto flags = r.get<std::uint8_t>();
  if ((flags & ~(kMoreFollow | kSigned)) != 0) return malformed("flags");
  const bool is_signed = (flags & kSigned) != 0;
  const std::size_t before_signature = kCommandHeaderBytes + kBodyBytes[kind];
  if (before_checksum != before_signature + (is_signed ? kSignatureBytes : 0))
    return malformed("length of a command");
  if (const auto fault = check_signature(in.first(before_checksum), before_signature, key))
    return *fault;

  Command c;
  c.kind = static_cast<CommandKind>(kind);
  c.more_follow = (flags & kMoreFollow) != 0;
  if (const char* fault = get_fields(r, c); fault != nullptr)
    return rejected(PacketFault::kValue, fault);
  return c;
}

}  // namespace hil
