#include "engine/optics/optics.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "engine/core/constants.h"
#include "engine/optics/mtf.h"
#include "tests/support/projected.h"
#include "tests/support/scenes.h"

namespace engine {
namespace {

using Eigen::Vector3d;
using test_support::Projected;
using test_support::small_camera;

constexpr int kSide_px = 512;
constexpr double kFaint_w_m2 = 1e-30;  // follow the spread of light as far as allowed
// Follow it far, but do not take a cell of radiance 1 for so bright that it must be a point.
constexpr double kQuiteFaint_w_m2 = 1e-9;

OpticsSpec spec_of(int side_px = kSide_px) {
  OpticsSpec spec;
  spec.camera = small_camera(side_px);
  return spec;
}

Projected project(const Radiance& in, int threads = 1, const OpticsSpec& spec = spec_of(),
                  double faint_w_m2 = kFaint_w_m2) {
  return test_support::project(in, spec, faint_w_m2, threads);
}

/// Irradiance on the detector, summed over pixels, that a point of 1 W/m^2 at the pupil makes: its
/// power through the aperture over a pixel's area.
double flux_of_unit_point() {
  const double power_w = kPi / 4.0 * 0.36 * 0.36 * 0.7;
  return power_w / (6.5e-6 * 6.5e-6);
}

Radiance point_at(double u, double v, PixelPoint motion = {}) {
  Radiance in;
  const int left = static_cast<int>(std::lround(u));
  const int top = static_cast<int>(std::lround(v));
  in.region = {left, top, left + 1, top + 1};
  in.grid.resize(3, 3);
  std::fill(in.grid.pixels().begin(), in.grid.pixels().end(), 0.0F);
  in.points.push_back({{u, v}, 1.0});
  in.motion_px = motion;
  return in;
}

/// Even radiance 1 over whole pixels.
Radiance plate_over(PixelRect region) {
  Radiance in;
  in.region = region;
  in.grid.resize(3 * region.width(), 3 * region.height());
  std::fill(in.grid.pixels().begin(), in.grid.pixels().end(), 1.0F);
  return in;
}

/// The share of a point's light in the pixel `du`, `dv` from it: the transform of OTF times pixel,
/// on a fine grid of frequencies in cycles per pixel, for `wavelengths` from 450 to 850 nm. The two
/// outermost weigh `ends`: .5 makes a trapezoid rule.
class ShareByIntegral {
 public:
  ShareByIntegral(int wavelengths, double ends) {
    for (std::size_t i = 0; i < otf_.size(); ++i) {
      const double per_m = static_cast<double>(i) * kRadialStep / 6.5e-6;
      double sum = 0;
      double weights = 0;
      for (int k = 0; k < wavelengths; ++k) {
        const double weight = k == 0 || k == wavelengths - 1 ? ends : 1.0;
        const double wavelength_m = 450e-9 + 400e-9 * k / (wavelengths - 1);
        sum += weight * diffraction_otf(per_m * wavelength_m * 12.5, 0.0);
        weights += weight;
      }
      otf_[i] = sum / weights;
    }
  }
  [[nodiscard]] double operator()(double du, double dv) const {
    double sum = 0;
    for (int i = 0; i < kSteps; ++i) {
      for (int j = 0; j < kSteps; ++j) {
        const double fx = (i + 0.5) * kStep;
        const double fy = (j + 0.5) * kStep;
        const double place = std::hypot(fx, fy) / kRadialStep;
        const auto low = static_cast<std::size_t>(place);
        const double part = place - static_cast<double>(low);
        const double otf = (1.0 - part) * otf_[low] + part * otf_[low + 1];
        sum += 4.0 * kStep * kStep * otf * sinc(fx) * sinc(fy) * std::cos(2.0 * kPi * fx * du) *
               std::cos(2.0 * kPi * fy * dv);
      }
    }
    return sum;
  }

