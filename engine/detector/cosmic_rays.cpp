#include "engine/detector/cosmic_rays.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/core/constants.h"
#include "engine/core/random.h"

namespace engine {
namespace {

constexpr double kElectrons_um = 80.0;
constexpr double kSpread_um = 4.9;
/// So that no flux and exposure make a frame without end.
constexpr double kMostRays = 1e6;

/// A line through pixels: x and y run from the upper left corner of the frame.
struct Track {
  double x = 0;
  double y = 0;
  double dx = 0;
  double dy = 0;
  double charge_e = 0;
};

Track draw_track(const DetectorSpec& spec, int width, int height, Draws draws) noexcept {
  Track track;
  track.x = width * draws.uniform_double();
  track.y = height * draws.uniform_double();
  const double cosine = std::sqrt(draws.uniform_double());
  const double turn = 2.0 * kPi * draws.uniform_double();
  const double length_um = spec.epitaxial_um / cosine;
  const double across_px =
      length_um * std::sqrt(1.0 - cosine * cosine) / (1e6 * spec.pixel_pitch_m);
  track.dx = across_px * std::cos(turn);
  track.dy = across_px * std::sin(turn);
  // -log of the square of a normal number has Moyal's distribution.
  const double z = std::max(1e-6, std::abs(static_cast<double>(draws.normal())));
  track.charge_e = length_um * (kElectrons_um - 2.0 * kSpread_um * std::log(z));
  return track;
}

/// Where, of a track from 0 to 1, the next pixel begins in one direction, and the share of the
/// track that a pixel takes.
struct Crossing {
  double next = std::numeric_limits<double>::infinity();
  double step = std::numeric_limits<double>::infinity();
  int sign = 0;
};

Crossing crossing(double from, double by) noexcept {
  if (by == 0.0) return {};
  const double in_pixel = from - std::floor(from);
  return {(by > 0.0 ? 1.0 - in_pixel : in_pixel) / std::abs(by), 1.0 / std::abs(by),
          by > 0.0 ? 1 : -1};
}

void lay(const Track& track, std::span<const float> response, ElectronImage& electrons) noexcept {
  int u = std::min(static_cast<int>(track.x), electrons.width() - 1);
  int v = std::min(static_cast<int>(track.y), electrons.height() - 1);
  Crossing along_u = crossing(track.x, track.dx);
  Crossing along_v = crossing(track.y, track.dy);
  double laid_e = 0;
  while (u >= 0 && u < electrons.width() && v >= 0 && v < electrons.height()) {
    const double until = std::min({1.0, along_u.next, along_v.next});
    const double by_now_e = std::floor(track.charge_e * until + 0.5);
    const std::size_t at =
        static_cast<std::size_t>(v) * static_cast<std::size_t>(electrons.width()) +
        static_cast<std::size_t>(u);
    if (response.empty() || response[at] > 0.0F)
      electrons.pixels()[at] += static_cast<float>(by_now_e - laid_e);
    laid_e = by_now_e;
    if (until >= 1.0) return;
    Crossing& first = along_u.next <= along_v.next ? along_u : along_v;
    (&first == &along_u ? u : v) += first.sign;
    first.next += first.step;
  }
}

}  // namespace

int add_cosmic_rays(const DetectorSpec& spec, Duration exposure, std::uint64_t seed,
                    std::uint64_t frame, std::span<const float> response,
                    ElectronImage& electrons) noexcept {
  const double side_cm = 100.0 * spec.pixel_pitch_m;
  const double area_cm2 = side_cm * side_cm * static_cast<double>(electrons.pixels().size());
  const double mean = spec.cosmic_rays_cm2_s * area_cm2 * seconds(exposure);
  const auto rays = static_cast<int>(
      std::min(kMostRays, Draws(seed, Stream::kCosmicRays, frame, 0).poisson(mean)));
  for (int i = 1; i <= rays; ++i)
    lay(draw_track(spec, electrons.width(), electrons.height(),
                   Draws(seed, Stream::kCosmicRays, frame, static_cast<std::uint32_t>(i))),
        response, electrons);
  return rays;
}

}  // namespace engine
