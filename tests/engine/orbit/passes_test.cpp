#include "engine/orbit/passes.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "engine/core/constants.h"
#include "engine/scene/camera_geometry.h"
#include "tests/support/csv.h"
#include "tests/support/scenes.h"

namespace engine {
namespace {

using Eigen::Vector3d;
using test_support::Csv;
using test_support::Flyby;

constexpr double kMillisecond_s = 1e-3;
constexpr double kFifteenDays_s = 15.0 * 86400.0;

/// Table 2 with its defaults: 300 km, the Sun's disc and half the diagonal field, and a cylinder
/// for a shadow, as the references have it.
VisibilitySpec paper_spec() {
  const ConfigReader nothing =
      ConfigReader::from_text("[visibility]\nshadow = \"cylinder\"", "x.toml");
  return read_visibility(nothing.table("visibility"), SunModel::kErfa,
                         CameraGeometry{}.half_diagonal_field_rad());
}

std::vector<Pass> passes(const Flyby& flyby, const VisibilitySpec& spec, double begin_s,
                         double end_s) {
  return find_passes(flyby.camera, flyby.target, spec, flyby.epoch, sim_time(begin_s),
                     sim_time(end_s));
}

TEST(Passes, AreTheSixteenOfTheReference) {
  const Flyby flyby;
  const std::vector<Pass> found = passes(flyby, paper_spec(), 0.0, kFifteenDays_s);
  const Csv ranges("range_windows_15d.csv");
  const Csv visible("visible_windows_15d.csv");
  ASSERT_EQ(found.size(), 16U);
  ASSERT_EQ(ranges.rows().size(), 16U);
  ASSERT_EQ(visible.rows().size(), 16U);
  for (std::size_t i = 0; i < found.size(); ++i) {
    const Pass& pass = found[i];
    const Csv::Row& range = ranges.rows()[i];
    const Csv::Row& window = visible.rows()[i];
    // The model's requirement: edges to 1 ms.
    EXPECT_NEAR(seconds(pass.start), window.number("start_s"), kMillisecond_s) << i + 1;
    EXPECT_NEAR(seconds(pass.end), window.number("end_s"), kMillisecond_s) << i + 1;
    EXPECT_EQ(name_of(pass.start_limited_by), window.text("start_limited_by")) << i + 1;
    EXPECT_EQ(name_of(pass.end_limited_by), window.text("end_limited_by")) << i + 1;
    EXPECT_NEAR(seconds(pass.closest), range.number("tca_s"), kMillisecond_s) << i + 1;
    // 1e-4 m of each orbit after 15 days.
    EXPECT_NEAR(pass.min_range_m, 1e3 * range.number("min_range_km"), 1e-3) << i + 1;
  }
}

TEST(Passes, AreCutShortWhereTheTargetIsInShadow) {
  const Csv reference("visible_windows_other_epochs.csv");
  std::map<std::string, std::vector<const Csv::Row*>> by_epoch;
  for (const Csv::Row& row : reference.rows()) by_epoch[row.text("epoch")].push_back(&row);
  ASSERT_EQ(by_epoch.size(), 3U);
  int eclipsed_edges = 0;
  for (const auto& [day, rows] : by_epoch) {
    const auto epoch = epoch_from_utc(day.substr(0, 10) + "T00:00:00");
    ASSERT_TRUE(epoch.has_value()) << day;
    const std::vector<Pass> found = passes(Flyby(*epoch), paper_spec(), 0.0, kFifteenDays_s);
    ASSERT_EQ(found.size(), rows.size()) << day;
    for (std::size_t i = 0; i < found.size(); ++i) {
      EXPECT_NEAR(seconds(found[i].start), rows[i]->number("start_s"), kMillisecond_s) << day;
      EXPECT_NEAR(seconds(found[i].end), rows[i]->number("end_s"), kMillisecond_s) << day;
      EXPECT_EQ(name_of(found[i].start_limited_by), rows[i]->text("start_limited_by")) << day;
      EXPECT_EQ(name_of(found[i].end_limited_by), rows[i]->text("end_limited_by")) << day;
      eclipsed_edges += found[i].start_limited_by == Condition::kEclipse ? 1 : 0;
    }
  }
  EXPECT_GE(eclipsed_edges, 1);
}

TEST(Passes, NumberAsTheRangeLimitAllows) {
  // Minima of the range over 15 days: 2 below 70 km, 3 below 100, 11 below 200, 16 below 300; then
  // four near misses.
  VisibilitySpec spec = paper_spec();
  spec.max_range_m = 340e3;
  const std::vector<Pass> found = passes(Flyby(), spec, 0.0, kFifteenDays_s);
  std::vector<double> minima_km;
  for (const Pass& pass : found) minima_km.push_back(pass.min_range_m * 1e-3);
  std::sort(minima_km.begin(), minima_km.end());
  const auto below = [&](double km) {
    return std::lower_bound(minima_km.begin(), minima_km.end(), km) - minima_km.begin();
  };
  EXPECT_EQ(below(70.0), 2);
  EXPECT_EQ(below(100.0), 3);
  EXPECT_EQ(below(200.0), 11);
  EXPECT_EQ(below(300.0), 16);
  ASSERT_EQ(minima_km.size(), 20U);
  // One decimal is printed.
  EXPECT_NEAR(minima_km[16], 316.5, 0.05);
  EXPECT_NEAR(minima_km[17], 318.7, 0.05);
  EXPECT_NEAR(minima_km[18], 321.2, 0.05);
  EXPECT_NEAR(minima_km[19], 336.7, 0.05);
}

TEST(Passes, ThatAreCutByTheSpanSayso) {
  const Flyby flyby;
  const auto found = passes(flyby, paper_spec(), 309770.0, 309790.0);
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].start, sim_time(309770.0));
  EXPECT_EQ(found[0].end, sim_time(309790.0));
  EXPECT_EQ(found[0].start_limited_by, Condition::kSpan);
  EXPECT_EQ(found[0].end_limited_by, Condition::kSpan);
  EXPECT_NEAR(seconds(found[0].closest), test_support::kClosestOfPass3_s, kMillisecond_s);

