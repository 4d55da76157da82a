#pragma once

#include <atomic>
#include <memory>
#include <semaphore>
#include <thread>
#include <vector>

#include "hil/camera_link.h"
#include "hil/spsc_ring.h"

namespace hil {

/// Several sources as one: commands in the order of their arrival, each source's own senders told
/// apart. A thread waits on each.
/// Thread: receiver. Loop-safe once made.
class MergedCommands final : public CommandSource {
 public:
  static constexpr std::size_t kMost = 8;
  /// All outlive it. Pre: 1 to kMost.
  explicit MergedCommands(const std::vector<CommandSource*>& sources);
  MergedCommands(const MergedCommands&) = delete;
  MergedCommands& operator=(const MergedCommands&) = delete;

  engine::Expected<Command> receive(engine::Duration timeout) noexcept override;

 private:
  struct Item {
    bool is_fault = false;
    engine::Error fault;
    Command command;
  };
  struct Ring : SpscRing<Item, 256> {};
  void pump(CommandSource& source, std::uint32_t which, const std::stop_token& stop) noexcept;

  std::vector<std::unique_ptr<Ring>> rings_;  // each pump -> receiver
  std::counting_semaphore<> count_{0};
  std::atomic<std::uint64_t> lost_{0};
  std::size_t next_ = 0;
  std::vector<std::jthread> pumps_;  // the last member: they use the others
};

}  // namespace hil
