#include "engine/scene/brdf.h"

#include <array>
#include <cmath>
#include <random>
#include <string>

#include <gtest/gtest.h>

#include "engine/core/constants.h"
#include "tests/support/csv.h"
#include "tests/support/scenes.h"
#include "tests/support/surfaces.h"

namespace engine {
namespace {

using Eigen::Vector3d;
using test_support::brdf_of;
using test_support::Csv;
using test_support::kMaterials;
using test_support::over_half_vectors;
using test_support::parameters;
using test_support::random_direction;
using test_support::tilted;
using Variant = Brdf::Variant;

/// The directional albedo of light that falls from `in`, integrated anew.
double integrated_albedo(const Brdf& brdf, const FiveParameters& p, Variant variant,
                         const Vector3d& in) {
  // The paper's variant scales the printed sum by a factor that depends on `in` alone.
  const double scale =
      variant == Variant::kPaper
          ? brdf.eval(in, tilted(1.0)) / brdf.five_parameters()->as_printed(in, tilted(1.0))
          : 1;
  const double diffuse = variant == Variant::kPaper ? scale * p.kd / in.z() : p.kd;
  return kPi * diffuse + over_half_vectors(in, [&](const Vector3d& out) {
           return (brdf.eval(in, out) - diffuse) * out.z();
         });
}

TEST(Brdf, AsPrintedIsReadingBOfTheReference) {
  const Csv reference("brdf_test_vectors.csv");
  for (const Csv::Row& row : reference.rows()) {
    const Brdf& brdf = brdf_of(row.text("material"), Variant::kPaper);
    const Vector3d in(row.number("ix"), row.number("iy"), row.number("iz"));
    const Vector3d out(row.number("rx"), row.number("ry"), row.number("rz"));
    // Inputs are printed to 1e-15. The steepest term is 1/cos_i at .08, then the lobe: its exponent
    // is 260 at most and follows the angle between n and h, .001 rad at least, to 1e-12.
    EXPECT_NEAR(brdf.five_parameters()->as_printed(in, out) / row.number("f_r_reading_B_swapped"),
                1.0, 1e-10);
  }
}

TEST(Brdf, AlbedosAreThoseOfTheReference) {
  const Csv reference("brdf_rho.csv");
  int compared = 0;
  for (const Csv::Row& row : reference.rows()) {
    ASSERT_EQ(row.text("reading"), "B");
    const FiveParameters p = parameters(row.text("material"));
    const double theta_deg = row.number("theta_i_deg");
    const Vector3d in = tilted(theta_deg);
    const Brdf& paper = brdf_of(row.text("material"), Variant::kPaper);
    const double specular_integrated = over_half_vectors(in, [&](const Vector3d& out) {
      return (paper.five_parameters()->as_printed(in, out) - p.kd / in.z()) * out.z();
    });
    const double specular = row.number("rho_spec_Gvcavity");
    // The test's own quadrature: 3000 x 96 points, third-order.
    EXPECT_NEAR(specular_integrated / specular, 1.0, 1e-4) << theta_deg;
    const double total = row.number("rho_total_Gvcavity");
    // The model's limit for a bias of the flux is .5 %.
    EXPECT_NEAR(paper.albedo(in.z()), std::min(1.0, total), 0.005 * std::min(1.0, total))
        << row.text("material") << " " << theta_deg;
    const Brdf& physical = brdf_of(row.text("material"), Variant::kPhysical);
    const double limited = std::min(1.0, kPi * p.kd + specular);
    EXPECT_NEAR(physical.albedo(in.z()), limited, 0.005 * limited)
        << row.text("material") << " " << theta_deg;
    ++compared;
  }
  EXPECT_EQ(compared, 36);
}

TEST(Brdf, PhysicalVariantIsReciprocal) {
  std::mt19937_64 random(3);
  for (const std::string& material : kMaterials) {
    const Brdf& brdf = brdf_of(material, Variant::kPhysical);
    for (int i = 0; i < 20000; ++i) {
      const Vector3d a = random_direction(random);
      // Half of them in the lobe, a degree wide.
      Vector3d b = random_direction(random);
      if (i % 2 == 0) b = (Vector3d(-a.x(), -a.y(), a.z()) + 0.02 * b).normalized();
      const double ab = brdf.eval(a, b);
      const double ba = brdf.eval(b, a);
      // i.h and o.h are one number, worked out twice: where both graze, h is the small sum of two
      // long vectors, and 1e-16 of them is divided by i.h twice.
      const double ih = std::sqrt(std::max(0.0, 0.5 * (1.0 + a.dot(b))));
      ASSERT_NEAR(ab, ba, (1e-12 + 1e-15 / (ih * ih)) * ab)
          << a.transpose() << " " << b.transpose();
    }
  }
}

TEST(Brdf, PaperVariantIsNotReciprocalAsPrinted) {
  // kd/cos_i favours light that grazes: f(20, 70)/f(70, 20) = .364 where the lobe is far away.
  const Brdf& brdf = brdf_of("silicon", Variant::kPaper);
  const double ratio = brdf.five_parameters()->as_printed(tilted(20), tilted(70)) /
                       brdf.five_parameters()->as_printed(tilted(70), tilted(20));
  EXPECT_NEAR(ratio, 0.364, 0.0005);
}

TEST(Brdf, NeverSendsBackMoreThanCameIn) {
  for (const std::string& material : kMaterials) {
    const FiveParameters p = parameters(material);
    for (const Variant variant : {Variant::kPhysical, Variant::kPaper}) {
      const Brdf& brdf = brdf_of(material, variant);
      for (const double deg :
           {0.0,  30.0, 60.0, 70.0, 73.0, 76.0, 78.0, 80.0, 81.5, 82.0, 83.0, 84.0,
            85.0, 86.0, 87.0, 88.0, 88.5, 89.0, 89.3, 89.5, 89.7, 89.8, 89.9}) {
        const double albedo = integrated_albedo(brdf, p, variant, tilted(deg));
        // The .5 % that the albedo's table may be off.
        EXPECT_LE(albedo, 1.005) << material << " " << deg << (variant == Variant::kPaper);
        EXPECT_GE(albedo, 0.0);
        EXPECT_LE(brdf.albedo(std::cos(deg * kDegree)), 1.0 + 1e-6);
      }
    }
  }
}

TEST(Brdf, PhysicalDiffuseTermIsLamberts) {
  for (const std::string& material : kMaterials) {
    const FiveParameters p = parameters(material);
    const Brdf& brdf = brdf_of(material, Variant::kPhysical);
    // Across the mirror's side the lobe is gone, below 1e-9.
    EXPECT_NEAR(brdf.eval(tilted(60), tilted(60)), p.kd, 1e-6 * p.kd);
  }
  const Brdf lambert(test_support::lambert(0.3), Variant::kPhysical);
  EXPECT_DOUBLE_EQ(lambert.eval(tilted(10), tilted(80, 30)), 0.3 / kPi);
  EXPECT_DOUBLE_EQ(lambert.albedo(0.5), 0.3);
}

TEST(Brdf, SpecularLightLeavesWithinFifteenDegreesOfTheMirror) {
  // The paper's own words; with alpha and gamma as printed it is next to nothing.
  for (const std::string& material : kMaterials) {
    const FiveParameters p = parameters(material);
    const Brdf& brdf = brdf_of(material, Variant::kPhysical);
    const Vector3d in = tilted(45.0);
    const Vector3d mirror = tilted(-45.0);
    const double all = over_half_vectors(
        in, [&](const Vector3d& out) { return (brdf.eval(in, out) - p.kd) * out.z(); });
    const double inside = over_half_vectors(in, [&](const Vector3d& out) {
      return mirror.dot(out) > std::cos(15.0 * kDegree) ? (brdf.eval(in, out) - p.kd) * out.z()
                                                        : 0.0;
    });
    EXPECT_GT(inside / all, 0.97) << material;
  }
}

TEST(Brdf, LobeHasItsGoldenHalfWidth) {
  // Three digits are printed; the lobe is searched in steps of 1e-4 rad, .006 deg.
  EXPECT_NEAR(brdf_of("silicon", Variant::kPhysical).lobe_half_width_rad() / kDegree, 0.394,
              0.0065);
  EXPECT_NEAR(brdf_of("polyimide", Variant::kPhysical).lobe_half_width_rad() / kDegree, 0.729,
              0.0065);
  const Brdf lambert(test_support::lambert(0.3), Variant::kPhysical);
  EXPECT_EQ(lambert.lobe_half_width_rad(), 0.0);
}

TEST(Brdf, WrinklesSpreadTheLobeAndKeepItsEnergy) {
  const FiveParameters p = test_support::polyimide();
  const Brdf& flat = brdf_of("polyimide", Variant::kPhysical);
  const Brdf wrinkled(p, Variant::kPhysical, 3.0 * kDegree);
  EXPECT_GT(wrinkled.lobe_half_width_rad(), 3.0 * kDegree);
  EXPECT_LT(wrinkled.eval(tilted(20), tilted(-20)), 0.2 * flat.eval(tilted(20), tilted(-20)));
  // The rest of the model changes slowly over a few degrees: second order in the wrinkles, 1 %.
  for (const double deg : {0.0, 20.0, 40.0}) {
    const double before = flat.albedo(std::cos(deg * kDegree));
    EXPECT_NEAR(wrinkled.albedo(std::cos(deg * kDegree)) / before, 1.0, 0.01) << deg;
  }
  for (const double deg : {0.0, 60.0, 85.0, 89.0, 89.9}) {
    EXPECT_LE(integrated_albedo(wrinkled, p, Variant::kPhysical, tilted(deg)), 1.005) << deg;
    const Vector3d out = tilted(deg - 5.0, 170.0);
    const double forth = wrinkled.eval(tilted(deg), out);
    EXPECT_NEAR(forth, wrinkled.eval(out, tilted(deg)), 1e-10 * forth);
  }
}

TEST(Brdf, IsFiniteAndNotNegativeAtGrazing) {
  const std::array<double, 9> hard{0.0, 1e-6, 45.0, 89.9, 89.9999, 89.999999, 90.0, 90.1, 180.0};
  for (const std::string& material : kMaterials) {
    for (const Variant variant : {Variant::kPhysical, Variant::kPaper}) {
      const Brdf& brdf = brdf_of(material, variant);
      for (const double a : hard) {
        for (const double b : hard) {
          for (const double azimuth : {0.0, 90.0, 180.0}) {
            const Vector3d in = tilted(a);
            const Vector3d out = tilted(b, azimuth);
            const double f = brdf.eval(in, out);
            ASSERT_TRUE(std::isfinite(f)) << a << " " << b;
            ASSERT_GE(f, 0.0) << a << " " << b;
            const double density = brdf.pdf(in, out);
            ASSERT_TRUE(std::isfinite(density)) << a << " " << b;
            ASSERT_GE(density, 0.0);
            if (a >= 90.0 || b >= 90.0) {
              EXPECT_EQ(f, 0.0) << a << " " << b;
            }
          }
        }
        ASSERT_TRUE(std::isfinite(brdf.albedo(std::cos(a * kDegree))));
      }
    }
  }
}

TEST(Brdf, EveryDirectionLightCanComeFromCanBeDrawn) {
  std::mt19937_64 random(4);
  for (const std::string& material : kMaterials) {
    for (const Variant variant : {Variant::kPhysical, Variant::kPaper}) {
      const Brdf& brdf = brdf_of(material, variant);
      for (int i = 0; i < 20000; ++i) {
        const Vector3d in = random_direction(random);
        const Vector3d out = random_direction(random);
        if (brdf.eval(in, out) > 0.0) {
          ASSERT_GT(brdf.pdf(in, out), 0.0);
        }
      }
    }
  }
}

}  // namespace
}  // namespace engine
