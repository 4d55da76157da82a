#include "engine/orbit/elements.h"

#include <cmath>
#include <string>

#include "engine/orbit/kepler.h"

namespace engine {
namespace {

using Eigen::Vector3d;

/// Where a body is along its conic.
struct Along {
  double eccentricity = 0;
  double mean_anomaly_rad = 0;
  double true_anomaly_rad = 0;
};

/// `p_over_a` is 1 - e^2.
Along along_ellipse(double e_cos, double e_sin, double p_over_a) noexcept {
  const double small = std::hypot(e_cos, e_sin);
  const double e = small < 0.5 ? small : std::sqrt(1.0 - p_over_a);
  const double e_anomaly = std::atan2(e_sin, e_cos);
  // Twice the angle by which the true anomaly runs ahead (Broucke & Cefola 1973).
  const double minor = std::sqrt(p_over_a);
  const double beta = e / (1.0 + minor);
  const double half_sine = std::sin(0.5 * e_anomaly);
  const double one_less_beta = (1.0 + minor - e) / (1.0 + minor);
  const double ahead =
      std::atan2(beta * std::sin(e_anomaly), one_less_beta + 2.0 * beta * half_sine * half_sine);
  return {e, mean_anomaly_rad(e, e_anomaly), e_anomaly + 2.0 * ahead};
}

Along along_hyperbola(double e_sinh, double p_over_a) noexcept {
  const double e = std::sqrt(1.0 - p_over_a);
  const double h = std::asinh(e_sinh / e);
  const double e_less_one = -p_over_a / (1.0 + e);
  const double half = std::atan2(std::sqrt(e + 1.0) * std::tanh(0.5 * h), std::sqrt(e_less_one));
  return {e, mean_anomaly_rad(e, h), 2.0 * half};
}

OrbitState read_state(const ConfigTable& table) {
  const auto vector = [&](const char* key, double limit) {
    const std::vector<double> numbers = table.numbers(key, 3, between(-limit, limit));
    return Vector3d(1e3 * Vector3d(numbers[0], numbers[1], numbers[2]));
  };
  OrbitState state;
  state.position.m = vector("position_km", 1e7);
  state.velocity.m_s = vector("velocity_km_s", 1e3);
  return state;
}

KeplerElements elements_from_state(const ConfigTable& table) {
  for (const char* key : {"semi_major_axis_km", "eccentricity", "inclination_deg",
                          "argument_of_perigee_deg", "raan_deg", "mean_anomaly_deg"})
    if (table.has(key)) table.fail(key, "and position_km exclude each other");
  const OrbitState state = read_state(table);
  const double distance_m = state.position.m.norm();
  if (distance_m < kEarthRadius_m) {
    table.fail("position_km", "must be outside the Earth, 6378.137 km from its centre, got " +
                                  std::to_string(distance_m * 1e-3) + " km");
  }
  const auto elements = elements_of(state);
  if (!elements) {
    table.fail("velocity_km_s",
               "puts the body on a parabola or on a straight line through the Earth's centre: "
               "there must be some other motion, 1 mm/s of it");
  }
  return *elements;
}

KeplerElements elements_as_given(const ConfigTable& table) {
  KeplerElements elements;
  elements.eccentricity = table.number("eccentricity", at_least(0.0));
  elements.semi_major_axis_m = table.number("semi_major_axis_km", between(-1e12, 1e12)) * 1e3;
  if (std::abs(elements.eccentricity - 1.0) < kParabola)
    table.fail("eccentricity",
               "must not be that of a parabola: give position_km and velocity_km_s "
               "of a state nearby, or an eccentricity 1e-8 away");
  const bool closed = elements.eccentricity < 1.0;
  if (closed ? elements.semi_major_axis_m <= 0.0 : elements.semi_major_axis_m >= 0.0) {
    table.fail("semi_major_axis_km", closed ? "must be > 0 where eccentricity is < 1, an ellipse"
                                            : "must be < 0 where eccentricity is > 1, a hyperbola");
  }
  elements.inclination_rad = table.number("inclination_deg", between(0.0, 180.0)) * kDegree;
  const Range turn = between(-360.0, 360.0);
  elements.argument_of_perigee_rad = table.number("argument_of_perigee_deg", turn) * kDegree;
  elements.raan_rad = table.number("raan_deg", turn) * kDegree;
  // A hyperbola's is no angle.
  const Range anywhere = closed ? turn : between(-1e9, 1e9);
  elements.mean_anomaly_rad = table.number("mean_anomaly_deg", anywhere) * kDegree;
  return elements;
}

}  // namespace

std::optional<KeplerElements> elements_of(const OrbitState& state, double mu_m3_s2) noexcept {
  const Vector3d& r = state.position.m;
  const Vector3d& v = state.velocity.m_s;
  const double distance = r.norm();
  const Vector3d h = r.cross(v);
  if (!(h.norm() > kStraight * distance * v.norm())) return std::nullopt;

  const double per_axis = 2.0 / distance - v.squaredNorm() / mu_m3_s2;
  const double p_over_a = h.squaredNorm() / mu_m3_s2 * per_axis;
  // 1 - e is half of 1 - e^2 there.
  if (!std::isfinite(p_over_a) || std::abs(p_over_a) < 2.0 * kParabola) return std::nullopt;
  const double e_sin = r.dot(v) * std::sqrt(std::abs(per_axis) / mu_m3_s2);
  const Along along = p_over_a > 0.0 ? along_ellipse(1.0 - distance * per_axis, e_sin, p_over_a)
                                     : along_hyperbola(e_sin, p_over_a);

  KeplerElements elements;
  elements.semi_major_axis_m = 1.0 / per_axis;
  elements.eccentricity = along.eccentricity;
  elements.mean_anomaly_rad = along.mean_anomaly_rad;
  const double tilt = std::hypot(h.x(), h.y());
  elements.inclination_rad = std::atan2(tilt, h.z());
  elements.raan_rad = tilt > 0.0 ? std::atan2(h.x(), -h.y()) : 0.0;
  const Vector3d node(std::cos(elements.raan_rad), std::sin(elements.raan_rad), 0.0);
  const double from_node = std::atan2(r.dot(h.normalized().cross(node)), r.dot(node));
  elements.argument_of_perigee_rad = std::remainder(from_node - along.true_anomaly_rad, 2.0 * kPi);
  return elements;
}

KeplerElements read_elements(const ConfigTable& table) {
  const bool from_state = table.has("position_km") || table.has("velocity_km_s");
  const KeplerElements elements =
      from_state ? elements_from_state(table) : elements_as_given(table);
  if (elements.perigee_m() < kEarthRadius_m) {
    table.fail(from_state ? "velocity_km_s" : "semi_major_axis_km",
               std::string(from_state ? "puts" : "and eccentricity put") +
                   " the perigee inside the Earth, " + std::to_string(elements.perigee_m() / 1e3) +
                   " km from its centre");
  }
  return elements;
}

}  // namespace engine
