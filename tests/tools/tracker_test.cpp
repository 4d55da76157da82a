#include "tools/tracker/tracker.h"

#include <array>
#include <cmath>
#include <random>
#include <vector>

#include <gtest/gtest.h>

namespace {

using engine::Duration;
using engine::PixelPoint;
using engine::SimTime;
using hil::Command;
using hil::CommandKind;
using tracker::Tracker;
using tracker::TrackerSpec;

constexpr int kSide_px = 128;
constexpr int kCentre_px = kSide_px / 2;
constexpr std::uint16_t kWhite_dn = 2047;
constexpr double kBackground_dn = 20;
// What the tracker promises on a clean spot.
constexpr double kCentroid_px = 0.05;

/// A dark sky with one DN of noise.
engine::DnImage dark_sky(unsigned seed = 1) {
  engine::DnImage image(kSide_px, kSide_px);
  std::mt19937 random(seed);
  std::normal_distribution<double> noise(kBackground_dn, 1.0);
  for (std::uint16_t& dn : image.pixels())
    dn = static_cast<std::uint16_t>(std::lround(std::max(0.0, noise(random))));
  return image;
}

/// Adds a round spot of 2 px sigma, clipped at full scale.
void add_spot(engine::DnImage& image, PixelPoint centre, double peak_dn) {
  constexpr double kSigma_px = 2.0;
  for (int v = 0; v < image.height(); ++v) {
    for (int u = 0; u < image.width(); ++u) {
      const double r2 = std::pow(u - centre.u, 2) + std::pow(v - centre.v, 2);
      const double dn = image.at(u, v) + peak_dn * std::exp(-0.5 * r2 / (kSigma_px * kSigma_px));
      image.at(u, v) = static_cast<std::uint16_t>(std::lround(std::min<double>(dn, kWhite_dn)));
    }
  }
}

engine::DnImage spot_at(PixelPoint centre, double peak_dn = 800, unsigned seed = 1) {
  engine::DnImage image = dark_sky(seed);
  add_spot(image, centre, peak_dn);
  return image;
}

std::vector<std::byte> bytes_of(const engine::DnImage& image, std::uint64_t sequence = 0,
                                Duration after_start = {}, hil::TrimAngles trim_rad = {}) {
  hil::Frame frame;
  frame.sequence = sequence;
  frame.shutter_open = engine::sim_time(1000.0) + after_start;
  frame.exposure = Duration(1'000'000);
  frame.trim_rad = trim_rad;
  frame.pixels = &image;
  std::vector<std::byte> bytes(drivers::frame_bytes(image.width(), image.height()));
  ENSURE(drivers::encode_frame(frame, bytes).ok());
  return bytes;
}

/// The tracker's answer, as the camera reads it.
Command answer(Tracker& tracker, std::span<const std::byte> bytes) {
  const auto packet = tracker.on_frame(bytes);
  EXPECT_TRUE(packet.has_value());
  if (!packet) return {};
  const auto command = hil::decode_command(packet->bytes());
  EXPECT_TRUE(command.ok()) << "its own answer is no command";
  return command.ok() ? command.value() : Command{};
}

TEST(Tracker, FindsTheCentreOfASpotToATwentiethOfAPixel) {
  // The sky's noise of 1 DN over the 22 x 22 px that the spot is measured in moves the centroid of
  // its 20 000 DN by 0.007 px (1 sigma): 0.05 is seven times that.
  unsigned seed = 1;
  for (const PixelPoint centre :
       {PixelPoint{64, 64}, {64.5, 64.5}, {30.25, 90.8}, {101.37, 20.13}, {20.0, 60.5}}) {
    Tracker tracker(TrackerSpec{}, kSide_px, kSide_px);
    const Command command = answer(tracker, bytes_of(spot_at(centre, 800, seed++), 77));
    EXPECT_EQ(command.answers_frame, 77U);
    EXPECT_GT(command.detection.confidence, 0.0F);
    EXPECT_LE(command.detection.confidence, 1.0F);
    EXPECT_NEAR(command.detection.centroid_px.u, centre.u, kCentroid_px);
    EXPECT_NEAR(command.detection.centroid_px.v, centre.v, kCentroid_px);
  }
}

TEST(Tracker, AnEmptySkyIsReportedAsNoDetectionAndMovesNothing) {
  for (unsigned seed = 1; seed <= 20; ++seed) {
    Tracker tracker(TrackerSpec{}, kSide_px, kSide_px);
    const Command command = answer(tracker, bytes_of(dark_sky(seed), 5));
    EXPECT_EQ(command.kind, CommandKind::kReport);
    EXPECT_EQ(command.detection.confidence, 0.0F);
    EXPECT_EQ(command.trim_offset_rad, hil::TrimAngles{});
    EXPECT_EQ(command.trim_rate_rad_s, hil::TrimAngles{});
    EXPECT_EQ(command.answers_frame, 5U);
  }
}

TEST(Tracker, EvenFramesAreNoDetectionWhateverTheirLevel) {
  for (const int level : {0, 1, 1000, 2046, 2047, 65535}) {
    engine::DnImage image(kSide_px, kSide_px);
    for (std::uint16_t& dn : image.pixels()) dn = static_cast<std::uint16_t>(level);
    Tracker tracker(TrackerSpec{}, kSide_px, kSide_px);
    const Command command = answer(tracker, bytes_of(image));
    EXPECT_EQ(command.kind, CommandKind::kReport) << level;
    EXPECT_EQ(command.detection.confidence, 0.0F) << level;
  }
}

TEST(Tracker, OneHotPixelIsNoTarget) {
  for (const PixelPoint place : {PixelPoint{40, 50}, {0, 0}, {127, 127}, {0, 64}}) {
    engine::DnImage image = dark_sky();
    image.at(static_cast<int>(place.u), static_cast<int>(place.v)) = kWhite_dn;
    Tracker tracker(TrackerSpec{}, kSide_px, kSide_px);
    const Command command = answer(tracker, bytes_of(image));
    EXPECT_EQ(command.kind, CommandKind::kReport) << place.u;
    EXPECT_EQ(command.detection.confidence, 0.0F) << place.u;
  }
}

TEST(Tracker, AHotPixelFarFromTheTargetDoesNotPullItsCentroid) {
  engine::DnImage image = spot_at({40.3, 70.6});
  image.at(110, 10) = kWhite_dn;
  Tracker tracker(TrackerSpec{}, kSide_px, kSide_px);
  const Command command = answer(tracker, bytes_of(image));
  EXPECT_NEAR(command.detection.centroid_px.u, 40.3, kCentroid_px);
  EXPECT_NEAR(command.detection.centroid_px.v, 70.6, kCentroid_px);
}

TEST(Tracker, AsksForTheTrimThatPutsTheTargetOnTheBoresight) {
  const TrackerSpec spec;
  Tracker tracker(spec, kSide_px, kSide_px);
  // 10 px to the right and 6 up, while a trim of (3e-5, -1e-5) was on: that one, and 10 px and -6
  // px more. The boresight's place is the centre of pixel (64, 64).
  const hil::TrimAngles on{3e-5, -1e-5};
  const Command command =
      answer(tracker, bytes_of(spot_at({kCentre_px + 10.0, kCentre_px - 6.0}), 1, Duration{}, on));
  EXPECT_EQ(command.kind, CommandKind::kTrim);
  EXPECT_NEAR(command.trim_offset_rad[0], on[0] + 10.0 * spec.ifov_rad,
              kCentroid_px * spec.ifov_rad);
  EXPECT_NEAR(command.trim_offset_rad[1], on[1] - 6.0 * spec.ifov_rad,
              kCentroid_px * spec.ifov_rad);
  EXPECT_EQ(command.trim_rate_rad_s, hil::TrimAngles{});
  // One frame says where, at mid-exposure, and not how fast.
  EXPECT_EQ(command.reference, engine::sim_time(1000.0) + Duration(500'000));
}

TEST(Tracker, LearnsTheRateOfATargetThatMovesEvenly) {
  const TrackerSpec spec;
  constexpr double kPeriod_s = 0.1;
  constexpr double kRate_px = 0.8;  // a frame, to the right; half of that down
  Tracker tracker(spec, kSide_px, kSide_px);
  Command command;
  for (unsigned k = 0; k <= 60; ++k) {
    const PixelPoint place{30.0 + kRate_px * k, 40.0 + 0.5 * kRate_px * k};
    command = answer(tracker,
                     bytes_of(spot_at(place, 800, k + 1), k, engine::from_seconds(kPeriod_s * k)));
  }
  // An alpha-beta filter passes noise on to its rate with a gain of sqrt(2 beta^2 / (alpha (4 - 2
  // alpha - beta))) = 0.24 a period (alpha 0.5, beta 0.2; Kalata 1984), and its first surprise is
  // gone after 60 frames. Of 0.05 px of centroid that is 0.012 px a frame; five sigma.
  const double px_a_frame = spec.ifov_rad / kPeriod_s;
  EXPECT_NEAR(command.trim_rate_rad_s[0], kRate_px * px_a_frame, 0.06 * px_a_frame);
  EXPECT_NEAR(command.trim_rate_rad_s[1], 0.5 * kRate_px * px_a_frame, 0.06 * px_a_frame);
  // A ramp leaves an alpha-beta filter no lag.
  EXPECT_NEAR(command.trim_offset_rad[0], (30.0 + kRate_px * 60 - kCentre_px) * spec.ifov_rad,
              kCentroid_px * spec.ifov_rad);
}

TEST(Tracker, ATargetHeldStillByAMovingTrimIsJustAsFast) {
  const TrackerSpec spec;
  constexpr double kPeriod_s = 0.1;
  constexpr double kRate_rad_s = 50e-6;
  Tracker tracker(spec, kSide_px, kSide_px);
  Command command;
  for (unsigned k = 0; k <= 60; ++k) {
    command = answer(tracker,
                     bytes_of(spot_at({64, 64}, 800, k + 1), k, engine::from_seconds(kPeriod_s * k),
                              {kRate_rad_s * kPeriod_s * k, 0.0}));
  }
  EXPECT_NEAR(command.trim_rate_rad_s[0], kRate_rad_s, 0.06 * spec.ifov_rad / kPeriod_s);
  EXPECT_NEAR(command.trim_rate_rad_s[1], 0.0, 0.06 * spec.ifov_rad / kPeriod_s);
}

TEST(Tracker, GarbageIsCountedAndLeftAlone) {
  Tracker tracker(TrackerSpec{}, kSide_px, kSide_px);
  std::mt19937 random(3);
  std::uint64_t bad = 0;
  for (int i = 0; i < 1000; ++i) {
    std::vector<std::byte> bytes(random() % 400);
    for (std::byte& b : bytes) b = static_cast<std::byte>(random());
    EXPECT_FALSE(tracker.on_frame(bytes).has_value());
    EXPECT_EQ(tracker.bad_frames(), ++bad);
  }
  std::vector<std::byte> damaged = bytes_of(spot_at({64, 64}));
  damaged[5000] ^= std::byte{1};
  EXPECT_FALSE(tracker.on_frame(damaged).has_value());
  EXPECT_EQ(tracker.bad_frames(), ++bad);
  // It has not learnt anything from that, and a good frame is answered.
  const Command command = answer(tracker, bytes_of(spot_at({70, 64})));
  EXPECT_EQ(command.sequence, 0U);
  EXPECT_NEAR(command.detection.centroid_px.u, 70.0, kCentroid_px);
  EXPECT_EQ(tracker.bad_frames(), bad);
}

TEST(Tracker, AFrameOfAnotherSizeIsRefused) {
  Tracker tracker(TrackerSpec{}, kSide_px, kSide_px);
  std::uint64_t bad = 0;
  for (const auto& [width, height] : {std::pair{127, 128}, {128, 127}, {64, 256}, {1, 1}}) {
    const engine::DnImage image(width, height);
    EXPECT_FALSE(tracker.on_frame(bytes_of(image)).has_value());
    EXPECT_EQ(tracker.bad_frames(), ++bad);
  }
}

TEST(Tracker, SaturatedFramesAreAnsweredWithFiniteNumbers) {
  for (const double peak_dn : {3e3, 3e4, 3e6, 1e9}) {
    for (const PixelPoint centre : {PixelPoint{64, 64}, {0, 0}, {127, 64}}) {
      Tracker tracker(TrackerSpec{}, kSide_px, kSide_px);
      const Command command = answer(tracker, bytes_of(spot_at(centre, peak_dn)));
      EXPECT_TRUE(std::isfinite(command.detection.centroid_px.u));
      EXPECT_TRUE(std::isfinite(command.trim_offset_rad[0]));
    }
  }
  // Values that eleven bits cannot hold.
  engine::DnImage image = dark_sky();
  for (int v = 50; v < 80; ++v)
    for (int u = 50; u < 80; ++u) image.at(u, v) = 65535;
  Tracker tracker(TrackerSpec{}, kSide_px, kSide_px);
  EXPECT_TRUE(std::isfinite(answer(tracker, bytes_of(image)).detection.centroid_px.u));
}

TEST(Tracker, ARoundSpotThatSaturatesKeepsItsCentre) {
  // Clipped evenly all around: there is nothing to lose but its own light.
  Tracker tracker(TrackerSpec{}, kSide_px, kSide_px);
  const Command command = answer(tracker, bytes_of(spot_at({60.0, 70.0}, 2e4)));
  EXPECT_NEAR(command.detection.centroid_px.u, 60.0, kCentroid_px);
  EXPECT_NEAR(command.detection.centroid_px.v, 70.0, kCentroid_px);
}

TEST(Tracker, TwoFramesOfTheSameInstantDoNotMakeARateOfInfinity) {
  Tracker tracker(TrackerSpec{}, kSide_px, kSide_px);
  answer(tracker, bytes_of(spot_at({60, 60}), 0));
  for (const Duration later : {Duration{}, Duration(-1'000'000'000)}) {
    const Command command = answer(tracker, bytes_of(spot_at({70, 60}), 1, later));
    EXPECT_TRUE(std::isfinite(command.trim_rate_rad_s[0]));
    EXPECT_EQ(command.trim_rate_rad_s[0], 0.0);
  }
}

TEST(Tracker, ReportsOnlyMeansThatItAsksForNothing) {
  TrackerSpec spec;
  spec.reports_only = true;
  Tracker tracker(spec, kSide_px, kSide_px);
  for (unsigned k = 0; k < 5; ++k) {
    const Command command =
        answer(tracker, bytes_of(spot_at({50.0 + k, 60.0}), k, engine::from_seconds(0.1 * k)));
    EXPECT_EQ(command.kind, CommandKind::kReport);
    EXPECT_GT(command.detection.confidence, 0.0F);
    EXPECT_EQ(command.trim_offset_rad, hil::TrimAngles{});
  }
}

/// A sky like the Earth's, brighter by slope_dn with each pixel to the right, with its shot noise;
/// before it, a target 40 px long: three quarters send 20 DN, the last 900.
struct BrightScene {
  double sky_dn = 250;
  double slope_dn = 0;
  PixelPoint corner{40, 50};
  bool with_target = true;

  [[nodiscard]] engine::DnImage image(unsigned seed) const {
    engine::DnImage image(kSide_px, kSide_px);
    std::mt19937 random(seed);
    std::normal_distribution<double> noise(0.0, 1.0);
    for (int v = 0; v < kSide_px; ++v) {
      for (int u = 0; u < kSide_px; ++u) {
        const double sky = sky_dn + slope_dn * (u - kCentre_px);
        const double light = with_target ? (1.0 - cover(u, v)) * sky + own_light(u, v) : sky;
        const double dn = light + noise(random) * std::sqrt(0.1 + light / 14.65);
        image.at(u, v) = static_cast<std::uint16_t>(std::lround(std::max(0.0, dn)));
      }
    }
    return image;
  }
  /// Edges are a pixel and a half wide.
  [[nodiscard]] double cover(int u, int v) const { return part(u, v, 0.0, 40.0); }
  [[nodiscard]] double own_light(int u, int v) const {
    return 20.0 * part(u, v, 0.0, 30.0) + 900.0 * part(u, v, 30.0, 40.0);
  }
  [[nodiscard]] PixelPoint photocentre() const {
    const double weight = 20.0 * 30.0 + 900.0 * 10.0;
    return {corner.u + (20.0 * 30.0 * 15.0 + 900.0 * 10.0 * 35.0) / weight, corner.v + 10.0};
  }

 private:
  static double edge(double x) { return std::clamp(x / 1.5 + 0.5, 0.0, 1.0); }
  [[nodiscard]] double part(int u, int v, double from, double to) const {
    const double along = edge(u - corner.u - from) - edge(u - corner.u - to);
    return along * (edge(v - corner.v) - edge(v - corner.v - 20.0));
  }
};

TEST(Tracker, ATargetDarkerThanTheEarthBehindItIsFoundByItsOwnLight) {
  // Edges are good to a tenth of a pixel: of 120 px of them, 12 px of sky at 250 DN, a fiftieth of
  // the target's light, and all at one end, 20 px off: 0.3 px at the very worst.
  unsigned seed = 1;
  for (const double sky_dn : {60.0, 250.0, 500.0}) {
    for (const double slope_dn : {0.0, 0.1, -0.3}) {
      SCOPED_TRACE(std::to_string(sky_dn) + " " + std::to_string(slope_dn));
      const BrightScene scene{sky_dn, slope_dn, {40.0 + 0.3 * seed, 50.2}};
      Tracker tracker(TrackerSpec{}, kSide_px, kSide_px);
      const Command command = answer(tracker, bytes_of(scene.image(seed++)));
      EXPECT_EQ(command.kind, CommandKind::kTrim);
      EXPECT_NEAR(command.detection.centroid_px.u, scene.photocentre().u, 0.3);
      EXPECT_NEAR(command.detection.centroid_px.v, scene.photocentre().v, 0.3);
      EXPECT_NEAR(command.detection.box_px[0], scene.corner.u, 2.5);
      EXPECT_NEAR(command.detection.box_px[2], scene.corner.u + 40.0, 2.5);
    }
  }
}

TEST(Tracker, CountsTheCamerasBlackForNoLight) {
  // A pedestal under all of it changes nothing.
  const BrightScene scene;
  engine::DnImage raised = scene.image(1);
  for (std::uint16_t& dn : raised.pixels()) dn = static_cast<std::uint16_t>(dn + 100);
  TrackerSpec spec;
  Tracker plain(spec, kSide_px, kSide_px);
  spec.black_dn = 100;
  Tracker told(spec, kSide_px, kSide_px);
  const PixelPoint want = answer(plain, bytes_of(scene.image(1))).detection.centroid_px;
  const PixelPoint got = answer(told, bytes_of(raised)).detection.centroid_px;
  EXPECT_NEAR(got.u, want.u, 1e-4);  // a packet's single precision
  EXPECT_NEAR(got.v, want.v, 1e-4);
}

TEST(Tracker, ASkyThatGrowsBrighterIsNoDetection) {
  for (const double slope_dn : {0.0, 0.3, -1.0, 1.9}) {
    for (unsigned seed = 1; seed <= 5; ++seed) {
      BrightScene scene{.sky_dn = 250, .slope_dn = slope_dn};
      scene.with_target = false;
      Tracker tracker(TrackerSpec{}, kSide_px, kSide_px);
      EXPECT_EQ(answer(tracker, bytes_of(scene.image(seed))).detection.confidence, 0.0F)
          << slope_dn << " " << seed;
    }
  }
}

TEST(Tracker, ASharpLimbIsNoTargetAndHidesNone) {
  // The Earth without air: dark to the left of a line, bright to the right.
  for (const bool with_target : {false, true}) {
    for (const int limb_u : {85, 100}) {
      BrightScene scene{.sky_dn = 250, .slope_dn = 0, .corner = {10, 50}};
      scene.with_target = false;
      engine::DnImage image = scene.image(3);
      engine::DnImage dark = with_target ? spot_at({30.3, 60.6}) : dark_sky();
      for (int v = 0; v < kSide_px; ++v)
        for (int u = 0; u < limb_u; ++u) image.at(u, v) = dark.at(u, v);
      Tracker tracker(TrackerSpec{}, kSide_px, kSide_px);
      const Command command = answer(tracker, bytes_of(image));
      EXPECT_EQ(command.detection.confidence, with_target ? 1.0F : 0.0F) << limb_u;
      if (!with_target) continue;
      EXPECT_NEAR(command.detection.centroid_px.u, 30.3, kCentroid_px);
      EXPECT_NEAR(command.detection.centroid_px.v, 60.6, kCentroid_px);
    }
  }
}

TEST(Tracker, ALargerSpotFarFromWhereTheTargetIsExpectedIsLeftAlone) {
  Tracker tracker(TrackerSpec{}, kSide_px, kSide_px);
  for (unsigned k = 0; k < 5; ++k) {
    engine::DnImage image = spot_at({20.0 + k, 30.0}, 400, k + 1);
    if (k > 1) add_spot(image, {110.0, 100.0}, 1500);
    const Command command = answer(tracker, bytes_of(image, k, engine::from_seconds(0.1 * k)));
    EXPECT_NEAR(command.detection.centroid_px.u, 20.0 + k, 2.0 * kCentroid_px) << k;
  }
  // One that has never seen its target takes the larger one.
  engine::DnImage image = spot_at({20.0, 30.0}, 400);
  add_spot(image, {110.0, 100.0}, 1500);
  Tracker fresh(TrackerSpec{}, kSide_px, kSide_px);
  EXPECT_NEAR(answer(fresh, bytes_of(image)).detection.centroid_px.u, 110.0, kCentroid_px);
}

/// Before a sky of 250 DN a dark bar, a bright end to it, and at the other end a panel, a third of
/// the whole, that sends `panel_dn`: at 250 it cannot be seen. All of it moves and grows.
struct Pass {
  double panel_dn = 60;
  double scale = 1.0;
  PixelPoint centre{64, 64};

  [[nodiscard]] engine::DnImage image(unsigned seed) const {
    engine::DnImage image(kSide_px, kSide_px);
    std::mt19937 random(seed);
    std::normal_distribution<double> noise(0.0, 1.0);
    for (int v = 0; v < kSide_px; ++v) {
      for (int u = 0; u < kSide_px; ++u) {
        const double x = (u - centre.u) / scale;
        const double y = (v - centre.v) / scale;
        const double light = 250.0 + (panel_dn - 250.0) * part(x, y, -24.0, -8.0) -
                             230.0 * part(x, y, -8.0, 16.0) + 650.0 * part(x, y, 16.0, 24.0);
        const double dn = light + noise(random) * std::sqrt(0.1 + light / 14.65);
        image.at(u, v) = static_cast<std::uint16_t>(std::lround(std::max(0.0, dn)));
      }
    }
    return image;
  }

 private:
  /// Edges are a pixel and a half wide.
  [[nodiscard]] double edge(double x) const { return std::clamp(x * scale / 1.5 + 0.5, 0.0, 1.0); }
  [[nodiscard]] double part(double x, double y, double from, double to) const {
    return (edge(x - from) - edge(x - to)) * (edge(y + 10.0) - edge(y - 10.0));
  }
};

/// Flies 40 frames of a pass, a tenth of a second apart. Returns by how much the trims asked for
/// move away from those of the pass whose panel is never lost, at most, in pixels; `visit` may
/// change the pass frame by frame.
template <class Visit>
double largest_departure_px(const Visit& visit) {
  const TrackerSpec spec;
  Tracker tracker(spec, kSide_px, kSide_px);
  Tracker undisturbed(spec, kSide_px, kSide_px);
  double largest = 0;
  for (unsigned k = 0; k < 40; ++k) {
    Pass pass;
    pass.centre = {50.0 + 0.4 * k, 60.0 + 0.2 * k};
    const Duration after = engine::from_seconds(0.1 * k);
    const Command calm = answer(undisturbed, bytes_of(pass.image(k + 1), k, after));
    visit(k, pass);
    const Command got = answer(tracker, bytes_of(pass.image(k + 1), k, after));
    for (std::size_t i = 0; i < 2; ++i) {
      const auto at_now = [&](const Command& c) {
        const double dt_s = engine::seconds(engine::sim_time(1000.0005) + after - c.reference);
        return c.trim_offset_rad[i] + c.trim_rate_rad_s[i] * dt_s;
      };
      largest = std::max(largest, std::abs(at_now(got) - at_now(calm)) / spec.ifov_rad);
    }
  }
  return largest;
}

TEST(Tracker, APanelThatIsLostBeforeTheEarthForAFifthOfASecondDoesNotMoveTheCamera) {
  // Edges leave .3 px at worst in a place (see above), and a filter of alpha .8 and beta .5 makes
  // of that .57 times as much a frame in the rate (Kalata 1984): after two frames .64 px, and .3 px
  // in the pass beside it.
  const double largest = largest_departure_px([&](unsigned k, Pass& pass) {
    if (k == 20 || k == 21) pass.panel_dn = 250;
  });
  EXPECT_LT(largest, 0.95);
  Tracker tracker(TrackerSpec{}, kSide_px, kSide_px);
  PixelPoint seen;
  for (unsigned k = 0; k < 12; ++k) {
    Pass pass;
    if (k == 11) pass.panel_dn = 250;
    const Command command =
        answer(tracker, bytes_of(pass.image(k + 1), k, engine::from_seconds(0.1 * k)));
    // The frame is answered by what is seen, and marked.
    if (k == 11) {
      EXPECT_GT(std::abs(command.detection.centroid_px.u - seen.u), 2.0);
    }
    seen = command.detection.centroid_px;
    EXPECT_EQ(command.detection.confidence, k == 11 ? 0.5F : 1.0F) << k;
  }
}

TEST(Tracker, AShapeThatStaysIsTheTargetsWithinASecond) {
  Tracker tracker(TrackerSpec{}, kSide_px, kSide_px);
  unsigned first_believed = 0;
  for (unsigned k = 0; k < 40; ++k) {
    Pass pass;
    if (k >= 10) pass.panel_dn = 250;
    const Command command =
        answer(tracker, bytes_of(pass.image(k + 1), k, engine::from_seconds(0.1 * k)));
    const bool believed = command.detection.confidence == 1.0F;
    if (k <= 10) {
      EXPECT_EQ(believed, k < 10);
    }
    if (k >= 10 && believed && first_believed == 0) first_believed = k;
    if (first_believed != 0) {
      EXPECT_TRUE(believed) << k;
    }
  }
  // The last one before was frame 9.
  EXPECT_GT(first_believed, 11U);
  EXPECT_LE(first_believed, 9U + 11U);
}

TEST(Tracker, ATargetThatComesCloserIsFollowed) {
  // 4 % more area a frame, the paper's pass at its fastest, and 10 %; places at the scene's rate.
  for (const double growth : {1.02, 1.05}) {
    Tracker tracker(TrackerSpec{}, kSide_px, kSide_px);
    Pass pass;
    pass.scale = 0.5;
    for (unsigned k = 0; k < 18; ++k) {
      const Command command =
          answer(tracker, bytes_of(pass.image(k + 1), k, engine::from_seconds(0.1 * k)));
      EXPECT_EQ(command.detection.confidence, 1.0F) << growth << " " << k;
      pass.scale *= growth;
      pass.centre.u += 0.4;
    }
  }
}

TEST(Tracker, ATargetThatManoeuvresIsFollowedAtOnce) {
  // A jump of 12 px, and its whole shape with it.
  Tracker tracker(TrackerSpec{}, kSide_px, kSide_px);
  for (unsigned k = 0; k < 20; ++k) {
    Pass pass;
    pass.centre.u = k < 10 ? 56.0 : 68.0;
    const Command command =
        answer(tracker, bytes_of(pass.image(k + 1), k, engine::from_seconds(0.1 * k)));
    EXPECT_EQ(command.detection.confidence, 1.0F) << k;
  }
}

TEST(Tracker, ATargetThatWasLostIsBelievedWhenItIsBack) {
  // Gone for three seconds; back, it is nearer, and elsewhere.
  Tracker tracker(TrackerSpec{}, kSide_px, kSide_px);
  const Pass before;
  Pass after;
  after.scale = 1.3;
  after.centre = {70, 70};
  BrightScene empty;
  empty.with_target = false;
  for (unsigned k = 0; k < 60; ++k) {
    const engine::DnImage image = k < 10   ? before.image(k + 1)
                                  : k < 40 ? empty.image(k + 1)
                                           : after.image(k + 1);
    const Command command = answer(tracker, bytes_of(image, k, engine::from_seconds(0.1 * k)));
    EXPECT_EQ(command.detection.confidence, k >= 10 && k < 40 ? 0.0F : 1.0F) << k;
  }
}

}  // namespace