  const auto half = passes(flyby, paper_spec(), 309785.0, 309900.0);
  ASSERT_EQ(half.size(), 1U);
  EXPECT_EQ(half[0].start_limited_by, Condition::kSpan);
  EXPECT_EQ(half[0].end_limited_by, Condition::kRange);
  EXPECT_EQ(half[0].closest, half[0].start);  // it only recedes
}

TEST(Passes, AppearAndVanishAtATangency) {
  const Flyby flyby;
  const Csv ranges("range_windows_15d.csv");
  for (const Csv::Row& row : ranges.rows()) {
    VisibilitySpec spec = paper_spec();
    const double tca_s = row.number("tca_s");
    spec.max_range_m = 1e3 * row.number("min_range_km") + 1.0;
    const auto grazing = passes(flyby, spec, tca_s - 900.0, tca_s + 900.0);
    ASSERT_EQ(grazing.size(), 1U) << row.text("idx");
    // The range is sqrt(r0^2 + (v t)^2): 1 m more lasts 2 sqrt(2 r0)/v.
    const double length_s = 2.0 * std::sqrt(2.0 * spec.max_range_m) / 14.54e3;
    EXPECT_NEAR(seconds(grazing[0].end - grazing[0].start) / length_s, 1.0, 0.01);
    spec.max_range_m -= 2.0;
    EXPECT_TRUE(passes(flyby, spec, tca_s - 900.0, tca_s + 900.0).empty()) << row.text("idx");
  }
}

