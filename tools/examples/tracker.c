/* A tracker in C: threshold, centroid, and a trim that brings the target to the middle. The target
 * is what differs from the sky, brighter or, before the Earth, darker.
 *
 *   cc -O2 tracker.c -o tracker $(pkg-config --cflags --libs starloop-client) -lm
 *   ./tracker NAME-OF-THE-LINK [rad-per-pixel]
 *
 * Runs until the camera is gone. Copy it, and put your own software where find_target() is. */
#include <math.h>
#include <starloop_client.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* The background is the median; its noise is what 84 % of a normal distribution stay under. */
static double threshold_of(const starloop_frame *frame, double *background) {
  static uint32_t histogram[65536];
  const size_t count = (size_t)frame->width_px * (size_t)frame->height_px;
  memset(histogram, 0, sizeof histogram);
  for (size_t i = 0; i < count; ++i) ++histogram[frame->pixels[i]];
  size_t below = 0;
  int dn = -1, median = -1;
  while ((double)below < 0.841 * (double)count) {
    below += histogram[++dn];
    if (median < 0 && 2 * below >= count) median = dn;
  }
  *background = median;
  return 6.0 * fmax(0.5, dn - median);
}

/* 1: found. The centroid of all that is off the background by more than the threshold. */
static int find_target(const starloop_frame *frame, starloop_detection *target) {
  double background = 0, sum = 0, sum_u = 0, sum_v = 0;
  const double threshold = threshold_of(frame, &background);
  int found = 0;
  for (int v = 0; v < frame->height_px; ++v) {
    const uint16_t *row = frame->pixels + (size_t)v * (size_t)frame->width_px;
    for (int u = 0; u < frame->width_px; ++u) {
      const double off = fabs(row[u] - background);
      if (off <= threshold) continue;
      sum += off;
      sum_u += off * u;
      sum_v += off * v;
      ++found;
    }
  }
  if (found < 4) return 0; /* noise, or a cosmic ray */
  target->centroid_px[0] = (float)(sum_u / sum);
  target->centroid_px[1] = (float)(sum_v / sum);
  target->confidence = 1;
  target->id = 1;
  return 1;
}

int main(int argc, char **argv) {
  const double ifov_rad = argc > 2 ? atof(argv[2]) : 1.4444e-6;
  double offset_rad[2] = {0, 0}, rate_rad_s[2] = {0, 0};
  int64_t last_ns = 0;
  int locked = 0;
  starloop_client *camera = NULL;
  starloop_frame frame;
  if (argc < 2 || starloop_open(&camera, argv[1], 10000) != STARLOOP_OK) {
    fprintf(stderr, "%s: %s\n", argv[0], argc < 2 ? "name of the link?" : starloop_last_error());
    return 1;
  }
  starloop_status status;
  while ((status = starloop_wait_frame(camera, &frame, 10000)) == STARLOOP_OK) {
    starloop_answer answer = starloop_answer_to(&frame);
    const int64_t middle_ns = frame.shutter_open_ns + frame.exposure_ns / 2;
    if (find_target(&frame, &answer.detection)) {
      /* What is wrong with the pointing: where the target is seen, plus the trim that was on. */
      const int32_t middle_px[2] = {frame.width_px / 2, frame.height_px / 2};
      const double dt = (double)(middle_ns - last_ns) * 1e-9;
      for (int i = 0; i < 2; ++i) {
        const double seen_rad =
            frame.trim_rad[i] + ((double)answer.detection.centroid_px[i] - middle_px[i]) * ifov_rad;
        /* An alpha-beta filter: an offset, and the rate at which it grows. */
        const double predicted = offset_rad[i] + rate_rad_s[i] * dt;
        const double surprise = seen_rad - predicted;
        offset_rad[i] = locked ? predicted + 0.8 * surprise : seen_rad;
        rate_rad_s[i] = locked && dt > 0 ? rate_rad_s[i] + 0.5 * surprise / dt : 0;
      }
      last_ns = middle_ns;
      locked = 1;
    }
    /* Every frame gets its answer: a camera in lockstep waits for it. */
    status = locked ? starloop_send_trim(camera, &answer, offset_rad, rate_rad_s, last_ns)
                    : starloop_send_report(camera, &answer);
    if (status != STARLOOP_OK) fprintf(stderr, "%s: %s\n", argv[0], starloop_last_error());
    starloop_release_frame(camera, &frame);
  }
  starloop_close(camera);
  if (status == STARLOOP_DISCONNECTED) return 0; /* the camera is done, and so are we */
  fprintf(stderr, "%s: %s\n", argv[0], starloop_last_error());
  return 1;
}
