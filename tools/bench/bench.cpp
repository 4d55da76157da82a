// What each model costs. Machines are shared and noisy: compare lines of one run with each other,
// or two builds run in turn, never with a number from another day.
//   build/release/bench                       everything
//   build/release/bench --benchmark_filter=frame
#include <benchmark/benchmark.h>

#include "drivers/frame_packet.h"
#include "drivers/pixel_packing.h"
#include "drivers/usb_packet.h"
#include "engine/core/random.h"
#include "engine/detector/noise_lanes.h"
#include "engine/orbit/kepler.h"
#include "engine/orbit/sun_track.h"
#include "engine/scene/mesh_repair.h"
#include "engine/scene/obj_file.h"
#include "engine/scene/sdf/delaunay.h"
#include "engine/scene/sdf_mesher.h"
#include "tools/quality/image_quality.h"
#include "tools/starloop/rig.h"
#include "tools/starloop/scenario.h"

namespace {

using namespace engine;

starloop::Scenario flyby(const std::vector<std::string>& overrides = {},
                         const std::string& name = "flyby") {
  starloop::CommonOptions options;
  options.file = STARLOOP_SOURCE_DIR "/config/" + name + ".toml";
  options.overrides = overrides;
  return starloop::load_scenario(options);
}

void bench_kepler(benchmark::State& state) {
  const double e = 1.0 - std::pow(10.0, -static_cast<double>(state.range(0)));
  double m = 0.0;
  for (auto _ : state) benchmark::DoNotOptimize(solve_kepler(e, m += 0.7));
}
BENCHMARK(bench_kepler)->ArgName("digits_of_e_from_1")->Arg(0)->Arg(2)->Arg(6)->Arg(12);

void bench_sun(benchmark::State& state) {
  const auto model = state.range(0) == 0 ? SunModel::kTable1 : SunModel::kErfa;
  Epoch t{};
  for (auto _ : state) benchmark::DoNotOptimize(sun_position(model, t += Duration(1'000'000)));
}
BENCHMARK(bench_sun)->ArgName("table1_erfa")->Arg(0)->Arg(1);

void bench_sun_track(benchmark::State& state) {
  // Every seven minutes, as a search asks: with ERFA's own place every three hours.
  SunTrack sun(SunModel::kErfa);
  Epoch t{};
  for (auto _ : state) benchmark::DoNotOptimize(sun.at(t += std::chrono::minutes(7)));
}
BENCHMARK(bench_sun_track);

void bench_lit_fraction(benchmark::State& state) {
  const auto model = static_cast<ShadowModel>(state.range(0));
  const Position<J2000> sun{{kAstronomicalUnit_m, 0.0, 0.0}};
  const Position<J2000> sunset{{-2350e3, state.range(1) == 0 ? 9e6 : kEarthRadius_m, 0.0}};
  for (auto _ : state) benchmark::DoNotOptimize(lit_fraction(model, sunset, sun));
}
BENCHMARK(bench_lit_fraction)
    ->ArgNames({"cylinder_cone_oblate", "in_penumbra"})
    ->ArgsProduct({{0, 1, 2}, {0, 1}});

/// A body whose place is asked for.
class Counted final : public Propagator {
 public:
  explicit Counted(const Propagator& body) : body_(body) {}
  [[nodiscard]] OrbitState at(Epoch t) const noexcept override {
    ++asked;
    return body_.at(t);
  }
  [[nodiscard]] EpochSpan span() const noexcept override { return body_.span(); }
  [[nodiscard]] double speed_bound_m_s() const noexcept override { return body_.speed_bound_m_s(); }
  mutable std::uint64_t asked = 0;

