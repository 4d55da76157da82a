// Sends stamped frames of 1024 x 1024 into a link of the program's own, as fast as it takes them or
// at a rate, and prints what that cost: for measure.sh.
//   guest_sender LINK SECONDS FRAMES-A-SECOND [KEY...]     KEY: mapped, plain

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <thread>

#include <sys/resource.h>

#include "drivers/open_link.h"
#include "tests/guest/stamps.h"

namespace {

using engine::Duration;

double cpu_s() {
  rusage use{};
  getrusage(RUSAGE_SELF, &use);
  const auto seconds = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  };
  return seconds(use.ru_utime) + seconds(use.ru_stime);
}

drivers::LinkSpec link_of(int argc, char** argv) {
  drivers::LinkSpec spec;
  const std::string name = argv[1];
  drivers::LinkTarget& to = spec.to.front();
  to.name = name;
  to.place = name.substr(name.find(':') + 1);
  to.kind = name == "usb"               ? drivers::LinkKind::kUsb
            : name.starts_with("v4l2:") ? drivers::LinkKind::kV4l2
                                        : drivers::LinkKind::kShm;
  for (int i = 4; i < argc; ++i) {
    if (std::strcmp(argv[i], "mapped") == 0) spec.v4l2_method = drivers::V4l2Method::kMapped;
    if (std::strcmp(argv[i], "plain") == 0) spec.usb_packed = false;
  }
  return spec;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 4) return 2;
  const double length_s = std::atof(argv[2]);
  const double rate_hz = std::atof(argv[3]);
  try {
    const drivers::OpenLink link(link_of(argc, argv), {.width_px = 1024, .height_px = 1024},
                                 hil::WhenBusy::kWait);
    for (int i = 0; i < 1000 && !link.frames().has_reader(); ++i)
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    engine::DnImage image(1024, 1024);
    for (std::size_t i = 0; i < image.pixels().size(); ++i) image.pixels()[i] = i & 0x7FFU;
    hil::Frame frame;
    frame.exposure = Duration(1'000'000);
    frame.pixels = &image;
    std::uint64_t sent = 0;
    const double cpu_before_s = cpu_s();
    const Duration start = hil::SteadyClock::stopwatch();
    const Duration end = start + engine::from_seconds(length_s);
    Duration now = start;
    for (; now < end; now = hil::SteadyClock::stopwatch(), ++frame.sequence) {
      if (rate_hz > 0)
        hil::SteadyClock::sleep_until_stopwatch(
            start + engine::from_seconds(static_cast<double>(frame.sequence) / rate_hz));
      guest::write_stamp(image.pixels());
      if (link.frames().send(frame, Duration(1'000'000'000)).ok()) ++sent;
    }
    const double took_s = engine::seconds(now - start);
    std::printf("sent=%llu refused=%llu per_s=%.1f cpu_ms_a_frame=%.2f\n",
                static_cast<unsigned long long>(sent),
                static_cast<unsigned long long>(frame.sequence - sent),
                static_cast<double>(sent) / took_s,
                1e3 * (cpu_s() - cpu_before_s) / static_cast<double>(frame.sequence));
  } catch (const std::exception& e) {
    std::printf("guest_sender: %s\n", e.what());
    return 1;
  }
  return 0;
}
