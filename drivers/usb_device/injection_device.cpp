#include "drivers/usb_device/injection_device.h"

#include <cstring>

#include "drivers/usb_device/usb_descriptors.h"

namespace drivers {
namespace {

constexpr unsigned kOut = 1;
constexpr unsigned kIn = 2;

UsbDescriptors describe() {
  constexpr unsigned kVendor = 0x1209;
  constexpr unsigned kProduct = 0x0001;
  UsbDescriptors d;
  d.device = DescriptorWriter()
                 .begin()
                 .bytes({kUsbDeviceDescriptor, 0x00, 0x02, 0, 0, 0, 64})
                 .half(kVendor)
                 .half(kProduct)
                 .half(0x0100)
                 .bytes({1, 2, 3, 1})
                 .finish();
  DescriptorWriter c;
  c.begin().bytes({kUsbConfigurationDescriptor});
  const std::size_t total = c.later();
  c.bytes({1, 1, 0, 0xC0, 0});
  c.begin().bytes({kUsbInterfaceDescriptor, 0, 0, 2, kUsbClass, kUsbSubclass, kUsbProtocol, 0});
  c.begin().bytes({kUsbEndpointDescriptor, kOut, 2}).half(kUsbPacketBytes).bytes({0});
  c.begin().bytes({kUsbEndpointDescriptor, kUsbToHost | kIn, 2}).half(kUsbPacketBytes).bytes({0});
  c.length_since(0, total);
  d.configuration = c.finish();
  d.strings = {"Starloop", "Frame injection device", "1"};
  return d;
}

}  // namespace

InjectionDevice::InjectionDevice(const UsbLimits& limits)
    : intake_(limits), descriptors_(describe()) {}

std::optional<std::vector<std::byte>> InjectionDevice::control(const UsbSetup& setup,
                                                               std::span<const std::byte> data) {
  constexpr unsigned kFromInterface = 0xC1;
  constexpr unsigned kToInterface = 0x41;
  const auto request = static_cast<UsbRequest>(setup.request);
  if (setup.type == kFromInterface && request == UsbRequest::kLimits) {
    const auto limits = encode_limits(intake_.limits());
    return std::vector<std::byte>(limits.begin(), limits.end());
  }
  if (setup.type == kFromInterface && request == UsbRequest::kStatus) {
    const std::size_t n = intake_.status_message(message_);
    return std::vector<std::byte>(message_.begin(),
                                  message_.begin() + static_cast<std::ptrdiff_t>(n));
  }
  std::uint32_t session = 0;
  if (setup.type == kToInterface && request == UsbRequest::kReset &&
      data.size() == sizeof session) {
    std::memcpy(&session, data.data(), sizeof session);
    intake_.reset(session);
    return std::vector<std::byte>{};
  }
  return std::nullopt;
}

void InjectionDevice::take(unsigned /*endpoint*/, std::span<const std::byte> bytes, bool ends) {
  intake_.take(bytes, ends);
}

std::optional<UsbAnswer> InjectionDevice::give(unsigned /*endpoint*/, std::size_t room) {
  const std::size_t n = intake_.next_message(message_);
  if (n == 0) return std::nullopt;
  if (n > room) return UsbAnswer{.overflow = true};
  return UsbAnswer{.data = std::span(message_).first(n)};
}

}  // namespace drivers
