#include "tools/starloop/soak_verdict.h"

#include <algorithm>
#include <functional>

#include <spdlog/fmt/fmt.h>
#include <nlohmann/json.hpp>

#include "hil/percentiles.h"

namespace starloop {
namespace {

constexpr double kCadence_s = 1e-3;
constexpr double kCadenceOfMachine = 3.0;
constexpr double kMiB = 1024.0 * 1024.0;
// A leak of a hundred bytes a frame is 400 kB an hour at 1 Hz, 8 MB at 20 Hz.
constexpr double kGrowth_bytes_h = 1.0 * kMiB;
// What may differ between two rounds without anything growing: pools of libraries and the heap's
// own pages.
constexpr double kHeapNoise_bytes = 0.25 * kMiB;
constexpr double kResidentNoise_bytes = 16.0 * kMiB;

using Count = std::function<std::uint64_t(const SoakRound&)>;

std::uint64_t sum(const std::vector<SoakRound>& rounds, const Count& count) {
  std::uint64_t total = 0;
  for (const SoakRound& r : rounds) total += count(r);
  return total;
}

SoakCheck none(const std::string& name, std::uint64_t found, const std::string& what) {
  return {name, found == 0, fmt::format("{} {}", found, what)};
}

std::uint64_t unaccounted(const SoakRound& r) {
  const hil::LoopReport& l = r.loop;
  const std::uint64_t known = l.sent + l.skipped + l.dropped + l.faults;
  return std::max(l.due, known) - std::min(l.due, known);
}

SoakCheck read_whole(const std::vector<SoakRound>& rounds) {
  std::uint64_t sent = 0;
  std::uint64_t read = 0;
  std::uint64_t wrong = 0;
  for (const SoakRound& r : rounds) {
    if (!r.audited) continue;
    sent += r.loop.sent;
    read += r.read;
    wrong += r.torn + r.out_of_order + (r.read == r.loop.sent ? 0 : 1);
  }
  return {"read whole", wrong == 0,
          fmt::format("{} frames read of {} sent; {} rounds short, frames torn or out of order",
                      read, sent, wrong)};
}

SoakCheck logs(const std::vector<SoakRound>& rounds) {
  std::uint64_t wrong = 0;
  std::string first;
  for (const SoakRound& r : rounds) {
    const std::uint64_t made = r.loop.due - r.loop.skipped - r.loop.dropped;
    if (r.log_fault.empty() && r.logged == made) continue;
    if (wrong++ == 0)
      first = fmt::format("; the first has {} of {} frames {}", r.logged, made, r.log_fault);
  }
  return {"logs", wrong == 0,
          fmt::format("{} of {} logs did not read back in full{}", wrong, rounds.size(), first)};
}

/// The cadence of all rounds with, or without, a slow reader; nothing when there is no such.
void add_cadence(const std::vector<SoakRound>& rounds, bool slow, std::vector<SoakCheck>& checks) {
  std::vector<double> late_s;
  hil::WakeHistogram machine;
  for (const SoakRound& r : rounds) {
    if (r.slow_reader != slow || !r.in_realtime) continue;
    late_s.insert(late_s.end(), r.late_s.begin(), r.late_s.end());
    machine.add(r.machine);
  }
  const hil::Percentiles late = hil::percentiles_of(std::move(late_s));
  if (late.count == 0) return;
  const double own_s = engine::seconds(machine.quantile(0.999));
  const double limit_s = std::max(kCadence_s, kCadenceOfMachine * own_s);
  checks.push_back({slow ? "cadence beside a slow reader" : "cadence", late.p99_9 <= limit_s,
                    fmt::format("shutters of {} frames open late by {:.3f} ms (p50), {:.3f} ms "
                                "(p99), {:.3f} ms (p99.9), {:.3f} ms (max); p99.9 must be at most "
                                "{:.3f} ms: 1 ms, or three times the machine's own {:.3f} ms",
                                late.count, late.p50 * 1e3, late.p99 * 1e3, late.p99_9 * 1e3,
                                late.max * 1e3, limit_s * 1e3, own_s * 1e3)});
}

SoakCheck grows(const std::string& name, const std::vector<SoakRound>& rounds, const Count& bytes,
                double hours, double noise) {
  // What is held goes up and down from round to round; a leak raises the least of it.
  const auto begin = rounds.begin() + static_cast<std::ptrdiff_t>(kWarmUpRounds);
  const auto some = std::max<std::ptrdiff_t>(2, (rounds.end() - begin) / 3);
  const auto less = [&bytes](const SoakRound& a, const SoakRound& b) {
    return bytes(a) < bytes(b);
  };
  const auto before = static_cast<double>(bytes(*std::min_element(begin, begin + some, less)));
  const auto after =
      static_cast<double>(bytes(*std::min_element(rounds.end() - some, rounds.end(), less)));
  const double limit = noise + kGrowth_bytes_h * hours;
  return {name, after - before <= limit,
          fmt::format(
              "at least {:.2f} MiB after the warm-up, {:.2f} MiB at the end; it may grow by {:.2f}",
              before / kMiB, after / kMiB, limit / kMiB)};
}

template <class Number>
SoakCheck steady(const std::string& name, const std::vector<SoakRound>& rounds,
                 Number SoakRound::*number) {
  const auto differs = [&](const SoakRound& r) { return r.*number != rounds.front().*number; };
  const auto it = std::find_if(rounds.begin(), rounds.end(), differs);
  const bool good = it == rounds.end();
  return {name, good,
          good ? fmt::format("{} after every round", rounds.front().*number)
               : fmt::format("{} after the first round, {} after round {}", rounds.front().*number,
                             (*it).*number, it - rounds.begin() + 1)};
}

}  // namespace

std::vector<SoakCheck> judge_soak(const std::vector<SoakRound>& rounds, double hours) {
  std::vector<SoakCheck> checks;
  const std::uint64_t due = sum(rounds, [](const SoakRound& r) { return r.loop.due; });
  checks.push_back({"rounds", !rounds.empty() && due > 0,
                    fmt::format("{} rounds of {} frames in all", rounds.size(), due)});
  if (rounds.empty()) return checks;

  checks.push_back(none("accounted for", sum(rounds, unaccounted),
                        "frames that were neither sent, skipped, dropped nor refused"));
  checks.push_back(read_whole(rounds));
  checks.push_back(logs(rounds));
  checks.push_back(none("records", sum(rounds, [](const SoakRound& r) { return r.records_lost; }),
                        "records of frames and commands lost"));
  checks.push_back(none("commands",
                        sum(rounds,
                            [](const SoakRound& r) {
                              if (!r.audited) return std::uint64_t{0};
                              return r.loop.command_faults + r.loop.commands_lost +
                                     r.loop.refused.total();
                            }),
                        "commands of the built-in tracker malformed, refused or lost"));
  add_cadence(rounds, false, checks);
  add_cadence(rounds, true, checks);
  checks.push_back(none("causes",
                        sum(rounds,
                            [](const SoakRound& r) {
                              const auto unknown = hil::LateCause::kUnknown;
                              return r.loop.late_by_cause[static_cast<std::size_t>(unknown)];
                            }),
                        "late frames without a cause"));
  checks.push_back(none("numbers", sum(rounds, [](const SoakRound& r) { return r.not_finite; }),
                        "rays refused or truths that are no numbers"));
  checks.push_back(steady("descriptors", rounds, &SoakRound::descriptors));
  checks.push_back(steady("threads", rounds, &SoakRound::threads));
  if (rounds.size() > kWarmUpRounds + 1) {
    checks.push_back(grows(
        "heap", rounds, [](const SoakRound& r) { return r.heap_bytes; }, hours, kHeapNoise_bytes));
    checks.push_back(grows(
        "resident memory", rounds, [](const SoakRound& r) { return r.resident_bytes; }, hours,
        kResidentNoise_bytes));
  }
  return checks;
}

nlohmann::ordered_json soak_json(const std::vector<SoakRound>& rounds,
                                 const std::vector<SoakCheck>& checks, double hours) {
  nlohmann::ordered_json json = {{"hours", hours}};
  for (const SoakCheck& c : checks)
    json["checks"].push_back({{"name", c.name}, {"good", c.good}, {"found", c.sentence}});
  for (const SoakRound& r : rounds) {
    const hil::Percentiles late = hil::percentiles_of(r.late_s);
    json["rounds"].push_back({{"slow_reader", r.slow_reader},
                              {"due", r.loop.due},
                              {"sent", r.loop.sent},
                              {"skipped", r.loop.skipped},
                              {"dropped", r.loop.dropped},
                              {"refused_by_link", r.loop.faults},
                              {"late", r.loop.late},
                              {"late_p50_ms", late.p50 * 1e3},
                              {"late_max_ms", late.max * 1e3},
                              {"machine_worst_ms", engine::seconds(r.machine.worst()) * 1e3},
                              {"read", r.read},
                              {"logged", r.logged},
                              {"heap_bytes", r.heap_bytes},
                              {"resident_bytes", r.resident_bytes},
                              {"descriptors", r.descriptors},
                              {"threads", r.threads}});
  }
  return json;
}

}  // namespace starloop
