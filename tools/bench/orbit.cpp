// Where bodies are, and when they see each other.
#include <benchmark/benchmark.h>

#include "engine/orbit/kepler.h"
#include "engine/orbit/passes.h"
#include "engine/orbit/shadow.h"
#include "engine/orbit/sun_track.h"
#include "tools/bench/beside.h"
#include "tools/bench/scenes.h"
#include "tools/starloop/rig.h"

namespace {

using namespace engine;

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

/// The search beside both bodies' places as often as it asks for them.
void bench_passes_of_15_days(benchmark::State& state, const std::string& file) {
  starloop::Scenario scenario = bench::scenario_of(file);
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
  const auto places = [&] {
    for (std::uint64_t i = 0; i < asked; ++i) {
      const Epoch t = epoch + end.time_since_epoch() / asked * i;
      benchmark::DoNotOptimize(camera.at(t));
      benchmark::DoNotOptimize(target.at(t));
    }
  };
  bench::beside(state, {.run = [&](int) { benchmark::DoNotOptimize(search()); }},
                {{"places", places}});
  state.counters["passes"] = static_cast<double>(passes.size());
  state.counters["instants"] = static_cast<double>(asked);
}
BENCHMARK_CAPTURE(bench_passes_of_15_days, flyby, "flyby")->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(bench_passes_of_15_days, formation, "formation")->Unit(benchmark::kMillisecond);

}  // namespace
