// A system that says no, for programs that are started with this library preloaded. What fails is
// in STARLOOP_FAULT:
//   new:N          the Nth allocation by operator new after main() has begun throws bad_alloc
//   write:N:E      the Nth write to a file fails with errno E; write:N+:E: all from the Nth on
//   short:N        the Nth write to a file writes half
//   sync:N:E       the Nth fsync or fdatasync fails with errno E
//   open:N:E       the Nth opening of a file for writing fails with errno E
//   thread:N:E     the Nth thread is not made, with errno E
//   clock          the time of day jumps an hour forward or back at every look at it
//   eintr          a signal a millisecond, all along: every call that waits is interrupted
// The C library's own streams do not come by here.

#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstdarg>
#include <cstddef>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <new>

#include <dlfcn.h>
#include <fcntl.h>
#include <pthread.h>
#include <sys/stat.h>
#include <sys/time.h>
#include <sys/uio.h>
#include <unistd.h>

namespace {

enum class What { kNothing, kNew, kWrite, kShort, kSync, kOpen, kThread, kClock, kEintr };

What what = What::kNothing;
long nth = 0;
bool from_then_on = false;
int error_number = 0;
bool in_main = false;
std::atomic<long> calls{0};

bool hit(What w) {
  if (what != w) return false;
  const long n = ++calls;
  return from_then_on ? n >= nth : n == nth;
}

template <class Function>
Function* next(const char* name) {
  return reinterpret_cast<Function*>(dlsym(RTLD_NEXT, name));
}

bool is_file(int descriptor) {
  struct stat s {};
  return fstat(descriptor, &s) == 0 && S_ISREG(s.st_mode);
}

time_t jump_s() {
  if (what != What::kClock) return 0;
  return calls++ % 2 == 0 ? 3600 : -3600;
}

void read_orders() {
  const char* text = std::getenv("STARLOOP_FAULT");
  if (text == nullptr) return;
  // Programs that this one starts are none of ours.
  unsetenv("LD_PRELOAD");
  const struct {
    const char* name;
    What what;
  } names[] = {{"new:", What::kNew},    {"write:", What::kWrite}, {"short:", What::kShort},
               {"sync:", What::kSync},  {"open:", What::kOpen},   {"thread:", What::kThread},
               {"clock", What::kClock}, {"eintr", What::kEintr}};
  for (const auto& n : names)
    if (std::strncmp(text, n.name, std::strlen(n.name)) == 0) what = n.what;
  if (what == What::kEintr) {
    struct sigaction action {};
    action.sa_handler = [](int) {};  // no SA_RESTART
    sigaction(SIGALRM, &action, nullptr);
    const itimerval every{{0, 1000}, {0, 1000}};
    setitimer(ITIMER_REAL, &every, nullptr);
    return;
  }
  const char* number = std::strchr(text, ':');
  if (number == nullptr) return;
  char* end = nullptr;
  nth = std::strtol(number + 1, &end, 10);
  if (*end == '+') {
    from_then_on = true;
    ++end;
  }
  if (*end == ':') error_number = std::atoi(end + 1);
}

int (*real_main)(int, char**, char**) = nullptr;
int watched_main(int argc, char** argv, char** environment) {
  read_orders();
  in_main = true;
  return real_main(argc, argv, environment);
}

void* allocate(std::size_t bytes, std::size_t alignment) {
  if (in_main && hit(What::kNew)) return nullptr;
  if (bytes == 0) bytes = 1;
  if (alignment <= alignof(std::max_align_t)) return std::malloc(bytes);
  return std::aligned_alloc(alignment, (bytes + alignment - 1) / alignment * alignment);
}

void* allocate_or_throw(std::size_t bytes, std::size_t alignment) {
  void* block = allocate(bytes, alignment);
  if (block == nullptr) throw std::bad_alloc();
  return block;
}

template <class Write>
ssize_t write_or_fail(int descriptor, std::size_t bytes, Write write) {
  if (what == What::kWrite && is_file(descriptor) && hit(What::kWrite)) {
    errno = error_number;
    return -1;
  }
  if (what == What::kShort && is_file(descriptor) && hit(What::kShort))
    return write(bytes > 1 ? bytes / 2 : bytes);
  return write(bytes);
}

int sync_or_fail(int descriptor, const char* name) {
  if (hit(What::kSync)) {
    errno = error_number;
    return -1;
  }
  return next<int(int)>(name)(descriptor);
}

int open_or_fail(const char* name, const char* path, int flags, mode_t mode) {
  if ((flags & O_ACCMODE) != O_RDONLY && std::strncmp(path, "/dev", 4) != 0 && hit(What::kOpen)) {
    errno = error_number;
    return -1;
  }
  return next<int(const char*, int, ...)>(name)(path, flags, mode);
}

}  // namespace

