#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string_view>
#include <vector>

#include "engine/core/image.h"
#include "engine/scene/point_source.h"
#include "engine/scene/snapshot.h"

namespace engine {

/// Light arriving at the entrance pupil: a grid (its region and oversampling are the optics' wish),
/// a list of point sources at exact sub-pixel places, and what lies behind them: what is even over
/// the field, and the Earth. The grid is the target's own light; what it hides of the Earth the
/// optics take away.
/// A grid cell holds the mean radiance over its own area, oversampling^2 cells to a pixel; the
/// cells of pixel (u, v) start at (oversampling * (u - region.left), ...).
struct Radiance {
  PixelRect region;  ///< may reach beyond the frame: light from there blurs in
  int oversampling = 3;
  RadianceImage grid;
  CoverImage cover;  ///< of the same cells: what lies behind them shows through the rest
  /// With companions in sight: what of the grid and of the cover is the target's own, where that
  /// can be.
  bool companions_in_sight = false;
  PixelRect targets_region;
  RadianceImage targets_grid;
  CoverImage targets_cover;
  static constexpr std::size_t kMostPoints = 64;
  std::vector<PointSource> points;  ///< inside the region, kMostPoints at most
  double uniform_w_m2_sr = 0;
  /// Behind it all, and none of the renderer's business: the imaging chain draws it.
  EarthBackground earth;
  PixelPoint motion_px;  ///< how the image moves from shutter open to shutter close
  ImagePath path;        ///< how far off that it is between: the imaging chain's, too
  double range_m = std::numeric_limits<double>::infinity();  ///< of the target: its focus
};

/// What the optics want to be given.
struct GridWish {
  int oversampling = 3;
  int beyond_frame_px = 64;  ///< how far outside the frame light still matters
};

/// The camera's own noise, by which a renderer judges its own.
struct SensorNoise {
  double e_per_radiance = 0;    ///< electrons in a pixel for an even 1 W/m^2/sr; 0: not known
  double dark_variance_e2 = 0;  ///< of a pixel that no light falls on
  double full_well_e = 0;
  /// Of the Gaussian that averages noise as the spread of light does, rms.
  double blur_px = 0;

  /// rms, of a pixel that collects `mean_e` of light.
  [[nodiscard]] double sigma_e(double mean_e) const noexcept {
    return std::sqrt(std::max(mean_e, 0.0) + dark_variance_e2);
  }
};

/// What a frame leaves out because time is short: each has what stands before it. In the order of
/// what a picture loses by it.
enum class Shed : std::uint8_t {
  kNothing,
  kUpkeep,   ///< what is kept from frame to frame is shown as it stands, but for lamps' patches
  kSamples,  ///< the coarsest lattice; of paths a quarter of the samples
  kBounces,  ///< light that bounces; of paths another three quarters of the samples
  kShadows   ///< the lattice's rays: edges of shadows are as its maps of the lamps' views have them
};
inline constexpr int kSheds = 5;
/// "nothing", "upkeep", "samples", "bounces" and "shadows".
[[nodiscard]] constexpr std::string_view name_of(Shed shed) noexcept {
  constexpr std::array<std::string_view, kSheds> kNames = {"nothing", "upkeep", "samples",
                                                           "bounces", "shadows"};
  return kNames[static_cast<std::size_t>(shed)];
}

/// What a frame may cost. 0 leaves it to the renderer's own setting.
struct Budget {
  int samples_per_pixel = 0;  ///< so many in every pixel, whatever the noise
  double rho_mc = 0;          ///< the largest Monte Carlo error after the optics, in sigmas, rms
  Duration time{};            ///< passes go on while the next one is likely to fit
  int passes = 0;             ///< so many, whatever the time: what a replay obeys
  Shed shed = Shed::kNothing;
  /// PathTracer: of samples_per_pixel, what the image has already from the call before, with the
  /// same snapshot at the same place. The rest goes on where those ended.
  int samples_done = 0;
};

/// A step of a ladder that a frame took. Both names are of static storage.
struct Rung {
  std::string_view ladder;  ///< "bounces"
  std::string_view taken;   ///< "1"
  double error_e = 0;       ///< the largest that it accepts, in a pixel; not a number: not known
};

/// The Monte Carlo error of an image after the optics over the sensor's noise, by the pixels that
/// see light; those at full well are counted apart. Not a number: not known.
struct NoiseReached {
  double rms = std::numeric_limits<double>::quiet_NaN();
  double worst = std::numeric_limits<double>::quiet_NaN();
  int lit_px = 0;
  int clipped_px = 0;
  static constexpr double kFirefly = 5;
  int firefly_px = 0;  ///< lit, and their own error is kFirefly sigmas or more: few samples made it
};

struct RaysByKind {
  std::uint64_t camera = 0;
  std::uint64_t shadow = 0;
  std::uint64_t bounce = 0;
  std::uint64_t bounce_shadow = 0;
};

/// What was reached.
struct RenderReport {
  std::uint64_t samples = 0;  ///< through the cells where the target can be
  std::uint64_t hits = 0;     ///< of these, on the target
  std::uint64_t rays = 0;
  RaysByKind rays_by_kind;          ///< where the renderer tells them apart
  std::uint64_t rejected_rays = 0;  ///< not finite or out of range: never given to the tracer
  int samples_per_pixel = 0;        ///< mean over those that see light
  int passes = 0;                   ///< over the image, each with further samples
  int bounces = 0;
  /// Of the target's image, lit or not, the share that lies in the frame: 1 wholly inside, 0
  /// outside. By area, each layer of surface for itself; the same as of the outline for a convex
  /// body.
  double visible_fraction = 0;
  std::array<double, kMostCompanions> visible_fraction_of_companion{};
  NoiseReached rho_mc;
  static constexpr std::size_t kMostRungs = 10;
  std::array<Rung, kMostRungs> rungs{};  ///< those with a name

  /// One too many is lost.
  void add(const Rung& rung) noexcept {
    for (Rung& r : rungs) {
      if (!r.ladder.empty()) continue;
      r = rung;
      return;
    }
  }
};

/// Thread: loop; it owns its workers. Loop-safe: the scene is built in the constructor.
class Renderer {
 public:
  virtual ~Renderer() = default;
  /// Overwrites `out`. The report says what was reached.
  virtual RenderReport render(const Snapshot& snapshot, Budget budget, Radiance& out) noexcept = 0;
};

}  // namespace engine
