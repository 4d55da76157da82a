#include "engine/orbit/oem.h"

#include <string>

#include <gtest/gtest.h>

#include "engine/core/contract.h"
#include "engine/orbit/ephemeris.h"

namespace engine {
namespace {

/// As GMAT and STK write them: comments, blanks, CR LF, accelerations, a covariance.
const std::string kGood =
    "CCSDS_OEM_VERS = 2.0\r\n"
    "COMMENT by hand\r\n"
    "CREATION_DATE = 2022-01-01T00:00:00\r\n"
    "ORIGINATOR = NOBODY\r\n"
    "\r\n"
    "META_START\r\n"
    "COMMENT one segment\r\n"
    "OBJECT_NAME          = TARGET\r\n"
    "OBJECT_ID            = 2022-001A\r\n"
    "CENTER_NAME          = EARTH\r\n"
    "REF_FRAME            = EME2000\r\n"
    "TIME_SYSTEM          = UTC\r\n"
    "START_TIME           = 2022-01-01T00:00:00.000\r\n"
    "USEABLE_START_TIME   = 2022-01-01T00:00:10.000\r\n"
    "USEABLE_STOP_TIME    = 2022-001T00:02:50\r\n"
    "STOP_TIME            = 2022-01-01T00:03:00.000Z\r\n"
    "INTERPOLATION        = LAGRANGE\r\n"
    "INTERPOLATION_DEGREE = 2\r\n"
    "META_STOP\r\n"
    "COMMENT rows\r\n"
    "2022-01-01T00:00:00.000   7000.0 +1.0 0.0  -1.0e-3 7.5 0.0\r\n"
    "2022-01-01T00:01:00.000\t7000.0 450.0 0.0  -0.1 7.5 0.0  -8e-3 0 0\r\n"
    "2022-001T00:02:00   6990.0 900.0 0.0  -0.2 7.4 0.0\r\n"
    "2022-01-01T00:03:00   6980.0 1350.0 0.0  -0.3 7.3 0.0\r\n"
    "\r\n"
    "COVARIANCE_START\r\n"
    "EPOCH = 2022-01-01T00:00:00\r\n"
    "1e-3\r\n"
    "COVARIANCE_STOP\r\n";

std::string changed(const std::string& from, const std::string& to) {
  std::string text = kGood;
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

std::vector<OemSegment> parse(const std::string& text) {
  return read_oem(KvnLines::from_text(text, "x.oem"));
}

TEST(Oem, ReadsWhatOtherToolsWrite) {
  const std::vector<OemSegment> segments = parse(kGood);
  ASSERT_EQ(segments.size(), 1U);
  const OemSegment& s = segments[0];
  EXPECT_EQ(s.meta.where, "x.oem:6");
  EXPECT_EQ(s.interpolation, Interpolation::kLagrange);
  EXPECT_EQ(s.degree, 2);
  ASSERT_EQ(s.times.size(), 4U);
  EXPECT_EQ(s.times[2], epoch_from_utc("2022-01-01T00:02:00").value());
  EXPECT_EQ(s.meta.usable.begin, epoch_from_utc("2022-01-01T00:00:10").value());
  EXPECT_EQ(s.meta.usable.end, epoch_from_utc("2022-01-01T00:02:50").value());
  EXPECT_DOUBLE_EQ(s.states[0].position.m.y(), 1000.0);
  EXPECT_DOUBLE_EQ(s.states[0].velocity.m_s.x(), -1.0);
  EXPECT_DOUBLE_EQ(s.states[1].position.m.y(), 450e3);
}

TEST(Oem, JoinsAsHermiteOfDegree7UnlessItSaysOtherwise) {
  std::string text = changed("INTERPOLATION        = LAGRANGE\r\n", "");
  text.replace(text.find("INTERPOLATION_DEGREE"), 26, "");
  const std::vector<OemSegment> segments = parse(text);
  EXPECT_EQ(segments[0].interpolation, Interpolation::kHermite);
  EXPECT_EQ(segments[0].window(), 4U);
}

TEST(Oem, CountsTimeInItsOwnScale) {
  const auto first = [](const std::string& scale) {
    std::string text = changed("STOP_TIME            = 2022-01-01T00:03:00.000Z",
                               "STOP_TIME            = 2022-01-01T00:03:00.000");
    text.replace(text.find("= UTC"), 5, "= " + scale);
    return parse(text)[0].times[0];
  };
  EXPECT_EQ(first("UTC") - first("TAI"), std::chrono::seconds(37));
  EXPECT_EQ(first("TAI") - first("TT"), std::chrono::milliseconds(32184));
  EXPECT_EQ(first("GPS") - first("TAI"), std::chrono::seconds(19));
}

TEST(Oem, PointsAtTheLineOfEachDefect) {
  struct Defect {
    const char* from;
    const char* to;
    const char* complaint;
  };
  const Defect kDefects[] = {
      {"CCSDS_OEM_VERS = 2.0", "CCSDS_OEM_VERS = 4.0",
       "x.oem:1: expected one of the versions 1.0, 2.0, 3.0"},
      {"CCSDS_OEM_VERS", "CCSDS_OPM_VERS", "x.oem:1: expected CCSDS_OEM_VERS"},
      {"ORIGINATOR", "ORIGIN", "x.oem:4: expected META_START"},
      {"META_START", "META_BEGIN", "x.oem:6: expected META_START"},
      {"META_STOP", "", "x.oem:21: expected META_STOP or a key"},
      {"OBJECT_NAME ", "OBJECT_NOUN ", "x.oem:8: expected META_STOP or a key"},
      {"= EARTH", "= MARS BARYCENTER", "x.oem:10: expected CENTER_NAME = EARTH, found \"MARS"},
      {"= EME2000", "= TEME", "x.oem:11: expected one of the frames EME2000, J2000"},
      {"= EME2000", "= ITRF2000", "found \"ITRF2000\""},
      {"= UTC", "= UT1", "x.oem:12: expected TIME_SYSTEM to be UTC, TAI, TT or GPS"},
      {"TIME_SYSTEM          = UTC\r\n", "", "x.oem:12: expected TIME_SYSTEM before START_TIME"},
      {"CENTER_NAME          = EARTH\r\n", "", "x.oem:18: expected CENTER_NAME before META_STOP"},
      {"OBJECT_ID ", "OBJECT_NAME ", "x.oem:9: OBJECT_NAME stands here twice"},
      {"00:00:10.000", "00:00:60.000", "x.oem:14: expected a date"},
      {"= 2022-001T00:02:50", "= 2022-001T00:00:05", "x.oem:19: expected START_TIME <= USEABLE"},
      {"= LAGRANGE", "= SPLINE", "x.oem:17: expected INTERPOLATION = HERMITE, LAGRANGE or LINEAR"},
      {"DEGREE = 2", "DEGREE = 26", "x.oem:18: expected a whole number from 1 to 25"},
      {"DEGREE = 2", "DEGREE = 2.5", "x.oem:18: expected a whole number"},
      {"DEGREE = 2", "DEGREE = 7", "x.oem:6: expected at least 8 rows in this segment"},
      {"T00:01:00.000\t", "T00:00:00.000\t", "x.oem:22: expected a time after the row before"},
      {"-001T00:02:00 ", "-001T00:00:30 ", "x.oem:23: expected a time after the row before"},
      {"6990.0", "nan", "x.oem:23: expected a finite number, found \"nan\""},
      {"6990.0", "inf", "x.oem:23: expected a finite number"},
      {"6990.0", "1e400", "x.oem:23: expected a finite number"},
      {"6990.0", "6,990", "x.oem:23: expected a finite number"},
      {"6990.0", "1e9", "x.oem:23: expected a place within 1e7 km"},
      {"6990.0", "", "x.oem:23: expected a date and 6 or 9 numbers, found 6 words"},
      {"6990.0", "1 2 3 4 5", "x.oem:23: expected a date and 6 or 9 numbers, found 11 words"},
      {"2022-01-01T00:03:00  ", "2022-01-01T00:02:45  ", "x.oem:6: expected rows from 2022"},
      {"COVARIANCE_STOP", "COVARIANCE_END", "expected COVARIANCE_STOP, found the end of the file"},
  };
  for (const Defect& defect : kDefects) {
    try {
      static_cast<void>(parse(changed(defect.from, defect.to)));
      ADD_FAILURE() << "taken: " << defect.from << " -> " << defect.to;
    } catch (const ConfigError& e) {
      EXPECT_NE(std::string(e.what()).find(defect.complaint), std::string::npos)
          << e.what() << "\nwanted: " << defect.complaint;
    }
  }
}

TEST(Oem, RefusesSegmentsThatOverlap) {
  const std::string& text = kGood;
  const std::string again = text.substr(text.find("META_START"));
  EXPECT_THROW(static_cast<void>(parse(text + again)), ConfigError);
}

TEST(Oem, AFileCutOffAnywhereIsReadOrRefused) {
  const std::string& text = kGood;
  int good_ones = 0;
  for (std::size_t length = 0; length <= text.size(); ++length) {
    try {
      const EphemerisPropagator body(parse(text.substr(0, length)));
      EXPECT_TRUE(body.at(body.span().begin).position.m.allFinite());
      ++good_ones;
    } catch (const ConfigError&) {
      // As it should.
    }
  }
  EXPECT_GT(good_ones, 0);
}

TEST(Oem, AFileWithAnyByteOfItBrokenIsReadOrRefused) {
  const std::string& text = kGood;
  for (std::size_t i = 0; i < text.size(); ++i) {
    for (const char c : {'\0', '\n', '=', '9', '-', '\xff'}) {
      std::string broken = text;
      broken[i] = c;
      try {
        const EphemerisPropagator body(parse(broken));
        EXPECT_TRUE(body.at(body.span().end).position.m.allFinite());
      } catch (const ConfigError&) {
        // As it should.
      }
    }
  }
}

TEST(Oem, AFileThatIsNotThereIsAConfigError) {
  EXPECT_THROW(static_cast<void>(KvnLines::from_file("/nowhere/at_all.oem")), ConfigError);
  EXPECT_THROW(static_cast<void>(KvnLines::from_file("/")), ConfigError);
}

}  // namespace
}  // namespace engine
