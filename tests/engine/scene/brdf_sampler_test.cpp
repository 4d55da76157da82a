#include <array>
#include <cmath>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "engine/core/constants.h"
#include "engine/core/random.h"
#include "engine/scene/brdf.h"
#include "tests/support/csv.h"
#include "tests/support/goniometer.h"
#include "tests/support/scenes.h"
#include "tests/support/statistics.h"
#include "tests/support/surfaces.h"

namespace engine {
namespace {

using Eigen::Vector3d;
using test_support::brdf_of;
using test_support::Csv;
using test_support::drawn;
using test_support::kMaterials;
using test_support::Moments;
using test_support::over_half_vectors;
using test_support::parameters;
using test_support::tilted;
using Variant = Brdf::Variant;

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
          return variant == Variant::kPaper
                     ? brdf.eval(in, out) / brdf.five_parameters()->as_printed(in, out)
                     : 1.0;
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

/// A surface of each kind, with a name for complaints.
struct Kind {
  std::string name;
  const Brdf* brdf;
};
const std::vector<Kind>& kinds() {
  static const Brdf wrinkled(test_support::polyimide(), Variant::kPhysical, 5.0 * kDegree);
  static const Brdf table(
      TabulatedBrdf(std::make_shared<BrdfGrid>(test_support::scanned(
                        {5, 20, 40, 60, 80},
                        [](const Vector3d& in, const Vector3d& out) {
                          return brdf_of("polyimide", Variant::kPhysical).eval(in, out);
                        })),
                    true));
  static const std::vector<Kind> all{{"silicon", &brdf_of("silicon", Variant::kPhysical)},
                                     {"paper", &brdf_of("polyimide", Variant::kPaper)},
                                     {"wrinkled", &wrinkled},
                                     {"table", &table}};
  return all;
}

/// Of draws by the half vector: 30 steps of 1 - cos that are fine at the cusp, by 8 of azimuth.
double chance_of_draws(const Brdf& brdf, const Vector3d& out) {
  constexpr int kSteps = 30;
  constexpr int kTurns = 8;
  constexpr int kFineSteps = 240;  // the density has steps of its own, up to a factor of two
  constexpr int kFineTurns = 16;
  constexpr std::uint32_t kDraws = 60000;
  const auto x_at = [](double i) { return std::pow(i / kSteps, 4.0); };
  // What each bin expects is the integral of the density over it; the last is below the horizon.
  std::vector<double> expected(kSteps * kTurns + 1);
  double above = 0;
  for (int i = 0; i < kSteps * kFineSteps; ++i) {
    const double low = x_at(1.0 * i / kFineSteps);
    const double high = x_at((i + 1.0) / kFineSteps);
    const double x = 0.5 * (low + high);
    const double sin_h = std::sqrt(x * (2.0 - x));
    for (int j = 0; j < kTurns * kFineTurns; ++j) {
      const double a = 2.0 * kPi * (j + 0.5) / (kTurns * kFineTurns);
      const Vector3d h(sin_h * std::cos(a), sin_h * std::sin(a), 1.0 - x);
      const double vh = out.dot(h);
      const Vector3d in = 2.0 * vh * h - out;
      if (vh <= 0.0 || in.z() <= 1e-6) continue;
      const double share =
          brdf.pdf(in, out) * 4.0 * vh * (high - low) * 2.0 * kPi / (kTurns * kFineTurns);
      expected[static_cast<std::size_t>((i / kFineSteps) * kTurns + j / kFineTurns)] +=
          kDraws * share;
      above += share;
    }
  }
  expected.back() = kDraws * std::max(0.0, 1.0 - above);
  std::vector<double> observed(expected.size());
  for (std::uint32_t i = 0; i < kDraws; ++i) {
    Draws draws(19, Stream::kLight, 0, i);
    const Vector3d in = drawn(brdf, out, draws).in;
    if (in.z() <= 1e-6) {
      ++observed.back();
      continue;
    }
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
  return test_support::histogram_p(observed, expected);
}

TEST(BrdfSampler, MixtureIsChiSquaredAgainstItsDensityInTheLobesOwnCoordinates) {
  const std::array<double, 4> views_deg{0.0, 30.0, 60.0, 80.0};
  for (const Kind& kind : kinds())
    for (const double deg : views_deg)
      // One chance in a hundred for all sixteen together (Bonferroni).
      EXPECT_GT(chance_of_draws(*kind.brdf, tilted(deg)), 0.01 / 16.0) << kind.name << " " << deg;
}

TEST(BrdfSampler, WhiteFurnaceFindsTheAlbedoOfEveryKind) {
  // A reciprocal surface under an even sky of radiance 1 sends back its albedo along every view.
  constexpr std::uint32_t kDraws = 60000;
  for (const Kind& kind : kinds()) {
    if (kind.name == "paper") continue;  // not reciprocal
    for (const double deg : {5.0, 45.0, 70.0}) {
      for (const BrdfSampler how : kUnbiased) {
        Moments found;
        for (std::uint32_t i = 0; i < kDraws; ++i) {
          Draws draws(29, Stream::kLight, 0, i);
          found.add(drawn(*kind.brdf, tilted(deg), draws, how).weight);
        }
        const double albedo = kind.brdf->albedo(std::cos(deg * kDegree));
        // .5 %: what the albedo's table may be off.
        EXPECT_NEAR(found.mean(), albedo, 3.5 * found.sigma_of_mean() + 0.005 * albedo)
            << kind.name << " " << deg << " " << static_cast<int>(how);
      }
    }
  }
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
      estimate.add(s.density > 0.0
                       ? brdf.five_parameters()->as_printed(in, s.in) * s.in.z() / s.density
                       : 0.0);
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
