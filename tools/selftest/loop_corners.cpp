// Commands, clocks and frames on their way.

#include <cmath>
#include <cstddef>
#include <limits>
#include <stop_token>
#include <vector>

#include "drivers/frame_packet.h"
#include "hil/actuator.h"
#include "hil/clock.h"
#include "hil/command_gate.h"
#include "hil/frame_loop.h"
#include "hil/no_commands.h"
#include "tools/selftest/corner.h"
#include "tools/selftest/worst.h"

namespace corners {
namespace {

using engine::Duration;
using engine::SimTime;
using hil::Command;

const SimTime kNow = engine::sim_time(1000.0);

Command trim(std::uint64_t sequence) {
  Command c;
  c.sequence = sequence;
  c.kind = hil::CommandKind::kTrim;
  c.made_at = kNow;
  c.reference = kNow;
  return c;
}

/// Good ones, and one of each kind that must not be obeyed.
struct Post {
  std::vector<Command> commands;
  int good = 0;
};
Post mixed_post() {
  Post post;
  const auto good = [&post](std::uint64_t n) {
    post.commands.push_back(trim(n));
    ++post.good;
  };
  good(1);
  good(3);
  post.commands.push_back(trim(3));  // twice
  post.commands.push_back(trim(2));  // overtaken
  Command stale = trim(4);
  stale.made_at = kNow - std::chrono::seconds(10);
  stale.time_to_live = std::chrono::seconds(1);
  post.commands.push_back(stale);
  Command early = trim(5);
  early.made_at = kNow + std::chrono::hours(1);
  post.commands.push_back(early);
  for (const double bad : {std::numeric_limits<double>::quiet_NaN(), HUGE_VAL}) {
    Command c = trim(6);
    c.trim_offset_rad[1] = bad;
    post.commands.push_back(c);
  }
  good(7);
  return post;
}

Corner commands() {
  const Post post = mixed_post();
  hil::CommandGate gate;
  int obeyed = 0;
  for (const Command& c : post.commands) obeyed += gate.admit(c, kNow) ? 0 : 1;
  const auto all = static_cast<int>(post.commands.size());
  return {"commands late, twice, no number",
          "the last that came counts",
          static_cast<double>(all - post.good),
          static_cast<double>(std::abs(obeyed - post.good)),
          0,
          "obeyed",
          "Of 9 commands 6 must be refused: a duplicate, one overtaken, a stale one, one from the "
          "future, two with a nan or an infinity. Wrongly obeyed, or refused; the bound is 0."};
}

class FixedPointing final : public hil::PointingSource {
 public:
  [[nodiscard]] engine::CameraAttitude attitude(SimTime /*t*/) noexcept override { return {}; }
  void apply(const Command& /*command*/) noexcept override {}
  [[nodiscard]] hil::TrimAngles trim_rad() const noexcept override { return {}; }
};

/// Takes its time: as long as `of` says of a frame.
class SlowGenerator final : public engine::SceneGenerator {
 public:
  SlowGenerator(hil::ManualClock& clock, Duration (*of)(std::uint64_t)) : clock_(clock), of_(of) {}
  engine::FrameReport expose(const engine::Shot& shot, engine::Budget /*budget*/,
                             engine::DnImage& /*out*/,
                             engine::TruthMask& /*mask*/) noexcept override {
    opened_.push_back(clock_.now());
    clock_.pass(of_(shot.sequence));
    return {};
  }
  [[nodiscard]] const std::vector<SimTime>& opened() const noexcept { return opened_; }

