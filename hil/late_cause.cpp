#include "hil/late_cause.h"

#include <array>
#include <charconv>
#include <ctime>

#include <fcntl.h>
#include <unistd.h>

namespace hil {

using engine::Duration;

LateCause late_cause(const Delay& d) noexcept {
  const auto most = [&d](Duration part) { return 2 * part > d.late; };
  if (most(d.held_up)) return LateCause::kMachine;
  if (!d.in_time) return LateCause::kOwnWork;
  if (!d.loop) return LateCause::kUnknown;
  if (most(d.loop->ran)) return LateCause::kOwnWork;
  return most(d.loop->queued) && most(d.loop->process_ran) ? LateCause::kOwnWork
                                                           : LateCause::kMachine;
}

RunTimeMeter::RunTimeMeter() noexcept
    : file_(open("/proc/thread-self/schedstat", O_RDONLY | O_CLOEXEC)) {}

RunTimeMeter::~RunTimeMeter() {
  if (file_ >= 0) close(file_);
}

std::optional<RunTime> RunTimeMeter::read() const noexcept {
  std::array<char, 64> text{};  // "ran queued slices", the first two in ns
  const ssize_t size = file_ < 0 ? -1 : pread(file_, text.data(), text.size(), 0);
  if (size <= 0) return std::nullopt;
  const char* const end = text.data() + size;
  std::int64_t ran = 0;
  std::int64_t queued = 0;
  const auto first = std::from_chars(text.data(), end, ran);
  if (first.ec != std::errc{} || first.ptr == end || *first.ptr != ' ') return std::nullopt;
  if (std::from_chars(first.ptr + 1, end, queued).ec != std::errc{}) return std::nullopt;
  timespec process{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &process);
  return RunTime{Duration(ran), Duration(queued),
                 std::chrono::seconds(process.tv_sec) + Duration(process.tv_nsec)};
}

}  // namespace hil
