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
#include "tools/starloop/file_names.h"
#include "tools/starloop/plot_script.h"
#include "tools/starloop/rig.h"
#include "tools/starloop/subcommands.h"

namespace starloop {
namespace {

constexpr int kRows = 400;       // a direction
constexpr int kPlaneSteps = 64;  // from zero to the cutoff: 129 x 129 frequencies

/// A table that is complete or an error.
class CsvFile {
 public:
  explicit CsvFile(const std::string& path) : path_(path), file_(path) { file_.precision(9); }
  [[nodiscard]] std::ofstream& rows() noexcept { return file_; }
  void close() {
    file_.close();
    if (!file_) throw std::runtime_error(path_ + ": cannot be written");
  }

 private:
  std::string path_;
  std::ofstream file_;
};

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

/// The same over the plane. The lens' terms are complex, where they are of coma.
void write_plane(const std::string& path, const engine::OpticsSpec& optics,
                 const engine::OtfCascade& cascade, const engine::OtfCascade::Focused& focused,
                 const engine::PixelPoint& smear_px) {
  const double cutoff = cascade.cutoff_per_px();
  const double lp_mm = 1e-3 / optics.camera.pixel_pitch_m;
  CsvFile csv(path);
  csv.rows() << "u_lp_mm,v_lp_mm,u_cycles_per_px,v_cycles_per_px,lens_re,lens_im,defocus_re,"
                "defocus_im,jitter,vibration,table,pixel,smear,product_re,product_im\n";
  for (int row = -kPlaneSteps; row <= kPlaneSteps; ++row) {
    for (int column = -kPlaneSteps; column <= kPlaneSteps; ++column) {
      const double u = cutoff * column / kPlaneSteps;
      const double v = cutoff * row / kPlaneSteps;
      csv.rows() << u * lp_mm << ',' << v * lp_mm << ',' << u << ',' << v;
      // Beyond the cutoff there is no product to be a term of.
      if (column * column + row * row > kPlaneSteps * kPlaneSteps) {
        csv.rows() << ",,,,,,,,,,0,0\n";
        continue;
      }
      const double smear = engine::sinc(u * smear_px.u + v * smear_px.v);
      const auto terms = cascade.terms(u, v, focused);
      for (std::size_t i = 0; i < terms.size(); ++i) {
        csv.rows() << ',' << terms[i].value.real();
        if (i < 2) csv.rows() << ',' << terms[i].value.imag();
      }
      const std::complex<double> whole = cascade.whole(u, v, focused) * smear;
      csv.rows() << ',' << smear << ',' << whole.real() << ',' << whole.imag() << '\n';
    }
  }
  csv.close();
}

/// Figure 13 of Li et al. 2023: the scenario's vibration, weaker and stronger, along its direction.
void write_amplitudes(const std::string& path, const engine::OpticsSpec& optics,
                      double cutoff_per_px) {
  CsvFile csv(path);
  csv.rows() << "amplitude_urad,amplitude_um,frequency_lp_mm,cycles_per_px,vibration\n";
  for (const double times : {0.25, 0.5, 1.0, 2.0}) {
    const double amplitude_rad = times * optics.vibration.amplitude_rad;
    const double amplitude_px = amplitude_rad / optics.camera.ifov_rad();
    const double pitch_um = optics.camera.pixel_pitch_m * 1e6;
    for (int i = 0; i <= kRows; ++i) {
      const double f = cutoff_per_px * i / kRows;
      csv.rows() << amplitude_rad * 1e6 << ',' << amplitude_px * pitch_um << ','
                 << f / pitch_um * 1e3 << ',' << f << ',' << engine::vibration_otf(f, amplitude_px)
                 << '\n';
    }
  }
  csv.close();
}

}  // namespace

int export_mtf(const CommonOptions& options, const MtfOptions& mtf) {
  Scenario scenario = load_scenario(options);
  const double time_s =
      mtf.time_s >= 0.0 ? mtf.time_s : engine::seconds(chosen_pass(scenario).closest);
  want_frames(scenario, engine::sim_time(time_s), engine::sim_time(time_s));
  scenario.run.pattern = true;  // no renderer is wanted, only where things are
  const Rig rig(scenario, 1);
  const engine::Snapshot snapshot =
      engine::SnapshotBuilder(scenario.scene, rig.camera(), rig.target())
          .build(rig.predicted_shot(engine::sim_time(time_s), scenario.run.exposure));
  const engine::OtfCascade cascade(scenario.optics);
  const double asked_m = scenario.optics.defocus_m(snapshot.range_m, snapshot.range_m);
  const double defocus_m = cascade.seen_defocus_m(asked_m);
  const auto focused = cascade.focused(defocus_m);

  CsvFile csv(mtf.out);
  csv.rows() << "direction_deg,frequency_lp_mm,cycles_per_px";
  for (const auto& term : cascade.terms(0.0, 0.0, focused)) csv.rows() << ',' << term.name;
  csv.rows() << ",smear,product_re,product_im\n";
  for (const double direction_deg : {0.0, 45.0, 90.0, 135.0})
    write_direction(csv.rows(), scenario.optics, cascade, focused, snapshot.smear_px,
                    direction_deg);
  csv.close();
  const std::string plane = beside(mtf.out, "_plane.csv");
  write_plane(plane, scenario.optics, cascade, focused, snapshot.smear_px);
  const std::string amplitudes = beside(mtf.out, "_vibration.csv");
  const bool vibrates = scenario.optics.vibration.amplitude_rad > 0.0;
  if (vibrates) write_amplitudes(amplitudes, scenario.optics, cascade.cutoff_per_px());
  const bool drawn = run_plot_script("mtf.py", mtf.out) && run_plot_script("mtf_plane.py", plane) &&
                     (!vibrates || run_plot_script("mtf_vibration.py", amplitudes, plane));
  if (options.quiet) return kGood;
  std::printf("%s: range %.3f km, defocus %.1f nm of path (%s), smear (%.3f, %.3f) px\n",
              mtf.out.c_str(), snapshot.range_m * 1e-3, asked_m * 1e9,
              defocus_m == 0.0 && asked_m != 0.0 ? "nobody sees it" : "in the product",
              snapshot.smear_px.u, snapshot.smear_px.v);
  const auto nyquist = cascade.whole(0.5, 0.0, focused) * engine::sinc(0.5 * snapshot.smear_px.u);
  std::printf("at Nyquist, %.2f lp/mm along u: %.4f; the lens passes %.2f lp/mm\n",
              0.5e-3 / scenario.optics.camera.pixel_pitch_m, nyquist.real(),
              1e-3 * cascade.lens().cutoff_per_m());
  std::printf("%s: the plane%s%s\n", plane.c_str(), vibrates ? "; amplitudes of vibration in " : "",
              vibrates ? amplitudes.c_str() : "");
  if (!drawn) std::printf("no picture: /usr/bin/python3 with matplotlib did not draw it\n");
  return kGood;
}

}  // namespace starloop
