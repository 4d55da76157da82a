#include "engine/orbit/oem.h"

#include <array>
#include <optional>
#include <set>

#include "engine/core/contract.h"

namespace engine {
namespace {

const std::set<std::string_view> kHeaderKeys{"CREATION_DATE", "ORIGINATOR", "MESSAGE_ID",
                                             "CLASSIFICATION"};
const std::set<std::string_view> kMetaKeys{
    "OBJECT_NAME",       "OBJECT_ID",   "CENTER_NAME",   "REF_FRAME",
    "REF_FRAME_EPOCH",   "TIME_SYSTEM", "START_TIME",    "USEABLE_START_TIME",
    "USEABLE_STOP_TIME", "STOP_TIME",   "INTERPOLATION", "INTERPOLATION_DEGREE"};

void read_header(KvnLines& lines) {
  lines.need("CCSDS_OEM_VERS = 2.0");
  const KvnLines::Entry first = lines.entry();
  if (first.key != "CCSDS_OEM_VERS")
    lines.fail("expected CCSDS_OEM_VERS = 2.0, found \"" + std::string(lines.line().substr(0, 60)) +
               "\"");
  if (first.value != "1.0" && first.value != "2.0" && first.value != "3.0")
    lines.fail("expected version 1.0, 2.0 or 3.0, found \"" + std::string(first.value) + "\"");
  while (true) {
    lines.need("META_START");
    if (lines.line() == "META_START") return;
    if (!kHeaderKeys.contains(lines.entry().key))
      lines.fail("expected META_START, found \"" + std::string(lines.line().substr(0, 60)) + "\"");
  }
}

/// Reads one segment's description; every value is checked on its own line.
class Meta {
 public:
  /// Pre: the line is META_START.
  Meta(KvnLines& lines, OemSegment& segment) {
    segment.where = lines.where();
    while (true) {
      lines.need("META_STOP");
      if (lines.line() == "META_STOP") break;
      const KvnLines::Entry entry = lines.entry();
      if (!kMetaKeys.contains(entry.key))
        lines.fail("expected META_STOP or a key of the metadata, found \"" +
                   std::string(lines.line().substr(0, 60)) + "\"");
      if (!seen_.insert(std::string(entry.key)).second)
        lines.fail(std::string(entry.key) + " stands here twice");
      take(lines, entry, segment);
    }
    for (const char* key :
         {"OBJECT_NAME", "CENTER_NAME", "REF_FRAME", "TIME_SYSTEM", "START_TIME", "STOP_TIME"})
      if (!seen_.contains(key)) lines.fail("expected " + std::string(key) + " before META_STOP");
    segment.usable = {usable_start_.value_or(start_), usable_stop_.value_or(stop_)};
    if (!(start_ <= segment.usable.begin && segment.usable.begin < segment.usable.end &&
          segment.usable.end <= stop_))
      lines.fail("expected START_TIME <= USEABLE_START_TIME < USEABLE_STOP_TIME <= STOP_TIME");
  }

  TimeScale scale = TimeScale::kUtc;

 private:
  void take(const KvnLines& lines, const KvnLines::Entry& entry, OemSegment& segment) {
    const auto& [key, value] = entry;
    if (key == "CENTER_NAME" && value != "EARTH")
      lines.fail("expected CENTER_NAME = EARTH, found \"" + std::string(value) + "\"");
    if (key == "REF_FRAME") lines.need_inertial(value);
    if (key == "TIME_SYSTEM") scale = lines.time_system(value);
    if (key.ends_with("_TIME") && !seen_.contains("TIME_SYSTEM"))
      lines.fail("expected TIME_SYSTEM before " + std::string(key));
    if (key == "START_TIME") start_ = lines.epoch(value, scale);
    if (key == "STOP_TIME") stop_ = lines.epoch(value, scale);
    if (key == "USEABLE_START_TIME") usable_start_ = lines.epoch(value, scale);
    if (key == "USEABLE_STOP_TIME") usable_stop_ = lines.epoch(value, scale);
    if (key == "INTERPOLATION") segment.interpolation = method(lines, value, segment);
    if (key == "INTERPOLATION_DEGREE")
      segment.degree = lines.whole_number(value, 1, kHighestDegree);
  }

