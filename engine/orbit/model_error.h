#pragma once

#include <memory>

#include "engine/orbit/orbit_spec.h"

namespace engine {

/// How far a body may be from where its model has it: what the model leaves out, not how exactly it
/// is computed. Nor does it know how good the elements are, or the file.
///
/// Two-body motion: its distance to the same state over an oblate Earth, integrated.
/// J2: an order of magnitude for low orbits: the higher zonals, 1.5e-5 m/s^2 at first and then 2 km
/// a day, and drag at 400 km and moderate activity (3e-12 kg/m^3), 7.65 km times the days squared;
/// fitted to an independent integration of the orbits of Li et al. 2023 with both. Less, higher up.
/// Ephemeris: the interpolation.
class ModelError {
 public:
  /// For times until `last`.
  ModelError(const OrbitSpec& spec, Epoch epoch, Epoch last);

  [[nodiscard]] double at_m(Epoch t) const noexcept;
  /// Across a line of sight; the whole where the error's direction is not known.
  [[nodiscard]] double across_m(Epoch t, const Direction<J2000>& line) const noexcept;
  /// What makes it: "the Earth's oblateness is left out".
  [[nodiscard]] std::string_view cause() const noexcept;

 private:
  [[nodiscard]] Eigen::Vector3d off_m(Epoch t) const noexcept;

  OrbitModel model_;
  Epoch epoch_;
  double interpolation_m_ = 0;
  std::unique_ptr<const Propagator> modelled_;  ///< of two-body motion, as the next
  std::unique_ptr<const Propagator> better_;
};

}  // namespace engine
