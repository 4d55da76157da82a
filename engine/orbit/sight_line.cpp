#include "engine/orbit/sight_line.h"

#include <cmath>

#include "engine/core/constants.h"

namespace engine {

SightLine sight_line(const Propagator& camera, const Propagator& target, Epoch now,
                     LightPath path) noexcept {
  SightLine line;
  line.emitted = now;
  line.camera = camera.at(now);
  line.target = target.at(now);
  if (path == LightPath::kApparent) {
    for (int i = 0; i < 2; ++i) {
      const double distance_m = (line.target.position.m - line.camera.position.m).norm();
      line.emitted = now - from_seconds(distance_m / kSpeedOfLight_m_s);
      line.target = target.at(line.emitted);
    }
  }
  const Eigen::Vector3d to_target = line.target.position.m - line.camera.position.m;
  const Eigen::Vector3d speed = line.target.velocity.m_s - line.camera.velocity.m_s;
  line.range_m = to_target.norm();
  line.toward_target = direction_of<J2000>(to_target);
  line.range_rate_m_s = speed.dot(line.toward_target.unit);
  line.rate_rad_s = speed.cross(line.toward_target.unit).norm() / line.range_m;
  line.apparent = line.toward_target;
  if (path == LightPath::kApparent) {
    line.apparent =
        direction_of<J2000>(line.toward_target.unit + line.camera.velocity.m_s / kSpeedOfLight_m_s);
  }
  return line;
}

Rotation<J2000, J2000> without_aberration(const SightLine& line) noexcept {
  return {Eigen::Quaterniond::FromTwoVectors(line.apparent.unit, line.toward_target.unit)
              .toRotationMatrix()};
}

Eigen::Vector3d aberrated(const Eigen::Vector3d& unit, const Velocity<J2000>& observer) noexcept {
  const Eigen::Vector3d beta = observer.m_s / kSpeedOfLight_m_s;
  const double inverse_gamma = std::sqrt(1.0 - beta.squaredNorm());
  const double along = unit.dot(beta);
  return (inverse_gamma * unit + (1.0 + along / (1.0 + inverse_gamma)) * beta) / (1.0 + along);
}

}  // namespace engine
