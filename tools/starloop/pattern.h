#pragma once

#include "engine/scene_generator.h"

namespace starloop {

/// The DN of a test pattern: a ramp that moves on with each frame. tools/check_pattern.py is the
/// other end.
[[nodiscard]] constexpr std::uint16_t pattern_dn(int u, int v, std::uint64_t frame,
                                                 int bits) noexcept {
  const std::uint64_t sum =
      static_cast<std::uint64_t>(u) + 3U * static_cast<std::uint64_t>(v) + 7U * frame;
  return static_cast<std::uint16_t>(sum & ((1U << bits) - 1U));
}

/// Frames that check a cable: no scene, every bit of every pixel moves. Loop-safe.
class PatternGenerator final : public engine::SceneGenerator {
 public:
  explicit PatternGenerator(int bits) : bits_(bits) {}
  engine::FrameReport expose(const engine::Shot& shot, engine::Budget /*budget*/,
                             engine::DnImage& out, engine::TruthMask& mask) noexcept override {
    mask.clear();
    std::uint16_t* dn = out.pixels().data();
    for (int v = 0; v < out.height(); ++v)
      for (int u = 0; u < out.width(); ++u) *dn++ = pattern_dn(u, v, shot.sequence, bits_);
    engine::FrameReport report;
    report.peak_dn = (1 << bits_) - 1;
    return report;
  }

 private:
  int bits_;
};

}  // namespace starloop
