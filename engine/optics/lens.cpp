#include "engine/optics/lens.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "engine/core/constants.h"
#include "engine/optics/pupil.h"

namespace engine {
namespace {

constexpr double kLargestRms_waves = 0.18;  // Shannon's factor is 0 here, and nonsense beyond
constexpr double kLeastOpenShare = 0.05;

void read_spider(const ConfigTable& table, LensSpec& lens) {
  lens.spider_vanes = static_cast<int>(table.integer_or("spider_vanes", 0, between(0, kMostVanes)));
  const double width_mm = table.number_or("spider_width_mm", 0.0, at_least(0.0));
  lens.spider_angle_rad = table.number_or("spider_angle_deg", 0.0, any_number()) * kDegree;
  if (lens.spider_vanes == 0) return;
  if (!(width_mm > 0.0)) table.fail("spider_width_mm", "must be > 0 where there are spider_vanes");
  lens.spider_width_m = width_mm * 1e-3;
  if (lens.open_share() < kLeastOpenShare) {
    table.fail("spider_width_mm", "leaves " + std::to_string(lens.open_share()) +
                                      " of the aperture open, expected " +
                                      std::to_string(kLeastOpenShare) + " at least");
  }
}

void read_zernike(const ConfigTable& table, LensSpec& lens) {
  const auto key_of = [](std::size_t j) { return "zernike_nm.z" + std::to_string(j); };
  if (table.has(key_of(1))) table.fail(key_of(1), "is piston, which no image shows");
  for (const std::size_t j : {std::size_t{2}, std::size_t{3}})
    if (table.has(key_of(j)))
      table.fail(key_of(j), "is tilt, which moves the image: point the camera instead");
  for (std::size_t j = 4; j <= LensSpec::kLastZernike; ++j)
    lens.zernike_m[j] = table.number_or(key_of(j), 0.0, any_number()) * 1e-9;
  const double slope = Pupil(lens).steepest_m() / lens.band_low_m;
  if (slope > Pupil::kSteepest_waves) {
    table.fail("zernike_nm", "makes a wavefront as steep as " + std::to_string(slope) +
                                 " waves of the shortest wavelength over the pupil's radius, "
                                 "expected " +
                                 std::to_string(Pupil::kSteepest_waves) + " at most");
  }
}

}  // namespace

double LensSpec::open_share() const noexcept {
  const double e = obscuration;
  if (spider_vanes == 0) return 1.0 - e * e;
  // Outside `inner` neighbouring vanes stand apart, and each hides an angle 2 asin(a / r).
  const double a = spider_width_m / aperture_m;
  const double inner =
      std::max(e, spider_vanes == 1 ? a : a / std::sin(kPi / std::max(spider_vanes, 2)));
  // One vane ends at the centre; what lies behind is open.
  const double behind = spider_vanes == 1 && e < a ? 0.5 * (a * a - e * e) : 0.0;
  if (inner >= 1.0) return behind;
  const auto hidden = [a](double r) {
    return r * r * std::asin(a / r) + a * std::sqrt(std::max(r * r - a * a, 0.0));
  };
  return 1.0 - inner * inner + behind - spider_vanes / kPi * (hidden(1.0) - hidden(inner));
}

LensSpec read_lens(const ConfigTable& table, const CameraGeometry& camera) {
  LensSpec lens;
  lens.focal_length_m = camera.focal_length_m;
  lens.aperture_m = table.number("aperture_m", positive());
  lens.obscuration = table.number_or("obscuration", 0.0, from_below(0.0, 1.0));
  read_spider(table, lens);
  read_zernike(table, lens);
  lens.wavefront_rms_m = table.number_or("wavefront_rms_nm", 0.0, at_least(0.0)) * 1e-9;
  const double largest_m = kLargestRms_waves * lens.band_low_m;
  if (lens.wavefront_rms_m > largest_m) {
    table.fail("wavefront_rms_nm", "must be <= " + std::to_string(largest_m * 1e9) +
                                       ", 0.18 waves of the shortest wavelength, got " +
                                       std::to_string(lens.wavefront_rms_m * 1e9));
  }
  return lens;
}

double defocus_m(const LensSpec& lens, double range_m, double focus_range_m) noexcept {
  return lens.aperture_m * lens.aperture_m / 8.0 * (1.0 / range_m - 1.0 / focus_range_m);
}

std::array<BandLine, kBandLines> band_lines(const LensSpec& lens) noexcept {
  constexpr std::array<double, kBandLines> kNodes{-0.9061798459386640, -0.5384693101056831, 0.0,
                                                  0.5384693101056831, 0.9061798459386640};
  constexpr std::array<double, kBandLines> kWeights{0.2369268850561891, 0.4786286704993665,
                                                    0.5688888888888889, 0.4786286704993665,
                                                    0.2369268850561891};
  const double middle_m = 0.5 * (lens.band_high_m + lens.band_low_m);
  const double half_m = 0.5 * (lens.band_high_m - lens.band_low_m);
  std::array<BandLine, kBandLines> lines{};
  for (std::size_t k = 0; k < lines.size(); ++k)
    lines[k] = {middle_m + half_m * kNodes[k], 0.5 * kWeights[k]};
  return lines;
}

double shannon_factor(double rms_waves, double nu) noexcept {
  const double part = rms_waves / kLargestRms_waves;
  const double off = nu - 0.5;
  return 1.0 - part * part * (1.0 - 4.0 * off * off);
}

}  // namespace engine
