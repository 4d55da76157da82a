#include "engine/detector/detector.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <vector>

#include <gtest/gtest.h>

#include "engine/core/constants.h"
#include "engine/core/random.h"
#include "engine/detector/noise_lanes.h"
#include "tests/support/csv.h"
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
    // Draws are left out where 64 pixels need none. One level lies 4.02 sigma of the read noise
    // below a step of the quantiser: of half a million pixels some 15 cross it.
    const float near = quantiser == Quantiser::kRound ? 13.92F : 6.61F;
    const std::array<float, 8> levels{0.0F, near, 1.0F, near, 3.0F, near, 29990.0F, near};
    ElectronImage electrons(kSide_px, kSide_px);
    for (std::size_t i = 0; i < electrons.pixels().size(); ++i)
      electrons.pixels()[i] = levels[i / 64 % levels.size()];
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

/// Everything that a sensor can have.
DetectorSpec spoiled() {
  DetectorSpec spec;
  spec.prnu_rms = 0.02;
  spec.dsnu_rms = 0.3;
  spec.hot_pixels = 0.01;
  spec.dead_pixels = 0.01;
  spec.hot_columns = 1;
  spec.dead_columns = 1;
  spec.blooming = Blooming::kColumn;
  spec.cosmic_rays_cm2_s = 1e6;
  return spec;
}

TEST(Detector, APlainSpecHasTheBitsOfADetectorWithoutMaps) {
  const DetectorSpec spec;
  WorkerPool pool(1);
  const IrradianceImage light = even_light(spec, 5.0, 64);
  ElectronImage out;
  Detector(spec, pool, SensorMaps(spec, 64, 64)).expose(light, kMillisecond, 1, 0, out);
  EXPECT_TRUE(std::ranges::equal(out.pixels(), exposed(spec, light).pixels()));
}

TEST(Detector, FixedPatternStaysWhereFramesAverageOut) {
  DetectorSpec spec;
  spec.prnu_rms = 0.02;
  spec.dsnu_rms = 0.5;
  spec.dark_e_s = 1e6;  // 1000 e- in 1 ms
  constexpr int kSide = 128;
  constexpr int kFrames = 50;
  const SensorMaps maps(spec, kSide, kSide);
  WorkerPool pool(1);
  const Detector detector(spec, pool, maps);
  const IrradianceImage light = even_light(spec, 5000.0, kSide);
  std::vector<double> sum(kSide * kSide, 0.0);
  ElectronImage out;
  for (std::uint64_t frame = 0; frame < kFrames; ++frame) {
    detector.expose(light, kMillisecond, 1, frame, out);
    for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += static_cast<double>(out.pixels()[i]);
  }
  // Each pixel's own mean, in sigmas of its own shot noise: a variance of one.
  double chi2 = 0;
  for (std::size_t i = 0; i < sum.size(); ++i) {
    const double mean = 5000.0 * static_cast<double>(maps.response()[i]) +
                        1e-3 * static_cast<double>(maps.dark_e_s()[i]);
    chi2 += std::pow(sum[i] - kFrames * mean, 2) / (kFrames * mean);
  }
  const auto n = static_cast<double>(sum.size());
  EXPECT_NEAR(chi2 / n, 1.0, 4.5 * std::sqrt(2.0 / n));
}

TEST(Detector, DeadPixelsStayEmptyWhateverFallsOnThem) {
  DetectorSpec spec = spoiled();
  const SensorMaps maps(spec, 64, 64);
  WorkerPool pool(2);
  IrradianceImage light(64, 64);
  std::fill(light.pixels().begin(), light.pixels().end(), std::numeric_limits<float>::infinity());
  ElectronImage out;
  const DetectorReport report =
      Detector(spec, pool, maps).expose(light, std::chrono::seconds(1), 1, 0, out);
  EXPECT_GT(report.cosmic_rays, 100);
  int dead = 0;
  for (std::size_t i = 0; i < out.pixels().size(); ++i) {
    const bool collects = maps.response()[i] > 0.0F;
    dead += collects ? 0 : 1;
    ASSERT_EQ(out.pixels()[i], collects ? 30000.0F : 0.0F) << i;
  }
  EXPECT_GE(dead, 64);
  EXPECT_EQ(report.full_well_px, 64 * 64 - dead);
}

