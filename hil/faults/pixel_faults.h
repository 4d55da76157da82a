#pragma once

#include <cstdint>
#include <vector>

#include "engine/core/image.h"
#include "engine/core/random.h"

namespace hil {

/// Damage to a picture of `full_scale` = 2^bits - 1. All of it comes after the detector's own
/// model: these are appearances, told in DN. Thread: any. Loop-safe.

/// What one particle left behind.
struct RayTrack {
  std::int64_t start = 0;  ///< pixel, row by row
  int pixels = 0;          ///< touched, at least 1
  std::int64_t added_dn = 0;
};
/// A cosmic ray: a straight line from anywhere in any direction, its length and the charge it
/// leaves in each pixel exponentially distributed, cut where the image ends. Leaves out: the angle
/// of incidence (long tracks leave more a pixel), energy lost along the way, delta electrons, and
/// the diffusion of charge.
[[nodiscard]] RayTrack add_ray(engine::Draws& draws, double mean_length_px, double mean_dn,
                               int full_scale, engine::DnImage& image) noexcept;

/// Columns of pixels at full scale, bleeding into those above and below. The charge beyond full
/// well is gone after the converter, so nothing is conserved: a run of n pixels makes ceil(bleed n)
/// pixels at each end as bright as itself.
class Bloom {
 public:
  explicit Bloom(int width_px) : bright_(static_cast<std::size_t>(width_px)) {}

  /// How many pixels are at full scale.
  [[nodiscard]] std::int64_t look(const engine::DnImage& image, int full_scale) noexcept;
  /// Pre: look() at the same pixels. Returns how many pixels changed.
  [[nodiscard]] std::int64_t apply(double bleed, int full_scale, engine::DnImage& image) noexcept;

 private:
  std::vector<std::uint8_t> bright_;  // columns with a pixel at full scale
};

/// Both return how many pixels changed.
[[nodiscard]] std::int64_t heat_column(int column, int dn, int full_scale,
                                       engine::DnImage& image) noexcept;
[[nodiscard]] std::int64_t stick_column(int column, int dn, engine::DnImage& image) noexcept;

/// Which bits of a picture are wrong, each with the same chance and alone: the gaps between them
/// are geometrically distributed, so that it takes no longer than there are flips.
class BitFlips {
 public:
  /// Pre: 0 < rate < 1.
  BitFlips(engine::Draws& draws, double rate, std::int64_t bits) noexcept;
  /// The next wrong bit, or -1 when there is none any more.
  [[nodiscard]] std::int64_t next() noexcept;

 private:
  engine::Draws& draws_;
  double log_of_good_;
  std::int64_t end_;
  std::int64_t at_ = -1;
};

}  // namespace hil
