#include "hil/tcp_port.h"

#include <algorithm>
#include <asio/buffer.hpp>
#include <asio/write.hpp>

#include "hil/steady_clock.h"

namespace hil {
namespace {

using asio::ip::tcp;
using engine::Duration;
using Error = asio::error_code;

constexpr int kSendBuffer_bytes = 1 << 16;  // a slow reader is not to read of the distant past
constexpr auto kAcceptAgain = std::chrono::milliseconds(100);

/// Refusals after which nothing on the stream can be believed any more.
bool breaks_trust(PortCount end) noexcept {
  return end == PortCount::kMalformed || end == PortCount::kChecksum ||
         end == PortCount::kUnsigned || end == PortCount::kBadSignature;
}

}  // namespace

TcpPort::TcpPort(asio::io_context& io, const tcp::endpoint& where, PacketIntake& intake,
                 Duration first_packet_limit)
    : acceptor_(io, where),
      accept_again_(io),
      intake_(intake),
      first_packet_limit_(first_packet_limit) {
  for (std::size_t i = 0; i < kMostConnections; ++i) connections_.emplace_back(io);
  accept();
}

void TcpPort::accept() {
  acceptor_.async_accept([this](const Error& error, tcp::socket socket) {
    if (error == asio::error::operation_aborted) return;
    if (!error) {
      take_connection(std::move(socket));
      accept();
      return;
    }
    // No descriptors left: the connection still waits, and asking at once would eat a core.
    intake_.counts().add(PortCount::kSystem);
    accept_again_.expires_after(kAcceptAgain);
    accept_again_.async_wait([this](const Error& stopped) {
      if (!stopped) accept();
    });
  });
}

void TcpPort::take_connection(tcp::socket socket) {
  const auto place =
      std::find_if(connections_.begin(), connections_.end(),
                   [](const Connection& c) { return !c.here && !c.reading && !c.writing; });
  if (place == connections_.end()) {
    intake_.counts().add(PortCount::kConnectionsRefused);
    return;
  }
  intake_.counts().add(PortCount::kConnections);
  Error ignored;
  socket.set_option(tcp::no_delay(true), ignored);
  socket.set_option(asio::socket_base::keep_alive(true), ignored);
  socket.set_option(asio::socket_base::send_buffer_size(kSendBuffer_bytes), ignored);
  Connection& c = *place;
  c.socket = std::move(socket);
  c.here = true;
  c.is_client = false;
  c.sender = intake_.new_sender();
  c.since = SteadyClock::stopwatch();
  c.in_bytes = 0;
  c.waiting_count = 0;
  read(c);
}

void TcpPort::read(Connection& c) {
  c.reading = true;
  c.socket.async_read_some(asio::buffer(c.in.data() + c.in_bytes, c.in.size() - c.in_bytes),
                           [this, &c](const Error& error, std::size_t bytes) {
                             c.reading = false;
                             if (!c.here) return;
                             if (error) {
                               if (c.in_bytes > 0) intake_.counts().add(PortCount::kCutShort);
                               close(c);
                               return;
                             }
                             c.in_bytes += bytes;
                             if (take_packets(c)) {
                               read(c);
                             } else {
                               intake_.counts().add(PortCount::kConnectionsClosed);
                               close(c);
                             }
                           });
}

bool TcpPort::take_packets(Connection& c) {
  std::span<const std::byte> rest = std::span(c.in).first(c.in_bytes);
  while (rest.size() >= kPrimaryHeaderBytes) {
    if (!may_be_command(rest)) {
      intake_.counts().add(PortCount::kMalformed);
      return false;
    }
    const std::size_t bytes = packet_bytes(rest);
    if (rest.size() < bytes) break;
    if (!take_packet(c, rest.first(bytes))) return false;
    rest = rest.subspan(bytes);
  }
  std::copy(rest.begin(), rest.end(), c.in.begin());
  c.in_bytes = rest.size();
  return true;
}

bool TcpPort::take_packet(Connection& c, std::span<const std::byte> packet) {
  const PacketIntake::Verdict verdict = intake_.check(packet);
  if (!verdict.good()) return !breaks_trust(verdict.end);
  if (!c.is_client) {
    c.is_client = true;
    intake_.client_came();
  }
  if (const auto pong = intake_.deliver(verdict.command, c.sender)) queue(c, *pong);
  return true;
}

void TcpPort::send(const TelemetryPacket& packet) {
  for (Connection& c : connections_)
    if (c.here && c.is_client) queue(c, packet);
}

void TcpPort::queue(Connection& c, const TelemetryPacket& packet) {
  if (c.waiting_count == kMostWaiting) {
    intake_.counts().add(PortCount::kTelemetryLost);
    c.first_waiting = (c.first_waiting + 1) % kMostWaiting;
    --c.waiting_count;
  }
  c.waiting[(c.first_waiting + c.waiting_count++) % kMostWaiting] = packet;
  if (!c.writing) write(c);
}

void TcpPort::write(Connection& c) {
  c.going = c.waiting[c.first_waiting];
  c.first_waiting = (c.first_waiting + 1) % kMostWaiting;
  --c.waiting_count;
  c.writing = true;
  asio::async_write(
      c.socket, asio::buffer(c.going.storage.data(), c.going.used),
      [this, &c](const Error& error, std::size_t /*bytes*/) {
        c.writing = false;
        intake_.counts().add(error ? PortCount::kTelemetryLost : PortCount::kTelemetrySent);
        if (!c.here) return;
        if (error) {
          close(c);
        } else if (c.waiting_count > 0) {
          write(c);
        }
      });
}

void TcpPort::close(Connection& c) noexcept {
  intake_.counts().add(PortCount::kTelemetryLost, c.waiting_count);
  c.waiting_count = 0;
  c.here = false;
  if (c.is_client) intake_.client_left();
  Error ignored;
  c.socket.close(ignored);
}

void TcpPort::drop_mute(Duration now) noexcept {
  for (Connection& c : connections_) {
    if (!c.here || c.is_client || now - c.since < first_packet_limit_) continue;
    if (c.in_bytes > 0) intake_.counts().add(PortCount::kCutShort);
    intake_.counts().add(PortCount::kConnectionsClosed);
    close(c);
  }
}

}  // namespace hil
