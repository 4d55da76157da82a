#include "engine/render/cap_light.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include <gtest/gtest.h>

#include "engine/core/constants.h"
#include "engine/render/texel_rays.h"
#include "tests/support/scenes.h"

namespace engine {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;

Vector3f turned_by(double angle_rad) {
  return {static_cast<float>(std::cos(angle_rad)), static_cast<float>(std::sin(angle_rad)), 0.0F};
}

TEST(RecentTurns, TellByTheAngleBetweenThenAndNow) {
  RecentTurns turns(7.5e-3F);
  // Away by a milliradian a frame, and back again: what counts is where it is, not the way.
  for (std::uint32_t f = 1; f <= 40; ++f)
    turns.note(f, turned_by(1e-3 * (20.0 - std::abs(f - 20.0))));
  for (std::uint32_t f = 1; f <= 40; ++f)
    EXPECT_EQ(turns.since(f), 20.0 - std::abs(f - 20.0) > 7.5) << f;
}

TEST(RecentTurns, KnowNothingOfWhatWasTooLongAgoOrForgotten) {
  RecentTurns turns(8e-3F);
  for (std::uint32_t f = 1; f <= 100; ++f) turns.note(f, turned_by(0.0));
  EXPECT_TRUE(turns.since(100 - RecentTurns::kFrames));
  EXPECT_FALSE(turns.since(101 - RecentTurns::kFrames));
  turns.forget();
  turns.note(101, turned_by(0.0));
  EXPECT_TRUE(turns.since(100));
  EXPECT_FALSE(turns.since(101));
  turns.note(102, Vector3f::Constant(std::numeric_limits<float>::quiet_NaN()));
  EXPECT_TRUE(turns.since(101));
}

/// From 420 km, the nadir `turned_rad` from the body's x axis.
EarthLight earth_at(double turned_rad) {
  EarthDisc<BodyFrame> disc;
  disc.to_centre.unit = {std::cos(turned_rad), std::sin(turned_rad), 0.0};
  disc.to_sun.unit = Vector3d(-1.0, 0.3, 0.5).normalized();
  disc.north.unit = Vector3d::UnitZ();
  disc.distance_radii = 1.0 + 420e3 / kEarthRadius_m;
  disc.sun_irradiance_w_m2 = 600.0;
  return EarthLight(disc);
}

struct KeptLight {
  KeptLight() : target(plate(), {test_support::lambert_material("grey", 0.5)}), cap(target) {}
  static Mesh plate() {
    Mesh mesh;
    test_support::add_plate(mesh, "grey", {0, 0, 0}, {0, 1, 0}, {0.2F, 0, 1});
    return mesh;
  }
  [[nodiscard]] HemisphereBins::FineValues seen_now(std::uint32_t side,
                                                    const EarthLight& earth) const {
    const SurfacePoint place = target.facets.on_side(side / 2, 0, 0, side % 2);
    HemisphereBins::FineValues light;
    HemisphereBins::see(earth, TexelRays::axes_of(place.normal), light);
    return light;
  }
  TracedTarget target;
  WorkerPool pool{2};
  CapLight cap;
};

TEST(CapLight, IsWhatWasSeenWhileTheEarthStoodWithinEightMilliradians) {
  KeptLight kept;
  for (const std::uint32_t side : {0U, 1U}) kept.cap.keep(side);
  constexpr double kTurn_rad = 1e-3;  // a frame
  for (std::uint32_t frame = 1; frame <= 150; ++frame) {
    kept.cap.renew(frame, earth_at(kTurn_rad * frame), kept.pool);
    for (const std::uint32_t side : {0U, 1U}) {
      ASSERT_NE(kept.cap.of(side), nullptr);
      bool found = false;
      for (std::uint32_t back = 0; back <= 8 && back < frame && !found; ++back)
        found =
            kept.cap.of(side)->w_m2_sr == kept.seen_now(side, earth_at(kTurn_rad * (frame - back)));
      EXPECT_TRUE(found) << frame << ' ' << side;
    }
  }
  // The side that faces away from the Earth and the one that does not.
  EXPECT_NE(kept.cap.of(0)->dark, kept.cap.of(1)->dark);
}

TEST(CapLight, OfAnEarthThatStandsStillIsRenewedWithinSixtyFourFrames) {
  // Its albedo goes up at once: no direction tells.
  KeptLight kept;
  kept.cap.keep(0);
  kept.cap.keep(1);
  const auto brighter = [](double by) {
    EarthDisc<BodyFrame> disc = earth_at(0.0).disc();
    disc.sun_irradiance_w_m2 *= by;
    return EarthLight(disc);
  };
  kept.cap.renew(1, brighter(1.0), kept.pool);
  for (std::uint32_t frame = 2; frame <= 65; ++frame)
    kept.cap.renew(frame, brighter(2.0), kept.pool);
  for (const std::uint32_t side : {0U, 1U})
    EXPECT_EQ(kept.cap.of(side)->w_m2_sr, kept.seen_now(side, brighter(2.0)));
}

TEST(CapLight, IsNoneOfOtherSidesNorOfADarkEarth) {
  KeptLight kept;
  kept.cap.keep(1);
  kept.cap.renew(1, earth_at(0.0), kept.pool);
  EXPECT_EQ(kept.cap.of(0), nullptr);
  EXPECT_NE(kept.cap.of(1), nullptr);
  kept.cap.renew(2, EarthLight(), kept.pool);
  EXPECT_EQ(kept.cap.of(1), nullptr);
  kept.cap.renew(3, earth_at(0.0), kept.pool);
  EXPECT_NE(kept.cap.of(1), nullptr);
  kept.cap.clear();
  EXPECT_EQ(kept.cap.of(1), nullptr);
}

}  // namespace
}  // namespace engine
