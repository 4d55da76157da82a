#include <cstdio>
#include <filesystem>
#include <map>
#include <optional>
#include <stop_token>
#include <thread>

#include <spdlog/spdlog.h>

#include "engine/core/crc32c.h"
#include "engine/core/fits.h"
#include "hil/frame_writer.h"
#include "hil/no_commands.h"
#include "tools/starloop/rig.h"
#include "tools/starloop/run_folder.h"
#include "tools/starloop/subcommands.h"

namespace starloop {
namespace {

namespace fs = std::filesystem;
using engine::Duration;
using engine::Status;

// Nobody is in a hurry: only a disk that has stopped for good is given up.
constexpr Duration kPatience = std::chrono::hours(1);
constexpr Duration kLook{100'000'000};

/// Takes the frames of a replay and holds them against the log.
class Comparison final : public hil::FrameSink {
 public:
  /// `writer` may be null.
  Comparison(const hil::Recording& log, hil::FrameWriter* writer) : writer_(writer) {
    for (const hil::LogFrame& f : log.frames) logged_[f.sequence] = f.pixels_crc32c;
  }

  Status send(const hil::Frame& frame, Duration timeout) noexcept override {
    ++frames_;
    const auto it = logged_.find(frame.sequence);
    if (it == logged_.end()) {
      ++without_;
    } else if (it->second == engine::crc32c(std::as_bytes(frame.pixels->pixels()))) {
      ++equal_;
    } else if (!first_other_) {
      first_other_ = frame.sequence;
      other_pixels_ = *frame.pixels;
    }
    return writer_ != nullptr ? writer_->take(frame, timeout) : Status(engine::Done{});
  }

  // Read these once the loop is through.
  [[nodiscard]] std::uint64_t equal() const noexcept { return equal_; }
  [[nodiscard]] std::uint64_t compared() const noexcept { return frames_ - without_; }
  [[nodiscard]] std::uint64_t without() const noexcept { return without_; }
  [[nodiscard]] const auto& first_other() const noexcept { return first_other_; }
  [[nodiscard]] const engine::DnImage& other_pixels() const noexcept { return other_pixels_; }

