// A USB device in software, which a kernel attaches over USB/IP: a frame-injection device, whose
// frames come out of shared memory as from `starloop run` itself,
//
//   starloop_usb_device --shm cam0                        (on the on-board computer, or anywhere)
//   sudo modprobe vhci-hcd; sudo usbip attach -r HOST -b 1-1       (where starloop runs)
//   starloop run config/flyby.toml --set link.to=usb
//
// or a standard camera, whose frames are those of `starloop run`:
//
//   starloop run config/flyby.toml --set link.to=shm:cam0 &
//   starloop_usb_device --camera cam0                              (where starloop runs)
//   sudo modprobe vhci-hcd; sudo usbip attach -r HOST -b 1-1       (on the on-board computer)

#include <cstdio>
#include <cstring>
#include <exception>
#include <memory>
#include <thread>

#include <CLI/CLI.hpp>

#include "drivers/pixel_packing.h"
#include "drivers/shm_link.h"
#include "drivers/usb_device/injection_device.h"
#include "hil/space_packet.h"
#include "hil/telemetry_packet.h"
#include "tools/usb_device/camera_source.h"
#include "tools/usb_device/usbip_server.h"

namespace {

using engine::Duration;
using usb_device::UsbIpServer;

constexpr Duration kPatience{50'000'000};

struct Options {
  std::string address = "127.0.0.1";
  std::uint16_t port = 3240;
  std::string camera;
  bool high_speed = false;
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

/// Frames of an injection device into shared memory, and commands of their reader back.
class HandOver {
 public:
  explicit HandOver(const Options& o)
      : shm_({.name = o.shm, .slots = o.frames + 1}, o.width_px, o.height_px),
        pixels_(static_cast<std::size_t>(o.width_px) * static_cast<std::size_t>(o.height_px + 1)) {}

  void take_frames(drivers::FrameIntake& intake) {
    for (auto f = intake.front(); f; f = intake.front()) {
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
      intake.pop();
    }
  }

  /// A thread that gives each command to `take`.
  template <class Take>
  [[nodiscard]] std::jthread return_commands(Take take) {
    return std::jthread([this, take](const std::stop_token& stop) {
      while (!stop.stop_requested()) {
        const auto command = shm_.receive(kPatience);
        if (command.ok()) {
          take(hil::encode_command(command.value()));
        } else if (command.error().fault == engine::Fault::kDisconnected) {
          std::this_thread::sleep_for(kPatience);
        }
      }
    });
  }

  void report() const {
    std::printf("host gone: %llu frames, %llu of them nobody took in time\n",
                static_cast<unsigned long long>(frames_),
                static_cast<unsigned long long>(not_taken_));
    std::fflush(stdout);
  }

 private:
  drivers::ShmLink shm_;
  std::vector<std::uint16_t> pixels_;
  std::uint64_t frames_ = 0;
  std::uint64_t not_taken_ = 0;
};

void be_injection_device(const Options& o) {
  HandOver hand_over(o);
  drivers::InjectionDevice device(limits_of(o));
  UsbIpServer server(o.address, o.port);
  std::printf("listening on %s:%u, frames to shared memory %s\n", o.address.c_str(), server.port(),
              o.shm.c_str());
  std::fflush(stdout);
  const std::jthread commands = hand_over.return_commands([&](const hil::CommandPacket& packet) {
    server.post([&device, packet] { static_cast<void>(device.intake().command(packet.bytes())); });
  });
  server.run(device, {.heard = [&] { hand_over.take_frames(device.intake()); },
                      .gone = [&] { hand_over.report(); }});
}

void report(const drivers::UvcCounts& c) {
  std::printf(
      "host gone: %llu frames sent, %llu overtaken, %llu cut, %llu while nobody streamed; %llu "
      "commands, %llu lost; %llu requests stalled\n",
      static_cast<unsigned long long>(c.sent), static_cast<unsigned long long>(c.overtaken),
      static_cast<unsigned long long>(c.cut), static_cast<unsigned long long>(c.idle),
      static_cast<unsigned long long>(c.commands), static_cast<unsigned long long>(c.commands_lost),
      static_cast<unsigned long long>(c.stalled));
  std::fflush(stdout);
}

/// Until the source's frames become those of another camera.
void be_one_camera(const Options& o, UsbIpServer& server) {
  usb_device::CameraSource source(o.camera);
  drivers::UvcSpec spec = source.wait_for_camera();
  spec.super_speed = !o.high_speed;
  drivers::UvcCamera camera(spec, [&](const hil::Command& c) { return source.send(c); });
  std::printf("listening on %s:%u, a camera of %d x %d%s, %d bits, every %.3f ms\n",
              o.address.c_str(), server.port(), spec.width_px, spec.height_px,
              spec.rows_below > 0 ? " and a telemetry row" : "", spec.bits,
              static_cast<double>(spec.period.count()) / 1e6);
  std::fflush(stdout);
  const std::jthread frames = source.follow(
      camera, [&](std::function<void()> work) { server.post(std::move(work)); },
      [&] { server.stop(); });
  server.run(camera, {.heard = {}, .gone = [&] { report(camera.counts()); }});
}

[[noreturn]] void be_camera(const Options& o) {
  UsbIpServer server(o.address, o.port);
  for (;;) {
    be_one_camera(o, server);
    std::printf("the frames have changed: unplugged\n");
    std::fflush(stdout);
  }
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{
      "A USB device in software: a kernel attaches it over USB/IP (usbip attach -r HOST -b 1-1).\n"
      "It injects frames: they come out of shared memory, and commands of the software that reads\n"
      "them go back. With --camera it is a standard camera (USB Video Class) instead, and shows "
      "the\n"
      "frames of starloop run. USB/IP has no key: an address other than loopback is for a network\n"
      "of your own."};
  Options o;
  app.add_option("--address", o.address, "to listen on")->capture_default_str();
  app.add_option("--port", o.port, "to listen on; 0: the system chooses")->capture_default_str();
  CLI::Option* camera = app.add_option(
      "--camera", o.camera, "be a camera with the frames of a run whose link.to is shm:NAME");
  app.add_flag("--high-speed", o.high_speed,
               "of the camera: no SuperSpeed, for hosts that do not know it")
      ->needs(camera);
  app.add_option("--shm", o.shm, "name of the shared memory that gets the frames")
      ->capture_default_str()
      ->excludes(camera);
  app.add_option("--width", o.width_px, "largest frame")
      ->check(CLI::Range(1, 4096))
      ->capture_default_str()
      ->excludes(camera);
  app.add_option("--height", o.height_px, "largest frame, without a telemetry row")
      ->check(CLI::Range(1, 4096))
      ->capture_default_str()
      ->excludes(camera);
  app.add_option("--frames", o.frames, "that it has room for")
      ->check(CLI::Range(1, 15))
      ->capture_default_str()
      ->excludes(camera);
  CLI11_PARSE(app, argc, argv);
  try {
    if (!o.camera.empty()) be_camera(o);
    be_injection_device(o);
  } catch (const std::exception& e) {
    std::fprintf(stderr, "starloop_usb_device: %s\n", e.what());
    return 3;
  }
  return 0;
}
