#include "engine/optics/optics_spec.h"

#include <algorithm>
#include <cmath>

#include "engine/core/constants.h"
#include "engine/core/number_table.h"

namespace engine {
namespace {

constexpr int kSmallestWing_px = 8;
constexpr std::size_t kMostTableRows = 10000;

void read_focus(const ConfigTable& table, OpticsSpec& spec) {
  spec.focus = table.choice_or<Focus>(
      "focus", "target",
      {{"target", Focus::kTarget}, {"infinity", Focus::kInfinity}, {"distance", Focus::kDistance}});
  if (spec.focus == Focus::kDistance)
    spec.focus_range_m = table.number("focus_km", positive()) * 1e3;
}

void read_vignetting(const ConfigTable& table, VignettingSpec& spec) {
  constexpr int kSteps = 100;
  spec.cos4 = table.choice_or<bool>("vignetting", "none", {{"none", false}, {"cos4", true}});
  spec.r2 = table.number_or("vignetting_r2", 0.0, any_number());
  spec.r4 = table.number_or("vignetting_r4", 0.0, any_number());
  spec.r6 = table.number_or("vignetting_r6", 0.0, any_number());
  for (int i = 0; i <= kSteps; ++i) {
    const double s = static_cast<double>(i) / kSteps;
    const double share = spec.polynomial(s * s);
    if (share > 0.0 && share <= 2.0) continue;
    table.fail("vignetting_r2",
               "and the other terms must leave more than 0 and at most 2 of the "
               "light, not " +
                   std::to_string(share) + " at " + std::to_string(s) +
                   " of the way to the sensor's corners");
  }
}

/// As many cells to a pixel's side as carry what the lens passes, three at least; or as many as the
/// scenario says, whatever the lens passes.
void choose_grid(const ConfigTable& table, OpticsSpec& spec) {
  constexpr int kLeast = 3;
  constexpr int kMost = 8;
  const int given = table.choice_or<int>(
      "grid", "fine",
      {{"fine", 0}, {"paper-grid", 1}, {"2x2", 2}, {"3x3", 3}, {"4x4", 4}, {"6x6", 6}, {"8x8", 8}});
  if (given > 0) {
    spec.oversampling = given;
    return;
  }
  const CameraGeometry& camera = spec.camera;
  const double cutoff_per_m = spec.lens.aperture_m / (camera.focal_length_m * spec.lens.band_low_m);
  const double cells = std::ceil(2.0 * cutoff_per_m * camera.pixel_pitch_m);
  if (cells > kMost) {
    table.fail("aperture_m", "passes " + std::to_string(cutoff_per_m * 1e-3) +
                                 " lp/mm, more than the " +
                                 std::to_string(0.5e-3 * kMost / camera.pixel_pitch_m) +
                                 " that eight cells to a pixel can carry");
  }
  spec.oversampling = std::max(kLeast, static_cast<int>(cells));
}

}  // namespace

double MtfTable::at(double frequency_per_m) const noexcept {
  if (per_m.empty()) return 1.0;
  const double f = std::abs(frequency_per_m);
  const auto next = std::ranges::upper_bound(per_m, f);
  if (next == per_m.end()) return value.back();
  const auto i = static_cast<std::size_t>(next - per_m.begin());
  const double part = (f - per_m[i - 1]) / (per_m[i] - per_m[i - 1]);
  return (1.0 - part) * value[i - 1] + part * value[i];
}

MtfTable read_mtf_table(const std::string& path) {
  const NumberTable file = read_number_table(path, "frequency_lp_mm,mtf", kMostTableRows);
  MtfTable table;
  for (const auto& [line, v] : file.rows) {
    if (table.per_m.empty() && (v[0] != 0.0 || v[1] != 1.0))
      file.fail(line, "the first row must be 0,1: what does not vary is not blurred");
    if (!table.per_m.empty() && v[0] * 1e3 <= table.per_m.back())
      file.fail(line, "frequencies must grow from row to row");
    if (v[1] < -1.0 || v[1] > 1.0) file.fail(line, "an MTF must be in [-1, 1]");
    table.per_m.push_back(v[0] * 1e3);
    table.value.push_back(v[1]);
  }
  if (table.per_m.size() < 2) file.fail(1, "an MTF needs two rows at least");
  return table;
}

double OpticsSpec::defocus_m(double range_m, double target_range_m) const noexcept {
  return engine::defocus_m(lens, range_m, focus == Focus::kTarget ? target_range_m : focus_range_m);
}

OpticsSpec read_optics(const ConfigTable& table, const CameraGeometry& camera) {
  OpticsSpec spec;
  spec.camera = camera;
  spec.lens = read_lens(table, camera);
  spec.transmission = table.number("transmission", between(1e-6, 1.0));
  read_focus(table, spec);
  // Of more than this nothing is left to see, and the tables below would not hold its image.
  const double most_rad = 10.0 * camera.ifov_rad();
  const auto angle = [&](const std::string& key) {
    return 1e-6 * table.number_or(key, 0.0, between(0.0, most_rad * 1e6));
  };
  spec.jitter_rad = angle("jitter_urad");
  spec.vibration.amplitude_rad = angle("vibration_urad");
  spec.vibration.direction_rad =
      table.number_or("vibration_direction_deg", 0.0, any_number()) * kDegree;
  spec.vibration.frequency_hz = table.number_or("vibration_hz", 0.0, between(0.0, 1e6));
  if (table.has("mtf_file")) spec.mtf = read_mtf_table(table.text("mtf_file"));
  spec.largest_wing_px =
      static_cast<int>(table.integer_or("largest_wing_px", 256, between(kSmallestWing_px, 512)));
  read_vignetting(table, spec.vignetting);
  spec.veiling_glare = table.number_or("veiling_glare", 0.0, between(0.0, 0.5));
  choose_grid(table, spec);
  return spec;
}

double throughput_sr(const OpticsSpec& spec) noexcept {
  const double d_over_f = spec.lens.aperture_m / spec.lens.focal_length_m;
  return kPi / 4.0 * d_over_f * d_over_f * spec.transmission * spec.lens.open_share();
}

}  // namespace engine
