#include "tools/starloop/picture.h"

#include <stdexcept>

#include <opencv2/imgcodecs.hpp>

namespace starloop {

void write_png(const std::string& path, const engine::DnImage& image, int bits) {
  // OpenCV has no view of constant pixels; nothing writes through this one.
  const cv::Mat view(image.height(), image.width(), CV_16UC1,
                     const_cast<std::uint16_t*>(image.pixels().data()));
  // A shift keeps every DN exact: the low bits of the file are zero.
  const cv::Mat scaled = view * (1 << (16 - bits));
  if (!cv::imwrite(path, scaled, {cv::IMWRITE_PNG_COMPRESSION, 1}))
    throw std::runtime_error(path + ": the picture could not be written");
}

}  // namespace starloop
