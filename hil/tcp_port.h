#pragma once

#include <array>
#include <asio/io_context.hpp>
#include <asio/ip/tcp.hpp>
#include <asio/steady_timer.hpp>
#include <list>

#include "hil/packet_intake.h"
#include "hil/space_packet.h"

namespace hil {

/// The stream half of a command port: packets back to back, each as long as its header says. A
/// connection is a client from its first good packet on; one that has not sent any within
/// `first_packet_limit`, or sends what is no packet, is closed. After that it may be silent for as
/// long as it likes. Only command_port.cpp includes this. Thread: io.
class TcpPort {
 public:
  static constexpr std::size_t kMostConnections = 8;

  /// Throws asio::system_error when it cannot listen there.
  TcpPort(asio::io_context& io, const asio::ip::tcp::endpoint& where, PacketIntake& intake,
          engine::Duration first_packet_limit);

  [[nodiscard]] std::uint16_t port() const { return acceptor_.local_endpoint().port(); }
  /// To every client. One that reads too slowly loses its oldest packets.
  void send(const TelemetryPacket& packet);
  void drop_mute(engine::Duration now) noexcept;

 private:
  static constexpr std::size_t kMostWaiting = 64;
  /// A place is free again when it is closed and nothing is under way in it any more.
  struct Connection {
    explicit Connection(asio::io_context& io) : socket(io) {}

    asio::ip::tcp::socket socket;
    bool here = false;
    bool is_client = false;
    bool reading = false;
    bool writing = false;
    std::uint32_t sender = 0;
    engine::Duration since{};
    std::array<std::byte, 4 * kLargestCommandBytes> in;
    std::size_t in_bytes = 0;
    std::array<TelemetryPacket, kMostWaiting> waiting;
    std::size_t first_waiting = 0;
    std::size_t waiting_count = 0;
    TelemetryPacket going;
  };

  void accept();
  void take_connection(asio::ip::tcp::socket socket);
  void read(Connection& c);
  /// False: this is no stream of packets of ours.
  [[nodiscard]] bool take_packets(Connection& c);
  [[nodiscard]] bool take_packet(Connection& c, std::span<const std::byte> packet);
  void queue(Connection& c, const TelemetryPacket& packet);
  void write(Connection& c);
  void close(Connection& c) noexcept;

  asio::ip::tcp::acceptor acceptor_;
  asio::steady_timer accept_again_;
  PacketIntake& intake_;
  engine::Duration first_packet_limit_;
  std::list<Connection> connections_;  ///< kMostConnections of them, for ever
};

}  // namespace hil
