#include "engine/orbit/oem.h"

#include <array>
#include <set>

#include "engine/core/contract.h"

namespace engine {
namespace {

const std::set<std::string_view> kKeys{"REF_FRAME", "REF_FRAME_EPOCH", "INTERPOLATION",
                                       "INTERPOLATION_DEGREE"};

Interpolation method(const KvnLines& lines, std::string_view name, OemSegment& segment) {
  if (name == "HERMITE") return Interpolation::kHermite;
  if (name == "LINEAR") segment.degree = 1;
  if (name == "LINEAR" || name == "LAGRANGE") return Interpolation::kLagrange;
  lines.fail("expected INTERPOLATION = HERMITE, LAGRANGE or LINEAR, found \"" + std::string(name) +
             "\"");
}

void take(const KvnLines& lines, const KvnLines::Entry& entry, OemSegment& segment) {
  const auto& [key, value] = entry;
  if (key == "REF_FRAME") lines.need_inertial(value);
  if (key == "INTERPOLATION") segment.interpolation = method(lines, value, segment);
  if (key == "INTERPOLATION_DEGREE") segment.degree = lines.whole_number(value, 1, kHighestDegree);
}

void skip_covariance(KvnLines& lines) {
  do lines.need("COVARIANCE_STOP");
  while (lines.line() != "COVARIANCE_STOP");
}

void read_row(const KvnLines& lines, OemSegment& segment) {
  const std::vector<std::string_view> words = lines.words();
  if (words.size() != 7 && words.size() != 10)
    lines.fail("expected a date and 6 or 9 numbers, found " + std::to_string(words.size()) +
               " words");
  const Epoch t = lines.epoch(words[0], segment.meta.scale);
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
bool read_rows(KvnLines& lines, OemSegment& segment) {
  while (lines.next()) {
    if (lines.line() == "META_START") return true;
    if (lines.line() == "COVARIANCE_START") {
      skip_covariance(lines);
    } else {
      read_row(lines, segment);
    }
  }
  return false;
}

}  // namespace

std::vector<OemSegment> read_oem(KvnLines lines) {
  static_cast<void>(read_header(lines, "CCSDS_OEM_VERS", {"1.0", "2.0", "3.0"}));
  std::vector<OemSegment> segments;
  bool more = true;
  while (more) {
    OemSegment segment;
    segment.meta = read_meta(lines, kKeys, {"CENTER_NAME", "REF_FRAME"},
                             [&](const KvnLines::Entry& entry) { take(lines, entry, segment); });
    more = read_rows(lines, segment);
    if (segment.times.size() < segment.window())
      throw ConfigError(
          segment.meta.where + ": expected at least " + std::to_string(segment.window()) +
          " rows in this segment for its degree of " + std::to_string(segment.degree) + ", found " +
          std::to_string(segment.times.size()));
    check_rows(segment.meta, segment.times,
               segments.empty() ? std::nullopt : std::optional(segments.back().meta.usable.end));
    segments.push_back(std::move(segment));
  }
  return segments;
}

}  // namespace engine
