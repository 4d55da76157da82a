#pragma once

#include <array>
#include <complex>
#include <vector>

#include "engine/optics/lens.h"

namespace engine {

inline constexpr int kMostVanes = 12;

/// Noll's Zernike term j over the unit disc: mean square 1 there, and orthogonal to the others.
/// Source: Noll 1976, DOI 10.1364/JOSA.66.000207. Pre: 1 <= j <= LensSpec::kLastZernike.
class ZernikeTerm {
 public:
  explicit ZernikeTerm(std::size_t j, double factor = 1.0) noexcept;
  [[nodiscard]] double at(double x, double y) const noexcept;
  [[nodiscard]] bool radial() const noexcept { return turns_ == 0; }
  /// True, and the sum of both, if they differ in their radial parts alone.
  bool takes(const ZernikeTerm& other) noexcept;

 private:
  int turns_ = 0;
  bool sine_ = false;
  std::array<double, 5> powers_{};  ///< of r^2, the factor of r^turns
};

/// Nodes in (-1, 1) and weights of Gauss-Legendre quadrature.
struct GaussRule {
  explicit GaussRule(int count);
  std::vector<double> nodes;
  std::vector<double> weights;
};

/// The open parts of a straight line, from low to high.
class OpenLine {
 public:
  struct Piece {
    double low;
    double high;
  };
  OpenLine(double low, double high) noexcept;
  void cut(double low, double high) noexcept;  ///< Pre: called as often as a lens has edges
  void keep(double low, double high) noexcept;
  [[nodiscard]] const Piece* begin() const noexcept { return pieces_.data(); }
  [[nodiscard]] const Piece* end() const noexcept { return pieces_.data() + size_; }

 private:
  // Twice, for an overlap: the obscuration and all vanes.
  std::array<Piece, 2 * (1 + kMostVanes) + 1> pieces_;
  std::size_t size_ = 0;
};

/// The lens' pupil: where it is open, how late light is there, and what its overlap with itself
/// lets through. Slow and exact, for tables and tests. Places in units of its radius.
/// Thread: any.
class Pupil {
 public:
  /// The steepest wavefront a lens may have by its own errors, in waves of the shortest wavelength
  /// over the pupil's radius.
  static constexpr double kSteepest_waves = 6.0;

  explicit Pupil(const LensSpec& lens);

  /// Depends on the distance from the centre alone.
  [[nodiscard]] bool radial() const noexcept { return radial_; }
  /// Its outline is the same after half a turn.
  [[nodiscard]] bool centred() const noexcept { return lens_.spider_vanes % 2 == 0; }
  /// Nothing but z4 bends the wavefront.
  [[nodiscard]] bool flat() const noexcept { return terms_.empty(); }
  /// W20 of z4, which is defocus: part of no function below but otf().
  [[nodiscard]] double curvature_m() const noexcept { return curvature_m_; }
  /// The wavefront, z4 and defocus left out.
  [[nodiscard]] double wavefront_m(double x, double y) const noexcept;
  /// The largest slope of the wavefront, z4 included, over the open and the hidden disc.
  [[nodiscard]] double steepest_m() const noexcept;
  /// Takes away what the pupil hides of the line at x; the pupil turned by minus `turn_rad`.
  void hide(double x, double turn_rad, OpenLine& line) const noexcept;

  /// The OTF at one wavelength, by quadrature over the overlap of the pupil with itself: of the
  /// point image's forward transform, exp(-2 pi i f x). `nu`: frequency over the cutoff. Shannon's
  /// factor is part of it. Within 1e-6, but 1e-4 with a spider.
  [[nodiscard]] std::complex<double> otf(double nu_x, double nu_y, double wavelength_m,
                                         double defocus_m) const;

 private:
  /// The pupil twice, at +-length/2 along x, the frame turned so; phases per metre of path, and of
  /// defocus per unit of x.
  struct Shift {
    double length;
    double turn_rad;
    double cosine;
    double sine;
    double per_m;
    double curvature;
  };
  /// By how much the first of the two is ahead in the overlap, and its integral along the line at
  /// x.
  [[nodiscard]] double phase(const Shift& shift, double x, double y) const noexcept;
  [[nodiscard]] std::complex<double> across(const Shift& shift, double x) const noexcept;

  LensSpec lens_;
  std::vector<ZernikeTerm> terms_;  ///< those of the same turns and kind are one
  double curvature_m_;
  bool radial_;
  GaussRule gauss_{16};
};

/// Where the overlap of two annuli, each shifted by half of `shift`, changes its shape along x, in
/// [0, its end]: between these places a sine's map makes quadrature exact.
[[nodiscard]] std::vector<double> overlap_corners(double shift, double obscuration);

}  // namespace engine
