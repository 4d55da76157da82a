#include "drivers/usb_device/uvc_stream.h"

#include <algorithm>
#include <cstring>
#include <utility>

#include <linux/usb/video.h>

#include "drivers/little_endian.h"

namespace drivers {
namespace {

// A camera that was away for longer than this many frames is not counted frame by frame.
constexpr std::uint64_t kMostFailed = 63;
// What a frame that failed consists of: a host counts none without any.
constexpr std::array<std::byte, 2> kFailed{};
constexpr std::byte kNoColour{0x80};

std::uint16_t pixel(std::span<const std::byte> in, std::size_t i) noexcept {
  return get<std::uint16_t>(in, 2 * i);
}

/// Rows of brightness, and of no colour behind each where pixels have two bytes. Returns where it
/// ended.
template <std::size_t kPixelBytes>
std::byte* put_rows(std::span<const std::byte> in, int down, std::size_t width,
                    std::byte* out) noexcept {
  const std::size_t pixels = in.size() / 2;
  for (std::size_t start = 0; start < pixels; start += width) {
    for (std::size_t u = 0; u < width; ++u, out += kPixelBytes) {
      out[0] = static_cast<std::byte>(pixel(in, start + u) >> down);
      if constexpr (kPixelBytes == 2) out[1] = kNoColour;
    }
    if (kPixelBytes == 2 && width % 2 != 0) {
      *out++ = std::byte{0};
      *out++ = kNoColour;
    }
  }
  return out;
}

}  // namespace

void uvc_pixels(const UvcSpec& spec, UvcFormat format, const FrameView& frame,
                std::span<std::byte> out) noexcept {
  if (format == UvcFormat::kY16) {
    const auto rest = std::copy(frame.pixels.begin(), frame.pixels.end(), out.begin());
    std::copy(frame.telemetry_row.begin(), frame.telemetry_row.end(), rest);
    return;
  }
  const auto put = format == UvcFormat::kY8 ? put_rows<1> : put_rows<2>;
  const auto width = static_cast<std::size_t>(spec.width_px);
  std::byte* row = put(frame.pixels, std::max(0, spec.bits - 8), width, out.data());
  put(frame.telemetry_row, 0, width, row);
}

UvcStream::UvcStream(const UvcSpec& spec) : spec_(spec) {
  ENSURE(spec.payload_bytes >= kHeaderBytes + kFailed.size());
}

void UvcStream::commit(UvcFormat format) {
  stop();
  committed_ = true;
  format_ = format;
  const std::uint32_t bytes = uvc_frame_size(spec_, format).bytes;
  next_.bytes.resize(bytes);
  now_.bytes.resize(bytes);
}

void UvcStream::stop() noexcept {
  counts_.cut += in_hand();
  next_.full = now_.full = false;
  in_payload_ = owes_empty_ = streaming_ = false;
  failed_left_ = 0;
  last_begun_ = first_sequence_ = kNone;
}

void UvcStream::reset() noexcept {
  stop();
  committed_ = false;
}

void UvcStream::offer(const FrameView& frame) noexcept {
  const std::uint64_t sequence = frame.frame.sequence;
  ++counts_.offered;
  if (last_offered_ != kNone && sequence > last_offered_)
    counts_.missed += sequence - last_offered_ - 1;
  last_offered_ = sequence;
  if (!streaming_) {
    ++counts_.idle;
    return;
  }
  if (next_.full) ++counts_.overtaken;
  constexpr std::int64_t kTick_ns = 1'000'000'000 / kUvcClock_hz;
  next_.full = true;
  next_.sequence = sequence;
  next_.time =
      static_cast<std::uint32_t>(frame.frame.shutter_open.time_since_epoch().count() / kTick_ns);
  uvc_pixels(spec_, format_, frame, next_.bytes);
}

std::optional<UsbAnswer> UvcStream::give(std::size_t room) noexcept {
  if (!committed_) return std::nullopt;
  streaming_ = true;
  if (owes_empty_) {
    owes_empty_ = false;
    return UsbAnswer{};
  }
  if (!in_payload_) {
    if (!now_.full && !next_.full) return std::nullopt;
    if (!now_.full) begin_frame();
    begin_payload();
  }
  UsbAnswer answer;
  const std::size_t total = kHeaderBytes + data_.size();
  const std::size_t n = std::min(room, total - payload_out_);
  const std::size_t header_out = std::min(payload_out_, kHeaderBytes);
  answer.head = std::span(header_).subspan(header_out, std::min(n, kHeaderBytes - header_out));
  answer.data = data_.subspan(payload_out_ - header_out, n - answer.head.size());
  payload_out_ += n;
  if (payload_out_ == total) {
    owes_empty_ = n == room && total < spec_.payload_bytes;
    end_payload();
  }
  return answer;
}

void UvcStream::begin_frame() noexcept {
  std::swap(now_, next_);
  next_.full = false;
  frame_out_ = 0;
  const bool goes_on = last_begun_ != kNone && now_.sequence > last_begun_;
  const std::uint64_t missing = goes_on ? now_.sequence - last_begun_ - 1 : 0;
  failed_left_ = std::min(missing, kMostFailed);
  if (first_sequence_ == kNone) {
    first_sequence_ = now_.sequence;
  } else {
    // What the host has not been told of, one way or the other.
    first_sequence_ += goes_on ? missing - failed_left_ : now_.sequence - last_begun_ - 1;
  }
  last_begun_ = now_.sequence;
  toggle_ = !toggle_;
}

void UvcStream::begin_payload() noexcept {
  const std::span<const std::byte> frame(now_.bytes);
  const std::size_t most = spec_.payload_bytes - kHeaderBytes;
  unsigned flags = UVC_STREAM_EOH | UVC_STREAM_PTS | (toggle_ ? UVC_STREAM_FID : 0U);
  if (failed_left_ > 0) {
    flags |= UVC_STREAM_ERR | UVC_STREAM_EOF;
    data_ = kFailed;
  } else {
    data_ = frame.subspan(frame_out_, std::min(most, frame.size() - frame_out_));
    if (frame_out_ + data_.size() == frame.size()) flags |= UVC_STREAM_EOF;
  }
  header_[0] = std::byte{kHeaderBytes};
  header_[1] = static_cast<std::byte>(flags);
  put(header_, 2, now_.time);
  payload_out_ = 0;
  in_payload_ = true;
}

void UvcStream::end_payload() noexcept {
  in_payload_ = false;
  if (failed_left_ > 0) {
    --failed_left_;
    toggle_ = !toggle_;
    return;
  }
  frame_out_ += data_.size();
  if (frame_out_ < now_.bytes.size()) return;
  now_.full = false;
  ++counts_.sent;
}

}  // namespace drivers
