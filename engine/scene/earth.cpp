#include "engine/scene/earth.h"

#include <cmath>

#include "engine/core/constants.h"

namespace engine {

EarthSpec read_earth(const ConfigTable& table) {
  EarthSpec spec;
  spec.earthshine = table.choice_or<EarthshineModel>("earthshine", "vector",
                                                     {{"none", EarthshineModel::kNone},
                                                      {"paper-lamp", EarthshineModel::kPaperLamp},
                                                      {"vector", EarthshineModel::kVector}});
  spec.albedo = table.number_or("albedo", 0.3, between(0.0, 1.0));
  return spec;
}

Eigen::Vector3d earthshine_vector(const Position<J2000>& target, const Direction<J2000>& to_sun,
                                  double albedo, double sun_irradiance) noexcept {
  using Eigen::Vector3d;
  constexpr int kRings = 72;
  constexpr int kSectors = 96;
  const double r = target.m.norm() / kEarthRadius_m;
  if (!(r > 1.0)) return Vector3d::Zero();

  // A frame round the nadir, its x axis towards the Sun so that the terminator lies evenly.
  const Vector3d up = target.m.normalized();
  Vector3d x = to_sun.unit - to_sun.unit.dot(up) * up;
  x = x.norm() > 1e-9 ? x.normalized() : up.unitOrthogonal();
  const double sun_up = to_sun.unit.dot(up);
  const double sun_x = to_sun.unit.dot(x);

  // Midpoints of the directions in the cap: the integral is over solid angle as seen from above.
  const double cos_limb = std::sqrt(1.0 - 1.0 / (r * r));
  double sum_nadir = 0;
  double sum_x = 0;
  for (int i = 0; i < kRings; ++i) {
    // Rings are denser at the limb, where a low Sun lights the cap.
    const double s = (i + 0.5) / kRings;
    const double cos_n = 1.0 - (1.0 - cos_limb) * s * (2.0 - s);
    const double ring_sr = (1.0 - cos_limb) * 2.0 * (1.0 - s) / kRings * (2.0 * kPi / kSectors);
    const double sin_n = std::sqrt(1.0 - cos_n * cos_n);
    const double slant = r * cos_n - std::sqrt(std::max(0.0, 1.0 - r * r * sin_n * sin_n));
    for (int j = 0; j < kSectors; ++j) {
      const double azimuth = 2.0 * kPi * (j + 0.5) / kSectors;
      const double dx = sin_n * std::cos(azimuth);
      const double cos_sun = sun_x * slant * dx + sun_up * (r - slant * cos_n);
      if (cos_sun <= 0.0) continue;
      sum_nadir += ring_sr * cos_sun * cos_n;
      sum_x += ring_sr * cos_sun * dx;
    }
  }
  return albedo * sun_irradiance / kPi * (sum_x * x - sum_nadir * up);
}

Eigen::Vector3d paper_earth_lamp(const Position<J2000>& target, double albedo,
                                 double sun_irradiance) noexcept {
  return -albedo * sun_irradiance * target.m.normalized();
}

}  // namespace engine
