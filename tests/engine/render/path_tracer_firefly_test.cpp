#include <algorithm>
#include <cmath>
#include <numeric>

#include <gtest/gtest.h>

#include "tests/support/noisy_corner.h"
#include "tests/support/path_tracing.h"
#include "tests/support/statistics.h"

namespace engine {
namespace {

using test_support::add_plate;
using test_support::converged;
using test_support::Corner;
using test_support::kSun_w_m2;
using test_support::Moments;
using test_support::sum_of;
using test_support::toward;
using test_support::true_errors;

/// The corner of narrow lobes: the wall mirrors the Sun on the floor.
struct GlossyCorner : Corner {
  GlossyCorner() {
    Mesh mesh;
    add_plate(mesh, "floor", {0, -3, 0}, {4, 0, 0}, {0, 6, 0});
    add_plate(mesh, "wall", {0, -3, 0}, {0, 6, 0}, {0, 0, 3});
    target = std::make_shared<TracedTarget>(
        mesh, std::vector<Material>{{"floor", test_support::polyimide()},
                                    {"wall", test_support::silicon()}});
    snapshot.sun = {toward({0.6, 0.3, 1}), kSun_w_m2};
  }
};

/// What a hundred seeds at so many samples a pixel as a scenario has by default come to.
struct Fireflies {
  double mean_over_truth = 0;
  double sigma_of_mean = 0;  ///< as a share
  double worst = 0;          ///< of pixels' true errors
  int beyond = 0;            ///< pixels with true errors of five sigmas and more
  int counted = 0;
  int not_noticed = 0;  ///< images with an error of twice that, and nothing counted
};

Fireflies fireflies_in(const GlossyCorner& corner, const std::vector<double>& truth) {
  WorkerPool pool(2);
  PathTracer tracer(corner.spec, corner.target, pool);
  Snapshot snapshot = corner.snapshot;
  Fireflies seen;
  Moments light_sum;
  for (snapshot.seed = 1; snapshot.seed <= 100; ++snapshot.seed) {
    Radiance light;
    const RenderReport report = tracer.render(snapshot, {}, light);
    light_sum.add(sum_of(light));
    double worst = 0;
    for (const double error : true_errors(light, truth)) {
      worst = std::max(worst, std::abs(error));
      if (std::abs(error) >= NoiseReached::kFirefly) ++seen.beyond;
    }
    seen.worst = std::max(seen.worst, worst);
    seen.counted += report.rho_mc.firefly_px;
    if (worst > 2.0 * NoiseReached::kFirefly && report.rho_mc.firefly_px == 0) ++seen.not_noticed;
  }
  const double all = std::reduce(truth.begin(), truth.end());
  seen.mean_over_truth = light_sum.mean() / all;
  seen.sigma_of_mean = light_sum.sigma_of_mean() / all;
  return seen;
}

TEST(PathTracerNoise, GlossyCornerHasNoFireflies) {
  const GlossyCorner corner;
  // The reference finds light in another way: evenly by the cosine, from every sample.
  RenderSpec other = corner.spec;
  other.sampler = BrdfSampler::kCosine;
  other.bounce_share = 1.0;
  const std::vector<double> truth = converged(other, corner.target, corner.snapshot, 8, 2304);
  const Fireflies seen = fireflies_in(corner, truth);
  EXPECT_NEAR(seen.mean_over_truth, 1.0, 0.01);
  EXPECT_LT(seen.sigma_of_mean, 0.001);
  EXPECT_LT(seen.worst, NoiseReached::kFirefly);
  EXPECT_EQ(seen.counted, 0);
}

TEST(PathTracerNoise, FirefliesOfExactCausticsAreCountedAndAddNoBias) {
  GlossyCorner corner;
  corner.spec.exact_caustics = true;
  corner.spec.sun_disc = SunDisc::kOn;
  RenderSpec fine = corner.spec;
  fine.bounce_share = 1.0;
  const std::vector<double> truth = converged(fine, corner.target, corner.snapshot, 8, 4608);
  const Fireflies seen = fireflies_in(corner, truth);
  EXPECT_NEAR(seen.mean_over_truth, 1.0, 0.01);
  EXPECT_LT(seen.sigma_of_mean, 0.0025);
  EXPECT_GT(seen.beyond, 100);  // there are some
  EXPECT_EQ(seen.not_noticed, 0);
  // Of an image's two replicates one has what stands out, and its size is known from the other.
  EXPECT_GT(seen.counted, seen.beyond / 2);
  EXPECT_LT(seen.counted, seen.beyond * 2);
}

}  // namespace
}  // namespace engine
