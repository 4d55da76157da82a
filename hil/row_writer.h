#pragma once

#include <vector>

#include "hil/telemetry_row.h"

namespace hil {

/// Gives each frame its telemetry row on the way to a link: the last thing before it, so that the
/// row says what the header says.
/// Thread: sender. Loop-safe once made.
class RowWriter final : public FrameSink {
 public:
  /// The link outlives it. Pre: width_px >= kTelemetryRowPixels.
  RowWriter(FrameSink& link, int width_px) : link_(link), row_(static_cast<std::size_t>(width_px)) {
    ENSURE(row_.size() >= kTelemetryRowPixels);
  }
  engine::Status send(const Frame& frame, engine::Duration timeout) noexcept override {
    Frame with_row = frame;
    static_cast<void>(encode_telemetry_row(telemetry_of(frame, sent_++), row_));
    with_row.telemetry_row = row_;
    return link_.send(with_row, timeout);
  }
  [[nodiscard]] bool has_reader() const noexcept override { return link_.has_reader(); }

 private:
  FrameSink& link_;
  std::vector<std::uint16_t> row_;
  std::uint64_t sent_ = 0;
};

}  // namespace hil
