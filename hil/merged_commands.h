#pragma once

#include <array>
#include <atomic>
#include <semaphore>
#include <thread>

#include "hil/camera_link.h"
#include "hil/spsc_ring.h"

namespace hil {

/// Two sources as one: commands in the order of their arrival, each source's own senders told
/// apart. A thread waits on each.
/// Thread: receiver. Loop-safe once made.
class MergedCommands final : public CommandSource {
 public:
  /// Both outlive it.
  MergedCommands(CommandSource& first, CommandSource& second);
  MergedCommands(const MergedCommands&) = delete;
  MergedCommands& operator=(const MergedCommands&) = delete;

  engine::Expected<Command> receive(engine::Duration timeout) noexcept override;

 private:
  struct Item {
    bool is_fault = false;
    engine::Error fault;
    Command command;
  };
  using Ring = SpscRing<Item, 256>;
  void pump(CommandSource& source, std::uint32_t which, const std::stop_token& stop) noexcept;

  std::array<Ring, 2> rings_;  // each pump -> receiver
  std::counting_semaphore<> count_{0};
  std::atomic<std::uint64_t> lost_{0};
  std::size_t next_ = 0;
  std::array<std::jthread, 2> pumps_;  // the last member: they use the others
};

}  // namespace hil
