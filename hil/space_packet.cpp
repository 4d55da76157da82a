#include "hil/space_packet.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <concepts>
#include <cstring>

#include "engine/core/crc32c.h"

namespace hil {
namespace {

using engine::Duration;
using engine::Error;
using engine::Fault;
using engine::SimTime;

constexpr std::uint8_t kProtocol = 1;
constexpr std::uint8_t kMoreFollow = 1;
constexpr std::uint64_t kMillisecond_ns = 1'000'000;

/// The bytes that follow the header, by kind of command.
constexpr std::array<std::size_t, kCommandKinds> kBodyBytes{0, 40, 24, 64, 4, 0, 0};

template <class T>
using Bits = std::conditional_t<
    sizeof(T) == 8, std::uint64_t,
    std::conditional_t<sizeof(T) == 4, std::uint32_t,
                       std::conditional_t<sizeof(T) == 2, std::uint16_t, std::uint8_t>>>;

/// Writes numbers one after the other.
class Writer {
 public:
  explicit Writer(std::span<std::byte> out) noexcept : out_(out) {}

  template <class T>
  Writer& put(T value) noexcept {
    auto bits = std::bit_cast<Bits<T>>(value);
    for (std::size_t i = sizeof bits; i-- > 0; ++at_)
      out_[at_] = static_cast<std::byte>(static_cast<std::uint64_t>(bits) >> (8 * i));
    return *this;
  }
  [[nodiscard]] std::size_t used() const noexcept { return at_; }

 private:
  std::span<std::byte> out_;
  std::size_t at_ = 0;
};

/// Reads numbers one after the other, and remembers whether all of them were finite.
class Reader {
 public:
  Reader(std::span<const std::byte> in, std::size_t at) noexcept : in_(in), at_(at) {}

  template <class T>
  T get() noexcept {
    std::uint64_t bits = 0;
    for (std::size_t i = 0; i < sizeof(T); ++i, ++at_)
      bits = bits << 8 | static_cast<std::uint64_t>(in_[at_]);
    const T value = std::bit_cast<T>(static_cast<Bits<T>>(bits));
    if constexpr (std::floating_point<T>) finite_ = finite_ && std::isfinite(value);
    return value;
  }
  template <class Array>
  void fill(Array& values) noexcept {
    for (auto& value : values) value = get<std::remove_reference_t<decltype(value)>>();
  }
  [[nodiscard]] SimTime time() noexcept { return SimTime(Duration(get<std::int64_t>())); }
  [[nodiscard]] bool finite() const noexcept { return finite_; }

 private:
  std::span<const std::byte> in_;
  std::size_t at_;
  bool finite_ = true;
};

Error rejected(const char* step) noexcept { return {Fault::kRejected, 0, step}; }

std::int64_t ns(SimTime t) noexcept { return t.time_since_epoch().count(); }

void put_body(Writer& out, const Command& c) noexcept {
  switch (c.kind) {
    case CommandKind::kTrim:
      for (const double x : c.trim_offset_rad) out.put(x);
      for (const double x : c.trim_rate_rad_s) out.put(x);
      out.put(ns(c.reference));
      break;
    case CommandKind::kRate:
      for (const double x : c.trim_rate_rad_s) out.put(x);
      out.put(ns(c.reference));
      break;
    case CommandKind::kAttitude:
      for (const double x : c.attitude.j2000_to_camera) out.put(x);
      for (const double x : c.attitude.rate_rad_s) out.put(x);
      out.put(ns(c.reference));
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
const char* get_body(Reader& in, Command& c) noexcept {
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

}  // namespace

CommandPacket encode_command(const Command& c) noexcept {
  const auto kind = static_cast<unsigned>(c.kind);
  CommandPacket packet;
  packet.used = kCommandHeaderBytes + kBodyBytes[kind] + kChecksumBytes;
  Writer out(packet.storage);
  out.put(static_cast<std::uint16_t>(0x1800U | (kCommandApid + kind)));
  out.put(static_cast<std::uint16_t>(0xC000U | (c.sequence & 0x3FFFU)));
  out.put(static_cast<std::uint16_t>(packet.used - 7));
  out.put(kProtocol);
  out.put(c.more_follow ? kMoreFollow : std::uint8_t{0});
  out.put(c.sequence);
  out.put(c.answers_frame);
  out.put(ns(c.made_at));
  // A life under a millisecond is not "for ever"; one over 49 days is.
  const auto life_ns =
      static_cast<std::uint64_t>(std::max<std::int64_t>(0, c.time_to_live.count()));
  const std::uint64_t life_ms = (life_ns + kMillisecond_ns - 1) / kMillisecond_ns;
  out.put(static_cast<std::uint32_t>(life_ms > 0xFFFFFFFFU ? 0U : life_ms));
  out.put(c.detection.id);
  out.put(static_cast<float>(c.detection.centroid_px.u));
  out.put(static_cast<float>(c.detection.centroid_px.v));
  for (const float x : c.detection.box_px) out.put(x);
  out.put(c.detection.confidence);
  put_body(out, c);
  out.put(engine::crc32c(std::span(packet.storage).first(out.used())));
  return packet;
}

std::size_t packet_bytes(std::span<const std::byte> in) noexcept {
  return std::size_t{Reader(in, 4).get<std::uint16_t>()} + 7;
}

engine::Expected<Command> decode_command(std::span<const std::byte> in) noexcept {
  if (in.size() < kCommandHeaderBytes + kChecksumBytes || in.size() > kLargestCommandBytes)
    return rejected("length of a command");
  Reader head(in, 0);
  const auto identity = head.get<std::uint16_t>();
  static_cast<void>(head.get<std::uint16_t>());
  if ((identity & 0xF800U) != 0x1800U) return rejected("version and type of a packet");
  const unsigned kind = (identity & 0x07FFU) - kCommandApid;
  if (kind >= kCommandKinds) return rejected("kind of command");
  if (packet_bytes(in) != in.size()) return rejected("length of a command");
  const std::size_t before_checksum = in.size() - kChecksumBytes;
  if (Reader(in, before_checksum).get<std::uint32_t>() != engine::crc32c(in.first(before_checksum)))
    return rejected("checksum");
  Reader r(in, kPrimaryHeaderBytes);
  if (r.get<std::uint8_t>() != kProtocol) return rejected("protocol");
  const auto flags = r.get<std::uint8_t>();
  if ((flags & ~kMoreFollow) != 0) return rejected("flags");
  if (in.size() != kCommandHeaderBytes + kBodyBytes[kind] + kChecksumBytes)
    return rejected("length of a command");

  Command c;
  c.kind = static_cast<CommandKind>(kind);
  c.more_follow = (flags & kMoreFollow) != 0;
  c.sequence = r.get<std::uint64_t>();
  c.answers_frame = r.get<std::uint64_t>();
  c.made_at = r.time();
  c.time_to_live = Duration(static_cast<std::int64_t>(r.get<std::uint32_t>() * kMillisecond_ns));
  c.detection.id = r.get<std::uint32_t>();
  c.detection.centroid_px.u = r.get<float>();
  c.detection.centroid_px.v = r.get<float>();
  r.fill(c.detection.box_px);
  c.detection.confidence = r.get<float>();
  if (const char* fault = get_body(r, c); fault != nullptr) return rejected(fault);
  if (!r.finite()) return rejected("a number that is not finite");
  if (c.detection.confidence < 0.0F || c.detection.confidence > 1.0F)
    return rejected("a confidence outside 0 to 1");
  return c;
}

}  // namespace hil
