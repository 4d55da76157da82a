#pragma once

#include <atomic>
#include <cstdint>
#include <optional>
#include <semaphore>
#include <span>

#include "hil/packet_auth.h"
#include "hil/port_counts.h"
#include "hil/spsc_ring.h"
#include "hil/telemetry_packet.h"

namespace hil {

/// What a command port does with a packet, by whichever socket it came: looks at it, counts it,
/// answers a ping, hands a command to the loop.
///
/// With a key, a packet is good only when its sequence is above that of every packet signed before,
/// whoever sent it: what is recorded on one connection is worth nothing on another.
/// Thread: io, where nothing else is said.
class PacketIntake {
 public:
  explicit PacketIntake(std::optional<PacketKey> key) noexcept : key_(std::move(key)) {}

  struct Verdict {
    PortCount end = PortCount::kPassedOn;  ///< what it is to be counted as when it is refused
    Command command;

    [[nodiscard]] bool good() const noexcept { return end == PortCount::kPassedOn; }
  };
  /// Counts why it is refused. A good one is counted by deliver() or refuse(), one of which it is
  /// still to be given to.
  [[nodiscard]] Verdict check(std::span<const std::byte> packet) noexcept;
  /// The answer to a ping; nothing for all else, which goes to the loop.
  [[nodiscard]] std::optional<TelemetryPacket> deliver(Command command,
                                                       std::uint32_t sender) noexcept;
  /// There is no place for the client that sent it.
  void refuse() noexcept { counts_.add(PortCount::kTooManyClients); }
  /// What pongs say of the last frame.
  void announce(const FrameNews& news) noexcept { last_ = news; }

  [[nodiscard]] std::uint32_t new_sender() noexcept { return next_sender_++; }
  void client_came() noexcept { clients_.fetch_add(1, std::memory_order_relaxed); }
  void client_left() noexcept { clients_.fetch_sub(1, std::memory_order_relaxed); }

  /// Thread: receiver.
  [[nodiscard]] engine::Expected<Command> receive(engine::Duration timeout) noexcept;
  /// Thread: any.
  [[nodiscard]] int clients() const noexcept { return clients_.load(std::memory_order_relaxed); }
  /// Thread: any.
  [[nodiscard]] PortCounters& counts() noexcept { return counts_; }
  [[nodiscard]] const PortCounters& counts() const noexcept { return counts_; }

 private:
  std::optional<PacketKey> key_;
  std::optional<std::uint64_t> last_signed_;
  std::uint32_t next_sender_ = 1;
  std::uint64_t pongs_ = 0;
  FrameNews last_;
  std::atomic<int> clients_{0};
  PortCounters counts_;
  SpscRing<Command, 1024> commands_;  // io -> receiver
  std::counting_semaphore<> command_count_{0};
};

}  // namespace hil