/// As a search that knows nothing of speeds would have it.
int passes_of_a_scan(const Flyby& flyby, double step_s) {
  int found = 0;
  bool before = false;
  for (double t_s = 0.0; t_s <= kFifteenDays_s; t_s += step_s) {
    const Epoch now = flyby.at(t_s);
    const Vector3d line_m = flyby.target.at(now).position.m - flyby.camera.at(now).position.m;
    const bool near = line_m.norm() < 300e3;
    found += near && !before ? 1 : 0;
    before = near;
  }
  return found;
}

TEST(Passes, AreMissedAtFixedSteps) {
  const Flyby flyby;
  EXPECT_EQ(passes_of_a_scan(flyby, 60.0), 7);
  EXPECT_EQ(passes_of_a_scan(flyby, 30.0), 15);
}

/// A body whose place is asked for.
class Counted final : public Propagator {
 public:
  explicit Counted(const Propagator& body) : body_(body) {}
  [[nodiscard]] OrbitState at(Epoch t) const noexcept override {
    ++asked_;
    return body_.at(t);
  }
  [[nodiscard]] int asked() const { return asked_; }

 private:
  const Propagator& body_;
  mutable int asked_ = 0;
};

TEST(Passes, OfFifteenDaysAreFoundInFewSteps) {
  // Steps as long as 15.33 km/s allows, the speeds at both perigees, were 3866.
  const Flyby flyby;
  const Counted camera(flyby.camera);
  const auto found = find_passes(camera, flyby.target, paper_spec(), flyby.epoch, SimTime{},
                                 sim_time(kFifteenDays_s));
  EXPECT_EQ(found.size(), 16U);
  EXPECT_LT(camera.asked(), 3866);
}

/// config/formation.toml's camera, 11.8 km from its target.
KeplerElements beside_target() {
  return {6796.7142e3,        0.0014363,         51.72785 * kDegree,
          101.3460 * kDegree, 40.2943 * kDegree, 23.6505 * kDegree};
}

TEST(Passes, OfAFormationTakeNoMoreThanAStepInTenSeconds) {
  // By the fastest approach of any two bodies the Sun's margin, 11.8 km and less, was good for .2
  // s.
  const Flyby flyby;
  const KeplerPropagator leader(beside_target(), flyby.epoch);
  const Counted camera(leader);
  const VisibilitySpec spec = paper_spec();
  const auto found =
      find_passes(camera, flyby.target, spec, flyby.epoch, SimTime{}, sim_time(kFifteenDays_s));
  EXPECT_LT(camera.asked(), kFifteenDays_s / 10.0);
  // One in each of 232.6 orbits, all but the first day's first ended by the shadow: 2 pi / n is
  // 5576.5 s, and the Sun moves the shadow's edge by a second an orbit.
  ASSERT_EQ(found.size(), 233U);
  const double orbit_s = 2.0 * kPi * std::sqrt(std::pow(6796.7142e3, 3) / kEarthMu_m3_s2);
  for (std::size_t i = 1; i + 1 < found.size(); ++i) {
    EXPECT_EQ(found[i].start_limited_by, Condition::kEclipse) << i;
    EXPECT_EQ(found[i].end_limited_by, Condition::kEclipse) << i;
    EXPECT_NEAR(seconds(found[i + 1].start - found[i].start), orbit_s, 3.0) << i;
    // The edge is where the cylinder is, by the Sun itself.
    const auto margin_m = [&](SimTime t) {
      const Epoch now = flyby.epoch + t.time_since_epoch();
      return shadow_margin_m(ShadowModel::kCylinder, flyby.target.at(now).position,
                             sun_position(SunModel::kErfa, now));
    };
    // The interpolated Sun's 1 ns and the edge's own, at 7.7 km/s.
    EXPECT_NEAR(margin_m(found[i].start), 0.0, 3e-5) << i;
    EXPECT_NEAR(margin_m(found[i].end), 0.0, 3e-5) << i;
  }
}

