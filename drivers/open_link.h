#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "drivers/mock_link.h"
#include "drivers/shm_link.h"
#include "drivers/side_link.h"
#include "drivers/usb_link.h"
#include "drivers/v4l2_link.h"
#include "engine/core/config_reader.h"
#include "hil/camera_link.h"
#include "hil/no_commands.h"

namespace drivers {

enum class LinkKind : std::uint8_t {
  kMock,  ///< inside this process, for the built-in tracker
  kShm,   ///< shared memory, for software in a process of its own
  kV4l2,  ///< a virtual camera
  kUsb,   ///< a frame-injection device
  kFile,  ///< a folder of FITS files
};

/// Where frames go, by a name:
///   mock                      the built-in tracker
///   shm:NAME                  shared memory of that name
///   v4l2:NODE, v4l2:LABEL     "/dev/video2", or the label of the card
///   usb, usb:VID:PID[:SERIAL] the first device with the interface, or that one; hexadecimal
///   file:FOLDER               FITS files
struct LinkTarget {
  std::string name = "mock";  ///< as it was written
  LinkKind kind = LinkKind::kMock;
  std::string place;  ///< what follows the colon, of shm, v4l2 and file
  UsbSpec usb;
};

/// The table `link` of a scenario.
struct LinkSpec {
  std::vector<LinkTarget> to{LinkTarget{}};  ///< at least one
  int slots = 4;                             ///< shm: frames in the ring, in [2, 16]
  bool telemetry_row = false;  ///< one row more, below the image (hil/telemetry_row.h)
  V4l2Format v4l2_format = V4l2Format::kY16;
  V4l2Method v4l2_method = V4l2Method::kAuto;
  bool v4l2_to_top = false;
  bool usb_packed = true;

  [[nodiscard]] bool has(LinkKind kind) const noexcept;
};

/// Throws engine::ConfigError.
[[nodiscard]] LinkSpec read_link(const engine::ConfigTable& table);

/// The camera at this end of the cable.
struct LinkCamera {
  int width_px = 0;
  int height_px = 0;  ///< without a telemetry row
  int bits = 11;
  engine::Duration period{100'000'000};
};

/// What became of one of several links.
struct LinkOutcome {
  std::string name;
  bool first = false;  ///< then its counts are the loop's own, and the next four stay empty
  std::uint64_t sent = 0;
  std::uint64_t left_out = 0;  ///< it was still busy with others
  std::uint64_t failed = 0;
  std::string failure;  ///< the first one
  std::optional<UsbCounts> usb;
};

/// Open links: where frames go and where commands come from. What the first one says of a frame is
/// what became of it; the others count for themselves.
class OpenLink {
 public:
  /// Throws std::runtime_error when the world does not let it.
  OpenLink(const LinkSpec& spec, const LinkCamera& camera, hil::WhenBusy when_busy);
  ~OpenLink();
  OpenLink(const OpenLink&) = delete;
  OpenLink& operator=(const OpenLink&) = delete;

  [[nodiscard]] hil::FrameSink& frames() const noexcept { return *frames_; }
  /// All that have a way back; one that never says anything where none has.
  [[nodiscard]] const std::vector<hil::CommandSource*>& commands() const noexcept {
    return sources_;
  }
  /// The device's side of a mock; null when there is none.
  [[nodiscard]] MockLink* mock() const noexcept { return mock_; }
  /// One line for the user.
  [[nodiscard]] std::string text() const;

  /// Ends the links beside the first. After the run.
  void finish() noexcept;
  /// After finish().
  [[nodiscard]] std::vector<LinkOutcome> outcomes() const;

 private:
  [[nodiscard]] std::unique_ptr<hil::FrameSink> open(const LinkSpec& spec, const LinkTarget& target,
                                                     const LinkCamera& camera,
                                                     hil::WhenBusy when_busy);

  std::vector<LinkTarget> targets_;
  std::unique_ptr<hil::FrameSink> first_;
  std::vector<std::unique_ptr<SideLink>> beside_;
  std::vector<std::unique_ptr<hil::FanOut>> fans_;
  hil::FrameSink* frames_ = nullptr;
  std::vector<hil::CommandSource*> sources_;
  hil::NoCommands nobody_;
  MockLink* mock_ = nullptr;
  std::vector<const UsbLink*> usb_;  // by target; null for the others
};

}  // namespace drivers
