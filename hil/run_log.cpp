#include "hil/run_log.h"

#include <bit>
#include <cmath>
#include <cstring>
#include <type_traits>

#include "engine/core/crc32c.h"
#include "hil/space_packet.h"

namespace hil {
namespace {

using engine::ConfigError;
using engine::Duration;
using engine::SimTime;

static_assert(std::endian::native == std::endian::little);

constexpr std::uint32_t kFormat = 1;

/// Numbers and texts, one after the other.
class Writer {
 public:
  explicit Writer(LogBytes& out) : out_(out) { out_.clear(); }

  template <class T>
  Writer& put(const T& value) {
    static_assert(std::is_arithmetic_v<T> || std::is_enum_v<T>);
    const auto bytes = std::as_bytes(std::span(&value, 1));
    return put(bytes);
  }
  Writer& put(std::span<const std::byte> bytes) {
    const std::size_t at = out_.size();
    out_.resize(at + bytes.size());
    if (!bytes.empty()) std::memcpy(out_.data() + at, bytes.data(), bytes.size());
    return *this;
  }
  Writer& put(Duration d) { return put(d.count()); }
  Writer& put(SimTime t) { return put(t.time_since_epoch()); }
  Writer& put(const std::string& text) {
    put(static_cast<std::uint32_t>(text.size()));
    return put(std::as_bytes(std::span(text.data(), text.size())));
  }

 private:
  LogBytes& out_;
};

/// The same back. After the first thing that is not there all is zero, and done() says so.
class Reader {
 public:
  explicit Reader(std::span<const std::byte> in) : left_(in) {}

  Reader& get(std::span<std::byte> out) {
    if (out.empty()) return *this;
    if (out.size() > left_.size()) {
      short_ = true;
      left_ = {};
      std::memset(out.data(), 0, out.size());
    } else {
      std::memcpy(out.data(), left_.data(), out.size());
      left_ = left_.subspan(out.size());
    }
    return *this;
  }
  template <class T>
  Reader& get(T& value) {
    static_assert(std::is_arithmetic_v<T> || std::is_enum_v<T>);
    return get(std::as_writable_bytes(std::span(&value, 1)));
  }
  Reader& get(Duration& d) {
    std::int64_t count = 0;
    get(count);
    d = Duration(count);
    return *this;
  }
  Reader& get(SimTime& t) {
    Duration since{};
    get(since);
    t = SimTime(since);
    return *this;
  }
  Reader& get(std::string& text) {
    std::uint32_t size = 0;
    get(size);
    if (size > left_.size()) {
      short_ = true;
      left_ = {};
      return *this;
    }
    text.resize(size);
    return get(std::as_writable_bytes(std::span(text.data(), text.size())));
  }
  Reader& get(bool& flag) {
    std::uint8_t byte = 0;
    get(byte);
    flag = byte != 0;
    return *this;
  }
  [[nodiscard]] std::span<const std::byte> rest() noexcept { return std::exchange(left_, {}); }
  [[nodiscard]] bool whole() const noexcept { return !short_; }
  /// Everything was there, and nothing is left.
  [[nodiscard]] bool done() const noexcept { return !short_ && left_.empty(); }