 private:
  hil::FrameWriter* writer_;
  std::map<std::uint64_t, std::uint32_t> logged_;
  std::uint64_t frames_ = 0;
  std::uint64_t equal_ = 0;
  std::uint64_t without_ = 0;
  std::optional<std::uint64_t> first_other_;
  engine::DnImage other_pixels_;
};

/// The loop as the log tells it, as far as it tells it.
hil::LoopSpec replay_spec(const hil::Recording& log) {
  hil::LoopSpec spec = log.start.loop;
  spec.frames = log.decisions.due.empty() ? 0 : log.decisions.due.back().frame + 1;
  if (log.end) spec.frames = std::max(spec.frames, log.end->loop.due);
  spec.when_busy = hil::WhenBusy::kWait;
  spec.send_timeout = kPatience;
  spec.replay = &log.decisions;
  return spec;
}

Scenario scenario_of(const hil::Recording& log, const std::string& path) {
  const hil::LogStart& start = log.start;
  Scenario scenario =
      load_scenario(ScenarioSource{start.scenario_file, start.scenario, start.overrides});
  const engine::CameraGeometry& camera = scenario.scene.camera;
  if (camera.width_px != start.loop.width_px || camera.height_px != start.loop.height_px ||
      scenario.detector.bits != start.loop.bits || scenario.scene.seed != start.seed)
    throw engine::ConfigError(path + ": expected a log whose scenario and loop agree, got another");
  return scenario;
}

/// The frame as the run kept it beside its log, in one of the forms that lose nothing.
std::optional<engine::DnImage> kept_pixels(const fs::path& folder, std::uint64_t sequence) {
  if (auto raw = hil::recorded_pixels((folder / "frames.slog").string(), sequence)) return raw;
  const fs::path fits = folder / hil::frame_name(sequence, "fits");
  std::error_code error;
  if (!fs::exists(fits, error)) return std::nullopt;
  return engine::read_fits(fits.string());
}

void tell_difference(const fs::path& folder, std::uint64_t sequence, const engine::DnImage& now) {
  std::printf("frame %llu is the first that differs\n", static_cast<unsigned long long>(sequence));
  const auto then = kept_pixels(folder, sequence);
  if (!then || then->width() != now.width() || then->height() != now.height()) {
    std::printf("  its pixels were not kept as FITS or raw: which DN differ is not known\n");
    return;
  }
  std::size_t count = 0;
  std::size_t first = 0;
  for (std::size_t i = now.pixels().size(); i-- > 0;) {
    if (now.pixels()[i] == then->pixels()[i]) continue;
    ++count;
    first = i;
  }
  if (count == 0) {
    std::printf("  the pixels kept are those of the replay: the log is at fault\n");
    return;
  }
  const auto width = static_cast<std::size_t>(now.width());
  std::printf("  %zu DN differ; the first at column %zu, row %zu: %d then, %d now\n", count,
              first % width, first / width, then->pixels()[first], now.pixels()[first]);
}

/// What the log has and has not, before anything runs.
void tell_log(const hil::Recording& log, const std::string& path, bool quiet) {
  if (!quiet)
    spdlog::info("{}: {}, {} frames, {} commands, by {}", path, log.start.scenario_file,
                 log.frames.size(), log.decisions.commands.size(), log.start.program);
  if (!log.fault.empty()) spdlog::warn("{}: {}; what follows is left out", path, log.fault);
  if (!log.end) {
    spdlog::warn("{}: no end: the run was cut short; it is replayed to frame {}", path,
                 log.decisions.due.empty() ? 0 : log.decisions.due.back().frame);
  } else if (log.end->log_lost + log.end->loop.records_lost > 0) {
    spdlog::warn("{}: {} records are missing: not all of the run is known", path,
                 log.end->log_lost + log.end->loop.records_lost);
  }
}

RecordFrames frames_named(const std::string& name) {
  if (name == "fits") return RecordFrames::kFits;
  if (name == "cube") return RecordFrames::kCube;
  return name == "raw" ? RecordFrames::kRaw : RecordFrames::kPng;
}

/// Runs the loop; nobody watches its records but to make room for more.
hil::LoopReport run_loop(hil::FrameLoop& loop) {
  const std::jthread observer([&loop](const std::stop_token& stop) {
    while (!stop.stop_requested()) {
      for (hil::FrameRecord r; loop.frames().pop(r);) {
      }
      for (hil::CommandRecord c; loop.commands().pop(c);) {
      }
      std::this_thread::sleep_for(kLook);
    }
  });
  return loop.run({});
}

int verdict(const hil::Recording& log, const Comparison& seen, const fs::path& folder) {
  // A frame in the log that no decision exposed was cut off with what decided it.
  std::uint64_t due = seen.compared();
  const std::uint64_t undecided = log.frames.size() - due;
  if (log.end) due = log.frames.size();
  std::printf("%llu of %llu frames equal\n", static_cast<unsigned long long>(seen.equal()),
              static_cast<unsigned long long>(due));
  if (seen.without() > 0)
    std::printf("%llu frames replayed that the log has no checksum of\n",
                static_cast<unsigned long long>(seen.without()));
  if (!log.end && undecided > 0)
    std::printf("%llu frames of the log not replayed: it ends before what decided them\n",
                static_cast<unsigned long long>(undecided));
  if (seen.first_other()) tell_difference(folder, *seen.first_other(), seen.other_pixels());
  return seen.equal() == due ? kGood : kCriterionFailed;
}

}  // namespace

int replay_log(const ReplayOptions& options) {
  std::error_code error;
  const bool is_folder = fs::is_directory(options.log, error);
  const fs::path path = is_folder ? fs::path(options.log) / "record.slog" : fs::path(options.log);
  const hil::Recording log = hil::load_recording(path.string());
  tell_log(log, path.string(), options.quiet);
  const Scenario scenario = scenario_of(log, path.string());
  Rig rig(scenario, options.threads);

  const hil::LoopSpec spec = replay_spec(log);
  std::unique_ptr<hil::FrameStore> store;
  std::unique_ptr<hil::FrameWriter> writer;
  if (!options.out.empty()) {
    fs::create_directories(options.out);
    store = make_store(options.out, scenario, frames_named(options.frames));
    writer = std::make_unique<hil::FrameWriter>(*store, spec.width_px, spec.height_px,
                                                hil::WhenBusy::kWait);
  }
  Comparison comparison(log, writer.get());
  hil::NoCommands commands;
  hil::ClosedLoopPointing pointing = make_pointing(scenario, rig, spec.start);
  run_up(scenario, rig, spec.start);
  hil::ManualClock clock(spec.start - spec.period);
  const auto loop = std::make_unique<hil::FrameLoop>(spec, clock, pointing, rig.generator(),
                                                     comparison, commands);
  static_cast<void>(run_loop(*loop));
  if (writer != nullptr) {
    writer->finish();
    if (!writer->failure().empty()) {
      spdlog::error("{} frames not written: {}", writer->failed(), writer->failure());
      return kDeviceFault;
    }
  }
  return verdict(log, comparison, path.parent_path());
}

}  // namespace starloop