void* operator new(std::size_t n) { return allocate_or_throw(n, 0); }
void* operator new[](std::size_t n) { return allocate_or_throw(n, 0); }
void* operator new(std::size_t n, std::align_val_t a) {
  return allocate_or_throw(n, static_cast<std::size_t>(a));
}
void* operator new[](std::size_t n, std::align_val_t a) {
  return allocate_or_throw(n, static_cast<std::size_t>(a));
}
void* operator new(std::size_t n, const std::nothrow_t&) noexcept { return allocate(n, 0); }
void* operator new[](std::size_t n, const std::nothrow_t&) noexcept { return allocate(n, 0); }
void operator delete(void* block) noexcept { std::free(block); }
void operator delete[](void* block) noexcept { std::free(block); }
void operator delete(void* block, std::size_t) noexcept { std::free(block); }
void operator delete[](void* block, std::size_t) noexcept { std::free(block); }
void operator delete(void* block, std::align_val_t) noexcept { std::free(block); }
void operator delete[](void* block, std::align_val_t) noexcept { std::free(block); }
void operator delete(void* block, std::size_t, std::align_val_t) noexcept { std::free(block); }
void operator delete[](void* block, std::size_t, std::align_val_t) noexcept { std::free(block); }

extern "C" {

// NOLINTBEGIN(bugprone-reserved-identifier,readability-identifier-naming)
int __libc_start_main(int (*main)(int, char**, char**), int argc, char** argv, void (*init)(),
                      void (*fini)(), void (*rtld_fini)(), void* stack_end) {
  real_main = main;
  return next<int(int (*)(int, char**, char**), int, char**, void (*)(), void (*)(), void (*)(),
                  void*)>("__libc_start_main")(watched_main, argc, argv, init, fini, rtld_fini,
                                               stack_end);
}
// NOLINTEND(bugprone-reserved-identifier,readability-identifier-naming)

ssize_t write(int descriptor, const void* data, std::size_t bytes) {
  return write_or_fail(descriptor, bytes, [&](std::size_t n) {
    return next<ssize_t(int, const void*, std::size_t)>("write")(descriptor, data, n);
  });
}

ssize_t writev(int descriptor, const iovec* parts, int count) {
  std::size_t bytes = 0;
  for (int i = 0; i < count; ++i) bytes += parts[i].iov_len;
  return write_or_fail(descriptor, bytes, [&](std::size_t n) {
    // A short one: what fits of the first part.
    if (n < bytes)
      return next<ssize_t(int, const void*, std::size_t)>("write")(
          descriptor, parts[0].iov_base, n < parts[0].iov_len ? n : parts[0].iov_len);
    return next<ssize_t(int, const iovec*, int)>("writev")(descriptor, parts, count);
  });
}

int fsync(int descriptor) { return sync_or_fail(descriptor, "fsync"); }
int fdatasync(int descriptor) { return sync_or_fail(descriptor, "fdatasync"); }

int open(const char* path, int flags, ...) {
  va_list more;
  va_start(more, flags);
  const mode_t mode = va_arg(more, mode_t);
  va_end(more);
  return open_or_fail("open", path, flags, mode);
}
int open64(const char* path, int flags, ...) {
  va_list more;
  va_start(more, flags);
  const mode_t mode = va_arg(more, mode_t);
  va_end(more);
  return open_or_fail("open64", path, flags, mode);
}

int clock_gettime(clockid_t clock, timespec* t) {
  const int result = next<int(clockid_t, timespec*)>("clock_gettime")(clock, t);
  if (result == 0 && clock == CLOCK_REALTIME) t->tv_sec += jump_s();
  return result;
}
time_t time(time_t* out) {
  timespec t{};
  clock_gettime(CLOCK_REALTIME, &t);
  if (out != nullptr) *out = t.tv_sec;
  return t.tv_sec;
}
int gettimeofday(timeval* out, void* /*zone*/) {
  timespec t{};
  const int result = clock_gettime(CLOCK_REALTIME, &t);
  *out = {t.tv_sec, t.tv_nsec / 1000};
  return result;
}

int pthread_create(pthread_t* thread, const pthread_attr_t* attributes, void* (*body)(void*),
                   void* argument) {
  if (hit(What::kThread)) return error_number;
  return next<int(pthread_t*, const pthread_attr_t*, void* (*)(void*), void*)>("pthread_create")(
      thread, attributes, body, argument);
}

}  // extern "C"