 private:
  std::span<const std::byte> left_;
  bool short_ = false;
};

bool decode(std::span<const std::byte> in, LogStart& start) {
  std::uint32_t format = 0;
  Reader r(in);
  r.get(format);
  if (format != kFormat) return false;
  std::uint32_t overrides = 0;
  r.get(start.program).get(start.scenario_file).get(start.scenario).get(overrides);
  for (std::uint32_t i = 0; i < overrides && r.whole(); ++i) r.get(start.overrides.emplace_back());
  LoopSpec& l = start.loop;
  r.get(start.seed).get(start.threads).get(l.start).get(l.period).get(l.frames);
  r.get(l.exposure).get(l.command_lead).get(l.width_px).get(l.height_px).get(l.bits);
  // What a loop asks of its spec; and no shutter opens beyond the end of the time line.
  const Duration none{};
  return r.done() && l.period > none && l.exposure > none && l.command_lead >= none &&
         l.exposure <= l.period && l.command_lead <= l.period - l.exposure &&
         l.start.time_since_epoch() >= none && l.width_px > 0 && l.height_px > 0 &&
         l.frames < static_cast<std::uint64_t>((SimTime::max() - l.start) / l.period);
}

void get_frame(Reader& r, LogFrame& f) {
  r.get(f.sequence).get(f.shutter_open).get(f.exposure).get(f.width_px).get(f.height_px);
  r.get(f.bits).get(f.flags).get(f.pixels_crc32c);
}

bool decode(std::span<const std::byte> in, CommandRecord& record) {
  Reader r(in);
  std::uint32_t sender = 0;
  Duration time_to_live{};
  engine::PixelPoint centroid_px;
  Quaternion q{};
  r.get(record.frame).get(sender).get(time_to_live).get(centroid_px.u).get(centroid_px.v);
  for (double& x : q) r.get(x);
  const auto command = decode_command(r.rest());
  if (!r.done() || !command.ok()) return false;
  record.command = command.value();
  record.command.sender = sender;
  record.command.time_to_live = time_to_live;
  record.command.detection.centroid_px = centroid_px;
  if (record.command.kind == CommandKind::kAttitude) record.command.attitude.j2000_to_camera = q;
  return true;
}

bool decode(std::span<const std::byte> in, LogDecision& d) {
  Reader r(in);
  r.get(d.kind).get(d.frame).get(d.shutter_open).get(d.late).get(d.skipped_before);
  using Kind = LogDecision::Kind;
  const bool in_haste = d.kind == Kind::kExposedInHaste;
  const bool in_passes = d.kind == Kind::kExposedInPasses;
  if (in_passes || in_haste) r.get(d.passes);
  if (in_haste) r.get(d.shed);
  if (!r.done()) return false;
  if (in_haste)
    return d.passes >= 0 && d.shed > engine::Shed::kNothing &&
           static_cast<int>(d.shed) < engine::kSheds;
  if (in_passes != (d.passes > 0)) return false;
  return in_passes || d.kind == Kind::kExposed || d.kind == Kind::kDropped;
}

bool decode(std::span<const std::byte> in, LogEnd& end) {
  Reader r(in);
  LoopReport& l = end.loop;
  r.get(l.due).get(l.sent).get(l.skipped).get(l.dropped).get(l.faults).get(l.late);
  r.get(l.commands).get(l.command_faults).get(l.commands_lost).get(l.records_lost);
  r.get(l.answer_missing).get(end.log_lost);
  return r.done();
}

/// Adds a record that is not the first; what is wrong with it, or null.
const char* add(const RawRecord& record, Recording& out) {
  constexpr const char* kNonsense = "a record that makes no sense";
  if (out.end) return "a record after the end";
  switch (static_cast<LogType>(record.type)) {
    case LogType::kFrame: {
      LogFrame frame;
      Reader r(record.payload);
      get_frame(r, frame);
      if (!r.done() || frame.sequence >= out.start.loop.frames) return kNonsense;
      out.frames.push_back(frame);
      return nullptr;
    }
    case LogType::kCommand: {
      CommandRecord command;
      if (!decode(record.payload, command)) return kNonsense;
      auto& all = out.decisions.commands;
      if (!all.empty() && command.frame < all.back().frame) return kNonsense;
      all.push_back(command);
      return nullptr;
    }
    case LogType::kDecision: {
      LogDecision d;
      if (!decode(record.payload, d)) return kNonsense;
      auto& due = out.decisions.due;
      if (d.frame >= out.start.loop.frames || (!due.empty() && d.frame <= due.back().frame))
        return kNonsense;
      due.push_back({d.frame, d.kind != LogDecision::Kind::kDropped, d.passes, d.shed});
      return nullptr;
    }
    case LogType::kEnd: {
      LogEnd end;
      if (!decode(record.payload, end) || end.loop.due > out.start.loop.frames) return kNonsense;
      out.end = end;
      return nullptr;
    }
    case LogType::kStart:
      break;
  }
  return "a record of an unknown type";
}

}  // namespace

void encode(const LogStart& start, LogBytes& out) {
  const LoopSpec& l = start.loop;
  Writer w(out);
  w.put(kFormat).put(start.program).put(start.scenario_file).put(start.scenario);
  w.put(static_cast<std::uint32_t>(start.overrides.size()));
  for (const std::string& text : start.overrides) w.put(text);
  w.put(start.seed).put(start.threads).put(l.start).put(l.period).put(l.frames);
  w.put(l.exposure).put(l.command_lead).put(l.width_px).put(l.height_px).put(l.bits);
}

void encode(const LogFrame& f, LogBytes& out) {
  Writer w(out);
  w.put(f.sequence).put(f.shutter_open).put(f.exposure).put(f.width_px).put(f.height_px);
  w.put(f.bits).put(f.flags).put(f.pixels_crc32c);
}

void encode(const CommandRecord& record, LogBytes& out) {
  const Command& c = record.command;
  Writer w(out);
  w.put(record.frame).put(c.sender).put(c.time_to_live);
  w.put(c.detection.centroid_px.u).put(c.detection.centroid_px.v);
  for (const double x : c.attitude.j2000_to_camera) w.put(x);
  w.put(encode_command(c).bytes());
}

void encode(const LogDecision& d, LogBytes& out) {
  Writer w(out);
  w.put(d.kind).put(d.frame).put(d.shutter_open).put(d.late).put(d.skipped_before);
  const bool in_haste = d.kind == LogDecision::Kind::kExposedInHaste;
  if (in_haste || d.kind == LogDecision::Kind::kExposedInPasses) w.put(d.passes);
  if (in_haste) w.put(d.shed);
}

void encode(const LogEnd& end, LogBytes& out) {
  const LoopReport& l = end.loop;
  Writer w(out);
  w.put(l.due).put(l.sent).put(l.skipped).put(l.dropped).put(l.faults).put(l.late);
  w.put(l.commands).put(l.command_faults).put(l.commands_lost).put(l.records_lost);
  w.put(static_cast<std::uint8_t>(l.answer_missing ? 1 : 0)).put(end.log_lost);
}

LogFrame log_frame(const Frame& frame) noexcept {
  return {.sequence = frame.sequence,
          .shutter_open = frame.shutter_open,
          .exposure = frame.exposure,
          .width_px = frame.pixels->width(),
          .height_px = frame.pixels->height(),
          .bits = frame.bits,
          .flags = 0,
          .pixels_crc32c = engine::crc32c(std::as_bytes(frame.pixels->pixels()))};
}

Recording load_recording(const std::string& path) {
  RawLogReader reader(path);
  Recording out;
  RawRecord record;
  if (!reader.next(record)) {
    throw ConfigError(path + ": expected the log of a run, found " +
                      (reader.fault() != nullptr ? reader.fault() : "nothing in it"));
  }
  if (static_cast<LogType>(record.type) != LogType::kStart || !decode(record.payload, out.start))
    throw ConfigError(path + ": expected the log of a run, found one of another format");
  const char* fault = nullptr;
  do {
    out.bytes = reader.offset();
    out.records = reader.records();
    if (!reader.next(record)) {
      fault = reader.fault();
      break;
    }
    fault = add(record, out);
  } while (fault == nullptr);
  if (fault != nullptr) out.fault = std::string(fault) + " at byte " + std::to_string(out.bytes);
  return out;
}

std::optional<engine::DnImage> recorded_pixels(const std::string& path, std::uint64_t sequence) {
  constexpr int kLargestSide_px = 8192;
  RawLogReader reader(path);
  for (RawRecord record; reader.next(record);) {
    if (static_cast<LogType>(record.type) != LogType::kFrame) continue;
    LogFrame f;
    Reader r(record.payload);
    get_frame(r, f);
    if (f.sequence != sequence || (f.flags & LogFrame::kPixelsFollow) == 0) continue;
    const auto pixels = r.rest();
    if (f.width_px < 1 || f.height_px < 1 || f.width_px > kLargestSide_px ||
        f.height_px > kLargestSide_px ||
        pixels.size() !=
            2 * static_cast<std::size_t>(f.width_px) * static_cast<std::size_t>(f.height_px) ||
        engine::crc32c(pixels) != f.pixels_crc32c)
      return std::nullopt;
    engine::DnImage image(f.width_px, f.height_px);
    std::memcpy(image.pixels().data(), pixels.data(), pixels.size());
    return image;
  }
  return std::nullopt;
}

}  // namespace hil
