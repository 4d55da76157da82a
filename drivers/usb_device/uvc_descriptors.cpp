#include "drivers/usb_device/uvc_descriptors.h"

#include <algorithm>
#include <limits>
#include <string_view>

#include <linux/usb/video.h>

#include "drivers/usb_device/usb_descriptors.h"
#include "drivers/usb_device/uvc_controls.h"
#include "engine/core/contract.h"

namespace drivers {
namespace {

constexpr unsigned kVideoClass = 0x0E;
constexpr unsigned kClassInterface = 0x24;  // a descriptor of the class, of an interface
constexpr unsigned kAssociation = 11;
constexpr unsigned kVersion = 0x0110;
constexpr unsigned kNone = 0;

enum Strings : unsigned { kMaker = 1, kProduct, kSerial, kExtension };

void add_association(DescriptorWriter& out) {
  out.begin().bytes({kAssociation, kUvcControlInterface, 2, kVideoClass,
                     UVC_SC_VIDEO_INTERFACE_COLLECTION, UVC_PC_PROTOCOL_UNDEFINED, kProduct});
}

void add_control_interface(DescriptorWriter& out) {
  out.begin().bytes({kUsbInterfaceDescriptor, kUvcControlInterface, 0, 0, kVideoClass,
                     UVC_SC_VIDEOCONTROL, UVC_PC_PROTOCOL_UNDEFINED, kProduct});
  const std::size_t start = out.used();
  out.begin().bytes({kClassInterface, UVC_VC_HEADER}).half(kVersion);
  const std::size_t total = out.later();
  out.word(kUvcClock_hz).bytes({1, kUvcStreamInterface});

  constexpr std::uint32_t kPanTiltAbsolute = 1U << 11;
  out.begin().bytes({kClassInterface, UVC_VC_INPUT_TERMINAL, kUvcCameraTerminal});
  out.half(UVC_ITT_CAMERA).bytes({kNone, kNone});
  out.half(0).half(0).half(0);  // focal lengths: not said
  out.bytes({3, kPanTiltAbsolute & 0xFF, kPanTiltAbsolute >> 8 & 0xFF, kPanTiltAbsolute >> 16});

  out.begin().bytes({kClassInterface, UVC_VC_EXTENSION_UNIT, kUvcExtensionUnit});
  for (const std::uint8_t b : kUvcExtensionGuid) out.bytes({b});
  out.bytes({kUvcSelectors, 1, kUvcCameraTerminal, 1, (1U << kUvcSelectors) - 1, kExtension});

  out.begin().bytes({kClassInterface, UVC_VC_OUTPUT_TERMINAL, kUvcOutputTerminal});
  out.half(UVC_TT_STREAMING).bytes({kNone, kUvcExtensionUnit, kNone});
  out.length_since(start, total);
}

struct Look {
  UvcFormat format;
  std::string_view code;  // the GUID's first four bytes
  unsigned bits;
};
constexpr Look kLooks[] = {
    {UvcFormat::kY16, "Y16 ", 16}, {UvcFormat::kY8, "Y800", 8}, {UvcFormat::kYuy2, "YUY2", 16}};
static_assert(std::size(kLooks) == kUvcFormats);

void add_format(DescriptorWriter& out, const UvcSpec& spec, const Look& look) {
  const auto number = static_cast<unsigned>(look.format);
  out.begin().bytes({kClassInterface, UVC_VS_FORMAT_UNCOMPRESSED, number, 1});
  for (const char c : look.code) out.bytes({static_cast<unsigned char>(c)});
  out.bytes({0x00, 0x00, 0x10, 0x00, 0x80, 0x00, 0x00, 0xaa, 0x00, 0x38, 0x9b, 0x71});
  out.bytes({look.bits, 1, 0, 0, 0, 0});

  const UvcFrameSize size = uvc_frame_size(spec, look.format);
  const std::uint64_t rate = std::uint64_t{size.bytes} * 8 * 10'000'000 / uvc_interval(spec);
  const auto rate_bits_s = static_cast<std::uint32_t>(
      std::min<std::uint64_t>(rate, std::numeric_limits<std::uint32_t>::max()));
  out.begin().bytes({kClassInterface, UVC_VS_FRAME_UNCOMPRESSED, 1, 0});
  out.half(static_cast<unsigned>(size.width_px)).half(static_cast<unsigned>(size.height_px));
  out.word(rate_bits_s).word(rate_bits_s).word(size.bytes);
  out.word(uvc_interval(spec)).bytes({1}).word(uvc_interval(spec));

  out.begin().bytes({kClassInterface, UVC_VS_COLORFORMAT, UVC_COLOR_PRIMARIES_UNSPECIFIED,
                     UVC_TRANSFER_CHARACTERISTICS_LINEAR, UVC_MATRIX_COEFFICIENTS_UNSPECIFIED});
}

void add_stream_interface(DescriptorWriter& out, const UvcSpec& spec) {
  constexpr unsigned kAddress = kUsbToHost | kUvcEndpoint;
  constexpr unsigned kBulk = 2;
  out.begin().bytes({kUsbInterfaceDescriptor, kUvcStreamInterface, 0, 1, kVideoClass,
                     UVC_SC_VIDEOSTREAMING, UVC_PC_PROTOCOL_UNDEFINED, kNone});
  const std::size_t start = out.used();
  out.begin().bytes({kClassInterface, UVC_VS_INPUT_HEADER, kUvcFormats});
  const std::size_t total = out.later();
  out.bytes({kAddress, 0, kUvcOutputTerminal, 0, 0, 0, 1});
  for (unsigned i = 0; i < kUvcFormats; ++i) out.bytes({0});  // nothing settable besides the format
  for (const Look& look : kLooks) add_format(out, spec, look);
  out.length_since(start, total);
  const std::size_t packet = spec.super_speed ? kUsbSuperPacketBytes : kUsbPacketBytes;
  out.begin().bytes({kUsbEndpointDescriptor, kAddress, kBulk});
  out.half(static_cast<unsigned>(packet)).bytes({0});
  if (spec.super_speed) out.begin().bytes({kUsbCompanionDescriptor, 0, 0, 0, 0});
}

/// What a device has to say of itself to be one of USB 3.
std::vector<std::byte> capabilities() {
  constexpr unsigned kUsb2Extension = 2;
  constexpr unsigned kSuperSpeed = 3;
  constexpr unsigned kOnlySuper = 1U << 3;
  DescriptorWriter out;
  out.begin().bytes({kUsbCapabilitiesDescriptor});
  const std::size_t total = out.later();
  out.bytes({2});
  out.begin().bytes({kUsbCapabilityDescriptor, kUsb2Extension}).word(0);
  out.begin().bytes({kUsbCapabilityDescriptor, kSuperSpeed, 0}).half(kOnlySuper);
  out.bytes({3, 0}).half(0);  // works from that speed on; leaves sleep at once
  out.length_since(0, total);
  return out.finish();
}

}  // namespace

UvcFrameSize uvc_frame_size(const UvcSpec& spec, UvcFormat format) noexcept {
  UvcFrameSize size;
  size.width_px = spec.width_px;
  if (format == UvcFormat::kYuy2) size.width_px += spec.width_px % 2;  // pixels come in pairs
  size.height_px = spec.height_px + spec.rows_below;
  const std::uint32_t pixel_bytes = format == UvcFormat::kY8 ? 1 : 2;
  size.bytes = static_cast<std::uint32_t>(size.width_px) *
               static_cast<std::uint32_t>(size.height_px) * pixel_bytes;
  return size;
}

std::uint32_t uvc_interval(const UvcSpec& spec) noexcept {
  const std::int64_t hundreds = spec.period.count() / 100;
  return static_cast<std::uint32_t>(
      std::clamp<std::int64_t>(hundreds, 1, std::numeric_limits<std::uint32_t>::max()));
}

UsbDescriptors uvc_descriptors(const UvcSpec& spec) {
  UsbDescriptors d;
  // Class, subclass and protocol of a device whose interfaces belong together.
  const unsigned version = spec.super_speed ? 0x0300 : 0x0200;
  const unsigned control_packet = spec.super_speed ? 9 : 64;  // a power of two there
  d.device = DescriptorWriter()
                 .begin()
                 .bytes({kUsbDeviceDescriptor})
                 .half(version)
                 .bytes({0xEF, 0x02, 0x01, control_packet})
                 .half(0x1209)
                 .half(0x0002)
                 .half(0x0100)
                 .bytes({kMaker, kProduct, kSerial, 1})
                 .finish();
  DescriptorWriter c;
  c.begin().bytes({kUsbConfigurationDescriptor});
  const std::size_t total = c.later();
  c.bytes({2, 1, 0, 0xC0, 0});
  add_association(c);
  add_control_interface(c);
  add_stream_interface(c, spec);
  c.length_since(0, total);
  d.configuration = c.finish();
  if (spec.super_speed) d.capabilities = capabilities();
  d.strings = {"Starloop", "Starloop camera", "1", "Starloop pointing"};
  return d;
}

}  // namespace drivers
