#include "engine/detector/pixel_budget.h"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "engine/detector/detector.h"
#include "tests/support/statistics.h"

namespace engine {
namespace {

using test_support::Moments;

constexpr Duration kExposure = std::chrono::milliseconds(20);
constexpr double kThroughput_sr = 0.0035;

TEST(PixelBudget, CountsPhotonsByHand) {
  DetectorSpec spec;
  spec.background_e_s = 15;
  const PixelBudget b = pixel_budget(1e-4, kExposure, kThroughput_sr, spec);
  // 1e-4 W/m^2 on (6.5 um)^2 for 20 ms is 8.45e-17 J; a photon of 626.78 nm has 3.16929e-19 J.
  EXPECT_NEAR(b.photons, 8.45e-17 / 3.16929e-19, 0.01);
  EXPECT_NEAR(b.light_e, 0.55 * b.photons, 1e-9);
  EXPECT_NEAR(b.radiance_w_m2_sr, 1e-4 / 0.0035, 1e-12);
  EXPECT_NEAR(b.dark_e, 50.0 * 0.02, 1e-12);
  EXPECT_NEAR(b.mean_dn, (b.light_e + 1.0) / (30000.0 / 2048.0), 1e-9);
  EXPECT_FALSE(b.clipped);
  EXPECT_NEAR(b.noise.quantiser_e, 30000.0 / 2048.0 / std::sqrt(12.0), 1e-12);
}

TEST(PixelBudget, SaysWhereAPixelEnds) {
  DetectorSpec spec;
  const double full = 30000.0 / spec.electrons_per_irradiance(kExposure);
  EXPECT_TRUE(pixel_budget(1.01 * full, kExposure, kThroughput_sr, spec).clipped);
  EXPECT_FALSE(pixel_budget(0.99 * full, kExposure, kThroughput_sr, spec).clipped);
  EXPECT_EQ(pixel_budget(9.0 * full, kExposure, kThroughput_sr, spec).mean_dn, 2047.0);
  spec.pedestal_dn = 100;  // the ADC ends before the well
  EXPECT_TRUE(pixel_budget(0.99 * full, kExposure, kThroughput_sr, spec).clipped);
}

TEST(PixelBudget, SumsItsNoiseToWhatADetectorHas) {
  // Independent of the budget: the spread of the detector's own numbers, in frames and in space.
  DetectorSpec spec;
  spec.bits = 14;
  spec.pedestal_dn = 50;
  spec.read_noise_e = 6;
  spec.dark_e_s = 400;
  spec.prnu_rms = 0.02;
  spec.dsnu_rms = 0.5;
  constexpr int kSide_px = 256;
  WorkerPool pool(1);
  const Detector detector(spec, pool, SensorMaps(spec, kSide_px, kSide_px));
  for (const double light_e : {0.0, 200.0, 12000.0}) {
    const double irradiance = light_e / spec.electrons_per_irradiance(kExposure);
    const PixelBudget b = pixel_budget(irradiance, kExposure, kThroughput_sr, spec);
    IrradianceImage light(kSide_px, kSide_px);
    std::ranges::fill(light.pixels(), static_cast<float>(irradiance));
    ElectronImage electrons;
    DnImage first;
    DnImage second;
    (void)detector.expose(light, kExposure, 3, 1, electrons);
    detector.digitize(electrons, 3, 1, first);
    (void)detector.expose(light, kExposure, 3, 2, electrons);
    detector.digitize(electrons, 3, 2, second);
    Moments level;
    Moments difference;
    for (std::size_t i = 0; i < first.pixels().size(); ++i) {
      level.add(first.pixels()[i]);
      difference.add(1.0 * first.pixels()[i] - second.pixels()[i]);
    }
    const double gain = spec.gain_e_dn();
    // 65536 pixels: their spread is known to 1 / sqrt(2 n), .28 %.
    EXPECT_NEAR(gain * std::sqrt(0.5 * difference.variance()) / b.noise.temporal_e, 1.0, 0.01)
        << light_e;
    EXPECT_NEAR(gain * std::sqrt(level.variance()) / b.noise.total_e, 1.0, 0.015) << light_e;
    EXPECT_NEAR(level.mean(), b.mean_dn - 0.5, 0.02 * b.noise.total_e / gain) << light_e;
  }
}

}  // namespace
}  // namespace engine
