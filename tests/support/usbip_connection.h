#pragma once

#include <cstdint>

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include "hil/big_endian.h"
#include "tests/support/usbip_host.h"

namespace usbip_host {

/// A host's connection to a device of this machine, which waits as long as it takes.
class Connection {
 public:
  explicit Connection(int port) : socket_(socket(AF_INET, SOCK_STREAM, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(static_cast<std::uint16_t>(port));
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    connected_ = connect(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0;
  }
  ~Connection() { close(socket_); }
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;

  [[nodiscard]] bool connected() const { return connected_; }
  void say(const Bytes& bytes) const {
    ASSERT_EQ(send(socket_, bytes.data(), bytes.size(), MSG_NOSIGNAL),
              static_cast<ssize_t>(bytes.size()));
  }
  /// Exactly so many bytes; fewer at the end of the connection.
  [[nodiscard]] Bytes hear(std::size_t count) const {
    Bytes bytes(count);
    const ssize_t n = recv(socket_, bytes.data(), count, MSG_WAITALL);
    bytes.resize(n > 0 ? static_cast<std::size_t>(n) : 0);
    return bytes;
  }
  /// The answer to a transfer, and its data.
  [[nodiscard]] Bytes hear_answer(bool with_data) const {
    const Bytes header = hear(48);
    if (header.size() != 48 || !with_data) return {};
    return hear(hil::BigEndianReader(header, 24).get<std::uint32_t>());
  }

 private:
  int socket_;
  bool connected_ = false;
};

}  // namespace usbip_host
