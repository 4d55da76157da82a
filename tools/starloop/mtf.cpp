#include <cmath>
#include <complex>
#include <cstdio>
#include <fstream>
#include <stdexcept>
#include <string>

#include "engine/core/constants.h"
#include "engine/optics/mtf.h"
#include "engine/optics/otf_cascade.h"
#include "engine/scene/snapshot_builder.h"
#include "tools/starloop/plot_script.h"
#include "tools/starloop/subcommands.h"

namespace starloop {
namespace {

constexpr int kRows = 400;  // a direction

void write_direction(std::ofstream& csv, const engine::OpticsSpec& optics,
                     const engine::OtfCascade& cascade, const engine::OtfCascade::Focused& focused,
                     const engine::PixelPoint& smear_px, double direction_deg) {
  const double u = std::cos(direction_deg * engine::kDegree);
  const double v = std::sin(direction_deg * engine::kDegree);
  for (int i = 0; i <= kRows; ++i) {
    const double f = cascade.cutoff_per_px() * i / kRows;
    const double smear = engine::sinc(f * (u * smear_px.u + v * smear_px.v));
    const std::complex<double> whole = cascade.whole(f * u, f * v, focused) * smear;
    csv << direction_deg << ',' << f / optics.camera.pixel_pitch_m * 1e-3 << ',' << f;
    // Their signs are part of them; a complex one, of coma, has its modulus here.
    for (const auto& term : cascade.terms(f * u, f * v, focused))
      csv << ',' << (term.value.imag() == 0.0 ? term.value.real() : std::abs(term.value));
    csv << ',' << smear << ',' << whole.real() << ',' << whole.imag() << '\n';
  }
}

}  // namespace

int export_mtf(const CommonOptions& options, const MtfOptions& mtf) {
  Scenario scenario = load_scenario(options);
  const double time_s =
      mtf.time_s >= 0.0 ? mtf.time_s : engine::seconds(chosen_pass(scenario).closest);
  scenario.run.pattern = true;  // no renderer is wanted, only where things are
  const Rig rig(scenario, 1);
  const engine::Snapshot snapshot =
      engine::SnapshotBuilder(scenario.scene, rig.camera(), rig.target())
          .build(rig.predicted_shot(engine::sim_time(time_s), scenario.run.exposure));
  const engine::OtfCascade cascade(scenario.optics);
  const double asked_m = scenario.optics.defocus_m(snapshot.range_m, snapshot.range_m);
  const double defocus_m = cascade.seen_defocus_m(asked_m);
  const auto focused = cascade.focused(defocus_m);

  std::ofstream csv(mtf.out);
  csv.precision(9);
  csv << "direction_deg,frequency_lp_mm,cycles_per_px";
  for (const auto& term : cascade.terms(0.0, 0.0, focused)) csv << ',' << term.name;
  csv << ",smear,product_re,product_im\n";
  for (const double direction_deg : {0.0, 45.0, 90.0, 135.0})
    write_direction(csv, scenario.optics, cascade, focused, snapshot.smear_px, direction_deg);
  csv.close();
  if (!csv) throw std::runtime_error(mtf.out + ": cannot be written");
  const bool drawn = run_plot_script("mtf.py", mtf.out);
  if (options.quiet) return kGood;
  std::printf("%s: range %.3f km, defocus %.1f nm of path (%s), smear (%.3f, %.3f) px\n",
              mtf.out.c_str(), snapshot.range_m * 1e-3, asked_m * 1e9,
              defocus_m == 0.0 && asked_m != 0.0 ? "nobody sees it" : "in the product",
              snapshot.smear_px.u, snapshot.smear_px.v);
  const auto nyquist = cascade.whole(0.5, 0.0, focused) * engine::sinc(0.5 * snapshot.smear_px.u);
  std::printf("at Nyquist, %.2f lp/mm along u: %.4f; the lens passes %.2f lp/mm\n",
              0.5e-3 / scenario.optics.camera.pixel_pitch_m, nyquist.real(),
              1e-3 * cascade.lens().cutoff_per_m());
  if (!drawn) std::printf("no picture: /usr/bin/python3 with matplotlib did not draw it\n");
  return kGood;
}

}  // namespace starloop
