#include "engine/scene/brdf_check.h"

#include <cmath>
#include <memory>
#include <string>

#include <gtest/gtest.h>

#include "engine/core/constants.h"
#include "tests/support/goniometer.h"
#include "tests/support/surfaces.h"

namespace engine {
namespace {

using Eigen::Vector3d;
using test_support::brdf_of;
using test_support::measure;
using test_support::scanned;
using test_support::steps;
using Variant = Brdf::Variant;

Brdf table_of(const BrdfPoints& points, bool reciprocal = true) {
  return Brdf(TabulatedBrdf(std::make_shared<BrdfGrid>(points), reciprocal));
}

TEST(BrdfCheck, FindsWhereThePrintedModelMakesLight) {
  // brdf_rho.csv: silicon .853 at 80 deg and above 1 at 82, polyimide at 73.
  const BrdfCheck silicon = check_brdf(brdf_of("silicon", Variant::kPaper));
  EXPECT_NEAR(silicon.makes_light_from_deg, 81.5, 0.6);
  EXPECT_EQ(silicon.limited_from_deg, silicon.makes_light_from_deg);
  const BrdfCheck polyimide = check_brdf(brdf_of("polyimide", Variant::kPaper));
  EXPECT_NEAR(polyimide.makes_light_from_deg, 72.5, 0.6);
  EXPECT_NEAR(polyimide.most_taken, 1.0 - 1.0 / polyimide.largest_albedo, 1e-6);
  // A constant kd makes light later than kd/cos_i does.
  const BrdfCheck physical = check_brdf(brdf_of("polyimide", Variant::kPhysical));
  EXPECT_EQ(physical.makes_light_from_deg, polyimide.makes_light_from_deg);
  EXPECT_GT(physical.limited_from_deg, polyimide.limited_from_deg + 3.0);
}

TEST(BrdfCheck, FindsTheLobeAtTheMirror) {
  for (const char* material : {"silicon", "polyimide"})
    for (const Variant variant : {Variant::kPhysical, Variant::kPaper})
      EXPECT_GT(check_brdf(brdf_of(material, variant)).at_mirror, 0.97) << material;
  // One that wrinkles have made wide is still about the mirror.
  const Brdf wide(test_support::polyimide(), Variant::kPhysical, 15.0 * kDegree);
  const BrdfCheck check = check_brdf(wide);
  EXPECT_LT(check.at_mirror, 0.5);
  EXPECT_EQ(brdf_note("foil", check).find("mirror"), std::string::npos);
}

TEST(BrdfCheck, FindsALobeThatLooksBackAtItsSource) {
  // What eq 7 is with alpha and gamma as printed.
  const Brdf back = table_of(scanned({10, 30, 50, 70}, [](const Vector3d& in, const Vector3d& out) {
    return 0.05 + 3.0 * std::exp(-(in - out).squaredNorm() / 0.02);
  }));
  const BrdfCheck check = check_brdf(back);
  EXPECT_LT(check.at_mirror, 0.01);
  EXPECT_NEAR(check.middle_off_mirror_deg, 90.0, 2.0);
  EXPECT_NE(brdf_note("foil", check).find("its lobe is not at the mirror"), std::string::npos);
}

TEST(BrdfCheck, FindsTheShareOfANarrowLobeThatLooksBack) {
  // A degree and a half wide and next to a lobe of 6 deg at the mirror with 16/3 of its light: of
  // all 3/19 are back, and of the rest exp(-(15/6)^2/2) is beyond 15 deg.
  const Brdf two = table_of(scanned({45, 60}, [](const Vector3d& in, const Vector3d& out) {
    const Vector3d mirror(-in.x(), -in.y(), in.z());
    const double s2 = 2.0 * std::pow(1.5 * kDegree, 2);
    return 0.05 + std::exp(-(mirror - out).squaredNorm() / (16.0 * s2)) +
           3.0 * std::exp(-(in - out).squaredNorm() / s2);
  }));
  const BrdfCheck check = check_brdf(two);
  EXPECT_NEAR(check.at_mirror, 16.0 / 19.0 * (1.0 - std::exp(-3.125)), 0.03);
  EXPECT_EQ(check.aside_at_deg, 45.0);
  EXPECT_NEAR(check.aside_off_mirror_deg, 90.0, 1e-6);
  EXPECT_NE(brdf_note("tape", check)
                .find("its brightest reading at 45 deg of incidence is 90 deg off the mirror"),
            std::string::npos)
      << brdf_note("tape", check);
}

TEST(BrdfCheck, PhysicalIsReciprocalAndPrintedIsNot) {
  const BrdfCheck physical = check_brdf(brdf_of("silicon", Variant::kPhysical));
  EXPECT_LT(physical.one_way_rms, 1e-12);
  EXPECT_GT(physical.one_way_before_rms, 0.2);
  EXPECT_GT(check_brdf(brdf_of("silicon", Variant::kPaper)).one_way_rms, 0.2);
}

TEST(BrdfCheck, SaysNothingOfALambertSurface) {
  const BrdfCheck check = check_brdf(Brdf(test_support::lambert(0.3), Variant::kPhysical));
  EXPECT_TRUE(std::isnan(check.at_mirror));
  EXPECT_EQ(brdf_note("white", check), "");
}

TEST(BrdfCheck, SaysWhatATableLacks) {
  BrdfPoints points;
  for (const double theta : {10.0, 50.0})
    for (const double p : steps(-60, 60, 10))
      for (const double o : steps(0, 30, 10))
        measure(points, theta, p, o, [](const Vector3d& in, const auto&) { return 0.1 / in.z(); });
  const BrdfCheck check = check_brdf(table_of(points));
  EXPECT_EQ(check.first_in_deg, 10.0);
  EXPECT_EQ(check.last_in_deg, 50.0);
  EXPECT_NEAR(check.widest_step_deg, 40.0, 1e-9);
  EXPECT_LT(check.one_way_rms, 1e-12);
  const std::string note = brdf_note("foil", check);
  EXPECT_NE(note.find("material foil: "), std::string::npos) << note;
  EXPECT_NE(note.find("measured over 53 % of the hemisphere, the edge held beyond"),
            std::string::npos)
      << note;
  EXPECT_NE(note.find("40 deg between two incidences"), std::string::npos) << note;
}

}  // namespace
}  // namespace engine
