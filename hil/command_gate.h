#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "engine/core/time.h"
#include "hil/camera_link.h"
#include "hil/refusal.h"

namespace hil {

/// Decides which commands may reach the pointing: of each sender only ever newer ones, and none
/// that is stale, from the future, or no number. A refused command changes nothing but its count.
///
/// Senders are told apart by Command::sender. What is remembered of each is its last sequence and
/// which of the 63 before were obeyed, to tell a duplicate from a late one. Of the 32 places the
/// one that obeyed least recently goes to a newcomer; a sender that comes back after that starts
/// afresh.
/// Thread: receiver. Loop-safe.
class CommandGate {
 public:
  /// A command stamped later than now by more than `most_ahead` is refused.
  explicit CommandGate(engine::Duration most_ahead = std::chrono::seconds(1)) noexcept
      : most_ahead_(most_ahead) {}

  /// Why not; nothing: obey it.
  std::optional<Refusal> admit(const Command& command, engine::SimTime now) noexcept;

  [[nodiscard]] std::uint64_t admitted() const noexcept { return admitted_; }
  [[nodiscard]] const RefusalCounts& refused() const noexcept { return refused_; }

 private:
  static constexpr std::size_t kSenders = 32;
  struct Sender {
    std::uint32_t name = 0;
    std::uint64_t last = 0;
    std::uint64_t obeyed = 0;    ///< bit i: `last` - i was obeyed; 0: nobody has this place
    std::uint64_t heard_at = 0;  ///< admitted_ at its last command
  };

  [[nodiscard]] Sender* find(std::uint32_t name) noexcept;
  [[nodiscard]] std::optional<Refusal> judge(const Command& command, engine::SimTime now) noexcept;
  void remember(const Command& command) noexcept;

  engine::Duration most_ahead_;
  std::array<Sender, kSenders> senders_;
  std::uint64_t admitted_ = 0;
  RefusalCounts refused_;
};

}  // namespace hil
