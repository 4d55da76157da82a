#include "engine/orbit/aem.h"

#include <array>
#include <cmath>

#include "engine/core/contract.h"

namespace engine {
namespace {

using Eigen::Quaterniond;

const std::set<std::string_view> kKeys{
    "REF_FRAME_A",     "REF_FRAME_B",          "ATTITUDE_DIR",        "ATTITUDE_TYPE",
    "QUATERNION_TYPE", "INTERPOLATION_METHOD", "INTERPOLATION_DEGREE"};

/// How a segment's rows are to be read.
struct Order {
  bool a_is_inertial = true;
  bool a_to_b = true;
  bool scalar_first = false;

  [[nodiscard]] Quaterniond body_from_j2000(const std::array<double, 4>& q) const noexcept {
    const Quaterniond given =
        scalar_first ? Quaterniond(q[0], q[1], q[2], q[3]) : Quaterniond(q[3], q[0], q[1], q[2]);
    return (a_is_inertial == a_to_b ? given.conjugate() : given).normalized();
  }
};

bool is_of_a_body(std::string_view frame) {
  return frame.starts_with("SC_BODY") || frame.starts_with("SC BODY") ||
         frame.starts_with("SPACECRAFT");
}

void take(const KvnLines& lines, const KvnLines::Entry& entry, Order& order) {
  const std::string_view key = entry.key;
  const std::string_view value = entry.value;
  const auto fail = [&](const std::string& expected) {
    lines.fail("expected " + expected + ", found \"" + std::string(value.substr(0, 60)) + "\"");
  };
  if (key == "REF_FRAME_A") order.a_is_inertial = !is_of_a_body(value);
  if ((key == "REF_FRAME_A" && order.a_is_inertial) ||
      (key == "REF_FRAME_B" && !order.a_is_inertial))
    lines.need_inertial(value);
  if (key == "REF_FRAME_B" && order.a_is_inertial && !is_of_a_body(value))
    fail("REF_FRAME_B = SC_BODY_1, or another of the body's");
  if (key == "ATTITUDE_DIR") {
    if (value != "A2B" && value != "B2A") fail("ATTITUDE_DIR = A2B or B2A");
    order.a_to_b = value == "A2B";
  }
  if (key == "ATTITUDE_TYPE" && value != "QUATERNION") fail("ATTITUDE_TYPE = QUATERNION");
  if (key == "QUATERNION_TYPE") {
    if (value != "FIRST" && value != "LAST") fail("QUATERNION_TYPE = FIRST or LAST");
    order.scalar_first = value == "FIRST";
  }
}

void read_row(const KvnLines& lines, const Order& order, AemSegment& segment) {
  const std::vector<std::string_view> words = lines.words();
  if (words.size() != 5)
    lines.fail("expected a date and 4 numbers, found " + std::to_string(words.size()) + " words");
  const Epoch t = lines.epoch(words[0], segment.meta.scale);
  if (!segment.times.empty() && t <= segment.times.back())
    lines.fail("expected a time after the row before, found " + std::string(words[0]));
  std::array<double, 4> q{};
  for (std::size_t i = 0; i < 4; ++i) q[i] = lines.number(words[i + 1]);
  const double length = std::hypot(std::hypot(q[0], q[1]), std::hypot(q[2], q[3]));
  if (!(std::abs(length - 1.0) < 1e-3))
    lines.fail("expected a quaternion of length 1, found " + std::to_string(length));
  Quaterniond turn = order.body_from_j2000(q);
  if (!segment.times.empty() && turn.dot(segment.body_from_j2000.back()) < 0.0)
    turn.coeffs() = -turn.coeffs();
  segment.times.push_back(t);
  segment.body_from_j2000.push_back(turn);
}

/// Reads from DATA_START to DATA_STOP. True: another segment follows, and the line is its
/// META_START.
bool read_rows(KvnLines& lines, const Order& order, AemSegment& segment) {
  lines.need("DATA_START");
  if (lines.line() != "DATA_START")
    lines.fail("expected DATA_START, found \"" + std::string(lines.line().substr(0, 60)) + "\"");
  while (true) {
    lines.need("DATA_STOP");
    if (lines.line() == "DATA_STOP") break;
    read_row(lines, order, segment);
  }
  if (!lines.next()) return false;
  if (lines.line() != "META_START")
    lines.fail("expected META_START, found \"" + std::string(lines.line().substr(0, 60)) + "\"");
  return true;
}

}  // namespace

std::vector<AemSegment> read_aem(KvnLines lines) {
  static_cast<void>(read_header(lines, "CCSDS_AEM_VERS", {"1.0", "2.0"}));
  std::vector<AemSegment> segments;
  bool more = true;
  while (more) {
    AemSegment segment;
    Order order;
    segment.meta = read_meta(lines, kKeys, {"REF_FRAME_A", "REF_FRAME_B", "ATTITUDE_TYPE"},
                             [&](const KvnLines::Entry& entry) { take(lines, entry, order); });
    more = read_rows(lines, order, segment);
    if (segment.times.size() < 2)
      throw ConfigError(segment.meta.where + ": expected at least 2 rows in this segment, found " +
                        std::to_string(segment.times.size()));
    check_rows(segment.meta, segment.times,
               segments.empty() ? std::nullopt : std::optional(segments.back().meta.usable.end));
    segments.push_back(std::move(segment));
  }
  return segments;
}

Quaterniond attitude_at(const std::vector<AemSegment>& segments, Epoch t) noexcept {
  const AemSegment& segment = segment_at(segments, t);
  t = std::clamp(t, segment.meta.usable.begin, segment.meta.usable.end);
  const std::size_t row = std::min(row_before(segment.times, t), segment.times.size() - 2);
  const double share =
      seconds(t - segment.times[row]) / seconds(segment.times[row + 1] - segment.times[row]);
  return segment.body_from_j2000[row].slerp(share, segment.body_from_j2000[row + 1]);
}

}  // namespace engine
