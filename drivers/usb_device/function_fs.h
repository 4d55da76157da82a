#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <functional>
#include <optional>
#include <stop_token>
#include <vector>

#include "drivers/usb_device/frame_intake.h"
#include "drivers/usb_device/function_files.h"
#include "hil/space_packet.h"
#include "hil/spsc_ring.h"

namespace drivers {

/// What became of the function so far.
struct FunctionCounts {
  std::uint64_t connections = 0;    ///< a host chose the configuration
  std::uint64_t sessions = 0;       ///< resets
  std::uint64_t refused = 0;        ///< requests stalled
  std::uint64_t failed_reads = 0;   ///< neither cancelled by us nor unplugged
  std::uint64_t failed_writes = 0;  ///< messages that the host never got
  std::uint64_t commands_lost = 0;  ///< no session, or sixteen waited
};

/// The frame-injection device as a USB function of this machine: usb_protocol.md on the files of
/// functionfs.
///
/// One thread serves all of it, since the kernel takes transfers without waiting (AIO) and says
/// when they end: endpoint files cannot be polled, and a thread blocked in one is freed by a signal
/// alone, which may come just before it blocks. It also gives the bus several reads to fill while a
/// frame is handed over, and takes them back exactly: a host that gives up a frame in the middle
/// leaves its beginning in a read, and the next session's first bytes would follow it there. So a
/// reset cancels all reads before it is answered.
/// Thread: one, but for command(). Allocates when made.
class FunctionFs {
 public:
  using TakeFrames = std::function<void(FrameIntake&)>;
  /// `take` is called when there are whole frames.
  FunctionFs(FunctionFiles& files, const UsbLimits& limits, TakeFrames take);

  /// Until it is asked to stop. Throws std::runtime_error: the controller keeps a transfer.
  void run(const std::stop_token& stop);
  /// One round of it, without waiting.
  void step();

  /// To go to the host. Thread: one other.
  void command(const hil::CommandPacket& packet) noexcept;

  [[nodiscard]] const FrameIntake& intake() const noexcept { return intake_; }
  [[nodiscard]] FunctionCounts counts() const noexcept;

 private:
  struct Request {
    unsigned type = 0;
    unsigned number = 0;
    unsigned value = 0;
    unsigned index = 0;
    std::size_t bytes = 0;
  };
  void take_events();
  void take_request(const Request& r);
  void begin_session();
  void answer(const Request& r, std::span<const std::byte> bytes);
  void refuse(const Request& r);
  void connect();
  void disconnect();
  void take_transfers();
  void take_read(std::size_t slot, FunctionFiles::Result result);
  void take_write(FunctionFiles::Result result);
  void take_commands();
  void keep_reading();
  void say();
  /// Afterwards none of them is in flight; what those that had not ended held is forgotten.
  void take_back(bool write_too);
  [[nodiscard]] bool may_try() const noexcept;
  void try_later() noexcept;

  FunctionFiles& files_;
  TakeFrames take_;
  FrameIntake intake_;
  std::vector<std::byte> places_;  // of the reads
  std::size_t oldest_ = 0;         // read in flight
  std::size_t reading_ = 0;
  std::array<std::optional<FunctionFiles::Result>, kFunctionReads> read_ended_;
  std::array<std::byte, kLargestUsbMessage> message_{};
  std::size_t message_bytes_ = 0;  // not yet given to the kernel
  bool writing_ = false;
  bool end_is_due_ = false;  // of a message: it was whole packets
  bool connected_ = false;
  bool in_session_ = false;
  // What ends now was taken back.
  bool forget_reads_ = false;
  bool forget_write_ = false;
  engine::Duration try_again_{};
  hil::SpscRing<hil::CommandPacket, 16> commands_;  // receiver -> device
  std::atomic<std::uint64_t> commands_lost_{0};
  FunctionCounts counts_;
};

}  // namespace drivers
