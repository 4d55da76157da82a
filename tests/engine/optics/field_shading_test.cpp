#include "engine/optics/field_shading.h"

#include <algorithm>
#include <cmath>
#include <string>

#include <gtest/gtest.h>

#include "tests/support/scenes.h"

namespace engine {
namespace {

OpticsSpec spec_of(int side_px = 64) {
  OpticsSpec spec;
  spec.camera = test_support::small_camera(side_px);
  return spec;
}

IrradianceImage even_field(int side_px, float light = 2.0F) {
  IrradianceImage image(side_px, side_px);
  std::ranges::fill(image.pixels(), light);
  return image;
}

double sum_of(const IrradianceImage& image) {
  double sum = 0;
  for (const float x : image.pixels()) sum += static_cast<double>(x);
  return sum;
}

TEST(FieldShading, LeavesAnImageAloneUnlessAsked) {
  WorkerPool pool(1);
  FieldShading shading(spec_of());
  IrradianceImage image = even_field(64);
  shading.vignette(image, pool);
  shading.veil(image, pool);
  EXPECT_FALSE(shading.vignettes());
  for (const float x : image.pixels()) ASSERT_EQ(x, 2.0F);
  EXPECT_EQ(shading.at({-1e9, 1e9}), 1.0);
}

TEST(FieldShading, VignettesByDistanceFromThePrincipalPoint) {
  WorkerPool pool(2);
  OpticsSpec spec = spec_of();
  spec.vignetting = {-0.3, -0.1, 0.05, false};
  const FieldShading shading(spec);
  IrradianceImage image = even_field(64);
  shading.vignette(image, pool);
  EXPECT_FLOAT_EQ(image.at(32, 32), 2.0F);
  // The corner is half a diagonal away, the edge's middle 1 / sqrt(2) of it.
  EXPECT_NEAR(static_cast<double>(image.at(0, 0)), 2.0 * 0.65, 1e-6);
  EXPECT_NEAR(static_cast<double>(image.at(0, 32)), 2.0 * (1 - 0.15 - 0.025 + 0.00625), 1e-6);
  EXPECT_NEAR(shading.at({0.2, 31.8}), 1 - 0.15 - 0.025 + 0.00625, 1e-6);
  EXPECT_NEAR(shading.at({-50.0, -50.0}), 0.65, 1e-6);
}

TEST(FieldShading, OfAWindowIsTheSensors) {
  OpticsSpec spec = spec_of();
  spec.vignetting.r2 = -0.4;
  const FieldShading whole(spec);
  spec.camera.window = {40, 8, 64, 64, 1};
  spec.camera.width_px = 20;
  spec.camera.height_px = 30;
  const FieldShading window(spec);
  for (const PixelPoint p : {PixelPoint{0, 0}, PixelPoint{19, 29}, PixelPoint{7, 3}})
    EXPECT_DOUBLE_EQ(window.at(p), whole.at({p.u + 40, p.v + 8}));
}

TEST(FieldShading, CosineToTheFourthIsOfTheAngle) {
  OpticsSpec spec = spec_of();
  spec.camera.focal_length_m = 100.0 * spec.camera.pixel_pitch_m;
  spec.vignetting.cos4 = true;
  const FieldShading shading(spec);
  EXPECT_NEAR(shading.at({32, 2}), std::pow(std::cos(std::atan(0.3)), 4), 1e-6);
}

TEST(FieldShading, AVeilMovesLightAndLosesNone) {
  WorkerPool pool(2);
  OpticsSpec spec = spec_of();
  spec.veiling_glare = 0.05;
  FieldShading shading(spec);
  IrradianceImage image = even_field(64, 0.0F);
  image.at(10, 20) = 4096.0F;
  shading.veil(image, pool);
  EXPECT_NEAR(sum_of(image), 4096.0, 1e-2);
  EXPECT_NEAR(static_cast<double>(image.at(60, 60)), 0.05, 1e-7);
  EXPECT_NEAR(static_cast<double>(image.at(10, 20)), 0.95 * 4096.0 + 0.05, 1e-3);
  // An even field has its veil already.
  image = even_field(64);
  shading.veil(image, pool);
  for (const float x : image.pixels()) ASSERT_NEAR(static_cast<double>(x), 2.0, 1e-6);
}

TEST(ReadOptics, RefusesAVignettingThatLeavesNoLight) {
  const auto read = [](const std::string& lines) {
    const ConfigReader config = ConfigReader::from_text(
        "[optics]\ntransmission = 0.7\naperture_m = 0.36\n" + lines, "x.toml");
    return read_optics(config.table("optics"), CameraGeometry{});
  };
  EXPECT_EQ(read("vignetting_r2 = -0.3\n").vignetting.r2, -0.3);
  EXPECT_TRUE(read("vignetting = \"cos4\"\n").vignetting.cos4);
  EXPECT_THROW((void)read("vignetting = \"some\"\n"), ConfigError);
  EXPECT_THROW((void)read("vignetting_r2 = -1.0\n"), ConfigError);
  EXPECT_THROW((void)read("vignetting_r4 = 1.5\n"), ConfigError);
  // Nothing half-way, all of it at the ends.
  EXPECT_THROW((void)read("vignetting_r2 = -8\nvignetting_r4 = 8\n"), ConfigError);
  EXPECT_THROW((void)read("veiling_glare = 0.6\n"), ConfigError);
  EXPECT_EQ(read("grid = \"paper-grid\"\n").oversampling, 1);
  EXPECT_EQ(read("grid = \"6x6\"\n").oversampling, 6);
}

}  // namespace
}  // namespace engine
