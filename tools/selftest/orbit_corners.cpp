// Time, and where bodies are.

#include <array>
#include <chrono>
#include <cmath>
#include <cstdint>

#include "engine/orbit/elements.h"
#include "engine/orbit/j2.h"
#include "engine/orbit/sight_line.h"
#include "engine/orbit/sun.h"
#include "engine/orbit/utc.h"
#include "tools/selftest/corner.h"
#include "tools/selftest/paper_orbits.h"
#include "tools/selftest/worst.h"

namespace corners {
namespace {

using Eigen::Vector3d;
using engine::Epoch;
using engine::J2Propagator;
using engine::kDegree;
using engine::OrbitState;

constexpr double kNanosecondsADay = 86400e9;

Corner julian_date() {
  const Epoch start = engine::epoch_from_utc("2026-11-23T05:06:07").value();
  const auto days = [](Epoch t) {
    const auto date = engine::terrestrial_time(t);
    return date.day1 + date.day2;
  };
  Worst plain;
  Worst ours;
  for (int i = 0; i < 1000; ++i) {
    const engine::Duration later(static_cast<std::int64_t>(i) * 99'991);
    const Epoch t = start + later;
    const auto want_ns = static_cast<double>(later.count());
    plain.add(std::abs((days(t) - days(start)) * kNanosecondsADay - want_ns));
    const Epoch back = engine::epoch_from_utc(engine::utc_text(t, 9)).value();
    ours.add(std::abs(static_cast<double>((back - t).count())));
  }
  return {
      "time of a frame",
      "Julian date in one double",
      plain.value(),
      ours.value(),
      0.5,
      "ns",
      "Error of a time after an epoch; ours goes out as a date and comes back. The bound is half "
      "a tick of integer nanoseconds. 40 us are 7 px of a fast pass. IAU SOFA, SOFA Time Scale "
      "and Calendar Tools, on two-part dates."};
}

/// Seconds of POSIX: 86400 to each day.
double posix_s(int days, int second_of_day) { return 86400.0 * days + second_of_day; }

Corner leap_second() {
  const auto at = [](const char* text) { return engine::epoch_from_utc(text).value(); };
  const double ours_s = engine::seconds(at("2017-01-01T00:00:00") - at("2016-12-31T23:59:59.5"));
  // Second 60 is the next day's first there; so are both halves of its way.
  const double plain_s = posix_s(17167, 0) - posix_s(17166, 86399) - 0.5;
  return {
      "over a leap second",
      "POSIX seconds",
      std::abs(plain_s - 1.5),
      std::abs(ours_s - 1.5),
      1e-9,
      "s",
      "Error of the time from 2016-12-31T23:59:59.5 to midnight, 1.5 s; a satellite goes 7.6 km "
      "in the missing one. The bound is a tick. CCSDS 301.0-B-4; IERS Bulletin C 52."};
}

/// As a textbook has it, with arccosines of the vectors' products.
engine::KeplerElements textbook_elements(const OrbitState& s) {
  const Vector3d& r = s.position.m;
  const Vector3d& v = s.velocity.m_s;
  const Vector3d h = r.cross(v);
  const Vector3d node = Vector3d::UnitZ().cross(h);
  const Vector3d e = v.cross(h) / engine::kEarthMu_m3_s2 - r.normalized();
  const auto angle = [](const Vector3d& a, const Vector3d& b, bool beyond) {
    const double acute = std::acos(a.dot(b) / (a.norm() * b.norm()));
    return beyond ? 2.0 * engine::kPi - acute : acute;
  };
  engine::KeplerElements out;
  out.eccentricity = e.norm();
  out.semi_major_axis_m = 1.0 / (2.0 / r.norm() - v.squaredNorm() / engine::kEarthMu_m3_s2);
  out.inclination_rad = std::acos(h.z() / h.norm());
  out.raan_rad = angle(Vector3d::UnitX(), node, node.y() < 0.0);
  out.argument_of_perigee_rad = angle(node, e, e.z() < 0.0);
  const double truth = angle(e, r, r.dot(v) < 0.0);
  const double eccentric =
      2.0 * std::atan(std::sqrt((1.0 - out.eccentricity) / (1.0 + out.eccentricity)) *
                      std::tan(0.5 * truth));
  out.mean_anomaly_rad = eccentric - out.eccentricity * std::sin(eccentric);
  return out;
}

Corner singular_elements() {
  Worst plain;
  Worst ours;
  const auto miss_m = [](const engine::KeplerElements& elements, const OrbitState& want) {
    return (engine::KeplerPropagator(elements, {}).at({}).position.m - want.position.m).norm();
  };
  for (const double e : {0.0, 1e-16, 1e-12, 1e-8}) {
    for (const double i_deg : {0.0, 1e-10, 90.0, 180.0}) {
      engine::KeplerElements from{7e6, e, i_deg * kDegree, 0.7, 1.1, 2.3};
      const OrbitState state = engine::KeplerPropagator(from, {}).at({});
      plain.add(miss_m(textbook_elements(state), state));
      const auto elements = engine::elements_of(state);
      ours.add(elements ? miss_m(*elements, state) : HUGE_VAL);
    }
  }
  return {"circular, equatorial orbits",
          "arccosines of the vectors",
          plain.value(),
          ours.value(),
          1e-6,
          "m",
          "State to elements and back; perigee and node have no direction there. The bound is some "
          "500 roundings of 7000 km. Vallado 2013, algorithm 9, with arctangents."};
}

Vector3d oblate_gravity(const Vector3d& r, const engine::OblateEarth& earth) {
  const double r2 = r.squaredNorm();
  const double z2 = r.z() * r.z() / r2;
  const double k = 1.5 * earth.j2 * earth.radius_m * earth.radius_m / r2;
  const double pull = -earth.mu_m3_s2 / (r2 * std::sqrt(r2));
  const double across = pull * (1.0 + k * (1.0 - 5.0 * z2));
  return {across * r.x(), across * r.y(), pull * (1.0 + k * (3.0 - 5.0 * z2)) * r.z()};
}

/// A state and its change alike: place and speed.
using Pair = std::array<Vector3d, 2>;

Pair change_of(const Pair& s) { return {s[1], oblate_gravity(s[0], {})}; }
Pair ahead(const Pair& s, const Pair& change, double step_s) {
  return {s[0] + step_s * change[0], s[1] + step_s * change[1]};
}

/// Runge and Kutta's fourth order.
OrbitState runge_kutta(const OrbitState& from, double step_s, int steps) {
  Pair s{from.position.m, from.velocity.m_s};
  for (int i = 0; i < steps; ++i) {
    const Pair a = change_of(s);
    const Pair b = change_of(ahead(s, a, 0.5 * step_s));
    const Pair c = change_of(ahead(s, b, 0.5 * step_s));
    const Pair d = change_of(ahead(s, c, step_s));
    for (std::size_t k = 0; k < 2; ++k)
      s[k] += step_s / 6.0 * (a[k] + 2.0 * b[k] + 2.0 * c[k] + d[k]);
  }
  return {{s[0]}, {s[1]}};
}

Corner oblateness() {
  const PaperOrbits orbits;
  const OrbitState first = orbits.camera.at(orbits.epoch);
  const J2Propagator ours(first, orbits.epoch, {orbits.epoch, orbits.at(600.0)});
  const OrbitState want = runge_kutta(first, 1.0, 600);
  const auto miss_m = [&](const engine::Propagator& p) {
    return (p.at(orbits.at(600.0)).position.m - want.position.m).norm();
  };
  return {"low orbit, ten minutes on",
          "two bodies",
          miss_m(orbits.camera),
          miss_m(ours),
          1e-3,
          "m",
          "Distance to the oblate Earth's motion by Runge-Kutta, 1 s a step, whose own error is "
          "some 1e-7 m. Ours has it as a choice, and prints the error of the one that is chosen. "
          "The bound is J2Propagator's. Vallado 2013, eq 8-30."};
}

Corner energy_drift() {
  const PaperOrbits orbits;
  constexpr double kSpan_s = 15.0 * 86400.0;
  const OrbitState first = orbits.camera.at(orbits.epoch);
  const auto drift = [&](const OrbitState& s) {
    return std::abs(engine::energy_j_kg(s) / engine::energy_j_kg(first) - 1.0);
  };
  const J2Propagator ours(first, orbits.epoch, {orbits.epoch, orbits.at(kSpan_s)});
  return {"low orbit, 15 days on",
          "Runge-Kutta, 60 s a step",
          drift(runge_kutta(first, 60.0, static_cast<int>(kSpan_s / 60.0))),
          drift(ours.at(orbits.at(kSpan_s))),
          1e-13,
          "of it",
          "Change of the energy, which such motion keeps. The bound is some 450 roundings, of 1900 "
          "steps of order 24. Jorba and Zou 2005, Experimental Mathematics 14."};
}

/// Where the light that arrives now left the target, by bisection of its travel.
Vector3d seen_place_m(const PaperOrbits& orbits, double t_s, const Vector3d& camera_m) {
  double low_s = 0;
  double high_s = 0.1;
  const auto place = [&](double ago_s) {
    // In two parts: a time in nanoseconds would be good to 15 um only.
    const OrbitState now = orbits.target.at(orbits.at(t_s));
    const double g = -engine::kEarthMu_m3_s2 / std::pow(now.position.m.norm(), 3.0);
    return Vector3d(now.position.m - ago_s * now.velocity.m_s +
                    0.5 * ago_s * ago_s * g * now.position.m);
  };
  for (int i = 0; i < 60; ++i) {
    const double ago_s = 0.5 * (low_s + high_s);
    const bool earlier = (place(ago_s) - camera_m).norm() > engine::kSpeedOfLight_m_s * ago_s;
    (earlier ? low_s : high_s) = ago_s;
  }
  return place(low_s);
}

/// A photon's four-momentum, boosted into the moving observer's frame.
Vector3d boosted(const Vector3d& toward, const Vector3d& observer_m_s) {
  const Vector3d beta = observer_m_s / engine::kSpeedOfLight_m_s;
  const double gamma = 1.0 / std::sqrt(1.0 - beta.squaredNorm());
  const Vector3d moves = -toward;
  const double along = beta.dot(moves);
  const Vector3d out = moves + ((gamma - 1.0) * along / beta.squaredNorm() - gamma) * beta;
  return -out.normalized();
}

Corner light_time() {
  const PaperOrbits orbits;
  Worst plain;
  Worst ours;
  for (const double after_s : {-10.0, 0.0, 10.0}) {
    const double t_s = kClosestOfPass3_s + after_s;
    const OrbitState camera = orbits.camera.at(orbits.at(t_s));
    const Vector3d line = seen_place_m(orbits, t_s, camera.position.m) - camera.position.m;
    const Vector3d want = boosted(line.normalized(), camera.velocity.m_s);
    const auto off_px = [&](engine::LightPath path) {
      const auto got = engine::sight_line(orbits.camera, orbits.target, orbits.at(t_s), path);
      return engine::angle_between_rad(got.apparent.unit, want) / kIfov_rad;
    };
    plain.add(off_px(engine::LightPath::kGeometric));
    ours.add(off_px(engine::LightPath::kApparent));
  }
  return {
      "line of sight at 15 km/s",
      "where target is now",
      plain.value(),
      ours.value(),
      1e-3,
      "px",
      "Angle to the light's own path, by bisection and a Lorentz boost. The bound is what first "
      "order in v/c leaves, v^2/c^2 = 7e-10 rad, twice. Green 1985, Spherical Astronomy, 8.3."};
}

Corner star_aberration() {
  const engine::Velocity<engine::J2000> observer =
      engine::earth_velocity(engine::epoch_from_utc("2022-01-01T00:00:00").value());
  Worst plain;
  Worst ours;
  for (int i = 0; i < 200; ++i) {
    const double z = -1.0 + (i + 0.5) / 100.0;
    const double turn = 2.399963229728653 * i;  // the golden angle
    const double r = std::sqrt(1.0 - z * z);
    const Vector3d star(r * std::cos(turn), r * std::sin(turn), z);
    const Vector3d want = boosted(star, observer.m_s);
    plain.add(engine::angle_between_rad(star, want) / kIfov_rad);
    ours.add(engine::angle_between_rad(engine::aberrated(star, observer), want) / kIfov_rad);
  }
  return {"stars from a moving Earth",
          "catalogue places",
          plain.value(),
          ours.value(),
          1e-6,
          "px",
          "Angle to the Lorentz boost of the photon. The bound is 1.4e-12 rad: roundings of unit "
          "vectors, over a beta of 1e-4. Green 1985, section 8.3."};
}

Corner sun_of_date() {
  Worst plain;
  Worst ours;
  for (int month = 0; month < 24; ++month) {
    const Epoch t =
        engine::epoch_from_utc("2022-01-01T00:00:00").value() + std::chrono::hours(24 * 30 * month);
    const auto date = engine::terrestrial_time(t);
    const double centuries = ((date.day1 - 2451545.0) + date.day2) / 36525.0;
    const Vector3d want = engine::sun_position(engine::SunModel::kErfa, t).m;
    const auto off_arcsec = [&](const Vector3d& got) {
      return engine::angle_between_rad(got, want) / kDegree * 3600.0;
    };
    plain.add(off_arcsec(engine::table1_sun_of_date_m(centuries)));
    ours.add(off_arcsec(engine::sun_position(engine::SunModel::kTable1, t).m));
  }
  return {
      "the Sun by mean elements",
      "of date taken for J2000",
      plain.value(),
      ours.value(),
      45,
      "arcsec",
      "Angle to ERFA's ephemeris, 2022 and 2023. The bound is the elements' own: the Moon's pull "
      "and the planets' are left out. Meeus 1998, Astronomical Algorithms, chapters 21, 25."};
}

}  // namespace

Room orbit_corners() {
  return {"Time, orbits, light paths",
          {julian_date(), leap_second(), singular_elements(), oblateness(), energy_drift(),
           light_time(), star_aberration(), sun_of_date()}};
}

}  // namespace corners