 private:
  static constexpr int kSteps = 500;
  static constexpr double kStep = 1.16 / kSteps;  // the optics pass 1.156 cycles per pixel
  static constexpr double kRadialStep = kStep / 2.0;
  std::array<double, 3 * kSteps> otf_{};  // to 1.5 times the cutoff: a square's corner
};

// Five wavelengths are within 1e-3 of 41 at each frequency (LensOtf), and the pixel passes about
// one square cycle per pixel: 1e-3 of a point's light. The window's own echo is 2e-8.
constexpr double kShareTolerance = 1e-3;

TEST(Optics, PointFillsItsPixelAsTheIntegralOfTheOtfSays) {
  // The golden .4088 and .1934 are the mean of 11 wavelengths, both ends counted; they prove this
  // integral. The band itself, flat in photons, gives .4056 and .1941.
  const ShareByIntegral golden(11, 1.0);
  EXPECT_NEAR(golden(0.0, 0.0), 0.4088, 1e-4);  // by its digits, and 1e-5 of the grid
  EXPECT_NEAR(golden(0.5, 0.5), 0.1934, 1e-4);
  const ShareByIntegral share(41, 0.5);
  const double flux = flux_of_unit_point();
  const Projected centred = project(point_at(256.0, 256.0));
  EXPECT_NEAR(centred.at(256, 256) / flux, share(0.0, 0.0), kShareTolerance);
  for (const int d : {1, 2, 3}) {
    EXPECT_NEAR(centred.at(256 + d, 256) / flux, share(d, 0.0), kShareTolerance) << d;
    EXPECT_NEAR(centred.at(256, 256 - d) / flux, share(0.0, d), kShareTolerance) << d;
    EXPECT_NEAR(centred.at(256 + d, 256 + d) / flux, share(d, d), kShareTolerance) << d;
  }
  const Projected corner = project(point_at(256.5, 256.5));
  for (const int u : {256, 257})
    for (const int v : {256, 257})
      EXPECT_NEAR(corner.at(u, v) / flux, share(0.5, 0.5), kShareTolerance);
}

TEST(Optics, GridIsBlurredAsTheSceneItIsTheMeanOf) {
  // A bright square of one pixel, at several places within a cell. Its edges hold frequencies that
  // three cells to a pixel fold; for an edge anywhere in a cell that averages out.
  constexpr std::array<double, 5> kNodes{-0.4530899229693320, -0.2692346550528416, 0.0,
                                         0.2692346550528416, 0.4530899229693320};
  constexpr std::array<double, 5> kWeights{0.1184634425280945, 0.2393143352496833,
                                           0.2844444444444444, 0.2393143352496833,
                                           0.1184634425280945};  // Gauss and Legendre
  const ShareByIntegral share(41, 0.5);
  const double throughput = kPi / 4.0 * 0.08 * 0.08 * 0.7;
  double off = 0;
  constexpr int kPlaces = 6;
  for (int k = 0; k < kPlaces; ++k) {
    const double shift_px = (k + 0.5) / (3.0 * kPlaces);
    Radiance in = plate_over({256, 256, 258, 258});
    const auto covered = [&](int cell) {
      const double low = std::max(cell / 3.0, shift_px);
      const double high = std::min((cell + 1) / 3.0, shift_px + 1.0);
      return 3.0 * std::max(0.0, high - low);
    };
    for (int y = 0; y < 6; ++y)
      for (int x = 0; x < 6; ++x) in.grid.at(x, y) = static_cast<float>(covered(x) * covered(y));
    double want = 0;
    for (std::size_t i = 0; i < kNodes.size(); ++i)
      for (std::size_t j = 0; j < kNodes.size(); ++j)
        want += kWeights[i] * kWeights[j] * share(shift_px + kNodes[i], shift_px + kNodes[j]);
    off += (project(in, 1, spec_of(), kQuiteFaint_w_m2).at(256, 256) / throughput - want) / kPlaces;
  }
  EXPECT_NEAR(off, 0.0, kShareTolerance);
}

TEST(Optics, KeepsThePointsLightButForTheStatedLoss) {
  const double flux = flux_of_unit_point();
  for (const double phase : {0.0, 0.25, 0.5, -0.3}) {
    const Projected out = project(point_at(256.0 + phase, 256.0 - phase / 2.0));
    EXPECT_GT(out.report.lost_flux_share, 0.0);
    EXPECT_LE(out.sum() / flux, 1.0 + 1e-5) << phase;  // single precision of 20000 pixels
    EXPECT_GE(out.sum() / flux, 1.0 - out.report.lost_flux_share - 1e-5) << phase;
  }
}

TEST(Optics, StatesTheLightOutsideItsWing) {
  // 1 - EE(r) = .256/r.
  for (const int wing_px : {16, 64, 128}) {
    OpticsSpec spec = spec_of();
    spec.largest_wing_px = wing_px;
    const Projected out = project(point_at(256.0, 256.0), 1, spec);
    EXPECT_EQ(out.report.wing_px, wing_px);
    EXPECT_NEAR(out.report.lost_flux_share * wing_px, 0.256,
                0.005);  // 1 in its third digit, 650 nm
  }
}

TEST(Optics, FollowsTheSpreadOfAFaintSourceLessFar) {
  const double flux = flux_of_unit_point();
  // The pattern falls as .0407 F/r^3: what is faint at 20 px.
  const double faint = 0.0407 * flux / (20.0 * 20.0 * 20.0);
  const Projected out = project(point_at(256.0, 256.0), 1, spec_of(), faint);
  EXPECT_NEAR(out.report.wing_px, 20, 1);
}

TEST(Optics, CentroidFollowsThePointAsSamplingBiasesIt) {
  // Pixels sample what passes one cycle per pixel, too: the full centroid of a point at x is
  // x - OTF(1)/pi sin(2 pi x), by Poisson's sum. Wings end unevenly in a window of +-X about a
  // pixel: their profile there, .0815/X^2, twice that with the padding's echoes and a quarter more,
  // times the window, 2 X: .0063 of the phase at 64.
  const OtfCascade cascade(spec_of());
  const double otf_at_one = cascade.at_radial(1.0, cascade.focused(0.0));
  for (const double phase : {0.0, 0.1, 0.25, 0.4, 0.5, -0.25}) {
    const Projected out = project(point_at(256.0 + phase, 256.0));
    double sum = 0;
    double sum_u = 0;
    double sum_v = 0;
    for (int v = 256 - 64; v <= 256 + 64; ++v) {
      for (int u = 256 - 64; u <= 256 + 64; ++u) {
        sum += out.at(u, v);
        sum_u += (u - 256) * out.at(u, v);
        sum_v += (v - 256) * out.at(u, v);
      }
    }
    const double want = phase - otf_at_one / kPi * std::sin(2.0 * kPi * phase);
    EXPECT_NEAR(sum_u / sum, want, 0.0063 * std::abs(phase) + 3e-4) << phase;
    EXPECT_NEAR(sum_v / sum, 0.0, 3e-4) << phase;
  }
}

TEST(Optics, PointSpreadIsSymmetricAboutAWholePixel) {
  const Projected out = project(point_at(256.0, 256.0));
  const double peak = out.highest();
  EXPECT_EQ(peak, out.at(256, 256));
  for (int d = 1; d <= 60; ++d) {
    for (const int e : {0, 1, 7}) {
      // Single precision of the transforms: 1e-7 times log2(600).
      EXPECT_NEAR(out.at(256 + d, 256 + e), out.at(256 - d, 256 - e), 1e-6 * peak);
      EXPECT_NEAR(out.at(256 + d, 256 + e), out.at(256 + e, 256 + d), 1e-6 * peak);
      EXPECT_NEAR(out.at(256 + d, 256 - e), out.at(256 + d, 256 + e), 1e-6 * peak);
    }
  }
}

TEST(Optics, ShiftsWithThePoint) {
  const Projected a = project(point_at(200.3, 256.7));
  const Projected b = project(point_at(207.3, 251.7));
  const double peak = a.highest();
  for (int v = 240; v < 270; ++v)
    for (int u = 185; u < 215; ++u) ASSERT_NEAR(a.at(u, v), b.at(u + 7, v - 5), 1e-6 * peak);
}

TEST(Optics, MakesNoNegativeLight) {
  for (const double phase : {0.0, 0.25, 0.5}) {
    for (const PixelPoint motion : {PixelPoint{}, PixelPoint{1.0, 0.0}, PixelPoint{7.3, -3.1}}) {
      const Projected out = project(point_at(256.0 + phase, 256.0 + phase, motion));
      // Single precision.
      EXPECT_GE(out.lowest(), -1e-6 * out.highest()) << phase << " " << motion.u;
    }
  }
}

TEST(Optics, SmearKeepsTheLightAndHasItsLength) {
  const double flux = flux_of_unit_point();
  const auto spread = [](const Projected& out, double along_u, double along_v) {
    double sum = 0;
    double first = 0;
    double second = 0;
    for (int v = 256 - 40; v <= 256 + 40; ++v) {
      for (int u = 256 - 40; u <= 256 + 40; ++u) {
        const double x = along_u * (u - 256) + along_v * (v - 256);
        sum += out.at(u, v);
        first += x * out.at(u, v);
        second += x * x * out.at(u, v);
      }
    }
    return std::pair(first / sum, second / sum);
  };
  const Projected still = project(point_at(256.0, 256.0));
  for (const PixelPoint motion :
       {PixelPoint{20.0, 0.0}, PixelPoint{0.0, 20.0}, PixelPoint{12.0, 16.0}}) {
    const Projected out = project(point_at(256.0, 256.0, motion));
    EXPECT_NEAR(out.sum() / flux, 1.0, out.report.lost_flux_share) << motion.u;
    const double au = motion.u / 20.0;
    const double av = motion.v / 20.0;
    // A streak of length L about the point adds L^2/12 = 33.3 px^2 along itself and nothing across.
    // Wings beyond the window, .256/40 of the light, weigh (L/40)^2 of that: 1 %.
    const auto [mean, along] = spread(out, au, av);
    const auto [mean_still, along_still] = spread(still, au, av);
    EXPECT_NEAR(mean, 0.0, 0.01);
    EXPECT_NEAR(along - along_still, 400.0 / 12.0, 0.02 * 400.0 / 12.0);
    const auto [off, across] = spread(out, -av, au);
    const auto [off_still, across_still] = spread(still, -av, au);
    EXPECT_NEAR(across, across_still, 0.02 * 400.0 / 12.0);
    EXPECT_NEAR(off, off_still, 0.01);
  }
}

TEST(Optics, SmearDoesNotTellForthFromBack) {
  const Projected forth = project(point_at(256.0, 256.0, {20.0, 5.0}));
  const Projected back = project(point_at(256.0, 256.0, {-20.0, -5.0}));
  // Summed up from the other end.
  const double peak = forth.highest();
  for (std::size_t i = 0; i < forth.image.pixels().size(); ++i)
    ASSERT_NEAR(forth.image.pixels()[i], back.image.pixels()[i], 1e-6 * peak);
  // The other diagonal is another streak.
  const Projected other = project(point_at(256.0, 256.0, {20.0, -5.0}));
  EXPECT_GT(forth.at(264, 258), 10.0 * other.at(264, 258));
}

TEST(Optics, NoMotionIsTheStillImageBitForBit) {
  const Projected still = project(point_at(256.25, 256.0));
  const Projected zero = project(point_at(256.25, 256.0, {0.0, 0.0}));
  EXPECT_TRUE(std::ranges::equal(still.image.pixels(), zero.image.pixels()));
}

TEST(Optics, EvenRadianceIsTheThroughput) {
  WorkerPool pool(1);
  Optics optics(spec_of(), kFaint_w_m2, pool);
  // Eq 15: pi/4 (D/f)^2 tau.
  EXPECT_DOUBLE_EQ(optics.throughput_sr(), kPi / 4.0 * 0.08 * 0.08 * 0.7);
  Radiance in;
  in.uniform_w_m2_sr = 3.25;
  IrradianceImage out;
  const OpticsReport report = optics.project(in, out);
  EXPECT_TRUE(report.window.empty());
  ASSERT_EQ(out.width(), kSide_px);
  ASSERT_EQ(out.height(), kSide_px);
  const auto want = static_cast<float>(3.25 * optics.throughput_sr());
  EXPECT_TRUE(std::ranges::all_of(out.pixels(), [want](float x) { return x == want; }));
}

/// Before the sunlit Earth that fills the field, a target that covers a part of each cell of a
/// square and sends `share` of the light that it hides.
Radiance before_the_earth(const Optics& optics, double share) {
  EarthInFrame earth;
  earth.disc.to_centre.unit = Vector3d(0.0, 0.6, 0.8);
  earth.disc.to_sun.unit = Vector3d(0.6, 0.0, -0.8);
  earth.disc.distance_radii = 1.1;
  earth.disc.sun_irradiance_w_m2 = 600.0;
  Radiance in;
  in.uniform_w_m2_sr = 0.5;
  in.earth.reserve(spec_of().camera, optics.wish().beyond_frame_px);
  in.earth.draw(earth, in.uniform_w_m2_sr);
  in.region = {200, 180, 260, 220};
  in.grid.resize(3 * in.region.width(), 3 * in.region.height());
  in.cover.resize(3 * in.region.width(), 3 * in.region.height());
  for (int j = 0; j < in.grid.height(); ++j) {
    for (int i = 0; i < in.grid.width(); ++i) {
      in.cover.at(i, j) = 0.5F + 0.5F * std::sin(0.7F * static_cast<float>(i * (j + 1)));
      const PixelPoint place{1.0 * in.region.left + i / 3, 1.0 * in.region.top + j / 3};
      in.grid.at(i, j) = static_cast<float>(share * static_cast<double>(in.cover.at(i, j)) *
                                            (in.uniform_w_m2_sr + in.earth.at(place)));
    }
  }
  return in;
}

TEST(Optics, ATargetAsBrightAsTheEarthThatItHidesIsNotSeen) {
  WorkerPool pool(1);
  Optics optics(spec_of(), kFaint_w_m2, pool);
  const Radiance in = before_the_earth(optics, 1.0);
  ASSERT_FALSE(in.earth.empty());
  IrradianceImage out;
  EXPECT_FALSE(optics.project(in, out).window.empty());
  for (int v = 0; v < kSide_px; v += 7) {
    for (int u = 0; u < kSide_px; u += 7) {
      const double want =
          optics.throughput_sr() * (in.uniform_w_m2_sr + in.earth.at({1.0 * u, 1.0 * v}));
      // Interpolated nodes, and single precision.
      EXPECT_NEAR(out.at(u, v), want, 1e-3 * want);
    }
  }
}

TEST(Optics, ABlackTargetTakesAwayWhatItHides) {
  WorkerPool pool(1);
  Optics optics(spec_of(), kFaint_w_m2, pool);
  const Radiance in = before_the_earth(optics, 0.0);
  IrradianceImage out;
  const OpticsReport report = optics.project(in, out);
  double missing = 0;
  for (int v = report.window.top; v < report.window.bottom; ++v) {
    const auto throughput = static_cast<float>(optics.throughput_sr());
    std::vector<float> behind(kSide_px, throughput * static_cast<float>(in.uniform_w_m2_sr));
    in.earth.add_row(v, 0, throughput, behind);
    for (int u = report.window.left; u < report.window.right; ++u)
      missing += static_cast<double>(behind[static_cast<std::size_t>(u)]) -
                 static_cast<double>(out.at(u, v));
  }
  double hidden = 0;
  for (int j = 0; j < in.cover.height(); ++j)
    for (int i = 0; i < in.cover.width(); ++i)
      hidden += static_cast<double>(in.cover.at(i, j)) / 9.0 * optics.throughput_sr() *
                (in.uniform_w_m2_sr +
                 in.earth.at({1.0 * in.region.left + i / 3, 1.0 * in.region.top + j / 3}));
  EXPECT_GT(hidden, 0.0);
  // The wings that nobody follows, and rounding: 2^-24 of each pixel's light where 1200 are hidden.
  EXPECT_NEAR(missing / hidden, 1.0, report.lost_flux_share + 512.0 * 512.0 / 1200.0 * 0x1p-24);
}

TEST(Optics, AveragesNoiseOverTheSquaredSpreadOfAPoint) {
  // The sum of the squared shares of a point that pixels get, averaged over its places in a pixel,
  // is the integral of the squared OTF.
  double squares = 0;
  constexpr int kPlaces = 4;
  for (int i = 0; i < kPlaces; ++i) {
    for (int k = 0; k < kPlaces; ++k) {
      const Projected out = project(point_at(256 + (i + 0.5) / kPlaces, 256 + (k + 0.5) / kPlaces));
      for (const float x : out.image.pixels())
        squares += std::pow(static_cast<double>(x) / flux_of_unit_point(), 2);
    }
  }
  squares /= kPlaces * kPlaces;
  WorkerPool pool(1);
  const double blur_px = Optics(spec_of(), kFaint_w_m2, pool).noise_blur_px();
  EXPECT_NEAR(1.0 / (4.0 * kPi * blur_px * blur_px) / squares, 1.0, 5e-3);
}

TEST(Optics, ObscurationTakesItsAreaFromTheThroughput) {
  OpticsSpec spec = spec_of();
  spec.lens.obscuration = 0.3;
  WorkerPool pool(1);
  const Optics optics(spec, kFaint_w_m2, pool);
  EXPECT_DOUBLE_EQ(optics.throughput_sr(), kPi / 4.0 * 0.08 * 0.08 * 0.7 * (1.0 - 0.09));
}

TEST(Optics, WideEvenSquareKeepsItsRadianceInTheMiddle) {
  const Projected out = project(plate_over({156, 156, 356, 356}));
  const double throughput = kPi / 4.0 * 0.08 * 0.08 * 0.7;
  // 100 px from the middle to an edge: .256/100 of the light comes from further off, at most.
  EXPECT_LE(out.at(256, 256) / throughput, 1.0 + 1e-5);
  EXPECT_GE(out.at(256, 256) / throughput, 1.0 - 0.256 / 100.0);
  // Half of the spread of a straight edge falls on either side.
  EXPECT_NEAR(0.5 * (out.at(155, 256) + out.at(156, 256)) / throughput, 0.5, 0.003);
  EXPECT_NEAR(0.5 * (out.at(256, 355) + out.at(256, 356)) / throughput, 0.5, 0.003);
  // 200 x 200 pixels of it in all.
  EXPECT_NEAR(out.sum() / throughput / 40000.0, 1.0, out.report.lost_flux_share);
}

TEST(Optics, PutsTheGridWhereItsRegionSays) {
  // One pixel of even radiance is symmetric about its own centre.
  const Projected out = project(plate_over({200, 300, 201, 301}), 1, spec_of(), kQuiteFaint_w_m2);
  const double peak = out.highest();
  EXPECT_EQ(peak, out.at(200, 300));
  for (const int d : {1, 2, 5}) {
    EXPECT_NEAR(out.at(200 + d, 300), out.at(200 - d, 300), 2e-6 * peak);
    EXPECT_NEAR(out.at(200, 300 + d), out.at(200, 300 - d), 2e-6 * peak);
  }
  // A point of the same light, spread over a pixel: 1 W/m^2/sr over one pixel's solid angle.
  const double ifov = 6.5e-6 / 4.5;
  EXPECT_NEAR(out.sum() / (flux_of_unit_point() * ifov * ifov), 1.0, out.report.lost_flux_share);
}

TEST(Optics, LightAtOneEdgeDoesNotShowAtTheOther) {
  // Region partly outside the frame, at each border and in a corner, with the longest smear.
  const double throughput = kPi / 4.0 * 0.08 * 0.08 * 0.7;
  for (const PixelPoint motion : {PixelPoint{}, PixelPoint{60.0, 60.0}}) {
    Radiance in = plate_over({-30, -30, 10, 10});
    in.uniform_w_m2_sr = 0.5;
    in.motion_px = motion;
    const Projected out = project(in);
    const auto even = static_cast<float>(0.5 * throughput);
    EXPECT_GT(out.at(0, 0), 1.1 * static_cast<double>(even));
    for (int i = 0; i < kSide_px; ++i) {
      // Beyond the window nothing is added at all.
      ASSERT_EQ(out.image.at(kSide_px - 1, i), even);
      ASSERT_EQ(out.image.at(i, kSide_px - 1), even);
    }
  }
}

TEST(Optics, HoldsAllLightThatMayCome) {
  // The whole frame and all that is looked at beyond it, with the longest smear: the largest grid
  // there is, and the rows' buffers must hold it.
  WorkerPool pool(2);
  Optics optics(spec_of(), kFaint_w_m2, pool);
  const int beyond = optics.wish().beyond_frame_px;
  Radiance in = plate_over({-beyond, -beyond, kSide_px + beyond, kSide_px + beyond});
  in.motion_px = {500.0, 500.0};
  IrradianceImage image;
  optics.project(in, image);
  const double throughput = kPi / 4.0 * 0.08 * 0.08 * 0.7;
  EXPECT_NEAR(static_cast<double>(image.at(kSide_px / 2, kSide_px / 2)) / throughput, 1.0, 1e-3);
}

TEST(Optics, LightDoesNotWrapRoundItsOwnWindow) {
  // A bright point at the left of a wide dark region: at the region's far end only its own wing,
  // and the echo from the padding, not nearer than the wing's length.
  Radiance in = plate_over({100, 240, 400, 270});
  std::fill(in.grid.pixels().begin(), in.grid.pixels().end(), 0.0F);
  in.points.push_back({{100.0, 255.0}, 1.0});
  const Projected out = project(in);
  // .0407/r^3 on average, up to twice that on a ring, at 64 px and more; the rest is rounding.
  const double limit = flux_of_unit_point() * (2.0 * 0.0407 / (64.0 * 64.0 * 64.0) + 1e-7);
  for (int v = 240; v < 270; ++v)
    for (int u = 300; u < 464; ++u) ASSERT_LT(std::abs(out.at(u, v)), limit) << u << " " << v;
}

TEST(Optics, PointsAndGridAddUp) {
  Radiance both = plate_over({250, 250, 260, 260});
  Radiance grid = plate_over({250, 250, 260, 260});
  Radiance point = plate_over({250, 250, 260, 260});
  std::fill(point.grid.pixels().begin(), point.grid.pixels().end(), 0.0F);
  const double bright = 1e-11;  // so that both are of one size
  both.points.push_back({{254.2, 255.9}, bright});
  point.points.push_back({{254.2, 255.9}, bright});
  both.uniform_w_m2_sr = 0.25;
  const Projected a = project(both);
  const Projected b = project(grid);
  const Projected c = project(point);
  const double even = 0.25 * kPi / 4.0 * 0.08 * 0.08 * 0.7;
  const double peak = a.highest();
  for (int v = 230; v < 280; ++v)
    for (int u = 230; u < 280; ++u)
      ASSERT_NEAR(a.at(u, v), b.at(u, v) + c.at(u, v) + even, 2e-6 * peak);
}

TEST(Optics, GivesTheSameBitsOnAnyNumberOfThreads) {
  Radiance in = plate_over({100, 90, 181, 147});
  for (std::size_t i = 0; i < in.grid.pixels().size(); ++i)
    in.grid.pixels()[i] = static_cast<float>(i % 97);
  in.points.push_back({{120.2, 100.9}, 1e-9});
  in.motion_px = {3.0, -7.0};
  const Projected one = project(in, 1);
  for (const int threads : {1, 2, 3}) {
    const Projected again = project(in, threads);
    EXPECT_TRUE(std::ranges::equal(one.image.pixels(), again.image.pixels())) << threads;
  }
}

TEST(Optics, SecondFrameRemembersNothingOfTheFirst) {
  WorkerPool pool(1);
  Optics optics(spec_of(), kFaint_w_m2, pool);
  IrradianceImage first;
  IrradianceImage large;
  IrradianceImage again;
  optics.project(point_at(256.25, 250.0), first);
  optics.project(plate_over({100, 100, 300, 300}), large);
  optics.project(point_at(256.25, 250.0), again);
  EXPECT_TRUE(std::ranges::equal(first.pixels(), again.pixels()));
}

TEST(ReadOptics, TakesAsManyCellsAsCarryWhatTheLensPasses) {
  const auto read = [](const std::string& aperture) {
    const ConfigReader config =
        ConfigReader::from_text("[optics]\ntransmission = 0.7\naperture_m = " + aperture, "x.toml");
    return read_optics(config.table("optics"), CameraGeometry{});
  };
  EXPECT_DOUBLE_EQ(read("0.36").lens.aperture_m, 0.36);
  // Half of 3 cells per 6.5 um is 231 lp/mm; 450 nm reach it at .467 m.
  EXPECT_EQ(read("0.02").oversampling, 3);
  EXPECT_EQ(read("0.467").oversampling, 3);
  EXPECT_EQ(read("0.468").oversampling, 4);
  EXPECT_EQ(read("1.24").oversampling, 8);
  EXPECT_THROW(read("1.25"), ConfigError);
  EXPECT_THROW(read("-1"), ConfigError);
}

}  // namespace
}  // namespace engine
