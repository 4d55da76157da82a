#include "hil/telemetry_packet.h"

#include "engine/core/crc32c.h"
#include "hil/big_endian.h"
#include "hil/space_packet.h"

namespace hil {
namespace {

constexpr std::uint8_t kProtocol = 1;

/// The bytes that follow the header, by kind of telemetry.
constexpr std::array<std::size_t, kTelemetryKinds> kBodyBytes{
    40, 72, 8, 8 * (4 + kRefusals + kPortCounts), 24};

/// Writes frame, time and body; one overload a kind.
class Encoder {
 public:
  explicit Encoder(BigEndianWriter& out) noexcept : out_(out) {}

  void operator()(const FrameNews& n) const noexcept {
    out_.put(n.frame).put(n.shutter_open).put(n.exposure);
    put(n.counts);
  }
  void operator()(const AttitudeNews& n) const noexcept {
    out_.put(n.frame).put(n.mid_exposure);
    out_.put(n.measured.j2000_to_camera).put(n.measured.rate_rad_s).put(n.trim_rad);
  }
  void operator()(const TimeNews& n) const noexcept {
    out_.put(n.frame).put(n.shutter_open).put(n.monotonic);
  }
  void operator()(const Housekeeping& n) const noexcept {
    out_.put(n.frame).put(n.shutter_open);
    put(n.counts);
    out_.put(n.counts.refused.by_cause).put(n.port.values);
  }
  void operator()(const Pong& n) const noexcept {
    out_.put(n.frame).put(n.shutter_open).put(n.sequence).put(n.made_at).put(n.monotonic);
  }

 private:
  void put(const LoopCounts& c) const noexcept {
    out_.put(c.skipped).put(c.dropped).put(c.late).put(c.commands);
  }
  BigEndianWriter& out_;
};

/// Reads what Encoder wrote; one overload a kind.
class Decoder {
 public:
  explicit Decoder(BigEndianReader& in) noexcept : in_(in) {}

  void operator()(FrameNews& n) const noexcept {
    n.frame = in_.get<std::uint64_t>();
    n.shutter_open = in_.time();
    n.exposure = in_.duration();
    n.counts = counts();
  }
  void operator()(AttitudeNews& n) const noexcept {
    n.frame = in_.get<std::uint64_t>();
    n.mid_exposure = in_.time();
    in_.fill(n.measured.j2000_to_camera);
    in_.fill(n.measured.rate_rad_s);
    in_.fill(n.trim_rad);
  }
  void operator()(TimeNews& n) const noexcept {
    n.frame = in_.get<std::uint64_t>();
    n.shutter_open = in_.time();
    n.monotonic = in_.duration();
  }
  void operator()(Housekeeping& n) const noexcept {
    n.frame = in_.get<std::uint64_t>();
    n.shutter_open = in_.time();
    n.counts = counts();
    in_.fill(n.counts.refused.by_cause);
    in_.fill(n.port.values);
  }
  void operator()(Pong& n) const noexcept {
    n.frame = in_.get<std::uint64_t>();
    n.shutter_open = in_.time();
    n.sequence = in_.get<std::uint64_t>();
    n.made_at = in_.time();
    n.monotonic = in_.duration();
  }

 private:
  [[nodiscard]] LoopCounts counts() const noexcept {
    LoopCounts c;
    for (std::uint64_t* n : {&c.skipped, &c.dropped, &c.late, &c.commands})
      *n = in_.get<std::uint64_t>();
    return c;
  }
  BigEndianReader& in_;
};

Telemetry empty(std::size_t kind) noexcept {
  switch (kind) {
    case 0:
      return FrameNews{};
    case 1:
      return AttitudeNews{};
    case 2:
      return TimeNews{};
    case 3:
      return Housekeeping{};
    default:
      return Pong{};
  }
}

engine::Error rejected(const char* step) noexcept { return {engine::Fault::kRejected, 0, step}; }

}  // namespace

TelemetryPacket encode_telemetry(const Telemetry& news, std::uint64_t count) noexcept {
  TelemetryPacket packet;
  packet.used = kTelemetryHeaderBytes + kBodyBytes[news.index()] + kChecksumBytes;
  BigEndianWriter out(packet.storage);
  out.put(static_cast<std::uint16_t>(0x0800U | (kTelemetryApid + news.index())));
  out.put(static_cast<std::uint16_t>(0xC000U | (count & 0x3FFFU)));
  out.put(static_cast<std::uint16_t>(packet.used - 7));
  out.put(kProtocol).put(std::uint8_t{0});
  std::visit(Encoder(out), news);
  out.put(engine::crc32c(std::span(packet.storage).first(out.used())));
  return packet;
}

engine::Expected<Telemetry> decode_telemetry(std::span<const std::byte> in) noexcept {
  if (in.size() < kTelemetryHeaderBytes + kChecksumBytes) return rejected("length of telemetry");
  const auto identity = BigEndianReader(in).get<std::uint16_t>();
  if ((identity & 0xF800U) != 0x0800U) return rejected("version and type of a packet");
  const std::size_t kind = (identity & 0x07FFU) - std::size_t{kTelemetryApid};
  if (kind >= kTelemetryKinds) return rejected("kind of telemetry");
  if (packet_bytes(in) != in.size() ||
      in.size() != kTelemetryHeaderBytes + kBodyBytes[kind] + kChecksumBytes)
    return rejected("length of telemetry");
  const std::size_t end = in.size() - kChecksumBytes;
  if (BigEndianReader(in, end).get<std::uint32_t>() != engine::crc32c(in.first(end)))
    return rejected("checksum");
  BigEndianReader r(in, kPrimaryHeaderBytes);
  if (r.get<std::uint8_t>() != kProtocol) return rejected("protocol");
  if (r.get<std::uint8_t>() != 0) return rejected("flags");
  Telemetry news = empty(kind);
  std::visit(Decoder(r), news);
  if (!r.finite()) return rejected("a number that is not finite");
  return news;
}

}  // namespace hil
