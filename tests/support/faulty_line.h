#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "hil/faults/faulty_sink.h"

/// A camera head, faults on purpose, and a cable that keeps what came through.
namespace faulty_line {

using engine::DnImage;
using engine::Duration;
using hil::FaultRecord;
using hil::FaultSpec;
using hil::FaultySink;

inline constexpr int kWidth = 24;
inline constexpr int kHeight = 16;
inline constexpr int kBits = 11;
inline constexpr int kFullScale = 2047;
inline constexpr Duration kPeriod{100'000'000};
inline const engine::SimTime kStart = engine::sim_time(1000.0);

inline FaultSpec faults(const std::string& toml, std::uint64_t seed = 1, int width_px = kWidth) {
  const auto config = engine::ConfigReader::from_text(toml, "faults.toml");
  FaultSpec spec = hil::read_faults(config, seed, width_px, kBits);
  config.reject_unknown_keys();
  return spec;
}

/// What the other end of the cable got.
struct Arrived {
  std::uint64_t sequence = 0;
  engine::SimTime shutter_open{};
  std::vector<std::uint16_t> pixels;
  std::vector<std::uint16_t> telemetry_row;
  const DnImage* address = nullptr;
  const engine::TruthMask* mask = nullptr;
  Duration timeout{};
};

class Cable final : public hil::FrameSink {
 public:
  engine::Status send(const hil::Frame& frame, Duration timeout) noexcept override {
    if (broken) return engine::Error{engine::Fault::kBusy, 0, "cable"};
    const auto pixels = frame.pixels->pixels();
    got.push_back({frame.sequence,
                   frame.shutter_open,
                   {pixels.begin(), pixels.end()},
                   {frame.telemetry_row.begin(), frame.telemetry_row.end()},
                   frame.pixels,
                   frame.truth_mask,
                   timeout});
    return engine::Done{};
  }
  [[nodiscard]] std::vector<std::uint64_t> sequences() const {
    std::vector<std::uint64_t> all;
    for (const Arrived& a : got) all.push_back(a.sequence);
    return all;
  }

  std::vector<Arrived> got;
  bool broken = false;
};

/// What the camera shows in frame k: every pixel and frame another value, none at full scale.
inline std::uint16_t shown(std::uint64_t k, int u, int v) {
  return static_cast<std::uint16_t>((k * 131 + static_cast<std::uint64_t>(v * kWidth + u) * 7) %
                                    2000);
}

/// A camera head in front of the faults: four slots in turn, as the loop has them.
class Head {
 public:
  explicit Head(const std::string& toml, std::uint64_t seed = 1, hil::Clock* clock = nullptr)
      : spec_(faults(toml, seed)),
        sink_(std::make_unique<FaultySink>(spec_, FaultySink::Shape{kWidth, kHeight}, kStart, cable,
                                           clock)),
        row_(kWidth) {
    for (DnImage& slot : slots_) slot.resize(kWidth, kHeight);
  }

  engine::Status send(std::uint64_t k, Duration timeout = kPeriod) {
    DnImage& slot = slot_of(k);
    for (int v = 0; v < kHeight; ++v)
      for (int u = 0; u < kWidth; ++u) slot.at(u, v) = paint ? paint(k, u, v) : shown(k, u, v);
    const std::vector<std::uint16_t> before(slot.pixels().begin(), slot.pixels().end());
    std::fill(row_.begin(), row_.end(), static_cast<std::uint16_t>(k));
    hil::Frame frame;
    frame.sequence = k;
    frame.shutter_open = kStart + kPeriod * static_cast<std::int64_t>(k);
    frame.bits = kBits;
    frame.pixels = &slot;
    frame.telemetry_row = row_;
    frame.truth_mask = &mask_;
    const engine::Status status = sink_->send(frame, timeout);
    EXPECT_TRUE(std::equal(before.begin(), before.end(), slot.pixels().begin()))
        << "the loop's own slot was written";
    for (FaultRecord r; sink_->records().pop(r);) records.push_back(r);
    return status;
  }
  void send_all(std::uint64_t frames) {
    for (std::uint64_t k = 0; k < frames; ++k) static_cast<void>(send(k));
  }

  [[nodiscard]] DnImage& slot_of(std::uint64_t k) { return slots_[k % slots_.size()]; }
  [[nodiscard]] FaultySink& sink() { return *sink_; }
  [[nodiscard]] const FaultSpec& spec() const { return spec_; }
  [[nodiscard]] const engine::TruthMask* mask() const { return &mask_; }
  [[nodiscard]] std::map<std::uint64_t, FaultRecord> by_frame() const {
    std::map<std::uint64_t, FaultRecord> out;
    for (const FaultRecord& r : records) EXPECT_TRUE(out.emplace(r.frame, r).second) << r.frame;
    return out;
  }

  Cable cable;
  std::function<std::uint16_t(std::uint64_t, int, int)> paint;
  std::vector<FaultRecord> records;

 private:
  FaultSpec spec_;
  std::unique_ptr<FaultySink> sink_;
  std::array<DnImage, 4> slots_;
  std::vector<std::uint16_t> row_;
  engine::TruthMask mask_;
};

inline void expect_adds_up(const FaultySink& sink) {
  const hil::FrameFaultCounts& c = sink.counts();
  EXPECT_EQ(c.taken, c.delivered + c.dropped + c.away + c.refused + c.held);
  EXPECT_EQ(c.copies, c.copies_delivered + c.copies_refused + c.copies_held);
}

inline std::uint16_t pixel(const Arrived& a, int u, int v) {
  return a.pixels[static_cast<std::size_t>(v * kWidth + u)];
}

inline bool is_clean(const Arrived& a, std::uint64_t k) {
  for (int v = 0; v < kHeight; ++v)
    for (int u = 0; u < kWidth; ++u)
      if (pixel(a, u, v) != shown(k, u, v)) return false;
  return true;
}

/// Half a width of five sigma about what n tries of chance p give.
inline double five_sigma(double n, double p) { return 5.0 * std::sqrt(n * p * (1.0 - p)); }

}  // namespace faulty_line
