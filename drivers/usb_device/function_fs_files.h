#pragma once

#include <array>
#include <string>

#include <linux/aio_abi.h>

#include "drivers/usb_device/function_files.h"

namespace drivers {

/// The files of a functionfs that is mounted at a folder. Making one tells the kernel what the
/// function is; from then on the gadget can be bound to a controller. With its end the gadget is
/// unbound: to the host the device is unplugged.
class FunctionFsFiles final : public FunctionFiles {
 public:
  /// Throws std::runtime_error: nothing is mounted there, another program has it, or the kernel
  /// does not take what we are.
  explicit FunctionFsFiles(const std::string& folder);
  ~FunctionFsFiles() override;
  FunctionFsFiles(const FunctionFsFiles&) = delete;
  FunctionFsFiles& operator=(const FunctionFsFiles&) = delete;

  void wait(engine::Duration timeout) override;
  void wait_for_transfer(engine::Duration timeout) override;
  void wake() noexcept override;
  Result read_control(std::span<std::byte> out) override;
  Result write_control(std::span<const std::byte> in) override;
  [[nodiscard]] bool read(std::size_t slot, std::span<std::byte> place) override;
  [[nodiscard]] bool write(std::span<const std::byte> bytes) override;
  [[nodiscard]] std::optional<Ended> next_ended() override;
  void cancel_reads() noexcept override;
  void cancel_write() noexcept override;
  [[nodiscard]] std::size_t in_packet_bytes() override;

 private:
  static constexpr std::size_t kWriteSlot = kFunctionReads;
  /// Closed at the end.
  struct File {
    int fd = -1;
    ~File();
  };
  void describe(const std::string& folder);
  [[nodiscard]] bool submit(std::size_t slot, unsigned operation, int fd, const std::byte* place,
                            std::size_t bytes);
  void cancel(std::size_t slot) noexcept;

  File control_;
  File out_;
  File in_;
  File ended_;  // an eventfd: transfers
  File woken_;  // an eventfd: wake()
  aio_context_t context_ = 0;
  std::array<iocb, kFunctionReads + 1> requests_{};
  std::array<bool, kFunctionReads + 1> in_flight_{};
};

}  // namespace drivers
