#include "engine/scene/camera_geometry.h"

#include <gtest/gtest.h>

namespace engine {
namespace {

TEST(CameraGeometry, HasThePapersFieldAndPrincipalPoint) {
  const CameraGeometry camera;
  EXPECT_NEAR(camera.ifov_rad(), 1.4444e-6, 5e-11);  // as printed in table 4's notes
  EXPECT_EQ(camera.principal_point().u, 512.0);
  EXPECT_EQ(camera.principal_point().v, 512.0);
  // Half the diagonal of 1.479 mrad squared; four digits are printed.
  EXPECT_NEAR(camera.half_diagonal_field_rad(), 1.479e-3 / std::sqrt(2.0), 4e-7);
}

TEST(CameraGeometry, ProjectsADirectionBackToItsPlace) {
  const CameraGeometry camera;
  for (const PixelPoint p : {PixelPoint{0, 0}, PixelPoint{512, 512}, PixelPoint{1023.25, -3.5}}) {
    const auto back = camera.project(7.0 * camera.direction_at(p));
    ASSERT_TRUE(back.has_value());
    EXPECT_NEAR(back->u, p.u, 1e-9);  // 1e-16 rad times 7e5 px per rad
    EXPECT_NEAR(back->v, p.v, 1e-9);
  }
}

TEST(CameraGeometry, HasXToTheRightAndYDown) {
  const CameraGeometry camera;
  EXPECT_GT(camera.project({1e-6, 0.0, 1.0})->u, 512.0);
  EXPECT_GT(camera.project({0.0, 1e-6, 1.0})->v, 512.0);
}

TEST(CameraGeometry, SeesNothingBehindIt) {
  const CameraGeometry camera;
  EXPECT_FALSE(camera.project({0.0, 0.0, -1.0}).has_value());
  EXPECT_FALSE(camera.project({1.0, 0.0, 0.0}).has_value());
  EXPECT_FALSE(camera.project({0.0, 0.0, std::nan("")}).has_value());
}

}  // namespace
}  // namespace engine
