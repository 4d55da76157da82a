// Frames and turns, where formulas have no answer or lose their digits.

#include <array>
#include <cmath>

#include <Eigen/Geometry>

#include "engine/core/constants.h"
#include "engine/core/vec.h"
#include "engine/orbit/attitude.h"
#include "engine/orbit/body_attitude.h"
#include "hil/turn.h"
#include "tools/selftest/corner.h"
#include "tools/selftest/worst.h"

namespace corners {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kRounding = 0x1p-52;

/// How far a matrix is from a rotation.
double not_rotation(const Matrix3d& m) {
  const double off = (m * m.transpose() - Matrix3d::Identity()).cwiseAbs().maxCoeff();
  return m.allFinite() ? off : NAN;
}

Corner small_angles() {
  Worst plain;
  Worst ours;
  for (int i = 0; i <= 120; ++i) {
    const double tan = std::pow(10.0, -0.1 * i);
    const Vector3d a(1.0, 0.0, 0.0);
    const Vector3d b(1.0, tan, 0.0);
    const double want = std::atan(tan);
    plain.add(std::abs(std::acos(a.dot(b.normalized())) / want - 1.0));
    ours.add(std::abs(engine::angle_between_rad(a, b) / want - 1.0));
  }
  return {"small angles, to 1e-12 rad",
          "arccosine of the product",
          plain.value(),
          ours.value(),
          8 * kRounding,
          "of it",
          "Error of the angle between two lines. An arccosine resolves 1.5e-8 rad there. The bound "
          "is eight roundings: of the product, the length and the arctangent."};
}

Matrix3d plain_orbital_frame(const engine::OrbitState& s) {
  Matrix3d axes;
  axes.row(2) = -s.position.m.normalized();
  axes.row(1) = -s.position.m.cross(s.velocity.m_s) / s.position.m.cross(s.velocity.m_s).norm();
  axes.row(0) = axes.row(1).cross(axes.row(2));
  return axes;
}

Corner radial_motion() {
  Worst plain;
  Worst ours;
  for (const Vector3d& up : {Vector3d(7e6, 0, 0), Vector3d(0, 0, 7e6), Vector3d(3e6, 4e6, 5e6)}) {
    for (const double speed : {-1e-3, 0.0, 1e-3}) {
      const engine::OrbitState state{{up}, {speed * up}};
      plain.add(not_rotation(plain_orbital_frame(state)));
      ours.add(not_rotation(engine::orbital_frame(state).matrix));
    }
  }
  return {"orbital frame, straight up",
          "r x v over its length",
          plain.value(),
          ours.value(),
          16 * kRounding,
          "",
          "How far the axes are from a rotation where there is no orbit's plane. The bound is 16 "
          "roundings of three rows' products. Ours says that it has no answer of its own."};
}

/// Eq 8 of Li et al. 2023: the angle round the pole by an arccosine and a sign.
Vector3d plain_boresight(const Vector3d& r) {
  const double across = std::hypot(r.x(), r.y());
  const double sign = r.y() > 0.0 ? 1.0 : r.y() < 0.0 ? -1.0 : 0.0;
  const double turn = std::acos(r.x() / across) * sign;
  return {across * std::cos(turn), across * std::sin(turn), r.z()};
}

Corner look_at() {
  Worst plain;
  Worst ours;
  for (const Vector3d& r : {Vector3d(0, 0, 1), Vector3d(0, 0, -1), Vector3d(-1, 0, 0),
                            Vector3d(-0.6, 0, 0.8), Vector3d(0.6, -0.8, 0)}) {
    plain.add((plain_boresight(r) - r).norm());
    const Matrix3d axes = engine::look_along({r}).axes.matrix;
    ours.add((axes.row(2).transpose() - r).norm() + not_rotation(axes));
  }
  return {"camera to the pole, or along -x",
          "arccosine and sign, eq 8",
          plain.value(),
          ours.value(),
          16 * kRounding,
          "",
          "How far the boresight is from where it is to look. At the pole the printed formula is "
          "0/0, along -x its sign is 0. The bound is 16 roundings."};
}

Vector3d golden_axis(int i, int count) {
  const double z = -1.0 + 2.0 * (i + 0.5) / count;
  const double r = std::sqrt(1.0 - z * z);
  return {r * std::cos(2.399963229728653 * i), r * std::sin(2.399963229728653 * i), z};
}

/// By the trace alone.
Matrix3d through_trace_quaternion(const Matrix3d& m) {
  const double w = 0.5 * std::sqrt(1.0 + m.trace());
  const Vector3d odd(m(2, 1) - m(1, 2), m(0, 2) - m(2, 0), m(1, 0) - m(0, 1));
  const Vector3d v = odd / (4.0 * w);
  return Eigen::Quaterniond(w, v.x(), v.y(), v.z()).toRotationMatrix();
}

Corner half_turns() {
  Worst plain;
  Worst ours;
  constexpr int kAxes = 500;
  for (int i = 0; i < kAxes; ++i) {
    for (const double short_of_pi : {1e-4, 1e-8, 0.0}) {
      const Matrix3d m = hil::axes_turned((engine::kPi - short_of_pi) * golden_axis(i, kAxes));
      plain.add((through_trace_quaternion(m) - m).cwiseAbs().maxCoeff());
      ours.add((hil::axes_of(hil::quaternion_of(m)) - m).cwiseAbs().maxCoeff());
    }
  }
  return {"quaternion of half a turn",
          "from the trace",
          plain.value(),
          ours.value(),
          32 * kRounding,
          "",
          "Matrix to quaternion and back, about 500 axes. The trace is -1 there, and a root of the "
          "difference is left. Shepperd 1978, DOI 10.2514/3.55767b. The bound is 32 roundings."};
}

/// The rotation vector by the arccosine of the trace.
Vector3d arccosine_turn(const Matrix3d& m) {
  const double angle = std::acos(0.5 * (m.trace() - 1.0));
  const Vector3d odd(m(1, 2) - m(2, 1), m(2, 0) - m(0, 2), m(0, 1) - m(1, 0));
  return angle / (2.0 * std::sin(angle)) * odd;
}

Corner tiny_turns() {
  Worst plain;
  Worst ours;
  for (int i = 0; i < 100; ++i) {
    for (const double angle : {1e-9, 1e-6, 1e-3, 3.14159}) {
      const Vector3d want = angle * golden_axis(i, 100);
      const Matrix3d m = hil::axes_turned(want);
      plain.add((arccosine_turn(m) - want).norm());
      ours.add((hil::turn_of(m) - want).norm());
    }
  }
  return {
      "the turn between two attitudes",
      "arccosine of the trace",
      plain.value(),
      ours.value(),
      64 * kRounding,
      "rad",
      "Error of a turn of 1e-9 rad to almost pi, back from its matrix. The bound is 64 roundings "
      "of the matrix, of the order of 1."};
}

Corner wrapped_angle() {
  const double from = 179.0 * engine::kDegree;
  const double to = -179.0 * engine::kDegree;
  const double plain = std::abs(to - from);
  const double ours =
      (hil::turn_near(to * Vector3d::UnitZ(), from * Vector3d::UnitZ()) - from * Vector3d::UnitZ())
          .norm();
  const double want = 2.0 * engine::kDegree;
  return {"a command over +-180 deg",
          "difference of angles",
          std::abs(plain - want),
          std::abs(ours - want),
          16 * kRounding,
          "rad",
          "Way from 179 to -179 deg, less the 2 deg that it is. The bound is 16 roundings of pi."};
}

Corner long_spin() {
  constexpr int kSteps = 9'000'000;  // 50 h at 50 Hz
  constexpr double kRate_rad_s = 0.01;
  constexpr double kStep_s = 0.02;
  const auto half = static_cast<float>(0.5 * kRate_rad_s * kStep_s);
  float w = 1;
  float z = 0;
  for (int i = 0; i < kSteps; ++i) {
    const float next = w * std::cos(half) - z * std::sin(half);
    z = z * std::cos(half) + w * std::sin(half);
    w = next;
  }
  engine::AttitudeSpec spec;
  spec.kind = engine::AttitudeKind::kSpin;
  spec.spin_axis = Vector3d::UnitZ();
  spec.spin_rate_rad_s = kRate_rad_s;
  const double t_s = kSteps * kStep_s;
  const Matrix3d m =
      engine::BodyAttitude(spec, {}).axes(engine::Epoch{} + engine::from_seconds(t_s), {}).matrix;
  const double want = kRate_rad_s * t_s;
  const auto off = [want](double angle) {
    return std::abs(std::remainder(angle - want, 2.0 * engine::kPi));
  };
  return {
      "an even spin for 50 h",
      "float quaternion, 50 Hz",
      off(2.0 * std::atan2(static_cast<double>(z), static_cast<double>(w))),
      off(std::atan2(m(0, 1), m(0, 0))),
      1e-12,
      "rad",
      "Angle after 9 million steps, less rate times time. The bound is two roundings of 1800 rad "
      "of turn."};
}

}  // namespace

Room attitude_corners() {
  return {"Attitude",
          {small_angles(), radial_motion(), look_at(), half_turns(), tiny_turns(), wrapped_angle(),
           long_spin()}};
}

}  // namespace corners
