#define _GNU_SOURCE
#include "drivers/client/starloop_client.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>

#include "drivers/client/shm_layout.h"
#include "drivers/client/shm_sync.h"
#include "drivers/client/space_packet.h"

#if __BYTE_ORDER__ != __ORDER_LITTLE_ENDIAN__
#error "frames are read as they lie"
#endif

enum { HEADER_BYTES = 192, HEADER_CRC_AT = 188 };

struct starloop_client {
  int fd; /* -1: detached */
  struct starloop_shm *shared;
  size_t total_bytes;
  size_t slots_at; /* our own copies, checked once */
  size_t slot_bytes;
  uint32_t slots;
  uint32_t attachment;
  uint64_t sequence;     /* the sending thread's */
  uint64_t packets_made; /* the sending thread's */
};

static _Thread_local char last_error[256] = "no error";

__attribute__((format(printf, 2, 3))) static starloop_status failed(starloop_status status,
                                                                    const char *format, ...) {
  va_list arguments;
  va_start(arguments, format);
  (void)vsnprintf(last_error, sizeof last_error, format, arguments);
  va_end(arguments);
  return status;
}

const char *starloop_last_error(void) { return last_error; }

static int64_t now_ns(void) {
  struct timespec time;
  (void)clock_gettime(CLOCK_MONOTONIC, &time);
  return (int64_t)time.tv_sec * 1000000000 + time.tv_nsec;
}

/* ---- Opening ----------------------------------------------------------------------------------
 */

static starloop_status map_object(starloop_client *c, const char *path) {
  c->fd = shm_open(path, O_RDWR, 0);
  if (c->fd < 0)
    return failed(errno == ENOENT ? STARLOOP_DISCONNECTED : STARLOOP_SYSTEM, "%s: %s", path,
                  errno == ENOENT ? "no camera has opened this link" : strerror(errno));
  struct stat status;
  if (fstat(c->fd, &status) != 0) return failed(STARLOOP_SYSTEM, "%s: %s", path, strerror(errno));
  if (!S_ISREG(status.st_mode) || (size_t)status.st_size < sizeof(struct starloop_shm))
    return failed(STARLOOP_REJECTED, "%s is no link of a camera", path);
  c->total_bytes = (size_t)status.st_size;
  void *memory = mmap(NULL, c->total_bytes, PROT_READ | PROT_WRITE, MAP_SHARED, c->fd, 0);
  if (memory == MAP_FAILED) return failed(STARLOOP_SYSTEM, "%s: %s", path, strerror(errno));
  c->shared = memory;
  c->slots = c->shared->slots;
  c->slots_at = c->shared->slots_at;
  c->slot_bytes = c->shared->slot_bytes;
  if (c->shared->magic != STARLOOP_SHM_MAGIC)
    return failed(STARLOOP_REJECTED, "%s is no link of a camera, or one of another version", path);
  if (c->slots < 1 || c->slots > STARLOOP_SHM_MOST_SLOTS || c->slot_bytes < HEADER_BYTES ||
      c->slot_bytes > c->total_bytes || c->slots_at < sizeof(struct starloop_shm) ||
      c->slots_at > c->total_bytes || c->slots_at % 64 != 0 || c->slot_bytes % 64 != 0 ||
      (c->total_bytes - c->slots_at) / c->slot_bytes < c->slots)
    return failed(STARLOOP_REJECTED, "%s: sizes that do not fit together", path);
  return STARLOOP_OK;
}

/* We hold the reader's lock: what is claimed was claimed by somebody dead. */
static void attach(starloop_client *c) {
  struct starloop_shm *shared = c->shared;
  starloop_store32(&shared->attached, 0);
  const int keep = starloop_load32(&shared->wait_when_full) != 0;
  for (uint32_t i = 0; i < c->slots; ++i) {
    uint64_t *word = &shared->slot[i].word;
    const uint64_t was = starloop_load64(word);
    const unsigned state = starloop_slot_state(was);
    const uint64_t ticket = starloop_slot_ticket(was);
    if (state == STARLOOP_SLOT_CLAIMED)
      (void)starloop_change64(
          word, was, starloop_slot_word(ticket, keep ? STARLOOP_SLOT_READY : STARLOOP_SLOT_FREE));
    else if (state == STARLOOP_SLOT_READY && !keep &&
             starloop_change64(word, was, starloop_slot_word(ticket, STARLOOP_SLOT_FREE)))
      starloop_store64(&shared->discarded, starloop_load64(&shared->discarded) + 1);
  }
  /* Zero is "nobody". */
  c->attachment = starloop_load32(&shared->attachments) + 1;
  if (c->attachment == 0) c->attachment = 1;
  starloop_store32(&shared->attachments, c->attachment);
  c->packets_made = starloop_load64(&shared->packets_made);
  shared->reader_pid = (int32_t)getpid();
  starloop_store32(&shared->attached, c->attachment);
  starloop_ring(&shared->space_bell);
}

