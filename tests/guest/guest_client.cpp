// A client of the shared memory that judges each frame of the pattern and prints, after each, what
// has been seen so far: software under test that believes nothing. Ends with the camera.

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <vector>

#include <starloop_client.h>

#include "tests/guest/frame_judge.h"
#include "tests/guest/stamps.h"

namespace {

/// Frames of guest_sender, until nothing comes for three seconds.
int read_stamps(starloop_client* camera) {
  guest::Ages ages;
  starloop_frame frame;
  for (int patience_ms = 30'000; starloop_wait_frame(camera, &frame, patience_ms) == STARLOOP_OK;
       patience_ms = 3'000) {
    ages.see(frame.pixels);
    starloop_release_frame(camera, &frame);
  }
  ages.print();
  return 0;
}

}  // namespace

// guest_client NAME WIDTH HEIGHT [stamps]
int main(int argc, char** argv) {
  if (argc < 4) return 2;
  guest::FrameJudge judge(std::atoi(argv[2]), std::atoi(argv[3]));
  const std::size_t width = static_cast<std::size_t>(std::atoi(argv[2]));
  starloop_client* camera = nullptr;
  if (starloop_open(&camera, argv[1], 30'000) != STARLOOP_OK) {
    std::printf("guest_client: %s\n", starloop_last_error());
    return 1;
  }
  if (argc > 4) return read_stamps(camera);
  std::vector<std::uint16_t> pixels(judge.pixels());
  std::uint64_t lost = 0;
  starloop_frame frame;
  starloop_status status = STARLOOP_OK;
  while ((status = starloop_wait_frame(camera, &frame, 60'000)) == STARLOOP_OK) {
    if (frame.telemetry_row == nullptr || starloop_check_frame(&frame) != STARLOOP_OK) {
      std::printf("guest_client: frame %llu is not what was sent\n",
                  static_cast<unsigned long long>(frame.sequence));
      return 1;
    }
    const std::size_t image = pixels.size() - width;
    std::memcpy(pixels.data(), frame.pixels, 2 * image);
    std::memcpy(pixels.data() + image, frame.telemetry_row, 2 * width);
    lost = frame.link_lost;
    starloop_release_frame(camera, &frame);
    judge.see(pixels);
    judge.print();
  }
  std::printf("lost=%llu\n", static_cast<unsigned long long>(lost));
  starloop_close(camera);
  return status == STARLOOP_DISCONNECTED ? 0 : 1;
}
