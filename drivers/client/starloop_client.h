/* starloop_client: software under test, in a process of its own, sees a camera's frames and sends
 * commands back. Plain C11, no library but libc, Linux.
 *
 *   starloop_client *camera;
 *   starloop_frame frame;
 *   if (starloop_open(&camera, "starloop", 10000) != STARLOOP_OK) complain(starloop_last_error());
 *   while ((status = starloop_wait_frame(camera, &frame, 1000)) == STARLOOP_OK) {
 *     ... frame.pixels[v * frame.width_px + u] ...
 *     starloop_answer answer = starloop_answer_to(&frame);
 *     starloop_send_trim(camera, &answer, offset_rad, rate_rad_s, reference_ns);
 *     starloop_release_frame(camera, &frame);
 *   }
 *   starloop_close(camera);
 *
 * Threads: one thread waits for frames and releases them; one thread, the same or another, sends.
 * Open and close when no other thread is inside. A forked child must not use the link, and keeps it
 * open for as long as it lives: exec, or spawn.
 *
 * Times are simulated nanoseconds after the scenario's epoch, unless they say _ms: those are the
 * wall's, and bound how long a call may take. Angles in rad. Pixel (0, 0) has its centre at (0, 0).
 */
#ifndef STARLOOP_CLIENT_H
#define STARLOOP_CLIENT_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Names as in C: NOLINTBEGIN(readability-identifier-naming) */

typedef enum {
  STARLOOP_OK = 0,
  STARLOOP_TIMEOUT = 1,      /* nothing happened in time */
  STARLOOP_BUSY = 2,         /* another reader has the link; the camera has not taken 64 commands */
  STARLOOP_DISCONNECTED = 3, /* the camera is gone, or was never there */
  STARLOOP_REJECTED = 4,     /* what was given, or what came, is not what it should be */
  STARLOOP_SYSTEM = 5        /* the operating system said no */
} starloop_status;

typedef struct starloop_client starloop_client;

/* A frame where it lies in shared memory. The camera leaves it alone until it is released. */
typedef struct {
  uint64_t sequence;       /* the period of the camera: gaps are frames that were lost */
  int64_t shutter_open_ns; /* exposure from here */
  int64_t exposure_ns;
  int32_t width_px;
  int32_t height_px;
  int32_t bits;                  /* of a pixel, in its low bits */
  uint32_t slot;                 /* for starloop_release_frame */
  const uint16_t *pixels;        /* height rows of width, from the top; on a 64-byte boundary */
  const uint16_t *telemetry_row; /* one row of width, or NULL */
  double trim_rad[2];            /* x, y: what the actuator says, at mid-exposure */
  double j2000_to_camera[4];     /* w, x, y, z: what the star tracker says */
  double rate_rad_s[3];          /* x, y, z in camera axes: what the gyro says */
  uint64_t skipped;              /* counts of the camera's loop so far */
  uint64_t dropped;
  uint64_t late;
  uint64_t commands;
  uint64_t link_lost;      /* frames this link overwrote unread: we were too slow */
  uint32_t payload_crc32c; /* of the pixels, and the row below: starloop_check_frame */
  uint32_t payload_bytes;
} starloop_frame;

/* Where in a frame the target seems to be. */
typedef struct {
  float centroid_px[2]; /* u, v */
  float confidence;     /* in [0, 1]; 0 is no detection */
  uint32_t id;          /* your own name for the target */
  float box_px[4];      /* edges left, top, right, bottom; all zero: not said */
} starloop_detection;

/* What every command carries besides itself. */
typedef struct {
  uint64_t answers_frame;  /* UINT64_MAX: none */
  int64_t made_at_ns;      /* on the camera's time line */
  int64_t time_to_live_ns; /* refused when older; 0: never too old; counts in whole ms */
  int32_t more_follow;     /* 1: this is not yet all of the answer to that frame */
  starloop_detection detection;
} starloop_answer;

typedef enum {
  STARLOOP_REPORT = 0,
  STARLOOP_TRIM = 1,
  STARLOOP_RATE = 2,
  STARLOOP_ATTITUDE = 3,
  STARLOOP_MODE = 4,
  STARLOOP_PING = 5,
  STARLOOP_TRIGGER = 6
} starloop_kind;

typedef enum {
  STARLOOP_PREDICTED_TARGET = 0,
  STARLOOP_NADIR = 1,
  STARLOOP_INERTIAL = 2,
  STARLOOP_COMMANDED = 3
} starloop_mode;

/* A command whole, for starloop_encode and starloop_send. Fields of other kinds are left alone. */
typedef struct {
  starloop_kind kind;
  uint64_t sequence; /* starloop_send counts by itself, from 0 */
  starloop_answer answer;
  double trim_offset_rad[2];
  double trim_rate_rad_s[2];
  int64_t reference_ns;
  double j2000_to_camera[4];
  double rate_rad_s[3];
  starloop_mode mode;
} starloop_command;

#define STARLOOP_LARGEST_COMMAND 136

/* Opens the link of that name, and waits for its camera. STARLOOP_BUSY: another reader has it. */
starloop_status starloop_open(starloop_client **client, const char *name, int timeout_ms);
/* Gives up the link, and the frames claimed; NULL is left alone. Their pixels are gone. */
void starloop_close(starloop_client *client);
/* The first half of starloop_close: another reader may come, the pixels stay readable. */
void starloop_detach(starloop_client *client);

/* The oldest frame not yet seen, claimed. Several may be held, though no more than the link's slots
 * less one if the camera is to go on. STARLOOP_DISCONNECTED within 0.2 s of the camera's end. */
starloop_status starloop_wait_frame(starloop_client *client, starloop_frame *frame, int timeout_ms);
starloop_status starloop_release_frame(starloop_client *client, const starloop_frame *frame);
/* That the pixels are those the camera sent: a millisecond or so for a million. */
starloop_status starloop_check_frame(const starloop_frame *frame);

/* Answers that frame, made at the end of its exposure, detecting nothing yet. */
starloop_answer starloop_answer_to(const starloop_frame *frame);

/* None of these waits. `answer` may be NULL. */
starloop_status starloop_send_report(starloop_client *client, const starloop_answer *answer);
/* The boresight offset + rate * (t - reference) from the guidance's own line. */
starloop_status starloop_send_trim(starloop_client *client, const starloop_answer *answer,
                                   const double offset_rad[2], const double rate_rad_s[2],
                                   int64_t reference_ns);
/* That rate alone, from where the boresight is at the reference time. */
starloop_status starloop_send_rate(starloop_client *client, const starloop_answer *answer,
                                   const double rate_rad_s[2], int64_t reference_ns);
/* This attitude at the reference time, turning at this rate in camera axes. */
starloop_status starloop_send_attitude(starloop_client *client, const starloop_answer *answer,
                                       const double j2000_to_camera[4], const double rate_rad_s[3],
                                       int64_t reference_ns);
starloop_status starloop_send_mode(starloop_client *client, const starloop_answer *answer,
                                   starloop_mode mode);
starloop_status starloop_send_ping(starloop_client *client, const starloop_answer *answer);
starloop_status starloop_send(starloop_client *client, const starloop_command *command);

/* A command as the bytes of a CCSDS Space Packet (hil/protocol.md), for links of your own. Returns
 * how many of `out` it used; 0 for a kind that is none. */
size_t starloop_encode(const starloop_command *command, uint8_t out[STARLOOP_LARGEST_COMMAND]);

/* What the last failed call of this thread found wrong. Never NULL. */
const char *starloop_last_error(void);

/* NOLINTEND(readability-identifier-naming) */

#ifdef __cplusplus
}
#endif

#endif
