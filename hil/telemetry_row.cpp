#include "hil/telemetry_row.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>

#include "engine/core/crc32c.h"

namespace hil {
namespace {

using engine::Duration;
using engine::Error;
using engine::Fault;
using engine::SimTime;

static_assert(std::endian::native == std::endian::little, "the row is written as it lies");

using Bytes = std::array<std::byte, kTelemetryRowPixels>;

constexpr char kMagic[4] = {'S', 'L', 'T', 'R'};
constexpr std::byte kVersion{2};
constexpr std::size_t kImageCrcAt = 48;
constexpr std::size_t kCrcAt = 52;

std::int64_t ns(SimTime t) noexcept { return t.time_since_epoch().count(); }

template <class T>
void put(Bytes& out, std::size_t at, const T& value) noexcept {
  std::memcpy(out.data() + at, &value, sizeof value);
}

template <class T>
[[nodiscard]] T get(const Bytes& in, std::size_t at) noexcept {
  T value{};
  std::memcpy(&value, in.data() + at, sizeof value);
  return value;
}

SimTime time_at(const Bytes& in, std::size_t at) noexcept {
  return SimTime(Duration(get<std::int64_t>(in, at)));
}

Error rejected(const char* step) noexcept { return {Fault::kRejected, 0, step}; }

}  // namespace

TelemetryRow telemetry_of(const Frame& frame, std::uint64_t link_sequence) noexcept {
  return {.frame_id = frame.sequence,
          .exposure_start = frame.shutter_open,
          .exposure_middle = frame.shutter_open + frame.exposure / 2,
          .exposure_end = frame.shutter_open + frame.exposure,
          .link_sequence = link_sequence,
          .image_crc32c = engine::crc32c(std::as_bytes(frame.pixels->pixels()))};
}

engine::Status encode_telemetry_row(const TelemetryRow& telemetry,
                                    std::span<std::uint16_t> row) noexcept {
  if (row.size() < kTelemetryRowPixels)
    return rejected("a telemetry row needs a camera at least 56 pixels wide");
  Bytes bytes{};
  put(bytes, 0, kMagic);
  bytes[4] = kVersion;
  bytes[5] = std::byte{kTelemetryRowPixels};
  put(bytes, 8, telemetry.frame_id);
  put(bytes, 16, ns(telemetry.exposure_start));
  put(bytes, 24, ns(telemetry.exposure_middle));
  put(bytes, 32, ns(telemetry.exposure_end));
  put(bytes, 40, telemetry.link_sequence);
  put(bytes, kImageCrcAt, telemetry.image_crc32c);
  put(bytes, kCrcAt, engine::crc32c(std::span(bytes).first(kCrcAt)));
  const auto rest = std::transform(bytes.begin(), bytes.end(), row.begin(),
                                   [](std::byte b) { return static_cast<std::uint16_t>(b); });
  std::fill(rest, row.end(), std::uint16_t{0});
  return engine::Done{};
}

engine::Expected<TelemetryRow> decode_telemetry_row(std::span<const std::uint16_t> row) noexcept {
  if (row.size() < kTelemetryRowPixels) return rejected("width of a telemetry row");
  const auto used = row.first(kTelemetryRowPixels);
  const auto rest = row.subspan(kTelemetryRowPixels);
  if (std::any_of(used.begin(), used.end(), [](std::uint16_t dn) { return dn > 255; }) ||
      std::any_of(rest.begin(), rest.end(), [](std::uint16_t dn) { return dn != 0; })) {
    return rejected("a pixel that no telemetry row has");
  }
  Bytes bytes{};
  std::transform(used.begin(), used.end(), bytes.begin(),
                 [](std::uint16_t dn) { return static_cast<std::byte>(dn); });
  if (std::memcmp(bytes.data(), kMagic, sizeof kMagic) != 0) return rejected("magic of the row");
  if (get<std::uint32_t>(bytes, kCrcAt) != engine::crc32c(std::span(bytes).first(kCrcAt)))
    return rejected("checksum of the row");
  if (bytes[4] != kVersion || bytes[5] != std::byte{kTelemetryRowPixels})
    return rejected("version of the row");
  return TelemetryRow{.frame_id = get<std::uint64_t>(bytes, 8),
                      .exposure_start = time_at(bytes, 16),
                      .exposure_middle = time_at(bytes, 24),
                      .exposure_end = time_at(bytes, 32),
                      .link_sequence = get<std::uint64_t>(bytes, 40),
                      .image_crc32c = get<std::uint32_t>(bytes, kImageCrcAt)};
}

}  // namespace hil
