#pragma once

#include <array>
#include <semaphore>
#include <span>

#include "hil/camera_link.h"
#include "hil/spsc_ring.h"

namespace drivers {

/// Packets of hil/space_packet.h on their way from a device to the receiver, who decodes them.
/// Thread: one that pushes, one that receives. Loop-safe.
class PacketQueue {
 public:
  static constexpr std::size_t kPackets = 64;
  static constexpr std::size_t kLargestPacket = 256;

  /// kBusy when as many as fit are waiting; kRejected for one that is too long.
  engine::Status push(std::span<const std::byte> bytes, std::uint32_t sender = 0) noexcept;
  /// kTimeout, and what decode_command() says.
  [[nodiscard]] engine::Expected<hil::Command> receive(engine::Duration timeout) noexcept;

 private:
  struct Packet {
    std::array<std::byte, kLargestPacket> bytes{};
    std::size_t used = 0;
    std::uint32_t sender = 0;
  };
  hil::SpscRing<Packet, kPackets> packets_;
  std::counting_semaphore<> count_{0};
};

}  // namespace drivers
