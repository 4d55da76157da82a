#pragma once

#include <algorithm>
#include <memory>
#include <vector>

#include "engine/core/worker_pool.h"
#include "engine/optics/blur.h"
#include "engine/optics/far_wings.h"
#include "engine/optics/field_shading.h"
#include "engine/optics/grid_otf.h"
#include "engine/optics/optics_spec.h"
#include "engine/optics/otf_cascade.h"
#include "engine/optics/point_splat.h"
#include "engine/render/renderer.h"

namespace engine {

struct OpticsReport {
  PixelRect window;  ///< where the image may differ from the background
  int wing_px = 0;   ///< how far the spread of light is followed
  int core_px = 0;   ///< of that, on the fine grid; 0: there was none, for there were points only
  /// Of the target's light, spread beyond that; bound for a point.
  double lost_flux_share = 0;
  int points = 0;    ///< of light that were spread by table, bright cells of the grid among them
  int segments = 1;  ///< that a long smear was made of
  double defocus_m = 0;  ///< W20 of the target, of path; one that nobody sees is 0
};

/// Throughput, then blur by the product of the component OTFs, before the pixels sample.
///
/// L pi/4 (D/f)^2 tau, eq 15 of Li et al. 2023, on a grid of 3 cells to a pixel's side, or as many
/// as carry what the lens passes: the paper's passes 178 lp/mm where its pixels end at 77, so that
/// the product of MTFs on the pixel grid, whose pixels it takes for points
/// (OpticsSpec::oversampling = 1), is 13 % wrong.
/// Terms: OtfCascade, the target out of focus by its own range, and linear smear. A cell is itself
/// a square average, and the product takes that back out. The spread of light is followed to where
/// it drops under `faint_w_m2` (rule B5), or to largest_wing_px: near by on the fine grid, further
/// out as FarWings. Points, and cells so bright that single precision would show their rounding all
/// over the window, go by PointSplat. A smear longer than a window is made of segments, each
/// sampled from the same transform; a path that bends is one, too, or beyond a window's reach has
/// its steps for segments. The Earth behind the target is not blurred but for the pixels
/// that the target hides of it: a spread of sigma px adds sigma^2 / 2 times the second derivative,
/// 1e-8 of its light in the paper's camera, 1e-3 in one of 20 deg at the limb; a limb sharper than
/// a pixel stays so. Leaves out: of a spider's spikes what is beyond 64 px.
/// Thread: loop. Loop-safe but for the constructor.
class Optics {
 public:
  Optics(const OpticsSpec& spec, double faint_w_m2, WorkerPool& pool);

  [[nodiscard]] GridWish wish() const noexcept;
  /// Irradiance on the detector for a radiance that is even over the field, in its unit per sr.
  [[nodiscard]] double throughput_sr() const noexcept { return throughput_sr_; }
  /// rms, in pixels, of the Gaussian that averages noise of the radiance as this does, smear apart:
  /// 1 / (4 pi sigma^2) is the integral of the squared OTF.
  [[nodiscard]] double noise_blur_px() const noexcept;

  /// W20 of the stars when the target is so far away.
  [[nodiscard]] double star_defocus_m(double target_range_m) const noexcept;
  /// All that blurs but motion, and the lens as it was last focused.
  [[nodiscard]] const OtfCascade& cascade() const noexcept { return cascade_; }
  /// What spreads points of light as this does.
  [[nodiscard]] PointSplat& splat() noexcept { return *splat_; }

  [[nodiscard]] const FieldShading& shading() const noexcept { return shading_; }

  /// Overwrites `out`, of the camera's size: what reaches the detector but veiling glare. Pre:
  /// in.oversampling is wish().oversampling.
  OpticsReport project(const Radiance& in, IrradianceImage& out) noexcept;
  /// Veiling glare of all light that there is; returns what each pixel has of it, in W/m^2.
  double veil(IrradianceImage& out) noexcept { return shading_.veil(out, pool_); }

