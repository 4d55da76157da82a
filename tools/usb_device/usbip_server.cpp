#include "tools/usb_device/usbip_server.h"

#include <span>
#include <utility>

namespace usb_device {

UsbIpServer::UsbIpServer(const std::string& address, std::uint16_t port)
    : acceptor_(io_, Tcp::endpoint(asio::ip::make_address(address), port)), socket_(io_) {}

void UsbIpServer::run(drivers::UsbFunction& function, const Events& events) {
  function_ = &function;
  events_ = events;
  stopping_ = false;
  accept();
  io_.restart();
  io_.run();
  function_ = nullptr;
}

void UsbIpServer::post(std::function<void()> work) {
  asio::post(io_, [this, work = std::move(work)] {
    work();
    if (device_) go_on();
  });
}

void UsbIpServer::stop() {
  asio::post(io_, [this] {
    stopping_ = true;
    acceptor_.cancel();
    if (device_) drop();
  });
}

void UsbIpServer::accept() {
  acceptor_.async_accept(socket_, [this](const asio::error_code& error) {
    if (stopping_) return;
    if (error) {
      accept();
      return;
    }
    asio::error_code ignored;
    socket_.set_option(Tcp::no_delay(true), ignored);
    // A host that vanished makes room for the next.
    socket_.set_option(asio::socket_base::keep_alive(true), ignored);
    device_.emplace(*function_);
    read();
  });
}

void UsbIpServer::read() {
  reading_ = true;
  socket_.async_read_some(asio::buffer(in_),
                          [this, host = host_](const asio::error_code& error, std::size_t n) {
                            if (host != host_) return;
                            reading_ = false;
                            heard(error, n);
                          });
}

void UsbIpServer::heard(const asio::error_code& error, std::size_t bytes) {
  if (error || !device_->take(std::span(in_).first(bytes))) {
    drop();
    return;
  }
  if (events_.heard) events_.heard();
  go_on();
}

void UsbIpServer::go_on() {
  if (writing_) return;
  device_->serve();
  out_ = device_->replies();
  if (out_.empty()) {
    if (!reading_) read();
    return;
  }
  writing_ = true;
  asio::async_write(socket_, asio::buffer(out_.data(), out_.size()),
                    [this, host = host_](const asio::error_code& error, std::size_t) {
                      if (host != host_) return;
                      writing_ = false;
                      if (error) {
                        drop();
                      } else {
                        go_on();
                      }
                    });
}

void UsbIpServer::drop() {
  ++host_;
  reading_ = writing_ = false;
  device_.reset();
  function_->reset();
  asio::error_code ignored;
  socket_.close(ignored);
  if (events_.gone) events_.gone();
  if (!stopping_) accept();
}

}  // namespace usb_device
