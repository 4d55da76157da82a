// Noise and numbers: where draws are not what they are to be, and where they are cut off.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <random>
#include <vector>

#include "drivers/pixel_packing.h"
#include "engine/core/random.h"
#include "engine/detector/detector.h"
#include "engine/detector/noise_lanes.h"
#include "tools/selftest/corner.h"
#include "tools/selftest/worst.h"

namespace corners {
namespace {

using engine::DetectorSpec;
using engine::Draws;
using engine::noise_lanes::Means;

/// Poisson electrons of a mean as the detector draws them.
std::vector<float> our_electrons(float mean_e, std::size_t count, std::uint64_t frame = 0) {
  Means means;
  means.e_per_w_m2 = 1.0F;
  means.full_well_e = 1e9F;
  means.brim_e = 1e9F;
  const std::vector<float> light(count, mean_e);
  std::vector<float> out(count);
  static_cast<void>(engine::noise_lanes::expose({7, frame, 0}, means, light, out));
  return out;
}

/// Knuth's method: uniform numbers are multiplied until the product is below exp(-mean).
int knuth(double mean, Draws& draws) {
  const double end = std::exp(-mean);
  int n = 0;
  for (double product = draws.uniform_double(); product > end; product *= draws.uniform_double())
    ++n;
  return n;
}

Corner large_means() {
  constexpr std::size_t kKnuth = 500;
  constexpr std::size_t kOurs = 65536;
  Worst plain;
  Worst ours;
  for (const double mean : {1e3, 1e4}) {
    double sum = 0;
    for (std::size_t i = 0; i < kKnuth; ++i) {
      Draws draws(7, engine::Stream::kCharts, 0, static_cast<std::uint32_t>(i));
      sum += knuth(mean, draws);
    }
    plain.add(std::abs(sum / kKnuth - mean) / std::sqrt(mean / kKnuth));
    double our_sum = 0;
    for (const float e : our_electrons(static_cast<float>(mean), kOurs))
      our_sum += static_cast<double>(e);
    ours.add(std::abs(our_sum / kOurs - mean) / std::sqrt(mean / kOurs));
  }
  return {"shot noise, 1000 e- and more",
          "Knuth's product",
          plain.value(),
          ours.value(),
          5,
          "sigma",
          "Mean of so many draws, off by how many of its own standard deviations: exp(-745) is the "
          "last that is not 0. The bound is five of them. Hormann 1993, DOI "
          "10.1016/0167-6687(93)90997-4."};
}

/// Half the sum of what each probability is off by; of means up to 60.
double total_variation(const std::vector<float>& electrons, double mean) {
  std::array<double, 128> share{};
  for (const float e : electrons)
    share[static_cast<std::size_t>(std::clamp(e, 0.0F, 127.0F))] +=
        1.0 / static_cast<double>(electrons.size());
  double sum = 0;
  for (std::size_t k = 0; k < share.size(); ++k) {
    const auto n = static_cast<double>(k);
    sum += std::abs(share[k] - std::exp(n * std::log(mean) - mean - std::lgamma(n + 1.0)));
  }
  return 0.5 * sum;
}

Corner small_means() {
  constexpr std::size_t kCount = 1 << 18;
  constexpr double kMean = 1.0;
  std::vector<float> plain(kCount);
  for (std::size_t i = 0; i < kCount; ++i) {
    Draws draws(7, engine::Stream::kCharts, 1, static_cast<std::uint32_t>(i));
    plain[i] = std::max(0.0F, std::round(static_cast<float>(kMean) +
                                         std::sqrt(static_cast<float>(kMean)) * draws.normal()));
  }
  // Sum over k of sqrt(p_k), of a mean of 1: 2.18.
  const double bound = 0.5 * 5.0 * 2.18 / std::sqrt(static_cast<double>(kCount));
  return {
      "shot noise, 1 e-",
      "Gaussian, rounded",
      total_variation(plain, kMean),
      total_variation(our_electrons(1.0F, kCount), kMean),
      bound,
      "",
      "Distance in variation to Poisson's distribution of 2^18 draws. The bound is five standard "
      "deviations of every count."};
}

Corner no_numbers() {
  std::vector<float> light(256, 100.0F);
  const float nan = std::numeric_limits<float>::quiet_NaN();
  for (std::size_t i = 0; i < light.size(); i += 4)
    light[i] = i % 8 == 0 ? nan : i % 12 == 0 ? -std::numeric_limits<float>::infinity() : -5.0F;
  Means means;
  means.e_per_w_m2 = 1.0F;
  means.full_well_e = means.brim_e = 1e9F;
  std::vector<float> out(light.size());
  static_cast<void>(engine::noise_lanes::expose({7, 0, 0}, means, light, out));
  const auto bad = [](float e) { return !(e >= 0.0F && e < 1e9F); };
  const auto plain = std::ranges::count_if(light, [&](float mean) {
    return bad(mean + 0.5F * std::sqrt(mean));  // half a sigma, whoever draws it
  });
  return {"light that is no number",
          "mean + sigma * normal",
          static_cast<double>(plain),
          static_cast<double>(std::ranges::count_if(out, bad)),
          0,
          "px",
          "Of 64 pixels whose light is negative or no number, those with electrons that are none. "
          "Ours are dark, and counted."};
}

double lag_correlation(const std::vector<double>& x) {
  double mean = 0;
  for (const double v : x) mean += v / static_cast<double>(x.size());
  double power = 0;
  double lagged = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    power += (x[i] - mean) * (x[i] - mean);
    if (i > 0) lagged += (x[i] - mean) * (x[i - 1] - mean);
  }
  return std::abs(lagged / power);
}

Corner seeds() {
  constexpr int kFrames = 20000;
  std::vector<double> plain;
  std::vector<double> ours;
  std::array<float, engine::noise_lanes::kTile> tile{};
  for (int k = 1; k <= kFrames; ++k) {
    std::minstd_rand generator(static_cast<unsigned>(k));
    plain.push_back(std::generate_canonical<double, 24>(generator));
    engine::noise_lanes::normals({7, static_cast<std::uint64_t>(k), 0}, engine::Stream::kRead,
                                 tile);
    ours.push_back(static_cast<double>(tile[0]));
  }
  return {"noise of frame after frame",
          "minstd, seed = frame",
          lag_correlation(plain),
          lag_correlation(ours),
          5.0 / std::sqrt(kFrames),
          "",
          "Correlation of one pixel with itself a frame later, 20000 frames. The bound is five "
          "standard deviations, 5 / sqrt(n). Salmon et al. 2011, DOI 10.1145/2063384.2063405."};
}

/// A detector without noise, of the paper's 11 bits.
DetectorSpec still() {
  DetectorSpec spec;
  spec.read_noise_e = 0;
  spec.dark_e_s = 0;
  return spec;
}

std::vector<double> our_dn(const DetectorSpec& spec, const std::vector<float>& electrons) {
  engine::WorkerPool pool(1);
  engine::ElectronImage in(static_cast<int>(electrons.size()), 1);
  std::copy(electrons.begin(), electrons.end(), in.pixels().begin());
  engine::DnImage out;
  engine::Detector(spec, pool).digitize(in, 3, 0, out);
  return {out.pixels().begin(), out.pixels().end()};
}

double deepest_fall(const std::vector<double>& dn) {
  double worst = 0;
  for (std::size_t i = 1; i < dn.size(); ++i) worst = std::max(worst, dn[i - 1] - dn[i]);
  return worst;
}

Corner full_well() {
  const DetectorSpec spec = still();
  std::vector<float> ramp(2048);
  for (std::size_t i = 0; i < ramp.size(); ++i) ramp[i] = 20.0F * static_cast<float>(i);
  std::vector<double> plain;
  for (const float e : ramp)
    plain.push_back(static_cast<int>(static_cast<double>(e) / spec.gain_e_dn()) & 2047);
  return {
      "full well and beyond",
      "DN times 2^11, 11 bits kept",
      deepest_fall(plain),
      deepest_fall(our_dn(spec, ramp)),
      0,
      "DN",
      "Deepest fall of the number along a ramp of light to 41 000 e-: a full well of 2^11 DN is "
      "none in 11 bits. More light is never less: the bound is 0."};
}

Corner rounding() {
  DetectorSpec spec = still();
  spec.quantiser = engine::Quantiser::kRound;
  spec.read_noise_e = 2;
  spec.pedestal_dn = 20;
  std::vector<float> ramp(65536);
  double plain = 0;
  double want = 0;
  const auto count = static_cast<double>(ramp.size());
  for (std::size_t i = 0; i < ramp.size(); ++i) {
    ramp[i] = 1000.0F + 0.2F * static_cast<float>(i);
    const double dn = static_cast<double>(ramp[i]) / spec.gain_e_dn();
    want += dn / count;
    plain += std::floor(dn) / count;
  }
  double ours = -spec.pedestal_dn;
  for (const double dn : our_dn(spec, ramp)) ours += dn / count;
  return {
      "quantiser",
      "cast to integer",
      std::abs(plain - want),
      std::abs(ours - want),
      5.0 * std::hypot(2.0 / spec.gain_e_dn(), std::sqrt(1.0 / 12.0)) / std::sqrt(count),
      "DN",
      "Mean over a ramp of 65536 pixels, less the ramp's own. Half a DN is 7 e-. The bound is "
      "five standard deviations of read noise and step. Janesick 2007, Photon Transfer, ch. 11."};
}

Corner dark_frame() {
  DetectorSpec spec = still();
  spec.bits = 14;
  spec.read_noise_e = 4;
  spec.quantiser = engine::Quantiser::kRound;
  const auto mean_e = [&](double pedestal_dn) {
    spec.pedestal_dn = pedestal_dn;
    double sum = 0;
    const std::vector<double> dn = our_dn(spec, std::vector<float>(65536, 0.0F));
    for (const double x : dn) sum += (x - pedestal_dn) / static_cast<double>(dn.size());
    return std::abs(sum) * spec.gain_e_dn();
  };
  const double plain = mean_e(0.0);
  return {
      "read noise in the dark, 14 bit",
      "no pedestal",
      plain,
      mean_e(20.0),
      5.0 * 4.1 / 256.0,
      "e-",
      "Mean of a dark frame: without a pedestal the ADC cuts the noise's lower half. The bound is "
      "five standard deviations of 65536 pixels with 4 e- of noise, step included. EMVA 1288 "
      "release 4, section 6.5."};
}

Corner odd_rows() {
  // 2049 pixels: every code, and one more.
  std::vector<std::uint16_t> codes(2049);
  for (std::size_t i = 0; i < codes.size(); ++i) codes[i] = static_cast<std::uint16_t>(i & 2047U);
  std::vector<std::byte> bytes(drivers::packed_bytes(codes.size()));
  drivers::pack_pixels(codes, bytes);
  std::vector<std::uint16_t> back(codes.size());
  drivers::unpack_pixels(bytes, back);
  Worst plain;
  Worst ours;
  for (std::size_t i = 0; i < codes.size(); ++i) {
    const auto top = static_cast<std::uint8_t>(codes[i] >> 3U);
    plain.add(std::abs((top << 3) - codes[i]));
    ours.add(std::abs(back[i] - codes[i]));
  }
  return {
      "11 bits in a stream of bytes",
      "the upper 8",
      plain.value(),
      ours.value(),
      0,
      "DN",
      "Each of 2048 codes out and back, in an odd number of pixels. What the camera said is what "
      "is read: the bound is 0."};
}

}  // namespace

Room detector_corners() {
  return {"Detector",
          {large_means(), small_means(), no_numbers(), seeds(), full_well(), rounding(),
           dark_frame(), odd_rows()}};
}

}  // namespace corners
