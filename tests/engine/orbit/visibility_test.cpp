#include "engine/orbit/visibility.h"

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

/// Table 2 with its defaults: 300 km, the Sun's disc and half the diagonal field.
VisibilitySpec paper_spec() {
  const ConfigReader nothing = ConfigReader::from_text("", "x.toml");
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

TEST(LineOfSight, ClearsTheEarthByTheHeightOfTheReference) {
  const Csv reference("los_test_vectors.csv");
  for (const Csv::Row& row : reference.rows()) {
    const Position<J2000> camera{
        1e3 * Vector3d(row.number("rc_x_km"), row.number("rc_y_km"), row.number("rc_z_km"))};
    const Position<J2000> target{
        1e3 * Vector3d(row.number("ro_x_km"), row.number("ro_y_km"), row.number("ro_z_km"))};
    // Places and height are printed to a micrometre.
    EXPECT_NEAR(line_of_sight_margin_m(camera, target, 0.0),
                1e3 * row.number("min_height_of_segment_km"), 3e-6)
        << row.text("tag");
    const double margin_m = line_of_sight_margin_m(camera, target, 1e3 * row.number("h0_km"));
    EXPECT_EQ(margin_m > 0.0, row.number("visible_truth") == 1.0) << row.text("tag");
    EXPECT_EQ(margin_m > 0.0, row.number("visible_corrected_Table2") == 1.0) << row.text("tag");
  }
}

TEST(LineOfSight, IsTable2AsCorrectedForRandomPlaces) {
  std::mt19937_64 random(1);
  std::normal_distribution<double> axis;
  std::uniform_real_distribution<double> height_m(200e3, 4e6);
  std::uniform_real_distribution<double> limit_m(0.0, 199e3);
  int blocked = 0;
  for (int i = 0; i < 100000; ++i) {
    const auto place = [&] {
      const Vector3d v(axis(random), axis(random), axis(random));
      return Vector3d(v.normalized() * (kEarthRadius_m + height_m(random)));
    };
    const Vector3d rc = place();
    const Vector3d ro = place();
    const double h0_m = limit_m(random);
    const double beta = angle_between_rad(-rc, ro - rc);
    const double beta0 = std::asin((kEarthRadius_m + h0_m) / rc.norm());
    const double alpha = angle_between_rad(rc, ro);
    const double alpha0 = std::acos((kEarthRadius_m + h0_m) / rc.norm());
    if (std::abs(beta - beta0) < 1e-9) continue;
    const bool clear = beta > beta0 || alpha < alpha0;
    ASSERT_EQ(line_of_sight_margin_m({rc}, {ro}, h0_m) > 0.0, clear) << i;
    blocked += clear ? 0 : 1;
  }
  EXPECT_GT(blocked, 10000);
}

TEST(LineOfSight, IsFiniteForPlacesThatCoincideOrFaceEachOther) {
  const Position<J2000> here{{7e6, 0, 0}};
  const Position<J2000> there{{-7e6, 0, 0}};
  EXPECT_DOUBLE_EQ(line_of_sight_margin_m(here, here, 0.0), 7e6 - kEarthRadius_m);
  EXPECT_DOUBLE_EQ(line_of_sight_margin_m(here, there, 0.0), -kEarthRadius_m);
  EXPECT_DOUBLE_EQ(line_of_sight_margin_m(here, {{8e6, 0, 0}}, 0.0), 7e6 - kEarthRadius_m);
}

TEST(Background, IsTheEarthWhereTheReferenceSaysSo) {
  const Flyby flyby;
  const Csv reference("background_intervals.csv");
  for (const Csv::Row& row : reference.rows()) {
    const bool earth = row.text("background").starts_with("earth");
    const double start_s = row.number("start_s");
    const double end_s = row.number("end_s");
    // Edges to 1 ms, as for the windows.
    for (const double t_s :
         {start_s + kMillisecond_s, 0.5 * (start_s + end_s), end_s - kMillisecond_s}) {
      const Epoch now = flyby.at(t_s);
      EXPECT_EQ(earth_is_behind(flyby.camera.at(now).position, flyby.target.at(now).position),
                earth)
          << "window " << row.text("range_window") << " at " << t_s;
    }
  }
}

TEST(Background, IsSpaceWhenTheCameraLooksAwayFromTheEarth) {
  EXPECT_FALSE(earth_is_behind({{7e6, 0, 0}}, {{8e6, 0, 0}}));
  EXPECT_TRUE(earth_is_behind({{8e6, 0, 0}}, {{7e6, 0, 0}}));
}

}  // namespace
}  // namespace engine