/// A body that moves along y as a function of time says, away from everything.
template <class Range>
class OnRails final : public Propagator {
 public:
  OnRails(Epoch epoch, Range range_m) : epoch_(epoch), range_m_(range_m) {}
  [[nodiscard]] OrbitState at(Epoch t) const noexcept override {
    const double s = seconds(t - epoch_);
    OrbitState state;
    state.position.m = {7e6, range_m_(s), 0.0};
    state.velocity.m_s = {0.0, (range_m_(s + 0.5) - range_m_(s - 0.5)), 0.0};
    return state;
  }

 private:
  Epoch epoch_;
  Range range_m_;
};

template <class Range>
std::vector<Window> near_300_km(Range range_m, double end_s, int* asked = nullptr) {
  const Epoch epoch{};
  const OnRails camera(epoch, [](double) { return 0.0; });
  const OnRails target(epoch, range_m);
  const Counted counted(target);
  auto windows = find_windows(camera, counted, VisibilitySpec{}, {Condition::kRange}, epoch,
                              SimTime{}, sim_time(end_s));
  if (asked != nullptr) *asked = counted.asked();
  return windows;
}

TEST(Windows, OfATouchAreOneOrNone) {
  // (t - 5)^2 / 2 over a depth: rounding of 300 km is 6e-11 m, and a scan of its signs would make
  // many windows of the middle ones.
  for (const double depth_m : {-1e-3, -1e-10, 0.0, 1e-13, 1e-10, 1e-6, 1e-3, 1.0}) {
    const auto range_m = [depth_m](double t_s) {
      return 300e3 + 0.5 * (t_s - 5.0) * (t_s - 5.0) - depth_m;
    };
    const std::vector<Window> found = near_300_km(range_m, 10.0);
    EXPECT_LE(found.size(), 1U) << depth_m;
    // Deeper than the .1 mm that count.
    EXPECT_EQ(found.size(), depth_m >= 1e-3 ? 1U : 0U) << depth_m;
    if (found.empty()) continue;
    EXPECT_NEAR(seconds(found[0].end - found[0].start), 2.0 * std::sqrt(2.0 * depth_m), 1e-6);
  }
}

TEST(Windows, OfARangeThatStaysAtItsLimitAreOneOrNoneAndTakeNoForever) {
  int asked = 0;
  // Rounding goes both ways.
  const auto found = near_300_km([](double t_s) { return 300e3 + 1e-9 * std::sin(1e3 * t_s); },
                                 kFifteenDays_s, &asked);
  EXPECT_LE(found.size(), 1U);
  EXPECT_LT(asked, 1.1 * kFifteenDays_s);
}

TEST(Windows, BeginWhereTheOrbitDoes) {
  class Short final : public Propagator {
   public:
    explicit Short(const Flyby& flyby) : flyby_(flyby) {}
    [[nodiscard]] OrbitState at(Epoch t) const noexcept override {
      EXPECT_GE(t, span().begin);
      EXPECT_LE(t, span().end);
      return flyby_.target.at(t);
    }
    [[nodiscard]] EpochSpan span() const noexcept override {
      return {flyby_.at(309770.0), flyby_.at(666690.0)};
    }

   private:
    const Flyby& flyby_;
  };
  const Flyby flyby;
  const Short target(flyby);
  const auto found = find_passes(flyby.camera, target, paper_spec(), flyby.epoch, SimTime{},
                                 sim_time(kFifteenDays_s));
  ASSERT_EQ(found.size(), 7U);  // the third to the ninth
  EXPECT_EQ(found.front().start, sim_time(309770.0));
  EXPECT_EQ(found.back().end, sim_time(666690.0));
  for (const Pass& pass : found)
    EXPECT_EQ(pass.truncated(), &pass == &found.front() || &pass == &found.back());
  EXPECT_TRUE(
      find_passes(flyby.camera, target, paper_spec(), flyby.epoch, SimTime{}, sim_time(309769.0))
          .empty());
}

