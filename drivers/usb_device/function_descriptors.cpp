#include <initializer_list>
#include <string_view>

#include <linux/usb/ch9.h>
#include <linux/usb/functionfs.h>

#include "drivers/usb_device/function_files.h"
#include "drivers/usb_packet.h"

namespace drivers {
namespace {

using Bytes = std::vector<std::byte>;

void append(Bytes& out, std::initializer_list<unsigned> values) {
  for (const unsigned v : values) out.push_back(static_cast<std::byte>(v));
}
void append_word(Bytes& out, std::uint32_t word) {
  append(out, {word & 0xFF, word >> 8 & 0xFF, word >> 16 & 0xFF, word >> 24});
}
/// All lengths of these files are at byte 4.
void set_length(Bytes& out) {
  Bytes length;
  append_word(length, static_cast<std::uint32_t>(out.size()));
  std::copy(length.begin(), length.end(), out.begin() + 4);
}

void append_endpoint(Bytes& out, unsigned address, unsigned packet) {
  append(out, {USB_DT_ENDPOINT_SIZE, USB_DT_ENDPOINT, address, USB_ENDPOINT_XFER_BULK,
               packet & 0xFF, packet >> 8, 0});
}

/// `most_burst`: packets more that the host may send without waiting; below 0: none of super
/// speed's companions.
void append_speed(Bytes& out, unsigned packet, int most_burst) {
  constexpr unsigned kFirstString = 1;
  constexpr unsigned kOut = 0x01;
  constexpr unsigned kIn = 0x82;
  append(out, {USB_DT_INTERFACE_SIZE, USB_DT_INTERFACE, 0, 0, 2, kUsbClass, kUsbSubclass,
               kUsbProtocol, kFirstString});
  append_endpoint(out, kOut, packet);
  if (most_burst >= 0)
    append(out, {USB_DT_SS_EP_COMP_SIZE, USB_DT_SS_ENDPOINT_COMP, static_cast<unsigned>(most_burst),
                 0, 0, 0});
  append_endpoint(out, kIn, packet);
  // Messages are single packets.
  if (most_burst >= 0) append(out, {USB_DT_SS_EP_COMP_SIZE, USB_DT_SS_ENDPOINT_COMP, 0, 0, 0, 0});
}

}  // namespace

Bytes function_descriptors() {
  Bytes out;
  append_word(out, FUNCTIONFS_DESCRIPTORS_MAGIC_V2);
  append_word(out, 0);
  append_word(out, FUNCTIONFS_HAS_FS_DESC | FUNCTIONFS_HAS_HS_DESC | FUNCTIONFS_HAS_SS_DESC);
  for (const std::uint32_t descriptors : {3U, 3U, 5U}) append_word(out, descriptors);
  append_speed(out, 64, -1);
  append_speed(out, 512, -1);
  append_speed(out, 1024, 15);
  set_length(out);
  return out;
}

Bytes function_strings() {
  constexpr unsigned kEnglish = 0x0409;
  constexpr std::string_view kName = "Starloop frame injection";
  Bytes out;
  append_word(out, FUNCTIONFS_STRINGS_MAGIC);
  append_word(out, 0);
  for (const std::uint32_t count : {1U, 1U}) append_word(out, count);  // strings, languages
  append(out, {kEnglish & 0xFF, kEnglish >> 8});
  for (const char c : kName) out.push_back(static_cast<std::byte>(c));
  out.push_back(std::byte{0});
  set_length(out);
  return out;
}

}  // namespace drivers
