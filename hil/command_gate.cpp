#include "hil/command_gate.h"

#include <algorithm>
#include <cmath>

namespace hil {
namespace {

using engine::Duration;
using engine::SimTime;

/// Far enough for every scenario, near enough that differences of two such times fit.
constexpr Duration kFarthestReference{1LL << 62};
constexpr std::uint64_t kRemembered = 64;

/// a - b, held at the ends: stamps come from outside and may be anything.
Duration difference(SimTime a, SimTime b) noexcept {
  const Duration::rep x = a.time_since_epoch().count();
  const Duration::rep y = b.time_since_epoch().count();
  Duration::rep out = 0;
  if (!__builtin_sub_overflow(x, y, &out)) return Duration(out);
  return x < y ? Duration::min() : Duration::max();
}

template <class Array>
bool finite(const Array& values) noexcept {
  return std::all_of(values.begin(), values.end(), [](auto x) { return std::isfinite(x); });
}

bool all_finite(const Command& c) noexcept {
  return finite(c.trim_offset_rad) && finite(c.trim_rate_rad_s) &&
         finite(c.attitude.j2000_to_camera) && finite(c.attitude.rate_rad_s) &&
         std::isfinite(c.detection.centroid_px.u) && std::isfinite(c.detection.centroid_px.v) &&
         std::isfinite(c.detection.confidence) && finite(c.detection.box_px);
}

}  // namespace

CommandGate::Sender* CommandGate::find(std::uint32_t name) noexcept {
  const auto at = std::find_if(senders_.begin(), senders_.end(),
                               [name](const Sender& s) { return s.obeyed != 0 && s.name == name; });
  return at == senders_.end() ? nullptr : &*at;
}

std::optional<Refusal> CommandGate::admit(const Command& command, SimTime now) noexcept {
  const std::optional<Refusal> refusal = judge(command, now);
  if (refusal) {
    ++refused_[*refusal];
  } else {
    remember(command);
  }
  return refusal;
}

std::optional<Refusal> CommandGate::judge(const Command& command, SimTime now) noexcept {
  if (const Sender* sender = find(command.sender);
      sender != nullptr && command.sequence <= sender->last) {
    const std::uint64_t behind = sender->last - command.sequence;
    const bool again = behind < kRemembered && (sender->obeyed >> behind & 1) != 0;
    return again ? Refusal::kDuplicate : Refusal::kReordered;
  }
  const Duration age = difference(now, command.made_at);
  if (command.time_to_live != Duration{} && age > command.time_to_live) return Refusal::kStale;
  if (age < -most_ahead_) return Refusal::kFuture;
  if (!all_finite(command)) return Refusal::kNotFinite;
  const Duration reference = command.reference.time_since_epoch();
  if (reference > kFarthestReference || reference < -kFarthestReference) return Refusal::kReference;
  return std::nullopt;
}

void CommandGate::remember(const Command& command) noexcept {
  Sender* sender = find(command.sender);
  if (sender == nullptr) {
    // Places nobody has are those that were never heard.
    sender = &*std::min_element(
        senders_.begin(), senders_.end(),
        [](const Sender& a, const Sender& b) { return a.heard_at < b.heard_at; });
    *sender = {.name = command.sender, .last = command.sequence, .obeyed = 0, .heard_at = 0};
  }
  const std::uint64_t ahead = command.sequence - sender->last;
  sender->obeyed = (ahead < kRemembered ? sender->obeyed << ahead : 0) | 1;
  sender->last = command.sequence;
  sender->heard_at = ++admitted_;
}

}  // namespace hil
