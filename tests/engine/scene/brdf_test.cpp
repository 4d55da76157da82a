#include "engine/scene/brdf.h"

#include <array>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "engine/core/constants.h"
#include "engine/core/random.h"
#include "tests/support/csv.h"
#include "tests/support/scenes.h"
#include "tests/support/statistics.h"

namespace engine {
namespace {

using Eigen::Vector3d;
using test_support::Csv;
using test_support::Moments;
using Variant = Brdf::Variant;

FiveParameters parameters(const std::string& material) {
  return material == "silicon" ? test_support::silicon() : test_support::polyimide();
}
const std::array<std::string, 2> kMaterials{"silicon", "polyimide"};

/// One object for each surface: its tables take a third of a second.
const Brdf& brdf_of(const std::string& material, Variant variant) {
  static const std::array<Brdf, 4> all{Brdf(test_support::silicon(), Variant::kPhysical),
                                       Brdf(test_support::silicon(), Variant::kPaper),
                                       Brdf(test_support::polyimide(), Variant::kPhysical),
                                       Brdf(test_support::polyimide(), Variant::kPaper)};
  return all[(material == "silicon" ? 0U : 2U) + (variant == Variant::kPaper ? 1U : 0U)];
}

Vector3d tilted(double from_normal_deg, double azimuth_deg = 0.0) {
  const double t = from_normal_deg * kDegree;
  const double a = azimuth_deg * kDegree;
  return {std::sin(t) * std::cos(a), std::sin(t) * std::sin(a), std::cos(t)};
}

Vector3d random_direction(std::mt19937_64& random) {
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  const double z = unit(random);
  const double a = 2.0 * kPi * unit(random);
  const double r = std::sqrt(1.0 - z * z);
  return {r * std::cos(a), r * std::sin(a), z};
}

Brdf::Sample drawn(const Brdf& brdf, const Vector3d& out, Draws& draws,
                   BrdfSampler how = BrdfSampler::kMixture) {
  const float u = draws.uniform();
  const float v = draws.uniform();
  return brdf.sample(out, how, {u, v}, draws.uniform());
}

/// What one direction scatters to, or gathers from, all others by the specular term alone: over
/// half vectors h, dw = 4 (v.h) dw_h, steps fine where the lobe has its cusp.
template <class Term>
double over_half_vectors(const Vector3d& v, const Term& term) {
  constexpr int kSteps = 3000;
  constexpr int kTurns = 96;
  double sum = 0;
  for (int i = 0; i < kSteps; ++i) {
    const double low = std::pow(static_cast<double>(i) / kSteps, 4.0);
    const double high = std::pow((i + 1.0) / kSteps, 4.0);
    const double x = 0.5 * (low + high);  // 1 - cos of the angle between h and the normal
    const double sin_h = std::sqrt(x * (2.0 - x));
    for (int k = 0; k < kTurns; ++k) {
      const double azimuth = 2.0 * kPi * (k + 0.5) / kTurns;
      const Vector3d h(sin_h * std::cos(azimuth), sin_h * std::sin(azimuth), 1.0 - x);
      const double vh = v.dot(h);
      const Vector3d w = 2.0 * vh * h - v;
      if (vh <= 0.0 || w.z() <= 1e-6) continue;
      sum += term(w) * 4.0 * vh * (high - low) * 2.0 * kPi / kTurns;
    }
  }
  return sum;
}

/// The directional albedo of light that falls from `in`, integrated anew.
double integrated_albedo(const Brdf& brdf, const FiveParameters& p, Variant variant,
                         const Vector3d& in) {
  // The paper's variant scales the printed sum by a factor that depends on `in` alone.
  const double scale = variant == Variant::kPaper
                           ? brdf.eval(in, tilted(1.0)) / brdf.as_printed(in, tilted(1.0))
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
    EXPECT_NEAR(brdf.as_printed(in, out) / row.number("f_r_reading_B_swapped"), 1.0, 1e-10);
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
      return (paper.as_printed(in, out) - p.kd / in.z()) * out.z();
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
  const double ratio =
      brdf.as_printed(tilted(20), tilted(70)) / brdf.as_printed(tilted(70), tilted(20));
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

TEST(BrdfSample, DrawsWithItsDensity) {
  // The mean of 1/pdf over draws that fall into a region is the region's solid angle: for the
  // mirror's lobe, the cone round it, and the sky down to 80 deg.
  constexpr int kDraws = 200000;
  for (const std::string& material : kMaterials) {
    const Brdf& brdf = brdf_of(material, Variant::kPhysical);
    for (const double deg : {0.0, 30.0, 60.0}) {
      const Vector3d out = tilted(deg);
      const Vector3d mirror = tilted(-deg);
      std::array<Moments, 4> regions;
      const std::array<double, 3> cones_deg{1.0, 5.0, 15.0};
      for (int i = 0; i < kDraws; ++i) {
        Draws draws(7, Stream::kLight, 0, static_cast<std::uint32_t>(i));
        const Brdf::Sample s = drawn(brdf, out, draws);
        ASSERT_TRUE(s.in.allFinite() && std::isfinite(s.weight));
        ASSERT_NEAR(s.in.norm(), 1.0, 1e-9);
        const double density = brdf.pdf(s.in, out);
        const double one = density > 0.0 ? 1.0 / density : 0.0;
        for (std::size_t k = 0; k < cones_deg.size(); ++k)
          regions[k].add(mirror.dot(s.in) > std::cos(cones_deg[k] * kDegree) ? one : 0.0);
        regions[3].add(s.in.z() > std::cos(80.0 * kDegree) ? one : 0.0);
      }
      for (std::size_t k = 0; k < cones_deg.size(); ++k) {
        const double want = 2.0 * kPi * (1.0 - std::cos(cones_deg[k] * kDegree));
        EXPECT_NEAR(regions[k].mean(), want, 4.0 * regions[k].sigma_of_mean())
            << material << " " << deg << " cone " << cones_deg[k];
      }
      EXPECT_NEAR(regions[3].mean(), 2.0 * kPi * (1.0 - std::cos(80.0 * kDegree)),
                  4.0 * regions[3].sigma_of_mean())
          << material << " " << deg;
    }
  }
}

TEST(BrdfSample, DensityIntegratesToOneOrLessBelowTheHorizon) {
  for (const std::string& material : kMaterials) {
    const Brdf& brdf = brdf_of(material, Variant::kPhysical);
    for (const double deg : {0.0, 45.0, 75.0, 85.0, 89.0}) {
      const Vector3d out = tilted(deg);
      const double all =
          over_half_vectors(out, [&](const Vector3d& in) { return brdf.pdf(in, out); });
      // Steps of the density and the horizon cut through cells of the quadrature: 1 %.
      EXPECT_LE(all, 1.01) << material << " " << deg;
      EXPECT_GE(all, deg < 60.0 ? 0.99 : 0.5) << material << " " << deg;
    }
  }
}

TEST(BrdfSample, WeightsAverageToTheLightGathered) {
  // A sky of even radiance 1: what comes back along `out` is the integral of f cos_i over `in`.
  constexpr int kDraws = 200000;
  for (const std::string& material : kMaterials) {
    const FiveParameters p = parameters(material);
    for (const Variant variant : {Variant::kPhysical, Variant::kPaper}) {
      const Brdf& brdf = brdf_of(material, variant);
      for (const double deg : {0.0, 30.0, 60.0, 80.0, 87.0}) {
        const Vector3d out = tilted(deg);
        Moments weights;
        for (int i = 0; i < kDraws; ++i) {
          Draws draws(11, Stream::kLight, 0, static_cast<std::uint32_t>(i));
          const double weight = drawn(brdf, out, draws).weight;
          ASSERT_TRUE(weight >= 0.0 && std::isfinite(weight));
          weights.add(weight);
        }
        // The specular part over half vectors, the diffuse one over cosines.
        const auto diffuse = [&](double cos_in, double share) {
          return variant == Variant::kPaper ? share * p.kd / cos_in : p.kd;
        };
        const auto share = [&](const Vector3d& in) {
          return variant == Variant::kPaper ? brdf.eval(in, out) / brdf.as_printed(in, out) : 1.0;
        };
        double gathered = over_half_vectors(out, [&](const Vector3d& in) {
          return (brdf.eval(in, out) - diffuse(in.z(), share(in))) * in.z();
        });
        constexpr int kCosines = 20000;
        for (int i = 0; i < kCosines; ++i) {
          const double cos_in = (i + 0.5) / kCosines;
          const Vector3d in(std::sqrt(1.0 - cos_in * cos_in), 0.0, cos_in);
          gathered += diffuse(cos_in, share(in)) * cos_in * 2.0 * kPi / kCosines;
        }
        EXPECT_NEAR(weights.mean(), gathered, 4.0 * weights.sigma_of_mean() + 2e-4 * gathered)
            << material << " " << deg << (variant == Variant::kPaper ? " paper" : " physical");
      }
    }
  }
}

TEST(BrdfSample, LambertWeighsEveryDrawItsAlbedo) {
  const Brdf brdf(test_support::lambert(0.3), Variant::kPhysical);
  for (std::uint32_t i = 0; i < 1000; ++i) {
    Draws draws(5, Stream::kLight, 0, i);
    const Brdf::Sample s = drawn(brdf, tilted(50.0), draws);
    ASSERT_NEAR(s.weight, 0.3, 1e-12);
  }
}

TEST(BrdfSample, SurvivesEveryViewDownToTheHorizon) {
  for (const std::string& material : kMaterials) {
    for (const Variant variant : {Variant::kPhysical, Variant::kPaper}) {
      const Brdf& brdf = brdf_of(material, variant);
      for (const double deg : {0.0, 89.9, 89.9999, 89.99999, 90.0, 91.0}) {
        for (std::uint32_t i = 0; i < 2000; ++i) {
          Draws draws(13, Stream::kLight, 0, i);
          const Brdf::Sample s = drawn(brdf, tilted(deg), draws);
          ASSERT_TRUE(s.in.allFinite()) << deg;
          ASSERT_TRUE(std::isfinite(s.weight) && s.weight >= 0.0) << deg;
        }
      }
    }
  }
}

TEST(ReadMaterials, TakesEveryTableBelowMaterials) {
  const ConfigReader config = ConfigReader::from_text(
      "[brdf]\nvariant = \"paper\"\n[materials.b]\nkd = 0.1\n[materials.a]\nkd = 0.047\nkb = "
      "15.42\n"
      "ar = 0.557\nbr = -261.6\nkr = 0.717\n",
      "x.toml");
  const std::vector<Material> materials = read_materials(config);
  ASSERT_EQ(materials.size(), 2U);
  EXPECT_EQ(materials[0].name, "a");
  EXPECT_EQ(materials[1].name, "b");
  const Brdf& same = brdf_of("silicon", Variant::kPaper);
  EXPECT_EQ(materials[0].brdf().eval(tilted(20), tilted(-21)), same.eval(tilted(20), tilted(-21)));
  config.reject_unknown_keys();
}

TEST(ReadMaterials, RefusesWhatMakesLight) {
  for (const char* text : {"kd = 0.4", "kd = -0.1", "kd = 0.1\nkb = -1", "kd = 0.1\nkb = 1",
                           "kd = 0.1\nkb = 1\nar = 0.5\nbr = 1\nkr = 1"}) {
    const ConfigReader config = ConfigReader::from_text(std::string("[materials.m]\n") + text, "x");
    EXPECT_THROW(static_cast<void>(read_materials(config)), ConfigError) << text;
  }
}

constexpr std::array<BrdfSampler, 3> kUnbiased{BrdfSampler::kMixture, BrdfSampler::kCosine,
                                               BrdfSampler::kUniform};

TEST(BrdfSampler, EverySamplerButTheConeFindsTheSameAlbedo) {
  // The light gathered from an even sky, by each. Of two hundred thousand draws.
  std::vector<FiveParameters> surfaces{test_support::silicon(), test_support::polyimide()};
  for (std::size_t k = 0; k < surfaces.size(); ++k) {
    const Brdf& brdf = brdf_of(kMaterials[k], Variant::kPhysical);
    for (const double deg : {0.0, 45.0, 70.0}) {
      std::array<Moments, 3> found;
      for (std::size_t how = 0; how < kUnbiased.size(); ++how) {
        for (std::uint32_t i = 0; i < 200000; ++i) {
          Draws draws(13, Stream::kLight, how, i);
          found[how].add(drawn(brdf, tilted(deg), draws, kUnbiased[how]).weight);
        }
      }
      for (std::size_t a = 0; a < found.size(); ++a) {
        for (std::size_t b = 0; b < a; ++b) {
          const double noise = std::hypot(found[a].sigma_of_mean(), found[b].sigma_of_mean());
          EXPECT_NEAR(found[a].mean(), found[b].mean(), 3.0 * noise) << deg << " " << a << " " << b;
        }
      }
      // The mixture is worth its while.
      EXPECT_LT(found[0].variance(), found[1].variance());
      EXPECT_LT(found[0].variance(), found[2].variance());
    }
  }
}

TEST(BrdfSampler, EachDrawsWithItsDensity) {
  // 20 x 20 bins of the hemisphere (even in z and azimuth) and one below the horizon; what each
  // expects is its density's integral over it.
  constexpr int kBins = 20;
  constexpr int kFine = 24;
  constexpr std::uint32_t kDraws = 100000;
  for (const BrdfSampler how :
       {BrdfSampler::kUniform, BrdfSampler::kCosine, BrdfSampler::kPaperCone}) {
    const Brdf& brdf = brdf_of("polyimide", Variant::kPhysical);
    for (const double deg : {0.0, 40.0, 70.0}) {
      std::vector<double> expected(kBins * kBins + 1);
      double all = 0;
      for (int i = 0; i < kBins * kFine; ++i) {
        for (int j = 0; j < kBins * kFine; ++j) {
          const double z = (i + 0.5) / (kBins * kFine);
          const double a = 2.0 * kPi * (j + 0.5) / (kBins * kFine);
          const double r = std::sqrt(1.0 - z * z);
          const double share = brdf.pdf({r * std::cos(a), r * std::sin(a), z}, tilted(deg), how) *
                               2.0 * kPi / (1.0 * kBins * kFine * kBins * kFine);
          expected[static_cast<std::size_t>((i / kFine) * kBins + j / kFine)] += share * kDraws;
          all += share;
        }
      }
      // Upright, the cone is 16 of the quadrature's rows high, and its rim cuts one of them.
      EXPECT_NEAR(all, 1.0, how == BrdfSampler::kPaperCone ? 0.035 : 1e-3) << deg;
      std::vector<double> observed(kBins * kBins + 1);
      for (std::uint32_t i = 0; i < kDraws; ++i) {
        Draws draws(17, Stream::kLight, 0, i);
        const Vector3d in = drawn(brdf, tilted(deg), draws, how).in;
        const double turn = std::atan2(in.y(), in.x()) / (2.0 * kPi);
        const auto row = static_cast<std::size_t>(std::min(in.z(), 1.0 - 1e-12) * kBins);
        const auto column = static_cast<std::size_t>((turn < 0.0 ? turn + 1.0 : turn) * kBins);
        ++observed[in.z() <= 0.0 ? kBins * kBins : row * kBins + std::min<std::size_t>(column, 19)];
      }
      if (how == BrdfSampler::kPaperCone) {
        // Bins that the rim crosses are not known well enough: whole cone only.
        EXPECT_EQ(observed.back(), 0.0);
        continue;
      }
      EXPECT_GT(test_support::histogram_p(observed, expected), 1e-3) << deg;
    }
  }
}

TEST(BrdfSampler, MixtureIsChiSquaredAgainstItsDensityInTheLobesOwnCoordinates) {
  // By the half vector: 30 steps of 1 - cos that are fine at the cusp, by 8 of azimuth.
  constexpr int kSteps = 30;
  constexpr int kTurns = 8;
  constexpr int kFine = 40;
  constexpr std::uint32_t kDraws = 100000;
  const Brdf& brdf = brdf_of("silicon", Variant::kPhysical);
  const Vector3d out = tilted(30.0);
  const auto x_at = [](double i) { return std::pow(i / kSteps, 4.0); };
  std::vector<double> expected(kSteps * kTurns + 1);
  for (int i = 0; i < kSteps * kFine; ++i) {
    const double low = x_at(1.0 * i / kFine);
    const double high = x_at((i + 1.0) / kFine);
    const double x = 0.5 * (low + high);
    const double sin_h = std::sqrt(x * (2.0 - x));
    for (int j = 0; j < kTurns * kFine; ++j) {
      const double a = 2.0 * kPi * (j + 0.5) / (kTurns * kFine);
      const Vector3d h(sin_h * std::cos(a), sin_h * std::sin(a), 1.0 - x);
      const double vh = out.dot(h);
      const Vector3d in = 2.0 * vh * h - out;
      if (vh <= 0.0 || in.z() <= 1e-6) continue;
      expected[static_cast<std::size_t>((i / kFine) * kTurns + j / kFine)] +=
          kDraws * brdf.pdf(in, out) * 4.0 * vh * (high - low) * 2.0 * kPi / (kTurns * kFine);
    }
  }
  std::vector<double> observed(expected.size());
  double above = 0;
  for (std::uint32_t i = 0; i < kDraws; ++i) {
    Draws draws(19, Stream::kLight, 0, i);
    const Vector3d in = drawn(brdf, out, draws).in;
    if (in.z() <= 1e-6) continue;
    ++above;
    const Vector3d h = (in + out).normalized();
    const double x = 0.5 * (h - Vector3d::UnitZ()).squaredNorm();
    const double turn = std::atan2(h.y(), h.x()) / (2.0 * kPi);
    const auto row = std::min(static_cast<std::size_t>(std::pow(x, 0.25) * kSteps),
                              static_cast<std::size_t>(kSteps - 1));
    const auto column =
        std::min(static_cast<std::size_t>((turn < 0.0 ? turn + 1.0 : turn) * kTurns),
                 static_cast<std::size_t>(kTurns - 1));
    ++observed[row * kTurns + column];
  }
  double all = 0;
  for (const double e : expected) all += e;
  EXPECT_NEAR(above / all, 1.0, 0.005);  // steps of the density that the quadrature cuts
  for (double& e : expected) e *= above / all;
  EXPECT_GT(test_support::histogram_p(observed, expected), 1e-4);
}

TEST(PaperCone, DirectionsAreThoseOfEquation14) {
  // Along the normal the mirror direction is the axis; about it the azimuth begins anywhere.
  const Brdf& brdf = brdf_of("silicon", Variant::kPhysical);
  const Csv reference("cone_sampling_vectors.csv");
  const auto drawn_at = [&](double eps1, double eps2) {
    return brdf
        .sample({0, 0, 1}, BrdfSampler::kPaperCone,
                {static_cast<float>(eps2), static_cast<float>(eps1)}, 0.5F)
        .in;
  };
  const Vector3d zero = drawn_at(0.0, 1.0);
  const double begin = std::atan2(zero.y(), zero.x());
  for (const Csv::Row& row : reference.rows()) {
    const Vector3d in = drawn_at(row.number("eps1"), row.number("eps2"));
    const double a = std::atan2(in.y(), in.x()) - begin;
    const double r = std::hypot(in.x(), in.y());
    // The numbers are floats.
    EXPECT_NEAR(r * std::cos(a), row.number("x"), 1e-7);
    EXPECT_NEAR(r * std::sin(a), row.number("y"), 1e-7);
    EXPECT_NEAR(in.z(), row.number("z"), 1e-7);
  }
  EXPECT_NEAR(brdf.pdf({0, 0, 1}, {0, 0, 1}, BrdfSampler::kPaperCone), 4.670838, 1e-6);
}

TEST(PaperCone, LosesWhatTheReferenceSaysOfTheAlbedo) {
  const Csv reference("cone_sampling_bias.csv");
  constexpr std::uint32_t kDraws = 40000;
  for (const Csv::Row& row : reference.rows()) {
    const Brdf& brdf = brdf_of(row.text("material"), Variant::kPaper);
    const Vector3d in = tilted(row.number("theta_i_deg"));
    Moments estimate;
    double below = 0;
    for (std::uint32_t i = 0; i < kDraws; ++i) {
      Draws draws(23, Stream::kLight, 0, i);
      // From the incident side: the table's albedo is what leaves, over all directions it leaves
      // by.
      const Brdf::Sample s = drawn(brdf, in, draws, BrdfSampler::kPaperCone);
      below += s.in.z() <= 0.0 ? 1.0 : 0.0;
      estimate.add(s.density > 0.0 ? brdf.as_printed(in, s.in) * s.in.z() / s.density : 0.0);
    }
    const double want = row.number("expected_cone_estimate");
    const std::string where = row.text("material") + " " + row.text("theta_i_deg");
    // The table is printed to 1e-6, and grazing directions below 1e-6 count for nothing.
    EXPECT_NEAR(estimate.mean(), want, 4.0 * estimate.sigma_of_mean() + 1e-6) << where;
    EXPECT_NEAR(std::sqrt(estimate.variance() / 50.0) / want, row.number("rel_std_50spp"),
                0.05 * row.number("rel_std_50spp"))
        << where;
    const double horizon = row.number("fraction_below_horizon");
    EXPECT_NEAR(below / kDraws, horizon, 4.0 * std::sqrt(horizon * (1.0 - horizon) / kDraws) + 5e-5)
        << where;
  }
}

}  // namespace
}  // namespace engine
