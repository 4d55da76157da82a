#include "engine/orbit/earth_rotation.h"

#include <erfa.h>

#include "engine/orbit/utc.h"

namespace engine {

Rotation<EarthFixed, J2000> earth_rotation(Epoch t) noexcept {
  const TwoPartDate utc = utc_date(t);
  const double angle = eraEra00(utc.day1, utc.day2);
  Rotation<EarthFixed, J2000> out;
  out.matrix = Eigen::AngleAxisd(-angle, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  return out;
}

}  // namespace engine
