#include "hil/faults/faulty_sink.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace hil {

using engine::Done;
using engine::Draws;
using engine::Duration;
using engine::Error;
using engine::Status;

FaultySink::FaultySink(const FaultSpec& spec, Shape shape, engine::SimTime start, FrameSink& inner,
                       Clock* clock)
    : spec_(spec),
      shape_(shape),
      start_(start),
      inner_(inner),
      clock_(clock),
      bloom_(shape.width_px),
      happened_(spec.faults.size()) {
  std::size_t late = 0;
  std::size_t copies = 0;
  for (const PlannedFault& fault : spec_.faults) {
    if (fault.kind == FaultKind::kTorn || fault.kind == FaultKind::kFrozen) remembers_ = true;
    if (fault.kind >= FaultKind::kRays && fault.kind <= FaultKind::kFlipped)
      changed_.resize(shape.width_px, shape.height_px);
    if (fault.kind == FaultKind::kDuplicated) copies = 1;
    if (fault.kind == FaultKind::kLate)
      late = std::max(late, static_cast<std::size_t>(fault.frames));
  }
  if (remembers_) before_.resize(shape.width_px, shape.height_px);
  held_.resize(late + copies);
  for (Held& held : held_) {
    held.pixels.resize(shape.width_px, shape.height_px);
    held.telemetry_row.reserve(static_cast<std::size_t>(shape.width_px));
  }
}

void FaultySink::record(std::size_t fault, std::int64_t place, std::int64_t count,
                        double amount) noexcept {
  ++happened_[fault];
  FaultRecord r;
  r.frame = at_.frame;
  r.since_start = at_.since_start;
  r.fault = fault;
  r.kind = spec_.faults[fault].kind;
  r.place = place;
  r.count = count;
  r.amount = amount;
  if (!records_.push(r)) ++counts_.records_lost;
}

template <class Act>
void FaultySink::each(FaultKind first, FaultKind last, Act&& act) noexcept {
  for (std::size_t i = 0; i < spec_.faults.size(); ++i) {
    const PlannedFault& fault = spec_.faults[i];
    if (fault.kind < first || fault.kind > last || !fault.window.holds(at_)) continue;
    Draws draws = fault.draws(spec_.seed, at_.frame);
    // A uniform number is never 0 nor 1: probability 0 is never, and 1 always.
    if (draws.uniform_double() < fault.window.probability) act(i, draws);
  }
}

// ---- on the wire ------------------------------------------------------------------------------

Status FaultySink::send(const Frame& frame, Duration timeout) noexcept {
  ENSURE(frame.pixels->width() == shape_.width_px && frame.pixels->height() == shape_.height_px);
  ++counts_.taken;
  at_ = {frame.sequence, frame.shutter_open - start_};
  const Route route = choose_route();
  // Before any frame: no answer must overtake the news.
  static_cast<void>(news_.push({at_, false, FrameNews::kNothing}));
  std::uint64_t instead = FrameNews::kNothing;
  Duration share = timeout;
  if (!route.away) {
    const auto due = std::count_if(held_.begin(), held_.end(),
                                   [&](const Held& held) { return is_due(held, route); });
    share = timeout / (due + 1);
    instead = send_held(route, share);
  }
  if (route.withheld()) static_cast<void>(news_.push({at_, true, instead}));
  if (route.away) {
    ++counts_.away;
    return Error{engine::Fault::kDisconnected, 0, "faults: away"};
  }
  if (route.dropped) {
    ++counts_.dropped;
    return Done{};
  }
  damage(frame);
  Frame out = frame;
  out.pixels = pixels_;
  out.shutter_open += clock_error();
  return send_along(out, route, share);
}

FaultySink::Route FaultySink::choose_route() noexcept {
  Route route;
  bool chosen = false;
  const auto choose = [&](std::size_t i, Draws&) {
    if (std::exchange(chosen, true)) return;
    const PlannedFault& fault = spec_.faults[i];
    route.away = fault.kind == FaultKind::kAway;
    route.dropped = fault.kind == FaultKind::kDropped;
    route.twice = fault.kind == FaultKind::kDuplicated;
    if (fault.kind == FaultKind::kLate) route.late_by = static_cast<std::uint64_t>(fault.frames);
    record(i, 0, static_cast<std::int64_t>(route.late_by), 0);
  };
  each(FaultKind::kAway, FaultKind::kLate, choose);
  each(FaultKind::kDuplicated, FaultKind::kDuplicated, choose);
  return route;
}