 private:
  hil::ManualClock& clock_;
  Duration (*of_)(std::uint64_t);
  std::vector<SimTime> opened_;
};

class NoSink final : public hil::FrameSink {
 public:
  engine::Status send(const hil::Frame& /*frame*/, Duration /*timeout*/) noexcept override {
    return engine::Done{};
  }
};

constexpr Duration kPeriod{100'000'000};
constexpr std::uint64_t kFrames = 50;

/// When shutters open in the loop itself, its clock standing still but for the work.
std::vector<SimTime> loop_openings(Duration (*work)(std::uint64_t)) {
  hil::ManualClock clock(kNow - kPeriod);
  FixedPointing pointing;
  SlowGenerator generator(clock, work);
  NoSink sink;
  hil::NoCommands nobody;
  hil::LoopSpec spec;
  spec.start = kNow;
  spec.period = kPeriod;
  spec.frames = kFrames;
  spec.when_busy = hil::WhenBusy::kWait;
  spec.width_px = 8;
  spec.height_px = 2;
  hil::FrameLoop loop(spec, clock, pointing, generator, sink, nobody);
  static_cast<void>(loop.run(std::stop_token{}));
  return generator.opened();
}

/// The furthest that an opening is from the grid of periods.
double off_grid_s(const std::vector<SimTime>& opened) {
  double worst = opened.empty() ? HUGE_VAL : 0.0;
  for (const SimTime t : opened) {
    const double s = engine::seconds(t - kNow);
    worst = std::fmax(worst, std::abs(std::remainder(s, engine::seconds(kPeriod))));
  }
  return worst;
}

Corner drift() {
  const auto work = [](std::uint64_t) { return Duration(700'000); };
  std::vector<SimTime> plain;
  SimTime now = kNow;
  for (std::uint64_t k = 0; k < kFrames; ++k) {
    plain.push_back(now);
    now += work(k) + kPeriod;
  }
  return {"cadence, .7 ms of work a frame",
          "sleep for a period",
          off_grid_s(plain),
          off_grid_s(loop_openings(work)),
          1e-9,
          "s",
          "How far a shutter opens off the grid of periods, of 50 frames, by a clock that nothing "
          "else moves. The bound is its tick. POSIX.1-2017, clock_nanosleep: absolute deadlines."};
}

Corner stall() {
  const auto work = [](std::uint64_t k) { return k == 10 ? kPeriod * 7 / 2 : Duration(700'000); };
  std::vector<SimTime> plain;
  SimTime now = kNow;
  for (std::uint64_t k = 0; k < kFrames; ++k) {
    now = std::max(now, kNow + kPeriod * static_cast<std::int64_t>(k));
    plain.push_back(now);
    now += work(k);
  }
  return {
      "a stall of 3.5 periods",
      "catch up at once",
      off_grid_s(plain),
      off_grid_s(loop_openings(work)),
      1e-9,
      "s",
      "How far a shutter opens off the grid after it: who catches up opens three in a burst. Ours "
      "skips and counts whole periods. The bound is the clock's tick."};
}

engine::DnImage numbered(std::uint16_t first) {
  engine::DnImage image(16, 8);
  for (std::size_t i = 0; i < image.pixels().size(); ++i)
    image.pixels()[i] = static_cast<std::uint16_t>((first + i) & 2047U);
  return image;
}

std::vector<std::byte> packet_of(const engine::DnImage& image, std::uint64_t sequence) {
  hil::Frame frame;
  frame.sequence = sequence;
  frame.pixels = &image;
  std::vector<std::byte> bytes(drivers::frame_bytes(image.width(), image.height()));
  static_cast<void>(drivers::encode_frame(frame, bytes));
  return bytes;
}

/// Sum of all bytes, modulo 2^16.
unsigned byte_sum(const std::vector<std::byte>& bytes) {
  unsigned sum = 0;
  for (const std::byte b : bytes) sum += std::to_integer<unsigned>(b);
  return sum & 0xFFFFU;
}

Corner torn_frames() {
  const std::vector<std::byte> sent = packet_of(numbered(100), 41);
  int plain = 0;
  int ours = 0;
  for (std::size_t cut = drivers::kFrameHeaderBytes; cut + 3 < sent.size(); cut += 2) {
    std::vector<std::byte> got = sent;  // two pixels come in each other's place
    std::swap(got[cut], got[cut + 2]);
    std::swap(got[cut + 1], got[cut + 3]);
    if (got == sent) continue;
    plain += byte_sum(got) == byte_sum(sent) ? 1 : 0;
    ours += drivers::decode_frame(got).ok() ? 1 : 0;
  }
  return {
      "pixels that change places",
      "sum of the bytes",
      static_cast<double>(plain),
      static_cast<double>(ours),
      0,
      "unseen",
      "Frames that are taken for whole though two neighbouring pixels are exchanged; a CRC of 32 "
      "bits tells every burst of up to 32. Castagnoli et al. 1993, DOI 10.1109/26.231911."};
}

Corner stiff_actuator() {
  hil::ActuatorSpec spec;
  spec.natural_frequency_hz = 400;
  spec.rate_limit_rad_s = 1;
  spec.acceleration_limit_rad_s2 = 1e4;
  constexpr double kStep_rad = 1e-5;
  hil::Actuator ours(spec);
  ours.advance_to(kNow);
  ours.follow(kStep_rad, 0.0, kNow);
  ours.advance_to(kNow + std::chrono::milliseconds(50));
  const double w = 2.0 * engine::kPi * spec.natural_frequency_hz;
  double angle = 0;
  double rate = 0;
  for (int ms = 0; ms < 50; ++ms) {
    const double pull = w * w * (kStep_rad - angle) - 2.0 * spec.damping * w * rate;
    angle += 1e-3 * rate;
    rate += 1e-3 * pull;
  }
  return {"a stiff actuator, 400 Hz",
          "Euler's steps of 1 ms",
          std::abs(angle - kStep_rad),
          std::abs(ours.angle_rad() - kStep_rad),
          kStep_rad * 1e-6,
          "rad",
          "Way left 50 ms after a step of 10 urad: exp(-.7 w t) is 1e-38 of it. Euler's steps grow "
          "where w h > 1.4. The bound is a millionth. Astrom and Wittenmark 1997, section 2.3."};
}

}  // namespace

Room loop_corners() {
  return {"Loop and links", {commands(), drift(), stall(), torn_frames(), stiff_actuator()}};
}

}  // namespace corners