static void unmap(starloop_client *c) {
  if (c->shared != NULL) (void)munmap(c->shared, c->total_bytes);
  if (c->fd >= 0) (void)close(c->fd);
  c->shared = NULL;
  c->fd = -1;
}

static starloop_status try_open(starloop_client *c, const char *path) {
  starloop_status status = map_object(c, path);
  if (status == STARLOOP_OK) {
    if (!starloop_locked(c->fd, STARLOOP_SHM_CAMERA))
      status = failed(STARLOOP_DISCONNECTED, "%s: its camera is gone", path);
    else if (!starloop_lock(c->fd, STARLOOP_SHM_READER))
      status =
          failed(STARLOOP_BUSY, "%s is being read by process %d", path, (int)c->shared->reader_pid);
    else
      attach(c);
  }
  if (status != STARLOOP_OK) unmap(c);
  return status;
}

starloop_status starloop_open(starloop_client **client, const char *name, int timeout_ms) {
  char path[208];
  if (client == NULL || name == NULL) return failed(STARLOOP_REJECTED, "open: NULL");
  *client = NULL;
  const char *bare = name[0] == '/' ? name + 1 : name;
  if (bare[0] == '\0' || bare[0] == '.' || strchr(bare, '/') != NULL || strlen(bare) > 200)
    return failed(STARLOOP_REJECTED, "\"%.60s\" is no name of a link", name);
  (void)snprintf(path, sizeof path, "/%s", bare);
  starloop_client *c = calloc(1, sizeof *c);
  if (c == NULL) return failed(STARLOOP_SYSTEM, "out of memory");
  c->fd = -1;
  const int64_t give_up = now_ns() + (int64_t)timeout_ms * 1000000;
  starloop_status status;
  /* No bell rings when a name appears or a lock is given up. */
  while ((status = try_open(c, path)) != STARLOOP_OK &&
         (status == STARLOOP_DISCONNECTED || status == STARLOOP_BUSY) && now_ns() < give_up) {
    const struct timespec pause = {0, 5000000};
    (void)nanosleep(&pause, NULL);
  }
  if (status == STARLOOP_OK)
    *client = c;
  else
    free(c);
  return status;
}

void starloop_detach(starloop_client *c) {
  if (c == NULL || c->fd < 0) return;
  starloop_store32(&c->shared->attached, 0);
  for (uint32_t i = 0; i < c->slots; ++i) {
    const uint64_t was = starloop_load64(&c->shared->slot[i].word);
    if (starloop_slot_state(was) == STARLOOP_SLOT_CLAIMED)
      (void)starloop_change64(&c->shared->slot[i].word, was,
                              starloop_slot_word(starloop_slot_ticket(was), STARLOOP_SLOT_FREE));
  }
  starloop_unlock(c->fd, STARLOOP_SHM_READER);
  starloop_ring(&c->shared->space_bell);
  (void)close(c->fd);
  c->fd = -1;
}

void starloop_close(starloop_client *c) {
  if (c == NULL) return;
  starloop_detach(c);
  unmap(c);
  free(c);
}

/* ---- Frames -----------------------------------------------------------------------------------
 */

static uint64_t read_le(const uint8_t *at, int bytes) {
  uint64_t value = 0;
  memcpy(&value, at, (size_t)bytes);
  return value;
}

static void read_doubles(const uint8_t *at, double *out, int count) {
  memcpy(out, at, (size_t)count * sizeof *out);
}

/* The layout is the comment of drivers/frame_packet.h. */
static starloop_status read_header(const uint8_t *in, uint64_t used, starloop_frame *frame) {
  if (used < HEADER_BYTES || memcmp(in, "SLF2", 4) != 0 || read_le(in + 4, 2) != HEADER_BYTES)
    return failed(STARLOOP_REJECTED, "a frame of another version");
  if (read_le(in + HEADER_CRC_AT, 4) != starloop_crc32c(in, HEADER_CRC_AT))
    return failed(STARLOOP_REJECTED, "checksum of a frame's header");
  frame->sequence = read_le(in + 8, 8);
  frame->shutter_open_ns = (int64_t)read_le(in + 16, 8);
  frame->exposure_ns = (int64_t)read_le(in + 24, 8);
  frame->width_px = (int32_t)read_le(in + 32, 2);
  frame->height_px = (int32_t)read_le(in + 34, 2);
  frame->bits = (int32_t)read_le(in + 36, 1);
  const uint64_t rows_below = read_le(in + 37, 1);
  read_doubles(in + 40, frame->trim_rad, 2);
  read_doubles(in + 56, frame->j2000_to_camera, 4);
  read_doubles(in + 88, frame->rate_rad_s, 3);
  frame->skipped = read_le(in + 112, 8);
  frame->dropped = read_le(in + 120, 8);
  frame->late = read_le(in + 128, 8);
  frame->commands = read_le(in + 136, 8);
  frame->payload_bytes = (uint32_t)read_le(in + 144, 4);
  frame->payload_crc32c = (uint32_t)read_le(in + 148, 4);
  const uint64_t pixels = (uint64_t)frame->width_px * (uint64_t)frame->height_px;
  if (rows_below > 1 || frame->payload_bytes != used - HEADER_BYTES ||
      frame->payload_bytes != 2 * (pixels + rows_below * (uint64_t)frame->width_px))
    return failed(STARLOOP_REJECTED, "length of a frame");
  frame->pixels = (const uint16_t *)(const void *)(in + HEADER_BYTES);
  frame->telemetry_row = rows_below != 0 ? frame->pixels + pixels : NULL;
  return STARLOOP_OK;
}

