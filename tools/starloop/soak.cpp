#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>

#include <malloc.h>
#include <unistd.h>

#include <spdlog/spdlog.h>

#include "hil/steady_clock.h"
#include "tools/starloop/flight.h"
#include "tools/starloop/observer.h"
#include "tools/starloop/rig.h"
#include "tools/starloop/soak_verdict.h"
#include "tools/starloop/subcommands.h"

namespace starloop {
namespace {

namespace fs = std::filesystem;
using engine::Duration;
using engine::seconds;

// Every fourth round's reader keeps each frame for ten periods.
constexpr std::size_t kSlowEvery = 4;
constexpr int kSlowPeriods = 10;

std::uint64_t resident_bytes() {
  std::uint64_t pages = 0;
  std::ifstream("/proc/self/statm") >> pages >> pages;
  return pages * static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE));
}

int entries(const char* folder) {
  return static_cast<int>(std::distance(fs::directory_iterator(folder), fs::directory_iterator()));
}

/// What the process holds, but for the soak's own notes of earlier rounds. The C library keeps
/// freed pages for the next round, now more, now less (70 MiB): it gives them back first.
void weigh(const std::vector<SoakRound>& earlier, SoakRound& round) {
  malloc_trim(0);
  const struct mallinfo2 heap = mallinfo2();
  round.heap_bytes = heap.uordblks + heap.hblkhd;
  round.heap_bytes -= earlier.capacity() * sizeof(SoakRound);
  for (const SoakRound& r : earlier) round.heap_bytes -= r.late_s.capacity() * sizeof(double);
  round.resident_bytes = resident_bytes();
  round.descriptors = entries("/proc/self/fd");
  round.threads = entries("/proc/self/task");
}

std::uint64_t not_finite(const hil::FrameRecord& r) {
  const engine::FrameTruth& t = r.report.truth;
  for (std::size_t i = 0; i < t.companions; ++i)
    if (!std::isfinite(t.companion[i].range_m) || !std::isfinite(t.companion[i].target_px.u))
      return r.report.render.rejected_rays + 1U;
  // The photocentre is not a number where there is no light: that is its way of saying so.
  const bool good = std::isfinite(t.range_m) && std::isfinite(t.target_px.u) &&
                    std::isfinite(t.target_px.v) && std::isfinite(t.smear_px) &&
                    std::isfinite(t.peak_e) && t.peak_e >= 0.0 &&
                    std::isfinite(t.signal_to_noise) && std::isfinite(t.visible_fraction) &&
                    std::isfinite(r.trim_rad[0]) && std::isfinite(r.trim_rad[1]);
  return r.report.render.rejected_rays + (good ? 0U : 1U);
}

/// The reader that counts is the built-in one.
bool audited(const Scenario& scenario) {
  return scenario.link.to.front().kind == drivers::LinkKind::kMock;
}

void read_back(const fs::path& folder, SoakRound& round) {
  const hil::Recording log = hil::load_recording((folder / "record.slog").string());
  round.logged = log.frames.size();
  round.log_fault = log.fault;
  if (log.fault.empty() && !log.end) round.log_fault = "and no end";
}

SoakRound fly_round(const Flight::Plan& plan, int threads, bool slow, const fs::path& folder) {
  const Scenario& scenario = plan.scenario;
  SoakRound round;
  round.slow_reader = slow;
  round.in_realtime = scenario.run.clock == ClockMode::kRealtime;
  round.audited = audited(scenario);
  Rig rig(scenario, threads);
  Flight flight(plan, rig);
  if (!flight.wait_for_reader()) {
    if (interrupted()) return round;
    throw std::runtime_error("nobody reads the frames");
  }
  FrameAudit audit;
  const DeviceManner manner{.hold = slow ? kSlowPeriods * scenario.run.period : Duration{},
                            .audit = &audit};
  const Flight::Result result = flight.fly(folder, manner);
  round.loop = result.log.loop;
  round.late_s.reserve(result.log.frames.size());
  for (const hil::FrameRecord& r : result.log.frames) {
    round.late_s.push_back(seconds(r.late));
    round.not_finite += not_finite(r);
  }
  if (result.log.machine) round.machine = *result.log.machine;
  round.read = audit.whole();
  round.torn = audit.torn();
  round.out_of_order = audit.out_of_order();
  round.records_lost = round.loop.records_lost + result.kept.records_lost;
  read_back(folder, round);
  return round;
}

