#include "drivers/shm_object.h"

#include <cerrno>
#include <cstring>
#include <stdexcept>

#include <sys/mman.h>
#include <sys/stat.h>

#include "drivers/client/shm_layout.h"
#include "drivers/client/shm_sync.h"

namespace drivers {
namespace {

constexpr const char* kFolder = "/dev/shm";  // where shm_open(3) of Linux keeps its objects
constexpr int kAttempts = 8;                 // at a name that others want, too

[[noreturn]] void fail(const std::string& what) {
  throw std::runtime_error("shared memory " + what);
}
[[noreturn]] void fail_with_errno(const std::string& what) {
  fail(what + ": " + std::strerror(errno));
}

std::string path_of(const std::string& name) {
  const std::string bare = name.starts_with('/') ? name.substr(1) : name;
  if (bare.empty() || bare.size() > 200 || bare.starts_with('.') ||
      bare.find('/') != std::string::npos || bare.find('\0') != std::string::npos) {
    fail("\"" + name + "\": a name is 1 to 200 characters without slash, the first no dot");
  }
  return std::string(kFolder) + "/" + bare;
}

bool same_file(const struct stat& a, const struct stat& b) noexcept {
  return a.st_dev == b.st_dev && a.st_ino == b.st_ino;
}

class Descriptor {
 public:
  explicit Descriptor(int fd) noexcept : fd_(fd) {}
  ~Descriptor() {
    if (fd_ >= 0) ::close(fd_);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  [[nodiscard]] int get() const noexcept { return fd_; }

 private:
  int fd_;
};

}  // namespace

ShmObject::ShmObject(const std::string& name, std::size_t bytes,
                     const std::function<void(std::span<std::byte>)>& fill)
    : path_(path_of(name)) {
  try {
    take_memory(bytes);
    fill(bytes_);
    publish();
  } catch (...) {
    close();
    throw;
  }
}

ShmObject::~ShmObject() {
  struct stat ours {};
  struct stat named {};
  if (fstat(fd_, &ours) == 0 && stat(path_.c_str(), &named) == 0 && same_file(ours, named))
    unlink(path_.c_str());
  close();
}

void ShmObject::close() noexcept {
  if (bytes_.data() != nullptr) munmap(bytes_.data(), bytes_.size());
  if (fd_ >= 0) ::close(fd_);
}

void ShmObject::take_memory(std::size_t bytes) {
  fd_ = open(kFolder, O_TMPFILE | O_RDWR | O_CLOEXEC, 0600);
  if (fd_ < 0) fail_with_errno(path_);
  if (const int error = posix_fallocate(fd_, 0, static_cast<off_t>(bytes)); error != 0) {
    errno = error;
    fail_with_errno(path_ + ": " + std::to_string(bytes) + " bytes");
  }
  void* memory = mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_POPULATE, fd_, 0);
  if (memory == MAP_FAILED) fail_with_errno(path_);
  bytes_ = {static_cast<std::byte*>(memory), bytes};
}

void ShmObject::publish() {
  if (starloop_lock(fd_, STARLOOP_SHM_CAMERA) == 0) fail_with_errno(path_ + ": lock");
  const std::string nameless = "/proc/self/fd/" + std::to_string(fd_);
  for (int attempt = 0; attempt < kAttempts; ++attempt) {
    if (linkat(AT_FDCWD, nameless.c_str(), AT_FDCWD, path_.c_str(), AT_SYMLINK_FOLLOW) == 0) return;
    if (errno != EEXIST) fail_with_errno(path_);
    remove_stale();
  }
  fail(path_ + ": others keep taking the name");
}

/// Frees the name when a dead camera of ours had it. Whoever removes an object holds its lock, and
/// has seen the name stand for it under that lock: two that clean up cannot remove a third one's.
void ShmObject::remove_stale() const {
  const Descriptor old(open(path_.c_str(), O_RDWR | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK));
  if (old.get() < 0) {
    if (errno == ENOENT) return;
    fail_with_errno(path_ + " is somebody else's");
  }
  struct stat before {};
  starloop_shm header{};
  if (fstat(old.get(), &before) != 0 || !S_ISREG(before.st_mode) || before.st_uid != geteuid() ||
      pread(old.get(), &header, sizeof header, 0) != static_cast<ssize_t>(sizeof header) ||
      header.magic != STARLOOP_SHM_MAGIC) {
    fail(path_ + " exists and is no link of ours: choose another name, or remove it");
  }
  if (starloop_lock(old.get(), STARLOOP_SHM_CAMERA) == 0)
    fail(path_ + " is in use by process " + std::to_string(header.camera_pid));
  struct stat now {};
  if (stat(path_.c_str(), &now) != 0 || !same_file(before, now)) return;
  unlink(path_.c_str());
}

bool ShmObject::whole() const noexcept {
  struct stat now {};
  return fstat(fd_, &now) == 0 && static_cast<std::size_t>(now.st_size) == bytes_.size();
}

bool ShmObject::reader_lives() const noexcept {
  return starloop_locked(fd_, STARLOOP_SHM_READER) != 0;
}

}  // namespace drivers
