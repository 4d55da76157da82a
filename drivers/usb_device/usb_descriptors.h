#pragma once

#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <string_view>
#include <vector>

#include "drivers/usb_device/usb_function.h"

namespace drivers {

inline constexpr unsigned kUsbDeviceDescriptor = 1;
inline constexpr unsigned kUsbConfigurationDescriptor = 2;
inline constexpr unsigned kUsbStringDescriptor = 3;
inline constexpr unsigned kUsbInterfaceDescriptor = 4;
inline constexpr unsigned kUsbEndpointDescriptor = 5;
inline constexpr unsigned kUsbCapabilitiesDescriptor = 15;
inline constexpr unsigned kUsbCapabilityDescriptor = 16;
inline constexpr unsigned kUsbCompanionDescriptor = 48;  // of an endpoint at SuperSpeed
/// Of a bulk endpoint at high speed, and at SuperSpeed.
inline constexpr std::size_t kUsbPacketBytes = 512;
inline constexpr std::size_t kUsbSuperPacketBytes = 1024;
/// Of the address of an endpoint to the host.
inline constexpr unsigned kUsbToHost = 0x80;

/// Descriptors one after the other; numbers little-endian, as USB has them.
class DescriptorWriter {
 public:
  /// A descriptor's length and what follows; the length counts itself.
  DescriptorWriter& begin();
  DescriptorWriter& bytes(std::initializer_list<unsigned> values);
  DescriptorWriter& half(unsigned value);
  DescriptorWriter& word(std::uint32_t value);
  /// Two bytes that say how long something is, once it is whole: where they are.
  [[nodiscard]] std::size_t later();
  void length_since(std::size_t start, std::size_t at);
  [[nodiscard]] std::size_t used() const noexcept { return out_.size(); }
  /// Ends the last descriptor.
  [[nodiscard]] std::vector<std::byte> finish();

 private:
  void close();

  std::vector<std::byte> out_;
  std::size_t open_ = 0;  // where the descriptor in hand begins
  bool is_open_ = false;
};

[[nodiscard]] std::vector<std::byte> usb_string_descriptor(std::string_view text);

/// An interface as its descriptor has it.
struct UsbInterface {
  std::uint8_t number = 0;
  std::uint8_t device_class = 0;
  std::uint8_t subclass = 0;
  std::uint8_t protocol = 0;
};

/// What a configuration is made of. Pre: its descriptors are whole.
struct UsbParts {
  std::vector<UsbInterface> interfaces;
  std::vector<unsigned> endpoints;  ///< addresses
};
[[nodiscard]] UsbParts usb_parts(const UsbDescriptors& descriptors);

/// GET_DESCRIPTOR; empty: there is no such descriptor.
[[nodiscard]] std::vector<std::byte> usb_descriptor(const UsbDescriptors& descriptors,
                                                    unsigned type, unsigned index);

}  // namespace drivers
