#include "hil/merged_commands.h"

namespace hil {

using engine::Duration;
using engine::Error;
using engine::Expected;
using engine::Fault;

namespace {

constexpr Duration kPatience{50'000'000};  // how often a pump looks for the stop

}  // namespace

MergedCommands::MergedCommands(CommandSource& first, CommandSource& second)
    : pumps_{std::jthread([this, &first](const std::stop_token& s) { pump(first, 0, s); }),
             std::jthread([this, &second](const std::stop_token& s) { pump(second, 1, s); })} {}

void MergedCommands::pump(CommandSource& source, std::uint32_t which,
                          const std::stop_token& stop) noexcept {
  while (!stop.stop_requested()) {
    const Expected<Command> command = source.receive(kPatience);
    Item item;
    if (command.ok()) {
      item.command = command.value();
      // The top bit says which source; senders with a name of their own up there keep it.
      if (which == 1) item.command.sender |= 0x80000000U;
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
    if (rings_[which].push(item)) {
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
  // In turns, so that a flood on one source does not silence the other.
  for (std::size_t i = 0; i < rings_.size(); ++i) {
    Item item;
    next_ = 1 - next_;
    if (!rings_[next_].pop(item)) continue;
    if (item.is_fault) return item.fault;
    return item.command;
  }
  return Error{Fault::kTimeout, 0, "merged commands"};
}

}  // namespace hil