 private:
  /// What one transform is for: a share of the light, with its motion, at equal shares at several
  /// places a line apart.
  struct Stroke {
    ImageMotion motion;    ///< of one piece
    PixelPoint line_px;    ///< from the beginning of the first piece to the end of the last
    PixelPoint middle_px;  ///< of the line
    int pieces = 1;
    double share = 1;  ///< of the light, all pieces'
    [[nodiscard]] PixelPoint centre_px(int i) const noexcept {
      const double t = (i + 0.5) / pieces - 0.5;
      return {middle_px.u + t * line_px.u, middle_px.v + t * line_px.v};
    }
  };
  /// A straight smear, cut into pieces that a window holds.
  [[nodiscard]] static Stroke straight(PixelPoint line_px, PixelPoint middle_px,
                                       double share) noexcept;

  /// What there is on a grid, by size: the light itself, less what is hidden, may be negative.
  struct Survey {
    double sum = 0;
    float most = 0;
    float most_dim = 0;  ///< of cells that are not so bright that they must be points
    int bright = 0;
    int broken = 0;  ///< cells that are no number
    float bright_limit = 0;
    void add(const Survey& o) noexcept {
      sum += o.sum;
      most = std::max(most, o.most);
      most_dim = std::max(most_dim, o.most_dim);
      bright += o.bright;
      broken += o.broken;
    }
  };

  OpticsReport spread(const Radiance& in, IrradianceImage& out) noexcept;
  void tabulate() noexcept;
  void focus(double defocus_m) noexcept;
  void fill_background(const Radiance& in, IrradianceImage& out) noexcept;
  const RadianceImage& net_light(const Radiance& in) noexcept;
  Survey survey(const RadianceImage& light) noexcept;
  [[nodiscard]] static Survey survey_row(std::span<const float> cells, float bright_limit) noexcept;
  RadianceImage& own(const RadianceImage& light) noexcept;
  const RadianceImage& without_broken(const RadianceImage& light, const Survey& found) noexcept;
  const RadianceImage& take_bright_cells(const Radiance& in, const RadianceImage& light,
                                         const Survey& found) noexcept;
  [[nodiscard]] int core_margin(double brightest, int blur_px, int reach_px) const noexcept;
  [[nodiscard]] static int longest_px(const OpticsSpec& spec) noexcept;
  /// A spider's spikes are none of FarWings'.
  [[nodiscard]] bool wings_apart() const noexcept { return spec_.lens.spider_vanes == 0; }
  void spread_grid(const RadianceImage& light, const PixelRect& region, const Survey& found,
                   int blur_px, const Stroke& stroke, OpticsReport& report,
                   IrradianceImage& out) noexcept;
  template <class Sample>
  void add_core(const PixelRect& grid_px, PixelPoint move_px, double share, const Sample& sample,
                IrradianceImage& out) noexcept;

  OpticsSpec spec_;
  int oversampling_;
  OtfCascade cascade_;
  OtfCascade::Focused focused_;
  double defocus_m_ = 0;  ///< of the target
  WingLaw wing_law_;
  double still_blur_px_;
  double throughput_sr_;
  double faint_w_m2_;
  WorkerPool& pool_;
  FieldShading shading_;
  FarWings wings_;
  Blur core_;
  GridOtf core_otf_;
  int least_core_px_;
  std::unique_ptr<PointSplat> splat_;  ///< stays where it is when this moves
  PointSplat cell_splat_;
  std::vector<float> whole_table_;  ///< of the radial OTF
  std::vector<float> core_table_;   ///< without what FarWings spread
  RadianceImage net_;               ///< the target's light without what it hides or what is a point
  std::vector<float> behind_;       ///< the background's pixels, row by row of the region
  std::vector<Survey> rows_;
  std::vector<PointSource> points_;
  std::vector<PointSource> bright_;  ///< cells
};

}  // namespace engine
