// A reader of a V4L2 capture node that can be as slow as it is told to: it reads half of a frame
// where it lies in the driver's buffer, waits, and reads the other half. Prints what FrameJudge
// counts.

#include <array>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include <fcntl.h>
#include <linux/videodev2.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <CLI/CLI.hpp>

#include "tests/guest/frame_judge.h"
#include "tests/guest/stamps.h"

namespace {

struct Options {
  std::string device = "/dev/video20";
  int width_px = 1024;
  int height_px = 1024;
  int frames = 30;
  int buffers = 4;
  int hold_ms = 0;
  int skip = 3;  ///< at the start: the driver gives old ones to who joins
  int patience_s = 20;
  bool stamps = false;  ///< of guest_sender: until there are no more, without a telemetry row
  bool hangs = false;   ///< takes one buffer and waits to be killed
};

template <class T>
void ask(int file, unsigned long request, T& argument, const char* what) {
  if (ioctl(file, request, &argument) != 0)
    throw std::runtime_error(std::string(what) + ": " + std::strerror(errno));
}

v4l2_buffer buffer(std::uint32_t index) {
  v4l2_buffer b{};
  b.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  b.memory = V4L2_MEMORY_MMAP;
  b.index = index;
  return b;
}

class Capture {
 public:
  explicit Capture(const Options& o) : file_(open(o.device.c_str(), O_RDWR | O_CLOEXEC)) {
    if (file_ < 0) throw std::runtime_error(o.device + ": " + std::strerror(errno));
    v4l2_format format{};
    format.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    ask(file_, VIDIOC_G_FMT, format, "G_FMT");
    const std::size_t bytes = 2U * static_cast<std::size_t>(o.width_px) *
                              static_cast<std::size_t>(o.height_px + (o.stamps ? 0 : 1));
    if (format.fmt.pix.pixelformat != V4L2_PIX_FMT_Y16 || format.fmt.pix.sizeimage != bytes)
      throw std::runtime_error("another format than Y16 with a telemetry row");
    v4l2_requestbuffers request{};
    request.count = static_cast<std::uint32_t>(o.buffers);
    request.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    request.memory = V4L2_MEMORY_MMAP;
    ask(file_, VIDIOC_REQBUFS, request, "REQBUFS");
    for (std::uint32_t i = 0; i < request.count; ++i) {
      v4l2_buffer b = buffer(i);
      ask(file_, VIDIOC_QUERYBUF, b, "QUERYBUF");
      void* start = mmap(nullptr, b.length, PROT_READ, MAP_SHARED, file_, b.m.offset);
      if (start == MAP_FAILED) throw std::runtime_error("mmap");
      places_.push_back(static_cast<const std::uint16_t*>(start));
      give(i);
    }
    int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    ask(file_, VIDIOC_STREAMON, type, "STREAMON");
  }

  /// False: nothing came in time.
  bool take(std::uint32_t& index, int patience_s) {
    pollfd ready{file_, POLLIN, 0};
    if (poll(&ready, 1, patience_s * 1000) <= 0) return false;
    v4l2_buffer b = buffer(0);
    ask(file_, VIDIOC_DQBUF, b, "DQBUF");
    index = b.index;
    return true;
  }
  void give(std::uint32_t index) {
    v4l2_buffer b = buffer(index);
    ask(file_, VIDIOC_QBUF, b, "QBUF");
  }
  [[nodiscard]] const std::uint16_t* place(std::uint32_t index) const { return places_[index]; }

 private:
  int file_;  // the process ends with it
  std::vector<const std::uint16_t*> places_;
};

int read_frames(const Options& o) {
  Capture capture(o);
  guest::FrameJudge judge(o.width_px, o.height_px);
  std::vector<std::uint16_t> frame(judge.pixels());
  const std::size_t half = frame.size() / 2;
  for (int k = 0; k < o.skip + o.frames; ++k) {
    std::uint32_t index = 0;
    if (!capture.take(index, o.patience_s)) {
      judge.print();
      std::printf("no frame within %d s\n", o.patience_s);
      return 1;
    }
    if (o.hangs) {
      std::printf("holding\n");
      std::fflush(stdout);
      pause();
    }
    const std::uint16_t* pixels = capture.place(index);
    std::copy_n(pixels, half, frame.begin());
    if (o.hold_ms > 0) std::this_thread::sleep_for(std::chrono::milliseconds(o.hold_ms));
    std::copy_n(pixels + half, frame.size() - half,
                frame.begin() + static_cast<std::ptrdiff_t>(half));
    capture.give(index);
    if (k >= o.skip) judge.see(frame);
  }
  judge.print();
  return 0;
}

int read_stamps(const Options& o) {
  Capture capture(o);
  guest::Ages ages;
  for (std::uint32_t index = 0; capture.take(index, o.patience_s);) {
    ages.see(capture.place(index));
    capture.give(index);
  }
  ages.print();
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  Options o;
  CLI::App app{"Reads frames of the pattern with a telemetry row from a V4L2 node."};
  app.add_option("--device", o.device)->capture_default_str();
  app.add_option("--width", o.width_px);
  app.add_option("--height", o.height_px, "without the telemetry row");
  app.add_option("--frames", o.frames);
  app.add_option("--buffers", o.buffers);
  app.add_option("--hold-ms", o.hold_ms, "between the two halves of a frame");
  app.add_option("--skip", o.skip, "frames at the start that are not judged");
  app.add_option("--patience", o.patience_s);
  app.add_flag("--stamps", o.stamps, "of guest_sender, until nothing comes for the patience");
  app.add_flag("--hangs", o.hangs, "takes one buffer and keeps it");
  CLI11_PARSE(app, argc, argv);
  try {
    return o.stamps ? read_stamps(o) : read_frames(o);
  } catch (const std::exception& e) {
    std::printf("guest_reader: %s\n", e.what());
    return 1;
  }
}
