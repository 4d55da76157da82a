#include "hil/hiccup_meter.h"

#include <algorithm>
#include <cmath>

#include "hil/realtime.h"

namespace hil {

using engine::Duration;

namespace {

constexpr Duration kPeriod{1'000'000};
constexpr Duration kFinest{1'000};

}  // namespace

void WakeHistogram::add(Duration late) noexcept {
  const double octaves = std::log2(std::max(1.0, engine::seconds(late) / engine::seconds(kFinest)));
  const auto bin = static_cast<std::size_t>(octaves * kBinsPerOctave);
  ++bins_[std::min(bin, kBins - 1)];
  ++count_;
  worst_ = std::max(worst_, late);
}

void WakeHistogram::add(const WakeHistogram& other) noexcept {
  for (std::size_t i = 0; i < kBins; ++i) bins_[i] += other.bins_[i];
  count_ += other.count_;
  worst_ = std::max(worst_, other.worst_);
}

Duration WakeHistogram::quantile(double share) const noexcept {
  const double wanted = share * static_cast<double>(count_);
  double under = 0;
  for (std::size_t i = 0; i < kBins; ++i) {
    under += static_cast<double>(bins_[i]);
    if (bins_[i] == 0 || under < wanted) continue;
    if (i + 1 == kBins) break;  // open-ended
    const double edge = std::exp2(static_cast<double>(i + 1) / kBinsPerOctave);
    return std::min(worst_, engine::from_seconds(edge * engine::seconds(kFinest)));
  }
  return worst_;
}

Duration HiccupHistory::within(Duration from, Duration to) const noexcept {
  Duration sum{};
  for (const Hiccup& h : last_)
    sum += std::max(Duration{}, std::min(to, h.to) - std::max(from, h.from));
  return sum;
}

HiccupMeter::HiccupMeter(int priority)
    : due_(SteadyClock::stopwatch()),
      thread_([this, priority](const std::stop_token& stop) { measure(stop, priority); }) {}

const WakeHistogram& HiccupMeter::finish() {
  thread_.request_stop();
  if (thread_.joinable()) thread_.join();
  return wakes_;
}

void HiccupMeter::measure(const std::stop_token& stop, int priority) noexcept {
  if (priority > 0) static_cast<void>(raise_priority(priority));
  Duration due = SteadyClock::stopwatch();
  while (!stop.stop_requested()) {
    due += kPeriod;
    due_.store(due, std::memory_order_release);
    SteadyClock::sleep_until_stopwatch(due);
    const Duration woke = SteadyClock::stopwatch();
    wakes_.add(woke - due);
    // When the ring is full the loop has not asked for a while: it has no use for them either.
    if (woke - due > kWorthTelling) static_cast<void>(told_.push({due, woke}));
    // What was slept through is one hiccup, not many.
    if (woke > due + kPeriod) due = woke;
  }
}

}  // namespace hil
