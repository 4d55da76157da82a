// The device's side of the USB stream, without the board: a frame-injection device that a kernel
// attaches over USB/IP. Its frames come out of shared memory, as from `starloop run` itself, and
// commands go back.
//
//   starloop_usb_device --shm cam0                        (on the on-board computer, or anywhere)
//   sudo modprobe vhci-hcd; sudo usbip attach -r HOST -b 1-1       (where starloop runs)
//   starloop run config/flyby.toml --set link.to=usb

#include <array>
#include <cstdio>
#include <cstring>
#include <exception>
#include <memory>
#include <thread>

#include <CLI/CLI.hpp>
#include <asio.hpp>

#include "drivers/pixel_packing.h"
#include "drivers/shm_link.h"
#include "drivers/usb_device/usbip_device.h"
#include "hil/space_packet.h"
#include "hil/telemetry_packet.h"

namespace {

using asio::ip::tcp;
using engine::Duration;

constexpr Duration kPatience{50'000'000};

struct Options {
  std::string address = "127.0.0.1";
  std::uint16_t port = 3240;
  std::string shm = "starloop-usb";
  int width_px = 1024;
  int height_px = 1024;
  int frames = 3;
};

drivers::UsbLimits limits_of(const Options& o) {
  drivers::UsbLimits l;
  l.formats = 3;
  l.width_px = o.width_px;
  l.height_px = o.height_px + 1;
  l.payload_bytes = static_cast<std::uint32_t>(
      drivers::usb_payload_bytes(drivers::PixelFormat::kPlain16, l.width_px, l.height_px));
  l.frames = static_cast<unsigned>(o.frames);
  return l;
}

/// What the camera said of itself behind the pixels.
void take_news(std::span<const std::byte> news, hil::Frame& frame) {
  constexpr std::size_t kSpaceHeader = 6;
  while (news.size() > kSpaceHeader) {
    const std::size_t bytes =
        7 + (std::to_integer<std::size_t>(news[4]) << 8 | std::to_integer<std::size_t>(news[5]));
    if (bytes > news.size()) return;
    if (const auto one = hil::decode_telemetry(news.first(bytes)); one.ok()) {
      if (const auto* f = std::get_if<hil::FrameNews>(&one.value())) frame.counts = f->counts;
      if (const auto* a = std::get_if<hil::AttitudeNews>(&one.value())) {
        frame.measured = a->measured;
        frame.trim_rad = a->trim_rad;
      }
    }
    news = news.subspan(bytes);
  }
}

/// Serves one host after the other, and hands over what comes.
class Server {
 public:
  explicit Server(const Options& o)
      : limits_(limits_of(o)),
        shm_({.name = o.shm, .slots = o.frames + 1}, o.width_px, o.height_px),
        pixels_(static_cast<std::size_t>(o.width_px) * static_cast<std::size_t>(o.height_px + 1)),
        acceptor_(io_, tcp::endpoint(asio::ip::make_address(o.address), o.port)),
        socket_(io_) {
    accept();
    commands_ = std::jthread([this](const std::stop_token& stop) { take_commands(stop); });
  }
  ~Server() { commands_ = {}; }
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  void run() { io_.run(); }
  [[nodiscard]] unsigned port() const { return acceptor_.local_endpoint().port(); }

 private:
  void accept() {
    device_ = std::make_unique<drivers::UsbIpDevice>(limits_);
    acceptor_.async_accept(socket_, [this](const asio::error_code& error) {
      if (error) {
        accept();
        return;
      }
      socket_.set_option(tcp::no_delay(true));
      read();
    });
  }

  void read() {
    socket_.async_read_some(
        asio::buffer(in_), [this](const asio::error_code& error, std::size_t n) {
          const bool good = !error && device_->take(std::as_bytes(std::span(in_).first(n)));
          if (!good) {
            std::printf("host gone: %llu frames, %llu of them nobody took in time\n",
                        static_cast<unsigned long long>(frames_),
                        static_cast<unsigned long long>(not_taken_));
            std::fflush(stdout);
            socket_.close();
            accept();
            return;
          }
          hand_over();
          device_->serve();
          if (write()) read();
        });
  }

