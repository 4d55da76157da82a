#pragma once

#include <string>
#include <vector>

#include "engine/core/image.h"

namespace starloop {

/// Several frames in one picture: a square of each about a place, at the frame's own scale, in rows
/// of four, each with a line of text. All are drawn alike: their brightest pixel is white.
class FrameSheet {
 public:
  /// `side_px`: of a square, or all of a frame that is no larger.
  explicit FrameSheet(int side_px) : side_px_(side_px) {}

  void add(const engine::DnImage& frame, engine::PixelPoint middle, const std::string& text);
  /// An 8-bit grey PNG. Throws std::runtime_error.
  void write(const std::string& path) const;

 private:
  struct Square {
    engine::DnImage image;
    std::string text;
  };
  int side_px_;
  std::vector<Square> squares_;
};

}  // namespace starloop
