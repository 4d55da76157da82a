#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cstdint>
#include <functional>
#include <optional>
#include <semaphore>
#include <thread>
#include <utility>
#include <vector>

#include "engine/scene_generator.h"
#include "hil/camera_link.h"
#include "hil/clock.h"
#include "hil/pointing_source.h"
#include "hil/spsc_ring.h"

/// Stand-ins for what a loop is connected to. They remember what was asked of them; read that only
/// after FrameLoop::run() has returned, when the threads that wrote it are joined.
namespace fakes {

/// A line of sight that is trimmed at once: the ideal actuator. What a frame would show, offset[0]
/// + trim[0], is hidden in the attitude's matrix for PixelGenerator to find.
class IdealPointing final : public hil::PointingSource {
 public:
  enum class What : std::uint8_t { kAttitude, kApply };
  struct Event {
    What what;
    engine::SimTime time;         ///< kAttitude: for when
    std::uint64_t answers_frame;  ///< kApply: of the command
    friend bool operator==(const Event&, const Event&) = default;
  };

  explicit IdealPointing(double offset_rad = 0.0) : offset_rad_(offset_rad) {
    events_.reserve(4096);
  }

  [[nodiscard]] engine::CameraAttitude attitude(engine::SimTime t) noexcept override {
    events_.push_back({What::kAttitude, t, 0});
    return passing(t);
  }
  [[nodiscard]] engine::CameraAttitude passing(engine::SimTime t) noexcept override {
    if (t < last_) ++steps_back_;
    last_ = t;
    engine::CameraAttitude attitude;
    attitude.axes.matrix(0, 0) = offset_rad_ + trim_[0];
    return attitude;
  }
  void apply(const hil::Command& command) noexcept override {
    events_.push_back({What::kApply, {}, command.answers_frame});
    if (command.kind == hil::CommandKind::kTrim) trim_ = command.trim_offset_rad;
  }
  [[nodiscard]] hil::TrimAngles trim_rad() const noexcept override { return trim_; }

  [[nodiscard]] const std::vector<Event>& events() const noexcept { return events_; }
  [[nodiscard]] int steps_back() const noexcept { return steps_back_; }  ///< must stay 0

 private:
  double offset_rad_;
  hil::TrimAngles trim_{};
  engine::SimTime last_ = engine::SimTime::min();
  int steps_back_ = 0;
  std::vector<Event> events_;
};

/// Writes what IdealPointing hid at mid-exposure into the first four pixels, and the sequence into
/// the last.
class PixelGenerator final : public engine::SceneGenerator {
 public:
  /// `while_exposing`, if given, is called in each exposure: to let time pass, to ask for a stop.
  explicit PixelGenerator(std::function<void(const engine::Shot&)> while_exposing = {})
      : while_exposing_(std::move(while_exposing)) {}

  engine::FrameReport expose(const engine::Shot& shot, engine::Budget /*budget*/,
                             engine::DnImage& out, engine::TruthMask& /*mask*/) noexcept override {
    shots_.push_back(shot);
    const double seen = shot.attitude.middle.axes.matrix(0, 0);
    const auto words = std::bit_cast<std::array<std::uint16_t, 4>>(seen);
    std::copy(words.begin(), words.end(), out.pixels().begin());
    out.pixels().back() = static_cast<std::uint16_t>(shot.sequence);
    if (while_exposing_) while_exposing_(shot);
    return {};
  }
  [[nodiscard]] const std::vector<engine::Shot>& shots() const noexcept { return shots_; }

 private:
  std::function<void(const engine::Shot&)> while_exposing_;
  std::vector<engine::Shot> shots_;
};

/// What PixelGenerator wrote. Images of at least 5 pixels.
[[nodiscard]] inline double seen_in(const hil::Frame& frame) noexcept {
  std::array<std::uint16_t, 4> words{};
  std::copy_n(frame.pixels->pixels().begin(), words.size(), words.begin());
  return std::bit_cast<double>(words);
}

/// Takes every frame, or does with it what it is told to.
class Sink final : public hil::FrameSink {
 public:
  using Answer = std::function<engine::Status(const hil::Frame&, engine::Duration timeout)>;
  explicit Sink(Answer answer = {}) : answer_(std::move(answer)) {}

