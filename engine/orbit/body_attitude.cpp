#include "engine/orbit/body_attitude.h"

#include <cmath>
#include <string>

#include "engine/core/constants.h"

namespace engine {
namespace {

using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;

Vector3d vector_of(const ConfigTable& table, const char* key, const Range& range) {
  const std::vector<double> v = table.numbers(key, 3, range);
  return {v[0], v[1], v[2]};
}

std::optional<Quaterniond> read_quaternion(const ConfigTable& table) {
  if (!table.has("quaternion")) return std::nullopt;
  const std::vector<double> q = table.numbers("quaternion", 4, between(-1.001, 1.001));
  const Quaterniond found(q[3], q[0], q[1], q[2]);
  if (std::abs(found.norm() - 1.0) > 1e-3)
    table.fail("quaternion",
               "must have a length of 1 within .001, got " + std::to_string(found.norm()));
  for (const char* key : {"pitch_deg", "roll_deg", "yaw_deg"})
    if (table.has(key) && table.number(key, any_number()) != 0.0)
      table.fail(key, "and quaternion exclude each other");
  return found.normalized();
}

void read_spin(const ConfigTable& table, AttitudeSpec& spec) {
  const Vector3d axis = vector_of(table, "spin_axis", between(-1e6, 1e6));
  if (!(axis.norm() > 1e-6)) table.fail("spin_axis", "must not be zero");
  spec.spin_axis = axis.normalized();
  spec.spin_rate_rad_s = table.number("spin_rate_deg_s", between(-1e4, 1e4)) * kDegree;
  spec.spin_phase_rad = table.number_or("spin_phase_deg", 0.0, between(-360.0, 360.0)) * kDegree;
}

void read_tumbling(const ConfigTable& table, AttitudeSpec& spec) {
  spec.inertia = vector_of(table, "moments_of_inertia", positive());
  if (2.0 * spec.inertia.maxCoeff() > spec.inertia.sum())
    table.fail("moments_of_inertia", "must be those of a body: none above the sum of the others");
  spec.inertia /= spec.inertia.maxCoeff();
  if (!(spec.inertia.minCoeff() > 1e-6))
    table.fail("moments_of_inertia", "must not differ by more than a factor of a million");
  spec.rate_rad_s = vector_of(table, "rate_deg_s", between(-1e4, 1e4)) * kDegree;
  if (TumblingBody::cycle_steps(spec.inertia, spec.rate_rad_s) > TumblingBody::kMostSteps)
    table.fail("moments_of_inertia",
               "are so nearly equal that its motion takes too long to "
               "repeat: make them equal, or use attitude = \"spin\"");
}

void read_file(const ConfigTable& table, AttitudeSpec& spec) {
  spec.where = table.where("attitude_file");
  const std::string path = table.text("attitude_file");
  try {
    spec.segments = read_aem(KvnLines::from_file(path));
  } catch (const ConfigError& e) {
    table.fail("attitude_file", std::string("is no attitude: ") + e.what());
  }
}

}  // namespace

AttitudeSpec read_attitude(const ConfigTable& table) {
  AttitudeSpec spec;
  spec.kind = table.choice_or<AttitudeKind>("attitude", "nadir",
                                            {{"nadir", AttitudeKind::kNadir},
                                             {"inertial", AttitudeKind::kInertial},
                                             {"spin", AttitudeKind::kSpin},
                                             {"tumbling", AttitudeKind::kTumbling},
                                             {"aem", AttitudeKind::kFile}});
  spec.offsets = read_offsets(table);
  if (spec.kind != AttitudeKind::kNadir && spec.kind != AttitudeKind::kFile)
    spec.body_from_j2000 = read_quaternion(table);
  if (spec.kind == AttitudeKind::kSpin) read_spin(table, spec);
  if (spec.kind == AttitudeKind::kTumbling) read_tumbling(table, spec);
  if (spec.kind == AttitudeKind::kFile) read_file(table, spec);
  return spec;
}

void need_span(const AttitudeSpec& spec, const EpochSpan& wanted) {
  if (spec.kind != AttitudeKind::kFile) return;
  if (const auto gap = gap_in(spec.segments, wanted)) fail_for_gap(spec.where, wanted, *gap);
}

BodyAttitude::BodyAttitude(const AttitudeSpec& spec, Epoch epoch) : spec_(spec), epoch_(epoch) {
  at_epoch_.matrix = spec.body_from_j2000 ? spec.body_from_j2000->toRotationMatrix()
                                          : body_offset(spec.offsets).matrix;
  if (spec.kind == AttitudeKind::kTumbling)
    tumbling_.emplace(spec.inertia, spec.rate_rad_s,
                      Quaterniond(Matrix3d(at_epoch_.matrix.transpose())));
}

Rotation<BodyFrame, J2000> BodyAttitude::axes(Epoch t, const OrbitState& upright) const noexcept {
  if (spec_.kind == AttitudeKind::kNadir)
    return body_offset(spec_.offsets) * orbital_frame(upright);
  if (spec_.kind == AttitudeKind::kFile) return {attitude_at(spec_.segments, t).toRotationMatrix()};
  const double t_s = seconds(t - epoch_);
  if (spec_.kind == AttitudeKind::kTumbling)
    return {tumbling_->at(t_s).j2000_from_body.toRotationMatrix().transpose()};
  if (spec_.kind == AttitudeKind::kInertial) return at_epoch_;
  const double turned_rad =
      std::remainder(spec_.spin_phase_rad + spec_.spin_rate_rad_s * t_s, 2.0 * kPi);
  // The axes turn with the body.
  return {Eigen::AngleAxisd(-turned_rad, spec_.spin_axis).toRotationMatrix() * at_epoch_.matrix};
}

}  // namespace engine
