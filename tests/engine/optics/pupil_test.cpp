#include "engine/optics/pupil.h"

#include <cmath>
#include <complex>
#include <vector>

#include <gtest/gtest.h>

#include "engine/core/constants.h"
#include "engine/optics/mtf.h"

namespace engine {
namespace {

using Complex = std::complex<double>;
constexpr double kRed_m = 650e-9;

/// Over the unit disc: Gauss in r^2 is exact for powers, even angles for turns.
template <class F>
double mean_over_disc(const F& f) {
  const GaussRule rule(12);
  constexpr int kAngles = 32;
  double sum = 0;
  for (std::size_t i = 0; i < rule.nodes.size(); ++i) {
    const double r = std::sqrt(0.5 + 0.5 * rule.nodes[i]);
    for (int k = 0; k < kAngles; ++k) {
      const double angle = 2.0 * kPi * k / kAngles;
      sum += 0.5 * rule.weights[i] / kAngles * f(r * std::cos(angle), r * std::sin(angle));
    }
  }
  return sum;
}

TEST(Zernike, TermsAreOrthonormalOverTheDisc) {
  for (std::size_t j = 1; j <= LensSpec::kLastZernike; ++j) {
    for (std::size_t k = j; k <= LensSpec::kLastZernike; ++k) {
      const double mean =
          mean_over_disc([a = ZernikeTerm(j), b = ZernikeTerm(k)](double x, double y) {
            return a.at(x, y) * b.at(x, y);
          });
      // Powers with coefficients up to 420, squared, times the rounding.
      EXPECT_NEAR(mean, j == k ? 1.0 : 0.0, 1e-11) << j << " " << k;
    }
  }
}

TEST(Zernike, TermsAreThoseOfNollsTable) {
  const double r = 0.8;
  const double a = 0.3;
  const double x = r * std::cos(a);
  const double y = r * std::sin(a);
  const auto at = [&](std::size_t j) { return ZernikeTerm(j).at(x, y); };
  // Noll 1976, table I.
  EXPECT_NEAR(at(1), 1.0, 1e-14);
  EXPECT_NEAR(at(2), 2.0 * x, 1e-14);
  EXPECT_NEAR(at(3), 2.0 * y, 1e-14);
  EXPECT_NEAR(at(4), std::sqrt(3.0) * (2 * r * r - 1), 1e-14);
  EXPECT_NEAR(at(5), std::sqrt(6.0) * r * r * std::sin(2 * a), 1e-14);
  EXPECT_NEAR(at(6), std::sqrt(6.0) * r * r * std::cos(2 * a), 1e-14);
  EXPECT_NEAR(at(7), std::sqrt(8.0) * (3 * r * r * r - 2 * r) * std::sin(a), 1e-14);
  EXPECT_NEAR(at(8), std::sqrt(8.0) * (3 * r * r * r - 2 * r) * std::cos(a), 1e-14);
  EXPECT_NEAR(at(9), std::sqrt(8.0) * r * r * r * std::sin(3 * a), 1e-14);
  EXPECT_NEAR(at(10), std::sqrt(8.0) * r * r * r * std::cos(3 * a), 1e-14);
  EXPECT_NEAR(at(11), std::sqrt(5.0) * (6 * std::pow(r, 4) - 6 * r * r + 1), 1e-14);
  EXPECT_NEAR(at(22), std::sqrt(7.0) * (20 * std::pow(r, 6) - 30 * std::pow(r, 4) + 12 * r * r - 1),
              1e-13);
}

TEST(GaussRule, IntegratesPowersExactly) {
  const GaussRule rule(16);
  for (int power = 0; power < 32; ++power) {
    double sum = 0;
    for (std::size_t i = 0; i < rule.nodes.size(); ++i)
      sum += rule.weights[i] * std::pow(rule.nodes[i], power);
    EXPECT_NEAR(sum, power % 2 == 0 ? 2.0 / (power + 1) : 0.0, 1e-14) << power;
  }
}

TEST(OpenLine, LosesWhatIsCutOfIt) {
  OpenLine line(-1.0, 1.0);
  line.cut(-0.2, 0.1);
  line.cut(0.5, 0.6);
  line.cut(0.55, 2.0);
  line.cut(-0.1, 0.2);
  line.cut(-3.0, -1.0);
  ASSERT_EQ(line.end() - line.begin(), 2);
  EXPECT_EQ(line.begin()->low, -1.0);
  EXPECT_EQ(line.begin()->high, -0.2);
  EXPECT_EQ((line.begin() + 1)->low, 0.2);
  EXPECT_EQ((line.begin() + 1)->high, 0.5);
  line.cut(-2.0, 2.0);
  EXPECT_EQ(line.begin(), line.end());
}

TEST(Pupil, ClearAndInFocusItIsTheClosedForm) {
  for (const double obscuration : {0.0, 0.3, 0.7}) {
    LensSpec lens;
    lens.obscuration = obscuration;
    const Pupil pupil(lens);
    for (double nu = 0.0; nu < 1.0; nu += 0.043) {
      const Complex otf = pupil.otf(nu * 0.6, -nu * 0.8, kRed_m, 0.0);
      EXPECT_NEAR(otf.real(), diffraction_otf(nu, obscuration), 1e-9) << obscuration << " " << nu;
      EXPECT_NEAR(otf.imag(), 0.0, 1e-12);
    }
  }
}

/// Hopkins 1955, eq 17: the clear, defocused pupil as a series of Bessel functions.
double hopkins(double nu, double waves) {
  const double s = 2.0 * nu;
  const double a = 4.0 * kPi * waves * s;
  const double b = std::acos(0.5 * s);
  const auto bessel = [&](int n) { return std::cyl_bessel_j(static_cast<double>(n), a); };
  double first = b * bessel(1);
  double second = 0;
  for (int k = 1; k < 60; ++k) {
    const double sign = k % 2 == 0 ? 1.0 : -1.0;
    first -= sign * 0.5 / k * std::sin(2.0 * k * b) * (bessel(2 * k - 1) - bessel(2 * k + 1));
  }
  for (int k = 0; k < 60; ++k) {
    const double sign = k % 2 == 0 ? 1.0 : -1.0;
    second += sign / (2 * k + 1) * std::sin((2 * k + 1) * b) * (bessel(2 * k) - bessel(2 * k + 2));
  }
  return 4.0 / (kPi * a) * (std::cos(0.5 * a * s) * first - std::sin(0.5 * a * s) * second);
}

TEST(Pupil, DefocusIsHopkinsSeries) {
  const Pupil pupil(LensSpec{});
  for (const double waves : {0.05, 0.25, 1.0, 2.5}) {
    for (double nu = 0.02; nu < 1.0; nu += 0.07) {
      EXPECT_NEAR(pupil.otf(nu, 0.0, kRed_m, waves * kRed_m).real(), hopkins(nu, waves), 1e-9)
          << waves << " " << nu;
    }
  }
}

/// The overlap by points of a grid: open in both places, with the difference of their paths.
Complex counted(const LensSpec& lens, double nu_x, double nu_y, double wavelength_m,
                double defocus_m) {
  constexpr int kSide = 1200;
  const auto open = [&](double x, double y) {
    const double r2 = x * x + y * y;
    if (r2 > 1.0 || r2 < lens.obscuration * lens.obscuration) return false;
    for (int v = 0; v < lens.spider_vanes; ++v) {
      const double angle = lens.spider_angle_rad + 2.0 * kPi * v / lens.spider_vanes;
      const double along = x * std::cos(angle) + y * std::sin(angle);
      const double beside = -x * std::sin(angle) + y * std::cos(angle);
      if (along >= 0.0 && std::abs(beside) < lens.spider_width_m / lens.aperture_m) return false;
    }
    return true;
  };
  const auto path_m = [&](double x, double y) {
    double sum = defocus_m * (x * x + y * y);
    for (std::size_t j = 4; j <= LensSpec::kLastZernike; ++j)
      if (lens.zernike_m[j] != 0.0) sum += lens.zernike_m[j] * ZernikeTerm(j).at(x, y);
    return sum;
  };
  Complex both = 0;
  double one = 0;
  for (int i = 0; i < kSide; ++i) {
    for (int k = 0; k < kSide; ++k) {
      const double x = -1.0 + 2.0 * (i + 0.5) / kSide;
      const double y = -1.0 + 2.0 * (k + 0.5) / kSide;
      one += open(x, y) ? 1.0 : 0.0;
      if (!open(x - nu_x, y - nu_y) || !open(x + nu_x, y + nu_y)) continue;
      both += std::polar(1.0, 2.0 * kPi / wavelength_m *
                                  (path_m(x - nu_x, y - nu_y) - path_m(x + nu_x, y + nu_y)));
    }
  }
  return both / one;
}

TEST(Pupil, IsItsOwnOverlapWithItsPaths) {
  LensSpec lens;
  lens.obscuration = 0.25;
  lens.spider_vanes = 3;
  lens.spider_width_m = 0.02;
  lens.spider_angle_rad = 0.4;
  lens.zernike_m[4] = 20e-9;
  lens.zernike_m[7] = 40e-9;
  lens.zernike_m[14] = 30e-9;
  const Pupil pupil(lens);
  for (const double defocus_m : {0.0, 400e-9, -900e-9}) {
    for (const auto& [x, y] : {std::pair(0.02, 0.01), {0.1, -0.25}, {-0.3, 0.2}, {0.5, 0.6}}) {
      const Complex otf = pupil.otf(x, y, kRed_m, defocus_m);
      const Complex want = counted(lens, x, y, kRed_m, defocus_m);
      // Up to 30000 cells at edges, counted wrong at random: 5 sigma of 87, of a million.
      EXPECT_NEAR(std::abs(otf - want), 0.0, 5e-4) << defocus_m << " " << x << " " << y;
    }
  }
}

TEST(Pupil, FocusOfZ4IsDefocus) {
  LensSpec lens;
  lens.zernike_m[4] = 50e-9;
  const Pupil pupil(lens);
  // sqrt(3) (2 r^2 - 1): W20 = 2 sqrt(3) z4, and piston.
  const double w20_m = 2.0 * std::sqrt(3.0) * 50e-9;
  for (double nu = 0.05; nu < 1.0; nu += 0.1) {
    EXPECT_NEAR(
        std::abs(pupil.otf(nu, 0.0, kRed_m, -w20_m) - Pupil(LensSpec{}).otf(nu, 0.0, kRed_m, 0.0)),
        0.0, 1e-12);
  }
}

TEST(Pupil, SlopeIsThatOfTheSteepestPlace) {
  LensSpec lens;
  lens.zernike_m[11] = 10e-9;
  // sqrt(5) (24 r^3 - 12 r) at the rim.
  EXPECT_NEAR(Pupil(lens).steepest_m(), 12.0 * std::sqrt(5.0) * 10e-9, 1e-14);
  lens.zernike_m[4] = 10e-9;
  EXPECT_NEAR(Pupil(lens).steepest_m(), (12.0 * std::sqrt(5.0) + 4.0 * std::sqrt(3.0)) * 10e-9,
              1e-14);
}

}  // namespace
}  // namespace engine
