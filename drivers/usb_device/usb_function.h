#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace drivers {

/// What a control transfer asks.
struct UsbSetup {
  std::uint8_t type = 0;  ///< bmRequestType
  std::uint8_t request = 0;
  std::uint16_t value = 0;
  std::uint16_t index = 0;
  std::uint16_t length = 0;
};

/// What a device says of itself, in the bytes of the USB specification.
struct UsbDescriptors {
  std::vector<std::byte> device;
  std::vector<std::byte> configuration;  ///< with all that is in it
  std::vector<std::byte> capabilities;   ///< the binary object store; empty below SuperSpeed
  std::vector<std::string> strings;      ///< from number 1 on
};

/// What goes into one bulk IN transfer. The bytes are the function's, until its next call.
struct UsbAnswer {
  std::span<const std::byte> head{};
  std::span<const std::byte> data{};
  bool overflow = false;  ///< more than there is room for: nothing went
};

/// What a device is for, whatever carries its transfers: a state machine without a clock or a
/// thread. Standard requests are the carrier's business.
/// Thread: one. May allocate.
class UsbFunction {
 public:
  virtual ~UsbFunction() = default;
  [[nodiscard]] virtual const UsbDescriptors& descriptors() const noexcept = 0;
  /// A request of a class or a vendor: what goes back (nothing, of a request with data out), or no
  /// value: stalled. The answer may be longer than what was asked for.
  [[nodiscard]] virtual std::optional<std::vector<std::byte>> control(
      const UsbSetup& setup, std::span<const std::byte> data) = 0;
  /// Bytes of a bulk OUT endpoint of its own. `ends`: with a short packet, or one of length zero.
  virtual void take(unsigned endpoint, std::span<const std::byte> bytes, bool ends) = 0;
  /// What goes into a transfer of `room` bytes on a bulk IN endpoint of its own; no value: there is
  /// nothing to say yet. One shorter than the room ends with a short packet.
  [[nodiscard]] virtual std::optional<UsbAnswer> give(unsigned endpoint, std::size_t room) = 0;
  /// The host has cleared the halt of an endpoint, by its address.
  virtual void clear_halt(unsigned /*address*/) {}
  /// The host is gone; another one begins at the beginning.
  virtual void reset() = 0;
};

}  // namespace drivers
