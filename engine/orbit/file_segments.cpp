#include "engine/orbit/file_segments.h"

#include "engine/core/contract.h"

namespace engine {
namespace {

const std::set<std::string_view> kHeaderKeys{"CREATION_DATE", "ORIGINATOR", "MESSAGE_ID",
                                             "CLASSIFICATION"};
const std::set<std::string_view> kMetaKeys{"OBJECT_NAME",       "OBJECT_ID",  "CENTER_NAME",
                                           "TIME_SYSTEM",       "START_TIME", "USEABLE_START_TIME",
                                           "USEABLE_STOP_TIME", "STOP_TIME"};

std::string found(std::string_view text) {
  return ", found \"" + std::string(text.substr(0, 60)) + "\"";
}

/// The dates of a segment, each checked on its own line.
struct Dates {
  std::optional<Epoch> start;
  std::optional<Epoch> stop;
  std::optional<Epoch> usable_start;
  std::optional<Epoch> usable_stop;

  void take(const KvnLines& lines, const KvnLines::Entry& entry, TimeScale scale) {
    const auto& [key, value] = entry;
    if (key == "START_TIME") start = lines.epoch(value, scale);
    if (key == "STOP_TIME") stop = lines.epoch(value, scale);
    if (key == "USEABLE_START_TIME") usable_start = lines.epoch(value, scale);
    if (key == "USEABLE_STOP_TIME") usable_stop = lines.epoch(value, scale);
  }
};

}  // namespace

std::string read_header(KvnLines& lines, const std::string& version_key,
                        const std::vector<std::string_view>& versions) {
  lines.need(version_key + " = " + std::string(versions.back()));
  const KvnLines::Entry first = lines.entry();
  if (first.key != version_key) lines.fail("expected " + version_key + found(lines.line()));
  std::string known;
  for (const std::string_view v : versions) known += (known.empty() ? "" : ", ") + std::string(v);
  if (std::find(versions.begin(), versions.end(), first.value) == versions.end())
    lines.fail("expected one of the versions " + known + found(first.value));
  std::string version(first.value);
  while (true) {
    lines.need("META_START");
    if (lines.line() == "META_START") return version;
    if (!kHeaderKeys.contains(lines.entry().key))
      lines.fail("expected META_START" + found(lines.line()));
  }
}

SegmentMeta read_meta(KvnLines& lines, const std::set<std::string_view>& keys,
                      const std::vector<std::string_view>& needed,
                      const std::function<void(const KvnLines::Entry&)>& take) {
  SegmentMeta meta;
  meta.where = lines.where();
  Dates dates;
  std::set<std::string, std::less<>> seen;
  while (true) {
    lines.need("META_STOP");
    if (lines.line() == "META_STOP") break;
    const KvnLines::Entry entry = lines.entry();
    if (!kMetaKeys.contains(entry.key) && !keys.contains(entry.key))
      lines.fail("expected META_STOP or a key of the metadata" + found(lines.line()));
    if (!seen.insert(std::string(entry.key)).second)
      lines.fail(std::string(entry.key) + " stands here twice");
    if (entry.key.ends_with("_TIME") && !seen.contains("TIME_SYSTEM"))
      lines.fail("expected TIME_SYSTEM before " + std::string(entry.key));
    if (entry.key == "CENTER_NAME" && entry.value != "EARTH")
      lines.fail("expected CENTER_NAME = EARTH" + found(entry.value));
    if (entry.key == "TIME_SYSTEM") meta.scale = lines.time_system(entry.value);
    dates.take(lines, entry, meta.scale);
    if (keys.contains(entry.key)) take(entry);
  }
  for (const std::string_view key : needed)
    if (!seen.contains(key)) lines.fail("expected " + std::string(key) + " before META_STOP");
  for (const char* key : {"OBJECT_NAME", "TIME_SYSTEM", "START_TIME", "STOP_TIME"})
    if (!seen.contains(key)) lines.fail("expected " + std::string(key) + " before META_STOP");
  meta.usable = {dates.usable_start.value_or(*dates.start),
                 dates.usable_stop.value_or(*dates.stop)};
  if (!(*dates.start <= meta.usable.begin && meta.usable.begin < meta.usable.end &&
        meta.usable.end <= *dates.stop))
    lines.fail("expected START_TIME <= USEABLE_START_TIME < USEABLE_STOP_TIME <= STOP_TIME");
  return meta;
}

void check_rows(const SegmentMeta& meta, const std::vector<Epoch>& times,
                const std::optional<Epoch>& before) {
  const EpochSpan& usable = meta.usable;
  if (usable.begin < times.front() || usable.end > times.back())
    throw ConfigError(meta.where + ": expected rows from " + utc_text(usable.begin) + " to " +
                      utc_text(usable.end) + " UTC, found them from " + utc_text(times.front()) +
                      " to " + utc_text(times.back()));
  if (before && usable.begin < *before)
    throw ConfigError(meta.where +
                      ": expected a segment that is used after the one before it, "
                      "which is used until " +
                      utc_text(*before) + " UTC");
}

void fail_for_gap(const std::string& where, const EpochSpan& wanted, const EpochSpan& gap) {
  throw ConfigError(where + " must have the body from " + utc_text(wanted.begin) + " to " +
                    utc_text(wanted.end) + " UTC, has nothing from " + utc_text(gap.begin) +
                    " to " + utc_text(gap.end));
}

}  // namespace engine
