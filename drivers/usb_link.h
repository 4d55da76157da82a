#pragma once

#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "drivers/packet_queue.h"
#include "drivers/usb_packet.h"
#include "hil/camera_link.h"

namespace drivers {

struct UsbSpec {
  /// 0 and 0: the first device that has the interface.
  std::uint16_t vendor = 0;
  std::uint16_t product = 0;
  std::string serial;  ///< empty: any
  bool packed = true;  ///< 11 bits a pixel, where the device takes them and the pixels fit
};

/// What became of the cable so far.
struct UsbCounts {
  std::uint64_t connections = 0;
  std::uint64_t resets = 0;           ///< sessions begun
  std::uint64_t halts = 0;            ///< endpoints that stalled, and were cleared
  std::uint64_t bad_messages = 0;     ///< that were none, or of an older session
  std::uint64_t status_requests = 0;  ///< for want of a credit
  std::uint64_t in_errors = 0;        ///< transfers of the bulk IN endpoint that failed
  std::uint64_t commands_lost = 0;    ///< nobody took them in time
  UsbStatus device;                   ///< its own words, of this session
};

struct UsbPort;  // libusb's things: usb_port.h

/// A frame-injection device on USB: frames out on a bulk endpoint, commands and credits back on
/// another, as usb_protocol.md has it.
///
/// A frame goes out as several transfers that are all in flight; send() returns when the last has
/// ended, so what it says is what happened. A frame is begun only with the device's credit: where
/// that does not come the answer is kBusy, and nothing of the frame was sent; the next frame asks
/// for the status first, for the message that had the credit may have been lost. After a frame that
/// failed half way, or when the device knows nothing of the session, the next begins a new one,
/// which puts both sides in step. A device that is unplugged is looked for ten times a second;
/// frames without it are kDisconnected.
///
/// Thread: sender for send(), receiver for receive(), one of its own for libusb's events. Loop-safe
/// once made.
class UsbLink final : public hil::FrameSink, public hil::CommandSource {
 public:
  /// For frames of this size and at most so many rows, a telemetry row included. Throws
  /// std::runtime_error: a device is there, but may not be opened, or is too small.
  UsbLink(const UsbSpec& spec, int width_px, int rows, int bits);
  ~UsbLink() override;
  UsbLink(const UsbLink&) = delete;
  UsbLink& operator=(const UsbLink&) = delete;

  engine::Status send(const hil::Frame& frame, engine::Duration timeout) noexcept override;
  /// Command::sender counts the connections: software that was started anew counts from 0 again.
  engine::Expected<hil::Command> receive(engine::Duration timeout) noexcept override {
    return packets_.receive(timeout);
  }
  [[nodiscard]] bool has_reader() const noexcept override;

  /// Thread: any.
  [[nodiscard]] UsbCounts counts() const;

 private:
  void keep(const std::stop_token& stop) noexcept;
  [[nodiscard]] engine::Status begin_session(engine::Duration timeout) noexcept;
  /// Has the device say its credits once more, by a request of its own.
  void ask_status(engine::Duration timeout) noexcept;
  [[nodiscard]] engine::Status wait_for_credit(engine::Duration deadline) noexcept;
  /// The frame in frame_, as transfers.
  [[nodiscard]] engine::Status transfer(std::size_t bytes, engine::Duration deadline) noexcept;

  UsbSpec spec_;
  int width_px_;
  int rows_;
  int bits_;
  PacketQueue packets_;  // events -> receiver
  std::unique_ptr<UsbPort> device_;
  // The sender's own.
  std::vector<std::byte> frame_;
  std::uint32_t begun_ = 0;                  // frames of this session
  bool in_step_ = false;                     // a session is on, and no frame of it failed
  bool starved_ = false;                     // the last frame found no credit
  std::uint64_t session_of_connection_ = 0;  // the session is this connection's
  std::jthread keeper_;                      // the last member: it uses the others
};

/// A device with the interface, on a bus of this machine.
struct UsbFound {
  std::uint16_t vendor = 0;
  std::uint16_t product = 0;
  int bus = 0;
  int address = 0;
  std::string problem;  ///< why it cannot be used; empty: it can
};
/// Throws std::runtime_error when libusb does not start.
[[nodiscard]] std::vector<UsbFound> list_usb_devices();

}  // namespace drivers
