#include "hil/frame_store.h"

#include <cstdio>
#include <cstring>
#include <stdexcept>

#include "hil/run_log.h"

namespace hil {

std::string frame_name(std::uint64_t sequence, const char* suffix) {
  char name[40];
  std::snprintf(name, sizeof name, "frame_%06llu.%s", static_cast<unsigned long long>(sequence),
                suffix);
  return name;
}

std::vector<engine::FitsCard> frame_cards(const Frame& f) {
  const Quaternion& q = f.measured.j2000_to_camera;
  const std::array<double, 3>& w = f.measured.rate_rad_s;
  const auto count = [](std::uint64_t n) { return static_cast<long long>(n); };
  return {
      {"FRAMENO", count(f.sequence), "number of the frame, from 0"},
      {"TIME", engine::seconds(f.shutter_open), "[s] shutter opens, after the epoch"},
      {"TIMENS", static_cast<long long>(f.shutter_open.time_since_epoch().count()),
       "[ns] the same, exactly"},
      {"EXPTIME", engine::seconds(f.exposure), "[s] exposure"},
      {"ADCBITS", static_cast<long long>(f.bits), "of a pixel"},
      {"TRIMX", f.trim_rad[0], "[rad] actuator at mid-exposure"},
      {"TRIMY", f.trim_rad[1], "[rad] actuator at mid-exposure"},
      {"QUATW", q[0], "J2000 to camera, measured, mid-exposure"},
      {"QUATX", q[1], "J2000 to camera, measured, mid-exposure"},
      {"QUATY", q[2], "J2000 to camera, measured, mid-exposure"},
      {"QUATZ", q[3], "J2000 to camera, measured, mid-exposure"},
      {"RATEX", w[0], "[rad/s] measured, camera axes"},
      {"RATEY", w[1], "[rad/s] measured, camera axes"},
      {"RATEZ", w[2], "[rad/s] measured, camera axes"},
      {"NSKIP", count(f.counts.skipped), "frames skipped before"},
      {"NDROP", count(f.counts.dropped), "frames dropped before"},
      {"NLATE", count(f.counts.late), "frames late before"},
      {"NCOMMAND", count(f.counts.commands), "commands obeyed before"},
  };
}

void FitsStore::put(const Frame& frame) {
  std::vector<engine::FitsCard> cards = run_;
  for (engine::FitsCard& card : frame_cards(frame)) cards.push_back(std::move(card));
  engine::write_fits(folder_ + "/" + frame_name(frame.sequence, "fits"), *frame.pixels, cards);
}

void RawStore::put(const Frame& frame) {
  LogFrame note = log_frame(frame);
  note.flags = LogFrame::kPixelsFollow;
  LogBytes head;
  encode(note, head);
  const engine::Status status = log_.append(static_cast<std::uint32_t>(LogType::kFrame), head,
                                            std::as_bytes(frame.pixels->pixels()));
  if (!status.ok())
    throw std::runtime_error(std::string("frames.slog: ") + std::strerror(status.error().code));
}

}  // namespace hil