TEST(Windows, OfAllConditionsAreWhatThoseOfEachHaveInCommon) {
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  const Epoch epoch = test_support::epoch_2022();
  const double day_s = 86400.0;
  int compared = 0;
  for (int pair = 0; pair < 20; ++pair) {
    const auto orbit = [&] {
      return KeplerElements{kEarthRadius_m + 4e5 + 2e6 * unit(random),
                            0.05 * unit(random),
                            kPi * unit(random),
                            2.0 * kPi * unit(random),
                            2.0 * kPi * unit(random),
                            2.0 * kPi * unit(random)};
    };
    const KeplerPropagator camera(orbit(), epoch);
    const KeplerPropagator target(orbit(), epoch);
    VisibilitySpec spec;
    spec.max_range_m = 5e6;
    spec.line_of_sight_height_m = 1e5 * unit(random);
    spec.sun_exclusion_rad = unit(random);
    const auto windows = [&](Conditions conditions) {
      return find_windows(camera, target, spec, conditions, epoch, SimTime{}, sim_time(day_s));
    };
    std::vector<Window> common{{SimTime{}, sim_time(day_s)}};
    for (const Condition c : {Condition::kRange, Condition::kLineOfSight, Condition::kEclipse,
                              Condition::kSunExclusion}) {
      std::vector<Window> both;
      for (const Window& a : common)
        for (const Window& b : windows({c}))
          if (std::max(a.start, b.start) < std::min(a.end, b.end))
            both.push_back({std::max(a.start, b.start), std::min(a.end, b.end)});
      std::sort(both.begin(), both.end(),
                [](const Window& a, const Window& b) { return a.start < b.start; });
      common = both;
    }
    const std::vector<Window> found = windows(Conditions::needed(spec));
    ASSERT_EQ(found.size(), common.size()) << pair;
    for (std::size_t i = 0; i < found.size(); ++i, ++compared) {
      // Bisected from other ends; a margin's rounding, 1e-8 m, is worth a nanosecond at 10 m/s.
      EXPECT_NEAR(seconds(found[i].start - common[i].start), 0.0, 4e-9) << pair;
      EXPECT_NEAR(seconds(found[i].end - common[i].end), 0.0, 4e-9) << pair;
    }
  }
  EXPECT_GT(compared, 100);
}

TEST(Windows, OfALineOfSightEndWhereTheTangentsSay) {
  // Two circles in one plane: the line touches a sphere of radius R when the bodies stand
  // acos(R / r1) + acos(R / r2) apart.
  const double r1_m = 6878137.0;
  const double r2_m = 7378137.0;
  const Epoch epoch{};
  const KeplerPropagator camera({r1_m, 0, 0.5, 0, 0, 0}, epoch);
  const KeplerPropagator target({r2_m, 0, 0.5, 0, 0, 0}, epoch);
  const double parts_rad_s =
      std::sqrt(kEarthMu_m3_s2 / std::pow(r1_m, 3)) - std::sqrt(kEarthMu_m3_s2 / std::pow(r2_m, 3));
  for (const double height_m : {0.0, 100e3}) {
    VisibilitySpec spec;
    spec.line_of_sight_height_m = height_m;
    const auto found = find_windows(camera, target, spec, {Condition::kLineOfSight}, epoch,
                                    SimTime{}, sim_time(20000.0));
    ASSERT_EQ(found.size(), 1U);
    const double ball_m = kEarthRadius_m + height_m;
    const double apart_rad = std::acos(ball_m / r1_m) + std::acos(ball_m / r2_m);
    EXPECT_EQ(found[0].start_limited_by, Condition::kSpan);
    EXPECT_EQ(found[0].end_limited_by, Condition::kLineOfSight);
    // A tenth of a micrometre at the tangent.
    EXPECT_NEAR(seconds(found[0].end), apart_rad / parts_rad_s, 1e-6) << height_m;
  }
}

