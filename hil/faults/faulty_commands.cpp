#include "hil/faults/faulty_commands.h"

#include <algorithm>

#include "hil/space_packet.h"

namespace hil {

using engine::Duration;
using engine::Error;
using engine::Expected;

namespace {

constexpr Duration kLook{2'000'000};  // how often lockstep looks for frames that never went out
constexpr int kMostNews = 64;         // at a time, so that there is always room for stand-ins
constexpr std::uint64_t kAnswersNone = Command{}.answers_frame;

}  // namespace

FaultyCommands::FaultyCommands(const FaultSpec& spec, CommandSource& inner, FrameNewsRing& news,
                               Pace pace)
    : spec_(spec), inner_(inner), news_(news), pace_(pace), happened_(spec.faults.size()) {}

Expected<Command> FaultyCommands::receive(Duration timeout) noexcept {
  Command next;
  if (ready_.pop(next)) return next;
  read_news();
  if (ready_.pop(next)) return next;
  const bool looks = pace_ == Pace::kLockstep && !spec_.faults.empty();
  const Expected<Command> got = inner_.receive(looks ? std::min(timeout, kLook) : timeout);
  if (!got.ok()) return got;
  read_news();
  const bool sound = take(got.value());
  note_answer(got.value());
  if (!sound) return Error{engine::Fault::kRejected, 0, "faults: corrupted"};
  if (ready_.pop(next)) return next;
  return Error{engine::Fault::kTimeout, 0, "faults: lost or delayed"};
}

void FaultyCommands::read_news() noexcept {
  FrameNews news;
  for (int n = 0; n < kMostNews && news_.pop(news); ++n) {
    at_ = news.at;
    if (!news.withheld) continue;
    if (news.after == FrameNews::kNothing || news.after == last_answered_) {
      stand_in_for(news.at.frame);
    } else {
      waits_ = news;
    }
  }
}

void FaultyCommands::note_answer(const Command& command) noexcept {
  if (command.answers_frame == kAnswersNone || command.more_follow) return;
  last_answered_ = command.answers_frame;
  if (!waits_.withheld || waits_.after != last_answered_) return;
  waits_.withheld = false;
  stand_in_for(waits_.at.frame);
}

bool FaultyCommands::take(const Command& command) noexcept {
  number_ = counts_.taken++;
  release_delayed();
  const std::size_t fault = choose();
  const FaultKind kind =
      fault < spec_.faults.size() ? spec_.faults[fault].kind : FaultKind::kDropped;
  if (kind == FaultKind::kCommandLost) {
    record(fault, 0);
    ++counts_.lost;
    stand_in_for(command);
    return true;
  }
  if (kind == FaultKind::kCommandDelayed) {
    record(fault, spec_.faults[fault].commands);
    const auto free =
        std::find_if(held_.begin(), held_.end(), [](const Held& held) { return !held.used; });
    ENSURE(free != held_.end());
    *free = {command, number_ + static_cast<std::uint64_t>(spec_.faults[fault].commands), true};
    ++counts_.held;
    stand_in_for(command);
    return true;
  }
  Command out = command;
  if (kind == FaultKind::kCommandCorrupted) {
    record(fault, spec_.faults[fault].bits);
    const Expected<Command> arrived = corrupted(command, fault);
    if (!arrived.ok()) {
      ++counts_.refused;
      stand_in_for(command);
      return false;
    }
    out = arrived.value();
  }
  ++counts_.delivered;
  make_ready(out);
  if (kind == FaultKind::kCommandDuplicated) {
    record(fault, 0);
    ++counts_.copies;
    make_ready(out);
  }
  return true;
}

void FaultyCommands::release_delayed() noexcept {
  for (;;) {
    Held* next = nullptr;
    for (Held& held : held_)
      if (held.used && held.due <= number_ && (next == nullptr || held.due < next->due))
        next = &held;
    if (next == nullptr) return;
    next->used = false;
    --counts_.held;
    ++counts_.delivered;
    make_ready(next->command);
  }
}

std::size_t FaultyCommands::choose() const noexcept {
  for (std::size_t i = 0; i < spec_.faults.size(); ++i) {
    const PlannedFault& fault = spec_.faults[i];
    if (!is_command_fault(fault.kind) || !fault.window.holds(at_)) continue;
    if (fault.draws(spec_.seed, number_).uniform_double() < fault.window.probability) return i;
  }
  return spec_.faults.size();
}

/// Through the packet and back: what the checksum lets pass is a command again.
Expected<Command> FaultyCommands::corrupted(const Command& command,
                                            std::size_t fault) const noexcept {
  engine::Draws draws = spec_.faults[fault].draws(spec_.seed, number_);
  static_cast<void>(draws.uniform_double());  // whether at all
  CommandPacket packet = encode_command(command);
  // Distinct, else two would be none: each in a stretch of its own.
  const auto bits = static_cast<std::size_t>(spec_.faults[fault].bits);
  const double stretch = static_cast<double>(8 * packet.used) / static_cast<double>(bits);
  for (std::size_t n = 0; n < bits; ++n) {
    const auto first = static_cast<std::size_t>(stretch * static_cast<double>(n));
    const auto end = static_cast<std::size_t>(stretch * static_cast<double>(n + 1));
    const auto off =
        static_cast<std::size_t>(draws.uniform_double() * static_cast<double>(end - first));
    const std::size_t bit = first + off;
    packet.storage[bit / 8] ^= static_cast<std::byte>(1U << (bit % 8));
  }
  Expected<Command> arrived = decode_command(packet.bytes());
  if (!arrived.ok()) return arrived;
  Command out = arrived.value();
  out.sender = command.sender;
  return out;
}

void FaultyCommands::make_ready(const Command& command) noexcept { ENSURE(ready_.push(command)); }

void FaultyCommands::stand_in_for(const Command& command) noexcept {
  // Of an answer in parts the last is what the loop waits for.
  if (command.answers_frame != kAnswersNone && !command.more_follow)
    stand_in_for(command.answers_frame);
}

void FaultyCommands::stand_in_for(std::uint64_t frame) noexcept {
  if (pace_ != Pace::kLockstep) return;
  Command report;
  report.sequence = counts_.stand_ins++;
  report.answers_frame = frame;
  report.sender = kStandIn;
  make_ready(report);
}

void FaultyCommands::record(std::size_t fault, std::int64_t count) noexcept {
  ++happened_[fault];
  FaultRecord r;
  r.frame = at_.frame;
  r.command = number_;
  r.since_start = at_.since_start;
  r.fault = fault;
  r.kind = spec_.faults[fault].kind;
  r.count = count;
  if (!records_.push(r)) ++counts_.records_lost;
}

}  // namespace hil
