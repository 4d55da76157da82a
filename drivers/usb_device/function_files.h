#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "engine/core/time.h"

namespace drivers {

/// Descriptors of the function as functionfs takes them: the interface of usb_protocol.md at full,
/// high and super speed. The device controller changes the endpoints' addresses as it must.
[[nodiscard]] std::vector<std::byte> function_descriptors();
/// The interface's name, in English.
[[nodiscard]] std::vector<std::byte> function_strings();

/// Bytes that a read of bulk OUT takes at most: a multiple of every packet size, so that a read
/// ends early where a packet is short, and only there. A kernel without scatter-gather allocates as
/// much in one piece for each.
inline constexpr std::size_t kFunctionReadBytes = std::size_t{64} * 1024;
/// Reads in flight at once.
inline constexpr std::size_t kFunctionReads = 8;

/// What a USB function is to its program: the files of functionfs, as the kernel serves them.
/// The other one is the tests' model of that kernel.
/// Results are those of the system call: bytes, or the negative errno.
/// Thread: one, but for wake().
class FunctionFiles {
 public:
  using Result = std::int64_t;
  virtual ~FunctionFiles() = default;

  /// Until there is an event, a transfer has ended, somebody called wake(), or the time is over.
  virtual void wait(engine::Duration timeout) = 0;
  /// As wait(), for transfers alone.
  virtual void wait_for_transfer(engine::Duration timeout) = 0;
  /// Thread: any. Also from a signal handler.
  virtual void wake() noexcept = 0;

  /// ep0: an event, or the data of a request that sends some. The wrong one of the two refuses a
  /// request.
  virtual Result read_control(std::span<std::byte> out) = 0;
  /// ep0: the answer to a request that wants one.
  virtual Result write_control(std::span<const std::byte> in) = 0;

  /// Bulk OUT; the place stays untouched until the read has ended. At most kFunctionReads. False:
  /// not now.
  [[nodiscard]] virtual bool read(std::size_t slot, std::span<std::byte> place) = 0;
  /// Bulk IN; one at a time, of any length.
  [[nodiscard]] virtual bool write(std::span<const std::byte> bytes) = 0;

  struct Ended {
    bool is_read = false;
    std::size_t slot = 0;  ///< of a read
    Result result = 0;
  };
  /// A transfer that has ended, in the order of the kernel.
  [[nodiscard]] virtual std::optional<Ended> next_ended() = 0;
  /// Those in flight end soon, with what they have or an error; packets of a read that was not yet
  /// full are lost.
  virtual void cancel_reads() noexcept = 0;
  virtual void cancel_write() noexcept = 0;
  /// Of bulk IN at the speed of the moment; 0: not connected.
  [[nodiscard]] virtual std::size_t in_packet_bytes() = 0;
};

}  // namespace drivers
