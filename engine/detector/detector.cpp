#include "engine/detector/detector.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "engine/core/constants.h"
#include "engine/core/random.h"

namespace engine {

double DetectorSpec::electrons_per_irradiance(Duration exposure) const noexcept {
  const double photon_j = kPlanck_j_s * kSpeedOfLight_m_s / mean_wavelength_m;
  return pixel_pitch_m * pixel_pitch_m * seconds(exposure) * quantum_efficiency / photon_j;
}

double DetectorSpec::noise_e(double mean_e) const noexcept {
  const double gain = gain_e_dn();
  return std::sqrt(mean_e + read_noise_e * read_noise_e + gain * gain / 12.0);
}

DetectorSpec read_detector(const ConfigTable& table, double pixel_pitch_m,
                           double mean_wavelength_m) {
  DetectorSpec spec;
  spec.quantum_efficiency = table.number("quantum_efficiency", between(1e-6, 1.0));
  spec.full_well_e = table.number("full_well_e", positive());
  spec.read_noise_e = table.number("read_noise_e", at_least(0.0));
  spec.dark_e_s = table.number("dark_e_s", at_least(0.0));
  spec.bits = static_cast<int>(table.integer("bits", between(8, 16)));
  spec.pedestal_dn = table.number_or("pedestal_dn", 0.0, between(0.0, 65535.0));
  spec.quantiser = table.choice_or<Quantiser>(
      "quantiser", "floor", {{"floor", Quantiser::kFloor}, {"round", Quantiser::kRound}});
  spec.pixel_pitch_m = pixel_pitch_m;
  spec.mean_wavelength_m = mean_wavelength_m;
  return spec;
}

void Detector::expose(const IrradianceImage& in, Duration exposure, std::uint64_t seed,
                      std::uint64_t frame, ElectronImage& out) const noexcept {
  out.resize(in.width(), in.height());
  pool_.rows(0, in.height(), [&](int v) {
    expose_row(in.row(v), exposure, seed, frame, static_cast<std::uint32_t>(v * in.width()),
               out.row(v));
  });
}

void Detector::expose_row(std::span<const float> light, Duration exposure, std::uint64_t seed,
                          std::uint64_t frame, std::uint32_t first,
                          std::span<float> collected) const noexcept {
  const double to_e = spec_.electrons_per_irradiance(exposure);
  const double dark_e = spec_.dark_e_s * seconds(exposure);
  double mean_e = 0;
  double dark_share = 1;  // of pixels with this mean that collect nothing
  float last = 0;
  std::array<std::uint32_t, 4> words{};
  for (std::size_t u = 0; u < light.size(); ++u) {
    const std::uint32_t place = first + static_cast<std::uint32_t>(u);
    if (u == 0 || light[u] != last) {  // most of a sky is one value
      last = light[u];
      const double irradiance = static_cast<double>(light[u]);
      mean_e = (irradiance > 0.0 ? irradiance * to_e : 0.0) + dark_e;
      dark_share = std::exp(-mean_e);
    }
    // Four neighbours share a block: the first 32 bits of each pixel's uniform number. They settle
    // nearly every dark pixel; where they do not, the pixel draws the rest of its bits.
    if (u == 0 || place % 4 == 0) words = Draws(seed, Stream::kShot, frame, place / 4).block();
    const double low = words[place % 4] * 0x1p-32;
    collected[u] = 0.0F;
    if (low + 0x1p-32 <= dark_share) continue;
    Draws draws(seed, Stream::kShotDetail, frame, place);
    const double electrons =
        mean_e > 0.0 && mean_e < Draws::kInversionLimit
            ? Draws::poisson_from(low + draws.uniform_double() * 0x1p-32, mean_e)
            : draws.poisson(mean_e);
    collected[u] = static_cast<float>(std::min(electrons, spec_.full_well_e));
  }
}

void Detector::digitize(const ElectronImage& in, std::uint64_t seed, std::uint64_t frame,
                        DnImage& out) const noexcept {
  out.resize(in.width(), in.height());
  const auto read_noise_e = static_cast<float>(spec_.read_noise_e);
  const float furthest_e = read_noise_e * Draws::kLargestNormal;
  const auto dn_per_e = static_cast<float>(1.0 / spec_.gain_e_dn());
  const auto offset_dn =
      static_cast<float>(spec_.pedestal_dn + (spec_.quantiser == Quantiser::kRound ? 0.5 : 0.0));
  const auto largest_dn = static_cast<float>(spec_.largest_dn());
  pool_.rows(0, in.height(), [&](int v) {
    const auto electrons = in.row(v);
    const auto dn = out.row(v);
    const auto first = static_cast<std::uint32_t>(v * in.width());
    const auto quantise = [&](float e) {
      return std::clamp(std::floor(e * dn_per_e + offset_dn), 0.0F, largest_dn);
    };
    for (std::size_t u = 0; u < electrons.size(); ++u) {
      const float least = quantise(electrons[u] - furthest_e);
      dn[u] = static_cast<std::uint16_t>(least);
      // In a dark sky no draw of the read noise can reach the next DN: the same bits without it.
      if (least == quantise(electrons[u] + furthest_e)) continue;
      Draws draws(seed, Stream::kRead, frame, first + static_cast<std::uint32_t>(u));
      dn[u] = static_cast<std::uint16_t>(quantise(electrons[u] + read_noise_e * draws.normal()));
    }
  });
}

}  // namespace engine
