#pragma once

#include <array>
#include <complex>
#include <memory>
#include <string_view>
#include <vector>

#include "engine/optics/lens_otf.h"
#include "engine/optics/optics_spec.h"

namespace engine {

/// All that blurs an image but its motion, as one product of OTFs: eq 18 and figure 7 of Li et al.
/// 2023, signed, and at the frequencies that the optics pass, not the pixels' alone.
///
/// Frequencies in cycles per pixel along u and v. Terms: the lens (LensOtf: diffraction over the
/// band, wavefront error, defocus), Gaussian jitter, vibration, a measured table, the pixel's
/// square. Vibration is J0(2 pi A f) along its direction: of many periods to an exposure.
/// Thread: any. Loop-safe but for the constructor and focus().
class OtfCascade {
 public:
  explicit OtfCascade(const OpticsSpec& spec);

  /// The lens at one defocus.
  using Focused = LensOtf::Slice;
  [[nodiscard]] Focused focused(double defocus_m) const { return lens_->slice(defocus_m); }
  void focus(double defocus_m, Focused& out) const noexcept { lens_->focus(defocus_m, out); }
  /// A defocus that nobody sees is none, and one beyond what the tables hold is the largest they
  /// do.
  [[nodiscard]] double seen_defocus_m(double defocus_m) const noexcept;

  [[nodiscard]] const LensOtf& lens() const noexcept { return *lens_; }
  [[nodiscard]] double cutoff_per_px() const noexcept;
  /// Depends on the length of the frequency alone, but for the pixel; real.
  [[nodiscard]] bool radial() const noexcept { return lens_->radial() && vibration_px_ == 0.0; }

  /// All of it but the pixel.
  [[nodiscard]] std::complex<double> at(double fu, double fv, const Focused& lens) const noexcept;
  /// The same. Pre: radial().
  [[nodiscard]] double at_radial(double f, const Focused& lens) const noexcept;
  /// With the pixel.
  [[nodiscard]] std::complex<double> whole(double fu, double fv,
                                           const Focused& lens) const noexcept;

  /// Each term by itself, for charts.
  struct Term {
    std::string_view name;
    std::complex<double> value;
  };
  static constexpr std::size_t kTerms = 6;
  [[nodiscard]] std::array<Term, kTerms> terms(double fu, double fv,
                                               const Focused& lens) const noexcept;

 private:
  [[nodiscard]] double vibration(double fu, double fv) const noexcept;
  [[nodiscard]] double unsteady(double f) const noexcept;

  double pitch_m_;
  double jitter_px_;
  double vibration_px_;
  std::vector<float> vibration_;  ///< by frequency along it, up to the cutoff
  double along_u_;
  double along_v_;
  MtfTable mtf_;
  std::unique_ptr<LensOtf> lens_;  ///< stays where it is when this moves
  Focused in_focus_;
  double unseen_m_;
};

}  // namespace engine
