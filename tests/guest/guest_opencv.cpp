// A V4L2 reader of OpenCV's: raw frames to stdout, for tools/check_pattern.py.
//   guest_opencv NODE FRAMES | tools/check_pattern.py

#include <cstdio>
#include <cstdlib>
#include <string>

#include <opencv2/videoio.hpp>

int main(int argc, char** argv) {
  if (argc != 3) return 2;
  cv::VideoCapture camera(std::string(argv[1]), cv::CAP_V4L2);
  camera.set(cv::CAP_PROP_CONVERT_RGB, 0);
  const int frames = std::atoi(argv[2]);
  cv::Mat image;
  for (int k = 0; k < frames; ++k) {
    if (!camera.read(image)) {
      std::fprintf(stderr, "OpenCV has no frame %d\n", k);
      return 1;
    }
    if (image.type() != CV_16UC1) {
      std::fprintf(stderr, "OpenCV's type %d is not CV_16UC1\n", image.type());
      return 1;
    }
    std::fwrite(image.data, image.elemSize(), image.total(), stdout);
  }
  return std::fflush(stdout) == 0 ? 0 : 1;
}
