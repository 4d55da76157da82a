#pragma once

#include <array>
#include <complex>
#include <vector>

#include "engine/optics/lens.h"
#include "engine/optics/pupil.h"

namespace engine {

/// What the lens alone does to an image: its OTF over the band, by frequency on the detector and by
/// defocus. Frequencies in cycles per metre along u and v; the OTF is the forward transform,
/// exp(-2 pi i f x), of a point's image whose pupil is LensSpec's.
///
/// A product. The first factor is the OTF in focus and without wavefront error, Shannon's factor
/// for the unknown rest included: O'Neill's closed form, and with a spider the pupil's sampled
/// overlap with itself. The second is what wavefront and defocus make of that, at most 1 and
/// smooth, since the cone at zero frequency is in the first. It is tabulated by frequency and by
/// W20. Radial pupils: quadrature over the overlap of two annuli, as Hopkins 1955 does it for a
/// clear pupil, DOI 10.1098/rspa.1955.0158. Others: transforms of the sampled pupil, its edges by
/// area.
///
/// Within 1e-3 of the exact OTF of the same five wavelengths. These are within 1e-3 of 41 in focus
/// and 3.1e-3 out of it, where nine would be within 1.5e-3. The point image is nowhere under -1e-6
/// of its peak; with a spider, of its peak in focus.
/// Thread: any. Loop-safe but for the constructor, slice() and unseen_defocus_m().
class LensOtf {
 public:
  using Complex = std::complex<float>;

  /// The OTF at one defocus, ready to be asked at many frequencies. Belongs to its LensOtf, which
  /// outlives it and stays where it is.
  class Slice {
   public:
    [[nodiscard]] std::complex<double> at(double fx_per_m, double fy_per_m) const noexcept;
    /// Pre: the lens is radial().
    [[nodiscard]] double at_radial(double f_per_m) const noexcept;

   private:
    friend class LensOtf;
    const LensOtf* lens_ = nullptr;
    double stretch_ = 1;
    std::vector<float> line_;
    std::vector<Complex> plane_;
  };

  /// `largest_defocus_m`: of either sign; infinity asks for all that the tables carry. A pupil that
  /// is not radial takes five transforms and 600 kB for each sixth of a wave: a second in all.
  LensOtf(const LensSpec& lens, double largest_defocus_m);

  /// Nothing passes from here on.
  [[nodiscard]] double cutoff_per_m() const noexcept { return cutoff_per_m_; }
  /// Neither spider nor wavefront errors but z4, z11, z22, z37: real, and depends on |f| alone.
  [[nodiscard]] bool radial() const noexcept { return radial_; }
  /// Defocus of either sign does the same.
  [[nodiscard]] bool even() const noexcept { return even_ && curvature_m_ == 0.0; }
  /// Not if no defocus was asked for.
  [[nodiscard]] bool changes_with_defocus() const noexcept { return largest_defocus_m_ > 0.0; }
  /// What the tables carry: what was asked for, but no more than 16 waves of the shortest
  /// wavelength, 4 for a pupil that is not radial, less what the wavefront errors take. Beyond, the
  /// image is that at the largest, grown in proportion, as geometry has it: up to .02 off where
  /// that is 7 um, .08 at 2 um.
  [[nodiscard]] double largest_defocus_m() const noexcept { return largest_defocus_m_; }

  /// Any frequency, any defocus.
  [[nodiscard]] std::complex<double> at(double fx_per_m, double fy_per_m,
                                        double defocus_m) const noexcept;
  /// Pre: radial().
  [[nodiscard]] double at_radial(double f_per_m, double defocus_m) const noexcept;

  [[nodiscard]] Slice slice(double defocus_m) const;
  /// The same without allocation. Pre: `out` comes from slice().
  void focus(double defocus_m, Slice& out) const noexcept;

  /// The largest defocus of either sign that changes the OTF by no more than `share`, of 1, at any
  /// frequency: what is under it can be left out. At most largest_defocus_m(); .65 times the mean
  /// wavelength times the root of `share` for a clear pupil.
  [[nodiscard]] double unseen_defocus_m(double share) const;

 private:
  static constexpr std::size_t kStencil = 6;

  /// Which tables make up a defocus.
  struct Blend {
    std::size_t count = 1;
    std::array<std::size_t, kStencil> level{};
    std::array<double, kStencil> weight{1.0};
    double stretch = 1;  ///< of frequencies, beyond the largest defocus
  };

  void choose_levels(const LensSpec& lens, const Pupil& pupil, double asked_m);
  void fill_clear(const LensSpec& lens);
  void fill_spider(const LensSpec& lens, const Pupil& pupil);
  void fill_line(const LensSpec& lens, const Pupil& pupil);
  void fill_plane(const LensSpec& lens, const Pupil& pupil);
  [[nodiscard]] double defocus_of(std::size_t level) const noexcept {
    return first_m_ + step_m_ * static_cast<double>(level);
  }
  [[nodiscard]] Blend blend(double defocus_m) const noexcept;
  /// The first factor, and the second from a table of it.
  [[nodiscard]] double clear(double f_per_m) const noexcept;
  [[nodiscard]] double clear(double fx_per_m, double fy_per_m) const noexcept;
  [[nodiscard]] double bent(const float* line, double f_per_m) const noexcept;
  [[nodiscard]] std::complex<double> bent(const Complex* plane, double fx_per_m,
                                          double fy_per_m) const noexcept;

  double cutoff_per_m_;
  double reach_per_m_;  ///< of the tables: the cutoff of the shortest of the band's lines
  bool radial_;
  bool even_ = false;   ///< defocus of either sign is the same
  double curvature_m_;  ///< W20 of z4, which defocus adds to
  double largest_defocus_m_ = 0;
  double first_m_ = 0;  ///< W20 of the first level
  double step_m_ = 1;
  std::size_t levels_ = 0;  ///< none: nothing but the first factor
  bool spider_;
  std::vector<float> clear_line_;
  std::vector<float> clear_plane_;  ///< [fy][fx], fy >= 0
  std::vector<float> lines_;        ///< [level][f]
  std::vector<Complex> planes_;     ///< [level][fy][fx], fy >= -1 step
};

}  // namespace engine