TEST(Detector, BackgroundAddsToTheDarkCurrent) {
  DetectorSpec spec;
  spec.dark_e_s = 1000.0;
  spec.background_e_s = 2000.0;
  for (const double prnu : {0.0, 1e-9}) {  // without a map, and with one
    spec.prnu_rms = prnu;
    WorkerPool pool(1);
    ElectronImage out;
    Detector(spec, pool, SensorMaps(spec, kSide_px, kSide_px))
        .expose(even_light(spec, 2.0), kMillisecond, 1, 0, out);
    Moments moments;
    for (const float e : out.pixels()) moments.add(static_cast<double>(e));
    EXPECT_NEAR(moments.mean(), 5.0, 5.0 * std::sqrt(5.0) / kSide_px);
  }
}

TEST(Detector, CosmicRaysAreClippedAtTheFullWell) {
  DetectorSpec spec = dark_free();
  spec.cosmic_rays_cm2_s = 1e5;
  spec.full_well_e = 500;
  WorkerPool pool(1);
  ElectronImage out;
  const IrradianceImage dark(256, 256);
  const DetectorReport report =
      Detector(spec, pool).expose(dark, std::chrono::milliseconds(10), 1, 0, out);
  int full = 0;
  for (const float e : out.pixels()) {
    ASSERT_LE(e, 500.0F);
    full += e == 500.0F ? 1 : 0;
  }
  EXPECT_GT(report.cosmic_rays, 10);
  EXPECT_GT(report.full_well_px, 5);
  EXPECT_GE(full, report.full_well_px);
}

TEST(Detector, BloomedChargeIsInTheFrameOrInTheReport) {
  DetectorSpec spec = dark_free();
  IrradianceImage light = even_light(spec, 20000.0, 128);
  for (int v = 50; v < 55; ++v)
    for (int u = 40; u < 50; ++u) light.at(u, v) *= 4.0F;
  for (int v = 0; v < 128; ++v) light.at(90, v) *= 2.0F;
  const auto sum = [](const ElectronImage& image) {
    double all = 0;
    for (const float e : image.pixels()) all += static_cast<double>(e);
    return all;
  };
  DetectorSpec deep = spec;
  deep.full_well_e = 1e7;
  const double collected = sum(exposed(deep, light));
  spec.blooming = Blooming::kColumn;
  WorkerPool pool(2);
  ElectronImage out;
  const DetectorReport report = Detector(spec, pool).expose(light, kMillisecond, 1, 0, out);
  EXPECT_EQ(report.full_well_px, 50 + 128);
  EXPECT_GT(report.bloomed_away_e, 1e5);
  EXPECT_EQ(sum(out) + report.bloomed_away_e, collected);
  for (const float e : out.pixels()) ASSERT_LE(e, 30000.0F);
}

TEST(Detector, ASpoiledSensorGivesTheSameBitsOnAnyNumberOfThreads) {
  const DetectorSpec spec = spoiled();
  IrradianceImage light(333, 77);
  const double to_e = spec.electrons_per_irradiance(kMillisecond);
  for (std::size_t i = 0; i < light.pixels().size(); ++i)
    light.pixels()[i] = static_cast<float>(static_cast<double>(i % 400) * 100.0 / to_e);
  const SensorMaps maps(spec, 333, 77);
  ElectronImage want;
  DetectorReport first;
  for (const int threads : {1, 2, 3}) {
    WorkerPool pool(threads);
    ElectronImage out;
    const DetectorReport report = Detector(spec, pool, maps).expose(light, kMillisecond, 1, 0, out);
    if (threads == 1) {
      want = out;
      first = report;
      continue;
    }
    EXPECT_TRUE(std::ranges::equal(out.pixels(), want.pixels())) << threads;
    EXPECT_EQ(report.full_well_px, first.full_well_px);
    EXPECT_EQ(report.cosmic_rays, first.cosmic_rays);
    EXPECT_EQ(report.bloomed_away_e, first.bloomed_away_e);
  }
}

}  // namespace
}  // namespace engine
