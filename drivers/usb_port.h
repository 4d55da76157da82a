#pragma once

#include <array>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <mutex>
#include <string>
#include <vector>

#include <libusb.h>

#include "drivers/packet_queue.h"
#include "drivers/usb_link.h"

namespace drivers {

/// What a transfer of a frame carries at most: a multiple of every packet size there is. Six are a
/// packed frame of 1024 x 1024.
inline constexpr std::size_t kUsbTransferBytes = std::size_t{256} * 1024;
inline constexpr std::size_t kUsbInTransfers = 4;
/// What a message may take, rounded up to whole packets of any speed.
inline constexpr std::size_t kUsbInBytes = 1024;
inline constexpr unsigned kUsbControlTimeout_ms = 500;
/// How long anybody waits for libusb at a time.
inline constexpr std::chrono::milliseconds kUsbLook{20};
/// For transfers that were cancelled to say so.
inline constexpr std::chrono::milliseconds kUsbDrain{1000};

/// Requests to the interface.
inline constexpr std::uint8_t kUsbAsk = std::uint8_t{LIBUSB_REQUEST_TYPE_VENDOR} |
                                        std::uint8_t{LIBUSB_RECIPIENT_INTERFACE} |
                                        std::uint8_t{LIBUSB_ENDPOINT_IN};
inline constexpr std::uint8_t kUsbTell = std::uint8_t{LIBUSB_REQUEST_TYPE_VENDOR} |
                                         std::uint8_t{LIBUSB_RECIPIENT_INTERFACE} |
                                         std::uint8_t{LIBUSB_ENDPOINT_OUT};

/// What a device must have to be ours.
struct UsbPlace {
  int interface = 0;
  std::uint8_t out = 0;
  std::uint8_t in = 0;
  unsigned out_packet_bytes = 0;
};

/// libusb's side of a UsbLink: a device while it is plugged in, its transfers, and what they leave
/// behind.
///
/// The handle is the keeper's to open and close; who uses it holds `in_use`. What transfers leave
/// behind is under `mutex`, which no call into libusb is made with: their ends come in any thread
/// that waits for events.
struct UsbPort {
  explicit UsbPort(PacketQueue& queue) : packets(queue) {}
  ~UsbPort();
  UsbPort(const UsbPort&) = delete;
  UsbPort& operator=(const UsbPort&) = delete;

  /// Empty, or why a device that is there cannot be used. Thread: the keeper, or before it.
  [[nodiscard]] std::string try_open(const UsbSpec& spec, int width_px, int rows, int bits);
  void close() noexcept;
  /// Starts libusb anew. What it knows of the bus it has from udev, and where nobody runs that, as
  /// in a container, it sees only what was there at its start. Pre: closed.
  void renew() noexcept;
  void submit_idle_in() noexcept;
  void out_ended(libusb_transfer* t) noexcept;
  void in_ended(libusb_transfer* t) noexcept;
  /// False: it is none, or of another session.
  bool take_message(std::span<const std::byte> bytes) noexcept;
  void handle_events(std::chrono::milliseconds timeout) noexcept;

  PacketQueue& packets;
  libusb_context* context = nullptr;
  libusb_device_handle* handle = nullptr;
  bool lost_transfers = false;  // libusb still has some that never ended
  UsbPlace place;
  UsbLimits limits;
  PixelFormat format = PixelFormat::kPlain16;
  std::vector<libusb_transfer*> out;
  std::array<libusb_transfer*, kUsbInTransfers> in{};
  std::array<std::array<unsigned char, kUsbInBytes>, kUsbInTransfers> in_bytes{};

  std::mutex in_use;
  std::mutex mutex;
  std::condition_variable news;
  std::atomic<bool> connected{false};
  // Under the mutex.
  int out_pending = 0;
  bool out_failed = false;
  libusb_transfer_status out_failure = LIBUSB_TRANSFER_COMPLETED;  // the first one
  bool out_halted = false;
  std::array<bool, kUsbInTransfers> in_idle{};
  bool in_halted = false;
  int in_pending = 0;
  bool gone = false;
  bool closing = false;
  std::uint32_t session = 0;
  UsbCounts counts;

 private:
  [[nodiscard]] std::string use(int width_px, int rows, int bits);
  void make_transfers(std::size_t frame_bytes);
  void free_transfers() noexcept;
};

}  // namespace drivers
