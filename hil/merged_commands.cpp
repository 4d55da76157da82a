#include "hil/merged_commands.h"

namespace hil {

using engine::Duration;
using engine::Error;
using engine::Expected;
using engine::Fault;

namespace {

constexpr Duration kPatience{50'000'000};  // how often a pump looks for the stop
constexpr unsigned kSourceAt = 29;
constexpr std::uint32_t kOwn = (1U << kSourceAt) - 1;

}  // namespace

MergedCommands::MergedCommands(const std::vector<CommandSource*>& sources) {
  ENSURE(!sources.empty() && sources.size() <= kMost);
  for (std::size_t i = 0; i < sources.size(); ++i) rings_.push_back(std::make_unique<Ring>());
  for (std::uint32_t i = 0; i < sources.size(); ++i)
    pumps_.emplace_back(
        [this, source = sources[i], i](const std::stop_token& stop) { pump(*source, i, stop); });
}

void MergedCommands::pump(CommandSource& source, std::uint32_t which,
                          const std::stop_token& stop) noexcept {
  while (!stop.stop_requested()) {
    const Expected<Command> command = source.receive(kPatience);
    Item item;
    if (command.ok()) {
      item.command = command.value();
      // The top bits say which source.
      item.command.sender = (item.command.sender & kOwn) | which << kSourceAt;
    } else if (command.error().fault == Fault::kTimeout) {
      continue;
    } else if (command.error().fault == Fault::kDisconnected) {
      // Nobody is there: look again later, without eating a core.
      std::this_thread::sleep_for(kPatience / 10);
      continue;
    } else {
      item.is_fault = true;
      item.fault = command.error();
    }
    if (rings_[which]->push(item)) {
      count_.release();
    } else {
      lost_.fetch_add(1, std::memory_order_relaxed);
    }
  }
}

Expected<Command> MergedCommands::receive(Duration timeout) noexcept {
  if (lost_.load(std::memory_order_relaxed) > 0) {
    lost_.fetch_sub(1, std::memory_order_relaxed);
    return Error{Fault::kBusy, 0, "commands came faster than they were taken"};
  }
  if (!count_.try_acquire_for(timeout)) return Error{Fault::kTimeout, 0, "merged commands"};
  // In turns, so that a flood on one source does not silence another.
  for (std::size_t i = 0; i < rings_.size(); ++i) {
    Item item;
    next_ = (next_ + 1) % rings_.size();
    if (!rings_[next_]->pop(item)) continue;
    if (item.is_fault) return item.fault;
    return item.command;
  }
  return Error{Fault::kTimeout, 0, "merged commands"};
}

}  // namespace hil
