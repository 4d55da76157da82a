#include "engine/orbit/sun.h"

#include <erfa.h>
#include <cmath>
#include <cstdio>

#include <gtest/gtest.h>

#include "engine/core/constants.h"
#include "engine/orbit/sight_line.h"
#include "engine/orbit/utc.h"
#include "tests/support/csv.h"

namespace engine {
namespace {

using test_support::Csv;

constexpr double kArcsecond = kDegree / 3600.0;

/// TT in days since J2000.
double tt_days(const Csv::Row& row) {
  return row.number("jd_tt1") - 2451545.0 + row.number("jd_tt2");
}
Epoch epoch_of(const Csv::Row& row) { return Epoch(from_seconds(tt_days(row) * 86400.0 - 32.184)); }
Eigen::Vector3d vector(const Csv::Row& row, const char* x, const char* y, const char* z) {
  return {row.number(x), row.number(y), row.number(z)};
}
double right_ascension_deg(const Eigen::Vector3d& v) {
  const double deg = std::atan2(v.y(), v.x()) / kDegree;
  return deg < 0.0 ? deg + 360.0 : deg;
}
double declination_deg(const Eigen::Vector3d& v) {
  return std::atan2(v.z(), std::hypot(v.x(), v.y())) / kDegree;
}
/// "-07 40 21" in units of its first number.
double sexagesimal(const std::string& text) {
  double a = 0;
  double b = 0;
  double c = 0;
  EXPECT_EQ(std::sscanf(text.c_str(), "%lf %lf %lf", &a, &b, &c), 3) << text;
  const double size = std::abs(a) + b / 60.0 + c / 3600.0;
  return text[0] == '-' ? -size : size;
}

TEST(Sun, ErfaIsWithinAnArcsecondAndOneInAHundredThousand) {
  const Csv reference("sun_reference.csv");
  for (const Csv::Row& row : reference.rows()) {
    const Position<J2000> sun = sun_position(SunModel::kErfa, epoch_of(row));
    EXPECT_LT(angle_between_rad(sun.m, vector(row, "geo_x_ICRS", "geo_y", "geo_z")), kArcsecond)
        << row.text("epoch");
    EXPECT_NEAR(sun.m.norm() / (row.number("distance_km") * 1e3), 1.0, 1e-5) << row.text("epoch");
  }
}

TEST(Sun, ShinesFromWhereItIsSeenWithinAnArcsecond) {
  const Csv reference("sun_reference.csv");
  for (const Csv::Row& row : reference.rows()) {
    const Epoch t = epoch_of(row);
    const Eigen::Vector3d seen = vector(row, "app_x_GCRS", "app_y", "app_z");
    EXPECT_LT(angle_between_rad(apparent_sun_position(SunModel::kErfa, t).m, seen), kArcsecond)
        << row.text("epoch");
    EXPECT_GT(angle_between_rad(sun_position(SunModel::kErfa, t).m, seen), 20.0 * kArcsecond);
  }
}

TEST(Sun, UtcEpochsReachTheSameTerrestrialTime) {
  const Csv reference("sun_reference.csv");
  int compared = 0;
  for (const Csv::Row& row : reference.rows()) {
    if (row.text("epoch_scale") != "utc") continue;
    std::string text = row.text("epoch");
    text[10] = 'T';
    const auto epoch = epoch_from_utc(text);
    ASSERT_TRUE(epoch.has_value()) << text;
    // A sum of 8000 days in one double: half a microsecond.
    EXPECT_NEAR(seconds(*epoch - epoch_of(row)), 0.0, 1e-6) << text;
    ++compared;
  }
  EXPECT_GE(compared, 4);
}

TEST(Sun, Table1OfDateAgreesWithItsIndependentEvaluation) {
  const Csv reference("sun_reference.csv");
  for (const Csv::Row& row : reference.rows()) {
    const Eigen::Vector3d sun_m = table1_sun_of_date_m(tt_days(row) / 36525.0);
    // Nine decimals are printed.
    EXPECT_NEAR(right_ascension_deg(sun_m), row.number("table1_intended_RA_mean_of_date_deg"),
                1e-9);
    EXPECT_NEAR(declination_deg(sun_m), row.number("table1_intended_Dec_mean_of_date_deg"), 1e-9);
    EXPECT_NEAR(sun_m.norm() * 1e-3, row.number("table1_distance_km"), 2e-6);
  }
}

TEST(Sun, Table1IsPrecessedToJ2000) {
  const Csv reference("sun_reference.csv");
  for (const Csv::Row& row : reference.rows()) {
    const Eigen::Vector3d sun = sun_position(SunModel::kTable1, epoch_of(row)).m.normalized();
    const Eigen::Vector3d want = vector(row, "table1_precessed_J2000_x", "table1_precessed_J2000_y",
                                        "table1_precessed_J2000_z");
    // Fifteen decimals are printed; a microsecond of time is worth 2e-13.
    EXPECT_LT((sun - want).norm(), 1e-12) << row.text("epoch");
    // The header's promise for this rung.
    EXPECT_LT(angle_between_rad(sun, vector(row, "geo_x_ICRS", "geo_y", "geo_z")),
              45.0 * kArcsecond);
  }
}

TEST(Sun, CorrectedTable1ReproducesTable6) {
  const Csv reference("sun_table6_reference.csv");
  for (const Csv::Row& row : reference.rows()) {
    const auto midnight = epoch_from_utc(row.text("date") + "T00:00:00");
    ASSERT_TRUE(midnight.has_value());
    // 0 h TT is 69.184 s before 0 h UTC.
    const TwoPartDate tt = terrestrial_time(*midnight - from_seconds(69.184));
    const Eigen::Vector3d sun_m = table1_sun_of_date_m((tt.day1 - 2451545.0 + tt.day2) / 36525.0);
    const double ra_deg = right_ascension_deg(sun_m);
    const double dec_deg = declination_deg(sun_m);
    EXPECT_NEAR(ra_deg, row.number("table1_intended_RA_deg"), 1e-9) << row.text("date");
    EXPECT_NEAR(dec_deg, row.number("table1_intended_Dec_deg"), 1e-9) << row.text("date");
    // The paper prints seconds of time, 15", and arcseconds; it is 3" wrong at most beyond that.
    EXPECT_NEAR(ra_deg, 15.0 * sexagesimal(row.text("paper_calc_RA")), (7.5 + 3.0) / 3600.0);
    EXPECT_NEAR(dec_deg, sexagesimal(row.text("paper_calc_Dec")), (0.5 + 3.0) / 3600.0);
  }
}

/// As an almanac has it: where an observer who moves with the Earth sees it, on the true equator
/// and equinox of date.
Eigen::Vector3d apparent_place(SunModel model, Epoch t) {
  const Eigen::Vector3d seen = apparent_sun_position(model, t).m.normalized();
  const TwoPartDate tt = terrestrial_time(t);
  double to_date[3][3];
  eraPnm06a(tt.day1, tt.day2, to_date);
  double gcrs[3] = {seen.x(), seen.y(), seen.z()};
  double of_date[3];
  eraRxp(to_date, gcrs, of_date);
  return {of_date[0], of_date[1], of_date[2]};
}

std::string sexagesimal_text(double units, const char* format) {
  const double seconds_of = std::abs(units) * 3600.0;
  char text[40];
  std::snprintf(text, sizeof text, format, units < 0.0 ? '-' : '+',
                static_cast<int>(seconds_of / 3600.0),
                static_cast<int>(std::fmod(seconds_of / 60.0, 60.0)), std::fmod(seconds_of, 60.0));
  return text;
}

TEST(Sun, ApparentPlacesAreThoseOfTheAlmanacAndMakeTable6) {
  const Csv reference("sun_table6_reference.csv");
  std::printf("%-10s  %-13s %-12s  %-13s %-12s  %-9s %-9s  off, arcsec\n", "0h TT", "RA, ERFA",
              "Dec", "RA, table 1", "Dec", "almanac", "");
  for (const Csv::Row& row : reference.rows()) {
    const Epoch t = *epoch_from_utc(row.text("date") + "T00:00:00") - from_seconds(69.184);
    const Eigen::Vector3d erfa = apparent_place(SunModel::kErfa, t);
    const Eigen::Vector3d table1 = apparent_place(SunModel::kTable1, t);
    const double ra_deg = right_ascension_deg(erfa);
    const double dec_deg = declination_deg(erfa);
    // The Sun's own 16 m/s round the barycentre while its light is on its way: .01".
    EXPECT_NEAR(ra_deg, row.number("ERFA_apparent_true_of_date_RA_deg"), 0.5 / 3600.0);
    EXPECT_NEAR(dec_deg, row.number("ERFA_apparent_true_of_date_Dec_deg"), 0.5 / 3600.0);
    EXPECT_LT(angle_between_rad(erfa, table1), 45.0 * kArcsecond) << row.text("date");
    // The almanac's columns are rounded to seconds; March's declination is misprinted by 20".
    EXPECT_NEAR(ra_deg, 15.0 * sexagesimal(row.text("paper_almanac_RA")), 8.0 / 3600.0);
    const double misprint_deg = row.text("date") == "2022-03-01" ? 20.0 / 3600.0 : 0.0;
    EXPECT_NEAR(dec_deg, sexagesimal(row.text("paper_almanac_Dec")) - misprint_deg, 1.0 / 3600.0);
    std::printf("%-10s  %s %s  %s %s  %-9s %-9s  %.1f\n", row.text("date").c_str(),
                sexagesimal_text(ra_deg / 15.0, "%c%02d %02d %05.2f").c_str(),
                sexagesimal_text(dec_deg, "%c%02d %02d %04.1f").c_str(),
                sexagesimal_text(right_ascension_deg(table1) / 15.0, "%c%02d %02d %05.2f").c_str(),
                sexagesimal_text(declination_deg(table1), "%c%02d %02d %04.1f").c_str(),
                row.text("paper_almanac_RA").c_str(), row.text("paper_almanac_Dec").c_str(),
                angle_between_rad(erfa, table1) / kArcsecond);
  }
}

TEST(Sun, BlackBodyGivesThePapersIrradiance) {
  // 633.460 and 654.827 W/m^2 and 629.711 nm, to the digits printed in the reference.
  const Csv reference("solar_band_450_850.csv");
  const Csv::Row& row = reference.rows().back();
  ASSERT_TRUE(row.text("source").starts_with("blackbody"));
  const BlackBodySun far = black_body_sun(1.521e11);
  EXPECT_NEAR(far.irradiance_w_m2, 633.460, 5e-4);
  EXPECT_NEAR(far.irradiance_w_m2, row.number("E_450_850nm_at_1.521e11m_W_m2"), 1e-6);
  const BlackBodySun near = black_body_sun(kAstronomicalUnit_m);
  EXPECT_NEAR(near.irradiance_w_m2, 654.827, 5e-4);
  EXPECT_NEAR(near.irradiance_w_m2, row.number("E_450_850nm_at_1au_W_m2"), 1e-6);
  EXPECT_NEAR(near.mean_wavelength_m * 1e9, row.number("energy_weighted_mean_wavelength_nm"), 5e-5);
}

TEST(Sun, MeasuredIrradianceIsThatOfAstmE490) {
  const Csv reference("solar_band_450_850.csv");
  const Csv::Row& row = reference.rows().front();
  const SunSpec spec;
  EXPECT_NEAR(spec.irradiance_1au_w_m2, row.number("E_450_850nm_at_1au_W_m2"), 5e-4);
  EXPECT_NEAR(spec.mean_wavelength_m * 1e9, row.number("energy_weighted_mean_wavelength_nm"), 5e-3);
  EXPECT_NEAR(sun_irradiance_w_m2(spec, 1.521e11), row.number("E_450_850nm_at_1.521e11m_W_m2"),
              5e-4);
}

TEST(Sun, IsBrighterInJanuaryThanInJulyByTheSquareOfItsDistance) {
  const auto irradiance = [](const char* day) {
    return sun_irradiance_w_m2(SunSpec{},
                               sun_position(SunModel::kErfa, *epoch_from_utc(day)).m.norm());
  };
  // (1 + e)^2 / (1 - e)^2 for e = .0167, and .001 for the Moon's pull on the Earth.
  EXPECT_NEAR(irradiance("2022-01-04T07:00:00") / irradiance("2022-07-04T07:00:00"), 1.069, 0.001);
}

TEST(ReadSun, KnowsTheThreeKindsOfIrradiance) {
  const auto read = [](const std::string& text) {
    const ConfigReader config = ConfigReader::from_text("[sun]\n" + text, "x.toml");
    return read_sun(config.table("sun"));
  };
  EXPECT_EQ(read("").irradiance_1au_w_m2, SunSpec{}.irradiance_1au_w_m2);
  EXPECT_TRUE(read("irradiance = \"measured\"").scales_with_distance);
  EXPECT_NEAR(read("irradiance = \"black-body\"").irradiance_1au_w_m2, 654.827, 5e-4);
  const SunSpec number = read("irradiance = 634.64");
  EXPECT_EQ(sun_irradiance_w_m2(number, 1e11), 634.64);
  EXPECT_EQ(sun_irradiance_w_m2(number, 2e11), 634.64);
  EXPECT_DOUBLE_EQ(read("wavelength_nm = 650").mean_wavelength_m, 650e-9);
  EXPECT_EQ(read("position = \"table-1\"").model, SunModel::kTable1);
  EXPECT_THROW(read("irradiance = -1.0"), ConfigError);
  EXPECT_THROW(read("irradiance = \"bright\""), ConfigError);
}

TEST(Sun, TheEarthsVelocityIsThatOfItsPlaceAndTheSunsOwn) {
  const Epoch start = epoch_from_utc("2022-01-01T00:00:00").value();
  for (int month = 0; month < 12; ++month) {
    const Epoch t = start + from_seconds(month * 30.4 * 86400.0);
    const Duration hour = from_seconds(3600.0);
    // The Earth from the Sun, by differences: half an hour of curvature leaves 1e-3 m/s.
    const Eigen::Vector3d round_the_sun =
        (sun_position(SunModel::kErfa, t - hour).m - sun_position(SunModel::kErfa, t + hour).m) /
        7200.0;
    const double suns_own = (earth_velocity(t).m_s - round_the_sun).norm();
    // The Sun goes round the barycentre, for Jupiter's and Saturn's sake, at 9 to 16 m/s.
    EXPECT_GT(suns_own, 5.0) << month;
    EXPECT_LT(suns_own, 20.0) << month;
  }
}

}  // namespace
}  // namespace engine
