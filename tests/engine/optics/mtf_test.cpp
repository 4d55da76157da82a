#include "engine/optics/mtf.h"

#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "engine/core/constants.h"
#include "tests/support/csv.h"

namespace engine {
namespace {

using test_support::Csv;

constexpr double kFocalRatio = 12.5;
constexpr double kPitch_m = 6.5e-6;
// Fourteen decimals are printed; arccosine and Bessel function add a few roundings of their size.
constexpr double kPrinted = 2e-13;

TEST(Mtf, ComponentsAreThoseOfTheReference) {
  const Csv reference("mtf_reference.csv");
  for (const Csv::Row& row : reference.rows()) {
    const double per_px = row.number("fft_index_k") / 1024.0;
    const double per_m = per_px / kPitch_m;
    EXPECT_NEAR(per_m * 1e-3, row.number("spatial_freq_lp_mm"), 1e-11);
    for (const int nm : {450, 550, 650, 850}) {
      EXPECT_NEAR(diffraction_otf(per_m * nm * 1e-9 * kFocalRatio, 0.0),
                  row.number("MTF_diffraction_" + std::to_string(nm) + "nm"), kPrinted);
    }
    EXPECT_NEAR(box_otf(per_px, 1.0), row.number("MTF_pixel_sinc"), kPrinted);
    for (const auto& [name, length_px] : {std::pair("0.5", 0.5), {"1", 1.0}, {"2", 2.0}}) {
      // The reference prints the modulus.
      EXPECT_NEAR(std::abs(box_otf(per_px, length_px)),
                  std::abs(row.number("MTF_smear_" + std::string(name) + "px")), kPrinted);
    }
    for (const auto& [name, um] :
         {std::pair("1", 1.0), {"2", 2.0}, {"4", 4.0}, {"5", 5.0}, {"6.5", 6.5}, {"10", 10.0}}) {
      // Signed: 10 um is negative in the middle of the band.
      EXPECT_NEAR(vibration_otf(per_m, um * 1e-6), row.number("J0_A_" + std::string(name) + "um"),
                  kPrinted);
    }
    for (const auto& [name, px] : {std::pair("0.1", 0.1), {"0.3", 0.3}, {"0.5", 0.5}, {"1", 1.0}}) {
      EXPECT_NEAR(jitter_otf(per_px, px),
                  row.number("MTF_gauss_jitter_sigma_" + std::string(name) + "px"), kPrinted);
    }
  }
}

TEST(Mtf, VibrationTurnsNegativeAboveTheModelsAmplitude) {
  const double nyquist_per_m = 0.5 / kPitch_m;
  // 4.976 um, four digits.
  EXPECT_GT(vibration_otf(nyquist_per_m, 4.9755e-6), 0.0);
  EXPECT_LT(vibration_otf(nyquist_per_m, 4.9765e-6), 0.0);
}

TEST(Mtf, IsOneAtZeroAndEven) {
  for (const double obscuration : {0.0, 0.1, 0.33, 0.5, 0.9}) {
    EXPECT_NEAR(diffraction_otf(0.0, obscuration), 1.0, 1e-14) << obscuration;
    EXPECT_EQ(diffraction_otf(0.3, obscuration), diffraction_otf(-0.3, obscuration));
    EXPECT_EQ(diffraction_otf(1.0, obscuration), 0.0);
    EXPECT_EQ(diffraction_otf(7.0, obscuration), 0.0);
    EXPECT_NEAR(diffraction_otf(1.0 - 1e-12, obscuration), 0.0, 1e-12);
  }
  EXPECT_EQ(sinc(0.0), 1.0);
  EXPECT_EQ(vibration_otf(0.0, 1e-6), 1.0);
  EXPECT_EQ(vibration_otf(-1e5, 3e-6), vibration_otf(1e5, 3e-6));
  EXPECT_EQ(jitter_otf(0.0, 1.0), 1.0);
  EXPECT_NEAR(sinc(1.0), 0.0, 1e-16);
}

TEST(Mtf, SincHasNoStepWhereItsSeriesEnds) {
  for (double p = 0.0195; p < 0.0205; p += 1e-6) {
    const double x = p / kPi;
    const double p2 = kPi * x * kPi * x;
    const double want = 1.0 - p2 / 6.0 + p2 * p2 / 120.0 - p2 * p2 * p2 / 5040.0;
    // What the short series leaves out: p^6/5040 at .02, and a few roundings.
    ASSERT_NEAR(sinc(x), want, 1.3e-14 + 1e-15) << p;
  }
}

TEST(Mtf, AnnularPupilTendsToTheFullOne) {
  // A hole of radius e takes 2 e^2 of the overlap at most.
  for (double nu = 0.0; nu < 1.0; nu += 0.01)
    EXPECT_NEAR(diffraction_otf(nu, 1e-5), diffraction_otf(nu, 0.0), 4e-10) << nu;
}

/// The share of an annular pupil that overlaps with itself moved by 2 nu: by counting points.
double counted_overlap(double nu, double e) {
  constexpr int kSide = 1500;
  int both = 0;
  int one = 0;
  const auto open = [e](double x, double y) {
    const double r2 = x * x + y * y;
    return r2 <= 1.0 && r2 >= e * e;
  };
  for (int i = 0; i < kSide; ++i) {
    for (int j = 0; j < kSide; ++j) {
      const double x = -1.0 + 2.0 * (i + 0.5) / kSide;
      const double y = -1.0 + 2.0 * (j + 0.5) / kSide;
      if (!open(x, y)) continue;
      ++one;
      both += open(x - 2.0 * nu, y) ? 1 : 0;
    }
  }
  return static_cast<double>(both) / one;
}

TEST(Mtf, AnnularPupilIsItsOwnOverlap) {
  for (const double e : {0.2, 0.5, 0.8}) {
    for (const double nu : {0.05, 0.1, 0.3, 0.5, 0.7, 0.9, 0.95}) {
      // Points are miscounted along the rims only, four rims of up to 1500 cells, at random.
      EXPECT_NEAR(diffraction_otf(nu, e), counted_overlap(nu, e), 1e-3) << e << " " << nu;
    }
  }
}

TEST(Mtf, IntegralIsTheAreaOfThePupil) {
  // The integral of an autocorrelation is the square of the integral: in units of the cutoff the
  // OTF of an annulus integrates to (1 - e^2)/8 over nu dnu.
  for (const double e : {0.0, 0.1, 0.33, 0.7}) {
    constexpr int kSteps = 20000;
    double sum = 0;
    for (int i = 0; i < kSteps; ++i) {
      const double nu = (i + 0.5) / kSteps;
      sum += diffraction_otf(nu, e) * nu / kSteps;
    }
    EXPECT_NEAR(sum, (1.0 - e * e) / 8.0, 1e-8) << e;  // midpoints: 1/n^2
  }
}

TEST(Mtf, OfElevenWavelengthsGivesTheSystemsResponseAtNyquist) {
  // .170 with the pixel's own, three digits, is the mean of 11 wavelengths with both ends counted.
  const double nyquist_per_m = 0.5 / kPitch_m;
  double eleven = 0;
  for (int i = 0; i < 11; ++i)
    eleven += diffraction_otf(nyquist_per_m * (450 + 40 * i) * 1e-9 * kFocalRatio, 0.0) / 11.0;
  EXPECT_NEAR(eleven * box_otf(0.5, 1.0), 0.170, 0.0005);
}

}  // namespace
}  // namespace engine
