#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "engine/core/expected.h"
#include "engine/core/image.h"
#include "engine/core/time.h"

namespace hil {

/// Offsets of the boresight from the predicted line of sight, towards its +x (u) and +y (v).
using TrimAngles = std::array<double, 2>;

/// What leaves the camera head: pixels, and what a camera knows about itself.
struct Frame {
  std::uint64_t sequence = 0;
  engine::SimTime shutter_open{};
  engine::Duration exposure{};
  int bits = 11;
  TrimAngles trim_rad{};  ///< read back from the actuator, at mid-exposure
  const engine::DnImage* pixels = nullptr;
};

/// Where in a frame the software under test believes the target to be.
struct Detection {
  engine::PixelPoint centroid_px;
  float confidence = 0;  ///< in [0, 1]; 0 is no detection
};

enum class CommandKind : std::uint8_t {
  kReport = 0,  ///< a detection, nothing to obey
  kTrim = 1,    ///< a detection and a trim
};

/// What the software under test sends back.
struct Command {
  std::uint64_t sequence = 0;
  std::uint64_t answers_frame = 0;
  CommandKind kind = CommandKind::kReport;
  /// kTrim: follow offset + rate * (t - reference).
  TrimAngles trim_offset_rad{};
  TrimAngles trim_rate_rad_s{};
  engine::SimTime reference{};
  Detection detection;
};

/// Where frames go: V4L2, USB, shared memory, mock, file, or several at once.
/// Opening one may throw. Using it does not throw, allocate, or block longer than `timeout`.
class FrameSink {
 public:
  virtual ~FrameSink() = default;
  /// Thread: sender.
  virtual engine::Status send(const Frame& frame, engine::Duration timeout) noexcept = 0;
};

/// Where commands come from: a socket, the USB link's return path, the mock, a log being replayed.
class CommandSource {
 public:
  virtual ~CommandSource() = default;
  /// Thread: receiver.
  virtual engine::Expected<Command> receive(engine::Duration timeout) noexcept = 0;
};

/// Several sinks as one: all get every frame, the first one's answer counts.
class FanOut final : public FrameSink {
 public:
  FanOut(FrameSink& first, FrameSink& second) : first_(first), second_(second) {}
  engine::Status send(const Frame& frame, engine::Duration timeout) noexcept override {
    const engine::Status status = first_.send(frame, timeout);
    static_cast<void>(second_.send(frame, timeout));
    return status;
  }

 private:
  FrameSink& first_;
  FrameSink& second_;
};

}  // namespace hil
