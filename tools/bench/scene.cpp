// Light, surfaces, background and stars: what stands about the target.
#include <benchmark/benchmark.h>

#include "engine/core/random.h"
#include "engine/render/renderer.h"
#include "engine/scene/brdf.h"
#include "engine/scene/earth_light.h"
#include "engine/scene/star_catalogue.h"
#include "engine/scene/star_field.h"

namespace {

using namespace engine;

/// 420 km up, the Sun 10 deg above the horizon there.
EarthDisc<BodyFrame> earth_of_bench(bool map) {
  EarthDisc<BodyFrame> disc;
  disc.to_sun = direction_of<BodyFrame>({1.0, 0.0, -0.18});
  disc.distance_radii = 1.066;
  disc.sun_irradiance_w_m2 = 1.0;
  disc.north = direction_of<BodyFrame>({0.0, 1.0, 0.0});
  disc.albedo_by_place = map;
  return disc;
}

void bench_earth_light(benchmark::State& state) {
  const EarthDisc<BodyFrame> disc = earth_of_bench(state.range(0) == 1);
  for (auto _ : state) benchmark::DoNotOptimize(EarthLight(disc));
}
BENCHMARK(bench_earth_light)->ArgName("even_map")->DenseRange(0, 1, 1);

void bench_earth_light_sample(benchmark::State& state) {
  const EarthLight light(earth_of_bench(state.range(0) == 1));
  double u = 0;
  for (auto _ : state) {
    u += 0.618033988749895;
    u -= u >= 1.0 ? 1.0 : 0.0;
    benchmark::DoNotOptimize(light.sample(u, 1.0 - u));
  }
}
BENCHMARK(bench_earth_light_sample)->ArgName("even_map")->DenseRange(0, 1, 1);

void bench_earth_light_radiance(benchmark::State& state) {
  const EarthLight light(earth_of_bench(state.range(0) == 1));
  Eigen::Vector3d direction(0.3, 0.2, 0.93);
  for (auto _ : state) {
    benchmark::DoNotOptimize(direction);
    benchmark::DoNotOptimize(light.radiance_w_m2_sr(direction));
  }
}
BENCHMARK(bench_earth_light_radiance)->ArgName("even_map")->DenseRange(0, 1, 1);

/// Drawing the Earth and adding it to 1024 x 1024 px: none in view, all of the frame, its limb.
void bench_earth_background(benchmark::State& state) {
  CameraGeometry camera;
  EarthBackground background;
  background.reserve(camera, 64);
  EarthInFrame earth;
  earth.disc.distance_radii = 1.08;
  const double limb = std::asin(1.0 / earth.disc.distance_radii);
  const double off = state.range(0) == 0 ? limb + 0.5 : state.range(0) == 1 ? limb - 0.2 : limb;
  earth.disc.to_centre.unit = {0.0, std::sin(off), std::cos(off)};
  earth.disc.to_sun = direction_of<CameraFrame>({1.0, -0.3, -0.3});
  earth.disc.sun_irradiance_w_m2 = 633.0;
  earth.disc.north = direction_of<CameraFrame>({1.0, 0.0, 0.0});
  earth.disc.greenwich = direction_of<CameraFrame>({0.0, 1.0, 0.0});
  earth.disc.albedo_by_place = state.range(1) == 1;
  IrradianceImage image(1024, 1024);
  for (auto _ : state) {
    background.draw(earth, 5e-7);
    if (!background.empty())
      for (int v = 0; v < 1024; ++v) background.add_row(v, 0, 1.0F, image.row(v));
    benchmark::ClobberMemory();
  }
}
BENCHMARK(bench_earth_background)
    ->ArgNames({"none_full_limb", "even_map"})
    ->ArgsProduct({{0, 1, 2}, {0, 1}})
    ->Unit(benchmark::kMicrosecond);

void bench_brdf_eval(benchmark::State& state) {
  const Brdf brdf({}, state.range(0) == 0 ? Brdf::Variant::kPhysical : Brdf::Variant::kPaper);
  const Eigen::Vector3d in = Eigen::Vector3d(0.3, 0.2, 0.8).normalized();
  const Eigen::Vector3d out = Eigen::Vector3d(-0.3, -0.1, 0.8).normalized();
  for (auto _ : state) benchmark::DoNotOptimize(brdf.eval(in, out));
}
BENCHMARK(bench_brdf_eval)->ArgName("physical_paper")->Arg(0)->Arg(1);

/// As above, of a table: 5 incidences, 2 deg apart in the plane and 5 deg out of it.
void bench_brdf_table_eval(benchmark::State& state) {
  const Brdf silicon({}, Brdf::Variant::kPhysical);
  BrdfPoints points;
  for (int theta = 0; theta <= 80; theta += 20)
    for (int first = -88; first <= 88; first += 2)
      for (int second = 0; second <= 85; second += 5) {
        BrdfPoint p{1, 1.0 * theta, 1.0 * first, 1.0 * second};
        p.brdf_per_sr = silicon.eval(incident_direction(p), scatter_direction(points.angles, p));
        points.points.push_back(p);
      }
  const Brdf brdf(TabulatedBrdf(std::make_shared<BrdfGrid>(points), true));
  const Eigen::Vector3d in = Eigen::Vector3d(0.3, 0.2, 0.8).normalized();
  const Eigen::Vector3d out = Eigen::Vector3d(-0.3, -0.1, 0.8).normalized();
  for (auto _ : state) benchmark::DoNotOptimize(brdf.eval(in, out));
}
BENCHMARK(bench_brdf_table_eval);

/// Looking the stars of a field up in the built-in catalogue: half a field in milliradians.
void bench_star_lookup(benchmark::State& state) {
  CameraGeometry camera;
  camera.focal_length_m = 0.5 * camera.width_px * camera.pixel_pitch_m /
                          std::tan(1e-3 * static_cast<double>(state.range(0)));
  StarSpec spec;
  spec.source = StarSpec::Source::kBuiltIn;
  const StarField field(read_star_catalogue(spec, Epoch{}), camera, StarLight(627e-9));
  SkyView sky;
  sky.camera.m = {7e6, 0.0, 0.0};
  const StarLimits limits{0.0, 0.4, 0.0, 5.0, 64.0};
  std::vector<PointSource> found;
  found.reserve(131072);
  std::uint64_t stars = 0;
  Draws draws(1, Stream::kShot, 0, 0);
  for (auto _ : state) {
    const Eigen::Vector3d any(draws.uniform_double() - 0.5, draws.uniform_double() - 0.5,
                              draws.uniform_double() - 0.5);
    const CameraAttitude attitude = look_along(direction_of<J2000>(any));
    sky.attitude = {attitude, attitude, attitude};
    found.clear();
    field.find(sky, limits, found);
    stars += found.size();
  }
  state.counters["stars"] =
      benchmark::Counter(static_cast<double>(stars), benchmark::Counter::kAvgIterations);
}
BENCHMARK(bench_star_lookup)
    ->ArgName("half_field_mrad")
    ->Arg(1)
    ->Arg(13)
    ->Arg(175)
    ->Unit(benchmark::kMicrosecond);

}  // namespace
