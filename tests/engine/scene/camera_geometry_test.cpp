#include "engine/scene/camera_geometry.h"

#include <cmath>
#include <string>

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

CameraGeometry bent_camera() {
  CameraGeometry camera;
  camera.focal_length_m = 1000.0 * camera.pixel_pitch_m;
  camera.height_px = 768;
  camera.distortion = {.k1 = -0.21, .k2 = 0.13, .k3 = -0.04, .p1 = 0.0012, .p2 = -0.0007};
  return camera;
}

TEST(CameraGeometry, DistortsAsOpenCvDoes) {
  // cv::projectPoints of OpenCV 4.6 with fx = fy = 1000, cx = 512, cy = 384 and these terms.
  const CameraGeometry camera = bent_camera();
  const auto first = camera.project({0.3, -0.2, 1.0});
  EXPECT_NEAR(first->u, 804.081736000000, 1e-9);
  EXPECT_NEAR(first->v, 189.374176000000, 1e-9);
  const auto second = camera.project({-0.45, 0.36, 1.0});
  EXPECT_NEAR(second->u, 86.685985027898, 1e-9);
  EXPECT_NEAR(second->v, 724.463755977682, 1e-9);
  const auto third = camera.project({0.02, 0.4, 0.8});
  EXPECT_NEAR(third->u, 535.726305663818, 1e-9);
  EXPECT_NEAR(third->v, 862.335613276367, 1e-9);
}

TEST(CameraGeometry, FindsTheDirectionBehindADistortion) {
  const CameraGeometry camera = bent_camera();
  for (const PixelPoint p : {PixelPoint{0, 0}, PixelPoint{512, 384}, PixelPoint{1087.5, -63.25}}) {
    const Eigen::Vector3d direction = camera.direction_at(p);
    const auto back = camera.project(direction);
    ASSERT_TRUE(back.has_value());
    EXPECT_NEAR(back->u, p.u, 1e-9);
    EXPECT_NEAR(back->v, p.v, 1e-9);
  }
}

TEST(CameraGeometry, IsAffineNearADirectionToFirstOrder) {
  const CameraGeometry camera = bent_camera();
  const Eigen::Vector3d middle(0.3, -0.2, 1.0);
  const auto map = camera.map_near(middle, {}, 1.0);
  ASSERT_TRUE(map.has_value());
  const LocalCamera local(camera, *map);
  EXPECT_NEAR(local.project(middle)->u, camera.project(middle)->u, 1e-9);
  // Twice as far off it is four times as wrong.
  const auto error = [&](double off_tan) {
    const Eigen::Vector3d aside = middle + Eigen::Vector3d(off_tan, 0.7 * off_tan, 0.0);
    return std::hypot(local.project(aside)->u - camera.project(aside)->u,
                      local.project(aside)->v - camera.project(aside)->v);
  };
  EXPECT_NEAR(error(0.02) / error(0.01), 4.0, 0.2);
  EXPECT_LT(error(0.01), 0.05);  // of 10 px
  const PixelPoint place{800.0, 190.0};
  const auto back = local.project(local.direction_at(place));
  EXPECT_NEAR(back->u, place.u, 1e-9);
  EXPECT_NEAR(back->v, place.v, 1e-9);
  const Eigen::Vector3d beside = local.direction_at({801.0, 190.0});
  EXPECT_LT((local.direction_at(place) + local.direction_per_u() - beside).norm(), 1e-15);
}

TEST(CameraGeometry, ARollingShutterShowsEachRowAtItsTime) {
  CameraGeometry camera;
  camera.row_time_s = 20e-6;
  const PixelPoint motion{3.0, -2.0};  // a millisecond's
  const PixelPoint straight{600.0, 800.0};
  const Eigen::Vector3d direction = camera.straight_direction_at(straight);
  const auto map = camera.map_near(direction, motion, 1e-3);
  const PixelPoint seen = map->apply(straight);
  // Where the image is when the row that it is seen in is exposed.
  const double after_ms = (seen.v - camera.principal_point().v) * 0.02;
  EXPECT_NEAR(seen.u, straight.u + motion.u * after_ms, 1e-9);
  EXPECT_NEAR(seen.v, straight.v + motion.v * after_ms, 1e-9);
  EXPECT_GT(after_ms, 5.0);
  // Rows that an image outruns show it somewhere, not nowhere or upside down.
  const auto fast = camera.map_near(direction, {0.0, 400.0}, 1e-3);
  EXPECT_GT(fast->slope(1, 1), 0.0);
  EXPECT_TRUE(fast->slope.allFinite());
  EXPECT_FALSE(camera.map_near(direction, {std::nan(""), 0.0}, 1e-3).has_value());
}