  engine::Status send(const hil::Frame& frame, engine::Duration timeout) noexcept override {
    sequences_.push_back(frame.sequence);
    return answer_ ? answer_(frame, timeout) : engine::Status(engine::Done{});
  }
  [[nodiscard]] const std::vector<std::uint64_t>& sequences() const noexcept { return sequences_; }

 private:
  Answer answer_;
  std::vector<std::uint64_t> sequences_;
};

/// Hands over what another thread gives it: commands, or faults.
class QueueSource final : public hil::CommandSource {
 public:
  engine::Expected<hil::Command> receive(engine::Duration timeout) noexcept override {
    done_with_.store(handed_over_, std::memory_order_release);
    Item item;
    if (!count_.try_acquire_for(timeout) || !queue_.pop(item))
      return engine::Error{engine::Fault::kTimeout, 0, "queue"};
    ++handed_over_;
    if (item.is_fault) return item.fault;
    return item.command;
  }

  /// Thread: one, for all three.
  /// Numbers the commands, as any sender does.
  void give(hil::Command command) noexcept {
    command.sequence = given_ + 1;
    push({false, {}, command});
  }
  void give(const engine::Error& fault) noexcept { push({true, fault, {}}); }
  /// Returns when the receiver has come back for more: it has then dealt with all it was given.
  void wait_until_taken() const noexcept {
    while (done_with_.load(std::memory_order_acquire) < given_) std::this_thread::yield();
  }

 private:
  struct Item {
    bool is_fault = false;
    engine::Error fault;
    hil::Command command;
  };
  void push(const Item& item) noexcept {
    ENSURE(queue_.push(item));
    ++given_;
    count_.release();
  }

  hil::SpscRing<Item, 2048> queue_;  // giver -> receiver
  std::counting_semaphore<> count_{0};
  std::uint64_t given_ = 0;        // the giver's own
  std::uint64_t handed_over_ = 0;  // the receiver's own
  std::atomic<std::uint64_t> done_with_{0};
};

/// Software under test without a cable: it sees each frame as it is sent and may answer it.
class Device final : public hil::FrameSink, public hil::CommandSource {
 public:
  using Answer = std::function<std::optional<hil::Command>(const hil::Frame&)>;
  explicit Device(Answer answer) : answer_(std::move(answer)) {}

  engine::Status send(const hil::Frame& frame, engine::Duration /*timeout*/) noexcept override {
    if (const auto command = answer_(frame)) answers_.give(*command);
    return engine::Done{};
  }
  engine::Expected<hil::Command> receive(engine::Duration timeout) noexcept override {
    return answers_.receive(timeout);
  }

 private:
  Answer answer_;
  QueueSource answers_;
};

/// A manual clock that does something just before it moves to where a sleep ends.
class HookedClock final : public hil::Clock {
 public:
  HookedClock(engine::SimTime start, std::function<void(engine::SimTime until)> before_sleep,
              engine::Duration oversleep = {})
      : clock_(start), before_sleep_(std::move(before_sleep)), oversleep_(oversleep) {}

  [[nodiscard]] engine::SimTime now() const noexcept override { return clock_.now(); }
  engine::Duration sleep_until(engine::SimTime t) noexcept override {
    if (before_sleep_) before_sleep_(t);
    if (t > clock_.now()) static_cast<void>(clock_.sleep_until(t + oversleep_));
    return clock_.now() - t;
  }

 private:
  hil::ManualClock clock_;
  std::function<void(engine::SimTime)> before_sleep_;
  engine::Duration oversleep_;
};

}  // namespace fakes
