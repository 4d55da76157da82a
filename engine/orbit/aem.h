#pragma once

#include <vector>

#include <Eigen/Geometry>

#include "engine/orbit/file_segments.h"

namespace engine {

/// Rows of one body's attitude.
struct AemSegment {
  SegmentMeta meta;
  std::vector<Epoch> times;
  /// Body coordinates are q v q*, v those of J2000; each on the side of the one before, so that
  /// none jumps by a turn.
  std::vector<Eigen::Quaterniond> body_from_j2000;
};

/// An Attitude Ephemeris Message, CCSDS 504.0-B-1 and -2, in keyword = value notation; versions 1.0
/// and 2.0, ATTITUDE_TYPE QUATERNION. One of its two frames is EME2000, J2000, GCRF or ICRF, all
/// taken for J2000, the other is the body. The CCSDS' quaternion of a frame A to a frame B is the
/// conjugate of ours. Whatever INTERPOLATION_METHOD it wishes, between rows the body turns evenly.
/// Throws ConfigError: "file:line: what was expected, what was found".
[[nodiscard]] std::vector<AemSegment> read_aem(KvnLines lines);

/// The attitude at a time by the even turn between two rows (Shoemake 1985); before and after its
/// segment it is held. Pre: as read_aem() leaves them. Loop-safe.
[[nodiscard]] Eigen::Quaterniond attitude_at(const std::vector<AemSegment>& segments,
                                             Epoch t) noexcept;

}  // namespace engine
