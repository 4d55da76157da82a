// starloop_usb_device as a process: a host's bytes in over TCP, frames out to the client library,
// and the client's commands back to the host.

#include <cstring>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <unistd.h>

#include "drivers/client/starloop_client.h"
#include "hil/space_packet.h"
#include "tests/support/process.h"
#include "tests/support/usb_frames.h"
#include "tests/support/usbip_connection.h"

namespace {

using usbip_host::Bytes;

TEST(UsbDevice, FramesGoToTheClientAndItsCommandsToTheHost) {
  const std::string name = "starloop-usb-test-" + std::to_string(getpid());
  process::Process device({STARLOOP_USB_DEVICE, "--port", "0", "--shm", name, "--width",
                           std::to_string(usb_frames::kWidth_px), "--height",
                           std::to_string(usb_frames::kHeight_px)});
  const std::string line = device.line();
  const int port = std::stoi(line.substr(line.find(':') + 1));
  starloop_client* client = nullptr;
  ASSERT_EQ(starloop_open(&client, name.c_str(), 10'000), STARLOOP_OK) << starloop_last_error();
  // One host after the other; the first one leaves in the middle of a frame.
  for (std::uint32_t round = 1; round <= 3; ++round) {
    const usbip_host::Connection host(port);
    ASSERT_TRUE(host.connected());
    host.say(usbip_host::import_request("1-1"));
    ASSERT_EQ(host.hear(320).size(), 320U);
    const Bytes session(4, std::byte{1});
    host.say(
        usbip_host::submit(1, usbip_host::kOut, 0, 0, 4, {0x41, 2, 0, 0, 0, 0, 4, 0}, session));
    static_cast<void>(host.hear_answer(false));
    host.say(usbip_host::submit(2, usbip_host::kIn, 2, 0, 1024));
    const Bytes first = host.hear_answer(true);
    ASSERT_TRUE(drivers::decode_usb_message(first).ok());
    EXPECT_EQ(drivers::decode_usb_message(first).value().status.credits, 3U);

    const auto image = usb_frames::image(round);
    Bytes frame(5 * 1024 * 8);
    frame.resize(drivers::encode_usb_frame(usb_frames::frame(round, image),
                                           drivers::PixelFormat::kPacked11, frame)
                     .value());
    if (round == 1) {
      frame.resize(1024);
      host.say(usbip_host::submit(3, usbip_host::kOut, 1, 0, 1024, {}, frame));
      static_cast<void>(host.hear_answer(false));
      continue;
    }
    host.say(usbip_host::submit(3, usbip_host::kOut, 1, usbip_host::kZeroPacket,
                                static_cast<std::uint32_t>(frame.size()), {}, frame));
    static_cast<void>(host.hear_answer(false));
    starloop_frame seen;
    ASSERT_EQ(starloop_wait_frame(client, &seen, 60'000), STARLOOP_OK) << starloop_last_error();
    EXPECT_EQ(seen.sequence, round);
    EXPECT_EQ(seen.width_px, usb_frames::kWidth_px);
    EXPECT_DOUBLE_EQ(seen.trim_rad[0], 1e-3);
    EXPECT_DOUBLE_EQ(seen.rate_rad_s[2], 3e-6);
    EXPECT_TRUE(std::equal(image.pixels().begin(), image.pixels().end(), seen.pixels));
    const starloop_answer answer = starloop_answer_to(&seen);
    const double offset[2] = {1e-6, 2e-6};
    const double rate[2] = {0, 0};
    ASSERT_EQ(starloop_send_trim(client, &answer, offset, rate, 5), STARLOOP_OK);
    EXPECT_EQ(starloop_release_frame(client, &seen), STARLOOP_OK);
    // Statuses first, whenever they come; then the command.
    for (std::uint32_t n = 10;; ++n) {
      host.say(usbip_host::submit(n, usbip_host::kIn, 2, 0, 1024));
      const Bytes bytes = host.hear_answer(true);
      const auto message = drivers::decode_usb_message(bytes);
      ASSERT_TRUE(message.ok());
      if (message.value().kind == drivers::UsbMessage::Kind::kStatus) continue;
      const auto command = hil::decode_command(message.value().command);
      ASSERT_TRUE(command.ok());
      EXPECT_EQ(command.value().answers_frame, round);
      EXPECT_DOUBLE_EQ(command.value().trim_offset_rad[1], 2e-6);
      break;
    }
  }
  // What is no USB/IP closes the connection, and the next host is served.
  {
    const usbip_host::Connection stranger(port);
    stranger.say(Bytes(64, std::byte{0x47}));
    EXPECT_TRUE(stranger.hear(1).empty());
  }
  const usbip_host::Connection next(port);
  next.say(usbip_host::import_request("1-1"));
  EXPECT_EQ(next.hear(320).size(), 320U);
  starloop_close(client);
}

}  // namespace
