#include "engine/orbit/visibility_margins.h"

#include <map>
#include <random>

#include <gtest/gtest.h>

#include "engine/core/constants.h"
#include "engine/orbit/kepler.h"
#include "tests/support/scenes.h"

namespace engine {
namespace {

constexpr std::array kAll{Condition::kRange,        Condition::kLineOfSight, Condition::kEclipse,
                          Condition::kSunExclusion, Condition::kField,       Condition::kSignal,
                          Condition::kEarthBehind};

/// All keys in use, and none idle.
VisibilitySpec busy_spec(double max_range_m) {
  VisibilitySpec spec;
  spec.max_range_m = max_range_m;
  spec.line_of_sight_height_m = 50e3;
  spec.sun_exclusion_rad = 0.7;
  spec.field = FieldOfView{};
  spec.field->left_tan = spec.field->top_tan = -0.8;
  spec.field->right_tan = spec.field->bottom_tan = 0.9;
  spec.signal = SignalLimit{5.0, 2.0, 0.2, 623.0, 4e13, 5.0, 1e-3, 0.4};
  // As bright as needed at some tenths of the range.
  spec.signal->electrons_per_w_m2 *= std::pow(max_range_m / 2e7, 2);
  return spec;
}

/// Breaks of a margin's promise: the side changes sooner than it said.
int broken_promises(const Propagator& camera, const Propagator& target, const VisibilitySpec& spec,
                    std::mt19937_64& random, std::map<Condition, int>& met) {
  const Epoch epoch = test_support::epoch_2022();
  std::uniform_real_distribution<double> when_s(0.0, 86400.0);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  int broken = 0;
  for (const Condition condition : kAll) {
    VisibilityMargins margins(camera, target, spec, {condition});
    for (int i = 0; i < 20; ++i) {
      const Epoch t = epoch + from_seconds(when_s(random));
      const Margin now = margins.at(t).all;
      met[condition] += now.m > 0.0 ? 1 : 0;
      for (int k = 0; k < 10; ++k) {
        const Epoch then = t + from_seconds(now.s * (k == 0 ? 0.999 : unit(random)));
        broken += (margins.at(then).all.m > 0.0) == (now.m > 0.0) ? 0 : 1;
      }
    }
  }
  return broken;
}

TEST(VisibilityMargins, HoldForAsLongAsTheySay) {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  const Epoch epoch = test_support::epoch_2022();
  std::map<Condition, int> met;
  for (int pair = 0; pair < 100; ++pair) {
    const auto orbit = [&](double most_e) {
      const double e = most_e * unit(random);
      const double perigee_m = kEarthRadius_m + 2e5 + 3e6 * unit(random);
      return KeplerElements{perigee_m / (1.0 - e),    e,
                            kPi * unit(random),       2.0 * kPi * unit(random),
                            2.0 * kPi * unit(random), 2.0 * kPi * unit(random)};
    };
    // Every other pair flies in formation, 20 km wide at most.
    const KeplerElements first = orbit(pair % 2 == 0 ? 0.7 : 0.05);
    KeplerElements second = orbit(0.7);
    if (pair % 2 == 1) {
      second = first;
      second.eccentricity += 1e-3 * unit(random);
      second.inclination_rad += 1e-3 * unit(random);
      second.mean_anomaly_rad += 1e-3 * unit(random);
    }
    const VisibilitySpec spec = busy_spec(pair % 2 == 0 ? 1e7 : 10e3);
    EXPECT_EQ(broken_promises(KeplerPropagator(first, epoch), KeplerPropagator(second, epoch), spec,
                              random, met),
              0)
        << pair;
  }
  // Neither always met nor never, of 2000.
  for (const Condition condition : kAll) {
    EXPECT_GT(met[condition], 50) << name_of(condition);
    EXPECT_LT(met[condition], 1950) << name_of(condition);
  }
}

TEST(VisibilityMargins, AreThoseOfTheConditionThatShutsLongest) {
  const test_support::Flyby flyby;
  const VisibilitySpec spec = busy_spec(1e7);
  VisibilityMargins all(flyby.camera, flyby.target, spec, Conditions::needed(spec));
  for (double t_s = 0.0; t_s < 86400.0; t_s += 137.0) {
    const Margins together = all.at(flyby.at(t_s));
    double least_m = 1e30;
    double open_s = 1e30;
    double shut_s = 0.0;
    double range_shut_s = 0.0;
    for (const Condition c : {Condition::kRange, Condition::kLineOfSight, Condition::kEclipse,
                              Condition::kSunExclusion, Condition::kField, Condition::kSignal}) {
      const Margin one =
          VisibilityMargins(flyby.camera, flyby.target, spec, {c}).at(flyby.at(t_s)).all;
      least_m = std::min(least_m, one.m);
      open_s = std::min(open_s, one.s);
      if (!(one.m > 0.0)) shut_s = std::max(shut_s, one.s);
      if (c == Condition::kRange) range_shut_s = shut_s;
    }
    EXPECT_EQ(together.all.m > 0.0, least_m > 0.0);
    if (range_shut_s > 60.0) {
      EXPECT_EQ(together.all.s, range_shut_s);  // then the others are not asked
    } else {
      EXPECT_EQ(together.all.m, least_m);
      EXPECT_EQ(together.all.s, least_m > 0.0 ? open_s : shut_s);
    }
  }
}

TEST(VisibilityMargins, AreFiniteForBodiesAtOnePlace) {
  const test_support::Flyby flyby;
  const VisibilitySpec spec = busy_spec(1e7);
  for (const Condition condition : kAll) {
    const Margin margin =
        VisibilityMargins(flyby.camera, flyby.camera, spec, {condition}).at(flyby.at(100.0)).all;
    EXPECT_TRUE(std::isfinite(margin.m)) << name_of(condition);
    EXPECT_GE(margin.s, 0.0) << name_of(condition);
  }
}

}  // namespace
}  // namespace engine