TEST(Windows, OfTheEarthBehindAreThoseOfTheReference) {
  const Flyby flyby;
  const Csv reference("background_intervals.csv");
  const Csv ranges("range_windows_15d.csv");
  std::size_t compared = 0;
  for (const Csv::Row& row : ranges.rows()) {
    const double start_s = row.number("start_s");
    const double end_s = row.number("end_s");
    const auto found =
        find_windows(flyby.camera, flyby.target, paper_spec(), {Condition::kEarthBehind},
                     flyby.epoch, sim_time(start_s), sim_time(end_s));
    std::size_t here = 0;
    for (const Csv::Row& interval : reference.rows()) {
      if (interval.text("range_window") != row.text("idx") ||
          !interval.text("background").starts_with("earth"))
        continue;
      ASSERT_LT(here, found.size());
      EXPECT_NEAR(seconds(found[here].start), interval.number("start_s"), kMillisecond_s);
      EXPECT_NEAR(seconds(found[here].end), interval.number("end_s"), kMillisecond_s);
      ++here;
    }
    EXPECT_EQ(found.size(), here) << row.text("idx");
    compared += here;
  }
  EXPECT_EQ(compared, 11U);
}

TEST(Passes, NeedTheTargetInAFieldThatStaysInTheSky) {
  // A camera that looks where the target is at the closest approach: there it crosses the field of
  // 1.479 mrad at .2109 rad/s, 7.01 ms from side to side through the middle.
  const Flyby flyby;
  const Epoch closest = flyby.at(test_support::kClosestOfPass3_s);
  const OrbitState camera = flyby.camera.at(closest);
  const OrbitState target = flyby.target.at(closest);
  const Vector3d z = (target.position.m - camera.position.m).normalized();
  const Vector3d x = (target.velocity.m_s - camera.velocity.m_s).normalized();
  VisibilitySpec spec = paper_spec();
  FieldOfView field;
  field.axes.matrix << x.transpose(), z.cross(x).transpose(), z.transpose();
  field.left_tan = field.top_tan = -512.0 * 6.5e-6 / 4.5;
  field.right_tan = field.bottom_tan = 512.0 * 6.5e-6 / 4.5;
  spec.field = field;
  const auto found = passes(flyby, spec, 309000.0, 310000.0);
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].start_limited_by, Condition::kField);
  EXPECT_EQ(found[0].end_limited_by, Condition::kField);
  // The rate is stationary there; the field's half is off by its own cube.
  EXPECT_NEAR(seconds(found[0].end - found[0].start), 2.0 * field.right_tan / 0.210890042, 1e-8);
  // Turned about by half a turn it sees nothing, not what lies behind it.
  spec.field->axes.matrix.row(0) *= -1.0;
  spec.field->axes.matrix.row(2) *= -1.0;
  EXPECT_TRUE(passes(flyby, spec, 309000.0, 310000.0).empty());
}

TEST(Passes, NeedTheSunOutOfTheWay) {
  // In pass 3 the phase angle at the closest approach is 109 deg: the Sun stands 71 deg off the
  // line.
  const Flyby flyby;
  VisibilitySpec spec = paper_spec();
  spec.sun_exclusion_rad = 60.0 * kDegree;
  const auto found = passes(flyby, spec, 309700.0, 309900.0);
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].start_limited_by, Condition::kSunExclusion);
  EXPECT_EQ(found[0].end_limited_by, Condition::kRange);
  const auto off_sun_rad = [&](SimTime t) {
    const Epoch now = flyby.epoch + t.time_since_epoch();
    const Vector3d camera = flyby.camera.at(now).position.m;
    return angle_between_rad(flyby.target.at(now).position.m - camera,
                             sun_position(SunModel::kErfa, now).m - camera);
  };
  // Edges to 1 ns: the line turns at .2 rad/s at most.
  EXPECT_NEAR(off_sun_rad(found[0].start), spec.sun_exclusion_rad, 1e-9);
}

}  // namespace
}  // namespace engine
