#pragma once

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <thread>
#include <vector>

#include "hil/space_packet.h"
#include "hil/telemetry_packet.h"

/// The other side of a command port: plain sockets on 127.0.0.1, with nothing of ours below the
/// packets. Only a test that fails waits as long as it may.
namespace port_clients {

using Bytes = std::vector<std::byte>;
constexpr int kPatience_ms = 20'000;

/// False: it did not become true in time.
template <class Condition>
[[nodiscard]] bool eventually(const Condition& condition) {
  const auto give_up = std::chrono::steady_clock::now() + std::chrono::milliseconds(kPatience_ms);
  while (!condition()) {
    if (std::chrono::steady_clock::now() > give_up) return false;
    std::this_thread::yield();
  }
  return true;
}

class Socket {
 public:
  Socket(int type, std::uint16_t port, int receive_buffer_bytes = 0)
      : fd_(::socket(AF_INET, type | SOCK_CLOEXEC, 0)) {
    if (receive_buffer_bytes > 0)
      ::setsockopt(fd_, SOL_SOCKET, SO_RCVBUF, &receive_buffer_bytes, sizeof receive_buffer_bytes);
    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_port = htons(port);
    to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    connected_ = ::connect(fd_, reinterpret_cast<const sockaddr*>(&to), sizeof to) == 0;
  }
  ~Socket() { ::close(fd_); }
  Socket(const Socket&) = delete;
  Socket& operator=(const Socket&) = delete;

  [[nodiscard]] bool connected() const { return connected_; }
  [[nodiscard]] int fd() const { return fd_; }
  bool send(std::span<const std::byte> bytes) const {
    return ::send(fd_, bytes.data(), bytes.size(), MSG_NOSIGNAL) ==
           static_cast<ssize_t>(bytes.size());
  }
  [[nodiscard]] bool readable(int timeout_ms = kPatience_ms) const {
    pollfd p{fd_, POLLIN, 0};
    return ::poll(&p, 1, timeout_ms) == 1;
  }

 private:
  int fd_;
  bool connected_ = false;
};

/// One packet a datagram.
class UdpClient : public Socket {
 public:
  explicit UdpClient(std::uint16_t port) : Socket(SOCK_DGRAM, port) {}

  /// Empty: nothing came.
  [[nodiscard]] Bytes read() const {
    Bytes bytes(2048);
    if (!readable()) return {};
    const ssize_t n = ::recv(fd(), bytes.data(), bytes.size(), 0);
    bytes.resize(n > 0 ? static_cast<std::size_t>(n) : 0);
    return bytes;
  }
};

/// Packets back to back.
class TcpClient : public Socket {
 public:
  explicit TcpClient(std::uint16_t port, int receive_buffer_bytes = 0)
      : Socket(SOCK_STREAM, port, receive_buffer_bytes) {}

  /// Empty: the stream ended, or nothing came.
  [[nodiscard]] Bytes read() const {
    Bytes bytes = exactly(hil::kPrimaryHeaderBytes);
    if (bytes.empty()) return {};
    const Bytes rest = exactly(hil::packet_bytes(bytes) - bytes.size());
    bytes.insert(bytes.end(), rest.begin(), rest.end());
    return bytes;
  }
  /// Whether the other side closes the stream, whatever it sends before.
  [[nodiscard]] bool ends() const {
    std::array<std::byte, 4096> bytes;
    while (readable())
      if (::recv(fd(), bytes.data(), bytes.size(), 0) <= 0) return true;
    return false;
  }

 private:
  [[nodiscard]] Bytes exactly(std::size_t n) const {
    Bytes bytes(n);
    for (std::size_t have = 0; have < n;) {
      if (!readable()) return {};
      const ssize_t got = ::recv(fd(), bytes.data() + have, n - have, 0);
      if (got <= 0) return {};
      have += static_cast<std::size_t>(got);
    }
    return bytes;
  }
};

[[nodiscard]] inline Bytes encoded(const hil::Command& command,
                                   const hil::PacketKey* key = nullptr) {
  hil::CommandPacket packet = hil::encode_command(command);
  if (key != nullptr) hil::sign(packet, *key);
  return {packet.bytes().begin(), packet.bytes().end()};
}

[[nodiscard]] inline Bytes ping(std::uint64_t sequence, const hil::PacketKey* key = nullptr) {
  hil::Command command;
  command.kind = hil::CommandKind::kPing;
  command.sequence = sequence;
  return encoded(command, key);
}

/// The next telemetry of one kind; what comes before it is left out.
template <class News, class Client>
[[nodiscard]] std::optional<News> next(const Client& client) {
  for (;;) {
    const Bytes bytes = client.read();
    if (bytes.empty()) return std::nullopt;
    const auto news = hil::decode_telemetry(bytes);
    if (!news.ok()) return std::nullopt;
    if (const auto* found = std::get_if<News>(&news.value())) return *found;
  }
}

/// Sends a ping and waits for its pong: all that was sent before has then been dealt with.
template <class Client>
[[nodiscard]] bool answered(const Client& client, std::uint64_t sequence,
                            const hil::PacketKey* key = nullptr) {
  if (!client.send(ping(sequence, key))) return false;
  for (;;) {
    const auto pong = next<hil::Pong>(client);
    if (!pong) return false;
    if (pong->sequence == sequence) return true;
  }
}

}  // namespace port_clients
