#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "drivers/usb_device/frame_intake.h"

namespace test_support {

/// A frame-injection device behind a usbfs of umockdev's: libusb and the link are the real ones,
/// the kernel is this. Only in a program that runs under umockdev-wrapper. Thread: any.
class UsbDeviceModel {
 public:
  explicit UsbDeviceModel(const drivers::UsbLimits& limits);
  ~UsbDeviceModel();
  UsbDeviceModel(const UsbDeviceModel&) = delete;
  UsbDeviceModel& operator=(const UsbDeviceModel&) = delete;

  void plug();
  /// Transfers under way end with "no device", as do all calls from then on.
  void unplug();

  /// Calls with the device's side, which nobody else touches meanwhile.
  void with(const std::function<void(drivers::FrameIntake&)>& use);

  /// From here on the bulk OUT endpoint takes so many bytes and then nothing more, until go_on().
  void stop_after(std::size_t bytes);
  void go_on();
  /// It takes so many bytes and then stalls, until the host clears the halt.
  void stall_after(std::size_t bytes);
  /// The next bulk IN transfer ends with this errno (EPIPE, EOVERFLOW, EPROTO), and no data.
  void fail_next_in(int error);
  /// The next bulk IN transfer has these bytes, whatever they are.
  void say(std::vector<std::byte> bytes);
  /// What the device has to say is lost on its way, while `lose` holds; said is said.
  void lose_messages(bool lose);
  [[nodiscard]] int messages_lost() const;
  /// Resets so far.
  [[nodiscard]] int resets() const;

 private:
  struct Self;
  std::unique_ptr<Self> self_;
};

}  // namespace test_support