  static Interpolation method(const KvnLines& lines, std::string_view name, OemSegment& segment) {
    if (name == "HERMITE") return Interpolation::kHermite;
    if (name == "LINEAR") segment.degree = 1;
    if (name == "LINEAR" || name == "LAGRANGE") return Interpolation::kLagrange;
    lines.fail("expected INTERPOLATION = HERMITE, LAGRANGE or LINEAR, found \"" +
               std::string(name) + "\"");
  }

  std::set<std::string> seen_;
  Epoch start_{};
  Epoch stop_{};
  std::optional<Epoch> usable_start_;
  std::optional<Epoch> usable_stop_;
};

void skip_covariance(KvnLines& lines) {
  do lines.need("COVARIANCE_STOP");
  while (lines.line() != "COVARIANCE_STOP");
}

void read_row(const KvnLines& lines, TimeScale scale, OemSegment& segment) {
  const std::vector<std::string_view> words = lines.words();
  if (words.size() != 7 && words.size() != 10)
    lines.fail("expected a date and 6 or 9 numbers, found " + std::to_string(words.size()) +
               " words");
  const Epoch t = lines.epoch(words[0], scale);
  if (!segment.times.empty() && t <= segment.times.back())
    lines.fail("expected a time after the row before, found " + std::string(words[0]));
  std::array<double, 9> values{};
  for (std::size_t i = 1; i < words.size(); ++i) values[i - 1] = lines.number(words[i]);
  OrbitState state;
  state.position.m = 1e3 * Eigen::Vector3d(values[0], values[1], values[2]);
  state.velocity.m_s = 1e3 * Eigen::Vector3d(values[3], values[4], values[5]);
  constexpr double kFarthest_m = 1e10;
  constexpr double kFastest_m_s = 1e6;
  if (state.position.m.norm() > kFarthest_m || state.velocity.m_s.norm() > kFastest_m_s)
    lines.fail("expected a place within 1e7 km and less than 1000 km/s");
  segment.times.push_back(t);
  segment.states.push_back(state);
}

/// Reads the rows of a segment. True: another segment follows, and the line is its META_START.
bool read_rows(KvnLines& lines, TimeScale scale, OemSegment& segment) {
  while (lines.next()) {
    if (lines.line() == "META_START") return true;
    if (lines.line() == "COVARIANCE_START") {
      skip_covariance(lines);
    } else {
      read_row(lines, scale, segment);
    }
  }
  return false;
}

void check(const KvnLines& lines, const OemSegment& segment, const OemSegment* before) {
  const auto fail = [&](const std::string& complaint) {
    throw ConfigError(segment.where + ": " + complaint);
  };
  if (segment.times.size() < segment.window())
    fail("expected at least " + std::to_string(segment.window()) +
         " rows in this segment for its degree of " + std::to_string(segment.degree) + ", found " +
         std::to_string(segment.times.size()));
  if (segment.usable.begin < segment.times.front() || segment.usable.end > segment.times.back())
    fail("expected rows from " + utc_text(segment.usable.begin) + " to " +
         utc_text(segment.usable.end) + " UTC, found them from " + utc_text(segment.times.front()) +
         " to " + utc_text(segment.times.back()));
  if (before != nullptr && segment.usable.begin < before->usable.end)
    fail("expected a segment that is used after the one before it, which " + lines.name() +
         " uses until " + utc_text(before->usable.end) + " UTC");
}

}  // namespace

std::vector<OemSegment> read_oem(KvnLines lines) {
  read_header(lines);
  std::vector<OemSegment> segments;
  bool more = true;
  while (more) {
    OemSegment segment;
    const Meta meta(lines, segment);
    more = read_rows(lines, meta.scale, segment);
    check(lines, segment, segments.empty() ? nullptr : &segments.back());
    segments.push_back(std::move(segment));
  }
  return segments;
}

}  // namespace engine
