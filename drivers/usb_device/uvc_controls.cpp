#include "drivers/usb_device/uvc_controls.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "drivers/little_endian.h"

namespace drivers {
namespace {

using engine::Duration;
using engine::Error;
using engine::Fault;
using engine::SimTime;

constexpr double kNano = 1e9;
constexpr double kCentroid = 65536;           // parts of a pixel
constexpr double kConfidence = 65535;         // parts of one
constexpr double kQuaternion = 1073741824.0;  // parts of one, 2^30
constexpr std::uint8_t kVersion = 1;
constexpr std::uint8_t kMoreFollow = 1;
constexpr std::uint8_t kCutOff = 1;

/// In parts of which `scale` are one.
template <class T = std::int32_t>
T fixed(double value, double scale, bool& cut_off) noexcept {
  constexpr double kLeast = std::numeric_limits<T>::min();
  constexpr double kMost = std::numeric_limits<T>::max();
  const double parts = std::nearbyint(value * scale);
  if (parts >= kLeast && parts <= kMost) return static_cast<T>(parts);
  cut_off = true;
  if (std::isnan(parts)) return 0;
  return parts < 0 ? std::numeric_limits<T>::min() : std::numeric_limits<T>::max();
}

template <class Array>
void put_fixed(std::span<std::byte> out, std::size_t at, const Array& values, double scale,
               bool& cut_off) noexcept {
  for (const double value : values) {
    put(out, at, fixed(value, scale, cut_off));
    at += sizeof(std::int32_t);
  }
}

template <class Array>
void get_fixed(std::span<const std::byte> in, std::size_t at, Array& values,
               double scale) noexcept {
  for (auto& value : values) {
    value =
        static_cast<std::remove_reference_t<decltype(value)>>(get<std::int32_t>(in, at) / scale);
    at += sizeof(std::int32_t);
  }
}

std::int64_t ns(SimTime t) noexcept { return t.time_since_epoch().count(); }
SimTime time_at(std::span<const std::byte> in, std::size_t at) noexcept {
  return SimTime(Duration(get<std::int64_t>(in, at)));
}

Error rejected(const char* step) noexcept { return {Fault::kRejected, 0, step}; }

bool has_place(hil::CommandKind kind) noexcept {
  switch (kind) {
    case hil::CommandKind::kReport:
    case hil::CommandKind::kTrim:
    case hil::CommandKind::kRate:
    case hil::CommandKind::kMode:
    case hil::CommandKind::kTrigger:
      return true;
    default:
      return false;
  }
}

}  // namespace

UvcCommandBytes encode_uvc_command(const hil::Command& c) noexcept {
  ENSURE(has_place(c.kind));
  constexpr std::int64_t kMostMs = std::numeric_limits<std::uint32_t>::max();
  UvcCommandBytes out{};
  bool cut_off = false;
  put(out, 0, kVersion);
  put(out, 1, static_cast<std::uint8_t>(c.kind));
  put(out, 2, std::uint8_t{c.more_follow ? kMoreFollow : std::uint8_t{0}});
  put(out, 3, static_cast<std::uint8_t>(c.mode));
  put(out, 4,
      static_cast<std::uint32_t>(
          std::clamp<std::int64_t>(c.time_to_live.count() / 1'000'000, 0, kMostMs)));
  put(out, 8, c.sequence);
  put(out, 16, c.answers_frame);
  put(out, 24, ns(c.made_at));
  put(out, 32, ns(c.reference));
  put_fixed(out, 40, c.trim_offset_rad, kNano, cut_off);
  put_fixed(out, 48, c.trim_rate_rad_s, kNano, cut_off);
  put_fixed(out, 56, std::array{c.detection.centroid_px.u, c.detection.centroid_px.v}, kCentroid,
            cut_off);
  put(out, 64, c.detection.id);
  put(out, 68, fixed<std::uint16_t>(double{c.detection.confidence}, kConfidence, cut_off));
  return out;
}

engine::Expected<hil::Command> decode_uvc_command(std::span<const std::byte> in) noexcept {
  if (in.size() != kUvcCommandBytes) return rejected("length of a command");
  if (get<std::uint8_t>(in, 0) != kVersion) return rejected("version of a command");
  hil::Command c;
  c.kind = static_cast<hil::CommandKind>(get<std::uint8_t>(in, 1));
  if (!has_place(c.kind)) return rejected("kind of a command");
  const auto flags = get<std::uint8_t>(in, 2);
  if ((flags & ~kMoreFollow) != 0 || get<std::uint16_t>(in, 70) != 0)
    return rejected("reserved bits of a command");
  c.more_follow = (flags & kMoreFollow) != 0;
  const auto mode = get<std::uint8_t>(in, 3);
  if (mode >= hil::kGuidanceModes) return rejected("mode of a command");
  c.mode = static_cast<hil::GuidanceMode>(mode);
  c.time_to_live = Duration(std::int64_t{get<std::uint32_t>(in, 4)} * 1'000'000);
  c.sequence = get<std::uint64_t>(in, 8);
  c.answers_frame = get<std::uint64_t>(in, 16);
  c.made_at = time_at(in, 24);
  c.reference = time_at(in, 32);
  get_fixed(in, 40, c.trim_offset_rad, kNano);
  get_fixed(in, 48, c.trim_rate_rad_s, kNano);
  std::array<double, 2> centroid_px{};
  get_fixed(in, 56, centroid_px, kCentroid);
  c.detection.centroid_px = {centroid_px[0], centroid_px[1]};
  c.detection.id = get<std::uint32_t>(in, 64);
  c.detection.confidence = static_cast<float>(get<std::uint16_t>(in, 68) / kConfidence);
  return c;
}

UvcFrameBytes encode_uvc_frame(const UvcFrameNews& news) noexcept {
  UvcFrameBytes out{};
  bool cut_off = news.cut_off;
  put(out, 0, news.sequence);
  put(out, 8, ns(news.shutter_open));
  put(out, 16, std::int64_t{news.exposure.count()});
  put_fixed(out, 24, news.trim_rad, kNano, cut_off);
  put_fixed(out, 32, news.measured.j2000_to_camera, kQuaternion, cut_off);
  put_fixed(out, 48, news.measured.rate_rad_s, kNano, cut_off);
  put(out, 60, static_cast<std::uint8_t>(news.bits));
  put(out, 61, std::uint8_t{cut_off ? kCutOff : std::uint8_t{0}});
  put(out, 64, news.commands);
  return out;
}

UvcFrameNews decode_uvc_frame(std::span<const std::byte> in) noexcept {
  UvcFrameNews news;
  news.sequence = get<std::uint64_t>(in, 0);
  news.shutter_open = time_at(in, 8);
  news.exposure = Duration(get<std::int64_t>(in, 16));
  get_fixed(in, 24, news.trim_rad, kNano);
  get_fixed(in, 32, news.measured.j2000_to_camera, kQuaternion);
  get_fixed(in, 48, news.measured.rate_rad_s, kNano);
  news.bits = get<std::uint8_t>(in, 60);
  news.cut_off = (get<std::uint8_t>(in, 61) & kCutOff) != 0;
  news.commands = get<std::uint64_t>(in, 64);
  return news;
}

namespace {

/// In the order of the bytes.
constexpr std::uint64_t UvcCounts::*kCounts[] = {&UvcCounts::offered,
                                                 &UvcCounts::idle,
                                                 &UvcCounts::sent,
                                                 &UvcCounts::overtaken,
                                                 &UvcCounts::cut,
                                                 &UvcCounts::in_hand,
                                                 &UvcCounts::missed,
                                                 &UvcCounts::refused,
                                                 &UvcCounts::commands,
                                                 &UvcCounts::commands_lost,
                                                 &UvcCounts::stalled,
                                                 &UvcCounts::last_command,
                                                 &UvcCounts::first_sequence,
                                                 &UvcCounts::skipped,
                                                 &UvcCounts::dropped,
                                                 &UvcCounts::late};
static_assert(std::size(kCounts) * 8 == kUvcCountsBytes);
static_assert(sizeof(UvcCounts) == kUvcCountsBytes, "every count has its place");

}  // namespace

UvcCountsBytes encode_uvc_counts(const UvcCounts& counts) noexcept {
  UvcCountsBytes out{};
  for (std::size_t i = 0; i < std::size(kCounts); ++i) put(out, 8 * i, counts.*kCounts[i]);
  return out;
}

UvcCounts decode_uvc_counts(std::span<const std::byte> in) noexcept {
  UvcCounts counts;
  for (std::size_t i = 0; i < std::size(kCounts); ++i)
    counts.*kCounts[i] = get<std::uint64_t>(in, 8 * i);
  return counts;
}

std::array<std::byte, kPanTiltBytes> encode_pan_tilt(PanTilt p) noexcept {
  std::array<std::byte, kPanTiltBytes> out{};
  put(out, 0, p.pan_arcsec);
  put(out, 4, p.tilt_arcsec);
  return out;
}

engine::Expected<PanTilt> decode_pan_tilt(std::span<const std::byte> in) noexcept {
  const PanTilt p{get<std::int32_t>(in, 0), get<std::int32_t>(in, 4)};
  for (const std::int32_t angle : {p.pan_arcsec, p.tilt_arcsec})
    if (angle < -kMostPanTilt_arcsec || angle > kMostPanTilt_arcsec)
      return rejected("pan or tilt beyond half a turn");
  return p;
}

hil::TrimAngles trim_of(PanTilt p) noexcept {
  constexpr double kArcsec_rad = std::numbers::pi / (180 * 3600);
  return {p.pan_arcsec * kArcsec_rad, p.tilt_arcsec * kArcsec_rad};
}

}  // namespace drivers
