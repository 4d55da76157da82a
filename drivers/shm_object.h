#pragma once

#include <cstddef>
#include <functional>
#include <span>
#include <string>

namespace drivers {

/// A named piece of shared memory that this process makes, and takes away at the end.
///
/// It gets its name whole, filled in and locked: nobody sees a half-made one. What a dead camera
/// left under the name is replaced; a living camera's, somebody else's or what is no link of ours
/// is left alone. Its memory is taken at once, so that a small /dev/shm is an error here and not a
/// signal later.
///
/// Leaves out: a peer of the same user that cuts the object short between whole() and an access
/// still ends the process; that user could as well send it a signal.
class ShmObject {
 public:
  /// Throws std::runtime_error. `name` is one of shm_open(3), the slash in front optional.
  ShmObject(const std::string& name, std::size_t bytes,
            const std::function<void(std::span<std::byte>)>& fill);
  ~ShmObject();
  ShmObject(const ShmObject&) = delete;
  ShmObject& operator=(const ShmObject&) = delete;

  [[nodiscard]] std::span<std::byte> bytes() const noexcept { return bytes_; }
  /// That nobody has cut it short. Loop-safe.
  [[nodiscard]] bool whole() const noexcept;
  /// That a reader is there, says the kernel. Loop-safe.
  [[nodiscard]] bool reader_lives() const noexcept;

 private:
  void take_memory(std::size_t bytes);
  void publish();
  void remove_stale() const;
  void close() noexcept;

  std::string path_;
  int fd_ = -1;
  std::span<std::byte> bytes_;
};

}  // namespace drivers
