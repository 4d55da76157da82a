#include "engine/scene/star_catalogue.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include <gtest/gtest.h>

#include "engine/core/constants.h"
#include "engine/orbit/utc.h"
#include "engine/scene/star_table.h"
#include "engine/scene/star_zones.h"
#include "tests/support/temp_file.h"

namespace engine {
namespace {

using Eigen::Vector3d;
using test_support::TempFile;

constexpr double kArcsecond = kDegree / 3600.0;

StarSpec built_in(double limit = 99.0) {
  StarSpec spec;
  spec.source = StarSpec::Source::kBuiltIn;
  spec.limit_magnitude = limit;
  return spec;
}
StarSpec file(const std::string& path) {
  StarSpec spec;
  spec.source = StarSpec::Source::kFile;
  spec.path = path;
  spec.where = "x.toml:1: stars.catalogue";
  return spec;
}
Epoch years_after(double years) { return Epoch(from_seconds(years * 365.25 * 86400.0)); }

/// The brightest star within a minute of arc.
CatalogueStar brightest_near(const StarCatalogue& catalogue, const Vector3d& unit) {
  CatalogueStar best;
  best.v_magnitude = 99.0F;
  for (const CatalogueStar& star : catalogue.stars)
    if (star.unit.dot(unit) > std::cos(60.0 * kArcsecond) && star.v_magnitude < best.v_magnitude)
      best = star;
  return best;
}

struct Known {
  const char* name;
  double ra_deg;  ///< J2000
  double dec_deg;
  double v;
  double b_v;
  double motion_ra_mas_yr;
  double motion_dec_mas_yr;
};
/// Hipparcos (ESA 1997) at J2000; the place of Barnard's star by Gaia.
constexpr Known kKnown[] = {
    {"Sirius", 101.287155, -16.716116, -1.44, 0.009, -546.01, -1223.08},
    {"Vega", 279.234735, 38.783689, 0.03, -0.001, 201.02, 287.46},
    {"Polaris", 37.954561, 89.264109, 1.97, 0.636, 44.22, -11.74},
    {"Barnard", 269.4520825, 4.6933642, 9.54, 1.57, -797.84, 10326.93},
};

TEST(StarCatalogue, HasTheKnownStarsAtJ2000) {
  const StarCatalogue catalogue = read_star_catalogue(built_in(10.0), years_after(0.0));
  for (const Known& k : kKnown) {
    const Vector3d place = unit_at(k.ra_deg * kDegree, k.dec_deg * kDegree);
    const CatalogueStar star = brightest_near(catalogue, place);
    // Where Tycho-2 has no place the source is rounded to .36": at most .26" off. Tycho-2's own of
    // Barnard's star, by photographs of a century, is .31" off.
    EXPECT_LT(angle_between_rad(star.unit, place) / kArcsecond, 0.32) << k.name;
    EXPECT_NEAR(static_cast<double>(star.v_magnitude), k.v, 0.003) << k.name;
    EXPECT_NEAR(static_cast<double>(star.colour_b_v), k.b_v, 0.013) << k.name;
  }
}

TEST(StarCatalogue, ProperMotionGoesToTheEpoch) {
  constexpr double kYears = 22.0;
  const StarCatalogue then = read_star_catalogue(built_in(10.0), years_after(0.0));
  const StarCatalogue now = read_star_catalogue(built_in(10.0), years_after(kYears));
  for (const Known& k : kKnown) {
    const double ra = k.ra_deg * kDegree;
    const Vector3d at_j2000 = brightest_near(then, unit_at(ra, k.dec_deg * kDegree)).unit;
    // By adding to the angles, not along a straight line: 1e-3" apart, at the pole 20 times that.
    const double dec = k.dec_deg * kDegree + k.motion_dec_mas_yr * 1e-3 * kYears * kArcsecond;
    const double ra_then =
        ra + k.motion_ra_mas_yr * 1e-3 * kYears * kArcsecond / std::cos(k.dec_deg * kDegree);
    const Vector3d expected = unit_at(ra_then, dec);
    const CatalogueStar star = brightest_near(now, expected);
    const double moved_rad = angle_between_rad(star.unit, at_j2000);
    const double speed = std::hypot(k.motion_ra_mas_yr, k.motion_dec_mas_yr) * 1e-3;
    EXPECT_NEAR(moved_rad / kArcsecond, speed * kYears, 0.02) << k.name;
    EXPECT_LT(angle_between_rad(star.unit, expected) / kArcsecond, 0.34) << k.name;
  }
  EXPECT_NEAR(now.years, kYears, 1e-6);
  EXPECT_GT(now.median_error_rad() / kArcsecond, 0.1);
}

TEST(StarCatalogue, IsCompleteAndWholeToItsLimit) {
  const StarCatalogue catalogue = read_star_catalogue(built_in(), years_after(0.0));
  EXPECT_EQ(catalogue.stars.size(), 900537U);
  EXPECT_EQ(catalogue.without_motion, 900537U - 32U);
  EXPECT_NEAR(static_cast<double>(catalogue.without_colour), 785615.0, 0.0);
  std::size_t north = 0;
  for (const CatalogueStar& star : catalogue.stars) {
    ASSERT_NEAR(star.unit.norm(), 1.0, 1e-12);
    ASSERT_LE(star.v_magnitude, 11.003F);
    ASSERT_TRUE(std::isfinite(star.colour_b_v));
    if (star.unit.z() > 0.0) ++north;
  }
  // The southern Milky Way is richer; a hemisphere that is missing would show.
  EXPECT_NEAR(static_cast<double>(north) / 900537.0, 0.5, 0.1);
  // To V = 6.5 some 8 400 to 9 100 stars are counted (Bright Star Catalogue: 9 096).
  const StarCatalogue bright = read_star_catalogue(built_in(6.5), years_after(0.0));
  EXPECT_NEAR(static_cast<double>(bright.stars.size()), 8800.0, 500.0);
}

TEST(StarCatalogue, ATableOfTheUserIsReadWithItsEpochAndColours) {
  const TempFile table("stars.csv",
                       "# Gaia\nmag, ra_deg,dec_deg,bp_rp,pmra_mas_yr,pmdec_mas_yr,epoch\r\n"
                       "9.0,10.0,20.0,0.823,1000,-500,2016\r\n\n"
                       "8.0,359.999,-90,,,,\n"
                       "7.0,-10,+90,1e0,0,0,\n");
  StarSpec spec = file(table.path());
  const StarCatalogue catalogue = read_star_catalogue(spec, years_after(22.0));
  ASSERT_EQ(catalogue.stars.size(), 3U);
  // Six years after 2016.
  const Vector3d moved_to = unit_at((10.0 + 6.0 / 3600.0 / std::cos(20.0 * kDegree)) * kDegree,
                                    (20.0 - 3.0 / 3600.0) * kDegree);
  EXPECT_LT(angle_between_rad(catalogue.stars[0].unit, moved_to) / kArcsecond, 1e-3);
  EXPECT_NEAR(static_cast<double>(catalogue.stars[0].colour_b_v), 0.65, 1e-6);
  // The Sun's G - V is -.15 (Casagrande & VandenBerg 2018).
  EXPECT_NEAR(static_cast<double>(catalogue.stars[0].v_magnitude), 9.15, 0.02);
  EXPECT_EQ(catalogue.without_motion, 1U);
  EXPECT_EQ(catalogue.without_colour, 1U);
  EXPECT_FLOAT_EQ(catalogue.stars[1].colour_b_v, 0.61F);
  EXPECT_FLOAT_EQ(catalogue.stars[1].v_magnitude, 8.0F);
  EXPECT_NEAR(catalogue.stars[2].unit.z(), 1.0, 1e-15);
  spec.limit_magnitude = 7.5;
  EXPECT_EQ(read_star_catalogue(spec, years_after(22.0)).stars.size(), 1U);
}

/// The complaint about a table, after its name.
std::string complaint(const std::string& text) {
  try {
    (void)read_star_table(text, "s.csv");
  } catch (const ConfigError& e) {
    return e.what();
  }
  return "none";
}

TEST(StarTable, RefusesRubbishWithItsLine) {
  const std::string head = "ra_deg,dec_deg,mag\n1,2,3\n";
  EXPECT_EQ(complaint(head), "none");
  EXPECT_EQ(complaint(head + "361,0,5\n"),
            "s.csv:3: ra_deg must be a number from -180 to 360, got \"361\"");
  EXPECT_EQ(complaint(head + "\n#x\n1,90.01,5\n"),
            "s.csv:5: dec_deg must be a number from -90 to 90, got \"90.01\"");
  for (const char* bad : {"nan", "inf", "-nan", "", "5x", "0x10", "1e999", "--3", "5 5", "\xff"})
    EXPECT_EQ(complaint(head + "1,2," + bad + "\n"),
              "s.csv:3: mag must be a number from -30 to 40, got \"" + std::string(bad) + "\"");
  EXPECT_EQ(complaint(head + "1,2\n"), "s.csv:3: must have 3 values, got 2");
  EXPECT_EQ(complaint(head + "1,2,3,4\n"), "s.csv:3: must have 3 values, got 4");
  EXPECT_EQ(complaint(head + std::string(2000, '1')), "s.csv:3: is longer than 1000 characters");
}

TEST(StarTable, ChecksItsHeader) {
  EXPECT_EQ(complaint(""),
            "s.csv:1: must name the columns ra_deg,dec_deg,mag and more, got nothing");
  EXPECT_EQ(complaint("# only\n\n"),
            "s.csv:2: must name the columns ra_deg,dec_deg,mag and more, got nothing");
  EXPECT_EQ(complaint("ra_deg,dec_deg\n"), "s.csv:1: must name the column mag");
  EXPECT_EQ(complaint("ra_deg,dec_deg,mag,mag\n"), "s.csv:1: names the column \"mag\" twice");
  EXPECT_EQ(complaint("ra_deg,dec_deg,mag,b_v,bp_rp\n"),
            "s.csv:1: names two colours, b_v and bp_rp");
  EXPECT_EQ(complaint("ra_deg,dec_deg,mag,pmra_mas_yr\n"),
            "s.csv:1: must name both pmra_mas_yr and pmdec_mas_yr, or neither");
  EXPECT_TRUE(complaint("ra,dec,mag\n").ends_with("got \"ra\""));
  EXPECT_TRUE(complaint("ra_deg,dec_deg,mag,\n").ends_with("got \"\""));
  EXPECT_EQ(complaint("ra_deg,dec_deg,mag,pmra_mas_yr,pmdec_mas_yr\n1,2,3,4,\n"),
            "s.csv:2: has one half of a motion: pmra_mas_yr and pmdec_mas_yr, or neither");
}

TEST(StarTable, GaiaColoursOfTheMainSequenceGrow) {
  double last = b_v_of_gaia_colour(-1.0);
  for (double c = -0.9; c < 6.0; c += 0.1) {
    const double here = b_v_of_gaia_colour(c);
    EXPECT_GE(here, last) << c;
    last = here;
  }
}

/// A binary catalogue of one star in the last cell.
std::string small_binary(std::uint32_t star_of_motion = 0, float motion = 10.0F) {
  std::string bytes = "SLSTARS1";
  const auto put = [&](const auto& value) {
    bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
  };
  const std::size_t cells = StarZones().cells();
  put(std::uint32_t{120});
  put(std::uint32_t{240});
  put(std::uint32_t{1});
  put(std::uint32_t{1});
  put(2000.0);
  for (std::size_t i = 0; i < cells; ++i) put(std::uint32_t{i + 1 == cells ? 1U : 0U});
  put(std::uint64_t{200} << 52U | std::uint64_t{1400} << 40U);
  put(star_of_motion);
  put(motion);
  put(motion);
  return bytes;
}

TEST(StarCatalogue, AFileOfTheMakersFormIsRead) {
  const TempFile good("good.bin", small_binary());
  const StarCatalogue catalogue = read_star_catalogue(file(good.path()), years_after(0.0));
  ASSERT_EQ(catalogue.stars.size(), 1U);
  EXPECT_FLOAT_EQ(catalogue.stars[0].v_magnitude, 5.0F);
  EXPECT_FLOAT_EQ(catalogue.stars[0].colour_b_v, 4.5F);
  EXPECT_GT(catalogue.stars[0].unit.z(), 0.999);
  EXPECT_EQ(catalogue.without_motion, 0U);
}

TEST(StarCatalogue, BrokenFilesAreRefused) {
  const std::string whole = small_binary();
  const auto refused = [](const std::string& bytes) {
    const auto* begin = reinterpret_cast<const unsigned char*>(bytes.data());
    try {
      (void)decode_stars({begin, bytes.size()}, "b", StarSpec{}, Epoch{});
    } catch (const ConfigError&) {
      return true;
    }
    return false;
  };
  EXPECT_FALSE(refused(whole));
  for (const std::size_t length : {std::size_t{0}, std::size_t{7}, std::size_t{8}, std::size_t{31},
                                   std::size_t{32}, whole.size() - 1})
    EXPECT_TRUE(refused(whole.substr(0, length))) << length;
  EXPECT_TRUE(refused(whole + "x"));
  for (const std::size_t byte : {8U, 12U, 16U, 19U, 20U, 23U, 31U, 33U}) {
    std::string other = whole;
    other[byte] = '\x7f';
    EXPECT_TRUE(refused(other)) << byte;
  }
  EXPECT_TRUE(refused(small_binary(1)));
  EXPECT_TRUE(refused(small_binary(0, std::numeric_limits<float>::quiet_NaN())));
  EXPECT_THROW((void)read_star_catalogue(file("/no/such/file"), Epoch{}), ConfigError);
  EXPECT_THROW((void)read_star_catalogue(file("/"), Epoch{}), ConfigError);
}

TEST(ReadStars, NoTableMeansNoStars) {
  const ConfigReader config = ConfigReader::from_text(
      "[stars]\ncatalogue = \"built-in\"\nlimit_magnitude = 9\n[bad]\ncatalogue = \"\"", "x.toml");
  EXPECT_EQ(read_stars(config.table("none")).source, StarSpec::Source::kNone);
  EXPECT_EQ(read_stars(config.table("stars")).source, StarSpec::Source::kBuiltIn);
  EXPECT_DOUBLE_EQ(read_stars(config.table("stars")).limit_magnitude, 9.0);
  EXPECT_THROW((void)read_stars(config.table("bad")), ConfigError);
}

}  // namespace
}  // namespace engine
