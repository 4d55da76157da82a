#include "engine/optics/lens_otf.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <unsupported/Eigen/FFT>

#include "engine/core/constants.h"
#include "engine/core/random.h"
#include "engine/optics/mtf.h"

namespace engine {
namespace {

using Complex = std::complex<double>;
constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kThousandth = 1e-3;  // what the tables promise

LensSpec clear_lens(double obscuration = 0.0) {
  LensSpec lens;
  lens.obscuration = obscuration;
  return lens;
}

LensSpec bent_lens(std::size_t j, double rms_m, double obscuration = 0.0) {
  LensSpec lens = clear_lens(obscuration);
  lens.zernike_m[j] = rms_m;
  return lens;
}

LensSpec spider_lens(int vanes, double width_m, double obscuration) {
  LensSpec lens = clear_lens(obscuration);
  lens.spider_vanes = vanes;
  lens.spider_width_m = width_m;
  lens.spider_angle_rad = 0.3;
  return lens;
}

LensSpec one_wavelength(LensSpec lens, double wavelength_m = 650e-9) {
  lens.band_low_m = wavelength_m * (1.0 - 1e-9);
  lens.band_high_m = wavelength_m * (1.0 + 1e-9);
  return lens;
}

struct Named {
  std::string name;
  LensSpec lens;
};

std::vector<Named> radial_lenses() {
  LensSpec many = bent_lens(22, 12e-9, 0.2);
  many.zernike_m[4] = 40e-9;
  many.zernike_m[11] = -20e-9;
  many.zernike_m[37] = 4e-9;
  LensSpec rough = clear_lens(0.3);
  rough.wavefront_rms_m = 45e-9;
  return {{"clear", clear_lens()},
          {"obscured", clear_lens(0.33)},
          {"spherical", bent_lens(11, 30e-9)},
          {"many", many},
          {"rough", rough}};
}

std::vector<Named> other_lenses() {
  LensSpec all = spider_lens(3, 0.005, 0.2);
  all.zernike_m[4] = -25e-9;
  all.zernike_m[7] = 30e-9;
  all.zernike_m[12] = 10e-9;
  all.wavefront_rms_m = 30e-9;
  return {{"coma", bent_lens(8, 40e-9)},
          {"astigmatism", bent_lens(6, 60e-9, 0.3)},
          {"spider", spider_lens(4, 0.010, 0.3)},
          {"all", all}};
}

Complex exact(const LensSpec& lens, const Pupil& pupil, double fx, double fy, double defocus_m) {
  Complex sum = 0;
  for (const BandLine& line : band_lines(lens)) {
    const double nu_m = lens.nu_m(line.wavelength_m);
    sum += line.share * pupil.otf(fx * nu_m, fy * nu_m, line.wavelength_m, defocus_m);
  }
  return sum;
}

/// The largest difference between the tables and the pupil at random places, half of them at the
/// low frequencies where large defocus happens.
double worst_error(const LensSpec& lens, double largest_m, int places) {
  const LensOtf otf(lens, largest_m);
  const Pupil pupil(lens);
  Draws draws(7, Stream::kLight, 0, 0);
  double worst = 0;
  for (int i = 0; i < places; ++i) {
    const double f = otf.cutoff_per_m() * draws.uniform_double() * (i % 2 == 0 ? 1.0 : 0.2);
    const double angle = 2.0 * kPi * draws.uniform_double();
    const double w_m = otf.largest_defocus_m() * (2.0 * draws.uniform_double() - 1.0);
    const double fx = f * std::cos(angle);
    const double fy = f * std::sin(angle);
    worst = std::max(worst, std::abs(otf.at(fx, fy, w_m) - exact(lens, pupil, fx, fy, w_m)));
  }
  return worst;
}

/// Over the plane, in units of the cutoff.
double integral(const LensOtf& otf, double defocus_m) {
  constexpr int kSteps = 400;
  double sum = 0;
  const auto slice = otf.slice(defocus_m);
  for (int i = -kSteps; i < kSteps; ++i) {
    for (int k = 0; k < kSteps; ++k) {
      const double x = (i + 0.5) / kSteps;
      const double y = (k + 0.5) / kSteps;
      sum += 2.0 * slice.at(x * otf.cutoff_per_m(), y * otf.cutoff_per_m()).real();
    }
  }
  return sum / (kSteps * kSteps);
}

TEST(LensOtf, InFocusAndClearIsTheBandsDiffraction) {
  for (const double obscuration : {0.0, 0.33}) {
    const LensSpec lens = clear_lens(obscuration);
    const auto band = [&](double per_m) {
      double sum = 0;
      for (const BandLine& line : band_lines(lens))
        sum += line.share * diffraction_otf(per_m * lens.nu_m(line.wavelength_m), obscuration);
      return sum;
    };
    for (const double largest_m : {0.0, 1e-6}) {
      const LensOtf otf(lens, largest_m);
      EXPECT_TRUE(otf.radial());
      EXPECT_EQ(otf.changes_with_defocus(), largest_m > 0.0);
      EXPECT_NEAR(otf.cutoff_per_m() * 1e-3, 177.8, 0.05);  // 1/(.45 um 12.5)
      for (double f = 0.0; f < 1.1 * otf.cutoff_per_m(); f += 0.0113 * otf.cutoff_per_m()) {
        // A table of 4096 steps: curvature of 40 at rims' crossings, over 8 n^2; single precision.
        EXPECT_NEAR(otf.at_radial(f, 0.0), band(f), 1e-6) << f;
        EXPECT_NEAR(std::abs(otf.at(0.6 * f, -0.8 * f, 0.0) - band(f)), 0.0, 1e-6) << f;
      }
    }
  }
}

TEST(LensOtf, StrehlOfATargetSeenFromAFocusAtInfinity) {
  const LensSpec lens = one_wavelength(clear_lens());
  const LensOtf otf(lens, 0.5e-6);
  const double sharp = integral(otf, 0.0);
  // Two digits; and the closed form of a defocused disc, sinc^2(W20 / lambda).
  for (const auto& [range_m, strehl] : {std::pair(69e3, 0.64), {100e3, 0.81}, {200e3, 0.95}}) {
    const double w_m = defocus_m(lens, range_m, kInfinity);
    EXPECT_NEAR(integral(otf, w_m) / sharp, strehl, 0.005) << range_m;
    EXPECT_NEAR(integral(otf, w_m) / sharp, std::pow(sinc(w_m / 650e-9), 2), 2e-4) << range_m;
    EXPECT_EQ(otf.at_radial(4e4, w_m), otf.at_radial(4e4, -w_m));
  }
}

TEST(LensOtf, TablesOfRadialPupilsAreWithinAThousandth) {
  for (const auto& [name, lens] : radial_lenses()) {
    EXPECT_TRUE(LensOtf(lens, 0.0).radial()) << name;
    EXPECT_LT(worst_error(lens, 0.0, 60), kThousandth) << name;
    EXPECT_LT(worst_error(lens, 1.4e-6, 150), kThousandth) << name;
    EXPECT_LT(worst_error(lens, kInfinity, 150), kThousandth) << name;
  }
}

TEST(LensOtf, TablesOfOtherPupilsAreWithinAThousandth) {
  for (const auto& [name, lens] : other_lenses()) {
    EXPECT_FALSE(LensOtf(lens, 0.0).radial()) << name;
    EXPECT_LT(worst_error(lens, 0.0, 24), kThousandth) << name;
    EXPECT_LT(worst_error(lens, kInfinity, 40), kThousandth) << name;
  }
}

TEST(LensOtf, CarriesATargetAt11kmFocusedAtInfinity) {
  // 2.1 waves at 650 nm: where the model says that nothing is left.
  for (const auto& [name, lens] : other_lenses()) {
    const double w_m = defocus_m(lens, 11.8e3, kInfinity);
    EXPECT_NEAR(w_m / 650e-9, 2.1, 0.02);
    EXPECT_EQ(LensOtf(lens, 1e-6).largest_defocus_m(), 1e-6);
    const LensOtf otf(lens, w_m);
    if (name != "all") {
      EXPECT_EQ(otf.largest_defocus_m(), w_m) << name;
    }
  }
  const LensOtf clear(one_wavelength(clear_lens()), 1.4e-6);
  EXPECT_LT(integral(clear, 1.373e-6) / integral(clear, 0.0), 0.01);
}

TEST(LensOtf, TransformsAndQuadratureAgree) {
  // A trace of astigmatism sends the same pupil by the other way: 1e-4 nm are 1e-6 of the phase.
  for (const auto& [name, radial] : radial_lenses()) {
    LensSpec other = radial;
    other.zernike_m[5] = 1e-13;
    const LensOtf by_quadrature(radial, 1.2e-6);
    const LensOtf by_transform(other, 1.2e-6);
    ASSERT_TRUE(by_quadrature.radial());
    ASSERT_FALSE(by_transform.radial());
    for (const double w_m : {0.0, 0.13e-6, -0.5e-6, 1.17e-6}) {
      for (double f = 0.0; f < 1.6e5; f += 3.1e3) {
        EXPECT_NEAR(
            std::abs(by_transform.at(0.8 * f, -0.6 * f, w_m) - by_quadrature.at_radial(f, w_m)),
            0.0, kThousandth)
            << name << " " << w_m << " " << f;
      }
    }
  }
}

TEST(LensOtf, SmallErrorsOfAnyShapeHaveMarechalsStrehl) {
  const double waves = 0.02;
  const double sharp = integral(LensOtf(one_wavelength(clear_lens()), 0.0), 0.0);
  const double want = std::exp(-std::pow(2.0 * kPi * waves, 2));
  for (std::size_t j = 4; j <= LensSpec::kLastZernike; ++j) {
    const LensOtf otf(one_wavelength(bent_lens(j, waves * 650e-9)), 0.0);
    // To fourth order the two differ by (k/12 - 1/4) sigma^4, k = <phi^4>/sigma^4 under 15, and
    // the transform's tables by their 1e-4.
    EXPECT_NEAR(integral(otf, 0.0) / sharp, want, 2.5e-4 + 1e-4) << j;
  }
}

TEST(LensOtf, AstigmatismTurnsWithItsAxis) {
  const LensOtf upright(bent_lens(6, 50e-9), 0.5e-6);
  const LensOtf turned(bent_lens(5, 50e-9), 0.5e-6);
  EXPECT_NEAR(integral(upright, 0.0) / integral(turned, 0.0), 1.0, 2e-4);
  double difference = 0;
  for (double angle = 0.0; angle < 2.0 * kPi; angle += 0.3) {
    for (const double f : {1e4, 4e4, 9e4}) {
      const auto at = [&](const LensOtf& otf, double a, double w_m) {
        return otf.at(f * std::cos(a), f * std::sin(a), w_m);
      };
      // z6 is r^2 cos 2 theta, z5 r^2 sin 2 theta: an eighth of a turn further.
      for (const double w_m : {0.0, 0.3e-6})
        EXPECT_NEAR(std::abs(at(upright, angle, w_m) - at(turned, angle + kPi / 4.0, w_m)), 0.0,
                    2.0 * kThousandth);
      difference =
          std::max(difference, std::abs(at(upright, angle, 0.3e-6) - at(turned, angle, 0.3e-6)));
    }
  }
  EXPECT_GT(difference, 0.1);
}

TEST(LensOtf, ComaIsComplexAndHermitian) {
  const LensOtf otf(bent_lens(8, 60e-9), 1e-6);
  EXPECT_GT(std::abs(otf.at(4e4, 0.0, 0.0).imag()), 0.05);
  for (const double w_m : {0.0, 0.37e-6, -0.9e-6}) {
    for (double angle = 0.1; angle < 2.0 * kPi; angle += 0.37) {
      const double x = 5e4 * std::cos(angle);
      const double y = 5e4 * std::sin(angle);
      EXPECT_EQ(otf.at(-x, -y, w_m), std::conj(otf.at(x, y, w_m)));
    }
    // On the axis of frequencies, too, where the half plane ends.
    EXPECT_NEAR(std::abs(otf.at(-5e4, 0.0, w_m) - std::conj(otf.at(5e4, 0.0, w_m))), 0.0, 1e-6);
  }
}

TEST(LensOtf, ComaMovesLightTowardsTheGrowingWavefront) {
  // A ray goes astray by 2 N times the slope; the mean slope of z8 over the disc is sqrt(8).
  const double shift_m = 2.0 * 12.5 * std::sqrt(8.0) * 30e-9;
  const double f = 50.0;
  for (const auto& [j, along_u] : {std::pair(std::size_t{8}, true), {std::size_t{7}, false}}) {
    const LensOtf otf(bent_lens(j, 30e-9), 0.0);
    const Complex along = along_u ? otf.at(f, 0.0, 0.0) : otf.at(0.0, f, 0.0);
    const Complex across = along_u ? otf.at(0.0, f, 0.0) : otf.at(f, 0.0, 0.0);
    // Over the first step of the table, 1/192 of the cutoff, the overlap loses a rim of 1.27/192 of
    // the area, where the slope is up to seven times the mean; the table is rounded there.
    EXPECT_NEAR(std::arg(along) / (-2.0 * kPi * f * shift_m), 1.0, 1.27 / 192.0 * 7.0);
    EXPECT_NEAR(std::arg(across), 0.0, 1e-6);
  }
}

TEST(LensOtf, SignOfDefocusMattersBesideSphericalAberration) {
  const LensOtf over(bent_lens(11, 40e-9), 1e-6);
  const LensOtf under(bent_lens(11, -40e-9), 1e-6);
  double difference = 0;
  for (double f = 0.0; f < 1.5e5; f += 4e3) {
    for (const double w_m : {0.2e-6, 0.55e-6}) {
      EXPECT_NEAR(over.at_radial(f, w_m), under.at_radial(f, -w_m), 1e-4);
      difference = std::max(difference, std::abs(over.at_radial(f, w_m) - over.at_radial(f, -w_m)));
    }
  }
  EXPECT_GT(difference, 0.05);
  // z4 and z11 lack nothing of W20 r^2 + 6 sqrt(5) z11 r^4 but piston if W20 takes their r^2 back:
  // what is nearer than the focus (W20 > 0) makes up for z4 < 0.
  const LensOtf shifted(bent_lens(4, -50e-9), 1e-6);
  const LensOtf sharp(clear_lens(), 1e-6);
  EXPECT_NEAR(shifted.at_radial(5e4, 2.0 * std::sqrt(3.0) * 50e-9), sharp.at_radial(5e4, 0.0),
              1e-4);
}

TEST(LensOtf, IntegralIsTheOpenAreaOfThePupil) {
  // As of an annulus: pi/4 times the open share, in units of the cutoff. Steps over the cone at
  // zero and the vanes' bends: (1/400)^2.
  for (const auto& lens : {clear_lens(), clear_lens(0.4), spider_lens(4, 0.010, 0.3),
                           spider_lens(3, 0.02, 0.0), spider_lens(1, 0.03, 0.1)}) {
    const LensOtf otf(one_wavelength(lens), 0.0);
    EXPECT_NEAR(integral(otf, 0.0), kPi / 4.0 * lens.open_share(), 5e-4)
        << lens.spider_vanes << " " << lens.obscuration;
  }
}

TEST(LensOtf, VanesHideTwiceWhatMovesAcrossThem) {
  LensSpec lens = one_wavelength(spider_lens(4, 0.006, 0.3));
  lens.spider_angle_rad = 0.0;
  const LensOtf otf(lens, 0.0);
  const double nu = 0.1;
  const double f = nu * otf.cutoff_per_m();
  const double axis = otf.at(f, 0.0, 0.0).real();
  const double diagonal = otf.at(f * std::sqrt(0.5), f * std::sqrt(0.5), 0.0).real();
  // Lengths of thin vanes in the overlap of two annuli 2 nu apart. Along u: four across the shift
  // (two vanes, and again), and two along it that hide themselves. Along the diagonal all hide
  // twice, moved by d across and along.
  const double e = 0.3;
  const double s = 2.0 * nu;
  const double d = s * std::sqrt(0.5);
  const double on_axis = 4.0 * (std::sqrt(1.0 - s * s) - e) + 2.0 * (1.0 - e - s);
  const double off_axis =
      4.0 * (1.0 - d - std::sqrt(e * e - d * d) + std::sqrt(1.0 - d * d) - d - e);
  const double width = 2.0 * 0.006 / 0.36;
  const double want = width * (off_axis - on_axis) / (kPi * lens.open_share());
  // The vanes' ends are as long as their width, of lengths of .7.
  EXPECT_NEAR(axis - diagonal, want, width / 0.7 * want);
  EXPECT_NEAR(otf.at(0.0, f, 0.0).real(), axis, 1e-5);
}

TEST(LensOtf, NoErrorRaisesTheResponseOfItsPupil) {
  for (const auto& lenses : {radial_lenses(), other_lenses()}) {
    for (const auto& [name, lens] : lenses) {
      LensSpec flat = lens;
      flat.zernike_m = {};
      const LensOtf sharp(flat, 0.0);
      const LensOtf otf(lens, 1.2e-6);
      for (const double w_m : {0.0, 0.11e-6, -0.41e-6, 1.13e-6}) {
        const auto slice = otf.slice(w_m);
        for (double x = -1.6e5; x < 1.6e5; x += 7.1e3) {
          for (double y = 0; y < 1.6e5; y += 7.7e3) {
            ASSERT_LE(std::abs(slice.at(x, y)), sharp.at(x, y, 0.0).real() + kThousandth)
                << name << " " << w_m << " " << x << " " << y;
          }
        }
      }
    }
  }
}

struct PointImage {
  double lowest = kInfinity;
  double highest = -kInfinity;
};

/// By transform, in a period of 256 pixels.
PointImage point_image(const LensOtf& otf, double defocus_m) {
  constexpr int kSide = 640;
  constexpr double kStep_per_m = 1.0 / (256.0 * 6.5e-6);
  const int last = static_cast<int>(otf.cutoff_per_m() / kStep_per_m);
  EXPECT_LT(2 * last + 1, kSide);
  const auto slice = otf.slice(defocus_m);
  const auto cell = [](int x, int y) {
    return static_cast<std::size_t>((y + kSide) % kSide * kSide + (x + kSide) % kSide);
  };
  std::vector<Complex> plane(static_cast<std::size_t>(kSide * kSide));
  for (int y = -last; y <= last; ++y)
    for (int x = -last; x <= last; ++x)
      plane[cell(x, y)] = slice.at(x * kStep_per_m, y * kStep_per_m);
  Eigen::FFT<double> fft;
  std::vector<Complex> in(kSide);
  std::vector<Complex> out(kSide);
  PointImage image;
  for (int y = 0; y < kSide; ++y) {
    std::copy_n(plane.begin() + y * kSide, kSide, in.begin());
    fft.inv(&plane[cell(0, y)], in.data(), kSide);
  }
  for (int x = 0; x < kSide; ++x) {
    for (int y = 0; y < kSide; ++y) in[static_cast<std::size_t>(y)] = plane[cell(x, y)];
    fft.inv(out.data(), in.data(), kSide);
    for (const Complex& c : out) {
      image.lowest = std::min(image.lowest, c.real());
      image.highest = std::max(image.highest, c.real());
    }
  }
  return image;
}

TEST(LensOtf, MakesNoNegativeLight) {
  for (const auto& lenses : {radial_lenses(), other_lenses()}) {
    for (const auto& [name, lens] : lenses) {
      const LensOtf otf(lens, kInfinity);
      const double peak = point_image(otf, 0.0).highest;
      // Between levels and beyond the tables, of both signs.
      for (const double part : {0.0, 0.03, -0.117, 0.213, 0.37, -0.5, 0.731, -1.0, 1.5, -3.0}) {
        const PointImage image = point_image(otf, part * otf.largest_defocus_m());
        // Of its own peak; behind a spider, whose vanes' bends the tables cut, of that in focus.
        const double limit = lens.spider_vanes > 0 ? peak : image.highest;
        EXPECT_GE(image.lowest, -1e-6 * limit) << name << " " << part;
      }
    }
  }
}

TEST(LensOtf, GrowsInProportionBeyondItsTables) {
  const LensSpec lens = clear_lens();
  const Pupil pupil(lens);
  const LensOtf otf(lens, 2e-6);
  EXPECT_EQ(otf.at_radial(3e4, 4e-6), otf.at_radial(6e4, 2e-6));
  EXPECT_EQ(otf.slice(4e-6).at_radial(3e4), otf.slice(2e-6).at_radial(6e4));
  EXPECT_NEAR(otf.at_radial(0.0, 1.0), 1.0, 1e-6);
  // Geometry lacks the overlap's shrinking, 1.27 nu in the cone and as much in the length of the
  // chords; half of the response is gone at nu = 1/(8 waves), some .03 at 3 waves.
  for (double f = 0.0; f < 1.6e5; f += 1e3)
    EXPECT_NEAR(otf.at_radial(f, 3e-6), exact(lens, pupil, f, 0.0, 3e-6).real(), 0.04) << f;
}

TEST(LensOtf, SlicesAreWhatTheyAreCutFrom) {
  for (const LensSpec& lens : {bent_lens(11, 20e-9), bent_lens(7, 30e-9), clear_lens()}) {
    const LensOtf otf(lens, 1e-6);
    auto slice = otf.slice(0.0);
    for (const double w_m : {0.0, 0.123e-6, -0.77e-6, 1.9e-6}) {
      otf.focus(w_m, slice);
      for (double f = 0.0; f < 1.7e5; f += 3.3e3)
        EXPECT_NEAR(std::abs(slice.at(-0.6 * f, 0.8 * f) - otf.at(-0.6 * f, 0.8 * f, w_m)), 0.0,
                    2e-6);
    }
  }
}

TEST(LensOtf, SameTablesEveryTime) {
  for (const LensSpec& lens : {bent_lens(11, 20e-9), spider_lens(3, 0.004, 0.1)}) {
    const LensOtf one(lens, 0.5e-6);
    const LensOtf two(lens, 0.5e-6);
    for (double f = 0.0; f < 1.7e5; f += 3.3e3)
      EXPECT_EQ(one.at(f, 0.4 * f, 0.3e-6), two.at(f, 0.4 * f, 0.3e-6));
  }
}

TEST(LensOtf, UnseenDefocusIsTheLargestThatKeepsTheLimit) {
  for (const LensSpec& lens : {clear_lens(0.3), bent_lens(11, 40e-9), bent_lens(8, 40e-9)}) {
    const LensOtf otf(lens, 1e-6);
    const auto change = [&](double w_m) {
      const auto sharp = otf.slice(0.0);
      const auto other = otf.slice(w_m);
      double largest = 0;
      for (double x = -1.7e5; x < 1.7e5; x += 3.3e3)
        for (double y = 0.0; y < 1.7e5; y += 3.3e3)
          largest = std::max(largest, std::abs(other.at(x, y) - sharp.at(x, y)));
      return largest;
    };
    for (const double share : {0.003, 0.03}) {
      const double w_m = otf.unseen_defocus_m(share);
      // Other frequencies than it looked at, a forty-eighth of the plane apart: 1 %.
      EXPECT_LE(std::max(change(w_m), change(-w_m)), 1.01 * share);
      EXPECT_GE(std::max(change(1.02 * w_m), change(-1.02 * w_m)), share);
    }
  }
  // Flat pupils lose by the square of the defocus.
  const LensOtf flat(clear_lens(), 1e-6);
  EXPECT_NEAR(flat.unseen_defocus_m(4e-3) / flat.unseen_defocus_m(1e-3), 2.0, 0.02);
  EXPECT_EQ(flat.unseen_defocus_m(2.0), flat.largest_defocus_m());
}

/// The largest difference that so many wavelengths make against 41.
double error_of_lines(const LensSpec& lens, double defocus_m, int count) {
  const Pupil pupil(lens);
  const auto band = [&](double f, const GaussRule& rule) {
    Complex sum = 0;
    for (std::size_t i = 0; i < rule.nodes.size(); ++i) {
      const double wavelength_m = 650e-9 + 200e-9 * rule.nodes[i];
      const double nu = f * lens.nu_m(wavelength_m);
      sum += 0.5 * rule.weights[i] * pupil.otf(0.8 * nu, 0.6 * nu, wavelength_m, defocus_m);
    }
    return sum;
  };
  const GaussRule many(41);
  const GaussRule few(count);
  double worst = 0;
  for (double f = 0.0; f < 1.77e5; f += 3e3)
    worst = std::max(worst, std::abs(band(f, few) - band(f, many)));
  return worst;
}

TEST(LensOtf, FiveWavelengthsDoInFocusAndThreeThousandthsOff) {
  for (const double obscuration : {0.0, 0.3}) {
    const LensSpec lens = clear_lens(obscuration);
    EXPECT_LT(error_of_lines(lens, 0.0, 5), 1e-3);
    EXPECT_LT(error_of_lines(lens, 0.2e-6, 5), 1.1e-3);
    EXPECT_LT(error_of_lines(lens, 1e-6, 5), 3.1e-3);
    EXPECT_LT(error_of_lines(lens, 2e-6, 5), 3e-3);
    EXPECT_LT(error_of_lines(lens, 1e-6, 9), 1e-3);
    EXPECT_LT(error_of_lines(lens, 2e-6, 9), 1.5e-3);
  }
}

}  // namespace
}  // namespace engine
