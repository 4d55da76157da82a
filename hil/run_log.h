#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "hil/decisions.h"
#include "hil/frame_loop.h"
#include "hil/raw_log.h"

namespace hil {

/// The log of a run, record.slog: what it was, and everything in it that a clock, a link or
/// somebody outside decided, so that it can be run again to the same bits. Little-endian payloads
/// of raw_log.h:
///   start     first: format, program, scenario with its overrides, seed, threads, LoopSpec
///   frame     one for each exposed frame: number, times, size, CRC-32C of its pixels; in
///             frames.slog the pixels follow
///   command   each that was obeyed: from which frame on, sender, its packet (space_packet.h), and
///             in full what the packet rounds
///   decision  what became of each frame that the loop came to; it stands after all commands up to
///             that frame, after how many passes a clock stopped rendering it, and what it
///             left out because the frames before took too long. Its kind leaves room for what else
///             a clock may decide
///   end       last: the loop's counts. A run that was killed has none
enum class LogType : std::uint32_t {
  kStart = 1,
  kFrame = 2,
  kCommand = 3,
  kDecision = 4,
  kEnd = 5
};

struct LogStart {
  std::string program;                 ///< its name and version
  std::string scenario_file;           ///< for complaints: it is not opened again
  std::string scenario;                ///< the text
  std::vector<std::string> overrides;  ///< table.key=value, in order
  std::uint64_t seed = 0;
  std::uint32_t threads = 0;
  LoopSpec loop;  ///< start, period, frames, exposure, lead, size
};

struct LogFrame {
  std::uint64_t sequence = 0;
  engine::SimTime shutter_open{};
  engine::Duration exposure{};
  std::int32_t width_px = 0;
  std::int32_t height_px = 0;
  std::int32_t bits = 0;
  std::uint32_t flags = 0;  ///< kPixelsFollow
  std::uint32_t pixels_crc32c = 0;

  static constexpr std::uint32_t kPixelsFollow = 1;
};

struct LogDecision {
  /// Only kExposedInPasses has `passes`, after all the rest, and only kExposedInHaste `passes` and
  /// `shed`. A program that does not know a kind
  /// reads a log no further, instead of making other pixels of it.
  enum class Kind : std::uint32_t {
    kExposed = 1,
    kDropped = 2,
    kExposedInPasses = 3,
    kExposedInHaste = 4
  };
  Kind kind = Kind::kExposed;
  std::uint64_t frame = 0;
  engine::SimTime shutter_open{};
  engine::Duration late{};  ///< for the record: it decides nothing
  std::uint64_t skipped_before = 0;
  std::int32_t passes = 0;  ///< above 0: after how many rendering was stopped
  engine::Shed shed = engine::Shed::kNothing;
};

struct LogEnd {
  LoopReport loop;
  std::uint64_t log_lost = 0;  ///< records that did not reach this log
};

using LogBytes = std::vector<std::byte>;
/// The payloads. They overwrite `out`, which keeps its memory.
void encode(const LogStart& start, LogBytes& out);
void encode(const LogFrame& frame, LogBytes& out);
void encode(const CommandRecord& command, LogBytes& out);
void encode(const LogDecision& decision, LogBytes& out);
void encode(const LogEnd& end, LogBytes& out);
[[nodiscard]] LogFrame log_frame(const Frame& frame) noexcept;

/// A log as far as it could be read.
struct Recording {
  LogStart start;
  std::vector<LogFrame> frames;
  Decisions decisions;
  std::optional<LogEnd> end;  ///< none: the run was cut short
  std::uint64_t records = 0;
  std::uint64_t bytes = 0;  ///< that were read and checked
  std::string fault;        ///< what is wrong with the bytes after these; empty: nothing
};
/// Throws engine::ConfigError for what is no log of a run, or one of another format. What comes
/// after the first record that is torn, corrupt or makes no sense is left alone.
[[nodiscard]] Recording load_recording(const std::string& path);

/// The pixels that frames.slog has of a frame; nothing when it has not, or not whole.
[[nodiscard]] std::optional<engine::DnImage> recorded_pixels(const std::string& path,
                                                             std::uint64_t sequence);

}  // namespace hil
