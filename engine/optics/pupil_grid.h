#pragma once

#include <complex>
#include <memory>
#include <vector>

#include "engine/optics/pupil.h"

namespace engine {

/// A pupil in square cells, its edges by area, and its overlap with itself by transform: for
/// set-up. Deterministic. Thread: one at a time.
class PupilGrid {
 public:
  /// `cell`: in units of the pupil's radius. `lags`: how many cells the overlap is wanted for.
  PupilGrid(const Pupil& pupil, double cell, int lags);
  ~PupilGrid();
  PupilGrid(PupilGrid&&) noexcept;
  PupilGrid& operator=(PupilGrid&&) noexcept;

  /// Of all cells, in cells.
  [[nodiscard]] double open_area() const noexcept { return open_area_; }

  /// The sum over cells of P(place) times the conjugate of P(place + shift), in cells, for the
  /// wavefront with this curvature W20, z4's included; P is open area times
  /// exp(2 pi i path / wavelength).
  void overlap(double wavelength_m, double w20_m);
  /// The same with the wavefront flat.
  void flat_overlap();
  /// By shift in cells. Pre: 0 <= dy <= lags, |dx| <= lags.
  [[nodiscard]] std::complex<double> at(int dx, int dy) const noexcept;

 private:
  /// A cell that is not closed.
  struct Cell {
    std::size_t place;
    double open;         ///< share of its area
    double wavefront_m;  ///< at its middle, z4 left out
    double radius2;      ///< of its middle from the pupil's centre, squared
  };
  struct Transforms;

  void find_cells(const Pupil& pupil, double cell);
  void transform();

  int side_;  ///< cells along an axis
  int lags_;
  int length_;  ///< of a transform
  double open_area_ = 0;
  std::vector<Cell> cells_;
  std::vector<std::complex<double>> rows_;  ///< [row][length]: pupil, spectrum, overlap in turn
  std::unique_ptr<Transforms> transforms_;
};

}  // namespace engine
