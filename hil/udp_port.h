#pragma once

#include <array>
#include <asio/io_context.hpp>
#include <asio/ip/udp.hpp>

#include "hil/packet_intake.h"

namespace hil {

/// The datagram half of a command port: one packet a datagram. An endpoint is a client from its
/// first good packet until it has sent none for `idle_limit`. Only command_port.cpp includes this.
/// Thread: io.
class UdpPort {
 public:
  static constexpr std::size_t kMostClients = 8;

  /// Throws asio::system_error when it cannot listen there.
  UdpPort(asio::io_context& io, const asio::ip::udp::endpoint& where, PacketIntake& intake,
          engine::Duration idle_limit);

  [[nodiscard]] std::uint16_t port() const { return socket_.local_endpoint().port(); }
  /// To every client. What the system has no room for is lost, and counted.
  void send(const TelemetryPacket& packet) noexcept;
  void drop_idle(engine::Duration now) noexcept;

 private:
  struct Client {
    bool here = false;
    asio::ip::udp::endpoint where;
    std::uint32_t sender = 0;
    engine::Duration heard_at{};
  };

  void wait();
  void drain() noexcept;
  /// False: nothing more to read for now.
  [[nodiscard]] bool read_one() noexcept;
  void take(std::span<const std::byte> datagram, const asio::ip::udp::endpoint& from) noexcept;
  [[nodiscard]] Client* client_at(const asio::ip::udp::endpoint& from) noexcept;
  void send_to(const Client& client, const TelemetryPacket& packet) noexcept;

  asio::ip::udp::socket socket_;
  PacketIntake& intake_;
  engine::Duration idle_limit_;
  std::array<Client, kMostClients> clients_;
  std::uint32_t kernel_lost_ = 0;  ///< as the system counts them, modulo 2^32
};

}  // namespace hil
