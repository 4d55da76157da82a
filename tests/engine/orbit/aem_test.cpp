#include "engine/orbit/aem.h"

#include <array>
#include <cmath>
#include <cstdio>
#include <string>

#include <gtest/gtest.h>

#include "engine/core/constants.h"
#include "engine/core/contract.h"

namespace engine {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

/// A body that turns about its z axis by 6 deg a second, a row each 10 s; signs as they come.
std::string rows(bool scalar_first, bool alternating) {
  std::string text = "DATA_START\n";
  for (int i = 0; i <= 6; ++i) {
    const double half = 0.5 * 60.0 * kDegree * i;
    // By the CCSDS from J2000 to the body: the axes turn.
    const double sign = alternating && i % 2 == 1 ? -1.0 : 1.0;
    const double z = sign * std::sin(half);
    const double w = sign * std::cos(half);
    char line[120];
    std::snprintf(line, sizeof line, "2022-01-01T00:%02d:%02d ", i / 6, i % 6 * 10);
    text += line;
    if (scalar_first) {
      std::snprintf(line, sizeof line, "%.16f 0 0 %.16f\n", w, z);
    } else {
      std::snprintf(line, sizeof line, "0 0 %.16f %.16f\n", z, w);
    }
    text += line;
  }
  return text + "DATA_STOP\n";
}

const std::string kMeta =
    "META_START\nOBJECT_NAME = TARGET\nOBJECT_ID = 2022-001A\nCENTER_NAME = EARTH\n"
    "REF_FRAME_A = EME2000\nREF_FRAME_B = SC_BODY_1\nATTITUDE_DIR = A2B\nTIME_SYSTEM = UTC\n"
    "START_TIME = 2022-01-01T00:00:00\nSTOP_TIME = 2022-01-01T00:01:00\n"
    "ATTITUDE_TYPE = QUATERNION\nQUATERNION_TYPE = LAST\nINTERPOLATION_METHOD = HERMITE\n"
    "INTERPOLATION_DEGREE = 7\nMETA_STOP\n";
const std::string kGood =
    "CCSDS_AEM_VERS = 1.0\nCOMMENT by hand\nORIGINATOR = NOBODY\n" + kMeta + rows(false, false);

std::string changed(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

std::vector<AemSegment> parse(const std::string& text) {
  return read_aem(KvnLines::from_text(text, "x.aem"));
}

Epoch at(double t_s) { return epoch_from_utc("2022-01-01T00:00:00").value() + from_seconds(t_s); }

/// The body's x axis, in J2000.
Vector3d x_axis(const std::vector<AemSegment>& segments, double t_s) {
  return attitude_at(segments, at(t_s)).conjugate() * Vector3d::UnitX();
}
Vector3d turned(double t_s) {
  const double angle = 6.0 * kDegree * t_s;
  return {std::cos(angle), std::sin(angle), 0.0};
}

TEST(Aem, ABodyThatTurnsEvenlyIsWhereItWouldBe) {
  const std::vector<AemSegment> segments = parse(kGood);
  for (double t_s = 0.0; t_s <= 60.0; t_s += 0.7)
    EXPECT_LT((x_axis(segments, t_s) - turned(t_s)).norm(), 3e-14) << t_s;  // of six radians
}

TEST(Aem, ReadsBothOrdersBothDirectionsAndBothVersions) {
  const std::string first =
      changed(changed(kGood, "= LAST", "= FIRST"), rows(false, false), rows(true, false));
  EXPECT_LT((x_axis(parse(first), 13.0) - turned(13.0)).norm(), 1e-14);
  // From the body to J2000 the same numbers turn it the other way.
  const Vector3d back(turned(13.0).x(), -turned(13.0).y(), 0.0);
  EXPECT_LT((x_axis(parse(changed(kGood, "= A2B", "= B2A")), 13.0) - back).norm(), 1e-14);
  const std::string swapped =
      changed(changed(kGood, "_A = EME2000", "_A = SC_BODY_1"), "_B = SC_BODY_1", "_B = ICRF");
  EXPECT_LT((x_axis(parse(swapped), 13.0) - back).norm(), 1e-14);
  std::string second = changed(kGood, "VERS = 1.0", "VERS = 2.0");
  second = changed(changed(second, "ATTITUDE_DIR = A2B\n", ""), "QUATERNION_TYPE = LAST\n", "");
  EXPECT_LT((x_axis(parse(second), 13.0) - turned(13.0)).norm(), 1e-14);
}

TEST(Aem, SignsThatAlternateMakeNoTurnOfIt) {
  const std::vector<AemSegment> segments =
      parse(changed(kGood, rows(false, false), rows(false, true)));
  for (int i = 0; i < 599; ++i) {
    const Quaterniond step =
        attitude_at(segments, at(0.1 * (i + 1))) * attitude_at(segments, at(0.1 * i)).conjugate();
    ASSERT_NEAR(20.0 * std::atan2(step.vec().norm(), step.w()), 6.0 * kDegree, 1e-12) << i;
  }
}

TEST(Aem, IsHeldOutsideItsSegments) {
  const std::vector<AemSegment> segments = parse(kGood);
  EXPECT_EQ(x_axis(segments, -1e6), x_axis(segments, 0.0));
  EXPECT_EQ(x_axis(segments, 1e6), x_axis(segments, 60.0));
  EXPECT_FALSE(gap_in(segments, {at(0.0), at(60.0)}).has_value());
  EXPECT_TRUE(gap_in(segments, {at(0.0), at(60.1)}).has_value());
}

TEST(Aem, PointsAtTheLineOfEachDefect) {
  const std::vector<std::array<std::string, 3>> defects{
      {"CCSDS_AEM_VERS = 1.0", "CCSDS_AEM_VERS = 3.0", "x.aem:1: expected one of the versions"},
      {"_A = EME2000", "_A = TEME", "x.aem:8: expected one of the frames EME2000"},
      {"_B = SC_BODY_1", "_B = ITRF", "x.aem:9: expected REF_FRAME_B = SC_BODY_1"},
      {"= A2B", "= A2C", "x.aem:10: expected ATTITUDE_DIR = A2B or B2A"},
      {"= QUATERNION\n", "= EULER_ANGLE\n", "x.aem:14: expected ATTITUDE_TYPE = QUATERNION"},
      {"= LAST", "= MIDDLE", "x.aem:15: expected QUATERNION_TYPE = FIRST or LAST"},
      {"DATA_START\n", "", "x.aem:19: expected DATA_START"},
      {"DATA_STOP\n", "", "expected DATA_STOP, found the end of the file"},
      {"DATA_STOP\n", "DATA_STOP\nmore\n", "x.aem:28: expected META_START"},
      {"2022-01-01T00:00:10", "2022-01-01T00:00:00", "x.aem:21: expected a time after"},
      {"2022-01-01T00:00:10 0", "2022-01-01T00:00:10 3", "x.aem:21: expected a quaternion"},
      {"2022-01-01T00:00:10 0", "2022-01-01T00:00:10 nan", "x.aem:21: expected a finite number"},
      {"2022-01-01T00:00:10 0", "2022-01-01T00:00:10", "x.aem:21: expected a date and 4 numbers"},
  };
  for (const auto& [from, to, complaint] : defects) {
    try {
      static_cast<void>(parse(changed(kGood, from, to)));
      ADD_FAILURE() << "taken: " << to;
    } catch (const ConfigError& e) {
      EXPECT_NE(std::string(e.what()).find(complaint), std::string::npos) << e.what();
    }
  }
}

TEST(Aem, AFileCutOffAnywhereIsReadOrRefused) {
  for (std::size_t length = 0; length <= kGood.size(); ++length) {
    try {
      EXPECT_TRUE(attitude_at(parse(kGood.substr(0, length)), at(30.0)).coeffs().allFinite());
    } catch (const ConfigError&) {
      // As it should.
    }
  }
}

}  // namespace
}  // namespace engine
