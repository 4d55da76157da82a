#include "engine/optics/lens.h"

#include <cmath>
#include <limits>
#include <string>

#include <gtest/gtest.h>

#include "engine/core/constants.h"
#include "engine/optics/mtf.h"

namespace engine {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

LensSpec read(const std::string& lines) {
  const ConfigReader config =
      ConfigReader::from_text("[optics]\naperture_m = 0.36\n" + lines, "x.toml");
  const LensSpec lens = read_lens(config.table("optics"), CameraGeometry{});
  config.reject_unknown_keys();
  return lens;
}

std::string complaint(const std::string& lines) {
  try {
    read(lines);
  } catch (const ConfigError& e) {
    return e.what();
  }
  return "";
}

TEST(ReadLens, IsClearUnlessTold) {
  const LensSpec lens = read("");
  EXPECT_EQ(lens.aperture_m, 0.36);
  EXPECT_EQ(lens.focal_length_m, 4.5);
  EXPECT_EQ(lens.spider_vanes, 0);
  EXPECT_EQ(lens.open_share(), 1.0);
  EXPECT_EQ(lens.wavefront_rms_m, 0.0);
  for (const double term_m : lens.zernike_m) EXPECT_EQ(term_m, 0.0);
}

TEST(ReadLens, ReadsEveryKeyInItsUnit) {
  const LensSpec lens = read(
      "obscuration = 0.3\nspider_vanes = 3\nspider_width_mm = 8\nspider_angle_deg = 30\n"
      "wavefront_rms_nm = 20\n[optics.zernike_nm]\nz4 = 10\nz37 = -3.5\n");
  EXPECT_EQ(lens.obscuration, 0.3);
  EXPECT_EQ(lens.spider_vanes, 3);
  EXPECT_DOUBLE_EQ(lens.spider_width_m, 0.008);
  EXPECT_DOUBLE_EQ(lens.spider_angle_rad, kPi / 6.0);
  EXPECT_DOUBLE_EQ(lens.wavefront_rms_m, 20e-9);
  EXPECT_DOUBLE_EQ(lens.zernike_m[4], 10e-9);
  EXPECT_DOUBLE_EQ(lens.zernike_m[37], -3.5e-9);
}

TEST(ReadLens, ComplaintsNameFileLineAndKey) {
  EXPECT_EQ(complaint("obscuration = 1.0"),
            "x.toml:3: optics.obscuration must be >= 0 and < 1, got 1");
  EXPECT_EQ(complaint("spider_vanes = 13"),
            "x.toml:3: optics.spider_vanes must be >= 0 and <= 12, got 13");
  EXPECT_EQ(complaint("spider_vanes = 4"),
            "x.toml: optics.spider_width_mm must be > 0 where there are spider_vanes");
  EXPECT_EQ(complaint("spider_vanes = 4\nspider_width_mm = -1"),
            "x.toml:4: optics.spider_width_mm must be >= 0, got -1");
  EXPECT_NE(complaint("spider_vanes = 12\nspider_width_mm = 90").find("of the aperture open"),
            std::string::npos);
  EXPECT_EQ(complaint("[optics.zernike_nm]\nz1 = 1"),
            "x.toml:4: optics.zernike_nm.z1 is piston, which no image shows");
  for (const char* key : {"z2", "z3"}) {
    EXPECT_EQ(complaint("[optics.zernike_nm]\nz5 = 1\n" + std::string(key) + " = 1"),
              "x.toml:5: optics.zernike_nm." + std::string(key) +
                  " is tilt, which moves the image: point the camera instead");
  }
  for (const char* key : {"z38", "z0", "coma"}) {
    EXPECT_EQ(complaint("[optics.zernike_nm]\n" + std::string(key) + " = 1"),
              "x.toml:4: optics.zernike_nm." + std::string(key) + " is not a key of a scenario");
  }
  EXPECT_EQ(complaint("[optics.zernike_nm]\nz7 = \"much\""),
            "x.toml:4: optics.zernike_nm.z7 must be a number, got \"much\"");
  EXPECT_NE(complaint("zernike_nm = 3").find("x.toml:3: optics.zernike_nm"), std::string::npos);
}

TEST(ReadLens, RefusesWavefrontsBeyondItsModels) {
  // .18 waves of 450 nm.
  EXPECT_EQ(complaint("wavefront_rms_nm = 80.9"), "");
  EXPECT_NE(complaint("wavefront_rms_nm = 81.1").find("x.toml:3: optics.wavefront_rms_nm must be"),
            std::string::npos);
  // z22 is sqrt(7) (20 r^6 - 30 r^4 + 12 r^2 - 1), whose slope at the rim is 24 sqrt(7) = 63.5:
  // 6 waves of 450 nm are reached at 42.5 nm.
  EXPECT_EQ(complaint("[optics.zernike_nm]\nz22 = 42.4"), "");
  EXPECT_NE(complaint("[optics.zernike_nm]\nz22 = 42.7").find("x.toml:3: optics.zernike_nm makes"),
            std::string::npos);
}

TEST(Lens, SpiderTakesItsShadow) {
  LensSpec lens;
  for (const int vanes : {0, 1, 2, 3, 4, 7}) {
    for (const double obscuration : {0.0, 0.02, 0.3}) {
      for (const double width_m : {0.002, 0.02, 0.1}) {
        lens.spider_vanes = vanes;
        lens.obscuration = obscuration;
        lens.spider_width_m = width_m;
        lens.spider_angle_rad = 0.3;
        constexpr int kSide = 1000;
        int open = 0;
        for (int i = 0; i < kSide; ++i) {
          for (int k = 0; k < kSide; ++k) {
            const double x = -1.0 + 2.0 * (i + 0.5) / kSide;
            const double y = -1.0 + 2.0 * (k + 0.5) / kSide;
            const double r = std::hypot(x, y);
            bool hidden = r > 1.0 || r < obscuration;
            for (int v = 0; v < vanes; ++v) {
              const double angle = 0.3 + 2.0 * kPi * v / vanes;
              const double along = x * std::cos(angle) + y * std::sin(angle);
              const double beside = -x * std::sin(angle) + y * std::cos(angle);
              hidden = hidden || (along >= 0.0 && std::abs(beside) <= width_m / 0.36);
            }
            open += hidden ? 0 : 1;
          }
        }
        // Points are miscounted at random along edges of up to 2 pi + 14 radii, 500 cells a radius:
        // 5 sigma of sqrt(10000)/2, of 785000.
        EXPECT_NEAR(lens.open_share(), open / (kPi / 4.0 * kSide * kSide), 4e-4)
            << vanes << " " << obscuration << " " << width_m;
      }
    }
  }
}

TEST(Lens, DefocusIsPositiveForWhatIsNear) {
  const LensSpec lens;
  // f^2 / (8 N^2 Z) with f 4.5 m, N 12.5.
  EXPECT_DOUBLE_EQ(defocus_m(lens, 100e3, kInfinity), 4.5 * 4.5 / (8.0 * 12.5 * 12.5 * 100e3));
  EXPECT_DOUBLE_EQ(defocus_m(lens, kInfinity, 100e3), -defocus_m(lens, 100e3, kInfinity));
  EXPECT_EQ(defocus_m(lens, kInfinity, kInfinity), 0.0);
  EXPECT_EQ(defocus_m(lens, 5e3, 5e3), 0.0);
}

TEST(Lens, BandIsFlatInPhotons) {
  double sum = 0;
  double mean_m = 0;
  double square = 0;
  for (const BandLine& line : band_lines(LensSpec{})) {
    sum += line.share;
    mean_m += line.share * line.wavelength_m;
    square += line.share * std::pow((line.wavelength_m - 650e-9) / 200e-9, 2);
  }
  EXPECT_NEAR(sum, 1.0, 1e-15);
  EXPECT_NEAR(mean_m, 650e-9, 1e-21);
  EXPECT_NEAR(square, 1.0 / 3.0, 1e-14);
}

TEST(Lens, ShannonsFactorIsWorstAtHalfTheCutoff) {
  EXPECT_EQ(shannon_factor(0.0, 0.3), 1.0);
  EXPECT_NEAR(shannon_factor(0.09, 0.0), 1.0, 1e-15);
  EXPECT_NEAR(shannon_factor(0.09, 1.0), 1.0, 1e-15);
  EXPECT_NEAR(shannon_factor(0.09, 0.5), 0.75, 1e-15);
  EXPECT_NEAR(shannon_factor(0.18, 0.5), 0.0, 1e-15);
}

}  // namespace
}  // namespace engine
