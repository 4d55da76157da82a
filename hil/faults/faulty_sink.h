#pragma once

#include <memory>
#include <vector>

#include "hil/camera_link.h"
#include "hil/clock.h"
#include "hil/faults/fault_record.h"
#include "hil/faults/fault_spec.h"
#include "hil/faults/pixel_faults.h"

namespace hil {

/// What the faults of commands know of the frames. Before a frame goes out, its moment; of one that
/// does not, once more, what its stand-in has to wait for.
struct FrameNews {
  static constexpr std::uint64_t kNothing = std::numeric_limits<std::uint64_t>::max();

  FaultMoment at;
  bool withheld = false;           ///< nobody can answer it now
  std::uint64_t after = kNothing;  ///< the late frame that went out instead, whose answer is due
};
using FrameNewsRing = SpscRing<FrameNews, 1024>;

/// Counts that add up: taken == delivered + dropped + away + refused + held, and
/// copies == copies_delivered + copies_refused + copies_held.
struct FrameFaultCounts {
  std::uint64_t taken = 0;  ///< from the loop
  std::uint64_t delivered = 0;
  std::uint64_t dropped = 0;
  std::uint64_t away = 0;
  std::uint64_t refused = 0;  ///< by the real link, or a slow one out of time
  std::uint64_t held = 0;     ///< late ones, held back to this moment
  std::uint64_t copies = 0;
  std::uint64_t copies_delivered = 0;
  std::uint64_t copies_refused = 0;
  std::uint64_t copies_held = 0;
  std::uint64_t records_lost = 0;  ///< the observer was too slow; the fault still happened
};

/// A link on which the frames of a scenario's faults go wrong, between the loop and the real one.
///
/// Faults of pixels come before the link's own checksum, which is then right: they are the
/// camera's, not the cable's. The loop's own slot is never written: what changes does so in a copy,
/// and a frame that no fault touches goes on as it is, in the loop's own memory. The telemetry row
/// and the truth mask go on unchanged; a frame that is held back or sent again has lost its mask.
/// One of away, dropped, late and duplicated happens to a frame, in this order; to one that is away
/// or dropped nothing else does. "The frame before" of torn and frozen is the last that got further
/// than that; the first of all is neither. To a frozen picture nothing else happens but wrong bits.
/// To the loop a dropped or late frame is sent, and one for a link that is away a fault. What is
/// held when the run ends is never sent.
///
/// Thread: sender, but for the rings. Loop-safe.
class FaultySink final : public FrameSink {
 public:
  struct Shape {
    int width_px = 0;
    int height_px = 0;
  };
  /// `start`: the run's first shutter. `clock`: what slow links sleep by; none, and they are not
  /// slow. Allocates all that its faults will need.
  FaultySink(const FaultSpec& spec, Shape shape, engine::SimTime start, FrameSink& inner,
             Clock* clock);

  engine::Status send(const Frame& frame, engine::Duration timeout) noexcept override;
  [[nodiscard]] bool has_reader() const noexcept override { return inner_.has_reader(); }

  /// Thread: one observer.
  [[nodiscard]] FaultRing& records() noexcept { return records_; }
  /// Thread: receiver.
  [[nodiscard]] FrameNewsRing& news() noexcept { return news_; }
  /// After the run. happened()[i]: how many records fault i of the spec made, lost or not.
  [[nodiscard]] const FrameFaultCounts& counts() const noexcept { return counts_; }
  [[nodiscard]] const std::vector<std::uint64_t>& happened() const noexcept { return happened_; }

 private:
  struct Held {
    Frame frame;
    engine::DnImage pixels;
    std::vector<std::uint16_t> telemetry_row;
    std::uint64_t due = 0;  ///< goes out just before this frame
    bool is_copy = false;
    bool used = false;
  };

  struct Route {
    bool away = false;
    bool dropped = false;
    bool twice = false;
    std::uint64_t late_by = 0;

    [[nodiscard]] bool withheld() const noexcept { return away || dropped || late_by > 0; }
  };
  /// Calls act(fault, draws) for each fault of these kinds that happens to the frame in hand.
  template <class Act>
  void each(FaultKind first, FaultKind last, Act&& act) noexcept;
  [[nodiscard]] Route choose_route() noexcept;
  /// Pre: neither away nor dropped.
  [[nodiscard]] engine::Status send_along(const Frame& frame, const Route& route,
                                          engine::Duration timeout) noexcept;

  void damage(const Frame& frame) noexcept;
  void damage_detector(std::size_t fault, engine::Draws& draws, int bits) noexcept;
  void tear(std::size_t fault, engine::Draws& draws) noexcept;
  void flip(std::size_t fault, engine::Draws& draws, int bits) noexcept;
  [[nodiscard]] engine::DnImage& writable() noexcept;
  [[nodiscard]] engine::Duration clock_error() noexcept;

  void hold(const Frame& frame, std::uint64_t due, bool is_copy) noexcept;
  [[nodiscard]] bool is_due(const Held& held, const Route& route) const noexcept;
  /// Returns the last late frame that went out, or FrameNews::kNothing.
  std::uint64_t send_held(const Route& route, engine::Duration share) noexcept;
  [[nodiscard]] engine::Status pass_on(const Frame& frame, engine::Duration timeout) noexcept;
  void record(std::size_t fault, std::int64_t place, std::int64_t count, double amount) noexcept;

  FaultSpec spec_;
  Shape shape_;
  engine::SimTime start_;
  FrameSink& inner_;
  Clock* clock_;
  Bloom bloom_;
  bool remembers_ = false;  // something shows the frame before
  engine::DnImage changed_;
  engine::DnImage before_;
  std::uint64_t before_sequence_ = 0;
  bool has_before_ = false;
  std::vector<Held> held_;

  // The frame in hand.
  FaultMoment at_;
  const engine::DnImage* pixels_ = nullptr;

  FrameFaultCounts counts_;
  std::vector<std::uint64_t> happened_;
  FaultRing records_;   // sender -> observer
  FrameNewsRing news_;  // sender -> receiver
};

}  // namespace hil
