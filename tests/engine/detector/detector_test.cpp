#include "engine/detector/detector.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "engine/core/random.h"
#include "engine/detector/noise_lanes.h"
#include "engine/optics/optics.h"
#include "engine/orbit/sun.h"
#include "tests/support/csv.h"
#include "tests/support/scenes.h"
#include "tests/support/statistics.h"

namespace engine {
namespace {

using test_support::Csv;
using test_support::Moments;

constexpr Duration kMillisecond = std::chrono::milliseconds(1);
constexpr int kSide_px = 1024;

/// The reference figures have no dark current.
DetectorSpec dark_free() {
  DetectorSpec spec;
  spec.dark_e_s = 0;
  return spec;
}

/// An even image of so many electrons in the mean.
IrradianceImage even_light(const DetectorSpec& spec, double mean_e, int side_px = kSide_px) {
  IrradianceImage image(side_px, side_px);
  const auto light = static_cast<float>(mean_e / spec.electrons_per_irradiance(kMillisecond));
  std::fill(image.pixels().begin(), image.pixels().end(), light);
  return image;
}

ElectronImage exposed(const DetectorSpec& spec, const IrradianceImage& light,
                      std::uint64_t frame = 0, int threads = 1, std::uint64_t seed = 1) {
  WorkerPool pool(threads);
  ElectronImage out;
  Detector(spec, pool).expose(light, kMillisecond, seed, frame, out);
  return out;
}

DnImage digitized(const DetectorSpec& spec, const ElectronImage& electrons, std::uint64_t frame = 0,
                  int threads = 1, std::uint64_t seed = 1) {
  WorkerPool pool(threads);
  DnImage out;
  Detector(spec, pool).digitize(electrons, seed, frame, out);
  return out;
}

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

TEST(Detector, HasTheReferencesMeanAndVariance) {
  const Csv reference("detector_moments.csv");
  const DetectorSpec spec = dark_free();
  for (const Csv::Row& row : reference.rows()) {
    const double mean_e = row.number("mean_electrons_mu");
    const DnImage dn = digitized(spec, exposed(spec, even_light(spec, mean_e)));
    Moments moments;
    Moments squares;
    const double want = row.number("mean_DN");
    for (const std::uint16_t x : dn.pixels()) {
      moments.add(x);
      squares.add((x - want) * (x - want));
    }
    const double want_variance = row.number("var_DN2");
    const double sigma = std::sqrt(want_variance / static_cast<double>(moments.count()));
    // 4.5 sigma of 2^20 pixels, for the mean by the exact variance, for the variance by its own.
    EXPECT_NEAR(moments.mean(), want, 4.5 * sigma + 1e-9) << mean_e;
    EXPECT_NEAR(squares.mean(), want_variance, 4.5 * squares.sigma_of_mean() + 1e-9) << mean_e;
  }
}

TEST(Detector, HasTheReferencesHistogram) {
  const Csv reference("detector_histograms.csv");
  const DetectorSpec spec = dark_free();
  std::map<double, std::map<int, double>> by_mean;
  for (const Csv::Row& row : reference.rows())
    by_mean[row.number("mean_electrons_mu")][static_cast<int>(row.number("DN"))] =
        row.number("probability");
  ASSERT_EQ(by_mean.size(), 4U);
  for (const auto& [mean_e, probability] : by_mean) {
    std::vector<double> expected(2048, 0.0);
    std::vector<double> observed(2048, 0.0);
    constexpr int kFrames = 3;
    for (std::uint64_t frame = 0; frame < kFrames; ++frame) {
      const DnImage dn = digitized(spec, exposed(spec, even_light(spec, mean_e), frame), frame);
      for (const std::uint16_t x : dn.pixels()) observed[x] += 1.0;
    }
    for (const auto& [dn, p] : probability)
      expected[static_cast<std::size_t>(dn)] = p * kFrames * kSide_px * kSide_px;
    // What the table leaves out is rarer than its last lines.
    for (std::size_t dn = 0; dn < expected.size(); ++dn)
      if (expected[dn] == 0.0 && observed[dn] < 3.0) observed[dn] = 0.0;
    EXPECT_GT(test_support::histogram_p(observed, expected), 1e-4) << mean_e;
  }
}

TEST(Detector, ShotNoiseIsPoissonAtEveryLightLevel) {
  // Means on both sides of each change of method; the read-out left aside.
  DetectorSpec spec = dark_free();
  for (const double mean_e : {1e-3, 0.1, 0.5, 1.0, 7.999, 8.001, 100.0, 1e4}) {
    const ElectronImage electrons = exposed(spec, even_light(spec, mean_e));
    Moments moments;
    const auto largest = static_cast<std::size_t>(mean_e + 12.0 * std::sqrt(mean_e) + 20.0);
    std::vector<double> observed(largest + 1, 0.0);
    for (const float e : electrons.pixels()) {
      ASSERT_EQ(e, std::floor(e));
      moments.add(static_cast<double>(e));
      observed[std::min(static_cast<std::size_t>(e), largest)] += 1.0;
    }
    const auto n = static_cast<double>(moments.count());
    // Five sigma: the mean's variance is m/n, the variance's (m + 2 m^2)/n. The light is a float.
    EXPECT_NEAR(moments.mean(), mean_e, 5.0 * std::sqrt(mean_e / n) + 6e-8 * mean_e) << mean_e;
    EXPECT_NEAR(moments.variance(), mean_e,
                5.0 * std::sqrt((mean_e + 2.0 * mean_e * mean_e) / n) + 6e-8 * mean_e)
        << mean_e;
    std::vector<double> expected(largest + 1, 0.0);
    for (std::size_t k = 0; k <= largest; ++k) {
      int sign = 1;
      const auto x = static_cast<double>(k);
      expected[k] = n * std::exp(x * std::log(mean_e) - mean_e - ::lgamma_r(x + 1.0, &sign));
    }
    EXPECT_GT(test_support::histogram_p(observed, expected), 1e-4) << mean_e;
  }
}

TEST(Detector, DarkCurrentAddsToTheLight) {
  DetectorSpec spec;
  spec.dark_e_s = 2000.0;  // 2 e- in 1 ms
  const ElectronImage electrons = exposed(spec, even_light(spec, 3.0));
  Moments moments;
  for (const float e : electrons.pixels()) moments.add(static_cast<double>(e));
  EXPECT_NEAR(moments.mean(), 5.0, 5.0 * std::sqrt(5.0 / static_cast<double>(moments.count())));
}

TEST(Detector, CountsWhatIsNoLightAsDarkness) {
  const DetectorSpec spec = dark_free();
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  IrradianceImage light(64, 4);
  const float bad[] = {kNan, -1.0F, -0.0F, -std::numeric_limits<float>::infinity()};
  for (int v = 0; v < 4; ++v) std::fill(light.row(v).begin(), light.row(v).end(), bad[v]);
  WorkerPool pool(2);
  ElectronImage electrons;
  const DetectorReport report = Detector(spec, pool).expose(light, kMillisecond, 1, 0, electrons);
  for (const float e : electrons.pixels()) ASSERT_EQ(e, 0.0F);
  EXPECT_EQ(report.no_light_px, 3 * 64);  // -0 is darkness
  EXPECT_EQ(report.full_well_px, 0);
  // Between good pixels, too.
  IrradianceImage mixed = even_light(spec, 1e4, 64);
  const ElectronImage good = exposed(spec, mixed);
  for (int u = 0; u < 64; u += 2) mixed.at(u, 5) = kNan;
  const ElectronImage with_bad = exposed(spec, mixed);
  for (int u = 0; u < 64; ++u) EXPECT_EQ(with_bad.at(u, 5), u % 2 == 0 ? 0.0F : good.at(u, 5));
}

TEST(Detector, InfiniteLightFillsTheWell) {
  const DetectorSpec spec;
  IrradianceImage light(64, 64);
  for (const float bright :
       {std::numeric_limits<float>::infinity(), std::numeric_limits<float>::max(), 1e20F, 1e9F}) {
    std::fill(light.pixels().begin(), light.pixels().end(), bright);
    WorkerPool pool(1);
    ElectronImage electrons;
    const DetectorReport report = Detector(spec, pool).expose(light, kMillisecond, 1, 0, electrons);
    for (const float e : electrons.pixels()) ASSERT_EQ(e, 30000.0F) << bright;
    EXPECT_EQ(report.full_well_px, 64 * 64);
    EXPECT_EQ(report.no_light_px, 0);
  }
}

TEST(Detector, ClipsAtTheFullWellAndClampsAt2047) {
  const DetectorSpec spec = dark_free();
  Moments full;
  const DnImage dn = digitized(spec, exposed(spec, even_light(spec, 40000.0, 256)));
  for (const std::uint16_t x : dn.pixels()) full.add(x);
  EXPECT_EQ(full.mean(), 2047.0);
  EXPECT_EQ(full.variance(), 0.0);  // noise is gone where the well is full
  const ElectronImage electrons = exposed(spec, even_light(spec, 30000.0, 256));
  for (const float e : electrons.pixels()) ASSERT_LE(e, 30000.0F);
}

TEST(Detector, DigitalNumberRisesWithTheElectronsAndEndsAt2047) {
  DetectorSpec spec;
  spec.read_noise_e = 0;
  ElectronImage ramp(40001, 1);
  for (int e = 0; e <= 40000; ++e) ramp.at(e, 0) = static_cast<float>(e);
  const DnImage dn = digitized(spec, ramp);
  EXPECT_EQ(dn.at(0, 0), 0);
  for (int e = 1; e <= 40000; ++e) {
    ASSERT_GE(dn.at(e, 0), dn.at(e - 1, 0)) << e;
    // Gain 30000/2^11; single precision moves an edge by less than 1 e-.
    ASSERT_NEAR(dn.at(e, 0), std::min(2047.0, std::floor(e / spec.gain_e_dn())), 1.0) << e;
    if (e > 29986) {
      ASSERT_EQ(dn.at(e, 0), 2047);
    }
  }
  EXPECT_EQ(dn.at(1000, 0), 68);
}

TEST(Detector, RoundsAndLiftsByThePedestalWhenAsked) {
  DetectorSpec spec;
  spec.read_noise_e = 0;
  spec.pedestal_dn = 20;
  spec.quantiser = Quantiser::kRound;
  ElectronImage electrons(3, 1);
  electrons.at(0, 0) = 0.0F;
  electrons.at(1, 0) = 7.0F;  // .48 DN
  electrons.at(2, 0) = 7.5F;  // .51 DN
  const DnImage dn = digitized(spec, electrons);
  EXPECT_EQ(dn.at(0, 0), 20);
  EXPECT_EQ(dn.at(1, 0), 20);
  EXPECT_EQ(dn.at(2, 0), 21);
}

TEST(Detector, RoundingHasNoBiasAboveThePedestal) {
  DetectorSpec spec = dark_free();
  spec.read_noise_e = 8;  // .55 DN: enough to smooth the steps
  spec.pedestal_dn = 20;
  spec.quantiser = Quantiser::kRound;
  for (const double dn : {0.0, 0.25, 0.5, 3.75}) {
    ElectronImage electrons(kSide_px, kSide_px);
    std::fill(electrons.pixels().begin(), electrons.pixels().end(),
              static_cast<float>(dn * spec.gain_e_dn()));
    Moments moments;
    const DnImage image = digitized(spec, electrons);
    for (const std::uint16_t x : image.pixels()) moments.add(x);
    // The ripple of a rounded Gaussian, exp(-2 pi^2 s^2)/pi, and 4.5 sigma.
    const double ripple = std::exp(-2.0 * kPi * kPi * 0.546 * 0.546) / kPi;
    EXPECT_NEAR(moments.mean(), 20.0 + dn, ripple + 4.5 * moments.sigma_of_mean()) << dn;
  }
}

TEST(Detector, SkippingADrawThatCannotMatterKeepsTheBits) {
  // Draw for every pixel, and quantise as the model says.
  for (const Quantiser quantiser : {Quantiser::kFloor, Quantiser::kRound}) {
    DetectorSpec spec;
    spec.quantiser = quantiser;
    spec.pedestal_dn = quantiser == Quantiser::kRound ? 20 : 0;
    ElectronImage electrons(512, 512);
    for (std::size_t i = 0; i < electrons.pixels().size(); ++i)
      electrons.pixels()[i] = static_cast<float>(i % 60 == 59 ? 30000 - i % 90 : i % 60);
    constexpr std::uint64_t kSeed = 0x123456789ABCDEFULL;
    constexpr std::uint64_t kFrame = 77;
    const DnImage dn = digitized(spec, electrons, kFrame, 2, kSeed);
    const auto dn_per_e = static_cast<float>(1.0 / spec.gain_e_dn());
    const auto offset =
        static_cast<float>(spec.pedestal_dn + (quantiser == Quantiser::kRound ? 0.5 : 0.0));
    std::vector<float> noise(electrons.pixels().size());
    noise_lanes::normals({kSeed, kFrame, 0}, Stream::kRead, noise);
    for (std::size_t i = 0; i < electrons.pixels().size(); ++i) {
      const float e = electrons.pixels()[i] + 2.0F * noise[i];
      const float want = std::clamp(std::floor(e * dn_per_e + offset), 0.0F, 2047.0F);
      ASSERT_EQ(dn.pixels()[i], static_cast<std::uint16_t>(want)) << i;
    }
  }
}

TEST(Detector, NeighboursAndFramesAreIndependent) {
  const DetectorSpec spec = dark_free();
  for (const double mean_e : {0.1, 0.7, 8.0, 300.0}) {
    const ElectronImage a = exposed(spec, even_light(spec, mean_e, 512), 0);
    const ElectronImage b = exposed(spec, even_light(spec, mean_e, 512), 1);
    const ElectronImage c = exposed(spec, even_light(spec, mean_e, 512), 0, 1, 2);
    const std::vector<double> x(a.pixels().begin(), a.pixels().end());
    const std::vector<double> y(b.pixels().begin(), b.pixels().end());
    const std::vector<double> z(c.pixels().begin(), c.pixels().end());
    const auto n = x.size();
    const double limit = 4.5 / std::sqrt(static_cast<double>(n));
    // A block of words serves pixels that lie 16, 32 and 48 apart.
    for (const std::size_t lag : {1U, 2U, 3U, 4U, 5U, 16U, 32U, 48U, 64U, 512U}) {
      EXPECT_LT(std::abs(test_support::correlation(std::span(x).first(n - lag),
                                                   std::span(x).subspan(lag))),
                limit)
          << mean_e << " lag " << lag;
    }
    EXPECT_LT(std::abs(test_support::correlation(x, y)), limit) << mean_e;
    EXPECT_LT(std::abs(test_support::correlation(x, z)), limit) << mean_e;
  }
}

TEST(Detector, ReadNoiseIsIndependentOfShotNoise) {
  DetectorSpec spec = dark_free();
  spec.bits = 16;  // fine enough to see 2 e-
  spec.pedestal_dn = 100;
  spec.quantiser = Quantiser::kRound;
  const ElectronImage electrons = exposed(spec, even_light(spec, 400.0, 512));
  const DnImage dn = digitized(spec, electrons);
  std::vector<double> shot;
  std::vector<double> read;
  Moments noise;
  for (std::size_t i = 0; i < dn.pixels().size(); ++i) {
    shot.push_back(static_cast<double>(electrons.pixels()[i]));
    read.push_back((dn.pixels()[i] - 100.0) * spec.gain_e_dn() - shot.back());
    noise.add(read.back());
  }
  const auto n = static_cast<double>(read.size());
  EXPECT_LT(std::abs(test_support::correlation(shot, read)), 4.5 / std::sqrt(n));
  EXPECT_NEAR(noise.mean(), 0.0, 4.5 * 2.0 / std::sqrt(n) + 1e-3);
  const double step = spec.gain_e_dn();
  EXPECT_NEAR(noise.variance(), 4.0 + step * step / 12.0, 4.5 * 4.1 * std::sqrt(2.0 / n));
}

TEST(Detector, GivesTheSameBitsOnAnyNumberOfThreads) {
  const DetectorSpec spec;
  IrradianceImage light(333, 77);
  const double to_e = spec.electrons_per_irradiance(kMillisecond);
  for (std::size_t i = 0; i < light.pixels().size(); ++i)
    light.pixels()[i] = static_cast<float>(static_cast<double>(i % 400) / to_e);
  const ElectronImage electrons = exposed(spec, light, 5);
  const DnImage dn = digitized(spec, electrons, 5);
  for (const int threads : {1, 2, 3}) {
    const ElectronImage again = exposed(spec, light, 5, threads);
    EXPECT_TRUE(std::ranges::equal(electrons.pixels(), again.pixels())) << threads;
    EXPECT_TRUE(std::ranges::equal(dn.pixels(), digitized(spec, again, 5, threads).pixels()));
  }
}

TEST(Detector, APixelsNoiseDoesNotDependOnItsNeighboursLight) {
  const DetectorSpec spec = dark_free();
  IrradianceImage light = even_light(spec, 5.0, 64);
  const ElectronImage before = exposed(spec, light);
  for (int u = 0; u < 64; u += 3) light.at(u, 10) *= 1000.0F;
  const ElectronImage after = exposed(spec, light);
  for (int u = 1; u < 64; u += 3) {
    EXPECT_EQ(after.at(u, 10), before.at(u, 10)) << u;
    EXPECT_EQ(after.at(u - 1, 11), before.at(u - 1, 11)) << u;
  }
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
  for (const char* wrong : {"detector.full_well_e=-30000", "detector.bits=17", "detector.bits=10.5",
                            "detector.quantum_efficiency=1.1", "detector.read_noise_e=-1",
                            "detector.quantiser=ceil", "detector.dark_e_s=nan"})
    EXPECT_THROW(read(wrong), ConfigError) << wrong;
}

}  // namespace
}  // namespace engine