/* 1: the oldest ready frame is ours. */
static int claim(starloop_client *c, uint32_t *slot, uint64_t *claimed) {
  for (;;) {
    uint64_t oldest = 0;
    int found = 0;
    for (uint32_t i = 0; i < c->slots; ++i) {
      const uint64_t word = starloop_load64(&c->shared->slot[i].word);
      if (starloop_slot_state(word) != STARLOOP_SLOT_READY || (found && word > oldest)) continue;
      oldest = word;
      *slot = i;
      found = 1;
    }
    if (!found) return 0;
    *claimed = starloop_slot_word(starloop_slot_ticket(oldest), STARLOOP_SLOT_CLAIMED);
    /* The camera may have been faster, and dropped it. */
    if (starloop_change64(&c->shared->slot[*slot].word, oldest, *claimed)) return 1;
  }
}

static void unclaim(starloop_client *c, uint32_t slot) {
  uint64_t *word = &c->shared->slot[slot].word;
  starloop_store64(
      word, starloop_slot_word(starloop_slot_ticket(starloop_load64(word)), STARLOOP_SLOT_FREE));
  starloop_ring(&c->shared->space_bell);
}

starloop_status starloop_wait_frame(starloop_client *c, starloop_frame *frame, int timeout_ms) {
  if (c == NULL || frame == NULL) return failed(STARLOOP_REJECTED, "wait for a frame: NULL");
  if (c->fd < 0) return failed(STARLOOP_DISCONNECTED, "the link is detached");
  const int64_t give_up = now_ns() + (int64_t)timeout_ms * 1000000;
  uint32_t slot = 0;
  for (;;) {
    const uint32_t seen = starloop_load32(&c->shared->frame_bell);
    /* Asked first: what is ready when the camera has gone is all there will be. */
    const int gone =
        starloop_load32(&c->shared->closed) != 0 || !starloop_locked(c->fd, STARLOOP_SHM_CAMERA);
    uint64_t claimed = 0;
    if (claim(c, &slot, &claimed)) break;
    if (gone) return failed(STARLOOP_DISCONNECTED, "the camera is gone");
    const int64_t left = give_up - now_ns();
    if (left <= 0) return failed(STARLOOP_TIMEOUT, "no frame in %d ms", timeout_ms);
    /* A crash rings no bell. */
    const int64_t look = STARLOOP_SHM_LIVENESS_MS * (int64_t)1000000;
    starloop_wait(&c->shared->frame_bell, seen, left < look ? left : look);
  }
  memset(frame, 0, sizeof *frame);
  frame->slot = slot;
  frame->link_lost = starloop_load64(&c->shared->lost);
  const uint64_t used = starloop_load64(&c->shared->slot[slot].used);
  const uint8_t *bytes = (const uint8_t *)c->shared + c->slots_at + slot * c->slot_bytes;
  const starloop_status status = read_header(bytes, used <= c->slot_bytes ? used : 0, frame);
  if (status != STARLOOP_OK) unclaim(c, slot);
  return status;
}

starloop_status starloop_release_frame(starloop_client *c, const starloop_frame *frame) {
  if (c == NULL || frame == NULL || frame->slot >= c->slots)
    return failed(STARLOOP_REJECTED, "release: no frame");
  if (c->fd < 0) return failed(STARLOOP_DISCONNECTED, "the link is detached");
  if (starloop_slot_state(starloop_load64(&c->shared->slot[frame->slot].word)) !=
      STARLOOP_SLOT_CLAIMED)
    return failed(STARLOOP_REJECTED, "release: the frame is not held");
  unclaim(c, frame->slot);
  return STARLOOP_OK;
}

