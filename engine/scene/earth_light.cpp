#include "engine/scene/earth_light.h"

namespace engine {
namespace {

using Eigen::Vector3d;

constexpr std::size_t kNodes = 16;

/// Nodes in (0, 1) and weights of Gauss and Legendre.
struct GaussLegendre {
  std::array<double, kNodes> at{};
  std::array<double, kNodes> weight{};
  GaussLegendre() noexcept {
    constexpr auto n = static_cast<double>(kNodes);
    for (std::size_t i = 0; i < kNodes; ++i) {
      double x = std::cos(kPi * (static_cast<double>(i) + 0.75) / (n + 0.5));
      double slope = 0;
      for (int step = 0; step < 8; ++step) {  // Newton: from here four are enough
        double p = 1.0;
        double before = 0.0;
        for (std::size_t k = 0; k < kNodes; ++k) {
          const auto j = static_cast<double>(k);
          const double next = ((2.0 * j + 1.0) * x * p - j * before) / (j + 1.0);
          before = p;
          p = next;
        }
        slope = n * (x * p - before) / (x * x - 1.0);
        x -= p / slope;
      }
      at[i] = 0.5 * (1.0 - x);
      weight[i] = 1.0 / ((1.0 - x * x) * slope * slope);
    }
  }
};
const GaussLegendre kGauss;

}  // namespace

EarthLight::EarthLight(const EarthDisc<BodyFrame>& disc) noexcept : disc_(disc) {
  if (!disc.seen() || !(disc.sun_irradiance_w_m2 > 0.0)) return;
  const Vector3d up = -disc.to_centre.unit;
  sun_up_ = disc.to_sun.unit.dot(up);
  across_ = disc.to_sun.unit - sun_up_ * up;
  sun_across_ = across_.norm();
  across_ = sun_across_ > 1e-9 ? Vector3d(across_ / sun_across_) : up.unitOrthogonal();
  beside_ = up.cross(across_);

  // The cap ends at the horizon; its rings are dark up to where the Sun rises and lit all round up
  // to where it sets.
  const double cos_edge = 1.0 / disc.distance_radii;
  const double sin_edge = std::sqrt(1.0 - cos_edge * cos_edge);
  const double widest = versed_nadir_of(sin_edge, cos_edge);
  const bool day = sun_up_ > 0.0;
  // The angle at the Earth's centre between the foot point and the terminator, its sine |sun_up_|.
  const bool terminator_in_cap = std::abs(sun_up_) < sin_edge;
  if (!day && !terminator_in_cap) return;
  widest_ = widest;
  const double at_terminator =
      terminator_in_cap ? versed_nadir_of(std::abs(sun_up_), sun_across_) : widest;
  narrowest_ = day ? 0.0 : at_terminator;
  const double highest_sun = std::atan2(sun_across_, sun_up_) < std::acos(cos_edge)
                                 ? 1.0
                                 : sun_up_ * cos_edge + sun_across_ * sin_edge;
  largest_w_m2_sr_ = disc.sun_irradiance_w_m2 / kPi * disc.largest_albedo() * highest_sun;
  if (day) add_moments(0.0, at_terminator);
  if (terminator_in_cap) add_moments(at_terminator, widest);
}

double EarthLight::versed_nadir_of(double sin_centre, double cos_centre) const noexcept {
  const double slant = std::hypot(sin_centre, disc_.distance_radii - cos_centre);
  const double sin_nadir = sin_centre / slant;
  return sin_nadir * sin_nadir / (1.0 + (disc_.distance_radii - cos_centre) / slant);
}

EarthLight::Ring EarthLight::ring_at(double versed_nadir) const noexcept {
  const double r = disc_.distance_radii;
  const double sin2 = versed_nadir * (2.0 - versed_nadir);
  Ring ring;
  ring.cos_nadir = 1.0 - versed_nadir;
  ring.sin_nadir = std::sqrt(sin2);
  const double slant = r * ring.cos_nadir - std::sqrt(std::max(0.0, 1.0 - r * r * sin2));
  ring.sin_centre = slant * ring.sin_nadir;
  ring.cos_centre = r - slant * ring.cos_nadir;
  const double even = sun_up_ * ring.cos_centre;
  const double swing = sun_across_ * ring.sin_centre;
  if (even >= swing) {
    ring.lit_rad = kPi;
  } else if (even > -swing) {
    // The cosine of lit_rad is -even / swing; by its half angle, which keeps its digits.
    ring.lit_rad = 2.0 * std::atan2(std::sqrt(swing + even), std::sqrt(swing - even));
  }
  return ring;
}

Vector3d EarthLight::direction_in(const Ring& ring, double azimuth) const noexcept {
  return ring.cos_nadir * disc_.to_centre.unit +
         ring.sin_nadir * (std::cos(azimuth) * across_ + std::sin(azimuth) * beside_);
}

/// Adds the light of the rings between two angles, given as 1 - cos.
/// At the limb, and where rings begin to be dark in part, the light rises as a square root: a step
/// that is flat at both ends takes that away, and 16 nodes each way leave 1e-6.
/// Of the coasts of a map they leave more: see the class.
void EarthLight::add_moments(double from, double to) noexcept {
  for (std::size_t i = 0; i < kNodes; ++i) {
    const double s = kGauss.at[i];
    const double width = (to - from) * kGauss.weight[i] * 6.0 * s * (1.0 - s);
    const Ring ring = ring_at(from + (to - from) * s * s * (3.0 - 2.0 * s));
    const bool whole = ring.lit_rad >= kPi;
    for (std::size_t j = 0; j < kNodes; ++j) {
      // A whole turn is periodic: there even steps are the better ones.
      const double turn = whole ? (static_cast<double>(j) + 0.5) / kNodes : kGauss.at[j];
      const double weight = whole ? 1.0 / kNodes : kGauss.weight[j];
      const double azimuth = (2.0 * turn - 1.0) * ring.lit_rad;
      const Vector3d outward = std::cos(azimuth) * across_ + std::sin(azimuth) * beside_;
      const Vector3d vertical = ring.sin_centre * outward - ring.cos_centre * disc_.to_centre.unit;
      const double cos_sun = vertical.dot(disc_.to_sun.unit);
      if (!(cos_sun > 0.0)) continue;
      const double albedo = disc_.albedo_at(vertical);
      const double light = cos_sun * (disc_.sun_irradiance_w_m2 / kPi * albedo) * width * 2.0 *
                           ring.lit_rad * weight;
      const Vector3d toward = ring.sin_nadir * outward + ring.cos_nadir * disc_.to_centre.unit;
      zeroth_ += light;
      first_ += light * toward;
      second_ += light * toward * toward.transpose();
      const double zonal = disc_.albedo.at(vertical.dot(disc_.north.unit));
      if (disc_.albedo_by_place) by_map_ += light * std::abs(1.0 - zonal / albedo);
    }
  }
}

EarthLight::Sample EarthLight::sample(double u1, double u2) const noexcept {
  Sample s;
  if (dark()) return s;
  const Ring ring = ring_at(narrowest_ + u1 * (widest_ - narrowest_));
  if (!(ring.lit_rad > 0.0)) return s;
  const double azimuth = (2.0 * u2 - 1.0) * ring.lit_rad;
  s.direction = direction_in(ring, azimuth);
  s.pdf = 1.0 / ((widest_ - narrowest_) * 2.0 * ring.lit_rad);
  const Vector3d outward = std::cos(azimuth) * across_ + std::sin(azimuth) * beside_;
  const Vector3d vertical = ring.sin_centre * outward - ring.cos_centre * disc_.to_centre.unit;
  const double cos_sun = vertical.dot(disc_.to_sun.unit);
  if (cos_sun > 0.0) s.radiance_w_m2_sr = cos_sun * disc_.zenith_radiance_w_m2_sr(vertical);
  return s;
}

double EarthLight::pdf(const Vector3d& direction) const noexcept {
  if (dark() || !(radiance_w_m2_sr(direction) > 0.0)) return 0.0;
  const double versed = 0.5 * (direction - disc_.to_centre.unit).squaredNorm();
  const Ring ring = ring_at(std::clamp(versed, narrowest_, widest_));
  // A ring that touches the light in one place has no width left after rounding.
  return 1.0 / ((widest_ - narrowest_) * 2.0 * std::max(ring.lit_rad, 1e-9));
}

}  // namespace engine
