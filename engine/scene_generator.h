#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "engine/core/image.h"
#include "engine/detector/detector.h"
#include "engine/optics/optics.h"
#include "engine/render/renderer.h"
#include "engine/scene/snapshot.h"
#include "engine/starlight.h"

namespace engine {

/// Of a body besides the target, as FrameTruth has it of the target. What hides it, or shades it,
/// is not in these numbers.
struct CompanionTruth {
  double range_m = 0;
  double phase_angle_rad = 0;
  PixelPoint target_px;         ///< the image of its centre, in or out of the frame
  double smear_px = 0;          ///< its own; the frame has the target's for all
  double visible_fraction = 0;  ///< of its image, in the frame, hidden or not
  double sun_irradiance_w_m2 = 0;
};

/// Of a part that turns by itself, at mid-exposure.
struct PartTruth {
  double angle_rad = 0;  ///< about its axis, from where the mesh has it
  double second_angle_rad = 0;
  bool at_limit = false;  ///< a limit keeps it from its place
};

/// What a frame really shows, before noise. The software under test never sees it. With companions
/// in sight the light of the target is what of it is seen past them, its mask too.
struct FrameTruth {
  double range_m = 0;
  double range_rate_m_s = 0;
  double line_of_sight_rate_rad_s = 0;
  double phase_angle_rad = 0;
  PixelPoint target_px;  ///< the image of the target's centre, in or out of the frame
  /// The centre of the target's light on the detector, free of noise and not clipped at full well;
  /// not a number when none of it falls there. With the Earth in the frame, that of the light
  /// before it is blurred: the same but where the frame's edge cuts the target.
  PixelPoint photocentre_px{std::numeric_limits<double>::quiet_NaN(),
                            std::numeric_limits<double>::quiet_NaN()};
  double smear_px = 0;  ///< twice as far as its image is from where it is at mid-exposure
  double peak_e = 0;    ///< of the target's light, as below
  PixelRect box;        ///< around the mask; empty when the mask is
  int mask_px = 0;      ///< pixels of the mask, of those too that it had no room for
  /// Of all the mask's light against its shot noise and that of the background; 0 without a mask.
  double signal_to_noise = 0;
  double visible_fraction = 0;  ///< RenderReport's: of the target, in the frame, lit or not
  double sun_irradiance_w_m2 = 0;
  double earthshine_w_m2 = 0;
  bool earth_behind = false;
  bool roll_is_fallback = false;
  bool attitude_is_fallback = false;
  std::array<CompanionTruth, kMostCompanions> companion{};  ///< the first `companions` of them
  std::size_t companions = 0;
  std::array<PartTruth, kMostParts> part{};  ///< the first `parts` of them
  std::size_t parts = 0;
};

/// The pixels where the target's light, free of noise, is above one sigma of the noise of a pixel
/// that sees the background only. Before the Earth the target's light is what it sends less what it
/// hides, and stands out from one sigma either way. As runs of
/// columns [begin, end), row by row from the top. Adding never allocates; what is too much is lost,
/// and the mask says so.
class TruthMask {
 public:
  struct Run {
    std::uint16_t row = 0;
    std::uint16_t begin = 0;
    std::uint16_t end = 0;
  };
  explicit TruthMask(std::size_t most_runs = 0) { runs_.reserve(most_runs); }

  void clear() noexcept {
    runs_.clear();
    truncated_ = false;
  }
  void add(const Run& run) noexcept {
    if (runs_.size() < runs_.capacity()) {
      runs_.push_back(run);
    } else {
      truncated_ = true;
    }
  }
  /// As far as there is room.
  void copy(const TruthMask& other) noexcept {
    clear();
    for (const Run& run : other.runs()) add(run);
    truncated_ = truncated_ || other.truncated_;
  }
  [[nodiscard]] std::span<const Run> runs() const noexcept { return runs_; }
  [[nodiscard]] bool truncated() const noexcept { return truncated_; }

 private:
  std::vector<Run> runs_;
  bool truncated_ = false;
};

/// Light on the detector: of the brightest pixel, whatever shines there, and of the even sky.
struct FieldLight {
  PixelPoint brightest_px;
  double brightest_w_m2 = 0;
  double sky_w_m2 = 0;
};

/// How long each stage took. All zero when nobody gave the chain a stopwatch.
struct StageTimes {
  Duration geometry{};
  Duration render{};
  Duration optics{};
  Duration detector{};
};

struct FrameReport {
  FrameTruth truth;
  RenderReport render;
  OpticsReport optics;
  StarReport stars;
  DetectorReport detector;
  FieldLight light;
  StageTimes times;
  int peak_dn = 0;
};

/// The engine seen from outside: a frame as a function of time, attitude and seed.
/// Thread: loop. Loop-safe.
class SceneGenerator {
 public:
  virtual ~SceneGenerator() = default;
  /// Overwrites `out` and `mask`.
  virtual FrameReport expose(const Shot& shot, Budget budget, DnImage& out,
                             TruthMask& mask) noexcept = 0;
};

}  // namespace engine
