#include "drivers/packet_queue.h"

#include <algorithm>

#include "hil/space_packet.h"

namespace drivers {

using engine::Done;
using engine::Error;
using engine::Expected;
using engine::Fault;

engine::Status PacketQueue::push(std::span<const std::byte> bytes, std::uint32_t sender) noexcept {
  if (bytes.size() > kLargestPacket) return Error{Fault::kRejected, 0, "link: packet too long"};
  Packet packet;
  std::copy(bytes.begin(), bytes.end(), packet.bytes.begin());
  packet.used = bytes.size();
  packet.sender = sender;
  if (!packets_.push(packet)) return Error{Fault::kBusy, 0, "link: packets that nobody took"};
  count_.release();
  return Done{};
}

Expected<hil::Command> PacketQueue::receive(engine::Duration timeout) noexcept {
  Packet packet;
  if (!count_.try_acquire_for(timeout) || !packets_.pop(packet))
    return Error{Fault::kTimeout, 0, "link: no packet"};
  const auto command = hil::decode_command(std::span(packet.bytes).first(packet.used));
  if (!command.ok()) return command;
  hil::Command c = command.value();
  c.sender = packet.sender;
  return c;
}

}  // namespace drivers
