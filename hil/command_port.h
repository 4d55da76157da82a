#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "engine/core/config_reader.h"
#include "hil/camera_link.h"
#include "hil/port_counts.h"

namespace hil {

struct CommandPortSpec {
  std::string address = "127.0.0.1";
  std::optional<std::uint16_t> udp_port;  ///< nothing: no UDP; 0: the system chooses
  std::optional<std::uint16_t> tcp_port;  ///< nothing: no TCP; 0: the system chooses
  std::string key_file;                   ///< empty: unsigned packets, on loopback only
  /// A UDP client that has sent nothing good for so long is none any more; a TCP connection that
  /// has not done so for as long after it was made is closed.
  engine::Duration idle_limit = std::chrono::seconds(30);
  /// Where each stands, for complaints.
  std::string address_where = "command_port.address";
  std::string udp_port_where = "command_port.udp_port";
  std::string tcp_port_where = "command_port.tcp_port";
  std::string key_file_where = "command_port.key_file";
};
/// Keys `address`, `udp_port`, `tcp_port`, `key_file`. No port at all where none of them is set.
[[nodiscard]] std::optional<CommandPortSpec> read_command_port(const engine::ConfigTable& table);

/// Who may command, over UDP and TCP, and who is told what the camera does: the Space Packets of
/// protocol.md. Up to 8 UDP clients and 8 TCP clients get all telemetry; pings are answered here
/// and not passed on.
///
/// One thread of its own holds all sockets. What it refuses, drops or loses is counted by cause;
/// nothing that arrives can stop it, make it grow, or keep the loop waiting.
class CommandPort final : public CommandSource, public FrameSink {
 public:
  /// Listens when it returns. Throws ConfigError for an address that is not loopback without a
  /// key, for a key that is none, and for a port that cannot be had.
  explicit CommandPort(const CommandPortSpec& spec);
  ~CommandPort() override;
  CommandPort(const CommandPort&) = delete;
  CommandPort& operator=(const CommandPort&) = delete;

  /// Thread: receiver. kTimeout when nothing came.
  engine::Expected<Command> receive(engine::Duration timeout) noexcept override;
  /// Queues announcement and attitude; every 10th frame time and housekeeping go with them. Never
  /// waits: kBusy when 64 frames are queued already. Thread: sender.
  engine::Status send(const Frame& frame, engine::Duration timeout) noexcept override;
  /// Whether a client is there. Thread: any.
  [[nodiscard]] bool has_reader() const noexcept override;

  /// Thread: any, all three.
  [[nodiscard]] PortCounts counts() const noexcept;
  [[nodiscard]] std::uint16_t udp_port() const noexcept;  ///< 0: none
  [[nodiscard]] std::uint16_t tcp_port() const noexcept;  ///< 0: none

 private:
  class Io;
  std::unique_ptr<Io> io_;
};

}  // namespace hil
