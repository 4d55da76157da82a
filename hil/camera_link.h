#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <span>

#include "engine/core/expected.h"
#include "engine/core/image.h"
#include "engine/core/time.h"
#include "engine/scene_generator.h"
#include "hil/refusal.h"

namespace hil {

/// Offsets of the boresight from the guidance's own line, towards its +x (u) and +y (v).
using TrimAngles = std::array<double, 2>;
/// Unit quaternion w, x, y, z of the passive rotation J2000 -> camera axes.
using Quaternion = std::array<double, 4>;

/// What star tracker and gyro say at mid-exposure.
struct MeasuredAttitude {
  Quaternion j2000_to_camera{1, 0, 0, 0};
  std::array<double, 3> rate_rad_s{};  ///< of the camera, in camera axes
};

/// What the loop had counted when a frame left it: the software under test can see its own losses.
struct LoopCounts {
  std::uint64_t skipped = 0;
  std::uint64_t dropped = 0;
  std::uint64_t late = 0;
  std::uint64_t commands = 0;  ///< obeyed
  RefusalCounts refused{};     ///< by the command gate
};

/// What leaves the camera head: pixels, and what a camera knows about itself.
struct Frame {
  std::uint64_t sequence = 0;
  engine::SimTime shutter_open{};
  engine::Duration exposure{};
  int bits = 11;
  TrimAngles trim_rad{};  ///< read back from the actuator, at mid-exposure
  MeasuredAttitude measured;
  LoopCounts counts;
  const engine::DnImage* pixels = nullptr;
  /// A row more, below the image, that survives links without metadata (telemetry_row.h). Empty
  /// unless asked for; as wide as the image.
  std::span<const std::uint16_t> telemetry_row;
  /// Which pixels the target's light reaches: for recorders. No link sends it.
  const engine::TruthMask* truth_mask = nullptr;
};

/// Where in a frame the software under test believes a target to be.
struct Detection {
  engine::PixelPoint centroid_px;
  float confidence = 0;  ///< in [0, 1]; 0 is no detection
  std::uint32_t id = 0;  ///< the software's own name for the target
  /// Edges left, top, right, bottom, px, pixel (0, 0) reaching from -0.5 to 0.5; all zero: not
  /// said.
  std::array<float, 4> box_px{};
};

enum class CommandKind : std::uint8_t {
  kReport = 0,    ///< a detection, nothing to obey
  kTrim = 1,      ///< offset and rate of the boresight
  kRate = 2,      ///< rate alone, from where the boresight is at the reference time
  kAttitude = 3,  ///< an attitude, and the rate at which it turns
  kMode = 4,      ///< which line the guidance follows
  kPing = 5,      ///< are you there
  kTrigger = 6,   ///< open the shutter, when the loop waits for that
};
inline constexpr int kCommandKinds = 7;

/// Which line the camera follows before trims.
enum class GuidanceMode : std::uint8_t {
  kPredictedTarget = 0,  ///< the apparent line of sight, as far as the orbits are known
  kNadir = 1,
  kInertial = 2,   ///< stays where it was when the mode was set
  kCommanded = 3,  ///< the last attitude command
};
inline constexpr int kGuidanceModes = 4;

/// What the software under test sends back. Each may carry a detection besides.
struct Command {
  std::uint64_t sequence = 0;
  std::uint64_t answers_frame = std::numeric_limits<std::uint64_t>::max();  ///< the default: none
  CommandKind kind = CommandKind::kReport;
  bool more_follow = false;         ///< this is not yet all of the answer to that frame
  engine::SimTime made_at{};        ///< on the camera's time line, as far as the sender knows it
  engine::Duration time_to_live{};  ///< refused when older; zero: never too old
  /// kTrim: follow offset + rate * (t - reference). kRate: the rate alone.
  TrimAngles trim_offset_rad{};
  TrimAngles trim_rate_rad_s{};
  engine::SimTime reference{};
  /// kAttitude: this at the reference time, turning at this rate in camera axes.
  MeasuredAttitude attitude;
  GuidanceMode mode = GuidanceMode::kPredictedTarget;  ///< kMode
  Detection detection;
  /// Who sent it, told apart by the source: each sender's sequence numbers stand for themselves.
  std::uint32_t sender = 0;
};

/// Where frames go: V4L2, USB, shared memory, mock, file, or several at once.
/// Opening one may throw. Using it does not throw, allocate, or block longer than `timeout`.
class FrameSink {
 public:
  virtual ~FrameSink() = default;
  /// Thread: sender.
  virtual engine::Status send(const Frame& frame, engine::Duration timeout) noexcept = 0;
  /// Whether somebody is there to read: what a start barrier waits for. Thread: any.
  [[nodiscard]] virtual bool has_reader() const noexcept { return true; }
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
  [[nodiscard]] bool has_reader() const noexcept override {
    return first_.has_reader() && second_.has_reader();
  }

 private:
  FrameSink& first_;
  FrameSink& second_;
};

}  // namespace hil
