// A tracker in C++ with OpenCV: the largest blob that differs from the sky, brighter or, before the
// Earth, darker, and a trim that brings it to the middle.
//
//   c++ -O2 tracker_opencv.cpp -o tracker $(pkg-config --cflags --libs starloop-client opencv4)
//   ./tracker NAME-OF-THE-LINK [rad-per-pixel]
//
// Runs until the camera is gone. Copy it, and put your own software where find_target() is.
#include <array>
#include <cstdio>
#include <cstdlib>

#include <starloop_client.h>
#include <opencv2/imgproc.hpp>

namespace {

// False: nothing there. OpenCV sees the frame where it lies; nothing is copied to get it here.
bool find_target(const starloop_frame& frame, starloop_detection& target) {
  const cv::Mat image(frame.height_px, frame.width_px, CV_16UC1,
                      const_cast<std::uint16_t*>(frame.pixels));
  cv::Mat smooth;
  cv::GaussianBlur(image, smooth, {5, 5}, 1.0);
  cv::Scalar mean;
  cv::Scalar deviation;
  cv::meanStdDev(smooth, mean, deviation);
  // Once more without what differs: that is the background.
  cv::Mat off;
  cv::absdiff(smooth, cv::Scalar(mean[0]), off);
  cv::meanStdDev(smooth, mean, deviation, off <= std::max(0.5, deviation[0]));
  cv::absdiff(smooth, cv::Scalar(mean[0]), off);
  cv::Mat differs = off > 8.0 * std::max(0.5, deviation[0]);
  // Close the gaps that shadows cut into the target.
  cv::dilate(differs, differs, cv::getStructuringElement(cv::MORPH_RECT, {9, 9}));

  cv::Mat labels;
  cv::Mat stats;
  cv::Mat centres;
  const int count = cv::connectedComponentsWithStats(differs, labels, stats, centres);
  int best = 0;
  for (int i = 1; i < count; ++i)
    if (best == 0 || stats.at<int>(i, cv::CC_STAT_AREA) > stats.at<int>(best, cv::CC_STAT_AREA))
      best = i;
  if (best == 0) return false;

  const cv::Rect box(stats.at<int>(best, cv::CC_STAT_LEFT), stats.at<int>(best, cv::CC_STAT_TOP),
                     stats.at<int>(best, cv::CC_STAT_WIDTH),
                     stats.at<int>(best, cv::CC_STAT_HEIGHT));
  cv::Mat light;
  cv::subtract(image(box), cv::Scalar(mean[0]), light, cv::noArray(), CV_32F);
  light = cv::abs(light);
  light.setTo(0, labels(box) != best);
  const cv::Moments m = cv::moments(light);
  if (!(m.m00 > 0)) return false;
  target.centroid_px[0] = static_cast<float>(box.x + m.m10 / m.m00);
  target.centroid_px[1] = static_cast<float>(box.y + m.m01 / m.m00);
  target.confidence = 1;
  target.id = 1;
  const std::array<int, 4> edges{box.x, box.y, box.br().x, box.br().y};
  for (std::size_t i = 0; i < 4; ++i) target.box_px[i] = static_cast<float>(edges[i]) - 0.5F;
  return true;
}

}  // namespace

int main(int argc, char** argv) {
  const double ifov_rad = argc > 2 ? std::atof(argv[2]) : 1.4444e-6;
  std::array<double, 2> offset_rad{};
  std::array<double, 2> rate_rad_s{};
  std::int64_t last_ns = 0;
  bool locked = false;
  starloop_client* camera = nullptr;
  if (argc < 2 || starloop_open(&camera, argv[1], 10000) != STARLOOP_OK) {
    std::fprintf(stderr, "%s: %s\n", argv[0],
                 argc < 2 ? "name of the link?" : starloop_last_error());
    return 1;
  }
  starloop_frame frame;
  starloop_status status = STARLOOP_OK;
  while ((status = starloop_wait_frame(camera, &frame, 10000)) == STARLOOP_OK) {
    starloop_answer answer = starloop_answer_to(&frame);
    const std::int64_t middle_ns = frame.shutter_open_ns + frame.exposure_ns / 2;
    if (find_target(frame, answer.detection)) {
      // What is wrong with the pointing: where the target is seen, plus the trim that was on.
      const double dt = static_cast<double>(middle_ns - last_ns) * 1e-9;
      const std::array<int, 2> middle_px{frame.width_px / 2, frame.height_px / 2};
      for (std::size_t i = 0; i < 2; ++i) {
        const double seen_rad =
            frame.trim_rad[i] +
            (static_cast<double>(answer.detection.centroid_px[i]) - middle_px[i]) * ifov_rad;
        // An alpha-beta filter: an offset, and the rate at which it grows.
        const double predicted = offset_rad[i] + rate_rad_s[i] * dt;
        const double surprise = seen_rad - predicted;
        offset_rad[i] = locked ? predicted + 0.8 * surprise : seen_rad;
        rate_rad_s[i] = locked && dt > 0 ? rate_rad_s[i] + 0.5 * surprise / dt : 0;
      }
      last_ns = middle_ns;
      locked = true;
    }
    // Every frame gets its answer: a camera in lockstep waits for it.
    status =
        locked ? starloop_send_trim(camera, &answer, offset_rad.data(), rate_rad_s.data(), last_ns)
               : starloop_send_report(camera, &answer);
    if (status != STARLOOP_OK) std::fprintf(stderr, "%s: %s\n", argv[0], starloop_last_error());
    starloop_release_frame(camera, &frame);
  }
  starloop_close(camera);
  if (status == STARLOOP_DISCONNECTED) return 0;  // the camera is done, and so are we
  std::fprintf(stderr, "%s: %s\n", argv[0], starloop_last_error());
  return 1;
}
