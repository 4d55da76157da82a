#include "engine/render/path_tracer.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include <gtest/gtest.h>

#include "engine/scene/telescope.h"
#include "tests/support/noisy_corner.h"
#include "tests/support/path_tracing.h"
#include "tests/support/statistics.h"

namespace engine {
namespace {

using test_support::add_plate;
using test_support::converged;
using test_support::Corner;
using test_support::kRange_m;
using test_support::kSun_w_m2;
using test_support::lambert_material;
using test_support::look_at_origin;
using test_support::Moments;
using test_support::render;
using test_support::Rendered;
using test_support::spec_of;
using test_support::toward;
using test_support::true_errors;

/// A telescope with two lamps.
Snapshot telescope_view() {
  Snapshot snapshot = look_at_origin({60e3, 70e3, -40e3}, {0, 0, 1});
  snapshot.sun = {toward({1, 1, -1}), kSun_w_m2};
  snapshot.earthshine = {toward({0, 0, 1}), 40.0};
  return snapshot;
}

TEST(PathTracer, NoiseOfIndependentSamplesFallsAsTheirRoot) {
  // The wall of the corner: only its bounce is random.
  Mesh mesh;
  add_plate(mesh, "grey", {0, -6, 0}, {8, 0, 0}, {0, 12, 0});
  add_plate(mesh, "grey", {0, -6, 0}, {0, 12, 0}, {0, 0, 6});
  Snapshot snapshot = test_support::view_from({kRange_m, 0, 3}, {-1, 0, 0}, {0, 0, 1});
  snapshot.sun = {toward({0, 0, 1}), kSun_w_m2};
  const auto variance = [&](int samples) {
    RenderSpec spec = spec_of(96, 1);
    spec.samples_per_pixel = samples;
    spec.bounce_share = 1.0;  // which samples bounce is spread evenly, and would be better
    spec.sequence = SequenceKind::kIndependent;
    const Rendered out = render(spec, mesh, {lambert_material("grey", 0.5)}, snapshot);
    Moments m;  // one height: one form factor in the middle of the wall
    for (int v = 46; v <= 50; ++v)
      for (int u = 48 - 20; u <= 48 + 20; ++u) m.add(out.mean(u, v));
    return m.variance();
  };
  // 205 pixels: the variance is known to 10 %, their ratio to 14 %, and three sigma.
  EXPECT_NEAR(variance(36) / variance(144) / 4.0, 1.0, 0.42);
}

TEST(PathTracer, SequencesAndSamplersAgreeInTheMean) {
  const auto target =
      std::make_shared<TracedTarget>(telescope_mesh(), test_support::telescope_materials());
  WorkerPool pool(2);
  const auto mean_light = [&](SequenceKind sequence, BrdfSampler sampler) {
    RenderSpec spec = spec_of(128, 2);
    spec.sequence = sequence;
    spec.sampler = sampler;
    spec.bounce_share = 0.5;
    PathTracer tracer(spec, target, pool);
    Snapshot snapshot = telescope_view();
    Moments m;
    for (std::uint64_t seed = 1; seed <= 12; ++seed) {
      snapshot.seed = seed;
      Radiance light;
      static_cast<void>(tracer.render(snapshot, {36}, light));
      double sum = 0;
      for (const float x : light.grid.pixels()) sum += static_cast<double>(x);
      m.add(sum);
    }
    return m;
  };
  const Moments usual = mean_light(SequenceKind::kSobol, BrdfSampler::kMixture);
  for (const auto& [sequence, sampler] :
       {std::pair(SequenceKind::kIndependent, BrdfSampler::kMixture),
        std::pair(SequenceKind::kSobol, BrdfSampler::kCosine),
        std::pair(SequenceKind::kSobol, BrdfSampler::kUniform)}) {
    const Moments other = mean_light(sequence, sampler);
    // Student's t for 22 degrees of freedom: 4.5 is 1e-4.
    EXPECT_NEAR(other.mean(), usual.mean(),
                4.5 * std::hypot(usual.sigma_of_mean(), other.sigma_of_mean()));
    if (sequence == SequenceKind::kIndependent) {
      EXPECT_GT(other.variance(), usual.variance());
    }
  }
  // The cone finds less.
  const Moments cone = mean_light(SequenceKind::kSobol, BrdfSampler::kPaperCone);
  EXPECT_LT(cone.mean(), usual.mean() - 5.0 * usual.sigma_of_mean());
}

/// Their root mean square.
double true_rho(const Radiance& light, const std::vector<double>& truth) {
  double sum = 0;
  const std::vector<double> errors = true_errors(light, truth);
  for (const double error : errors) sum += error * error;
  return std::sqrt(sum / static_cast<double>(errors.size()));
}

/// Its image, worked out once.
const std::vector<double>& corner_converged() {
  static const std::vector<double> truth = [] {
    const Corner corner;
    return converged(corner.spec, corner.target, corner.snapshot, 24, 2000);
  }();
  return truth;
}

TEST(PathTracerNoise, ReportedErrorIsTheTrueOne) {
  Corner corner;
  const std::vector<double>& truth = corner_converged();
  WorkerPool pool(2);
  PathTracer tracer(corner.spec, corner.target, pool);
  for (const int samples : {36, 144}) {
    Moments reported2;
    Moments true2;
    for (std::uint64_t seed = 1; seed <= 16; ++seed) {
      corner.snapshot.seed = seed;
      Radiance light;
      const RenderReport report = tracer.render(corner.snapshot, {samples}, light);
      ASSERT_GT(report.rho_mc.lit_px, 150);
      reported2.add(report.rho_mc.rms * report.rho_mc.rms);
      const double rho = true_rho(light, truth);
      true2.add(rho * rho);
      EXPECT_GE(report.rho_mc.worst, report.rho_mc.rms);
    }
    // The reference itself has a 300th of the variance at most; noise is averaged by a kernel on
    // pixels, not cells: 3 %.
    const double noise = std::hypot(reported2.sigma_of_mean(), true2.sigma_of_mean());
    EXPECT_NEAR(reported2.mean(), true2.mean(), 4.0 * noise + 0.06 * true2.mean()) << samples;
  }
}

TEST(PathTracerNoise, OneSampleACellKnowsNothingOfItsNoise) {
  const Corner corner;
  WorkerPool pool(1);
  PathTracer tracer(corner.spec, corner.target, pool);
  Radiance light;
  const RenderReport report = tracer.render(corner.snapshot, {9}, light);
  EXPECT_EQ(report.samples_per_pixel, 9);
  EXPECT_TRUE(std::isnan(report.rho_mc.rms));
}

TEST(PathTracerNoise, LimitIsMetAndCostsNoMoreThanItMust) {
  Corner corner;
  corner.spec.samples_per_pixel = 0;
  const std::vector<double>& truth = corner_converged();
  WorkerPool pool(2);
  PathTracer tracer(corner.spec, corner.target, pool);
  std::array<int, 3> samples{};
  const std::array<double, 3> limits{0.4, 0.19, 0.1};
  for (std::size_t i = 0; i < limits.size(); ++i) {
    Radiance light;
    Budget budget;
    budget.rho_mc = limits[i];
    const RenderReport report = tracer.render(corner.snapshot, budget, light);
    // Two hundred lit pixels, six of which share their noise: its rms is known to 12 %.
    EXPECT_LT(report.rho_mc.rms, 1.25 * limits[i]);
    EXPECT_LT(true_rho(light, truth), 1.25 * limits[i]);
    samples[i] = report.samples_per_pixel;
  }
  EXPECT_LE(samples[0], samples[1]);
  EXPECT_LT(samples[1], samples[2]);
  // As the root of the samples at the slowest.
  EXPECT_LT(samples[2], 1.5 * samples[1] * std::pow(0.19 / 0.1, 2));
  // The profile's limit holds where the budget has none.
  Radiance light;
  EXPECT_EQ(tracer.render(corner.snapshot, {}, light).samples_per_pixel, samples[1]);
}

TEST(PathTracerNoise, StoppingAddsNoBias) {
  // What the pilot saw chooses the samples, and none of it is in the image: over 200 seeds the mean
  // is the converged image's, in light and in its centre.
  Corner corner;
  corner.spec.samples_per_pixel = 0;
  const std::vector<double>& truth = corner_converged();
  WorkerPool pool(2);
  PathTracer tracer(corner.spec, corner.target, pool);
  Moments light_sum;
  Moments first_moment;
  double true_sum = 0;
  double true_moment = 0;
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    corner.snapshot.seed = seed;
    Radiance light;
    Budget budget;
    budget.rho_mc = 0.5;
    static_cast<void>(tracer.render(corner.snapshot, budget, light));
    double sum = 0;
    double moment = 0;
    true_sum = 0;
    true_moment = 0;
    for (std::size_t i = 0; i < truth.size(); ++i) {
      const double x = static_cast<double>(i % static_cast<std::size_t>(light.grid.width()));
      const auto value = static_cast<double>(light.grid.pixels()[i]);
      sum += value;
      moment += value * x;
      true_sum += truth[i];
      true_moment += truth[i] * x;
    }
    light_sum.add(sum);
    first_moment.add(moment);
  }
  // The reference, 24 seeds of 2000 samples, is worth more than 600 of these: a third of the noise.
  EXPECT_NEAR(light_sum.mean(), true_sum, 4.0 * 1.2 * light_sum.sigma_of_mean());
  EXPECT_NEAR(first_moment.mean(), true_moment, 4.0 * 1.2 * first_moment.sigma_of_mean());
}

/// A clock that each look moves on.
Duration g_now{};
Duration g_step{};
Duration ticking() noexcept { return g_now += g_step; }

TEST(PathTracerDeadline, StopsWhenTheNextPassWouldNotFitAndSaysWhatItReached) {
  Corner corner;
  corner.spec.clock = ticking;
  WorkerPool pool(1);
  PathTracer tracer(corner.spec, corner.target, pool);
  Radiance light;
  Budget budget;
  budget.samples_per_pixel = 576;  // 32 of each cell and replicate: passes of 1, 1, 2, 4, 8, 16
  g_step = Duration(1'000'000);
  budget.time = Duration(1'000'000'000);
  const RenderReport all = tracer.render(corner.snapshot, budget, light);
  EXPECT_EQ(all.passes, 6);
  EXPECT_EQ(all.samples_per_pixel, 576);
  // Each pass takes a millisecond by this clock, two with the looks between.
  budget.time = Duration(8'000'000);
  const RenderReport cut = tracer.render(corner.snapshot, budget, light);
  EXPECT_LT(cut.passes, 6);
  EXPECT_GE(cut.passes, 1);
  EXPECT_EQ(cut.samples_per_pixel, 18 << (cut.passes - 1));
  EXPECT_GT(cut.rho_mc.rms, all.rho_mc.rms);
  budget.time = Duration(1);
  EXPECT_EQ(tracer.render(corner.snapshot, budget, light).passes, 1);
}

TEST(PathTracerDeadline, ReplayObeysThePassesThatWereDone) {
  Corner corner;
  corner.spec.clock = ticking;
  WorkerPool pool(1);
  PathTracer tracer(corner.spec, corner.target, pool);
  g_step = Duration(1'000'000);
  for (const int samples : {576, 0}) {
    Radiance live;
    Budget budget;
    budget.samples_per_pixel = samples;
    budget.rho_mc = samples == 0 ? 0.1 : 0.0;
    budget.time = Duration(9'000'000);
    const RenderReport report = tracer.render(corner.snapshot, budget, live);
    budget.time = {};
    budget.passes = report.passes;
    Radiance replay;
    RenderSpec without_clock = corner.spec;
    without_clock.clock = nullptr;
    PathTracer other(without_clock, corner.target, pool);
    EXPECT_EQ(other.render(corner.snapshot, budget, replay).passes, report.passes);
    EXPECT_TRUE(std::ranges::equal(live.grid.pixels(), replay.grid.pixels()));
    EXPECT_TRUE(std::ranges::equal(live.cover.pixels(), replay.cover.pixels()));
  }
}

}  // namespace
}  // namespace engine
