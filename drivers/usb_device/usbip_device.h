#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <span>
#include <vector>

#include "drivers/usb_device/usb_descriptors.h"
#include "drivers/usb_device/usb_function.h"

namespace drivers {

/// A device as the other end of USB/IP (protocol version 1.1.1, as Linux' own vhci-hcd speaks it):
/// a host attaches it over a network or a socket pair, and its kernel sees a device that does what
/// the function does, at SuperSpeed if it has the descriptors for that, else at high speed. This
/// class is the bytes alone; who carries them is the caller's business.
///
/// Transfers are whole: USB/IP knows no packets, so what goes out ends where a transfer's length is
/// no multiple of the packet size or its zero-packet flag is set.
/// Thread: one. Allocates.
class UsbIpDevice {
 public:
  /// The function outlives it, and is reset.
  explicit UsbIpDevice(UsbFunction& function);

  /// Bytes from the host, in any pieces. False: they are none of the protocol's; the connection is
  /// to be closed.
  [[nodiscard]] bool take(std::span<const std::byte> bytes);
  /// Answers transfers that wait for the device to say something, when it has.
  void serve();
  /// Bytes for the host, whose they are.
  [[nodiscard]] std::vector<std::byte> replies();

  /// A host has imported the device.
  [[nodiscard]] bool attached() const noexcept { return attached_; }

 private:
  struct Request {
    std::uint32_t id = 0;
    unsigned endpoint = 0;
    std::uint32_t bytes = 0;
  };
  [[nodiscard]] bool take_operation();
  [[nodiscard]] bool take_command();
  void submit(std::span<const std::byte> header, std::span<const std::byte> data);
  void control(std::uint32_t id, const UsbSetup& setup, std::span<const std::byte> data);
  /// A request that every device answers; false: it is stalled.
  [[nodiscard]] bool standard(const UsbSetup& setup, std::vector<std::byte>& answer);
  void unlink(std::uint32_t id, std::uint32_t which);
  void describe();
  [[nodiscard]] bool has_endpoint(unsigned address) const noexcept;
  void end(std::uint32_t id, int status, std::size_t bytes, const UsbAnswer& answer = {});
  void reply(std::span<const std::byte> bytes);

  UsbFunction& function_;
  UsbParts parts_;
  bool is_super_;
  std::vector<std::byte> held_;  // of the host's, not yet whole
  std::vector<std::byte> replies_;
  std::deque<Request> waiting_;  // bulk IN
  bool attached_ = false;
};

}  // namespace drivers