CameraGeometry read(const std::string& more) {
  const ConfigReader config = ConfigReader::from_text(
      "[camera]\nfocal_length_m = 4.5\npixel_pitch_um = 6.5\nwidth_px = 1024\nheight_px = 768\n" +
          more,
      "x.toml");
  CameraGeometry camera = read_camera_geometry(config.table("camera"));
  config.reject_unknown_keys();
  return camera;
}

TEST(ReadCameraGeometry, AWindowSeesWhatTheSensorSeesThere) {
  const CameraGeometry whole = read("");
  const CameraGeometry window = read(
      "window_left_px = 100\nwindow_top_px = 48\nwindow_width_px = 640\nwindow_height_px = 500\n");
  EXPECT_EQ(window.width_px, 640);
  EXPECT_EQ(window.height_px, 500);
  EXPECT_EQ(window.window.sensor_width_px, 1024);
  const Eigen::Vector3d direction = whole.direction_at({300.25, 77.5});
  EXPECT_NEAR(window.project(direction)->u, 200.25, 1e-9);
  EXPECT_NEAR(window.project(direction)->v, 29.5, 1e-9);
  // Its furthest corner is (1024 - 284, 768 - 220) away from ours: the upper left.
  EXPECT_NEAR(window.half_diagonal_field_rad(), std::hypot(412.0, 336.0) * whole.ifov_rad(), 1e-9);
}

TEST(ReadCameraGeometry, BinnedPixelsCoverTheirPhotosites) {
  const CameraGeometry whole = read("");
  const CameraGeometry binned = read("binning = 2\n");
  EXPECT_EQ(binned.width_px, 512);
  EXPECT_DOUBLE_EQ(binned.pixel_pitch_m, 13e-6);
  // Photosites 300 and 301 are pixel 150: between their centres lies its own.
  const Eigen::Vector3d direction = whole.direction_at({300.5, 200.5});
  EXPECT_NEAR(binned.project(direction)->u, 150.0, 1e-9);
  EXPECT_NEAR(binned.project(direction)->v, 100.0, 1e-9);
  EXPECT_NEAR(binned.half_diagonal_field_rad(), whole.half_diagonal_field_rad(), whole.ifov_rad());
}

TEST(ReadCameraGeometry, RefusesWhatHasNoPicture) {
  EXPECT_THROW((void)read("window_left_px = 1020\n"), ConfigError);
  EXPECT_THROW((void)read("window_left_px = 500\nwindow_width_px = 600\n"), ConfigError);
  EXPECT_THROW((void)read("binning = 3\n"), ConfigError);  // 1024 is no multiple
  EXPECT_THROW((void)read("binning = 2\nwindow_left_px = 33\n"), ConfigError);
  EXPECT_THROW((void)read("binning = 0\n"), ConfigError);
  EXPECT_THROW((void)read("row_time_us = -1\n"), ConfigError);
  EXPECT_THROW((void)read("row_time_us = nan\n"), ConfigError);
  // The field is .9 mrad wide, and 1 / 3 r^2 is 4e5: from there on the image folds.
  EXPECT_NO_THROW((void)read("distortion_k1 = -1e5\n"));
  EXPECT_THROW((void)read("distortion_k1 = -1e6\n"), ConfigError);
  EXPECT_THROW((void)read("distortion_p1 = 1e4\n"), ConfigError);
}

TEST(ReadCameraGeometry, WhatADistortionFoldsIntoTheFrameIsNotSeen) {
  // At 4.3 mrad from the axis the terms have the sign of the image turned: 1 - 1e5 r^2 = -.85.
  const CameraGeometry camera = read("distortion_k1 = -1e5\n");
  const Eigen::Vector3d far(3.2e-3, 0.0, 1.0);
  EXPECT_NEAR(camera.distortion.apply(far.head<2>()).x(), 0.0, 1e-4);
  EXPECT_FALSE(camera.project(far).has_value());
  EXPECT_FALSE(camera.map_near(far, {}, 1.0).has_value());
  EXPECT_TRUE(camera.project(camera.direction_at({-64.0, 700.0})).has_value());
}

}  // namespace
}  // namespace engine
