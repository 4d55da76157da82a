#include "drivers/usb_device/function_fs_files.h"

#include <cerrno>
#include <cstring>
#include <ctime>
#include <stdexcept>

#include <fcntl.h>
#include <linux/usb/functionfs.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/ioctl.h>
#include <sys/syscall.h>
#include <unistd.h>

namespace drivers {
namespace {

using engine::Duration;

[[noreturn]] void fail(const std::string& what) {
  const int error = errno;
  throw std::runtime_error(what + ": " + std::strerror(error));
}

int opened(const std::string& path, int flags) {
  // Without waiting: an endpoint that no host has chosen yet would keep us.
  const int fd = open(path.c_str(), flags | O_NONBLOCK | O_CLOEXEC);
  if (fd < 0 && errno == ENOENT)
    throw std::runtime_error(path +
                             ": no functionfs is mounted there (modprobe usb_f_fs; "
                             "tools/usb_device/gadget.sh does all of it)");
  if (fd < 0) fail(path);
  return fd;
}

int made_eventfd() {
  const int fd = eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC);
  if (fd < 0) fail("eventfd");
  return fd;
}

FunctionFiles::Result result_of(ssize_t n) noexcept { return n < 0 ? -errno : n; }

int milliseconds_of(Duration d) noexcept {
  return static_cast<int>((d.count() + 999'999) / 1'000'000);
}

void forget_wakes(int fd) noexcept {
  std::uint64_t count = 0;
  static_cast<void>(!::read(fd, &count, sizeof count));
}

}  // namespace

FunctionFsFiles::File::~File() {
  if (fd >= 0) close(fd);
}

FunctionFsFiles::FunctionFsFiles(const std::string& folder)
    : control_{opened(folder + "/ep0", O_RDWR)} {
  describe(folder + "/ep0");
  // In the order of the descriptors. One direction each: the other one halts an endpoint.
  out_.fd = opened(folder + "/ep1", O_RDONLY);
  in_.fd = opened(folder + "/ep2", O_WRONLY);
  ended_.fd = made_eventfd();
  woken_.fd = made_eventfd();
  if (syscall(SYS_io_setup, requests_.size(), &context_) != 0) fail("io_setup");
}

FunctionFsFiles::~FunctionFsFiles() {
  // Waits for what is in flight, which it cancels.
  if (context_ != 0) syscall(SYS_io_destroy, context_);
}

void FunctionFsFiles::describe(const std::string& path) {
  const std::vector<std::byte> descriptors = function_descriptors();
  const std::vector<std::byte> strings = function_strings();
  if (::write(control_.fd, descriptors.data(), descriptors.size()) < 0)
    fail(path + ": the descriptors are not taken (has another program this function?)");
  if (::write(control_.fd, strings.data(), strings.size()) < 0)
    fail(path + ": the strings are not taken");
}

void FunctionFsFiles::wait(Duration timeout) {
  std::array<pollfd, 3> ready{
      {{control_.fd, POLLIN, 0}, {ended_.fd, POLLIN, 0}, {woken_.fd, POLLIN, 0}}};
  if (poll(ready.data(), ready.size(), milliseconds_of(timeout)) > 0) forget_wakes(woken_.fd);
}

void FunctionFsFiles::wait_for_transfer(Duration timeout) {
  pollfd ready{ended_.fd, POLLIN, 0};
  static_cast<void>(poll(&ready, 1, milliseconds_of(timeout)));
}

void FunctionFsFiles::wake() noexcept {
  const std::uint64_t one = 1;
  static_cast<void>(!::write(woken_.fd, &one, sizeof one));
}

FunctionFiles::Result FunctionFsFiles::read_control(std::span<std::byte> out) {
  return result_of(::read(control_.fd, out.data(), out.size()));
}

FunctionFiles::Result FunctionFsFiles::write_control(std::span<const std::byte> in) {
  return result_of(::write(control_.fd, in.data(), in.size()));
}

bool FunctionFsFiles::submit(std::size_t slot, unsigned operation, int fd, const std::byte* place,
                             std::size_t bytes) {
  iocb& r = requests_[slot];
  r = {};
  r.aio_data = slot;
  r.aio_lio_opcode = static_cast<std::uint16_t>(operation);
  r.aio_fildes = static_cast<std::uint32_t>(fd);
  r.aio_buf = reinterpret_cast<std::uint64_t>(place);
  r.aio_nbytes = bytes;
  r.aio_flags = IOCB_FLAG_RESFD;
  r.aio_resfd = static_cast<std::uint32_t>(ended_.fd);
  iocb* list = &r;
  in_flight_[slot] = syscall(SYS_io_submit, context_, 1, &list) == 1;
  return in_flight_[slot];
}

bool FunctionFsFiles::read(std::size_t slot, std::span<std::byte> place) {
  return submit(slot, IOCB_CMD_PREAD, out_.fd, place.data(), place.size());
}

bool FunctionFsFiles::write(std::span<const std::byte> bytes) {
  return submit(kWriteSlot, IOCB_CMD_PWRITE, in_.fd, bytes.data(), bytes.size());
}

std::optional<FunctionFiles::Ended> FunctionFsFiles::next_ended() {
  forget_wakes(ended_.fd);
  io_event event{};
  timespec at_once{};
  if (syscall(SYS_io_getevents, context_, 0, 1, &event, &at_once) != 1) return std::nullopt;
  const auto slot = static_cast<std::size_t>(event.data);
  in_flight_[slot] = false;
  return Ended{slot != kWriteSlot, slot, event.res};
}

void FunctionFsFiles::cancel(std::size_t slot) noexcept {
  io_event event{};
  // The end comes as any other does.
  if (in_flight_[slot]) syscall(SYS_io_cancel, context_, &requests_[slot], &event);
}

void FunctionFsFiles::cancel_reads() noexcept {
  for (std::size_t slot = 0; slot < kFunctionReads; ++slot) cancel(slot);
  ioctl(out_.fd, FUNCTIONFS_FIFO_FLUSH);  // what a controller keeps besides
}

void FunctionFsFiles::cancel_write() noexcept { cancel(kWriteSlot); }

std::size_t FunctionFsFiles::in_packet_bytes() {
  usb_endpoint_descriptor d{};
  if (ioctl(in_.fd, FUNCTIONFS_ENDPOINT_DESC, &d) < 0) return 0;
  return d.wMaxPacketSize & 0x7FFU;
}

}  // namespace drivers
