#include <linux/usb/ch9.h>
#include <linux/usb/functionfs.h>

#include "drivers/usb_device/function_files.h"
#include "drivers/usb_device/usb_descriptors.h"
#include "drivers/usb_packet.h"

namespace drivers {
namespace {

// Both files begin with a magic number and their length.
constexpr std::size_t kLengthAt = 4;

/// `most_burst`: packets more that the host may send without waiting; below 0: none of super
/// speed's companions.
void add_speed(DescriptorWriter& out, std::size_t packet, int most_burst) {
  constexpr unsigned kFirstString = 1;
  constexpr unsigned kOut = 0x01;
  constexpr unsigned kIn = kUsbToHost | 0x02;
  out.begin().bytes(
      {kUsbInterfaceDescriptor, 0, 0, 2, kUsbClass, kUsbSubclass, kUsbProtocol, kFirstString});
  for (const unsigned address : {kOut, kIn}) {
    out.begin().bytes({kUsbEndpointDescriptor, address, USB_ENDPOINT_XFER_BULK});
    out.half(static_cast<unsigned>(packet)).bytes({0});
    if (most_burst < 0) continue;
    // Messages are single packets.
    const unsigned burst = address == kOut ? static_cast<unsigned>(most_burst) : 0;
    out.begin().bytes({kUsbCompanionDescriptor, burst, 0, 0, 0});
  }
}

}  // namespace

std::vector<std::byte> function_descriptors() {
  constexpr int kSuperBurst = 15;
  DescriptorWriter out;
  out.word(FUNCTIONFS_DESCRIPTORS_MAGIC_V2).word(0);
  out.word(FUNCTIONFS_HAS_FS_DESC | FUNCTIONFS_HAS_HS_DESC | FUNCTIONFS_HAS_SS_DESC);
  out.word(3).word(3).word(5);  // descriptors of each
  add_speed(out, 64, -1);
  add_speed(out, kUsbPacketBytes, -1);
  add_speed(out, kUsbSuperPacketBytes, kSuperBurst);
  out.length_since(0, kLengthAt);
  return out.finish();
}

std::vector<std::byte> function_strings() {
  constexpr unsigned kEnglish = 0x0409;
  DescriptorWriter out;
  out.word(FUNCTIONFS_STRINGS_MAGIC).word(0);
  out.word(1).word(1).half(kEnglish);  // strings, languages, and which
  // With the zero at its end.
  for (const char c : "Starloop frame injection") out.bytes({static_cast<unsigned char>(c)});
  out.length_since(0, kLengthAt);
  return out.finish();
}

}  // namespace drivers
