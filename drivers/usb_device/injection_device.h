#pragma once

#include <array>

#include "drivers/usb_device/frame_intake.h"
#include "drivers/usb_device/usb_function.h"

namespace drivers {

/// The frame-injection device of usb_protocol.md as a function: frames in, messages out.
class InjectionDevice final : public UsbFunction {
 public:
  explicit InjectionDevice(const UsbLimits& limits);

  [[nodiscard]] FrameIntake& intake() noexcept { return intake_; }

  [[nodiscard]] const UsbDescriptors& descriptors() const noexcept override { return descriptors_; }
  [[nodiscard]] std::optional<std::vector<std::byte>> control(
      const UsbSetup& setup, std::span<const std::byte> data) override;
  void take(unsigned endpoint, std::span<const std::byte> bytes, bool ends) override;
  [[nodiscard]] std::optional<UsbAnswer> give(unsigned endpoint, std::size_t room) override;
  void reset() override { intake_.reset(0); }

 private:
  FrameIntake intake_;
  UsbDescriptors descriptors_;
  std::array<std::byte, kLargestUsbMessage> message_{};
};

}  // namespace drivers
