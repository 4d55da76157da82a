#include "drivers/usb_device/uvc_camera.h"

#include <algorithm>
#include <limits>
#include <utility>

#include <linux/usb/video.h>

#include "drivers/little_endian.h"

namespace drivers {
namespace {

constexpr std::uint64_t kNewest = std::numeric_limits<std::uint64_t>::max();
constexpr unsigned kGet = UVC_CONTROL_CAP_GET;
constexpr unsigned kGetSet = UVC_CONTROL_CAP_GET | UVC_CONTROL_CAP_SET;
constexpr unsigned kNews = UVC_CONTROL_CAP_GET | UVC_CONTROL_CAP_AUTOUPDATE;
// Of probe and commit: UVC 1.0, and 1.1.
constexpr std::size_t kOldProbeBytes = 26;
constexpr std::size_t kProbeBytes = 34;

template <class Array>
std::vector<std::byte> bytes_of(const Array& values) {
  return {values.begin(), values.end()};
}

template <class T>
std::vector<std::byte> number(T value) {
  std::vector<std::byte> out(sizeof value);
  put(std::span(out), 0, value);
  return out;
}

std::vector<std::byte> filled(std::size_t bytes, unsigned value) {
  return std::vector<std::byte>(bytes, static_cast<std::byte>(value));
}

/// A command with all its fields at one end, for hosts that map single fields as controls.
hil::Command extreme(bool most) {
  using Limits = std::numeric_limits<std::int32_t>;
  const double angle_rad = (most ? Limits::max() : Limits::min()) * 1e-9;
  const double centroid_px = (most ? Limits::max() : Limits::min()) / 65536.0;
  constexpr auto kAll = std::numeric_limits<std::uint64_t>::max();
  using Times = std::numeric_limits<std::int64_t>;
  hil::Command c;
  c.kind = most ? hil::CommandKind::kTrigger : hil::CommandKind::kReport;
  c.mode = most ? hil::GuidanceMode::kCommanded : hil::GuidanceMode::kPredictedTarget;
  c.more_follow = most;
  c.sequence = c.answers_frame = most ? kAll : 0;
  c.time_to_live = engine::Duration(most ? Times::max() : 0);
  c.made_at = c.reference = engine::SimTime(engine::Duration(most ? Times::max() : Times::min()));
  c.trim_offset_rad = c.trim_rate_rad_s = {angle_rad, angle_rad};
  c.detection.centroid_px = {centroid_px, centroid_px};
  c.detection.confidence = most ? 1.0F : 0.0F;
  c.detection.id = most ? std::numeric_limits<std::uint32_t>::max() : 0;
  return c;
}

}  // namespace

UvcCamera::UvcCamera(const UvcSpec& spec, Obey obey)
    : spec_(spec), obey_(std::move(obey)), descriptors_(uvc_descriptors(spec)), stream_(spec) {
  reset();
}

void UvcCamera::reset() {
  stream_.reset();
  probed_ = committed_ = UvcFormat::kY16;
  hint_ = 0;
  pan_tilt_ = {};
  command_ = encode_uvc_command({});
  select_ = kNewest;
  refusal_ = Refusal::kNone;
}

bool UvcCamera::offer(const FrameView& frame) noexcept {
  const std::size_t row = 2 * static_cast<std::size_t>(spec_.width_px);
  const bool same = frame.width_px == spec_.width_px && frame.height_px == spec_.height_px &&
                    frame.frame.bits == spec_.bits &&
                    frame.pixels.size() == row * static_cast<std::size_t>(spec_.height_px) &&
                    frame.telemetry_row.size() == row * static_cast<std::size_t>(spec_.rows_below);
  if (!same) {
    ++counts_.refused;
    return false;
  }
  news_[newest_++ % kRemembered] = {.sequence = frame.frame.sequence,
                                    .shutter_open = frame.frame.shutter_open,
                                    .exposure = frame.frame.exposure,
                                    .bits = frame.frame.bits,
                                    .trim_rad = frame.frame.trim_rad,
                                    .measured = frame.frame.measured,
                                    .commands = frame.frame.counts.commands};
  counts_.skipped = frame.frame.counts.skipped;
  counts_.dropped = frame.frame.counts.dropped;
  counts_.late = frame.frame.counts.late;
  stream_.offer(frame);
  return true;
}

UvcCounts UvcCamera::counts() const noexcept {
  UvcCounts c = counts_;
  const UvcStream::Counts& s = stream_.counts();
  c.offered = s.offered;
  c.idle = s.idle;
  c.sent = s.sent;
  c.overtaken = s.overtaken;
  c.cut = s.cut;
  c.missed = s.missed;
  c.in_hand = stream_.in_hand();
  c.first_sequence = stream_.first_sequence();
  return c;
}

UvcFrameNews UvcCamera::selected() const noexcept {
  if (newest_ == 0) return {};
  if (select_ == kNewest) return news_[(newest_ - 1) % kRemembered];
  // The latest one of that number: a source may have begun again.
  const std::uint64_t oldest = newest_ - std::min<std::uint64_t>(newest_, kRemembered);
  for (std::uint64_t i = newest_; i-- > oldest;)
    if (news_[i % kRemembered].sequence == select_) return news_[i % kRemembered];
  return {};
}

// ---- Requests ----------------------------------------------------------------------------------

std::optional<std::vector<std::byte>> UvcCamera::control(const UsbSetup& setup,
                                                         std::span<const std::byte> data) {
  Bytes out;
  // Asking for the error code does not change it.
  const bool asks_why = setup.type == 0xA1 && setup.index == kUvcControlInterface &&
                        setup.value == UVC_VC_REQUEST_ERROR_CODE_CONTROL << 8;
  const Refusal refusal = answer(setup, data, out);
  if (!asks_why) refusal_ = refusal;
  if (refusal == Refusal::kNone) return out;
  ++counts_.stalled;
  return std::nullopt;
}

UvcCamera::Refusal UvcCamera::answer(const UsbSetup& setup, std::span<const std::byte> data,
                                     Bytes& out) {
  constexpr unsigned kFromInterface = 0xA1;
  constexpr unsigned kToInterface = 0x21;
  const Place place{setup.index & 0xFFU, unsigned{setup.index} >> 8, unsigned{setup.value} >> 8};
  Control control;
  if (const Refusal refusal = find(place, control); refusal != Refusal::kNone) return refusal;
  if ((setup.value & 0xFFU) != 0) return Refusal::kControl;
  if (setup.type == kToInterface) {
    const bool can = setup.request == UVC_SET_CUR && (control.info & UVC_CONTROL_CAP_SET) != 0;
    return can ? set(place, data) : Refusal::kRequest;
  }
  if (setup.type != kFromInterface) return Refusal::kRequest;
  switch (setup.request) {
    case UVC_GET_INFO:
      out = number(static_cast<std::uint8_t>(control.info));
      break;
    case UVC_GET_LEN:
      out = number(static_cast<std::uint16_t>(control.current.size()));
      break;
    case UVC_GET_CUR:
      out = std::move(control.current);
      break;
    case UVC_GET_MIN:
      out = std::move(control.least);
      break;
    case UVC_GET_MAX:
      out = std::move(control.most);
      break;
    case UVC_GET_RES:
      out = std::move(control.step);
      break;
    case UVC_GET_DEF:
      out = std::move(control.first);
      break;
    default:
      break;
  }
  return out.empty() ? Refusal::kRequest : Refusal::kNone;
}

UvcCamera::Refusal UvcCamera::find(const Place& place, Control& out) const {
  if (place.interface == kUvcStreamInterface) {
    if (place.entity != 0) return Refusal::kUnit;
    if (place.selector != UVC_VS_PROBE_CONTROL && place.selector != UVC_VS_COMMIT_CONTROL)
      return Refusal::kControl;
    out = stream_control(place.selector);
    return Refusal::kNone;
  }
  if (place.interface != kUvcControlInterface) return Refusal::kUnit;
  switch (place.entity) {
    case 0:
      if (place.selector != UVC_VC_REQUEST_ERROR_CODE_CONTROL) return Refusal::kControl;
      out.info = kGet;
      out.current = number(refusal_);
      return Refusal::kNone;
    case kUvcCameraTerminal:
      if (place.selector != UVC_CT_PANTILT_ABSOLUTE_CONTROL) return Refusal::kControl;
      out.info = kGetSet;
      out.current = bytes_of(encode_pan_tilt(pan_tilt_));
      out.least = bytes_of(encode_pan_tilt({-kMostPanTilt_arcsec, -kMostPanTilt_arcsec}));
      out.most = bytes_of(encode_pan_tilt({kMostPanTilt_arcsec, kMostPanTilt_arcsec}));
      out.step = bytes_of(encode_pan_tilt({1, 1}));
      out.first = bytes_of(encode_pan_tilt({}));
      return Refusal::kNone;
    case kUvcExtensionUnit:
      if (place.selector == 0 || place.selector > kUvcSelectors) return Refusal::kControl;
      out = unit_control(static_cast<UvcSelector>(place.selector));
      return Refusal::kNone;
    case kUvcOutputTerminal:
      return Refusal::kControl;
    default:
      return Refusal::kUnit;
  }
}

UvcCamera::Control UvcCamera::unit_control(UvcSelector selector) const {
  const auto raw = [](unsigned info, const auto& current) {
    Control c;
    c.info = info;
    c.current = c.first = bytes_of(current);
    c.least = filled(c.current.size(), 0);
    c.most = filled(c.current.size(), 0xFF);
    c.step = filled(c.current.size(), 0);
    return c;
  };
  switch (selector) {
    case UvcSelector::kCommand: {
      Control c = raw(kGetSet, command_);
      c.first = bytes_of(encode_uvc_command({}));
      c.least = bytes_of(encode_uvc_command(extreme(false)));
      c.most = bytes_of(encode_uvc_command(extreme(true)));
      return c;
    }
    case UvcSelector::kFrame:
      return raw(kNews, encode_uvc_frame(selected()));
    case UvcSelector::kSelect: {
      Control c = raw(kGetSet, number(select_));
      c.first = number(kNewest);
      return c;
    }
    case UvcSelector::kCounts:
      break;
  }
  return raw(kNews, encode_uvc_counts(counts()));
}

UvcCamera::Refusal UvcCamera::set(const Place& place, std::span<const std::byte> data) {
  if (place.interface == kUvcStreamInterface) return set_stream(place.selector, data);
  if (place.entity == kUvcCameraTerminal) {
    if (data.size() != kPanTiltBytes) return Refusal::kRequest;
    const engine::Expected<PanTilt> wanted = decode_pan_tilt(data);
    if (!wanted.ok()) return Refusal::kOutOfRange;
    hil::Command command;
    command.kind = hil::CommandKind::kTrim;
    command.trim_offset_rad = trim_of(wanted.value());
    if (newest_ > 0) {
      const UvcFrameNews& newest = news_[(newest_ - 1) % kRemembered];
      command.made_at = command.reference = newest.shutter_open + newest.exposure;
    }
    const Refusal refusal = pass_on(command);
    if (refusal == Refusal::kNone) pan_tilt_ = wanted.value();
    return refusal;
  }
  if (place.selector == static_cast<unsigned>(UvcSelector::kSelect)) {
    if (data.size() != sizeof select_) return Refusal::kRequest;
    select_ = get<std::uint64_t>(data, 0);
    return Refusal::kNone;
  }
  if (data.size() != kUvcCommandBytes) return Refusal::kRequest;
  const engine::Expected<hil::Command> command = decode_uvc_command(data);
  if (!command.ok()) return Refusal::kOutOfRange;
  const Refusal refusal = pass_on(command.value());
  if (refusal != Refusal::kNone) return refusal;
  counts_.last_command = command.value().sequence;
  std::copy(data.begin(), data.end(), command_.begin());
  return refusal;
}

UvcCamera::Refusal UvcCamera::pass_on(const hil::Command& command) {
  const bool obeyed = obey_(command);
  ++(obeyed ? counts_.commands : counts_.commands_lost);
  return obeyed ? Refusal::kNone : Refusal::kNotReady;
}

// ---- The stream --------------------------------------------------------------------------------

UvcCamera::Bytes UvcCamera::probe_bytes(UvcFormat format) const {
  constexpr unsigned kFramesTold = 3;  // headers say which frame they are of, and where it ends
  Bytes out(kProbeBytes);
  const std::span<std::byte> p(out);
  put(p, 0, hint_);
  put(p, 2, static_cast<std::uint8_t>(format));
  put(p, 3, std::uint8_t{1});  // the frame size
  put(p, 4, uvc_interval(spec_));
  put(p, 18, uvc_frame_size(spec_, format).bytes);
  put(p, 22, spec_.payload_bytes);
  put(p, 26, kUvcClock_hz);
  put(p, 30, static_cast<std::uint8_t>(kFramesTold));
  return out;
}

UvcCamera::Control UvcCamera::stream_control(unsigned selector) const {
  Control c;
  c.info = kGetSet;
  if (selector == UVC_VS_COMMIT_CONTROL) {
    c.current = probe_bytes(committed_);
    return c;
  }
  c.current = c.least = c.most = probe_bytes(probed_);
  c.step = filled(kProbeBytes, 0);
  c.first = probe_bytes(UvcFormat::kY16);
  return c;
}

UvcCamera::Refusal UvcCamera::set_stream(unsigned selector, std::span<const std::byte> data) {
  if (data.size() != kProbeBytes && data.size() != kOldProbeBytes) return Refusal::kRequest;
  const auto format = get<std::uint8_t>(data, 2);
  const bool known = format >= 1 && format <= kUvcFormats;
  if (selector == UVC_VS_COMMIT_CONTROL) {
    if (!known || get<std::uint8_t>(data, 3) != 1) return Refusal::kOutOfRange;
    committed_ = static_cast<UvcFormat>(format);
    stream_.commit(committed_);
    return Refusal::kNone;
  }
  // A probe asks for what there is: the nearest to it.
  hint_ = get<std::uint16_t>(data, 0);
  probed_ = known ? static_cast<UvcFormat>(format) : UvcFormat::kY16;
  return Refusal::kNone;
}

void UvcCamera::take(unsigned /*endpoint*/, std::span<const std::byte> /*bytes*/, bool /*ends*/) {}

std::optional<UsbAnswer> UvcCamera::give(unsigned /*endpoint*/, std::size_t room) {
  return stream_.give(room);
}

void UvcCamera::clear_halt(unsigned /*address*/) { stream_.stop(); }

}  // namespace drivers
