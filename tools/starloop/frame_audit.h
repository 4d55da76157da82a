#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "drivers/frame_packet.h"

namespace starloop {

/// An unbelieving reader: counts the frames that came through a link, and what was wrong with them.
/// Thread: one; read it when that has ended.
class FrameAudit {
 public:
  void see(std::span<const std::byte> bytes) noexcept {
    const auto frame = drivers::decode_frame(bytes);
    if (!frame.ok()) {
      ++torn_;
      return;
    }
    const std::uint64_t sequence = frame.value().frame.sequence;
    if (whole_ > 0 && sequence <= last_) ++out_of_order_;
    last_ = sequence;
    ++whole_;
  }

  [[nodiscard]] std::uint64_t whole() const noexcept { return whole_; }
  [[nodiscard]] std::uint64_t torn() const noexcept { return torn_; }  ///< or otherwise no frame
  [[nodiscard]] std::uint64_t out_of_order() const noexcept { return out_of_order_; }

 private:
  std::uint64_t whole_ = 0;
  std::uint64_t torn_ = 0;
  std::uint64_t out_of_order_ = 0;
  std::uint64_t last_ = 0;
};

}  // namespace starloop
