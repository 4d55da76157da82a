// Descriptors, read with the structures of Linux' own header.

#include "drivers/usb_device/uvc_descriptors.h"

#include <cstring>
#include <set>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <linux/usb/video.h>

#include "drivers/usb_device/usb_descriptors.h"
#include "tests/support/uvc_frames.h"

namespace {

using Bytes = std::vector<std::byte>;

/// One descriptor after the other; each says its own length.
std::vector<Bytes> parts(const Bytes& all) {
  std::vector<Bytes> found;
  for (std::size_t at = 0; at < all.size();) {
    const auto length = std::to_integer<std::size_t>(all[at]);
    if (length < 2 || at + length > all.size()) {
      ADD_FAILURE() << "a length of " << length << " at " << at;
      break;
    }
    found.emplace_back(all.begin() + static_cast<std::ptrdiff_t>(at),
                       all.begin() + static_cast<std::ptrdiff_t>(at + length));
    at += length;
  }
  return found;
}

unsigned at(const Bytes& d, std::size_t i) { return std::to_integer<unsigned>(d[i]); }

template <class T>
T as(const Bytes& d) {
  T out{};
  EXPECT_GE(d.size(), sizeof out);
  std::memcpy(&out, d.data(), std::min(d.size(), sizeof out));
  return out;
}

/// Those of the class that belong to an interface, in their order.
std::vector<Bytes> class_specific(const Bytes& configuration, unsigned interface) {
  std::vector<Bytes> found;
  bool here = false;
  for (const Bytes& d : parts(configuration)) {
    if (at(d, 1) == 4) here = at(d, 2) == interface;
    if (here && at(d, 1) == 0x24) found.push_back(d);
  }
  return found;
}

std::size_t bytes_in(const std::vector<Bytes>& all) {
  std::size_t sum = 0;
  for (const Bytes& d : all) sum += d.size();
  return sum;
}

TEST(UvcDescriptors, LengthsAndNumbersFitTogether) {
  const drivers::UsbDescriptors d = drivers::uvc_descriptors(uvc_frames::spec());
  EXPECT_EQ(at(d.device, 0), d.device.size());
  EXPECT_EQ(d.device.size(), 18U);
  const std::vector<Bytes> all = parts(d.configuration);
  EXPECT_EQ(at(all[0], 2) | at(all[0], 3) << 8, d.configuration.size());
  EXPECT_EQ(at(all[0], 4), 2U) << "interfaces";
  EXPECT_EQ(at(all[1], 1), 11U) << "they belong together";
  const drivers::UsbParts parts_of = drivers::usb_parts(d);
  ASSERT_EQ(parts_of.interfaces.size(), 2U);
  for (unsigned i = 0; i < 2; ++i) {
    EXPECT_EQ(parts_of.interfaces[i].number, i);
    EXPECT_EQ(parts_of.interfaces[i].device_class, 0x0E);
    EXPECT_EQ(parts_of.interfaces[i].subclass, i + 1);
  }
  EXPECT_EQ(parts_of.endpoints, std::vector<unsigned>{0x81});
  // Every string that is spoken of is there.
  for (unsigned i = 0; i <= d.strings.size(); ++i)
    EXPECT_FALSE(drivers::usb_descriptor(d, 3, i).empty()) << i;
  for (const std::size_t place : {14U, 15U, 16U}) EXPECT_LE(at(d.device, place), d.strings.size());
}

TEST(UvcDescriptors, SuperSpeedSaysSoAndHighSpeedDoesNot) {
  drivers::UvcSpec spec = uvc_frames::spec();
  const auto endpoint_of = [](const drivers::UsbDescriptors& d) {
    const std::vector<Bytes> all = parts(d.configuration);
    for (std::size_t i = 0; i < all.size(); ++i)
      if (at(all[i], 1) == 5)
        return std::vector<Bytes>(all.begin() + static_cast<std::ptrdiff_t>(i), all.end());
    return std::vector<Bytes>{};
  };
  const drivers::UsbDescriptors super = drivers::uvc_descriptors(spec);
  EXPECT_EQ(at(super.device, 3), 3U);
  EXPECT_EQ(at(super.device, 7), 9U) << "2^9 bytes";
  ASSERT_EQ(endpoint_of(super).size(), 2U) << "a companion";
  EXPECT_EQ(at(endpoint_of(super)[0], 5), 1024U >> 8);
  EXPECT_EQ(at(endpoint_of(super)[1], 1), 48U);
  const std::vector<Bytes> store = parts(super.capabilities);
  ASSERT_EQ(store.size(), 3U);
  EXPECT_EQ(at(store[0], 2), super.capabilities.size());
  EXPECT_EQ(at(store[0], 4), 2U);
  EXPECT_EQ(store[2].size(), 10U);
  spec.super_speed = false;
  const drivers::UsbDescriptors high = drivers::uvc_descriptors(spec);
  EXPECT_EQ(at(high.device, 3), 2U);
  EXPECT_EQ(at(high.device, 7), 64U);
  ASSERT_EQ(endpoint_of(high).size(), 1U);
  EXPECT_EQ(at(endpoint_of(high)[0], 5), 512U >> 8);
  EXPECT_TRUE(high.capabilities.empty());
}

TEST(UvcDescriptors, UnitsMakeAChainFromTheCameraToTheStream) {
  const drivers::UsbDescriptors d = drivers::uvc_descriptors(uvc_frames::spec());
  const std::vector<Bytes> control = class_specific(d.configuration, 0);
  ASSERT_EQ(control.size(), 4U);
  const auto header = as<uvc_header_descriptor>(control[0]);
  EXPECT_EQ(header.bcdUVC, 0x0110);
  EXPECT_EQ(header.wTotalLength, bytes_in(control));
  EXPECT_EQ(header.bInCollection, 1);
  EXPECT_EQ(at(control[0], 12), 1U) << "the stream's interface";
  const auto camera = as<uvc_camera_terminal_descriptor>(control[1]);
  EXPECT_EQ(camera.wTerminalType, UVC_ITT_CAMERA);
  EXPECT_EQ(camera.bLength, UVC_DT_CAMERA_TERMINAL_SIZE(3));
  EXPECT_EQ(camera.bmControls[1], 1 << 3) << "pan and tilt, absolute, alone";
  EXPECT_EQ(camera.bmControls[0] | camera.bmControls[2], 0);
  const Bytes& unit = control[2];
  EXPECT_EQ(at(unit, 2), unsigned{UVC_VC_EXTENSION_UNIT});
  EXPECT_EQ(unit.size(), std::size_t{UVC_DT_EXTENSION_UNIT_SIZE(1, 1)});
  EXPECT_EQ(std::memcmp(unit.data() + 4, drivers::kUvcExtensionGuid.data(), 16), 0);
  EXPECT_EQ(at(unit, 20), 4U) << "controls";
  EXPECT_EQ(at(unit, 22), camera.bTerminalID);
  EXPECT_EQ(at(unit, 24), 0x0FU);
  const auto output = as<uvc_output_terminal_descriptor>(control[3]);
  EXPECT_EQ(output.wTerminalType, UVC_TT_STREAMING);
  EXPECT_EQ(output.bSourceID, at(unit, 3));
  EXPECT_EQ((std::set<unsigned>{camera.bTerminalID, at(unit, 3), output.bTerminalID}.size()), 3U);
}

TEST(UvcDescriptors, FormatsHaveOneFrameEachOfTheCamerasSizeAndRate) {
  drivers::UvcSpec spec = uvc_frames::spec(1023, 1024, 1);
  spec.period = engine::Duration(16'666'667);
  const drivers::UsbDescriptors d = drivers::uvc_descriptors(spec);
  const std::vector<Bytes> stream = class_specific(d.configuration, 1);
  ASSERT_EQ(stream.size(), 1U + 3 * 3);
  const auto header = as<uvc_input_header_descriptor>(stream[0]);
  EXPECT_EQ(header.bNumFormats, 3);
  EXPECT_EQ(header.wTotalLength, bytes_in(stream));
  EXPECT_EQ(header.bEndpointAddress, 0x81);
  EXPECT_EQ(header.bTerminalLink, drivers::kUvcOutputTerminal);
  EXPECT_EQ(header.bLength, UVC_DT_INPUT_HEADER_SIZE(3, 1));
  struct Look {
    const char* code;
    unsigned bits;
    unsigned width_px;
    unsigned bytes;
  };
  const Look looks[] = {{"Y16 ", 16, 1023, 1023 * 1025 * 2},
                        {"Y800", 8, 1023, 1023 * 1025},
                        {"YUY2", 16, 1024, 1024 * 1025 * 2}};
  for (unsigned i = 0; i < 3; ++i) {
    const auto format = as<uvc_format_uncompressed>(stream[1 + 3 * i]);
    EXPECT_EQ(format.bFormatIndex, i + 1);
    EXPECT_EQ(format.bNumFrameDescriptors, 1);
    EXPECT_EQ(std::memcmp(format.guidFormat, looks[i].code, 4), 0);
    EXPECT_EQ(std::memcmp(format.guidFormat + 4, "\0\0\x10\0\x80\0\0\xAA\0\x38\x9B\x71", 12), 0);
    EXPECT_EQ(format.bBitsPerPixel, looks[i].bits);
    const auto frame = as<uvc_frame_uncompressed>(stream[2 + 3 * i]);
    EXPECT_EQ(frame.bLength, UVC_DT_FRAME_UNCOMPRESSED_SIZE(1));
    EXPECT_EQ(frame.wWidth, looks[i].width_px);
    EXPECT_EQ(frame.wHeight, 1025);
    EXPECT_EQ(frame.dwMaxVideoFrameBufferSize, looks[i].bytes);
    EXPECT_EQ(frame.dwDefaultFrameInterval, 166666U);
    EXPECT_EQ(frame.bFrameIntervalType, 1);
  }
}

}  // namespace
