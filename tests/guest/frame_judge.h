#pragma once

#include <cstdint>
#include <cstdio>
#include <span>

#include "engine/core/crc32c.h"
#include "hil/telemetry_row.h"
#include "tools/starloop/pattern.h"

namespace guest {

/// Judges frames of `starloop run --pattern` that carry a telemetry row: by what a reader can know
/// (the row and its checksums), and by what is true (every pixel of the pattern).
/// Thread: one.
class FrameJudge {
 public:
  FrameJudge(int width_px, int height_px) : width_px_(width_px), height_px_(height_px) {}

  [[nodiscard]] std::size_t pixels() const noexcept {
    return static_cast<std::size_t>(width_px_) * static_cast<std::size_t>(height_px_ + 1);
  }

  /// Image and row, as they were read.
  void see(std::span<const std::uint16_t> frame) noexcept {
    ++frames_;
    const auto image = frame.first(pixels() - static_cast<std::size_t>(width_px_));
    const auto row = hil::decode_telemetry_row(frame.subspan(image.size()));
    if (!row.ok() || row.value().image_crc32c != engine::crc32c(std::as_bytes(image))) {
      ++noticed_;
      return;
    }
    const std::uint64_t id = row.value().frame_id;
    if (!is_pattern(image, id)) ++unnoticed_;
    if (whole_++ > 0) {
      if (id <= last_) ++backward_;
      if (id > last_ + 1) missing_ += id - last_ - 1;
    }
    last_ = id;
  }

  [[nodiscard]] std::uint64_t frames() const noexcept { return frames_; }
  [[nodiscard]] std::uint64_t whole() const noexcept { return whole_; }
  /// Frames, what the checksums caught, what they did not, frames in between that never came, and
  /// frames that came again or late.
  void print() const {
    std::printf(
        "frames=%llu whole=%llu torn_noticed=%llu torn_unnoticed=%llu missing=%llu "
        "backward=%llu last=%llu\n",
        ull(frames_), ull(whole_), ull(noticed_), ull(unnoticed_), ull(missing_), ull(backward_),
        ull(last_));
    std::fflush(stdout);
  }
  [[nodiscard]] std::uint64_t last() const noexcept { return last_; }

 private:
  static unsigned long long ull(std::uint64_t n) noexcept { return n; }
  [[nodiscard]] bool is_pattern(std::span<const std::uint16_t> image,
                                std::uint64_t id) const noexcept {
    const std::uint16_t* dn = image.data();
    unsigned wrong = 0;
    for (int v = 0; v < height_px_; ++v)
      for (int u = 0; u < width_px_; ++u)
        wrong |= static_cast<unsigned>(*dn++ ^ starloop::pattern_dn(u, v, id, 11));
    return wrong == 0;
  }

  int width_px_;
  int height_px_;
  std::uint64_t frames_ = 0;
  std::uint64_t whole_ = 0;
  std::uint64_t noticed_ = 0;
  std::uint64_t unnoticed_ = 0;
  std::uint64_t missing_ = 0;
  std::uint64_t backward_ = 0;
  std::uint64_t last_ = 0;
};

}  // namespace guest
