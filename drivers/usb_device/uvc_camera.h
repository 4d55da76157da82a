#pragma once

#include <array>
#include <functional>
#include <optional>
#include <vector>

#include "drivers/usb_device/usb_function.h"
#include "drivers/usb_device/uvc_controls.h"
#include "drivers/usb_device/uvc_stream.h"

namespace drivers {

/// A USB Video Class camera as a function: frames that it is offered go out in the format that the
/// host has chosen, and its controls become commands. uvc_protocol.md is what a host sees.
///
/// What a host may not ask is stalled, counted, and told of by the request's error code. A host
/// that comes begins with nothing set; counts go on.
/// Thread: one. Allocates.
class UvcCamera final : public UsbFunction {
 public:
  /// Passes a command on; false: it could not.
  using Obey = std::function<bool(const hil::Command&)>;

  UvcCamera(const UvcSpec& spec, Obey obey);

  /// False: it is of another size. Otherwise it is the newest from now on.
  bool offer(const FrameView& frame) noexcept;
  [[nodiscard]] UvcCounts counts() const noexcept;

  [[nodiscard]] const UsbDescriptors& descriptors() const noexcept override { return descriptors_; }
  [[nodiscard]] std::optional<std::vector<std::byte>> control(
      const UsbSetup& setup, std::span<const std::byte> data) override;
  void take(unsigned endpoint, std::span<const std::byte> bytes, bool ends) override;
  [[nodiscard]] std::optional<UsbAnswer> give(unsigned endpoint, std::size_t room) override;
  void clear_halt(unsigned address) override;
  void reset() override;

  /// Why a request was stalled, as UVC 1.1 numbers it in 4.2.1.2.
  enum class Refusal : std::uint8_t {
    kNone = 0,
    kNotReady = 1,
    kOutOfRange = 4,
    kUnit = 5,
    kControl = 6,
    kRequest = 7,
  };

 private:
  using Bytes = std::vector<std::byte>;
  /// A control as a host asks for it: `selector` of an entity of an interface.
  struct Place {
    unsigned interface = 0;
    unsigned entity = 0;
    unsigned selector = 0;
  };
  /// Empty values: it has none.
  struct Control {
    unsigned info = 0;  // UVC_CONTROL_CAP_...
    Bytes current;
    Bytes least;
    Bytes most;
    Bytes step;
    Bytes first;  // the default
  };
  static constexpr std::size_t kRemembered = 128;

  /// The control there, or why there is none.
  [[nodiscard]] Refusal find(const Place& place, Control& out) const;
  [[nodiscard]] Control stream_control(unsigned selector) const;
  [[nodiscard]] Control unit_control(UvcSelector selector) const;
  [[nodiscard]] Refusal answer(const UsbSetup& setup, std::span<const std::byte> data, Bytes& out);
  [[nodiscard]] Refusal set(const Place& place, std::span<const std::byte> data);
  [[nodiscard]] Refusal set_stream(unsigned selector, std::span<const std::byte> data);
  [[nodiscard]] Refusal pass_on(const hil::Command& command);
  [[nodiscard]] Bytes probe_bytes(UvcFormat format) const;
  [[nodiscard]] UvcFrameNews selected() const noexcept;

  UvcSpec spec_;
  Obey obey_;
  UsbDescriptors descriptors_;
  UvcStream stream_;
  std::array<UvcFrameNews, kRemembered> news_;
  std::uint64_t newest_ = 0;  // how many were put there
  UvcCounts counts_;          // those that are not the stream's

  // What the host has set.
  UvcFormat probed_ = UvcFormat::kY16;
  UvcFormat committed_ = UvcFormat::kY16;
  std::uint16_t hint_ = 0;
  PanTilt pan_tilt_;
  UvcCommandBytes command_{};
  std::uint64_t select_ = 0;
  Refusal refusal_ = Refusal::kNone;
};

}  // namespace drivers
