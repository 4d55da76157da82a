#include "drivers/usb_port.h"

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "hil/steady_clock.h"

namespace drivers {
namespace {

using engine::Duration;
using std::chrono::milliseconds;

Duration now() noexcept { return hil::SteadyClock::stopwatch(); }

bool find_place(libusb_device* device, UsbPlace& place) noexcept {
  libusb_config_descriptor* config = nullptr;
  if (libusb_get_active_config_descriptor(device, &config) != 0) return false;
  bool found = false;
  for (int i = 0; i < config->bNumInterfaces && !found; ++i) {
    if (config->interface[i].num_altsetting < 1) continue;
    const libusb_interface_descriptor& d = config->interface[i].altsetting[0];
    if (d.bInterfaceClass != kUsbClass || d.bInterfaceSubClass != kUsbSubclass ||
        d.bInterfaceProtocol != kUsbProtocol)
      continue;
    place = {.interface = d.bInterfaceNumber};
    for (int e = 0; e < d.bNumEndpoints; ++e) {
      const libusb_endpoint_descriptor& p = d.endpoint[e];
      if ((p.bmAttributes & LIBUSB_TRANSFER_TYPE_MASK) != LIBUSB_TRANSFER_TYPE_BULK) continue;
      const bool is_in = (p.bEndpointAddress & LIBUSB_ENDPOINT_DIR_MASK) == LIBUSB_ENDPOINT_IN;
      (is_in ? place.in : place.out) = p.bEndpointAddress;
      if (!is_in) place.out_packet_bytes = p.wMaxPacketSize & 0x7FFU;
    }
    found = place.in != 0 && place.out != 0 && place.out_packet_bytes > 0 &&
            kUsbTransferBytes % place.out_packet_bytes == 0;
  }
  libusb_free_config_descriptor(config);
  return found;
}

std::string serial_of(libusb_device_handle* handle, libusb_device* device) {
  libusb_device_descriptor d{};
  std::array<unsigned char, 256> text{};
  if (libusb_get_device_descriptor(device, &d) != 0 || d.iSerialNumber == 0) return {};
  const int n = libusb_get_string_descriptor_ascii(handle, d.iSerialNumber, text.data(),
                                                   static_cast<int>(text.size()));
  return n > 0 ? std::string(text.begin(), text.begin() + n) : std::string();
}

}  // namespace

UsbPort::~UsbPort() {
  close();
  free_transfers();
  if (context != nullptr) libusb_exit(context);
}

void UsbPort::make_transfers(std::size_t frame_bytes) {
  free_transfers();
  out.assign((frame_bytes + kUsbTransferBytes - 1) / kUsbTransferBytes, nullptr);
  for (libusb_transfer*& t : out)
    if ((t = libusb_alloc_transfer(0)) == nullptr) throw std::bad_alloc();
  for (libusb_transfer*& t : in)
    if ((t = libusb_alloc_transfer(0)) == nullptr) throw std::bad_alloc();
}

void UsbPort::free_transfers() noexcept {
  for (libusb_transfer*& t : out) libusb_free_transfer(t);
  for (libusb_transfer*& t : in) {
    libusb_free_transfer(t);
    t = nullptr;
  }
  out.clear();
}

std::string UsbPort::try_open(const UsbSpec& spec, int width_px, int rows, int bits) {
  libusb_device** list = nullptr;
  const ssize_t count = libusb_get_device_list(context, &list);
  std::string problem;
  for (ssize_t i = 0; i < count && handle == nullptr; ++i) {
    libusb_device_descriptor d{};
    if (libusb_get_device_descriptor(list[i], &d) != 0) continue;
    if ((spec.vendor != 0 || spec.product != 0) &&
        (d.idVendor != spec.vendor || d.idProduct != spec.product))
      continue;
    if (!find_place(list[i], place)) continue;
    if (const int code = libusb_open(list[i], &handle); code != 0) {
      handle = nullptr;
      problem = std::string("usb: the device cannot be opened: ") + libusb_strerror(code);
      if (code == LIBUSB_ERROR_ACCESS)
        problem += "; config/udev/70-starloop.rules lets the user do it";
      continue;
    }
    if (spec.serial.empty() || serial_of(handle, list[i]) == spec.serial)
      problem = use(width_px, rows, bits);
    if (!connected) {
      libusb_close(handle);
      handle = nullptr;
    }
  }
  if (list != nullptr) libusb_free_device_list(list, 1);
  return problem;
}

/// Takes the device that was opened, if it can be ours.
std::string UsbPort::use(int width_px, int rows, int bits) {
  if (const int code = libusb_claim_interface(handle, place.interface); code != 0)
    return std::string("usb: the interface cannot be claimed: ") + libusb_strerror(code);
  std::array<unsigned char, kUsbLimitsBytes> bytes{};
  const int n =
      libusb_control_transfer(handle, kUsbAsk, static_cast<std::uint8_t>(UsbRequest::kLimits), 0,
                              static_cast<std::uint16_t>(place.interface), bytes.data(),
                              static_cast<std::uint16_t>(bytes.size()), kUsbControlTimeout_ms);
  if (n < 0) return std::string("usb: the device does not tell its limits: ") + libusb_strerror(n);
  const auto told =
      decode_limits(std::as_bytes(std::span(bytes)).first(static_cast<std::size_t>(n)));
  if (!told.ok()) return told.error().step;
  limits = told.value();
  format = bits <= 11 && limits.takes(PixelFormat::kPacked11) ? PixelFormat::kPacked11
                                                              : PixelFormat::kPlain16;
  const std::size_t payload = usb_payload_bytes(format, width_px, rows);
  if (!limits.takes(format) || width_px > limits.width_px || rows > limits.height_px ||
      payload > limits.payload_bytes) {
    return "usb: the device takes " + std::to_string(limits.width_px) + " x " +
           std::to_string(limits.height_px) + " pixels and " +
           std::to_string(limits.payload_bytes) + " bytes, and the camera has " +
           std::to_string(width_px) + " x " + std::to_string(rows) + " in " +
           std::to_string(payload);
  }
  make_transfers(kUsbHeaderBytes + payload);
  {
    const std::lock_guard lock(mutex);
    gone = closing = in_halted = out_halted = false;
    out_pending = in_pending = 0;
    in_idle.fill(true);
    ++counts.connections;
    session += 0x10001;  // nobody takes messages of the last connection for this one's
  }
  submit_idle_in();
  connected = true;
  return {};
}

void UsbPort::close() noexcept {
  connected = false;
  if (handle == nullptr) return;
  {
    const std::lock_guard lock(mutex);
    closing = true;
  }
  for (libusb_transfer* t : in)
    if (t != nullptr) static_cast<void>(libusb_cancel_transfer(t));
  for (libusb_transfer* t : out)
    if (t != nullptr) static_cast<void>(libusb_cancel_transfer(t));
  const Duration deadline = now() + kUsbDrain;
  for (;;) {
    {
      const std::lock_guard lock(mutex);
      if (in_pending + out_pending == 0) break;
    }
    if (now() > deadline) {
      // The kernel still has them: what they point to must stay. Never seen; better a leak.
      handle = nullptr;
      out.clear();
      in.fill(nullptr);
      lost_transfers = true;
      return;
    }
    handle_events(kUsbLook);
  }
  free_transfers();  // libusb asks them for their handle then
  static_cast<void>(libusb_release_interface(handle, place.interface));
  libusb_close(handle);
  handle = nullptr;
}

void UsbPort::renew() noexcept {
  libusb_context* fresh = nullptr;
  if (lost_transfers || libusb_init(&fresh) != 0) return;
  libusb_exit(context);
  context = fresh;
}

void UsbPort::handle_events(milliseconds timeout) noexcept {
  timeval wait{0, static_cast<suseconds_t>(timeout.count() * 1000)};
  static_cast<void>(libusb_handle_events_timeout_completed(context, &wait, nullptr));
}

void UsbPort::submit_idle_in() noexcept {
  bool halted = false;
  {
    const std::lock_guard lock(mutex);
    halted = std::exchange(in_halted, false);
    if (halted) ++counts.halts;
  }
  if (halted) static_cast<void>(libusb_clear_halt(handle, place.in));
  for (std::size_t i = 0; i < in.size(); ++i) {
    {
      const std::lock_guard lock(mutex);
      if (!in_idle[i] || gone) continue;
      in_idle[i] = false;
      ++in_pending;
    }
    libusb_fill_bulk_transfer(
        in[i], handle, place.in, in_bytes[i].data(), static_cast<int>(kUsbInBytes),
        [](libusb_transfer* t) { static_cast<UsbPort*>(t->user_data)->in_ended(t); }, this, 0);
    const int code = libusb_submit_transfer(in[i]);
    if (code == 0) continue;
    const std::lock_guard lock(mutex);
    in_idle[i] = true;
    --in_pending;
    if (code == LIBUSB_ERROR_NO_DEVICE) gone = true;
  }
}

void UsbPort::in_ended(libusb_transfer* t) noexcept {
  const auto i = static_cast<std::size_t>(std::find(in.begin(), in.end(), t) - in.begin());
  if (t->status == LIBUSB_TRANSFER_COMPLETED && t->actual_length > 0)
    static_cast<void>(take_message(
        std::as_bytes(std::span(t->buffer, static_cast<std::size_t>(t->actual_length)))));
  bool again = t->status == LIBUSB_TRANSFER_COMPLETED;
  {
    const std::lock_guard lock(mutex);
    again = again && !closing;
  }
  if (again && libusb_submit_transfer(t) == 0) return;
  const std::lock_guard lock(mutex);
  --in_pending;
  in_idle[i] = true;  // the keeper tries again in a moment
  switch (t->status) {
    case LIBUSB_TRANSFER_NO_DEVICE:
      gone = true;
      break;
    case LIBUSB_TRANSFER_STALL:
      in_halted = true;
      break;
    case LIBUSB_TRANSFER_CANCELLED:
      break;
    default:
      ++counts.in_errors;
  }
  news.notify_all();
}

bool UsbPort::take_message(std::span<const std::byte> bytes) noexcept {
  const auto message = decode_usb_message(bytes);
  const std::lock_guard lock(mutex);
  if (!message.ok() || message.value().session != session) {
    ++counts.bad_messages;
    return false;
  }
  const UsbMessage& m = message.value();
  if (m.kind == UsbMessage::Kind::kStatus) {
    // One that was asked for may overtake one on bulk IN: credits only grow.
    if (m.status.credits >= counts.device.credits) counts.device = m.status;
    news.notify_all();
  } else if (!packets.push(m.command, static_cast<std::uint32_t>(counts.connections)).ok()) {
    ++counts.commands_lost;
  }
  return true;
}

void UsbPort::out_ended(libusb_transfer* t) noexcept {
  const std::lock_guard lock(mutex);
  --out_pending;
  if (!out_failed && (t->status != LIBUSB_TRANSFER_COMPLETED || t->actual_length != t->length)) {
    out_failed = true;
    out_failure = t->status;
  }
  if (t->status == LIBUSB_TRANSFER_NO_DEVICE) gone = true;
  if (t->status == LIBUSB_TRANSFER_STALL) out_halted = true;
  news.notify_all();
}

std::vector<UsbFound> list_usb_devices() {
  libusb_context* context = nullptr;
  if (const int code = libusb_init(&context); code != 0)
    throw std::runtime_error(std::string("libusb: ") + libusb_strerror(code));
  std::vector<UsbFound> all;
  libusb_device** list = nullptr;
  const ssize_t count = libusb_get_device_list(context, &list);
  for (ssize_t i = 0; i < count; ++i) {
    libusb_device_descriptor d{};
    UsbPlace place;
    if (libusb_get_device_descriptor(list[i], &d) != 0 || !find_place(list[i], place)) continue;
    UsbFound found{d.idVendor,
                   d.idProduct,
                   libusb_get_bus_number(list[i]),
                   libusb_get_device_address(list[i]),
                   {}};
    libusb_device_handle* handle = nullptr;
    if (const int code = libusb_open(list[i], &handle); code != 0) {
      found.problem = libusb_strerror(code);
    } else {
      libusb_close(handle);
    }
    all.push_back(std::move(found));
  }
  if (list != nullptr) libusb_free_device_list(list, 1);
  libusb_exit(context);
  return all;
}

}  // namespace drivers
