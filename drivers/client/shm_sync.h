/* How two processes meet in shared memory: atomic words, futexes, locks that end with their owner.
 * C11 and C++20, GCC and Clang, Linux. Define _GNU_SOURCE before the first #include. Not installed.
 */
#ifndef STARLOOP_SHM_SYNC_H
#define STARLOOP_SHM_SYNC_H

#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <linux/futex.h>
#include <stddef.h>
#include <stdint.h>
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

static inline uint32_t starloop_load32(const uint32_t* word) {
  return __atomic_load_n(word, __ATOMIC_ACQUIRE);
}
static inline uint64_t starloop_load64(const uint64_t* word) {
  return __atomic_load_n(word, __ATOMIC_ACQUIRE);
}
static inline void starloop_store32(uint32_t* word, uint32_t value) {
  __atomic_store_n(word, value, __ATOMIC_RELEASE);
}
static inline void starloop_store64(uint64_t* word, uint64_t value) {
  __atomic_store_n(word, value, __ATOMIC_RELEASE);
}
/* 1: `word` was `from` and is now `to`. */
static inline int starloop_change64(uint64_t* word, uint64_t from, uint64_t to) {
  return __atomic_compare_exchange_n(word, &from, to, 0, __ATOMIC_ACQ_REL, __ATOMIC_ACQUIRE) ? 1
                                                                                             : 0;
}

/* Until the bell is no longer at `seen`, or somebody rings, or the time is over. May return early.
 */
static inline void starloop_wait(const uint32_t* bell, uint32_t seen, int64_t at_most_ns) {
  struct timespec time;
  if (at_most_ns <= 0) return;
  time.tv_sec = (time_t)(at_most_ns / 1000000000);
  time.tv_nsec = (long)(at_most_ns % 1000000000);
  (void)syscall(SYS_futex, bell, FUTEX_WAIT, seen, &time, NULL, 0);
}
static inline void starloop_ring(uint32_t* bell) {
  __atomic_fetch_add(bell, 1, __ATOMIC_RELEASE);
  (void)syscall(SYS_futex, bell, FUTEX_WAKE, INT_MAX, NULL, NULL, 0);
}

static inline struct flock starloop_byte(int type, int which) {
  struct flock byte;
  byte.l_type = (short)type;
  byte.l_whence = SEEK_SET;
  byte.l_start = which;
  byte.l_len = 1;
  byte.l_pid = 0;
  return byte;
}
/* 1: the lock is ours until we unlock it, or end. */
static inline int starloop_lock(int fd, int which) {
  struct flock byte = starloop_byte(F_WRLCK, which);
  return fcntl(fd, F_OFD_SETLK, &byte) == 0 ? 1 : 0;
}
static inline void starloop_unlock(int fd, int which) {
  struct flock byte = starloop_byte(F_UNLCK, which);
  (void)fcntl(fd, F_OFD_SETLK, &byte);
}
/* 1: somebody else, who is alive, holds it. */
static inline int starloop_locked(int fd, int which) {
  struct flock byte = starloop_byte(F_WRLCK, which);
  return fcntl(fd, F_OFD_GETLK, &byte) == 0 && byte.l_type != F_UNLCK ? 1 : 0;
}

#endif
