#include "tools/starloop/frame_sheet.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

namespace starloop {
namespace {

constexpr int kColumns = 4;
constexpr int kGap_px = 4;
constexpr int kLine_px = 18;
constexpr int kGrey = 40;  // between squares
constexpr int kText = 220;
constexpr int kFont = cv::FONT_HERSHEY_SIMPLEX;
constexpr double kFontScale = 0.4;  // or what fits below a square

/// Where a length of `side` begins that is about `middle` and within [0, all).
int begin_about(double middle, int side, int all) {
  const double wanted = std::isfinite(middle) ? middle - 0.5 * side : 0.0;
  return static_cast<int>(std::clamp(std::round(wanted), 0.0, 1.0 * (all - side)));
}

}  // namespace

void FrameSheet::add(const engine::DnImage& frame, engine::PixelPoint middle,
                     const std::string& text) {
  const int width = std::min(side_px_, frame.width());
  const int height = std::min(side_px_, frame.height());
  const int left = begin_about(middle.u, width, frame.width());
  const int top = begin_about(middle.v, height, frame.height());
  Square& square = squares_.emplace_back(Square{engine::DnImage(width, height), text});
  for (int v = 0; v < height; ++v)
    for (int u = 0; u < width; ++u) square.image.at(u, v) = frame.at(left + u, top + v);
}

void FrameSheet::write(const std::string& path) const {
  int width = 0;
  int height = 0;
  int brightest = 1;
  for (const Square& square : squares_) {
    width = std::max(width, square.image.width());
    height = std::max(height, square.image.height());
    for (const std::uint16_t dn : square.image.pixels()) brightest = std::max<int>(brightest, dn);
  }
  const int count = static_cast<int>(squares_.size());
  const int columns = std::min(kColumns, std::max(count, 1));
  const int rows = (count + columns - 1) / columns;
  const int step_y = height + kLine_px + kGap_px;
  cv::Mat sheet(rows * step_y + kGap_px, columns * (width + kGap_px) + kGap_px, CV_8UC1,
                cv::Scalar(kGrey));
  for (int i = 0; i < count; ++i) {
    const Square& square = squares_[static_cast<std::size_t>(i)];
    const int left = kGap_px + i % columns * (width + kGap_px);
    const int top = kGap_px + i / columns * step_y;
    for (int v = 0; v < square.image.height(); ++v)
      for (int u = 0; u < square.image.width(); ++u)
        sheet.at<std::uint8_t>(top + v, left + u) =
            static_cast<std::uint8_t>(square.image.at(u, v) * 255 / brightest);
    int below = 0;
    const cv::Size full = cv::getTextSize(square.text, kFont, kFontScale, 1, &below);
    const double scale = kFontScale * std::min(1.0, 1.0 * width / std::max(full.width, 1));
    cv::putText(sheet, square.text, {left, top + height + kLine_px - 5}, kFont, scale,
                cv::Scalar(kText), 1, cv::LINE_AA);
  }
  if (!cv::imwrite(path, sheet)) throw std::runtime_error(path + ": the picture was not written");
}

}  // namespace starloop
