// The other process of shm_process_test.cpp: an end of a link that can be killed.
//   shm_peer read LINK     reads until the camera has gone; says "attached", then how many it read
//   shm_peer answer LINK   the same, and reports each frame
//   shm_peer hold LINK     claims a frame, says "held", and waits to be killed
//   shm_peer camera LINK   makes the link, says "open", and sends until it is killed
#include <cinttypes>
#include <cstdio>
#include <cstring>
#include <string>

#include <unistd.h>

#include "drivers/client/starloop_client.h"
#include "drivers/shm_link.h"
#include "tests/support/numbered_frames.h"

namespace {

constexpr int kLong_ms = 60'000;  // only a link that is wrong waits this long

void say(const std::string& text) {
  std::puts(text.c_str());
  std::fflush(stdout);
}

int complain(const char* what) {
  std::fprintf(stderr, "shm_peer: %s: %s\n", what, starloop_last_error());
  return 1;
}

bool as_sent(const starloop_frame& frame) {
  if (starloop_check_frame(&frame) != STARLOOP_OK) return false;
  const auto count = static_cast<std::size_t>(frame.width_px * frame.height_px);
  for (std::size_t i = 0; i < count; ++i)
    if (frame.pixels[i] != numbered_frames::pixel(frame.sequence, i)) return false;
  return true;
}

int read_frames(starloop_client* client, bool answers) {
  std::uint64_t count = 0;
  std::uint64_t last = 0;
  starloop_frame frame;
  starloop_status status = STARLOOP_OK;
  while ((status = starloop_wait_frame(client, &frame, kLong_ms)) == STARLOOP_OK) {
    if (!as_sent(frame)) return complain("torn");
    if (count > 0 && frame.sequence <= last) return complain("out of order");
    last = frame.sequence;
    if (++count == 1) say("reading");
    const starloop_answer answer = starloop_answer_to(&frame);
    if (answers && starloop_send_report(client, &answer) == STARLOOP_REJECTED)
      return complain("report");
    if (starloop_release_frame(client, &frame) != STARLOOP_OK) return complain("release");
  }
  if (status != STARLOOP_DISCONNECTED) return complain("wait");
  say(std::to_string(count));
  starloop_close(client);
  return 0;
}

int camera(const std::string& name) {
  drivers::ShmLink link({.name = name}, numbered_frames::kWidth_px, numbered_frames::kHeight_px);
  engine::DnImage pixels(numbered_frames::kWidth_px, numbered_frames::kHeight_px);
  say("open");
  hil::Frame frame;
  frame.pixels = &pixels;
  for (;; ++frame.sequence) {
    numbered_frames::fill(pixels, frame.sequence);
    static_cast<void>(link.send(frame, engine::Duration{}));
  }
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) return 2;
  const std::string what = argv[1];
  if (what == "camera") return camera(argv[2]);
  starloop_client* client = nullptr;
  if (starloop_open(&client, argv[2], kLong_ms) != STARLOOP_OK) return complain("open");
  say("attached");
  if (what == "read" || what == "answer") return read_frames(client, what == "answer");
  starloop_frame frame;
  if (starloop_wait_frame(client, &frame, kLong_ms) != STARLOOP_OK) return complain("wait");
  say("held");
  for (;;) pause();
}
