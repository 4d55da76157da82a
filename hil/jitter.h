#pragma once

#include <string>
#include <vector>

#include "engine/core/config_reader.h"
#include "engine/core/time.h"
#include "hil/camera_link.h"

namespace hil {

/// One sinusoid: amplitude * sin(2 pi f t + phase), to and fro along one direction.
struct JitterLine {
  double frequency_hz = 0;
  double amplitude_rad = 0;
  double direction_rad = 0;  ///< from +x (u) towards +y (v)
  double phase_rad = 0;
};

/// One-sided power spectral densities of the two axes, linear between the points, nothing beyond.
struct JitterDensity {
  double frequency_hz = 0;
  std::array<double, 2> rad2_hz{};
};

/// Where the boresight was, at growing times; linear in between.
struct JitterSample {
  double time_s = 0;
  TrimAngles rad{};
};

struct JitterSpec {
  std::vector<JitterLine> lines;
  std::vector<JitterDensity> densities;  ///< empty, or at least two, frequencies growing
  std::vector<JitterSample> samples;     ///< empty, or at least two, times growing
};
/// Keys `psd_file` ("frequency_hz,x_rad2_hz,y_rad2_hz") and `series_file` ("t_s,x_urad,y_urad") of
/// [jitter], and a table [jitter.lines.NAME] for each line: frequency_hz, amplitude_urad,
/// direction_deg, phase_deg.
[[nodiscard]] JitterSpec read_jitter(const engine::ConfigReader& config);

/// Vibration of the boresight: a pure function of simulated time.
///
/// Lines, density and series add up. A density becomes kSinusoids sinusoids an axis, each with the
/// same share of its power, so that the mean square over a long time is the integral of the
/// density; where a sinusoid lies within its share of the band, and its phase, are drawn. What a
/// spectrum says is reached to one share; nothing repeats in a run. Shinozuka & Jan 1972,
/// DOI 10.1016/0022-460X(72)90600-1, who space frequencies evenly; ours are drawn, because an even
/// spacing repeats after 1 / spacing.
/// A series repeats: after its last sample the first follows by the mean spacing, so that the
/// boresight never jumps. Its first time stands for `start`.
/// Thread: any. Loop-safe once built.
class Jitter {
 public:
  static constexpr std::size_t kSinusoids = 128;

  Jitter() = default;
  /// Allocates. Pre: `spec` as read_jitter() gives it.
  Jitter(const JitterSpec& spec, std::uint64_t seed, engine::SimTime start);

  [[nodiscard]] TrimAngles at(engine::SimTime t) const noexcept;

 private:
  /// Towards x and towards y.
  struct Sinusoid {
    double frequency_hz = 0;
    double phase_rad = 0;
    TrimAngles amplitude_rad{};
  };
  void realise(const std::vector<JitterDensity>& densities, std::size_t axis, std::uint64_t seed);
  [[nodiscard]] TrimAngles in_series(double t_s) const noexcept;

  engine::SimTime start_{};
  std::vector<Sinusoid> sinusoids_;
  std::vector<JitterSample> samples_;  // the first again at the end, one period later
};

}  // namespace hil
