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
//
// On a board with a USB device port it is the device itself: tools/usb_device/gadget.sh.

#include <cstdio>
#include <exception>
#include <thread>

#include <CLI/CLI.hpp>

#include "drivers/usb_device/injection_device.h"
#include "tools/usb_device/camera_source.h"
#include "tools/usb_device/gadget.h"
#include "tools/usb_device/hand_over.h"
#include "tools/usb_device/usbip_server.h"

namespace {

using usb_device::UsbIpServer;

struct Options {
  std::string address = "127.0.0.1";
  std::uint16_t port = 3240;
  std::string camera;
  bool high_speed = false;
  std::string gadget;  ///< a mounted functionfs; empty: USB/IP
  usb_device::HandOverSpec board;
};

void report(const usb_device::HandOverCounts& c) {
  std::printf("host gone: %llu frames, %llu of them nobody took in time\n",
              static_cast<unsigned long long>(c.frames),
              static_cast<unsigned long long>(c.frames - c.taken));
  std::fflush(stdout);
}

void be_injection_device(const Options& o) {
  usb_device::HandOver hand_over(o.board);
  drivers::InjectionDevice device(usb_device::limits_of(o.board));
  UsbIpServer server(o.address, o.port);
  std::printf("listening on %s:%u, frames to shared memory %s\n", o.address.c_str(), server.port(),
              o.board.shm.c_str());
  std::fflush(stdout);
  const std::jthread commands = hand_over.return_commands([&](const hil::CommandPacket& packet) {
    server.post([&device, packet] { static_cast<void>(device.intake().command(packet.bytes())); });
  });
  server.run(device, {.heard = [&] { hand_over.take_frames(device.intake()); },
                      .gone = [&] { report(hand_over.counts()); }});
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
  app.add_option("--shm", o.board.shm, "name of the shared memory that gets the frames")
      ->capture_default_str()
      ->excludes(camera);
  app.add_option("--width", o.board.width_px, "largest frame")
      ->check(CLI::Range(1, 4096))
      ->capture_default_str()
      ->excludes(camera);
  app.add_option("--height", o.board.height_px, "largest frame, without a telemetry row")
      ->check(CLI::Range(1, 4096))
      ->capture_default_str()
      ->excludes(camera);
  app.add_option("--frames", o.board.frames, "that it has room for")
      ->check(CLI::Range(1, 15))
      ->capture_default_str()
      ->excludes(camera);
  app.add_option("--gadget", o.gadget,
                 "instead of USB/IP: serves the functionfs mounted there, of a gadget on this "
                 "machine's USB device port (tools/usb_device/gadget.sh makes one)")
      ->excludes(camera);
  CLI11_PARSE(app, argc, argv);
  try {
    if (!o.gadget.empty()) {
      usb_device::run_gadget(o.gadget, o.board);
      return 0;
    }
    if (!o.camera.empty()) be_camera(o);
    be_injection_device(o);
  } catch (const std::exception& e) {
    std::fprintf(stderr, "starloop_usb_device: %s\n", e.what());
    return 3;
  }
  return 0;
}
