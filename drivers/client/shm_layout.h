/* The shared memory of a link, as both sides see it: C11 and C++20. Not installed.
 *
 * The camera makes the object whole and locked before it gets its name, and is its only writer of
 * frames. One reader at a time. Who is alive is told by the kernel: each side holds a lock on one
 * byte of the object (open file description locks), which ends with its process, however it ends.
 * Process ids are there for messages alone.
 *
 * A slot's word is its ticket and its state; the ticket counts frames, so that a word never
 * comes back. The only changes:
 *   free, ready -> writing -> ready   camera; from ready only when it drops the oldest
 *   ready -> claimed -> free          reader
 * The camera never writes to a claimed slot and the reader never reads one that it has not claimed:
 * no frame is torn. A new reader, who holds the lock, frees what a dead one had claimed.
 *
 * The camera believes nothing that lies here: sizes and places are its own copies. */
#ifndef STARLOOP_SHM_LAYOUT_H
#define STARLOOP_SHM_LAYOUT_H

#include <assert.h>
#include <stdint.h>

/* Names as in C: NOLINTBEGIN(readability-identifier-naming) */

#define STARLOOP_SHM_MAGIC UINT64_C(0x31304D4853504C53) /* "SLPSHM01" */

enum {
  STARLOOP_SHM_MOST_SLOTS = 16,
  STARLOOP_SHM_PACKETS = 64,
  STARLOOP_SHM_PACKET_BYTES = 248,
  STARLOOP_SHM_PAGE = 4096,      /* slots start on one */
  STARLOOP_SHM_LIVENESS_MS = 100 /* how often a waiting side looks whether the other is alive */
};

/* Bytes of the object that are locked. */
enum { STARLOOP_SHM_CAMERA = 0, STARLOOP_SHM_READER = 1 };

enum { STARLOOP_SLOT_FREE, STARLOOP_SLOT_WRITING, STARLOOP_SLOT_READY, STARLOOP_SLOT_CLAIMED };

struct starloop_shm_slot {
  uint64_t word; /* ticket * 4 + state */
  uint64_t used; /* bytes of the frame packet (drivers/frame_packet.h) */
  uint8_t padding[48];
};

struct starloop_shm_packet {
  uint32_t used;
  uint32_t sender; /* the attachment that made it */
  uint8_t bytes[STARLOOP_SHM_PACKET_BYTES];
};

struct starloop_shm {
  /* Fixed before the object has a name. */
  uint64_t magic;
  uint64_t total_bytes;
  uint64_t slots_at; /* of the first slot's bytes, from the start of the object */
  uint64_t slot_bytes;
  uint32_t slots;
  uint32_t wait_when_full; /* 1: lockstep, nothing is dropped; 0: the oldest unread frame goes */
  uint32_t width_px;
  uint32_t height_px;
  int32_t camera_pid;
  uint8_t padding_0[12];

  /* Written by the camera. */
  uint32_t frame_bell; /* futex: another frame, or the end */
  uint32_t closed;
  uint64_t published;     /* frames made ready */
  uint64_t lost;          /* of those, overwritten before anybody claimed them */
  uint64_t packets_taken; /* commands */
  uint8_t padding_1[32];

  /* Written by the reader. */
  uint32_t space_bell;  /* futex: a slot is free, or a reader is there */
  uint32_t packet_bell; /* futex: another command */
  uint32_t attached;    /* number of this attachment, from 1; 0: nobody */
  uint32_t attachments;
  uint64_t packets_made;
  uint64_t discarded; /* ready frames that a new reader threw away as stale */
  int32_t reader_pid;
  uint8_t padding_2[28];

  struct starloop_shm_slot slot[STARLOOP_SHM_MOST_SLOTS];
  struct starloop_shm_packet packet[STARLOOP_SHM_PACKETS];
};

static_assert(sizeof(struct starloop_shm_slot) == 64, "a cache line");
static_assert(sizeof(struct starloop_shm) == 192 + 16 * 64 + 64 * 256,
              "three lines and two arrays");

static inline uint64_t starloop_slot_word(uint64_t ticket, unsigned state) {
  return ticket << 2 | state;
}
static inline uint64_t starloop_slot_ticket(uint64_t word) { return word >> 2; }
static inline unsigned starloop_slot_state(uint64_t word) { return (unsigned)(word & 3U); }

/* NOLINTEND(readability-identifier-naming) */

#endif