starloop_status starloop_check_frame(const starloop_frame *frame) {
  if (frame == NULL || frame->pixels == NULL) return failed(STARLOOP_REJECTED, "check: no frame");
  if (starloop_crc32c(frame->pixels, frame->payload_bytes) != frame->payload_crc32c)
    return failed(STARLOOP_REJECTED, "checksum of a frame's pixels");
  return STARLOOP_OK;
}

/* ---- Commands ---------------------------------------------------------------------------------
 */

starloop_answer starloop_answer_to(const starloop_frame *frame) {
  starloop_answer answer;
  memset(&answer, 0, sizeof answer);
  answer.answers_frame = frame->sequence;
  answer.made_at_ns = frame->shutter_open_ns + frame->exposure_ns;
  return answer;
}

starloop_status starloop_send(starloop_client *c, const starloop_command *command) {
  if (c == NULL || command == NULL) return failed(STARLOOP_REJECTED, "send: NULL");
  if (c->fd < 0) return failed(STARLOOP_DISCONNECTED, "the link is detached");
  starloop_command numbered = *command;
  numbered.sequence = c->sequence;
  uint8_t bytes[STARLOOP_LARGEST_COMMAND];
  const size_t used = starloop_encode(&numbered, bytes);
  if (used == 0) return failed(STARLOOP_REJECTED, "send: a kind of command that is none");
  if (starloop_load32(&c->shared->closed) != 0 || !starloop_locked(c->fd, STARLOOP_SHM_CAMERA))
    return failed(STARLOOP_DISCONNECTED, "the camera is gone");
  if (c->packets_made - starloop_load64(&c->shared->packets_taken) >= STARLOOP_SHM_PACKETS)
    return failed(STARLOOP_BUSY, "the camera has not taken the last %d commands",
                  STARLOOP_SHM_PACKETS);
  struct starloop_shm_packet *packet = &c->shared->packet[c->packets_made % STARLOOP_SHM_PACKETS];
  memcpy(packet->bytes, bytes, used);
  packet->used = (uint32_t)used;
  packet->sender = c->attachment;
  ++c->sequence;
  ++c->packets_made;
  starloop_store64(&c->shared->packets_made, c->packets_made);
  starloop_ring(&c->shared->packet_bell);
  return STARLOOP_OK;
}

static starloop_command command_of(starloop_kind kind, const starloop_answer *answer) {
  starloop_command command;
  memset(&command, 0, sizeof command);
  command.kind = kind;
  command.answer.answers_frame = UINT64_MAX;
  if (answer != NULL) command.answer = *answer;
  return command;
}

starloop_status starloop_send_report(starloop_client *c, const starloop_answer *answer) {
  const starloop_command command = command_of(STARLOOP_REPORT, answer);
  return starloop_send(c, &command);
}

starloop_status starloop_send_trim(starloop_client *c, const starloop_answer *answer,
                                   const double offset_rad[2], const double rate_rad_s[2],
                                   int64_t reference_ns) {
  starloop_command command = command_of(STARLOOP_TRIM, answer);
  memcpy(command.trim_offset_rad, offset_rad, sizeof command.trim_offset_rad);
  memcpy(command.trim_rate_rad_s, rate_rad_s, sizeof command.trim_rate_rad_s);
  command.reference_ns = reference_ns;
  return starloop_send(c, &command);
}

starloop_status starloop_send_rate(starloop_client *c, const starloop_answer *answer,
                                   const double rate_rad_s[2], int64_t reference_ns) {
  starloop_command command = command_of(STARLOOP_RATE, answer);
  memcpy(command.trim_rate_rad_s, rate_rad_s, sizeof command.trim_rate_rad_s);
  command.reference_ns = reference_ns;
  return starloop_send(c, &command);
}

starloop_status starloop_send_attitude(starloop_client *c, const starloop_answer *answer,
                                       const double j2000_to_camera[4], const double rate_rad_s[3],
                                       int64_t reference_ns) {
  starloop_command command = command_of(STARLOOP_ATTITUDE, answer);
  memcpy(command.j2000_to_camera, j2000_to_camera, sizeof command.j2000_to_camera);
  memcpy(command.rate_rad_s, rate_rad_s, sizeof command.rate_rad_s);
  command.reference_ns = reference_ns;
  return starloop_send(c, &command);
}

starloop_status starloop_send_mode(starloop_client *c, const starloop_answer *answer,
                                   starloop_mode mode) {
  starloop_command command = command_of(STARLOOP_MODE, answer);
  command.mode = mode;
  return starloop_send(c, &command);
}

starloop_status starloop_send_ping(starloop_client *c, const starloop_answer *answer) {
  const starloop_command command = command_of(STARLOOP_PING, answer);
  return starloop_send(c, &command);
}
