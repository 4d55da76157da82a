#include "hil/udp_port.h"

#include <sys/socket.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "hil/space_packet.h"
#include "hil/steady_clock.h"

namespace hil {
namespace {

using asio::ip::udp;
using engine::Duration;

constexpr int kReceiveBuffer_bytes = 1 << 20;
constexpr int kDatagramsInARow = 64;  // before telemetry and streams get their turn

/// How many datagrams the system has dropped on this socket so far, if it says so.
bool find_lost(msghdr& message, std::uint32_t& lost) noexcept {
  for (cmsghdr* c = CMSG_FIRSTHDR(&message); c != nullptr; c = CMSG_NXTHDR(&message, c)) {
    if (c->cmsg_level != SOL_SOCKET || c->cmsg_type != SO_RXQ_OVFL) continue;
    std::memcpy(&lost, CMSG_DATA(c), sizeof lost);
    return true;
  }
  return false;
}

}  // namespace

UdpPort::UdpPort(asio::io_context& io, const udp::endpoint& where, PacketIntake& intake,
                 Duration idle_limit)
    : socket_(io, where), intake_(intake), idle_limit_(idle_limit) {
  // Bursts wait in the kernel; where it gives less room, it counts what it drops.
  asio::error_code ignored;
  socket_.set_option(asio::socket_base::receive_buffer_size(kReceiveBuffer_bytes), ignored);
  const int on = 1;
  static_cast<void>(::setsockopt(socket_.native_handle(), SOL_SOCKET, SO_RXQ_OVFL, &on, sizeof on));
  wait();
}

void UdpPort::wait() {
  socket_.async_wait(udp::socket::wait_read, [this](const asio::error_code& error) {
    if (error == asio::error::operation_aborted) return;
    drain();
    wait();
  });
}

void UdpPort::drain() noexcept {
  for (int i = 0; i < kDatagramsInARow; ++i)
    if (!read_one()) return;
}

bool UdpPort::read_one() noexcept {
  // A byte more than the longest command: what fills it is too long, however long it was.
  std::array<std::byte, kLargestCommandBytes + 1> bytes;
  alignas(cmsghdr) std::array<char, 64> control;
  udp::endpoint from;
  iovec into{bytes.data(), bytes.size()};
  msghdr message{};
  message.msg_name = from.data();
  message.msg_namelen = static_cast<socklen_t>(from.capacity());
  message.msg_iov = &into;
  message.msg_iovlen = 1;
  message.msg_control = control.data();
  message.msg_controllen = control.size();
  const ssize_t got = ::recvmsg(socket_.native_handle(), &message, MSG_DONTWAIT);
  if (got < 0) {
    if (errno == EINTR) return true;
    if (errno != EAGAIN && errno != EWOULDBLOCK) intake_.counts().add(PortCount::kSystem);
    return false;
  }
  if (std::uint32_t lost = 0; find_lost(message, lost)) {
    intake_.counts().add(PortCount::kKernelLost, lost - kernel_lost_);
    kernel_lost_ = lost;
  }
  from.resize(message.msg_namelen);
  take(std::span(bytes).first(static_cast<std::size_t>(got)), from);
  return true;
}

void UdpPort::take(std::span<const std::byte> datagram, const udp::endpoint& from) noexcept {
  const PacketIntake::Verdict verdict = intake_.check(datagram);
  if (!verdict.good()) return;
  Client* client = client_at(from);
  if (client == nullptr) {
    intake_.refuse();
    return;
  }
  client->heard_at = SteadyClock::stopwatch();
  if (const auto pong = intake_.deliver(verdict.command, client->sender)) send_to(*client, *pong);
}

/// The client that this endpoint is, or becomes; null: there is no place.
UdpPort::Client* UdpPort::client_at(const udp::endpoint& from) noexcept {
  const auto known = std::find_if(clients_.begin(), clients_.end(),
                                  [&from](const Client& c) { return c.here && c.where == from; });
  if (known != clients_.end()) return &*known;
  const auto free =
      std::find_if(clients_.begin(), clients_.end(), [](const Client& c) { return !c.here; });
  if (free == clients_.end()) return nullptr;
  *free = {.here = true, .where = from, .sender = intake_.new_sender(), .heard_at = {}};
  intake_.client_came();
  return &*free;
}

void UdpPort::drop_idle(Duration now) noexcept {
  for (Client& client : clients_) {
    if (!client.here || now - client.heard_at < idle_limit_) continue;
    client.here = false;
    intake_.client_left();
  }
}

void UdpPort::send(const TelemetryPacket& packet) noexcept {
  for (const Client& client : clients_)
    if (client.here) send_to(client, packet);
}

void UdpPort::send_to(const Client& client, const TelemetryPacket& packet) noexcept {
  const ssize_t sent = ::sendto(socket_.native_handle(), packet.storage.data(), packet.used,
                                MSG_DONTWAIT | MSG_NOSIGNAL, client.where.data(),
                                static_cast<socklen_t>(client.where.size()));
  intake_.counts().add(sent < 0 ? PortCount::kTelemetryLost : PortCount::kTelemetrySent);
}

}  // namespace hil
