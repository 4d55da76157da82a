#include "drivers/usb_device/usb_descriptors.h"

#include <utility>

#include "engine/core/contract.h"

namespace drivers {

DescriptorWriter& DescriptorWriter::begin() {
  close();
  open_ = out_.size();
  is_open_ = true;
  out_.push_back(std::byte{0});
  return *this;
}

DescriptorWriter& DescriptorWriter::bytes(std::initializer_list<unsigned> values) {
  for (const unsigned v : values) out_.push_back(static_cast<std::byte>(v));
  return *this;
}

DescriptorWriter& DescriptorWriter::half(unsigned value) {
  return bytes({value & 0xFF, value >> 8 & 0xFF});
}

DescriptorWriter& DescriptorWriter::word(std::uint32_t value) {
  return half(value & 0xFFFF).half(value >> 16);
}

std::size_t DescriptorWriter::later() {
  half(0);
  return out_.size() - 2;
}

void DescriptorWriter::length_since(std::size_t start, std::size_t at) {
  const std::size_t length = out_.size() - start;
  ENSURE(length <= 0xFFFF);
  out_[at] = static_cast<std::byte>(length & 0xFF);
  out_[at + 1] = static_cast<std::byte>(length >> 8);
}

void DescriptorWriter::close() {
  if (!is_open_) return;
  ENSURE(out_.size() - open_ <= 0xFF);
  out_[open_] = static_cast<std::byte>(out_.size() - open_);
  is_open_ = false;
}

std::vector<std::byte> DescriptorWriter::finish() {
  close();
  return std::exchange(out_, {});
}

std::vector<std::byte> usb_string_descriptor(std::string_view text) {
  DescriptorWriter out;
  out.begin().bytes({kUsbStringDescriptor});
  for (const char c : text) out.half(static_cast<unsigned char>(c));
  return out.finish();
}

UsbParts usb_parts(const UsbDescriptors& descriptors) {
  UsbParts parts;
  const auto& in = descriptors.configuration;
  const auto at = [&in](std::size_t i) { return std::to_integer<std::uint8_t>(in[i]); };
  for (std::size_t i = 0; i < in.size(); i += at(i)) {
    ENSURE(at(i) >= 2 && i + at(i) <= in.size());
    const bool first_setting = at(i + 1) == kUsbInterfaceDescriptor && at(i + 3) == 0;
    if (first_setting) parts.interfaces.push_back({at(i + 2), at(i + 5), at(i + 6), at(i + 7)});
    if (at(i + 1) == kUsbEndpointDescriptor) parts.endpoints.push_back(at(i + 2));
  }
  return parts;
}

std::vector<std::byte> usb_descriptor(const UsbDescriptors& descriptors, unsigned type,
                                      unsigned index) {
  constexpr unsigned kEnglish = 0x0409;
  if (type == kUsbDeviceDescriptor && index == 0) return descriptors.device;
  if (type == kUsbConfigurationDescriptor && index == 0) return descriptors.configuration;
  if (type == kUsbCapabilitiesDescriptor && index == 0) return descriptors.capabilities;
  if (type != kUsbStringDescriptor || index > descriptors.strings.size()) return {};
  if (index > 0) return usb_string_descriptor(descriptors.strings[index - 1]);
  return DescriptorWriter().begin().bytes({kUsbStringDescriptor}).half(kEnglish).finish();
}

}  // namespace drivers
