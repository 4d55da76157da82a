#include "engine/detector/detector_spec.h"

#include <cmath>

#include "engine/core/constants.h"

namespace engine {

double DetectorSpec::electrons_per_irradiance(Duration exposure) const noexcept {
  const double photon_j = kPlanck_j_s * kSpeedOfLight_m_s / mean_wavelength_m;
  return pixel_pitch_m * pixel_pitch_m * seconds(exposure) * quantum_efficiency / photon_j;
}

double DetectorSpec::dark_factor() const noexcept {
  return dark_doubling_c > 0.0 ? std::exp2((temperature_c - dark_reference_c) / dark_doubling_c)
                               : 1.0;
}

double DetectorSpec::dark_mean_e(Duration exposure) const noexcept {
  return (dark_rate_e_s() + background_e_s * binning * binning) * seconds(exposure);
}

double DetectorSpec::noise_e(double mean_e) const noexcept {
  const double gain = gain_e_dn();
  return std::sqrt(mean_e + read_noise_e * read_noise_e + gain * gain / 12.0);
}

namespace {

/// All three or none.
void read_temperature(const ConfigTable& table, DetectorSpec& spec) {
  if (!table.has("temperature_c") && !table.has("dark_reference_c") &&
      !table.has("dark_doubling_c"))
    return;
  const Range cold_to_hot = between(-273.15, 200.0);
  spec.temperature_c = table.number("temperature_c", cold_to_hot);
  spec.dark_reference_c = table.number("dark_reference_c", cold_to_hot);
  spec.dark_doubling_c = table.number("dark_doubling_c", between(1.0, 100.0));
}

/// Instead of a map that is drawn.
MapFile read_map_file(const ConfigTable& table, const std::string& key, const std::string& rms) {
  if (!table.has(key)) return {};
  if (table.has(rms)) table.fail(key, "cannot stand beside " + rms);
  MapFile file{table.text(key), table.where(key)};
  if (file.path.empty()) table.fail(key, "must be the path of a FITS file, got \"\"");
  return file;
}

void read_sensor(const ConfigTable& table, DetectorSpec& spec) {
  constexpr double kMostColumns = 4096;
  spec.sensor = static_cast<std::uint64_t>(table.integer_or("sensor", 1, at_least(0.0)));
  spec.prnu_rms = table.number_or("prnu_rms", 0.0, between(0.0, 1.0));
  spec.dsnu_rms = table.number_or("dsnu_rms", 0.0, between(0.0, 100.0));
  spec.prnu_map = read_map_file(table, "prnu_map", "prnu_rms");
  spec.dsnu_map = read_map_file(table, "dsnu_map", "dsnu_rms");
  spec.hot_pixels = table.number_or("hot_pixels", 0.0, between(0.0, 0.1));
  spec.hot_dark_e_s = table.number_or("hot_dark_e_s", spec.hot_dark_e_s, between(0.0, 1e9));
  spec.dead_pixels = table.number_or("dead_pixels", 0.0, between(0.0, 0.1));
  spec.hot_columns =
      static_cast<int>(table.integer_or("hot_columns", 0, between(0.0, kMostColumns)));
  spec.dead_columns =
      static_cast<int>(table.integer_or("dead_columns", 0, between(0.0, kMostColumns)));
  spec.columns_where = table.where(spec.dead_columns > 0 ? "dead_columns" : "hot_columns");
}

}  // namespace

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
  spec.background_e_s = table.number_or("background_e_s", 0.0, between(0.0, 1e9));
  read_temperature(table, spec);
  read_sensor(table, spec);
  spec.blooming = table.choice_or<Blooming>(
      "blooming", "none", {{"none", Blooming::kNone}, {"column", Blooming::kColumn}});
  spec.cosmic_rays_cm2_s = table.number_or("cosmic_rays_cm2_s", 0.0, between(0.0, 1e6));
  spec.epitaxial_um = table.number_or("epitaxial_um", spec.epitaxial_um, between(0.1, 1000.0));
  spec.pixel_pitch_m = pixel_pitch_m;
  spec.mean_wavelength_m = mean_wavelength_m;
  return spec;
}

}  // namespace engine
