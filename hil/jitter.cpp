#include "hil/jitter.h"

#include <algorithm>
#include <cmath>

#include "engine/core/constants.h"
#include "engine/core/number_table.h"
#include "engine/core/random.h"

namespace hil {

using engine::kDegree;
using engine::kPi;

namespace {

constexpr std::size_t kMostLines = 100;
constexpr std::size_t kMostDensities = 10'000;
constexpr std::size_t kMostSamples = 1'000'000;
constexpr double kLargest_rad = 0.1;
constexpr double kHighest_hz = 1e5;

std::vector<JitterLine> read_lines(const engine::ConfigReader& config) {
  std::vector<JitterLine> lines;
  for (const std::string& name : config.tables_below("jitter.lines")) {
    const engine::ConfigTable table = config.table("jitter.lines." + name);
    if (lines.size() == kMostLines)
      table.fail("frequency_hz",
                 "is one line more than the " + std::to_string(kMostLines) + " allowed");
    const engine::Range turn = engine::between(-360.0, 360.0);
    lines.push_back(
        {table.number("frequency_hz", engine::between(0.0, kHighest_hz)),
         table.number("amplitude_urad", engine::between(0.0, kLargest_rad * 1e6)) * 1e-6,
         table.number_or("direction_deg", 0.0, turn) * kDegree,
         table.number_or("phase_deg", 0.0, turn) * kDegree});
  }
  return lines;
}

/// Power of one axis between two neighbouring points, rad^2.
double power_between(const JitterDensity& a, const JitterDensity& b, std::size_t axis) {
  return 0.5 * (a.rad2_hz[axis] + b.rad2_hz[axis]) * (b.frequency_hz - a.frequency_hz);
}

double power_of(const std::vector<JitterDensity>& densities, std::size_t axis) {
  double power = 0;
  for (std::size_t i = 1; i < densities.size(); ++i)
    power += power_between(densities[i - 1], densities[i], axis);
  return power;
}

std::vector<JitterDensity> read_densities(const std::string& path) {
  const engine::NumberTable table =
      engine::read_number_table(path, "frequency_hz,x_rad2_hz,y_rad2_hz", kMostDensities);
  std::vector<JitterDensity> densities;
  std::array<double, 2> power{};
  for (const auto& [line, v] : table.rows) {
    if (v[0] < 0.0 || v[0] > kHighest_hz)
      table.fail(line, "a frequency must be >= 0 and <= 100000 Hz");
    if (!densities.empty() && v[0] <= densities.back().frequency_hz)
      table.fail(line, "frequencies must grow from row to row");
    if (v[1] < 0.0 || v[2] < 0.0) table.fail(line, "a density must be >= 0");
    densities.push_back({v[0], {v[1], v[2]}});
    if (densities.size() < 2) continue;
    for (std::size_t axis = 0; axis < 2; ++axis) {
      power[axis] += power_between(densities.end()[-2], densities.back(), axis);
      if (!(power[axis] <= kLargest_rad * kLargest_rad))
        table.fail(line, "the jitter so far must be <= 0.1 rad rms");
    }
  }
  if (densities.size() < 2) table.fail(1, "a density needs two rows at least");
  return densities;
}

std::vector<JitterSample> read_samples(const std::string& path) {
  const engine::NumberTable table =
      engine::read_number_table(path, "t_s,x_urad,y_urad", kMostSamples);
  std::vector<JitterSample> samples;
  for (const auto& [line, v] : table.rows) {
    if (!samples.empty() && v[0] <= samples.back().time_s)
      table.fail(line, "times must grow from row to row");
    if (std::abs(v[0]) > 1e9) table.fail(line, "a time must be within 1e9 s of 0");
    if (std::max(std::abs(v[1]), std::abs(v[2])) > kLargest_rad * 1e6)
      table.fail(line, "an angle must be within 100000 urad of 0");
    samples.push_back({v[0], {v[1] * 1e-6, v[2] * 1e-6}});
  }
  if (samples.size() < 2) table.fail(1, "a series needs two rows at least");
  return samples;
}

/// Where the power from the first point on reaches `share`. Pre: some power lies there.
double frequency_at(const std::vector<JitterDensity>& densities, std::size_t axis, double share) {
  for (std::size_t i = 1; i < densities.size(); ++i) {
    const JitterDensity& a = densities[i - 1];
    const JitterDensity& b = densities[i];
    const double here = power_between(a, b, axis);
    if (share > here) {
      share -= here;
      continue;
    }
    if (!(here > 0.0)) continue;
    // a s + (b - a) s^2 / 2 width = share, solved without the difference of two near numbers.
    const double width = b.frequency_hz - a.frequency_hz;
    const double low = a.rad2_hz[axis];
    const double slope = (b.rad2_hz[axis] - low) / width;
    const double root = std::sqrt(std::max(0.0, low * low + 2.0 * slope * share));
    return a.frequency_hz + std::min(width, 2.0 * share / (low + root));
  }
  return densities.back().frequency_hz;
}

}  // namespace

JitterSpec read_jitter(const engine::ConfigReader& config) {
  const engine::ConfigTable table = config.table("jitter");
  JitterSpec spec;
  spec.lines = read_lines(config);
  if (table.has("psd_file")) spec.densities = read_densities(table.text("psd_file"));
  if (table.has("series_file")) spec.samples = read_samples(table.text("series_file"));
  return spec;
}

Jitter::Jitter(const JitterSpec& spec, std::uint64_t seed, engine::SimTime start)
    : start_(start), samples_(spec.samples) {
  for (const JitterLine& line : spec.lines) {
    sinusoids_.push_back({line.frequency_hz,
                          line.phase_rad,
                          {line.amplitude_rad * std::cos(line.direction_rad),
                           line.amplitude_rad * std::sin(line.direction_rad)}});
  }
  for (std::size_t axis = 0; axis < 2; ++axis) realise(spec.densities, axis, seed);
  if (samples_.empty()) return;
  const double lasts_s = samples_.back().time_s - samples_.front().time_s;
  JitterSample again = samples_.front();
  again.time_s += lasts_s + lasts_s / static_cast<double>(samples_.size() - 1);
  samples_.push_back(again);
}

void Jitter::realise(const std::vector<JitterDensity>& densities, std::size_t axis,
                     std::uint64_t seed) {
  const double power = power_of(densities, axis);
  if (!(power > 0.0)) return;
  const double share = power / kSinusoids;
  for (std::size_t i = 0; i < kSinusoids; ++i) {
    engine::Draws draws(seed, engine::Stream::kJitter, axis, static_cast<std::uint32_t>(i));
    Sinusoid s;
    s.frequency_hz =
        frequency_at(densities, axis, share * (static_cast<double>(i) + draws.uniform_double()));
    s.phase_rad = 2.0 * kPi * draws.uniform_double();
    s.amplitude_rad[axis] = std::sqrt(2.0 * share);
    sinusoids_.push_back(s);
  }
}

TrimAngles Jitter::at(engine::SimTime t) const noexcept {
  const double t_s = engine::seconds(t - start_);
  TrimAngles sum{};
  if (!samples_.empty()) sum = in_series(t_s);
  for (const Sinusoid& s : sinusoids_) {
    const double wave = std::sin(2.0 * kPi * s.frequency_hz * t_s + s.phase_rad);
    sum[0] += s.amplitude_rad[0] * wave;
    sum[1] += s.amplitude_rad[1] * wave;
  }
  return sum;
}

TrimAngles Jitter::in_series(double t_s) const noexcept {
  const double first_s = samples_.front().time_s;
  const double period_s = samples_.back().time_s - first_s;
  double into_s = std::fmod(t_s, period_s);
  if (into_s < 0.0) into_s += period_s;
  const double at_s = first_s + into_s;
  auto after = std::upper_bound(samples_.begin() + 1, samples_.end() - 1, at_s,
                                [](double x, const JitterSample& s) { return x < s.time_s; });
  const JitterSample& b = *after;
  const JitterSample& a = *(after - 1);
  const double part = std::clamp((at_s - a.time_s) / (b.time_s - a.time_s), 0.0, 1.0);
  return {a.rad[0] + part * (b.rad[0] - a.rad[0]), a.rad[1] + part * (b.rad[1] - a.rad[1])};
}

}  // namespace hil
