#include "tools/starloop/budget_table.h"

#include <cmath>
#include <cstdio>
#include <stdexcept>

namespace starloop {
namespace {

std::string line_of(const char* pixel, const engine::PixelBudget& b) {
  const engine::PixelBudget::Noise& n = b.noise;
  char text[400];
  std::snprintf(text, sizeof text,
                "%s: %.4g W/m^2/sr = %.4g W/m^2 on the detector = %.5g photons = %.5g e- + %.3g "
                "dark = %.1f DN%s; noise, e- rms: %.3g photon, %.3g dark, %.3g read, %.3g "
                "quantiser, %.3g PRNU, %.3g DSNU, together %.4g\n",
                pixel, b.radiance_w_m2_sr, b.irradiance_w_m2, b.photons, b.light_e, b.dark_e,
                b.mean_dn, b.clipped ? " (clipped)" : "", n.photon_e, n.dark_e, n.read_e,
                n.quantiser_e, n.prnu_e, n.dsnu_e, n.total_e);
  return text;
}

}  // namespace

FrameBudget::FrameBudget(const Scenario& scenario, const engine::FieldLight& light)
    : brightest_px(light.brightest_px) {
  const auto of = [&](double irradiance_w_m2) {
    return engine::pixel_budget(irradiance_w_m2, scenario.run.exposure,
                                engine::throughput_sr(scenario.optics), scenario.detector);
  };
  brightest = of(light.brightest_w_m2);
  sky = of(light.sky_w_m2);
}

BudgetTable::BudgetTable(const std::filesystem::path& path) : path_(path), file_(path) {
  file_ << "frame,pixel,u_px,v_px,radiance_w_m2_sr,irradiance_w_m2,photons,light_e,dark_e,"
           "mean_dn,clipped,photon_noise_e,dark_noise_e,read_noise_e,quantiser_noise_e,"
           "prnu_e,dsnu_e,temporal_noise_e,total_noise_e\n";
  if (!file_) throw std::runtime_error(path_.string() + ": cannot be written");
}

void BudgetTable::add(std::uint64_t frame, const FrameBudget& budget) {
  const double nan = std::nan("");
  add_row(frame, "brightest", budget.brightest_px, budget.brightest);
  add_row(frame, "sky", {nan, nan}, budget.sky);
}

void BudgetTable::add_row(std::uint64_t frame, const char* pixel, const engine::PixelPoint& place,
                          const engine::PixelBudget& b) {
  const engine::PixelBudget::Noise& n = b.noise;
  file_ << frame << ',' << pixel;
  for (const double x :
       {place.u, place.v, b.radiance_w_m2_sr, b.irradiance_w_m2, b.photons, b.light_e, b.dark_e,
        b.mean_dn, b.clipped ? 1.0 : 0.0, n.photon_e, n.dark_e, n.read_e, n.quantiser_e, n.prnu_e,
        n.dsnu_e, n.temporal_e, n.total_e})
    file_ << ',' << x;
  file_ << '\n';
}

void BudgetTable::close() {
  file_.close();
  if (!file_) throw std::runtime_error(path_.string() + ": not written");
}

std::string text_of(const FrameBudget& budget) {
  char place[60];
  std::snprintf(place, sizeof place, "brightest pixel (%.0f, %.0f)", budget.brightest_px.u,
                budget.brightest_px.v);
  return line_of(place, budget.brightest) + line_of("sky", budget.sky);
}

}  // namespace starloop
