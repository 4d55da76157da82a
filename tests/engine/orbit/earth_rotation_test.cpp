#include "engine/orbit/earth_rotation.h"

#include <cmath>

#include <gtest/gtest.h>

#include "engine/core/constants.h"
#include "engine/orbit/sun.h"
#include "engine/orbit/utc.h"

namespace engine {
namespace {

TEST(EarthRotation, TheSunStandsOverGreenwichAtNoonButForTheEquationOfTime) {
  // Minutes that a sundial is ahead, and declinations, from almanacs: the greatest and the least
  // of 2022, and the four days about which there are none.
  struct Noon {
    const char* utc;
    double equation_min;
    double declination_deg;
  };
  for (const Noon& noon :
       {Noon{"2022-02-11T12:00:00", -14.2, -13.9}, Noon{"2022-04-15T12:00:00", 0.0, 9.9},
        Noon{"2022-06-13T12:00:00", 0.0, 23.2}, Noon{"2022-09-01T12:00:00", 0.0, 8.2},
        Noon{"2022-11-03T12:00:00", 16.4, -15.2}, Noon{"2022-12-25T12:00:00", 0.0, -23.4}}) {
    const Epoch t = epoch_from_utc(noon.utc).value();
    const Position<EarthFixed> sun = earth_rotation(t) * sun_position(SunModel::kErfa, t);
    // The pole's .12 deg since 2000, and what is rounded away: .25 min are .06 deg.
    EXPECT_NEAR(std::atan2(sun.m.y(), sun.m.x()) / kDegree, -noon.equation_min / 4.0, 0.2)
        << noon.utc;
    EXPECT_NEAR(std::asin(sun.m.z() / sun.m.norm()) / kDegree, noon.declination_deg, 0.2)
        << noon.utc;
  }
}

TEST(EarthRotation, TurnsEastOnceInASiderealDay) {
  const Epoch t = epoch_from_utc("2022-01-01T00:00:00").value();
  const auto greenwich = [](Epoch when) {
    return (earth_rotation(when).inverse() * Direction<EarthFixed>{Eigen::Vector3d::UnitX()}).unit;
  };
  // 86164.0989 s: the stellar day (IERS). A millisecond is 7e-8 rad.
  EXPECT_LT((greenwich(t + from_seconds(86164.0989)) - greenwich(t)).norm(), 1e-7);
  const Eigen::Vector3d later = greenwich(t + std::chrono::hours(1));
  EXPECT_NEAR(std::asin(greenwich(t).cross(later).z()) / kDegree, 15.041, 0.001);
}

}  // namespace
}  // namespace engine
