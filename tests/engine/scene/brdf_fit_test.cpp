#include "engine/scene/brdf_fit.h"

#include <array>
#include <cmath>
#include <limits>
#include <string>

#include <gtest/gtest.h>

#include "engine/core/constants.h"
#include "engine/core/contract.h"
#include "engine/core/random.h"
#include "tests/support/goniometer.h"
#include "tests/support/scenes.h"
#include "tests/support/statistics.h"

namespace engine {
namespace {

using Eigen::Vector3d;
using test_support::measure;
using test_support::steps;
using Variant = FiveParameterBrdf::Variant;

constexpr std::array<FitParameter, kFitParameters> kAll{
    FitParameter::kAr, FitParameter::kBr, FitParameter::kKb, FitParameter::kKd, FitParameter::kKr};

double value_of(const FiveParameters& p, FitParameter which) {
  BrdfFit fit;
  fit.parameters = p;
  return fit.value(which);
}

/// Eq 7 as it is fitted.
double model(const FiveParameters& p, Variant variant, const Vector3d& in, const Vector3d& out) {
  const FacetGeometry g(in, out);
  return p.kb * g.fresnel_like(p.kr) * std::exp(p.br * std::pow(g.x, p.ar)) * g.masking /
             g.cosines +
         (variant == Variant::kPaper ? p.kd / in.z() : p.kd);
}

struct Noise {
  double share = 0;  ///< of each reading
  double floor = 0;  ///< 1/sr
  bool stated = false;
  std::uint64_t seed = 1;
};

/// What an in-plane goniometer does: every 5 deg, finer about the mirror, and some steps aside.
BrdfPoints bench(const FiveParameters& truth, Variant variant, const Noise& noise,
                 const std::vector<double>& incidences_deg = {10, 20, 30, 40, 50, 60, 70}) {
  BrdfPoints points;
  points.path = "bench.csv";
  points.have_sigma = noise.stated;
  const auto add = [&](double theta_in, double in_plane, double out_of_plane) {
    if (std::abs(in_plane) > 86.0) return;
    measure(points, theta_in, in_plane, out_of_plane,
            [&](const auto& in, const auto& out) { return model(truth, variant, in, out); });
    BrdfPoint& p = points.points.back();
    const double sigma = std::hypot(noise.share * p.brdf_per_sr, noise.floor);
    Draws draws(noise.seed, Stream::kRead, 0, static_cast<std::uint32_t>(p.line));
    p.brdf_per_sr = std::max(0.0, p.brdf_per_sr + sigma * static_cast<double>(draws.normal()));
    if (noise.stated) p.sigma_per_sr = sigma;
  };
  for (const double theta_in : incidences_deg) {
    for (const double p : steps(-80, 80, 5)) add(theta_in, p, 0.0);
    for (const double off :
         {-4.0, -3.0, -2.0, -1.5, -1.0, -0.5, 0.25, 0.5, 1.0, 1.5, 2.0, 3.0, 4.0})
      add(theta_in, theta_in + off + 0.1, 0.0);
    for (const double o : {0.5, 1.0, 2.0, 4.0, 10.0, 20.0}) add(theta_in, theta_in, o);
  }
  return points;
}

TEST(FitBrdf, GivesTheParametersOfExactPointsBack) {
  for (const FiveParameters& truth : {test_support::silicon(), test_support::polyimide()}) {
    for (const Variant variant : {Variant::kPhysical, Variant::kPaper}) {
      const BrdfFit fit = fit_brdf(bench(truth, variant, {}), {variant, {}});
      EXPECT_TRUE(fit.converged);
      // Steps end at 1e-10 in the logarithms; br and ar go together ten times as far.
      for (const FitParameter p : kAll)
        EXPECT_NEAR(fit.value(p) / value_of(truth, p), 1.0, 1e-7) << truth.ar;
    }
  }
}

TEST(FitBrdf, Table3ComesBackFromNoisyPointsWithinItsUncertainty) {
  // Pulls are normal if the stated uncertainty is right: the sum of their squares over the noises
  // is chi squared. 20 tests, none below 1e-3 unless one in fifty times.
  constexpr std::size_t kNoises = 24;
  for (const FiveParameters& truth : {test_support::silicon(), test_support::polyimide()}) {
    for (const bool stated : {false, true}) {
      const Variant variant = stated ? Variant::kPaper : Variant::kPhysical;
      std::array<double, kFitParameters> chi2{};
      for (std::size_t i = 0; i < kNoises; ++i) {
        const Noise noise = stated ? Noise{0.03, 0.002, true, 100 + i} : Noise{0.05, 0, false, i};
        const BrdfFit fit = fit_brdf(bench(truth, variant, noise), {variant, {}});
        ASSERT_TRUE(fit.converged) << i;
        for (std::size_t k = 0; k < kFitParameters; ++k) {
          const double pull = (fit.value(kAll[k]) - value_of(truth, kAll[k])) / fit.sigma[k];
          EXPECT_LT(std::abs(pull), 4.5) << kFitNames[k] << " " << i;
          EXPECT_LT(fit.sigma[k], 0.06 * std::abs(value_of(truth, kAll[k]))) << kFitNames[k];
          chi2[k] += pull * pull;
        }
        // Of 364 points: the rms to 4 %, four times that.
        if (stated) {
          EXPECT_NEAR(fit.reduced_chi2, 1.0, 4.5 * std::sqrt(2.0 / 359.0));
        } else {
          EXPECT_NEAR(fit.relative_rms, 0.05, 0.16 * 0.05);
        }
      }
      for (std::size_t k = 0; k < kFitParameters; ++k) {
        const double above = test_support::chi_squared_tail(chi2[k], kNoises);
        EXPECT_GT(above, 1e-3) << kFitNames[k] << ": uncertainty too small";
        EXPECT_LT(above, 1.0 - 1e-3) << kFitNames[k] << ": uncertainty too large";
      }
    }
  }
}

TEST(FitBrdf, SaysThatExponentAndWidthAreHardlyKnownApart) {
  const BrdfFit fit =
      fit_brdf(bench(test_support::silicon(), Variant::kPhysical, {0.05, 0, false, 9}), {});
  EXPECT_GT(std::abs(fit.correlation(0, 1)), 0.95);
  EXPECT_DOUBLE_EQ(fit.correlation(0, 1), fit.correlation(1, 0));
  EXPECT_EQ(fit.correlation(3, 3), 1.0);
}

TEST(FitBrdf, SaysWhatThePointsDoNotKnow) {
  // A Lambert surface: there is no lobe to have a width.
  const BrdfFit lambert =
      fit_brdf(bench(test_support::lambert(0.3), Variant::kPhysical, {0.02, 0, false, 4}), {});
  EXPECT_NEAR(lambert.parameters.kd, 0.3 / kPi, 5.0 * lambert.sigma[3]);
  EXPECT_FALSE(lambert.undetermined(FitParameter::kKd));
  EXPECT_TRUE(lambert.undetermined(FitParameter::kBr));
  EXPECT_TRUE(lambert.undetermined(FitParameter::kKr));
  // Next to normal light alone: what kr does is a factor, as is kb.
  const BrdfFit head_on = fit_brdf(
      bench(test_support::polyimide(), Variant::kPhysical, {0.05, 0, false, 5}, {1.0, 3.0}), {});
  EXPECT_FALSE(head_on.undetermined(FitParameter::kKb));
  EXPECT_GT(head_on.sigma[4] / head_on.parameters.kr, 5.0 * 0.016);  // ten times the whole bench's
}

TEST(FitBrdf, WhatIsHeldStaysAndHelpsTheRest) {
  const BrdfPoints points = bench(test_support::silicon(), Variant::kPhysical, {0.05, 0, false, 6});
  BrdfFitSpec held;
  held.fixed[0] = 0.557;
  const BrdfFit with = fit_brdf(points, held);
  const BrdfFit without = fit_brdf(points, {});
  EXPECT_EQ(with.parameters.ar, 0.557);
  EXPECT_EQ(with.sigma[0], 0.0);
  EXPECT_EQ(with.correlation(0, 1), 0.0);
  EXPECT_LT(with.sigma[1], 0.3 * without.sigma[1]);
  EXPECT_EQ(with.degrees, without.degrees + 1);
}

TEST(FitBrdf, LogarithmsOfReadingsWouldPullTheDiffuseTermDown) {
  // The mean of log(1 + e) is -e^2/2: of .2 that is 2 %, where kd is known to .2 / sqrt(180) = 1.5
  // %. Over sixteen noises the mean is known to .4 %: the weighed fit is within it, four times.
  double sum = 0;
  for (std::uint64_t seed = 0; seed < 16; ++seed) {
    const FiveParameters truth = test_support::polyimide();
    const BrdfFit fit = fit_brdf(bench(truth, Variant::kPhysical, {0.2, 0, false, 40 + seed}), {});
    sum += fit.parameters.kd / truth.kd - 1.0;
  }
  EXPECT_NEAR(sum / 16.0, 0.0, 4.0 * 0.004);
}

TEST(FitBrdf, IsNotDoneWhenItsSumsAreNoNumbers) {
  // All held and sigmas of next to nothing: no step, and a sum of squares beyond all numbers.
  BrdfPoints points = bench(test_support::silicon(), Variant::kPhysical, {});
  points.have_sigma = true;
  for (BrdfPoint& p : points.points) p.sigma_per_sr = 1e-160;
  const BrdfFit fit = fit_brdf(points, {Variant::kPhysical, {1.0, -100.0, 1.0, 0.1, 1.0}});
  EXPECT_FALSE(fit.converged);
  EXPECT_EQ(fit.sigma[0], 0.0);
}

TEST(FitBrdf, RelativeScatterIsOfReadingsThatAreLight) {
  // A detector's noise of .1 all over is twice silicon's diffuse term: most readings are none but
  // noise, off by twice the model rms. Where it is three sigmas they are off by a third at most.
  const Noise noise{0.01, 0.1, true, 77};
  const BrdfFit fit = fit_brdf(bench(test_support::silicon(), Variant::kPhysical, noise), {});
  EXPECT_TRUE(std::isfinite(fit.relative_rms));
  EXPECT_GT(fit.relative_rms, 0.0);
  EXPECT_LT(fit.relative_rms, 1.0 / 3.0);
  EXPECT_NEAR(fit.reduced_chi2, 1.0, 0.5);
}

TEST(FitBrdf, ComplainsOfTooLittle) {
  BrdfPoints points = bench(test_support::silicon(), Variant::kPhysical, {});
  BrdfPoints few = points;
  few.points.resize(8);
  EXPECT_THROW(static_cast<void>(fit_brdf(few, {})), ConfigError);
  BrdfPoints one_place = points;
  for (BrdfPoint& p : one_place.points) {
    p.theta_in_deg = 30;
    p.first_deg = 30;
    p.second_deg = 0;
  }
  EXPECT_THROW(static_cast<void>(fit_brdf(one_place, {})), ConfigError);
  BrdfPoints dark = points;
  for (BrdfPoint& p : dark.points) p.brdf_per_sr = 0;
  EXPECT_THROW(static_cast<void>(fit_brdf(dark, {})), ConfigError);
}

}  // namespace
}  // namespace engine