Status FaultySink::send_along(const Frame& frame, const Route& route, Duration timeout) noexcept {
  if (route.late_by > 0) {
    ++counts_.held;
    hold(frame, at_.frame + route.late_by, false);
    return Done{};
  }
  if (route.twice) {
    ++counts_.copies;
    ++counts_.copies_held;
    hold(frame, at_.frame + 1, true);
  }
  const Status status = pass_on(frame, timeout);
  ++(status.ok() ? counts_.delivered : counts_.refused);
  return status;
}

Status FaultySink::pass_on(const Frame& frame, Duration timeout) noexcept {
  Duration left = timeout;
  if (clock_ != nullptr) {
    each(FaultKind::kSlow, FaultKind::kSlow, [&](std::size_t i, Draws&) {
      record(i, 0, 0, engine::seconds(spec_.faults[i].slow_by) * 1e3);
      const Duration asleep = std::min(spec_.faults[i].slow_by, left);
      static_cast<void>(clock_->sleep_until(clock_->now() + asleep));
      left -= asleep;
    });
    if (left <= Duration{} && timeout > Duration{})
      return Error{engine::Fault::kTimeout, 0, "faults: slow"};
  }
  return inner_.send(frame, left);
}

void FaultySink::hold(const Frame& frame, std::uint64_t due, bool is_copy) noexcept {
  const auto free =
      std::find_if(held_.begin(), held_.end(), [](const Held& held) { return !held.used; });
  ENSURE(free != held_.end());
  ENSURE(frame.telemetry_row.size() <= static_cast<std::size_t>(shape_.width_px));
  const auto pixels = frame.pixels->pixels();
  std::copy(pixels.begin(), pixels.end(), free->pixels.pixels().begin());
  free->telemetry_row.assign(frame.telemetry_row.begin(), frame.telemetry_row.end());
  free->frame = frame;
  free->frame.pixels = &free->pixels;
  free->frame.telemetry_row = free->telemetry_row;
  free->frame.truth_mask = nullptr;  // the loop's own, and soon of another frame
  free->due = due;
  free->is_copy = is_copy;
  free->used = true;
}

bool FaultySink::is_due(const Held& held, const Route& route) const noexcept {
  // A copy waits for company, so that there is only ever one; and in lockstep software may leave
  // copies unanswered, but not the frame behind it.
  return held.used && held.due <= at_.frame && !(held.is_copy && route.withheld());
}

/// In the order of their numbers.
std::uint64_t FaultySink::send_held(const Route& route, Duration share) noexcept {
  std::uint64_t last = FrameNews::kNothing;
  for (;;) {
    Held* next = nullptr;
    for (Held& held : held_) {
      if (!is_due(held, route)) continue;
      if (next == nullptr || held.frame.sequence < next->frame.sequence) next = &held;
    }
    if (next == nullptr) return last;
    const bool ok = inner_.send(next->frame, share).ok();
    next->used = false;
    if (next->is_copy) {
      --counts_.copies_held;
      ++(ok ? counts_.copies_delivered : counts_.copies_refused);
    } else {
      --counts_.held;
      ++(ok ? counts_.delivered : counts_.refused);
      if (ok) last = next->frame.sequence;
    }
  }
}

// ---- in the header ----------------------------------------------------------------------------

Duration FaultySink::clock_error() noexcept {
  Duration sum{};
  each(FaultKind::kClock, FaultKind::kClock, [&](std::size_t i, Draws&) {
    const PlannedFault& fault = spec_.faults[i];
    const Duration running = at_.since_start - fault.window.from;
    const Duration off =
        fault.jump + engine::from_seconds(engine::seconds(running) * fault.ppm * 1e-6);
    if (off == Duration{}) return;
    record(i, 0, 0, static_cast<double>(off.count()));
    sum += off;
  });
  return sum;
}

// ---- in the pixels ----------------------------------------------------------------------------

