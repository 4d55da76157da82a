// starloop_usb_device --camera as a process: frames of a camera in shared memory out to a host over
// TCP, and what the host commands back to the camera.

#include <memory>
#include <string>
#include <thread>

#include <gtest/gtest.h>
#include <unistd.h>

#include "drivers/shm_link.h"
#include "drivers/usb_device/uvc_controls.h"
#include "tests/support/process.h"
#include "tests/support/usb_frames.h"
#include "tests/support/usbip_connection.h"
#include "tests/support/uvc_frames.h"

namespace {

using usbip_host::Bytes;
using usbip_host::Connection;
using usbip_host::kIn;
using usbip_host::kOut;
using usbip_host::submit;

constexpr engine::Duration kLong{60'000'000'000};  // only what is wrong waits this long

/// What `starloop run --set link.to=shm:NAME` is to the device.
class Camera {
 public:
  explicit Camera(const std::string& name, int height_px = usb_frames::kHeight_px)
      : link_(std::make_unique<drivers::ShmLink>(drivers::ShmSpec{.name = name},
                                                 usb_frames::kWidth_px, height_px)),
        image_(usb_frames::kWidth_px, height_px) {}

  void wait_for_reader() const {
    while (!link_->has_reader()) std::this_thread::yield();
  }
  void send(std::uint64_t sequence) {
    numbered_frames::fill(image_, sequence);
    ASSERT_TRUE(link_->send(usb_frames::frame(sequence, image_), engine::Duration{}).ok());
  }
  [[nodiscard]] hil::Command command() {
    const auto command = link_->receive(kLong);
    EXPECT_TRUE(command.ok());
    return command.ok() ? command.value() : hil::Command{};
  }

 private:
  std::unique_ptr<drivers::ShmLink> link_;
  engine::DnImage image_;
};

int port_of(const std::string& line) { return std::stoi(line.substr(line.find(':') + 1)); }

/// Imports the device, and has Y16 committed.
void begin(const Connection& host) {
  ASSERT_TRUE(host.connected());
  host.say(usbip_host::import_request("1-1"));
  ASSERT_EQ(host.hear(320).size(), 320U);
  Bytes wish(34);
  wish[2] = wish[3] = std::byte{1};
  host.say(submit(1, kOut, 0, 0, 34, {0x21, 1, 0, 2, 1, 0, 34, 0}, wish));
  static_cast<void>(host.hear_answer(false));
}

Bytes counts_request(std::uint32_t number) {
  return submit(number, kIn, 0, 0, 128, {0xA1, 0x81, 0, 4, 0, 2, 128, 0});
}

/// A frame in one payload, as the camera gave it.
void expect_frame(const Connection& host, Camera& camera, std::uint64_t sequence) {
  host.say(submit(100, kIn, 1, 0, 32768));
  // What answers this has seen that.
  host.say(counts_request(101));
  ASSERT_EQ(host.hear_answer(true).size(), drivers::kUvcCountsBytes);
  camera.send(sequence);
  const Bytes payload = host.hear_answer(true);
  const Bytes expected =
      uvc_frames::expected(uvc_frames::spec(), drivers::UvcFormat::kY16, sequence);
  ASSERT_EQ(payload.size(), 6 + expected.size());
  EXPECT_TRUE(std::equal(expected.begin(), expected.end(), payload.begin() + 6));
}

TEST(UsbCamera, FramesGoToTheHostAndItsCommandsToTheCamera) {
  const std::string name = "starloop-camera-test-" + std::to_string(getpid());
  auto camera = std::make_unique<Camera>(name);
  process::Process device({STARLOOP_USB_DEVICE, "--camera", name, "--port", "0"});
  camera->wait_for_reader();
  camera->send(1);
  camera->send(3);
  const std::string line = device.line();
  EXPECT_NE(line.find("a camera of 72 x 50, 11 bits, every 100.000 ms"), std::string::npos) << line;
  const int port = port_of(line);
  for (std::uint64_t round = 1; round <= 3; ++round) {  // hosts come and go
    const Connection host(port);
    begin(host);
    expect_frame(host, *camera, 10 * round);
    hil::Command c;
    c.kind = hil::CommandKind::kTrim;
    c.answers_frame = 10 * round;
    c.trim_offset_rad = {-1e-6, 2e-9};
    const auto bytes = drivers::encode_uvc_command(c);
    host.say(submit(2, kOut, 0, 0, 72, {0x21, 1, 0, 1, 0, 2, 72, 0}, bytes));
    static_cast<void>(host.hear_answer(false));
    const hil::Command seen = camera->command();
    EXPECT_EQ(seen.kind, hil::CommandKind::kTrim);
    EXPECT_EQ(seen.answers_frame, 10 * round);
    EXPECT_DOUBLE_EQ(seen.trim_offset_rad[0], -1e-6);
    EXPECT_DOUBLE_EQ(seen.trim_offset_rad[1], 2e-9);
  }
  for (int i = 0; i < 3; ++i) EXPECT_TRUE(device.line().starts_with("host gone: "));
}

TEST(UsbCamera, ACameraThatComesBackIsTheSameAndOneOfAnotherSizeIsPluggedInAnew) {
  const std::string name = "starloop-camera-back-" + std::to_string(getpid());
  auto camera = std::make_unique<Camera>(name);
  process::Process device({STARLOOP_USB_DEVICE, "--camera", name, "--port", "0"});
  camera->wait_for_reader();
  camera->send(1);
  camera->send(2);
  const int port = port_of(device.line());
  const Connection host(port);
  begin(host);
  expect_frame(host, *camera, 5);
  camera.reset();
  camera = std::make_unique<Camera>(name);
  camera->wait_for_reader();
  expect_frame(host, *camera, 2);

  camera.reset();
  camera = std::make_unique<Camera>(name, usb_frames::kHeight_px + 1);
  camera->wait_for_reader();
  camera->send(1);
  EXPECT_TRUE(host.hear(48).empty()) << "unplugged";
  EXPECT_TRUE(device.line().starts_with("host gone: "));
  EXPECT_TRUE(device.line().starts_with("the frames have changed"));
  camera->wait_for_reader();
  camera->send(2);
  camera->send(3);
  const std::string line = device.line();
  EXPECT_NE(line.find("a camera of 72 x 51,"), std::string::npos) << line;
  EXPECT_EQ(port_of(line), port);
  begin(Connection(port));
}

}  // namespace
