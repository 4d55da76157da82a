// The plane that `starloop mtf` writes.

#include <algorithm>
#include <cmath>
#include <complex>
#include <filesystem>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <starloop_test_paths.h>

#include "engine/core/constants.h"
#include "tests/tools/program.h"

namespace {

namespace fs = std::filesystem;
using program::Outcome;
using program::starloop;
using Row = std::map<std::string, double>;  // without the cells that are empty

constexpr int kSide = 129;
constexpr double kIfov_rad = 6.5e-6 / 4.5;

std::vector<Row> rows_of(const fs::path& file) {
  std::istringstream lines(program::content_of(file));
  std::vector<std::string> names;
  std::vector<Row> rows;
  for (std::string line; std::getline(lines, line);) {
    std::istringstream cells(line);
    std::size_t i = 0;
    Row row;
    for (std::string cell; std::getline(cells, cell, ','); ++i) {
      if (rows.empty() && i == names.size()) {
        names.push_back(cell);
      } else if (!cell.empty()) {
        row[names.at(i)] = std::stod(cell);
      }
    }
    rows.push_back(row);
  }
  rows.erase(rows.begin());  // the names
  return rows;
}

std::complex<double> complex_of(const Row& row, const std::string& name) {
  return {row.at(name + "_re"), row.at(name + "_im")};
}

double cycles_per_px(const Row& row) {
  return std::hypot(row.at("u_cycles_per_px"), row.at("v_cycles_per_px"));
}

class MtfPlane : public testing::Test {
 protected:
  /// Every term does something: coma, so that it is complex; out of focus; vibration aslant.
  MtfPlane() {
    const Outcome run =
        starloop({"mtf", STARLOOP_SOURCE_DIR "/config/flyby.toml", "--out",
                  (folder_.path() / "m.csv").string(), "--set", "optics.zernike_nm.z7=60", "--set",
                  "optics.focus=infinity", "--set", "optics.jitter_urad=0.3", "--set",
                  "optics.vibration_urad=1.5", "--set", "optics.vibration_direction_deg=30"});
    EXPECT_EQ(run.exit_code, 0) << run.err;
    plane_ = rows_of(folder_.path() / "m_plane.csv");
    drawn_ = run.out.find("no picture") == std::string::npos;
  }
  void SetUp() override {
    ASSERT_EQ(plane_.size(), static_cast<std::size_t>(kSide) * kSide);
    cutoff_ = -plane_.front().at("u_cycles_per_px");
  }
  [[nodiscard]] bool passed(const Row& row) const {
    return cycles_per_px(row) < cutoff_ * (1.0 + 1e-8);
  }

  program::TemporaryFolder folder_;
  std::vector<Row> plane_;
  double cutoff_ = 0;
  bool drawn_ = false;
};

TEST_F(MtfPlane, ProductIsThatOfTheTermsAndThatOfARealImage) {
  int compared = 0;
  for (std::size_t i = 0; i < plane_.size(); ++i) {
    const Row& row = plane_[i];
    const std::complex<double> product = complex_of(row, "product");
    // A real image's OTF at the opposite frequency is the conjugate.
    EXPECT_NEAR(std::abs(product - std::conj(complex_of(plane_[plane_.size() - 1 - i], "product"))),
                0.0, 1e-6);
    if (!passed(row)) {
      EXPECT_EQ(product, 0.0);
      EXPECT_EQ(row.size(), 6U);
      continue;
    }
    const std::complex<double> lens = complex_of(row, "lens");
    // Two circles whose middles are nearly a diameter apart share .1 % at 99 % of the cutoff.
    if (cycles_per_px(row) > 0.99 * cutoff_) {
      EXPECT_LT(std::abs(product), 2e-3);
    }
    if (std::abs(lens) < 1e-2) continue;
    const std::complex<double> terms = lens * complex_of(row, "defocus") * row.at("jitter") *
                                       row.at("vibration") * row.at("table") * row.at("pixel") *
                                       row.at("smear");
    EXPECT_NEAR(std::abs(terms - product), 0.0, 1e-6);  // the lens' tables: single precision
    ++compared;
  }
  EXPECT_GT(compared, 5000);
  EXPECT_NEAR(std::abs(complex_of(plane_[plane_.size() / 2], "product") - 1.0), 0.0, 1e-6);
}

TEST_F(MtfPlane, VibrationIsJ0AlongItsDirectionWithItsSign) {
  const double amplitude_px = 1.5e-6 / kIfov_rad;
  const double direction_rad = 30.0 * engine::kDegree;
  double least = 0;
  for (const Row& row : plane_) {
    if (!passed(row)) continue;
    const double along = std::abs(row.at("u_cycles_per_px") * std::cos(direction_rad) +
                                  row.at("v_cycles_per_px") * std::sin(direction_rad));
    const double x = 2.0 * engine::kPi * amplitude_px * along;
    // A broken line of 8192 steps, at most 1e-7 off; nine digits.
    EXPECT_NEAR(row.at("vibration"), std::cyl_bessel_j(0.0, x), 3e-7);
    least = std::min(least, row.at("vibration"));
  }
  EXPECT_NEAR(least, -0.4028, 2e-3);  // of J0, between the plane's frequencies
}

TEST_F(MtfPlane, VibrationsOfOtherAmplitudesAreBesideItAndDrawn) {
  const std::vector<Row> rows = rows_of(folder_.path() / "m_vibration.csv");
  ASSERT_EQ(rows.size(), 4U * 401U);
  EXPECT_EQ(rows.front().at("amplitude_urad"), 0.375);
  EXPECT_EQ(rows.back().at("amplitude_urad"), 3.0);
  for (const Row& row : rows) {
    const double f = row.at("frequency_lp_mm") * 1e3;
    const double x = 2.0 * engine::kPi * row.at("amplitude_urad") * 1e-6 * 4.5 * f;
    EXPECT_NEAR(row.at("vibration"), std::cyl_bessel_j(0.0, x), 1e-7) << x;
  }
  if (!drawn_) GTEST_SKIP() << "no python3 with matplotlib";
  for (const std::string name : {"m.png", "m_plane.png", "m_vibration.png"})
    EXPECT_GT(fs::file_size(folder_.path() / name), 10'000U) << name;
}

}  // namespace
