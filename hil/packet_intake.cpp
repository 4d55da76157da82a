#include "hil/packet_intake.h"

#include "hil/space_packet.h"
#include "hil/steady_clock.h"

namespace hil {
namespace {

PortCount end_of(PacketFault fault) noexcept {
  switch (fault) {
    case PacketFault::kMalformed:
      return PortCount::kMalformed;
    case PacketFault::kChecksum:
      return PortCount::kChecksum;
    case PacketFault::kUnsigned:
      return PortCount::kUnsigned;
    case PacketFault::kSignature:
      return PortCount::kBadSignature;
    case PacketFault::kValue:
      return PortCount::kBadValue;
  }
  return PortCount::kMalformed;
}

}  // namespace

PacketIntake::Verdict PacketIntake::check(std::span<const std::byte> packet) noexcept {
  const auto decoded = decode_command(packet, key_ ? &*key_ : nullptr);
  Verdict verdict;
  if (!decoded.ok()) {
    verdict.end = end_of(static_cast<PacketFault>(decoded.error().code));
  } else {
    verdict.command = decoded.value();
    const std::uint64_t sequence = verdict.command.sequence;
    if (key_ && last_signed_ && sequence <= *last_signed_) {
      verdict.end = PortCount::kReplayed;
    } else {
      last_signed_ = sequence;
    }
  }
  if (!verdict.good()) counts_.add(verdict.end);
  return verdict;
}

std::optional<TelemetryPacket> PacketIntake::deliver(Command command,
                                                     std::uint32_t sender) noexcept {
  if (command.kind == CommandKind::kPing) {
    counts_.add(PortCount::kPings);
    const Pong pong{last_.frame, last_.shutter_open, command.sequence, command.made_at,
                    SteadyClock::stopwatch()};
    return encode_telemetry(pong, pongs_++);
  }
  command.sender = sender;
  if (commands_.push(command)) {
    counts_.add(PortCount::kPassedOn);
    command_count_.release();
  } else {
    counts_.add(PortCount::kQueueFull);
  }
  return std::nullopt;
}

engine::Expected<Command> PacketIntake::receive(engine::Duration timeout) noexcept {
  Command command;
  if (!command_count_.try_acquire_for(timeout) || !commands_.pop(command))
    return engine::Error{engine::Fault::kTimeout, 0, "command port"};
  return command;
}

}  // namespace hil
