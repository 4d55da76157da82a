#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>

namespace hil {

/// What a command port counts. The numbers are those of protocol.md.
///
/// Every packet that arrives ends in exactly one of the first ten: kPackets is their sum.
enum class PortCount : std::uint8_t {
  kPassedOn = 0,             ///< commands, handed to the loop
  kPings = 1,                ///< answered
  kMalformed = 2,            ///< no packet of ours: length, version, type, APID, protocol, flags
  kChecksum = 3,             ///< damaged
  kUnsigned = 4,             ///< we have a key, the packet has no signature
  kBadSignature = 5,         ///< not made with our key, or we have none
  kReplayed = 6,             ///< signed, with a sequence that is not above all signed before
  kBadValue = 7,             ///< a number that is none, or out of its range
  kTooManyClients = 8,       ///< from a UDP endpoint for which there was no place
  kQueueFull = 9,            ///< the loop did not take them fast enough
  kPackets = 10,             ///< not counted: the sum of the ends, at any moment
  kKernelLost = 11,          ///< datagrams that the operating system had no room for
  kConnections = 12,         ///< TCP, taken
  kConnectionsRefused = 13,  ///< TCP, no place
  kConnectionsClosed = 14,   ///< TCP, by us: not our protocol, not our key, or nothing said at all
  kCutShort = 15,            ///< TCP, ended inside a packet
  kTelemetrySent = 16,       ///< packets, to all clients together
  kTelemetryLost = 17,       ///< packets that a slow reader did not get
  kFramesLost = 18,          ///< frames whose telemetry nobody got: we were too slow
  kSystem = 19,              ///< what the operating system refused
};
inline constexpr std::size_t kPortCounts = 20;
inline constexpr std::size_t kPacketEnds = 10;

/// One word, for reports and tables.
[[nodiscard]] constexpr const char* name(PortCount count) noexcept {
  constexpr std::array<const char*, kPortCounts> kNames{"passed_on",
                                                        "pings",
                                                        "malformed",
                                                        "checksum",
                                                        "unsigned",
                                                        "bad_signature",
                                                        "replayed",
                                                        "bad_value",
                                                        "too_many_clients",
                                                        "queue_full",
                                                        "packets",
                                                        "kernel_lost",
                                                        "connections",
                                                        "connections_refused",
                                                        "connections_closed",
                                                        "cut_short",
                                                        "telemetry_sent",
                                                        "telemetry_lost",
                                                        "frames_lost",
                                                        "system"};
  return kNames[static_cast<std::size_t>(count)];
}

/// The counts at one moment.
struct PortCounts {
  std::array<std::uint64_t, kPortCounts> values{};

  [[nodiscard]] std::uint64_t operator[](PortCount count) const noexcept {
    return values[static_cast<std::size_t>(count)];
  }
};

/// The counts while they grow. Thread: any.
class PortCounters {
 public:
  void add(PortCount count, std::uint64_t n = 1) noexcept {
    values_[static_cast<std::size_t>(count)].fetch_add(n, std::memory_order_relaxed);
  }
  [[nodiscard]] PortCounts now() const noexcept {
    PortCounts counts;
    for (std::size_t i = 0; i < kPortCounts; ++i)
      counts.values[i] = values_[i].load(std::memory_order_relaxed);
    for (std::size_t i = 0; i < kPacketEnds; ++i)
      counts.values[static_cast<std::size_t>(PortCount::kPackets)] += counts.values[i];
    return counts;
  }

 private:
  std::array<std::atomic<std::uint64_t>, kPortCounts> values_{};
};

}  // namespace hil
