#include "drivers/usb_link.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <mutex>
#include <stdexcept>
#include <utility>

#include "drivers/usb_port.h"
#include "hil/steady_clock.h"

namespace drivers {
namespace {

using engine::Done;
using engine::Duration;
using engine::Error;
using engine::Fault;
using engine::Status;
using std::chrono::milliseconds;

constexpr milliseconds kLookAgain{100};
constexpr unsigned kLooksToRenew = 3;

Duration now() noexcept { return hil::SteadyClock::stopwatch(); }

/// Of a control request. Zero would be for ever.
unsigned patience_ms(Duration timeout) noexcept {
  return static_cast<unsigned>(
      std::clamp<std::int64_t>(timeout / milliseconds(1), 10, kUsbControlTimeout_ms));
}

Error error_of(int code, const char* step) noexcept {
  switch (code) {
    case LIBUSB_ERROR_NO_DEVICE:
    case LIBUSB_ERROR_NOT_FOUND:
      return {Fault::kDisconnected, code, step};
    case LIBUSB_ERROR_TIMEOUT:
      return {Fault::kTimeout, code, step};
    case LIBUSB_ERROR_PIPE:
    case LIBUSB_ERROR_OVERFLOW:
      return {Fault::kRejected, code, step};
    default:
      return {Fault::kSystem, code, step};
  }
}

Error error_of(libusb_transfer_status status) noexcept {
  switch (status) {
    case LIBUSB_TRANSFER_NO_DEVICE:
      return {Fault::kDisconnected, status, "usb: the device is gone"};
    case LIBUSB_TRANSFER_CANCELLED:
    case LIBUSB_TRANSFER_TIMED_OUT:
      return {Fault::kTimeout, status, "usb: the frame did not go out in time"};
    case LIBUSB_TRANSFER_STALL:
      return {Fault::kRejected, status, "usb: the device stalled"};
    case LIBUSB_TRANSFER_COMPLETED:
      return {Fault::kRejected, status, "usb: a transfer was cut short"};
    default:
      return {Fault::kSystem, status, "usb: transfer"};
  }
}

}  // namespace

UsbLink::UsbLink(const UsbSpec& spec, int width_px, int rows, int bits)
    : spec_(spec),
      width_px_(width_px),
      rows_(rows),
      bits_(spec.packed ? bits : 16),
      device_(std::make_unique<UsbPort>(packets_)),
      frame_(kUsbHeaderBytes + usb_payload_bytes(PixelFormat::kPlain16, width_px, rows)) {
  if (const int code = libusb_init(&device_->context); code != 0)
    throw std::runtime_error(std::string("libusb: ") + libusb_strerror(code));
  device_->session = static_cast<std::uint32_t>(now().count());
  const std::string problem = device_->try_open(spec_, width_px_, rows_, bits_);
  if (!problem.empty() && !device_->connected) throw std::runtime_error(problem);
  keeper_ = std::jthread([this](const std::stop_token& stop) { keep(stop); });
}

UsbLink::~UsbLink() = default;

bool UsbLink::has_reader() const noexcept { return device_->connected; }

UsbCounts UsbLink::counts() const {
  const std::lock_guard lock(device_->mutex);
  return device_->counts;
}

/// Serves libusb, and puts the device back when it is gone.
void UsbLink::keep(const std::stop_token& stop) noexcept {
  UsbPort& d = *device_;
  unsigned looks = 0;
  while (!stop.stop_requested()) {
    if (!d.connected) {
      const std::lock_guard use(d.in_use);
      d.close();
      if (++looks % kLooksToRenew == 0) d.renew();
      try {
        static_cast<void>(d.try_open(spec_, width_px_, rows_, bits_));
      } catch (const std::exception&) {  // no memory: as if nothing were there
        d.close();
      }
    }
    if (!d.connected) {
      std::this_thread::sleep_for(kLookAgain);
      continue;
    }
    d.handle_events(kUsbLook);
    d.submit_idle_in();
    bool gone = false;
    {
      const std::lock_guard lock(d.mutex);
      gone = d.gone;
    }
    // A sender in the middle of a frame is told by its transfers, and then lets go.
    if (gone && d.in_use.try_lock()) {
      d.close();
      d.in_use.unlock();
    }
  }
  const std::lock_guard use(d.in_use);
  d.close();
}

Status UsbLink::send(const hil::Frame& frame, Duration timeout) noexcept {
  UsbPort& d = *device_;
  const Duration deadline = now() + timeout;
  const std::unique_lock use(d.in_use, std::try_to_lock);
  if (!use.owns_lock() || !d.connected) {
    in_step_ = false;
    return Error{Fault::kDisconnected, 0, "usb: no device"};
  }
  // Unplugged and back between two frames: the device knows nothing of the session.
  if (const std::uint64_t connection = counts().connections; session_of_connection_ != connection) {
    session_of_connection_ = connection;
    in_step_ = false;
  }
  if (std::exchange(starved_, false) && in_step_) ask_status(deadline - now());
  if (!in_step_) {
    if (const Status begun = begin_session(deadline - now()); !begun.ok()) return begun;
  }
  if (const Status may = wait_for_credit(deadline); !may.ok()) return may;
  const auto bytes = encode_usb_frame(frame, d.format, frame_);
  if (!bytes.ok()) return bytes.error();
  if (bytes.value() > d.out.size() * kUsbTransferBytes)
    return Error{Fault::kRejected, 0, "usb: a frame larger than the camera's"};
  ++begun_;
  const Status sent = transfer(bytes.value(), deadline);
  if (!sent.ok()) in_step_ = false;
  return sent;
}

Status UsbLink::begin_session(Duration timeout) noexcept {
  UsbPort& d = *device_;
  bool halted = false;
  std::uint32_t session = 0;
  {
    const std::lock_guard lock(d.mutex);
    session = ++d.session;
    d.counts.device = {};
    ++d.counts.resets;
    halted = std::exchange(d.out_halted, false);
    if (halted) ++d.counts.halts;
  }
  begun_ = 0;
  if (halted) {
    if (const int code = libusb_clear_halt(d.handle, d.place.out); code != 0)
      return error_of(code, "usb: clear a halt");
  }
  std::array<unsigned char, sizeof session> bytes{};
  std::memcpy(bytes.data(), &session, sizeof session);
  const int code =
      libusb_control_transfer(d.handle, kUsbTell, static_cast<std::uint8_t>(UsbRequest::kReset), 0,
                              static_cast<std::uint16_t>(d.place.interface), bytes.data(),
                              static_cast<std::uint16_t>(bytes.size()), patience_ms(timeout));
  if (code < 0) {
    if (code == LIBUSB_ERROR_NO_DEVICE) {
      const std::lock_guard lock(d.mutex);
      d.gone = true;
    }
    return error_of(code, "usb: begin a session");
  }
  in_step_ = true;
  return Done{};
}

void UsbLink::ask_status(Duration timeout) noexcept {
  UsbPort& d = *device_;
  {
    const std::lock_guard lock(d.mutex);
    if (d.gone || d.counts.device.credits > begun_) return;  // the news were only late
    ++d.counts.status_requests;
  }
  std::array<unsigned char, kLargestUsbMessage> bytes{};
  const int n =
      libusb_control_transfer(d.handle, kUsbAsk, static_cast<std::uint8_t>(UsbRequest::kStatus), 0,
                              static_cast<std::uint16_t>(d.place.interface), bytes.data(),
                              static_cast<std::uint16_t>(bytes.size()), patience_ms(timeout));
  if (n == LIBUSB_ERROR_NO_DEVICE) {
    const std::lock_guard lock(d.mutex);
    d.gone = true;
  }
  // An answer of another session: the device was started anew, and waits for a reset.
  if (n > 0 && !d.take_message(std::as_bytes(std::span(bytes)).first(static_cast<std::size_t>(n))))
    in_step_ = false;
}

Status UsbLink::wait_for_credit(Duration deadline) noexcept {
  UsbPort& d = *device_;
  std::unique_lock lock(d.mutex);
  const bool may = d.news.wait_for(lock, std::max(Duration{}, deadline - now()),
                                   [&] { return d.gone || d.counts.device.credits > begun_; });
  if (d.gone) return Error{Fault::kDisconnected, 0, "usb: the device is gone"};
  if (may) return Done{};
  starved_ = true;
  return Error{Fault::kBusy, 0, "usb: the device has no room"};
}

Status UsbLink::transfer(std::size_t bytes, Duration deadline) noexcept {
  UsbPort& d = *device_;
  {
    const std::lock_guard lock(d.mutex);
    d.out_failed = false;
    d.out_failure = LIBUSB_TRANSFER_COMPLETED;
  }
  int refused = 0;
  std::size_t at = 0;
  for (std::size_t i = 0; at < bytes && refused == 0; ++i) {
    libusb_transfer* t = d.out[i];
    const std::size_t n = std::min(kUsbTransferBytes, bytes - at);
    libusb_fill_bulk_transfer(
        t, d.handle, d.place.out, reinterpret_cast<unsigned char*>(frame_.data() + at),
        static_cast<int>(n),
        [](libusb_transfer* ended) { static_cast<UsbPort*>(ended->user_data)->out_ended(ended); },
        &d, 0);
    at += n;
    // The end of a frame is always a short packet.
    t->flags = at == bytes ? LIBUSB_TRANSFER_ADD_ZERO_PACKET : 0;
    {
      const std::lock_guard lock(d.mutex);
      ++d.out_pending;
    }
    refused = libusb_submit_transfer(t);
    if (refused != 0) {
      const std::lock_guard lock(d.mutex);
      --d.out_pending;
    }
  }
  const auto ended = [&d] { return d.out_pending == 0; };
  std::unique_lock lock(d.mutex);
  if (refused == 0)
    d.news.wait_for(lock, std::max(Duration{}, deadline - now()),
                    [&] { return ended() || d.out_failed; });
  if (!ended()) {
    lock.unlock();
    for (libusb_transfer* t : d.out) static_cast<void>(libusb_cancel_transfer(t));
    lock.lock();
    if (!d.news.wait_for(lock, kUsbDrain, ended)) d.gone = true;
  }
  if (refused == LIBUSB_ERROR_NO_DEVICE) d.gone = true;
  if (refused != 0) return error_of(refused, "usb: submit a transfer");
  if (d.out_failed) return error_of(d.out_failure);
  return Done{};
}

}  // namespace drivers
