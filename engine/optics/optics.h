#pragma once

#include <complex>
#include <vector>

#include "engine/core/config_reader.h"
#include "engine/core/worker_pool.h"
#include "engine/optics/fourier.h"
#include "engine/optics/mtf.h"
#include "engine/render/renderer.h"
#include "engine/scene/camera_geometry.h"

namespace engine {

struct OpticsSpec {
  BandOtf::Spec band;
  double transmission = 0.7;  ///< in (0, 1]
  int largest_wing_px = 64;   ///< light spread further than this is lost, and the loss reported
  CameraGeometry camera;
};
[[nodiscard]] OpticsSpec read_optics(const ConfigTable& table, const CameraGeometry& camera);

/// Irradiance on the detector for a radiance that is even over the field, in its unit per sr.
[[nodiscard]] double throughput_sr(const OpticsSpec& spec) noexcept;

struct OpticsReport {
  PixelRect window;            ///< where the image may differ from the background
  int wing_px = 0;             ///< how far the spread of light is followed
  double lost_flux_share = 0;  ///< of the target's light, spread beyond that; bound for a point
};

/// Throughput, then blur by the product of the component OTFs, before the pixels sample.
///
/// L pi/4 (D/f)^2 tau, eq 15 of Li et al. 2023, on a grid of 3 cells to a pixel's side: the optics
/// pass 178 lp/mm where the pixels end at 77, so a product of MTFs on the pixel grid is 13 % wrong.
/// Terms: diffraction over the band, the pixel's square, linear smear. A cell is itself a square
/// average, and the product takes that back out: diffraction, pixel and smear are exact.
/// The spread of light is followed to where it drops under `faint_w_m2` (rule B5), or to
/// largest_wing_px. The Earth behind the target is not blurred but for the pixels that the target
/// hides of it: a spread of sigma px adds sigma^2 / 2 times the second derivative, 1e-8 of its
/// light in the paper's camera, 1e-3 in one of 20 deg at the limb; a limb sharper than a pixel
/// stays so. Leaves out: defocus, wavefront error, vibration, distortion, vignetting. Thread: loop.
/// Loop-safe but for the constructor.
class Optics {
 public:
  Optics(const OpticsSpec& spec, double faint_w_m2, WorkerPool& pool);

  [[nodiscard]] GridWish wish() const noexcept { return {kOversampling, spec_.largest_wing_px}; }
  /// Irradiance on the detector for a radiance that is even over the field, in its unit per sr.
  [[nodiscard]] double throughput_sr() const noexcept { return throughput_sr_; }
  /// rms, in pixels, of the Gaussian that averages noise of the radiance as this does, smear apart:
  /// 1 / (4 pi sigma^2) is the integral of the squared OTF.
  [[nodiscard]] double noise_blur_px() const noexcept;

  /// Overwrites `out`, of the camera's size. Pre: in.oversampling is wish().oversampling.
  OpticsReport project(const Radiance& in, IrradianceImage& out) noexcept;

 private:
  using Complex = FourierLines::Complex;
  static constexpr int kOversampling = 3;

  /// The grid that a projection runs on: `pixels_x` by `pixels_y` pixels, three times the cells.
  struct Grid {
    int left = 0;  ///< detector pixel of its first column
    int top = 0;
    int pixels_x = 0;
    int pixels_y = 0;
    int columns = 0;  ///< of the half spectrum, up to the optics' cutoff
    [[nodiscard]] int cells_x() const noexcept { return pixels_x * kOversampling; }
    [[nodiscard]] int cells_y() const noexcept { return pixels_y * kOversampling; }
  };

  template <class Work>
  void share(int count, const Work& work) noexcept;
  [[nodiscard]] int wing_for(const Radiance& in) const noexcept;
  void copy_cells(const Radiance& in, int row, std::span<float> behind,
                  std::span<float> line) const noexcept;
  [[nodiscard]] Grid grid_for(const Radiance& in, int wing_px) const noexcept;
  void transform_rows(const Radiance& in, const Grid& grid) noexcept;
  void blur_columns(const Radiance& in, const Grid& grid) noexcept;
  void add_points(const Radiance& in, const Grid& grid, int column, std::span<Complex> sum,
                  std::span<Complex> spectrum) const noexcept;
  void multiply_otf(const Radiance& in, const Grid& grid, int column,
                    std::span<Complex> spectrum) const noexcept;
  void fold_columns(const Grid& grid) noexcept;
  void sample_rows(const Grid& grid, IrradianceImage& out) noexcept;

  OpticsSpec spec_;
  BandOtf diffraction_;
  double throughput_sr_;
  double faint_w_m2_;
  WorkerPool& pool_;

  std::vector<FourierLines> lines_;  ///< one a share of the work
  std::vector<std::vector<Complex>> line_in_;
  std::vector<std::vector<Complex>> line_out_;
  std::vector<std::vector<float>> line_real_;
  std::vector<std::vector<float>> behind_;  ///< the target, by pixel
  std::vector<Complex> spectrum_;           ///< [column][cell row], then [column][row frequency]
  std::vector<Complex> folded_;             ///< [column][row frequency], then [column][pixel row]
};

}  // namespace engine
