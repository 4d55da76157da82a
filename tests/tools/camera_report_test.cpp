// A small camera on the bench, through the engine's own optics and detector.

#include "tools/characterize/camera_report.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <functional>
#include <stdexcept>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "engine/core/constants.h"
#include "tools/characterize/sensor_figures.h"

namespace {

using characterize::Bench;
using characterize::CameraReport;
using characterize::Figure;
using characterize::SensorReport;
using characterize::Standing;

constexpr int kSide_px = 128;
constexpr engine::Duration kExposure = std::chrono::milliseconds(20);
// 8 frames a level, 64 of a stack.
const characterize::RecordPlan kPlan{50, std::size_t{8} << 14, std::size_t{64} << 14};

struct SmallCamera {
  engine::OpticsSpec optics_spec;
  engine::DetectorSpec detector;
  engine::WorkerPool pool{1};

  explicit SmallCamera(int side_px = kSide_px) {
    optics_spec.camera.width_px = side_px;
    optics_spec.camera.height_px = side_px;
    detector.quantum_efficiency = 0.7;
    detector.full_well_e = 20000;
    detector.read_noise_e = 8;
    detector.dark_e_s = 500;
    detector.bits = 12;
    detector.pedestal_dn = 40;
    detector.quantiser = engine::Quantiser::kRound;
  }
  [[nodiscard]] engine::Optics optics() { return {optics_spec, 1e-6, pool}; }
  [[nodiscard]] engine::SensorMaps maps() const {
    return {detector, optics_spec.camera.width_px, optics_spec.camera.height_px};
  }
  SensorReport report() {
    engine::Optics lens = optics();
    return characterize::characterize_sensor(lens, detector, maps(), optics_spec.camera, pool, 1,
                                             kExposure, kPlan);
  }
};

const Figure& figure_of(const std::vector<Figure>& figures, const std::string& key) {
  const auto found = std::ranges::find(figures, key, &Figure::key);
  if (found == figures.end()) throw std::runtime_error("no figure " + key);
  return *found;
}

TEST(CameraReport, EveryFigureIsWithinFourErrorsOfTheTruth) {
  SmallCamera camera;
  camera.detector.prnu_rms = 0.01;
  camera.detector.dsnu_rms = 0.3;
  camera.detector.hot_pixels = 0.002;
  camera.detector.dead_pixels = 0.001;
  const SensorReport report = camera.report();
  EXPECT_EQ(report.figures.size(), 18U);
  for (const Figure& figure : report.figures) {
    EXPECT_EQ(figure.standing, Standing::kMeasured) << figure.key;
    if (figure.key == "linearity_error") continue;
    EXPECT_LT(std::abs(figure.sigmas()), 4.0)
        << figure.key << ": " << figure.measured.value << " +- " << figure.measured.error
        << ", true " << figure.truth;
  }
  EXPECT_LT(figure_of(report.figures, "linearity_error").measured.value, 0.05);
  EXPECT_NEAR(figure_of(report.figures, "prnu_1288").truth, 1.0, 0.03);
  EXPECT_NEAR(figure_of(report.figures, "dark_current_rms_e_s").truth, 150, 12);
  // 33 hot and 16 dead pixels, each with its chance; the faintest hot ones are not told.
  EXPECT_NEAR(static_cast<double>(report.record.defects.size()), 49, 4 * 7);
}

TEST(CameraReport, TheTruthOfABinnedPixelIsAllItsPhotosites) {
  engine::DetectorSpec spec;
  spec.dark_e_s = 30;
  spec.background_e_s = 12;
  spec.binning = 2;
  const characterize::PixelMask all(16, 1);
  EXPECT_DOUBLE_EQ(characterize::sensor_truth(spec, {}, all, 0.01).dark_rate_e_s, 4.0 * (30 + 12));
}

TEST(CameraReport, TellsWhenTheSensorIsNotWhatTheScenarioSays) {
  SmallCamera camera;
  const SensorReport report = camera.report();
  const auto sigmas_if = [&](const std::string& key,
                             const std::function<void(engine::DetectorSpec&)>& change) {
    engine::DetectorSpec wrong = camera.detector;
    change(wrong);
    const auto truth = characterize::sensor_truth(wrong, camera.maps(), report.record.used,
                                                  report.record.exposure_s);
    const auto figures = characterize::sensor_figures(report.record, report.transfer, truth);
    return std::abs(figure_of(figures, key).sigmas());
  };
  using Spec = engine::DetectorSpec;
  EXPECT_GT(sigmas_if("gain_dn_e", [](Spec& s) { s.full_well_e *= 1.02; }), 4.0);
  EXPECT_GT(sigmas_if("quantum_efficiency", [](Spec& s) { s.quantum_efficiency *= 1.02; }), 4.0);
  EXPECT_GT(sigmas_if("read_noise_e", [](Spec& s) { s.read_noise_e *= 1.03; }), 4.0);
  EXPECT_GT(sigmas_if("dark_current_e_s", [](Spec& s) { s.dark_e_s *= 1.02; }), 4.0);

  CameraReport whole;
  whole.sensors.push_back(report);
  EXPECT_TRUE(characterize::missed_limits(whole).empty());
  for (Figure& figure : whole.sensors[0].figures)
    if (figure.key == "gain_dn_e") figure.truth *= 1.03;
  EXPECT_EQ(characterize::missed_limits(whole).size(), 1U);
}

TEST(CameraReport, SaysWhatQuantiserAndPedestalHide) {
  SmallCamera camera;
  camera.detector.bits = 8;  // 78 e- to a DN
  camera.detector.pedestal_dn = 20;
  const auto hidden = camera.report().figures;
  const Figure& noise = figure_of(hidden, "read_noise_e");
  EXPECT_EQ(noise.standing, Standing::kUpperLimit);
  EXPECT_GT(noise.measured.value, 8.0);
  EXPECT_NE(noise.note.find("dominated by the quantiser"), std::string::npos) << noise.note;
  EXPECT_EQ(figure_of(hidden, "dynamic_range_db").standing, Standing::kLowerLimit);

  camera.detector.pedestal_dn = 0;
  const auto cut = camera.report().figures;
  EXPECT_EQ(figure_of(cut, "read_noise_e").standing, Standing::kNotMeasurable);
  EXPECT_TRUE(std::isnan(figure_of(cut, "read_noise_e").measured.value));
  EXPECT_LT(std::abs(figure_of(cut, "gain_dn_e").sigmas()), 4.0);

  const engine::DetectorSpec deep = characterize::at_16_bits(camera.detector);
  EXPECT_EQ(deep.bits, 16);
  EXPECT_GE(deep.pedestal_dn * deep.gain_e_dn(), 8 * camera.detector.read_noise_e);
}

TEST(CameraReport, EdgesShowTheProductOfTheOptics) {
  SmallCamera camera(192);
  camera.detector = characterize::at_16_bits(camera.detector);
  camera.optics_spec.jitter_rad = 0.3e-6;
  camera.optics_spec.vibration.amplitude_rad = 0.5e-6;  // along u: one edge sees it
  engine::Optics lens = camera.optics();
  SensorReport sensor;
  sensor.spec = camera.detector;
  sensor.record.used.assign(192 * 192, 1);
  sensor.transfer.saturation_e.value = 20000;
  sensor.record.light.resize(1);
  sensor.record.light[0].irradiance_w_m2 =
      20000 / camera.detector.electrons_per_irradiance(kExposure);
  const auto edges = characterize::characterize_edges(lens, camera.optics_spec, sensor,
                                                      camera.maps(), camera.pool, 1, kExposure);
  ASSERT_EQ(edges.size(), 2U);
  for (const auto& edge : edges) {
    EXPECT_NEAR(edge.angle_deg, 5.0, 0.02);
    EXPECT_LT(std::abs(edge.worst), 0.01) << edge.worst_cycles_per_px;
  }
  EXPECT_LT(edges[0].analytic.back(), edges[1].analytic.back() - 0.03);

  // Against optics that do not shake it is too low by more than the limit.
  camera.optics_spec.jitter_rad = 0;
  const engine::OtfCascade steady(camera.optics_spec);
  const double f = edges[0].response.cycles_per_px[60];
  const double analytic = std::abs(steady.whole(f, 0.0, steady.focused(0.0)));
  EXPECT_LT(edges[0].response.mtf[60], analytic - 0.01);
}

/// Power of a frame less its mean by spatial frequency, over that of white noise of the same
/// variance, in rings of 1/32 cycle per pixel: by how many sigmas the furthest is off 1.
double colour_of_noise(const std::vector<double>& noise, int side) {
  constexpr int kBlock = 32;
  constexpr int kRings = kBlock / 2;
  std::vector<std::complex<double>> turn;
  for (int i = 0; i < kBlock; ++i) turn.push_back(std::polar(1.0, -2.0 * engine::kPi * i / kBlock));
  std::vector<double> power(kRings + 1);
  std::vector<double> count(kRings + 1);
  const auto at = [](int i) { return static_cast<std::size_t>(i); };
  for (int top = 0; top < side; top += kBlock) {
    for (int left = 0; left < side; left += kBlock) {
      std::vector<std::complex<double>> rows(kBlock * kBlock);
      for (int v = 0; v < kBlock; ++v)
        for (int k = 0; k < kBlock; ++k)
          for (int u = 0; u < kBlock; ++u)
            rows[at(v * kBlock + k)] +=
                noise[at((top + v) * side + left + u)] * turn[at(k * u % kBlock)];
      // Half of the plane: the rest mirrors it.
      for (int k = 1; k < kBlock / 2; ++k) {
        for (int m = 0; m < kBlock; ++m) {
          std::complex<double> sum = 0;
          for (int v = 0; v < kBlock; ++v)
            sum += rows[at(v * kBlock + k)] * turn[at(m * v % kBlock)];
          const int ring = static_cast<int>(std::lround(std::hypot(k, m > 16 ? m - kBlock : m)));
          if (ring > kRings) continue;
          power[at(ring)] += std::norm(sum);
          count[at(ring)] += 1.0;
        }
      }
    }
  }
  double all = 0;
  double n = 0;
  for (int r = 1; r <= kRings; ++r) {
    all += power[at(r)];
    n += count[at(r)];
  }
  double worst = 0;
  for (int r = 1; r <= kRings; ++r)  // a power has an error of itself
    worst = std::max(
        worst, std::abs(power[at(r)] / count[at(r)] / (all / n) - 1.0) * std::sqrt(count[at(r)]));
  return worst;
}

TEST(Bench, NoiseOfAFlatFieldIsWhite) {
  constexpr int kFrame_px = 256;
  SmallCamera camera(kFrame_px);
  engine::Optics lens = camera.optics();
  Bench bench(lens, camera.detector, camera.maps(), camera.optics_spec.camera, camera.pool, 1);
  bench.illuminate(10000 / camera.detector.electrons_per_irradiance(kExposure));
  const engine::DnImage& frame = bench.frame(kExposure);
  double mean = 0;
  for (const std::uint16_t dn : frame.pixels()) mean += dn / (1.0 * kFrame_px * kFrame_px);
  std::vector<double> noise;
  for (const std::uint16_t dn : frame.pixels()) noise.push_back(dn - mean);
  EXPECT_LT(colour_of_noise(noise, kFrame_px), 3.0);

  // Noise that went through the optics, here a tenth of it into each of two neighbours, is not.
  std::vector<double> blurred = noise;
  for (std::size_t i = kFrame_px; i < noise.size(); ++i)
    blurred[i] = 0.8 * noise[i] + 0.1 * noise[i - 1] + 0.1 * noise[i - kFrame_px];
  EXPECT_GT(colour_of_noise(blurred, kFrame_px), 10.0);
}

TEST(Bench, FramesDifferAndSeedsRepeat) {
  SmallCamera camera;
  engine::Optics lens = camera.optics();
  const auto frames = [&](std::uint64_t seed) {
    Bench bench(lens, camera.detector, camera.maps(), camera.optics_spec.camera, camera.pool, seed);
    std::vector<std::vector<std::uint16_t>> out;
    for (int i = 0; i < 2; ++i) {
      const auto dn = bench.frame(kExposure).pixels();
      out.emplace_back(dn.begin(), dn.end());
    }
    return out;
  };
  const auto first = frames(1);
  EXPECT_NE(first[0], first[1]);
  EXPECT_EQ(first, frames(1));
  EXPECT_NE(first, frames(2));
}

}  // namespace