 private:
  const Propagator& body_;
};

/// The search, or as its lower bound both bodies' places as often as it asks for them.
void bench_passes_of_15_days(benchmark::State& state, const std::string& file, bool bare) {
  starloop::Scenario scenario = flyby({}, file);
  scenario.run.pattern = true;
  const starloop::Rig rig(scenario, 1);
  const Counted camera(rig.camera());
  const Counted target(rig.target());
  const Epoch epoch = scenario.scene.epoch;
  const SimTime end{std::chrono::hours(15 * 24)};
  const auto search = [&] {
    return find_passes(camera, target, scenario.visibility, epoch, SimTime{}, end);
  };
  const auto passes = search();
  const std::uint64_t asked = camera.asked;
  for (auto _ : state) {
    if (!bare) {
      benchmark::DoNotOptimize(search());
      continue;
    }
    for (std::uint64_t i = 0; i < asked; ++i) {
      const Epoch t = epoch + end.time_since_epoch() / asked * i;
      benchmark::DoNotOptimize(camera.at(t));
      benchmark::DoNotOptimize(target.at(t));
    }
  }
  state.counters["passes"] = static_cast<double>(passes.size());
  state.counters["instants"] = static_cast<double>(asked);
}
BENCHMARK_CAPTURE(bench_passes_of_15_days, flyby, "flyby", false)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(bench_passes_of_15_days, flyby_bare, "flyby", true)
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(bench_passes_of_15_days, formation, "formation", false)
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(bench_passes_of_15_days, formation_bare, "formation", true)
    ->Unit(benchmark::kMillisecond);

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

/// A ball of a million triangles, as an exporter writes it.
const std::string& ball_text() {
  static const std::string text = [] {
    constexpr int kRings = 501;
    constexpr int kSides = 1000;
    std::string obj = "usemtl white\n";
    char line[160];
    for (int i = 0; i < kRings; ++i) {
      for (int k = 0; k < kSides; ++k) {
        const double polar = kPi * (i + 0.5) / kRings;
        const double azimuth = 2.0 * kPi * k / kSides;
        std::snprintf(line, sizeof line, "v %.6f %.6f %.6f\n", std::sin(polar) * std::cos(azimuth),
                      std::sin(polar) * std::sin(azimuth), std::cos(polar));
        obj += line;
      }
    }
    for (int i = 0; i + 1 < kRings; ++i) {
      for (int k = 0; k < kSides; ++k) {
        const int a = i * kSides + k + 1;
        const int b = i * kSides + (k + 1) % kSides + 1;
        std::snprintf(line, sizeof line, "f %d//%d %d//%d %d//%d\nf %d//%d %d//%d %d//%d\n", a, a,
                      a + kSides, a, b + kSides, a, a, a, b + kSides, a, b, a);
        obj += line;
      }
    }
    return obj;
  }();
  return text;
}
void bench_load_mesh(benchmark::State& state) {
  for (auto _ : state) {
    MeshReport report;
    ObjFile file = obj_from_text(ball_text(), "ball.obj", report);
    if (state.range(0) > 0) repair(file.grouped, std::move(file.line), report);
    if (state.range(0) > 1)
      benchmark::DoNotOptimize(smooth_normals(file.grouped.mesh, 40.0 * kDegree));
    benchmark::DoNotOptimize(file);
  }
}
BENCHMARK(bench_load_mesh)
    ->ArgName("read_repair_normals")
    ->DenseRange(0, 2, 1)
    ->Unit(benchmark::kMillisecond);

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

void bench_poisson(benchmark::State& state) {
  const double mean = std::pow(10.0, static_cast<double>(state.range(0)));
  Draws draws(1, Stream::kShot, 0, 0);
  for (auto _ : state) benchmark::DoNotOptimize(draws.poisson(mean));
}
BENCHMARK(bench_poisson)->ArgName("log10_mean")->DenseRange(-2, 4, 1);

/// The bound that the detector's frames are held against: one normal number a pixel, 1024 x 1024.
void bench_gaussian_frame(benchmark::State& state) {
  std::vector<float> numbers(std::size_t{1024} * 1024);
  std::uint64_t frame = 0;
  for (auto _ : state) {
    noise_lanes::normals({1, frame++, 0}, Stream::kRead, numbers);
    benchmark::ClobberMemory();
  }
}
BENCHMARK(bench_gaussian_frame)->Unit(benchmark::kMillisecond);

/// Electrons to DN on one thread: a frame of so many electrons a pixel; 0: the paper's dark sky
/// with a disc of 115 px that collects 15 000. 11 bits as in the paper, or 16 with a pedestal.
void bench_detector_frame(benchmark::State& state) {
  DetectorSpec spec;
  spec.bits = static_cast<int>(state.range(1));
  if (spec.bits == 16) {
    spec.pedestal_dn = 100;
    spec.quantiser = Quantiser::kRound;
  }
  const Duration exposure = std::chrono::milliseconds(1);
  const double to_e = spec.electrons_per_irradiance(exposure);
  const auto level_e = static_cast<double>(state.range(0));
  IrradianceImage light(1024, 1024);
  for (int v = 0; v < 1024; ++v)
    for (int u = 0; u < 1024; ++u) {
      const double sky_e = level_e > 0.0 ? level_e : 1e-3;
      const bool lit = level_e == 0.0 && std::hypot(u - 512, v - 512) < 57.5;
      // The disc is no plane: each of its pixels has a mean of its own.
      light.at(u, v) = static_cast<float>((lit ? 15000.0 + u + 0.3 * v : sky_e) / to_e);
    }
  WorkerPool pool(1);
  const Detector detector(spec, pool);
  ElectronImage electrons;
  DnImage dn;
  std::uint64_t frame = 0;
  for (auto _ : state) {
    detector.expose(light, exposure, 1, frame, electrons);
    detector.digitize(electrons, 1, frame++, dn);
    benchmark::ClobberMemory();
  }
}
BENCHMARK(bench_detector_frame)
    ->ArgNames({"electrons", "bits"})
    ->ArgsProduct({{0, 1, 8, 15, 30, 100, 15000}, {11, 16}})
    ->Unit(benchmark::kMillisecond);

/// Optics alone on one thread: a patched disc so many pixels across, smeared by so many, or on a
/// path of a swing of that amplitude.
void bench_optics(benchmark::State& state) {
  const starloop::Scenario scenario = flyby();
  const double to_e = scenario.detector.electrons_per_irradiance(scenario.run.exposure);
  WorkerPool pool(1);
  Optics optics(scenario.optics, 0.3 * scenario.detector.noise_e(0.0) / to_e, pool);
  const auto across = static_cast<int>(state.range(0));
  Radiance in;
  const int corner = 512 - across / 2;
  in.region = {corner, corner, corner + across, corner + across};
  in.grid.resize(3 * across, 3 * across);
  const auto moves_px = static_cast<double>(state.range(1));
  in.path.bends = state.range(2) != 0;
  if (!in.path.bends) in.motion_px = {moves_px, 0.0};
  for (int i = 0; in.path.bends && i <= ImagePath::kSteps; ++i)
    in.path.off_px[static_cast<std::size_t>(i)] = {
        0.0, moves_px * std::sin(2.0 * kPi * i / ImagePath::kSteps)};
  const double bright = 15000.0 / (to_e * optics.throughput_sr());
  for (int v = 0; v < 3 * across; ++v)
    for (int u = 0; u < 3 * across; ++u) {
      const bool lit = std::hypot(u - 1.5 * across, v - 1.5 * across) < 1.5 * across;
      in.grid.at(u, v) = lit && (u / 40 + v / 33) % 3 != 0 ? static_cast<float>(bright) : 0.0F;
    }
  IrradianceImage out;
  OpticsReport report;
  for (auto _ : state) report = optics.project(in, out);
  state.counters["wing_px"] = report.wing_px;
  state.counters["side_cells"] = 3 * Blur::fast_length(across + 2 * report.core_px);
}
BENCHMARK(bench_optics)
    ->ArgNames({"across_px", "smear_px", "path"})
    ->ArgsProduct({{1, 10, 60, 110, 130, 800, 1000}, {0}, {0}})
    ->ArgsProduct({{110}, {3, 146, 1000}, {0}})
    ->ArgsProduct({{110}, {3, 80}, {1}})
    ->Unit(benchmark::kMillisecond);

/// The bound of bench_optics: one real transform of so many cells a side (side_cells there).
void bench_transform(benchmark::State& state) {
  const auto n = static_cast<std::size_t>(state.range(0));
  const std::vector<int> lengths{static_cast<int>(n)};
  FourierLines lines(lengths);
  const std::vector<Lanes> row(n);
  std::vector<FourierLines::Complex> half(n / 2 + 1);
  std::vector<FourierLines::Complex> column(n);
  std::vector<FourierLines::Complex> spectrum((n / 8 + 1) * n);
  for (auto _ : state) {
    for (std::size_t y = 0; y < n; y += Lanes::kCount) {
      lines.forward(std::span(row), std::span(half));
      // As far as its memory goes, turning rows into columns is part of it.
      for (std::size_t x = 0; x < n / 2; x += Lanes::kCount)
        std::copy_n(&half[x], Lanes::kCount, &spectrum[x / Lanes::kCount * n + y]);
    }
    for (std::size_t g = 0; g <= n / 8; ++g) {
      const auto line = std::span(spectrum).subspan(g * n, n);
      lines.forward(std::span<const FourierLines::Complex>(line), std::span(column));
      std::ranges::copy(column, line.begin());
    }
    benchmark::ClobberMemory();
  }
}
BENCHMARK(bench_transform)
    ->ArgName("cells")
    ->Arg(432)
    ->Arg(480)
    ->Arg(2592)
    ->Arg(3240)
    ->Unit(benchmark::kMillisecond);

/// A frame of the paper's pass, so many seconds after its closest point; stages as counters.
void expose_flyby(benchmark::State& state, const starloop::Scenario& scenario, double after_s,
                  int threads) {
  starloop::Rig rig(scenario, threads);
  Shot shot = rig.predicted_shot(sim_time(309781.706 + after_s), scenario.run.exposure);
  DnImage image(scenario.scene.camera.width_px, scenario.scene.camera.height_px);
  TruthMask mask;
  FrameReport report;
  double render_s = 0;
  double optics_s = 0;
  double detector_s = 0;
  for (auto _ : state) {
    ++shot.sequence;
    report = rig.generator().expose(shot, Budget{}, image, mask);
    render_s += seconds(report.times.render);
    optics_s += seconds(report.times.optics);
    detector_s += seconds(report.times.detector);
  }
  const auto per_frame_ms = benchmark::Counter::kAvgIterations;
  state.counters["render_ms"] = benchmark::Counter(render_s * 1e3, per_frame_ms);
  state.counters["optics_ms"] = benchmark::Counter(optics_s * 1e3, per_frame_ms);
  state.counters["detector_ms"] = benchmark::Counter(detector_s * 1e3, per_frame_ms);
  state.counters["range_km"] = report.truth.range_m * 1e-3;
  state.counters["rays"] = static_cast<double>(report.render.rays);
}

/// What a score of such a frame costs the thread that sends it.
void bench_image_quality(benchmark::State& state) {
  const starloop::Scenario scenario = flyby();
  starloop::Rig rig(scenario, 1);
  const double after_s = static_cast<double>(state.range(0));
  const Shot shot = rig.predicted_shot(sim_time(309781.706 + after_s), scenario.run.exposure);
  DnImage image(scenario.scene.camera.width_px, scenario.scene.camera.height_px);
  TruthMask mask;
  rig.generator().expose(shot, Budget{}, image, mask);
  quality::Meter meter(image.width(), image.height());
  const quality::CameraFigures camera{scenario.detector.largest_dn(),
                                      scenario.detector.gain_e_dn()};
  quality::ImageQuality quality;
  for (auto _ : state) benchmark::DoNotOptimize(quality = meter.measure(image, camera));
  state.counters["lit_px"] = quality.lit_px;
}
BENCHMARK(bench_image_quality)
    ->ArgName("s_after_closest")
    ->Arg(0)
    ->Arg(20)
    ->Unit(benchmark::kMillisecond);

void bench_frame(benchmark::State& state) {
  expose_flyby(state, flyby(), static_cast<double>(state.range(0)),
               static_cast<int>(state.range(1)));
}
BENCHMARK(bench_frame)
    ->ArgNames({"s_after_closest", "threads"})
    ->ArgsProduct({{0, 5, 10, 20}, {1, 2}})
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();

/// With companions in a row, so many metres from one to the next: at 16 m beside the target in the
/// frame, at 5 km out of it.
void bench_frame_of_bodies(benchmark::State& state) {
  std::vector<std::string> companions;
  for (int i = 1; i < state.range(0); ++i)
    companions.push_back("companions.c" + std::to_string(i) +
                         ".cross_m=" + std::to_string(i * state.range(1)));
  expose_flyby(state, flyby(companions), 0.0, 1);
}
BENCHMARK(bench_frame_of_bodies)
    ->ArgNames({"bodies", "metres_apart"})
    ->ArgsProduct({{1, 2, 4}, {16, 5000}})
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();

/// Stars onto the detector of the paper's camera, each 300 e- in a millisecond; footprints a
/// second.
void bench_star_footprints(benchmark::State& state) {
  const starloop::Scenario scenario = flyby();
  const CameraGeometry& camera = scenario.scene.camera;
  const double to_e = scenario.detector.electrons_per_irradiance(scenario.run.exposure);
  const double faint_w_m2 = 0.3 * scenario.detector.noise_e(0.0) / to_e;
  WorkerPool pool(static_cast<int>(state.range(1)));
  PointSplat splat(scenario.optics, OtfCascade(scenario.optics), faint_w_m2, pool);
  std::vector<PointSource> stars(10000);
  Draws draws(1, Stream::kShot, 0, 0);
  for (PointSource& star : stars)
    star = {{camera.width_px * draws.uniform_double(), camera.height_px * draws.uniform_double()},
            300.0 / (to_e * splat.pixels_per_irradiance()),
            {static_cast<double>(state.range(0)), 0.0}};
  IrradianceImage image(camera.width_px, camera.height_px);
  std::uint64_t footprints = 0;
  for (auto _ : state) footprints += splat.add(stars, {}, image).footprints;
  state.counters["footprints_s"] =
      benchmark::Counter(static_cast<double>(footprints), benchmark::Counter::kIsRate);
  state.counters["reach_px"] = splat.reach_px(stars[0].irradiance_w_m2);
}
BENCHMARK(bench_star_footprints)
    ->ArgNames({"streak_px", "threads"})
    ->ArgsProduct({{0, 10}, {1, 2}})
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();

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

void bench_frame_packet(benchmark::State& state) {
  const DnImage image(1024, 1024);
  hil::Frame frame;
  frame.pixels = &image;
  std::vector<std::byte> bytes(drivers::frame_bytes(1024, 1024));
  for (auto _ : state) {
    benchmark::DoNotOptimize(drivers::encode_frame(frame, bytes));
    if (state.range(0) == 1) benchmark::DoNotOptimize(drivers::decode_frame(bytes));
  }
}
BENCHMARK(bench_frame_packet)->ArgName("and_decode")->Arg(0)->Arg(1)->Unit(benchmark::kMillisecond);

enum class Packing { kCopy, kPack, kUnpack, kPackPlain, kUnpackPlain };

/// A frame's pixels, at 2 bytes each a second: packing against copying them.
void bench_packing(benchmark::State& state, Packing how) {
  std::vector<std::uint16_t> pixels(std::size_t{1024} * 1024);
  for (std::size_t i = 0; i < pixels.size(); ++i) pixels[i] = static_cast<std::uint16_t>(i & 2047);
  std::vector<std::uint16_t> copy(pixels.size());
  std::vector<std::byte> packed(drivers::packed_bytes(pixels.size()));
  drivers::pack_pixels(pixels, packed);
  for (auto _ : state) {
    switch (how) {
      case Packing::kCopy:
        std::copy(pixels.begin(), pixels.end(), copy.begin());
        break;
      case Packing::kPack:
        drivers::pack_pixels(pixels, packed);
        break;
      case Packing::kUnpack:
        drivers::unpack_pixels(packed, copy);
        break;
      case Packing::kPackPlain:
        drivers::detail::pack_plain(pixels, packed);
        break;
      case Packing::kUnpackPlain:
        drivers::detail::unpack_plain(packed, copy);
        break;
    }
    benchmark::ClobberMemory();
  }
  state.SetBytesProcessed(state.iterations() * static_cast<std::int64_t>(2 * pixels.size()));
}
BENCHMARK_CAPTURE(bench_packing, copy, Packing::kCopy);
BENCHMARK_CAPTURE(bench_packing, pack, Packing::kPack);
BENCHMARK_CAPTURE(bench_packing, unpack, Packing::kUnpack);
BENCHMARK_CAPTURE(bench_packing, pack_plain, Packing::kPackPlain);
BENCHMARK_CAPTURE(bench_packing, unpack_plain, Packing::kUnpackPlain);

void bench_usb_frame(benchmark::State& state) {
  const DnImage image(1024, 1024);
  hil::Frame frame;
  frame.pixels = &image;
  const auto format = static_cast<drivers::PixelFormat>(state.range(0));
  std::vector<std::byte> bytes(drivers::kUsbHeaderBytes +
                               drivers::usb_payload_bytes(format, 1024, 1024));
  for (auto _ : state) benchmark::DoNotOptimize(drivers::encode_usb_frame(frame, format, bytes));
}
BENCHMARK(bench_usb_frame)->ArgName("packed")->Arg(0)->Arg(1)->Unit(benchmark::kMillisecond);

SdfShape square() { return region_of({{{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}}}); }

// What meshing costs in triangulations: a truss makes some twenty, a front none.
void bench_delaunay(benchmark::State& state) {
  const SdfMesh mesh = mesh_shape(square(), even_edges(0.05, SdfMethod::kTruss));
  for (auto _ : state) benchmark::DoNotOptimize(delaunay(mesh.places_m));
  state.counters["triangles"] = static_cast<double>(mesh.triangles.size());
}
BENCHMARK(bench_delaunay)->Unit(benchmark::kMillisecond);

void bench_meshing(benchmark::State& state, const SdfShape& shape, SdfMethod method,
                   double edge_m) {
  std::size_t triangles = 0;
  for (auto _ : state) triangles = mesh_shape(shape, even_edges(edge_m, method)).triangles.size();
  state.counters["triangles"] = static_cast<double>(triangles);
}
BENCHMARK_CAPTURE(bench_meshing, square_truss, square(), SdfMethod::kTruss, 0.05)
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(bench_meshing, square_front, square(), SdfMethod::kFront, 0.05)
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(bench_meshing, cube_front, surface_of(Solid::box({2, 2, 2})), SdfMethod::kFront,
                  0.1)
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(bench_meshing, sphere_truss, surface_of(Solid::sphere(1)), SdfMethod::kAuto, 0.1)
    ->Unit(benchmark::kMillisecond);

}  // namespace

BENCHMARK_MAIN();
