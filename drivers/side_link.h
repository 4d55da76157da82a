#pragma once

#include <memory>

#include "hil/frame_writer.h"

namespace drivers {

/// A link beside the first one: it gets a copy of each frame on a thread of its own, so that a slow
/// one costs the first nothing. Frames that come while its copies are all waiting are left out; a
/// rehearsal waits.
/// Thread: sender. Loop-safe once made.
class SideLink final : public hil::FrameSink {
 public:
  SideLink(std::unique_ptr<hil::FrameSink> link, int width_px, int height_px,
           hil::WhenBusy when_busy);
  engine::Status send(const hil::Frame& frame, engine::Duration timeout) noexcept override {
    return writer_.take(frame, timeout);
  }
  [[nodiscard]] bool has_reader() const noexcept override { return link_->has_reader(); }
  /// Sends what is waiting. Nothing is taken after that.
  void finish() noexcept { writer_.finish(); }

  // After finish().
  [[nodiscard]] const hil::FrameWriter& writer() const noexcept { return writer_; }

 private:
  class Store;
  std::unique_ptr<hil::FrameSink> link_;
  std::unique_ptr<hil::FrameStore> store_;
  hil::FrameWriter writer_;
};

}  // namespace drivers
