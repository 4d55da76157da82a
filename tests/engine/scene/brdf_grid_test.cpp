#include "engine/scene/brdf_grid.h"

#include <cmath>
#include <string>

#include <gtest/gtest.h>

#include "engine/core/constants.h"
#include "engine/core/contract.h"
#include "engine/scene/brdf.h"
#include "tests/support/goniometer.h"
#include "tests/support/scenes.h"
#include "tests/support/temp_file.h"

namespace engine {
namespace {

using Eigen::Vector3d;
using test_support::measure;
using test_support::scanned;
using test_support::steps;
using test_support::TempFile;

const FiveParameterBrdf& polyimide() {
  static const FiveParameterBrdf brdf(test_support::polyimide(), Brdf::Variant::kPhysical, 0.0);
  return brdf;
}
double of_polyimide(const Vector3d& in, const Vector3d& out) { return polyimide().eval(in, out); }

/// Of the plane of incidence: x is forward.
Vector3d in_plane(double deg) {
  return scatter_direction(ScatterAngles::kPlanes, deg * kDegree, 0.0);
}
Vector3d from(double theta_in_deg) { return incident_direction(theta_in_deg * kDegree); }

TEST(BrdfGrid, GivesEveryReadingBackWhereItWasTaken) {
  const BrdfPoints points = scanned({10, 30, 50, 70}, of_polyimide);
  const BrdfGrid grid(points);
  for (const BrdfPoint& p : points.points) {
    const Vector3d out = scatter_direction(points.angles, p);
    if (out.z() <= 1e-3) continue;
    // Angles come back from directions to 1e-16 / cos; a step of .25 deg doubles a reading at most.
    ASSERT_NEAR(grid.at(incident_direction(p), out) / p.brdf_per_sr, 1.0, 1e-8) << p.line;
  }
}

TEST(BrdfGrid, LobeMovesWithTheMirrorBetweenIncidences) {
  const BrdfGrid grid(scanned({20, 30, 40, 50, 60}, of_polyimide));
  for (const double theta_deg : {25.0, 35.0, 45.0, 55.0}) {
    const Vector3d in = from(theta_deg);
    double brightest = 0;
    double brightest_deg = 0;
    for (double deg = theta_deg - 8; deg <= theta_deg + 8; deg += 0.05) {
      const double f = grid.at(in, in_plane(deg));
      if (f > brightest) {
        brightest = f;
        brightest_deg = deg;
      }
    }
    EXPECT_NEAR(brightest_deg, theta_deg, 0.1);
    // Between incidences 10 deg apart the peak goes with 1 / cos^2, whose logarithm the chord
    // overestimates by (10 deg)^2 / 8 of its second derivative, 2 / cos^2: 1.5 % at 45 deg, 2.3 at
    // 55; the masking and the fresnel-like term are slow.
    EXPECT_NEAR(brightest / of_polyimide(in, in_plane(theta_deg)), 1.0, 0.03) << theta_deg;
    // Interpolation at the same angles of scatter is brightest at a neighbour's mirror, 5 deg off,
    // half as bright as this, and four times too bright 5 deg aside.
    for (const double off : {-5.0, -3.0, 3.0, 5.0})
      EXPECT_NEAR(
          grid.at(in, in_plane(theta_deg + off)) / of_polyimide(in, in_plane(theta_deg + off)), 1.0,
          0.15)
          << theta_deg << " " << off;
  }
}

TEST(BrdfGrid, BeyondTheLastIncidenceTheLobeStaysAtTheMirror) {
  const BrdfGrid grid(scanned({20, 40}, of_polyimide));
  for (const double theta_deg : {5.0, 60.0, 80.0}) {
    const double at_mirror = grid.at(from(theta_deg), in_plane(theta_deg));
    const double held =
        grid.at(from(theta_deg < 20 ? 20.0 : 40.0), in_plane(theta_deg < 20 ? 20 : 40));
    EXPECT_NEAR(at_mirror / held, 1.0, 1e-9);
    // Of the same width in projection: it is hardly a third at .12 from the mirror.
    const double aside_deg = std::asin(std::sin(theta_deg * kDegree) - 0.12) / kDegree;
    EXPECT_LT(grid.at(from(theta_deg), in_plane(aside_deg)), 0.35 * at_mirror) << theta_deg;
  }
}

/// What an ordinary goniometer makes of a lobe of 8 deg: fine within the plane of incidence, and a
/// few degrees out of it.
BrdfPoints near_the_plane(const std::vector<double>& incidences_deg, double furthest_deg) {
  BrdfPoints points;
  for (const double theta : incidences_deg)
    for (const double p : steps(-86, 86, 2))
      for (const double o : steps(0, furthest_deg, 2))
        measure(points, theta, p, o, [](const Vector3d& in, const Vector3d& out) {
          const Vector3d mirror(-in.x(), -in.y(), in.z());
          const double a = std::atan2(mirror.cross(out).norm(), mirror.dot(out));
          return 0.05 + 10.0 * std::exp(-std::pow(a / (8.0 * kDegree), 2));
        });
  return points;
}

TEST(BrdfGrid, NormalLightIsScatteredAlikeAllRoundAndWithoutAJump) {
  for (const double first_deg : {0.0, 5.0}) {
    const BrdfGrid grid(near_the_plane({first_deg, 20, 40, 60, 75}, 14));
    for (const double out_deg : {0.0, 4.0, 12.0, 30.0, 70.0}) {
      const double a = out_deg / 8.0;
      const double at_normal = grid.at(Vector3d::UnitZ(), in_plane(out_deg));
      // A few percent of the lobe's flank for the grid's 2 deg. With the held edge across: .52.
      EXPECT_NEAR(at_normal / (0.05 + 10.0 * std::exp(-a * a)), 1.0, 0.06) << out_deg;
      for (const double azimuth_deg : {0.0, 50.0, 90.0, 180.0}) {
        const Vector3d out =
            scatter_direction(ScatterAngles::kPolar, out_deg * kDegree, azimuth_deg * kDegree);
        EXPECT_NEAR(grid.at(Vector3d::UnitZ(), out), at_normal, 1e-9 * at_normal);
        EXPECT_NEAR(grid.at(from(1e-6), out), at_normal, 1e-5 * at_normal) << azimuth_deg;
      }
    }
  }
}

TEST(BrdfGrid, AReadingOfZeroDoesNotChangeItsNeighbourhood) {
  // Half of the least reading, 1e-3, beside a corner of 1: geometric between them. With the values
  // themselves weighed instead it is .5.
  BrdfPoints points;
  for (const double theta : {10.0, 50.0})
    for (const double p : steps(-80, 80, 10))
      for (const double o : steps(0, 80, 10))
        measure(points, theta, p, o, [&](const auto&, const auto&) {
          if (o > 0.0) return 1.0;
          return p == 20.0 ? 0.0 : (p == -20.0 ? 2e-3 : 1.0);
        });
  const BrdfGrid grid(points);
  EXPECT_NEAR(grid.at(from(10), in_plane(20)), 1e-3, 1e-9);
  EXPECT_NEAR(grid.at(from(10), in_plane(25)), std::sqrt(1e-3), 1e-6);
}

TEST(BrdfGrid, FindsALobeThatIsNotAtTheMirror) {
  const auto back = [](const Vector3d& in, const Vector3d& out) {
    return 0.05 + 100.0 * std::exp(-(in - out).squaredNorm() / (2.0 * 0.02 * 0.02)) +
           200.0 * std::exp(-(Vector3d(-in.x(), -in.y(), in.z()) - out).squaredNorm() / 1e-3);
  };
  const BrdfGrid grid(scanned({20, 40}, back));
  ASSERT_TRUE(grid.lobe_aside(1));
  EXPECT_NEAR((*grid.lobe_aside(1) - from(40)).norm(), 0.0, 1e-12);
  EXPECT_FALSE(BrdfGrid(scanned({20, 40}, of_polyimide)).lobe_aside(1));
  // Carried to where it is interpolated from.
  const Vector3d carried = grid.carried(40 * kDegree, *grid.lobe_aside(1), 40 * kDegree);
  EXPECT_NEAR((carried - from(40)).norm(), 0.0, 1e-9);
}

TEST(BrdfGrid, TheTwoWaysToNameADirectionAgree) {
  const auto smooth = [](const Vector3d& in, const Vector3d& out) {
    return 0.1 + 0.05 * out.x() * in.z() + 0.02 * out.y() * out.y();
  };
  BrdfPoints polar;
  polar.angles = ScatterAngles::kPolar;
  for (const double theta : {0.0, 30.0, 60.0})
    for (const double out : steps(0, 90, 2))
      for (const double azimuth : steps(0, 180, 4)) measure(polar, theta, out, azimuth, smooth);
  const BrdfGrid a(polar);
  const BrdfGrid b(scanned({1e-9, 30, 60}, smooth));
  for (const double theta : {30.0, 60.0}) {
    for (const double x : {-0.7, -0.2, 0.3, 0.6}) {
      for (const double y : {-0.5, 0.1, 0.6}) {
        const Vector3d out(x, y, std::sqrt(1.0 - x * x - y * y));
        // Bilinear over 5 deg of a function whose second derivative is .1 at most: 1e-4.
        EXPECT_NEAR(a.at(from(theta), out), smooth(from(theta), out), 1.5e-4);
        EXPECT_NEAR(b.at(from(theta), out), smooth(from(theta), out), 1.5e-4);
      }
    }
  }
}

TEST(BrdfGrid, FrameOfTheSurfaceDoesNotMatter) {
  const BrdfGrid grid(scanned({20, 40, 60}, of_polyimide));
  const Vector3d in = from(33.0);
  const Vector3d out = scatter_direction(ScatterAngles::kPlanes, 30 * kDegree, 4 * kDegree);
  const double want = grid.at(in, out);
  for (const double turn : {0.3, 1.7, 3.0, 5.5}) {
    const Eigen::AngleAxisd about(turn, Vector3d::UnitZ());
    EXPECT_NEAR(grid.at(about * in, about * out), want, 1e-10 * want);
  }
  EXPECT_NEAR(grid.at(in, Vector3d(out.x(), -out.y(), out.z())), want, 1e-12 * want);
}

TEST(BrdfGrid, CoverageIsTheShareOfProjectedSolidAngle) {
  BrdfPoints points;
  for (const double theta : {10.0, 50.0})
    for (const double p : steps(-60, 60, 10))
      for (const double o : steps(0, 30, 10))
        measure(points, theta, p, o, [](const auto&, const auto&) { return 0.1; });
  // Integral of cos(o)^2 cos(p) over the grid, over pi.
  const double want =
      2.0 * std::sin(60 * kDegree) * (30 * kDegree + 0.5 * std::sin(60 * kDegree)) / kPi;
  EXPECT_NEAR(BrdfGrid(points).coverage(1), want, 0.01);
}

TEST(BrdfGrid, ReadingsOnBothSidesAreAveragedAndTheirDifferenceIsKnown) {
  BrdfPoints points;
  for (const double theta : {10.0, 50.0})
    for (const double p : steps(-60, 60, 10))
      for (const double o : steps(-30, 30, 10))
        measure(points, theta, p, o, [](const auto&, const Vector3d& out) {
          return out.y() > 1e-9 ? 0.12 : (out.y() < -1e-9 ? 0.08 : 0.1);
        });
  const BrdfGrid grid(points);
  EXPECT_NEAR(grid.at(from(30), scatter_direction(ScatterAngles::kPlanes, 0.1, 0.2)), 0.1, 1e-12);
  EXPECT_NEAR(grid.left_right_rms(), 0.2, 1e-12);
}

/// What is said about a file with these rows; without its name.
std::string complaint(const std::string& rows, bool polar = false) {
  const TempFile file("foil.csv",
                      (polar ? "theta_in_deg,theta_out_deg,azimuth_deg,brdf_per_sr\n"
                             : "theta_in_deg,in_plane_deg,out_of_plane_deg,brdf_per_sr\n") +
                          rows);
  try {
    const BrdfGrid grid(read_brdf_points(file.path()));
  } catch (const ConfigError& e) {
    const std::string text = e.what();
    EXPECT_EQ(text.substr(0, file.path().size()), file.path());
    return text.substr(file.path().size());
  }
  return "";
}

TEST(BrdfPoints, SayWhichLineIsWrong) {
  EXPECT_EQ(complaint("10,0,0,-0.1\n"), ":2: brdf_per_sr must be >= 0 and <= 1000000000, got -0.1");
  EXPECT_EQ(complaint("90,0,0,0.1\n"), ":2: theta_in_deg must be >= 0 and < 90, got 90");
  EXPECT_EQ(complaint("10,91,0,0.1\n"), ":2: in_plane_deg must be >= -90 and <= 90, got 91");
  EXPECT_EQ(complaint("10,0,-91,0.1\n"), ":2: out_of_plane_deg must be >= -90 and <= 90, got -91");
  EXPECT_EQ(complaint("10,-5,0,0.1\n", true), ":2: theta_out_deg must be >= 0 and <= 90, got -5");
  EXPECT_EQ(complaint("10,5,361,0.1\n", true),
            ":2: azimuth_deg must be >= -180 and <= 360, got 361");
  for (const char* row :
       {"10,0,0,nan\n", "10,0,0,1e999\n", "10,0,0\n", "10,0,0,0.1,2\n", "a,0,0,1\n"})
    EXPECT_EQ(complaint(row).substr(0, 40), ":2: must be 4 finite numbers with commas") << row;
  EXPECT_NE(complaint("10,0,0,0.1\n\xff\xfe\n").find(":3:"), std::string::npos);
  EXPECT_EQ(complaint(""), ": expected measured points, found none");
}

TEST(BrdfPoints, NeedOneOfTheirLists) {
  const TempFile file("foil.csv", "theta_in_deg,in_plane_deg,brdf_per_sr\n10,0,0.1\n");
  try {
    static_cast<void>(read_brdf_points(file.path()));
    FAIL();
  } catch (const ConfigError& e) {
    EXPECT_NE(std::string(e.what()).find("foil.csv:1: must name the columns \"theta_in_deg,"),
              std::string::npos)
        << e.what();
  }
  EXPECT_THROW(static_cast<void>(read_brdf_points("/nowhere/foil.csv")), ConfigError);
  const TempFile bad("foil.csv",
                     "theta_in_deg,in_plane_deg,out_of_plane_deg,brdf_per_sr,sigma_per_sr\n"
                     "10,0,0,0.1,0\n");
  EXPECT_THROW(static_cast<void>(read_brdf_points(bad.path())), ConfigError);
}

TEST(BrdfGrid, SaysWhatIsMissingOfAGrid) {
  const std::string scan10 = "10,0,0,1\n10,0,10,1\n10,20,0,1\n10,20,10,1\n";
  const std::string scan30 = "30,0,0,1\n30,0,10,1\n30,20,0,1\n30,20,10,1\n";
  EXPECT_EQ(complaint(scan10 + scan30), "");
  EXPECT_EQ(complaint(scan10),
            ":2: has the one theta_in_deg of the table: two are needed to know how the lobe moves");
  EXPECT_EQ(complaint(scan10 + "30,0,0,1\n30,0,10,1\n30,20,0,1\n"),
            ":8: is in a row with a hole: at theta_in_deg 30 there is no point at in_plane_deg 20, "
            "out_of_plane_deg 10");
  EXPECT_EQ(complaint(scan10 + scan30 + "30,20,10,2\n"), ":10: has the angles of line 9");
  EXPECT_EQ(complaint(scan10 + "30,0,0,1\n30,20,0,1\n"),
            ":6: at theta_in_deg 30 is one out_of_plane_deg alone: cuts do not make a surface "
            "(starloop fit-brdf takes them)");
  EXPECT_EQ(complaint(scan10 + "30,0,0,1\n30,0,10,1\n"),
            ":6: at theta_in_deg 30 is one in_plane_deg alone: a grid has two at least");
  EXPECT_EQ(complaint("10,0,0,0\n10,0,10,0\n10,20,0,0\n10,20,10,0\n"
                      "30,0,0,0\n30,0,10,0\n30,20,0,0\n30,20,10,0\n"),
            ":2: and all others have no light: brdf_per_sr is 0");
}

TEST(BrdfGrid, NormalAndNormalLightNeedNoAzimuths) {
  // One reading along the normal of each incidence; one azimuth of normal light; a full turn.
  EXPECT_EQ(complaint("0,0,0,1\n0,40,0,2\n30,0,0,1\n30,40,0,1\n30,40,90,1\n30,40,180,1\n"
                      "30,40,270,1\n30,40,360,1\n",
                      true),
            "");
}

}  // namespace
}  // namespace engine
