#include "engine/detector/detector_spec.h"

#include <algorithm>
#include <cmath>
#include <string>

#include <gtest/gtest.h>

#include "engine/optics/optics.h"
#include "engine/orbit/sun.h"
#include "tests/support/csv.h"
#include "tests/support/scenes.h"

namespace engine {
namespace {

using test_support::Csv;

constexpr Duration kMillisecond = std::chrono::milliseconds(1);

TEST(DetectorSpec, TurnsALambertPlateIntoTheModelsElectrons) {
  const Csv reference("electrons_lambert30.csv");
  WorkerPool pool(1);
  OpticsSpec optics_spec;
  optics_spec.camera = test_support::small_camera(32);
  const Optics optics(optics_spec, 1.0, pool);
  int golden = 0;
  for (const Csv::Row& row : reference.rows()) {
    DetectorSpec spec;
    const bool mono = row.text("photon_energy_model") == "650nm";
    spec.mean_wavelength_m = mono ? 650e-9 : black_body_sun(kAstronomicalUnit_m).mean_wavelength_m;
    const Duration exposure = from_seconds(1e-3 * row.number("exposure_ms"));
    const double electrons =
        row.number("L_W_m2_sr") * optics.throughput_sr() * spec.electrons_per_irradiance(exposure);
    // Ten digits are printed; the constants of nature are exact.
    EXPECT_NEAR(electrons / row.number("electrons"), 1.0, 1e-8);
    golden += std::abs(electrons - 16214.10) < 0.01 ? 1 : 0;
    golden += std::abs(electrons - 15708.00) < 0.01 ? 1 : 0;
    const double dn = std::floor(std::min(electrons, spec.full_well_e) / spec.gain_e_dn());
    EXPECT_EQ(std::min(dn, static_cast<double>(spec.largest_dn())), row.number("DN_floor"));
  }
  EXPECT_GE(golden, 2);
}

TEST(DetectorSpec, NoiseIsTheModelsSigma) {
  const DetectorSpec spec;
  EXPECT_NEAR(spec.noise_e(0.35), 4.72, 0.005);
  EXPECT_NEAR(spec.noise_e(1000.0), 32.0, 0.5);
  EXPECT_NEAR(spec.noise_e(10000.0), 100.0, 0.5);
  EXPECT_NEAR(spec.noise_e(30000.0), 173.0, 0.5);
}

TEST(DetectorSpec, DarkCurrentDoublesWithTheTemperature) {
  DetectorSpec spec;
  EXPECT_EQ(spec.dark_mean_e(kMillisecond), 0.035);  // without a temperature it is what it is
  spec.dark_reference_c = 20;
  spec.dark_doubling_c = 8;
  spec.temperature_c = 20;
  EXPECT_EQ(spec.dark_mean_e(kMillisecond), 0.035);
  spec.temperature_c = 28;
  EXPECT_NEAR(spec.dark_mean_e(kMillisecond), 0.07, 1e-15);
  spec.temperature_c = -20;
  EXPECT_NEAR(spec.dark_mean_e(kMillisecond), 0.035 / 32.0, 1e-15);
  spec.background_e_s = 100;  // glow has no temperature
  EXPECT_NEAR(spec.dark_mean_e(kMillisecond), 0.035 / 32.0 + 0.1, 1e-15);
}

TEST(ReadDetector, RefusesWhatIsNoDetector) {
  const auto read = [](const std::string& changed) {
    ConfigReader config = ConfigReader::from_text(
        "[detector]\nquantum_efficiency = 0.55\nfull_well_e = 30000.0\nread_noise_e = 2.0\n"
        "dark_e_s = 35.0\nbits = 11\n",
        "x.toml");
    if (!changed.empty()) config.set(changed);
    return read_detector(config.table("detector"), 6.5e-6, 650e-9);
  };
  EXPECT_EQ(read("").largest_dn(), 2047);
  EXPECT_EQ(read("detector.quantiser=round").quantiser, Quantiser::kRound);
  for (const char* wrong :
       {"detector.full_well_e=-30000", "detector.bits=17", "detector.bits=10.5",
        "detector.quantum_efficiency=1.1", "detector.read_noise_e=-1", "detector.quantiser=ceil",
        "detector.dark_e_s=nan", "detector.prnu_rms=1.1", "detector.dsnu_rms=-0.1",
        "detector.hot_pixels=0.2", "detector.dead_pixels=-1", "detector.hot_columns=1.5",
        "detector.blooming=row", "detector.cosmic_rays_cm2_s=-1", "detector.epitaxial_um=0",
        "detector.sensor=-1", "detector.prnu_map=3", "detector.prnu_map=\"\"",
        "detector.background_e_s=-1"})
    EXPECT_THROW(read(wrong), ConfigError) << wrong;
}

TEST(ReadDetector, WantsAllOfATemperatureOrNothing) {
  const std::string base =
      "[detector]\nquantum_efficiency = 0.55\nfull_well_e = 30000.0\nread_noise_e = 2.0\n"
      "dark_e_s = 35.0\nbits = 11\n";
  const auto read = [&](const std::string& more) {
    const ConfigReader config = ConfigReader::from_text(base + more, "x.toml");
    return read_detector(config.table("detector"), 6.5e-6, 650e-9);
  };
  EXPECT_NEAR(
      read("temperature_c = 10\ndark_reference_c = 20\ndark_doubling_c = 10\n").dark_rate_e_s(),
      17.5, 1e-12);
  try {
    read("temperature_c = 10\ndark_reference_c = 20\n");
    FAIL();
  } catch (const ConfigError& e) {
    EXPECT_NE(std::string(e.what()).find("detector.dark_doubling_c is missing"), std::string::npos)
        << e.what();
  }
}

TEST(ReadDetector, SaysWhichMapStandsBesideWhat) {
  const ConfigReader config = ConfigReader::from_text(
      "[detector]\nquantum_efficiency = 0.55\nfull_well_e = 30000.0\nread_noise_e = 2.0\n"
      "dark_e_s = 35.0\nbits = 11\nprnu_rms = 0.01\nprnu_map = \"a.fits\"\n",
      "x.toml");
  try {
    FAIL() << read_detector(config.table("detector"), 6.5e-6, 650e-9).prnu_map.path;
  } catch (const ConfigError& e) {
    EXPECT_STREQ(e.what(), "x.toml:8: detector.prnu_map cannot stand beside prnu_rms");
  }
}

}  // namespace
}  // namespace engine