bool good(const std::vector<SoakCheck>& checks) {
  return std::all_of(checks.begin(), checks.end(), [](const SoakCheck& c) { return c.good; });
}

void show(std::size_t number, const SoakRound& r) {
  const hil::LoopReport& l = r.loop;
  spdlog::info(
      "round {:4}{}: {} due = {} sent + {} skipped + {} dropped + {} refused; {} late; heap {:.2f} "
      "MiB, {} descriptors, {} threads",
      number, r.slow_reader ? " (slow reader)" : "", l.due, l.sent, l.skipped, l.dropped, l.faults,
      l.late, static_cast<double>(r.heap_bytes) / (1024.0 * 1024.0), r.descriptors, r.threads);
}

}  // namespace

int soak(const CommonOptions& options, const SoakOptions& spec) {
  const ScenarioSource source = read_source(options);
  const Scenario scenario = load_scenario(source);
  if (!scenario.faults.faults.empty())
    throw engine::ConfigError(source.file +
                              ": a soak must not have faults on purpose, got the table faults." +
                              scenario.faults.faults.front().name);
  const Flight::Plan plan{source, scenario, chosen_pass(scenario), false, true};
  const bool can_be_slow = scenario.run.clock == ClockMode::kRealtime && audited(scenario);
  catch_signals();
  const fs::path folder = make_run_folder(spec.out, scenario.name + "-soak");
  spdlog::info("{}: pass {}, over and over for {:g} minutes; {}", scenario.name, scenario.run.pass,
               spec.minutes, folder.string());

  std::vector<SoakRound> rounds;
  fs::path last;
  bool last_was_good = true;
  const Duration start = hil::SteadyClock::stopwatch();
  const auto passed_s = [&] { return seconds(hil::SteadyClock::stopwatch() - start); };
  while (!interrupted() && (rounds.empty() || passed_s() < spec.minutes * 60.0)) {
    // What a good round left makes room for the next.
    if (last_was_good && !last.empty()) fs::remove_all(last);
    last = folder / ("round-" + std::to_string(rounds.size() + 1));
    fs::create_directories(last);
    const bool slow = can_be_slow && rounds.size() % kSlowEvery == kSlowEvery - 1;
    SoakRound round = fly_round(plan, options.threads, slow, last);
    weigh(rounds, round);
    last_was_good = good(judge_soak({round}, 0.0));
    rounds.push_back(std::move(round));
    show(rounds.size(), rounds.back());
  }

  const double hours = passed_s() / 3600.0;
  std::vector<SoakCheck> checks = judge_soak(rounds, hours);
  if (!rounds.empty() && rounds.back().loop.sent > 0) {
    ReplayOptions replay;
    replay.log = last.string();
    replay.threads = options.threads;
    replay.quiet = true;
    const bool equal = replay_log(replay) == kGood;
    checks.push_back({"replay", equal,
                      equal ? "the last round comes back from its log to the bit"
                            : "the last round does not come back from its log to the bit"});
  }
  std::ofstream(folder / "soak.json") << soak_json(rounds, checks, hours).dump(2) << "\n";
  for (const SoakCheck& c : checks) {
    if (c.good) {
      spdlog::info("good: {}: {}", c.name, c.sentence);
    } else {
      spdlog::error("NOT GOOD: {}: {}", c.name, c.sentence);
    }
  }
  spdlog::info("results: {}", folder.string());
  return good(checks) ? kGood : kCriterionFailed;
}

}  // namespace starloop
