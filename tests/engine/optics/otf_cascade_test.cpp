#include "engine/optics/otf_cascade.h"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "engine/core/constants.h"
#include "engine/optics/mtf.h"

namespace engine {
namespace {

TEST(OtfCascade, IsTheProductOfItsTerms) {
  OpticsSpec spec;
  spec.lens.obscuration = 0.3;
  spec.lens.zernike_m[7] = 40e-9;
  spec.jitter_rad = 0.3e-6;
  spec.vibration = {1.1e-6, 0.5};
  spec.mtf = {{0.0, 100e3}, {1.0, 0.7}};
  spec.focus = Focus::kInfinity;
  const OtfCascade cascade(spec);
  EXPECT_FALSE(cascade.radial());
  const auto focused = cascade.focused(150e-9);
  for (const double fu : {0.0, 0.2, 0.5, 0.9}) {
    for (const double fv : {-0.4, 0.0, 0.3}) {
      std::complex<double> product = 1.0;
      for (const auto& term : cascade.terms(fu, fv, focused)) product *= term.value;
      // The vibration's table; and the ratio that stands for defocus is told only where light
      // passes.
      const std::complex<double> whole = cascade.whole(fu, fv, focused);
      if (std::abs(whole) > 1e-4) {
        EXPECT_NEAR(std::abs(product - whole), 0.0, 2e-5) << fu << " " << fv;
      }
      // An image is real.
      EXPECT_NEAR(std::abs(cascade.whole(-fu, -fv, focused) - std::conj(whole)), 0.0, 1e-6);
    }
  }
  EXPECT_NEAR(cascade.whole(0.0, 0.0, focused).real(), 1.0, 1e-6);
}

TEST(OtfCascade, VibrationIsSignedAndAlongItsDirection) {
  OpticsSpec spec;
  // Above .7655 px J0 is negative at Nyquist.
  spec.vibration = {1.0 * spec.camera.ifov_rad(), kPi / 2.0};
  const OtfCascade cascade(spec);
  const auto focused = cascade.focused(0.0);
  const OtfCascade still{OpticsSpec{}};
  const auto sharp = still.focused(0.0);
  EXPECT_EQ(cascade.at(0.5, 0.0, focused), still.at(0.5, 0.0, sharp));
  const double ratio = cascade.at(0.0, 0.5, focused).real() / still.at(0.0, 0.5, sharp).real();
  EXPECT_NEAR(ratio, vibration_otf(0.5, 1.0), 1e-5);
  EXPECT_LT(ratio, 0.0);
}

TEST(OtfCascade, LeavesOutADefocusThatNobodySees) {
  OpticsSpec spec;
  spec.focus = Focus::kInfinity;
  const OtfCascade cascade(spec);
  const double far = std::numeric_limits<double>::infinity();
  EXPECT_EQ(cascade.seen_defocus_m(spec.defocus_m(5000e3, far)), 0.0);
  const double seen_m = cascade.seen_defocus_m(spec.defocus_m(100e3, far));
  EXPECT_DOUBLE_EQ(seen_m, 0.36 * 0.36 / 8.0 / 100e3);
  // What is left out changes the OTF by two thousandths at most, whatever the frequency.
  double limit_m = 1e-9;
  while (cascade.seen_defocus_m(limit_m * 1.02) == 0.0) limit_m *= 1.02;
  const auto out = cascade.focused(limit_m);
  const auto in = cascade.focused(0.0);
  double most = 0;
  for (double f = 0.0; f < 1.15; f += 0.01)
    most = std::max(most, std::abs(cascade.at_radial(f, out) - cascade.at_radial(f, in)));
  EXPECT_LE(most, 2e-3);
  EXPECT_GE(most, 1.5e-3);  // and hardly a smaller one is kept
}

TEST(OpticsSpec, TellsEachSourceItsOwnDefocus) {
  OpticsSpec spec;
  const double far = std::numeric_limits<double>::infinity();
  // Focused on the target, it is sharp and stars are not; at infinity the other way round.
  EXPECT_EQ(spec.defocus_m(69e3, 69e3), 0.0);
  EXPECT_LT(spec.defocus_m(far, 69e3), 0.0);
  spec.focus = Focus::kInfinity;
  EXPECT_GT(spec.defocus_m(69e3, 69e3), 0.0);
  EXPECT_EQ(spec.defocus_m(far, 69e3), 0.0);
  spec.focus = Focus::kDistance;
  spec.focus_range_m = 100e3;
  EXPECT_GT(spec.defocus_m(69e3, 69e3), 0.0);
  EXPECT_EQ(spec.defocus_m(100e3, 69e3), 0.0);
  EXPECT_LT(spec.defocus_m(far, 69e3), 0.0);
}

}  // namespace
}  // namespace engine