  /// A host takes what it asked for: it may be waited for.
  bool write() {
    const std::vector<std::byte> out = device_->replies();
    asio::error_code error;
    if (!out.empty()) asio::write(socket_, asio::buffer(out.data(), out.size()), error);
    if (!error) return true;
    socket_.close();
    accept();
    return false;
  }

  void hand_over() {
    for (auto f = device_->intake().front(); f; f = device_->intake().front()) {
      const drivers::UsbFrameHeader& h = f->header;
      const auto width = static_cast<std::size_t>(h.width_px);
      const std::size_t image = width * static_cast<std::size_t>(h.height_px);
      const std::size_t all = image + width * static_cast<std::size_t>(h.rows_below);
      const std::span<std::uint16_t> pixels = std::span(pixels_).first(all);
      const std::size_t bytes = f->payload.size() - h.news_bytes;
      if (h.format == drivers::PixelFormat::kPacked11) {
        drivers::unpack_pixels(f->payload.first(bytes), pixels);
      } else {
        std::memcpy(pixels.data(), f->payload.data(), bytes);
      }
      engine::DnImage picture(h.width_px, h.height_px);
      std::copy_n(pixels.begin(), image, picture.pixels().begin());
      hil::Frame frame;
      frame.sequence = h.sequence;
      frame.shutter_open = h.shutter_open;
      frame.exposure = h.exposure;
      frame.bits = h.bits;
      frame.pixels = &picture;
      frame.telemetry_row = pixels.subspan(image);
      take_news(f->payload.subspan(bytes), frame);
      ++frames_;
      if (!shm_.send(frame, Duration{}).ok()) ++not_taken_;
      device_->intake().pop();
    }
  }

  void take_commands(const std::stop_token& stop) {
    while (!stop.stop_requested()) {
      const auto command = shm_.receive(kPatience);
      if (!command.ok()) {
        if (command.error().fault == engine::Fault::kDisconnected)
          std::this_thread::sleep_for(kPatience);
        continue;
      }
      const hil::CommandPacket packet = hil::encode_command(command.value());
      asio::post(io_, [this, packet] {
        if (!device_->attached() || !device_->intake().command(packet.bytes())) return;
        device_->serve();
        static_cast<void>(write());
      });
    }
  }

  drivers::UsbLimits limits_;
  drivers::ShmLink shm_;
  std::vector<std::uint16_t> pixels_;
  std::uint64_t frames_ = 0;
  std::uint64_t not_taken_ = 0;
  asio::io_context io_;
  tcp::acceptor acceptor_;
  tcp::socket socket_;
  std::unique_ptr<drivers::UsbIpDevice> device_;
  std::array<char, 256 * 1024> in_{};
  std::jthread commands_;  // the last member: it uses the others
};

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{
      "A frame-injection device in software: a kernel attaches it over USB/IP (usbip attach -r "
      "HOST\n"
      "-b 1-1), its frames come out of shared memory, and commands of the software that reads "
      "them\n"
      "go back. USB/IP has no key: an address other than loopback is for a network of your own."};
  Options o;
  app.add_option("--address", o.address, "to listen on")->capture_default_str();
  app.add_option("--port", o.port, "to listen on; 0: the system chooses")->capture_default_str();
  app.add_option("--shm", o.shm, "name of the shared memory that gets the frames")
      ->capture_default_str();
  app.add_option("--width", o.width_px, "largest frame")
      ->check(CLI::Range(1, 4096))
      ->capture_default_str();
  app.add_option("--height", o.height_px, "largest frame, without a telemetry row")
      ->check(CLI::Range(1, 4096))
      ->capture_default_str();
  app.add_option("--frames", o.frames, "that it has room for")
      ->check(CLI::Range(1, 15))
      ->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  try {
    auto server = std::make_unique<Server>(o);
    std::printf("listening on %s:%u, frames to shared memory %s\n", o.address.c_str(),
                server->port(), o.shm.c_str());
    std::fflush(stdout);
    server->run();
  } catch (const std::exception& e) {
    std::fprintf(stderr, "starloop_usb_device: %s\n", e.what());
    return 3;
  }
  return 0;
}
