#include "drivers/client/space_packet.h"

#include <pthread.h>
#include <string.h>

#include "drivers/client/starloop_client.h"

enum { HEADER_BYTES = 68, CHECKSUM_BYTES = 4, APID = 0x100, PROTOCOL = 1, MORE_FOLLOW = 1 };

/* Slicing by eight: table k steps a byte over k more bytes of zeros. */
static uint32_t crc_table[8][256];
static pthread_once_t crc_table_once = PTHREAD_ONCE_INIT;

static void make_crc_table(void) {
  for (uint32_t i = 0; i < 256; ++i) {
    uint32_t c = i;
    for (int bit = 0; bit < 8; ++bit) c = (c >> 1) ^ ((c & 1U) != 0 ? 0x82F63B78U : 0U);
    crc_table[0][i] = c;
  }
  for (int k = 1; k < 8; ++k)
    for (int i = 0; i < 256; ++i)
      crc_table[k][i] = (crc_table[k - 1][i] >> 8) ^ crc_table[0][crc_table[k - 1][i] & 0xFFU];
}

uint32_t starloop_crc32c(const void *bytes, size_t count) {
  const uint8_t *in = bytes;
  uint32_t c = 0xFFFFFFFFU;
  (void)pthread_once(&crc_table_once, make_crc_table);
  for (; count >= 8; count -= 8, in += 8) {
    uint64_t word;
    memcpy(&word, in, 8);
    word ^= c;
    c = 0;
    for (int k = 0; k < 8; ++k) c ^= crc_table[7 - k][(word >> (8 * k)) & 0xFFU];
  }
  for (; count > 0; --count, ++in) c = (c >> 8) ^ crc_table[0][(c ^ *in) & 0xFFU];
  return ~c;
}

/* Writes numbers one after the other, the high byte first. */
static uint8_t *put(uint8_t *out, uint64_t value, int bytes) {
  for (int i = bytes; i-- > 0;) *out++ = (uint8_t)(value >> (8 * i));
  return out;
}

static uint8_t *put_float(uint8_t *out, float value) {
  uint32_t bits;
  memcpy(&bits, &value, sizeof bits);
  return put(out, bits, 4);
}

static uint8_t *put_doubles(uint8_t *out, const double *values, int count) {
  for (int i = 0; i < count; ++i) {
    uint64_t bits;
    memcpy(&bits, &values[i], sizeof bits);
    out = put(out, bits, 8);
  }
  return out;
}

/* A life under a millisecond is not "for ever"; one over 49 days is. */
static uint32_t life_ms(int64_t life_ns) {
  const uint64_t life = life_ns > 0 ? ((uint64_t)life_ns + 999999U) / 1000000U : 0U;
  return life > 0xFFFFFFFFU ? 0U : (uint32_t)life;
}

static uint8_t *put_body(uint8_t *out, const starloop_command *c) {
  switch (c->kind) {
    case STARLOOP_TRIM:
      out = put_doubles(out, c->trim_offset_rad, 2);
      out = put_doubles(out, c->trim_rate_rad_s, 2);
      return put(out, (uint64_t)c->reference_ns, 8);
    case STARLOOP_RATE:
      out = put_doubles(out, c->trim_rate_rad_s, 2);
      return put(out, (uint64_t)c->reference_ns, 8);
    case STARLOOP_ATTITUDE:
      out = put_doubles(out, c->j2000_to_camera, 4);
      out = put_doubles(out, c->rate_rad_s, 3);
      return put(out, (uint64_t)c->reference_ns, 8);
    case STARLOOP_MODE:
      return put(out, (uint64_t)c->mode, 4);
    case STARLOOP_REPORT:
    case STARLOOP_PING:
    case STARLOOP_TRIGGER:
      break;
  }
  return out;
}

size_t starloop_encode(const starloop_command *c, uint8_t out[STARLOOP_LARGEST_COMMAND]) {
  static const uint8_t body_bytes[] = {0, 40, 24, 64, 4, 0, 0};
  const unsigned kind = (unsigned)c->kind;
  if (kind >= sizeof body_bytes) return 0;
  const size_t used = HEADER_BYTES + body_bytes[kind] + CHECKSUM_BYTES;
  uint8_t *to = out;
  to = put(to, 0x1800U | (APID + kind), 2);
  to = put(to, 0xC000U | (c->sequence & 0x3FFFU), 2);
  to = put(to, used - 7, 2);
  to = put(to, PROTOCOL, 1);
  to = put(to, c->answer.more_follow != 0 ? MORE_FOLLOW : 0, 1);
  to = put(to, c->sequence, 8);
  to = put(to, c->answer.answers_frame, 8);
  to = put(to, (uint64_t)c->answer.made_at_ns, 8);
  to = put(to, life_ms(c->answer.time_to_live_ns), 4);
  const starloop_detection *detection = &c->answer.detection;
  to = put(to, detection->id, 4);
  for (int i = 0; i < 2; ++i) to = put_float(to, detection->centroid_px[i]);
  for (int i = 0; i < 4; ++i) to = put_float(to, detection->box_px[i]);
  to = put_float(to, detection->confidence);
  to = put_body(to, c);
  (void)put(to, starloop_crc32c(out, (size_t)(to - out)), 4);
  return used;
}
