#include "hil/jitter.h"

#include <cmath>

#include <gtest/gtest.h>

#include "engine/core/constants.h"
#include "engine/core/random.h"
#include "tests/support/temp_file.h"

namespace {

using engine::kPi;
using engine::sim_time;
using engine::SimTime;
using hil::Jitter;
using hil::JitterSpec;
using test_support::TempFile;

/// x: a triangle from 10 to 20 to 40 Hz. y: flat from 10 to 40 Hz.
JitterSpec density() {
  JitterSpec spec;
  spec.densities = {{10.0, {0.0, 2e-12}}, {20.0, {4e-12, 2e-12}}, {40.0, {0.0, 2e-12}}};
  return spec;
}

/// What the mean of x(t) x(t + lag) should be: the integral of S cos(2 pi f lag).
double transform(std::size_t axis, double lag_s) {
  double sum = 0;
  constexpr int kCells = 30'000;
  for (int i = 0; i < kCells; ++i) {
    const double f = 10.0 + 30.0 * (i + 0.5) / kCells;
    const double triangle = f < 20.0 ? (f - 10.0) / 10.0 : (40.0 - f) / 20.0;
    sum += (axis == 0 ? 4e-12 * triangle : 2e-12) * std::cos(2.0 * kPi * f * lag_s);
  }
  return sum * 30.0 / kCells;
}

constexpr int kSamples = 4000;
constexpr double kPower_rad2 = 60e-12;  // half of 30 Hz at 4e-12, and 30 Hz at 2e-12

SimTime some_time(std::uint32_t i) {
  return sim_time(86400.0 * engine::Draws(5, engine::Stream::kLight, 0, i).uniform_double());
}

/// Mean of x(t) x(t + lag) and of y(t) y(t + lag) at instants all over a day, in shares of the
/// power.
std::array<double, 2> autocorrelation(const Jitter& jitter, double lag_s) {
  std::array<double, 2> sum{};
  for (std::uint32_t i = 0; i < kSamples; ++i) {
    const SimTime t = some_time(i);
    const auto now = jitter.at(t);
    const auto later = jitter.at(t + engine::from_seconds(lag_s));
    for (std::size_t axis = 0; axis < 2; ++axis) sum[axis] += now[axis] * later[axis];
  }
  return {sum[0] / kSamples / kPower_rad2, sum[1] / kSamples / kPower_rad2};
}

// Of the mean of n squares of a normal variable; products of two scatter less.
const double kFiveSigma = 5.0 * std::sqrt(2.0 / kSamples);

TEST(Jitter, MeanSquareIsTheIntegralOfTheDensity) {
  for (const double share : autocorrelation(Jitter(density(), 1, SimTime{}), 0.0))
    EXPECT_NEAR(share, 1.0, kFiveSigma);
}

TEST(Jitter, AutocorrelationIsTheTransformOfTheDensity) {
  const Jitter jitter(density(), 1, SimTime{});
  for (const double lag_s : {0.013, 0.02, 0.05}) {
    const std::array<double, 2> got = autocorrelation(jitter, lag_s);
    // A sinusoid's place within its share, a quarter of a hertz wide and 2 Hz at the triangle's
    // tips, is worth less than a hundredth.
    for (std::size_t axis = 0; axis < 2; ++axis)
      EXPECT_NEAR(got[axis], transform(axis, lag_s) / kPower_rad2, kFiveSigma + 0.01)
          << axis << " " << lag_s;
  }
}

TEST(Jitter, DoesNotRepeatAfterTheSpacingOfItsSinusoids) {
  const Jitter jitter(density(), 1, SimTime{});
  // Evenly spaced they would give 1 or -1 here. Drawn, each has a phase of its own: 5 sigma of a
  // mean of 128 cosines.
  const double lag_s = static_cast<double>(Jitter::kSinusoids) / 30.0;
  EXPECT_LT(std::abs(autocorrelation(jitter, lag_s)[1]),
            5.0 * std::sqrt(0.5 / Jitter::kSinusoids) + kFiveSigma);
}

TEST(Jitter, AxesDoNotKnowEachOther) {
  const Jitter jitter(density(), 1, SimTime{});
  double sum = 0;
  for (std::uint32_t i = 0; i < kSamples; ++i) {
    const auto x = jitter.at(some_time(i));
    sum += x[0] * x[1] / kPower_rad2;
  }
  EXPECT_NEAR(sum / kSamples, 0.0, 5.0 / std::sqrt(kSamples));
}

TEST(Jitter, ALineHasItsAmplitudeFrequencyDirectionAndPhase) {
  JitterSpec spec;
  spec.lines = {{40.0, 3e-6, 30.0 * engine::kDegree, 0.5}};
  const SimTime start = sim_time(1000.0);
  const Jitter jitter(spec, 1, start);
  for (int i = 0; i < 1000; ++i) {
    const double t_s = 0.00137 * i;
    const double wave = 3e-6 * std::sin(2.0 * kPi * 40.0 * t_s + 0.5);
    const auto got = jitter.at(start + engine::from_seconds(t_s));
    // Times are whole nanoseconds: 40 Hz move by 2.5e-7 rad of phase in one.
    ASSERT_NEAR(got[0], wave * std::cos(kPi / 6.0), 1e-12);
    ASSERT_NEAR(got[1], wave * std::sin(kPi / 6.0), 1e-12);
  }
}

TEST(Jitter, IsAFunctionOfSeedAndTime) {
  const Jitter one(density(), 1, SimTime{});
  const Jitter same(density(), 1, SimTime{});
  const Jitter other(density(), 2, SimTime{});
  static_cast<void>(same.at(sim_time(77.0)));  // what was asked before does not count
  EXPECT_EQ(one.at(sim_time(3.0)), same.at(sim_time(3.0)));
  EXPECT_NE(one.at(sim_time(3.0)), other.at(sim_time(3.0)));
}

TEST(Jitter, WithoutAnythingIsNothing) {
  EXPECT_EQ(Jitter().at(sim_time(3.0)), (hil::TrimAngles{}));
  EXPECT_EQ(Jitter({}, 1, SimTime{}).at(sim_time(3.0)), (hil::TrimAngles{}));
}

TEST(Jitter, ASeriesIsLinearBetweenItsSamplesAndRepeatsWithoutAJump) {
  JitterSpec spec;
  spec.samples = {{5.0, {0.0, 4e-6}}, {6.0, {2e-6, 0.0}}, {9.0, {-1e-6, 1e-6}}};
  const Jitter jitter(spec, 1, sim_time(100.0));
  const auto expect_at = [&](double after_start_s, double x_rad, double y_rad) {
    const auto got = jitter.at(sim_time(100.0 + after_start_s));
    EXPECT_NEAR(got[0], x_rad, 1e-15) << after_start_s;
    EXPECT_NEAR(got[1], y_rad, 1e-15) << after_start_s;
  };
  // The mean spacing is 2 s: a round takes 6.
  for (const double round_s : {0.0, 6.0, 600.0, -6.0}) {
    expect_at(round_s, 0.0, 4e-6);
    expect_at(round_s + 0.25, 0.5e-6, 3e-6);
    expect_at(round_s + 1.0, 2e-6, 0.0);
    expect_at(round_s + 2.5, 0.5e-6, 0.5e-6);
    expect_at(round_s + 4.0, -1e-6, 1e-6);
    expect_at(round_s + 5.0, -0.5e-6, 2.5e-6);
    expect_at(round_s + 6.0 - 1e-9, -0.5e-15, 4e-6 - 1.5e-15);
  }
}

TEST(Jitter, ScenarioNamesLinesAndFiles) {
  const TempFile psd("psd.csv", "frequency_hz,x_rad2_hz,y_rad2_hz\n1,1e-12,0\n9,3e-12,0\n");
  const TempFile series("series.csv", "# seen on the bench\nt_s,x_urad,y_urad\n0,1,2\n\n1,3,4\r\n");
  const auto config = engine::ConfigReader::from_text(
      "[jitter]\npsd_file = \"" + psd.path() + "\"\nseries_file = \"" + series.path() +
          "\"\n[jitter.lines.wheel]\nfrequency_hz = 40\namplitude_urad = 2\ndirection_deg = 90\n"
          "phase_deg = 180\n[jitter.lines.cooler]\nfrequency_hz = 60\namplitude_urad = 1\n",
      "j.toml");
  const JitterSpec spec = hil::read_jitter(config);
  config.reject_unknown_keys();
  ASSERT_EQ(spec.lines.size(), 2U);  // in alphabetical order
  EXPECT_EQ(spec.lines[0].frequency_hz, 60.0);
  EXPECT_DOUBLE_EQ(spec.lines[1].amplitude_rad, 2e-6);
  EXPECT_DOUBLE_EQ(spec.lines[1].direction_rad, kPi / 2.0);
  EXPECT_DOUBLE_EQ(spec.lines[1].phase_rad, kPi);
  ASSERT_EQ(spec.densities.size(), 2U);
  EXPECT_EQ(spec.densities[1].rad2_hz[0], 3e-12);
  ASSERT_EQ(spec.samples.size(), 2U);
  EXPECT_DOUBLE_EQ(spec.samples[1].rad[1], 4e-6);
}

/// What is said about [jitter] `key` = a file that holds `content`, without the file's name.
std::string complaint(const std::string& key, const std::string& content) {
  const TempFile file("bad.csv", content);
  const auto config = engine::ConfigReader::from_text(
      "[jitter]\n" + key + " = \"" + file.path() + "\"\n", "j.toml");
  try {
    static_cast<void>(hil::read_jitter(config));
  } catch (const engine::ConfigError& e) {
    const std::string text = e.what();
    EXPECT_EQ(text.substr(0, file.path().size()), file.path());
    return text.substr(file.path().size());
  }
  return "";
}

TEST(Jitter, FileErrorsNameFileAndLine) {
  const std::string psd = "frequency_hz,x_rad2_hz,y_rad2_hz\n";
  EXPECT_EQ(complaint("psd_file", psd + "1,0,0\n1,0,0\n"),
            ":3: frequencies must grow from row to row");
  EXPECT_EQ(complaint("psd_file", psd + "1,-1e-12,0\n2,0,0\n"), ":2: a density must be >= 0");
  EXPECT_EQ(complaint("psd_file", psd + "-1,0,0\n"),
            ":2: a frequency must be >= 0 and <= 100000 Hz");
  EXPECT_EQ(complaint("psd_file", psd + "1,1,0\n2,1,0\n"),
            ":3: the jitter so far must be <= 0.1 rad rms");
  EXPECT_EQ(complaint("psd_file", psd + "1,0,0\n"), ":1: a density needs two rows at least");
  const std::string series = "t_s,x_urad,y_urad\n";
  EXPECT_EQ(complaint("series_file", series + "0,0,0\n1,0,0\n0.5,0,0\n"),
            ":4: times must grow from row to row");
  EXPECT_EQ(complaint("series_file", series + "0,0,0\n1,2e5,0\n"),
            ":3: an angle must be within 100000 urad of 0");
  EXPECT_EQ(complaint("series_file", series + "2e9,0,0\n"), ":2: a time must be within 1e9 s of 0");
  EXPECT_EQ(complaint("series_file", series), ":1: a series needs two rows at least");
}

}  // namespace
