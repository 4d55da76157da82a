#include "tools/usb_device/hand_over.h"

#include <algorithm>
#include <cstring>
#include <utility>
#include <variant>

#include "drivers/pixel_packing.h"
#include "hil/telemetry_packet.h"

namespace usb_device {
namespace {

using engine::Duration;

constexpr Duration kPatience{50'000'000};
// Eight packed pixels are whole bytes.
constexpr std::size_t kGroup = 8;

/// What the camera said of itself behind the pixels.
void take_news(std::span<const std::byte> news, hil::Frame& frame) noexcept {
  while (news.size() > hil::kPrimaryHeaderBytes) {
    const std::size_t bytes = hil::packet_bytes(news);
    if (bytes > news.size()) return;
    if (const auto one = hil::decode_telemetry(news.first(bytes)); one.ok()) {
      if (const auto* f = std::get_if<hil::FrameNews>(&one.value())) frame.counts = f->counts;
      if (const auto* a = std::get_if<hil::AttitudeNews>(&one.value())) {
        frame.measured = a->measured;
        frame.trim_rad = a->trim_rad;
      }
    }
    news = news.subspan(bytes);
  }
}

}  // namespace

drivers::UsbLimits limits_of(const HandOverSpec& spec) {
  drivers::UsbLimits l;
  l.formats = 3;
  l.width_px = spec.width_px;
  l.height_px = spec.height_px + 1;
  l.payload_bytes = static_cast<std::uint32_t>(
      drivers::usb_payload_bytes(drivers::PixelFormat::kPlain16, l.width_px, l.height_px));
  l.frames = static_cast<unsigned>(spec.frames);
  return l;
}

HandOver::HandOver(const HandOverSpec& spec)
    : shm_({.name = spec.shm, .slots = spec.frames + 1}, spec.width_px, spec.height_px),
      picture_(spec.width_px, spec.height_px),
      rest_(kGroup + static_cast<std::size_t>(spec.width_px)) {}

void HandOver::take_frames(drivers::FrameIntake& intake) noexcept {
  for (auto f = intake.front(); f; f = intake.front()) {
    hand_over(*f);
    intake.pop();
  }
}

void HandOver::hand_over(const drivers::FrameIntake::Frame& f) noexcept {
  const drivers::UsbFrameHeader& h = f.header;
  ++counts_.frames;
  if (h.width_px != picture_.width() || h.height_px != picture_.height()) {
    ++counts_.other_sizes;
    return;
  }
  hil::Frame frame;
  frame.sequence = h.sequence;
  frame.shutter_open = h.shutter_open;
  frame.exposure = h.exposure;
  frame.bits = h.bits;
  frame.pixels = &picture_;
  frame.telemetry_row = unpack(f);
  take_news(f.payload.last(h.news_bytes), frame);
  ++(shm_.send(frame, Duration{}).ok() ? counts_.taken : counts_.not_taken);
}

std::span<const std::uint16_t> HandOver::unpack(const drivers::FrameIntake::Frame& f) noexcept {
  const std::span<std::uint16_t> image = picture_.pixels();
  const std::size_t odd = image.size() % kGroup;
  const std::span<std::uint16_t> groups = image.first(image.size() - odd);
  const std::span<std::uint16_t> rest =
      std::span(rest_).first(odd + static_cast<std::size_t>(f.header.width_px) *
                                       static_cast<std::size_t>(f.header.rows_below));
  if (f.header.format == drivers::PixelFormat::kPacked11) {
    const std::size_t bytes = drivers::packed_bytes(groups.size());
    drivers::unpack_pixels(f.payload.first(bytes), groups);
    drivers::unpack_pixels(f.payload.subspan(bytes, drivers::packed_bytes(rest.size())), rest);
  } else {
    std::memcpy(groups.data(), f.payload.data(), groups.size_bytes());
    std::memcpy(rest.data(), f.payload.data() + groups.size_bytes(), rest.size_bytes());
  }
  std::copy_n(rest.begin(), odd, image.end() - static_cast<std::ptrdiff_t>(odd));
  return rest.subspan(odd);
}

std::jthread HandOver::return_commands(TakeCommand take) {
  return std::jthread([this, take = std::move(take)](const std::stop_token& stop) {
    while (!stop.stop_requested()) {
      const auto command = shm_.receive(kPatience);
      if (command.ok()) {
        take(hil::encode_command(command.value()));
      } else if (command.error().fault == engine::Fault::kDisconnected) {
        std::this_thread::sleep_for(kPatience);
      }
    }
  });
}

}  // namespace usb_device
