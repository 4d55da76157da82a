#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include <asio.hpp>

#include "drivers/usb_device/usbip_device.h"

namespace usb_device {

/// A device in software on a TCP port: serves one host after the other over USB/IP.
///
/// Nothing is read from a host that has not yet taken what it was sent.
/// Thread: that of run(), for all but post() and stop().
class UsbIpServer {
 public:
  /// What there is to do besides; both may be empty.
  struct Events {
    std::function<void()> heard;  ///< after each piece of a host's bytes
    std::function<void()> gone;   ///< a host is
  };

  /// Port 0: the system chooses. Throws what Asio throws.
  UsbIpServer(const std::string& address, std::uint16_t port);

  [[nodiscard]] unsigned port() const { return acceptor_.local_endpoint().port(); }
  /// Hosts see this function until stop(); then they see it unplugged.
  void run(drivers::UsbFunction& function, const Events& events);
  /// `work` runs between the bytes of a host; then what the function has to say goes out. Thread:
  /// any.
  void post(std::function<void()> work);
  /// Thread: any.
  void stop();

 private:
  using Tcp = asio::ip::tcp;

  void accept();
  void read();
  void heard(const asio::error_code& error, std::size_t bytes);
  /// Sends what there is to send; when there is nothing, goes on reading.
  void go_on();
  void drop();

  asio::io_context io_;
  Tcp::acceptor acceptor_;
  Tcp::socket socket_;
  drivers::UsbFunction* function_ = nullptr;
  Events events_;
  std::optional<drivers::UsbIpDevice> device_;  // while a host is there
  std::uint64_t host_ = 0;                      // number of the host: of others nothing is heard
  bool reading_ = false;
  bool writing_ = false;
  bool stopping_ = false;
  std::array<std::byte, 256UL * 1024> in_{};
  std::vector<std::byte> out_;
};

}  // namespace usb_device
