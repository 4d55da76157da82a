#pragma once

#include <span>
#include <vector>

#include "engine/core/image.h"
#include "engine/detector/detector_spec.h"

namespace engine {

/// How the pixels of one sensor differ from each other, for good: what its serial number draws, or
/// the user's maps.
///
/// PRNU is normal, cut at no response at all; DSNU is log-normal, so that no dark current is
/// negative (both by their rms, as in EMVA 1288 release 4, sections 4.2 and 8). Hot pixels and
/// columns have an exponential dark current besides; dead ones collect nothing.
/// We differ from EMVA 1288, whose non-uniformity has row and column parts: ours is white.
/// Leaves out: non-linearity, traps, a bias of each column's amplifier.
/// Thread: any; reading is loop-safe, making is not.
class SensorMaps {
 public:
  /// Of a sensor whose pixels are all alike: no memory.
  SensorMaps() = default;
  /// Of photosites. Throws ConfigError for a map that cannot be read or does not fit the sensor.
  SensorMaps(const DetectorSpec& spec, int width, int height);

  /// Of pixels that are so many photosites wide and high: they respond as these do on average, and
  /// have all their dark current. Pre: the sensor is a whole number of them.
  [[nodiscard]] SensorMaps binned(int binning) const;
  /// What of it lies in a window. Pre: within the sensor.
  [[nodiscard]] SensorMaps cut(const PixelRect& window) const;

  /// 1 + PRNU of each pixel in raster order, 0 where it is dead; empty: 1 everywhere.
  [[nodiscard]] std::span<const float> response() const noexcept { return response_; }
  /// What each pixel collects without light, background included; empty: all alike.
  [[nodiscard]] std::span<const float> dark_e_s() const noexcept { return dark_e_s_; }

 private:
  void fill_response(const DetectorSpec& spec);
  void fill_dark(const DetectorSpec& spec);
  void spoil_pixels(const DetectorSpec& spec);
  void spoil_columns(const DetectorSpec& spec);
  void kill(std::size_t pixel) noexcept;

  int width_ = 0;
  int height_ = 0;
  std::vector<float> response_;
  std::vector<float> dark_e_s_;
};

}  // namespace engine