engine::DnImage& FaultySink::writable() noexcept {
  if (pixels_ != &changed_) {
    const auto from = pixels_->pixels();
    std::copy(from.begin(), from.end(), changed_.pixels().begin());
    pixels_ = &changed_;
  }
  return changed_;
}

void FaultySink::damage(const Frame& frame) noexcept {
  pixels_ = frame.pixels;
  bool frozen = false;
  bool torn = false;
  if (has_before_) {
    each(FaultKind::kFrozen, FaultKind::kFrozen, [&](std::size_t i, Draws&) {
      if (std::exchange(frozen, true)) return;
      pixels_ = &before_;
      record(i, 0, 0, static_cast<double>(before_sequence_));
    });
  }
  if (!frozen) {
    each(FaultKind::kRays, FaultKind::kStuckColumn,
         [&](std::size_t i, Draws& draws) { damage_detector(i, draws, frame.bits); });
    if (has_before_ && shape_.height_px > 1) {
      each(FaultKind::kTorn, FaultKind::kTorn, [&](std::size_t i, Draws& draws) {
        if (!std::exchange(torn, true)) tear(i, draws);
      });
    }
    if (remembers_ && !torn) {
      const auto from = pixels_->pixels();
      std::copy(from.begin(), from.end(), before_.pixels().begin());
    }
    has_before_ = remembers_;
    before_sequence_ = frame.sequence;
  }
  each(FaultKind::kFlipped, FaultKind::kFlipped,
       [&](std::size_t i, Draws& draws) { flip(i, draws, frame.bits); });
}

void FaultySink::damage_detector(std::size_t i, Draws& draws, int bits) noexcept {
  const PlannedFault& fault = spec_.faults[i];
  const int full_scale = (1 << bits) - 1;
  if (fault.kind == FaultKind::kRays) {
    const auto tracks = static_cast<int>(draws.poisson(fault.tracks));
    for (int n = 0; n < tracks; ++n) {
      const RayTrack t = add_ray(draws, fault.length_px, fault.dn_per_px, full_scale, writable());
      record(i, t.start, t.pixels, static_cast<double>(t.added_dn));
    }
  } else if (fault.kind == FaultKind::kBlooming) {
    const std::int64_t bright = bloom_.look(*pixels_, full_scale);
    if (bright == 0) return;
    record(i, bright, bloom_.apply(fault.bleed, full_scale, writable()), 0);
  } else {
    const bool hot = fault.kind == FaultKind::kHotColumn;
    for (const int column : fault.columns) {
      const std::int64_t changed = hot ? heat_column(column, fault.dn, full_scale, writable())
                                       : stick_column(column, fault.dn, writable());
      record(i, column, changed, fault.dn);
    }
  }
}

/// Exchanges the lower rows with those of the frame before, which thereby becomes this one.
void FaultySink::tear(std::size_t fault, Draws& draws) noexcept {
  const int height = shape_.height_px;
  const int first = 1 + static_cast<int>(draws.uniform_double() * (height - 1));
  engine::DnImage& now = writable();
  for (int v = 0; v < height; ++v) {
    const auto mine = now.row(v);
    const auto old = before_.row(v);
    if (v < first) {
      std::copy(mine.begin(), mine.end(), old.begin());
    } else {
      std::swap_ranges(mine.begin(), mine.end(), old.begin());
    }
  }
  record(fault, first, height - first, 0);
}

void FaultySink::flip(std::size_t fault, Draws& draws, int bits) noexcept {
  const auto pixels = static_cast<std::int64_t>(pixels_->pixels().size());
  BitFlips flips(draws, spec_.faults[fault].bit_error_rate, pixels * bits);
  std::int64_t first = 0;
  std::int64_t count = 0;
  for (std::int64_t bit = flips.next(); bit >= 0; bit = flips.next(), ++count) {
    if (count == 0) first = bit / bits;
    std::uint16_t& pixel = writable().pixels()[static_cast<std::size_t>(bit / bits)];
    pixel = static_cast<std::uint16_t>(pixel ^ (1U << (bit % bits)));
  }
  if (count > 0) record(fault, first, count, 0);
}

}  // namespace hil
