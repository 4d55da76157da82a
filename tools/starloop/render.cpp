#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <string>

#include "engine/core/constants.h"
#include "engine/core/fits.h"
#include "engine/orbit/utc.h"
#include "tools/starloop/budget_table.h"
#include "tools/starloop/frame_sheet.h"
#include "tools/starloop/orbit_notes.h"
#include "tools/starloop/picture.h"
#include "tools/starloop/quality_files.h"
#include "tools/starloop/rig.h"
#include "tools/starloop/subcommands.h"

namespace starloop {
namespace {

std::string left_out(const engine::Rung& rung) {
  if (!std::isfinite(rung.error_e)) return "";
  char text[60];
  std::snprintf(text, sizeof text, "; leaves out %.2f e- of a pixel at most", rung.error_e);
  return text;
}

std::vector<engine::FitsCard> header_of(const Scenario& s, double time_s,
                                        const engine::FrameReport& r) {
  const engine::Epoch open = s.scene.epoch + engine::from_seconds(time_s);
  const engine::FrameTruth& t = r.truth;
  const engine::NoiseReached& noise = r.render.rho_mc;
  return {
      {"ORIGIN", "Starloop", "program that made this frame"},
      {"OBJECT", s.mesh.name, "target"},
      {"SCENARIO", s.name, "scenario"},
      {"DATE-OBS", engine::utc_text(open), "shutter opens, UTC"},
      {"TIME", time_s, "[s] shutter opens, after the scenario's epoch"},
      {"EXPTIME", engine::seconds(s.run.exposure), "[s] exposure"},
      {"SEED", static_cast<long long>(s.scene.seed), "of all random numbers"},
      {"BUNIT", "DN", "digital numbers"},
      {"GAIN", s.detector.gain_e_dn(), "[e-/DN]"},
      {"SATURATE", static_cast<long long>(s.detector.largest_dn()), "[DN] largest value"},
      {"RANGE", t.range_m, "[m] camera to target"},
      {"LOSRATE", t.line_of_sight_rate_rad_s, "[rad/s] of the line of sight"},
      {"PHASE", t.phase_angle_rad / engine::kDegree, "[deg] Sun, target, camera"},
      {"SUNIRR", t.sun_irradiance_w_m2, "[W/m2] 450-850 nm, at the target"},
      {"EARTHIRR", t.earthshine_w_m2, "[W/m2] vector irradiance of the Earth"},
      {"EARTHBG", static_cast<long long>(t.earth_behind), "1: the Earth is behind the target"},
      {"TARGETU", t.target_px.u, "[px] image of the target's centre, from 0"},
      {"TARGETV", t.target_px.v, "[px] image of the target's centre, from 0"},
      {"SMEAR", t.smear_px, "[px] over the exposure"},
      {"PEAKE", t.peak_e, "[e-] brightest pixel of the target, no noise"},
      {"SAMPLES", static_cast<long long>(r.render.samples_per_pixel), "per pixel"},
      // FITS has no number that is none.
      {"RHOMC", std::isfinite(noise.rms) ? noise.rms : -1.0,
       "rms noise of the rendering over the sensor's; -1: unknown"},
      {"BOUNCES", static_cast<long long>(r.render.bounces), "indirect"},
      {"WINGPX", static_cast<long long>(r.optics.wing_px),
       "[px] how far light's spread is followed"},
      {"DEFOCUS", r.optics.defocus_m, "[m] W20 of the target, of path; 0 when nobody sees it"},
      {"STARS", static_cast<long long>(r.stars.in_frame), "in the frame, bright enough to be seen"},
  };
}

/// What a person wants to know of it.
void tell(const std::string& fits, const std::string& png, const Scenario& scenario,
          const std::string& star_text, const engine::FrameReport& report) {
  const engine::FrameTruth& t = report.truth;
  std::printf("%s, %s: range %.3f km, phase %.1f deg, peak %.0f e- = %d DN%s\n", fits.c_str(),
              png.c_str(), t.range_m * 1e-3, t.phase_angle_rad / engine::kDegree, t.peak_e,
              report.peak_dn, t.sun_irradiance_w_m2 > 0.0 ? "" : ", in the Earth's shadow");
  for (std::size_t i = 0; i < t.companions; ++i) {
    const engine::CompanionTruth& c = t.companion[i];
    std::printf("%s: range %.3f km, centre at (%.2f, %.2f), %.0f %% in the frame%s\n",
                scenario.companions[i].name.c_str(), c.range_m * 1e-3, c.target_px.u, c.target_px.v,
                100.0 * c.visible_fraction,
                c.sun_irradiance_w_m2 > 0.0 ? "" : ", in the Earth's shadow");
  }
  const std::vector<std::string> parts = part_names(scenario);
  for (std::size_t i = 0; i < t.parts; ++i) {
    const engine::PartTruth& part = t.part[i];
    std::printf("%s: turned by %.2f deg", parts[i].c_str(), part.angle_rad / engine::kDegree);
    if (scenario.parts[i].second_axis)
      std::printf(" and %.2f deg", part.second_angle_rad / engine::kDegree);
    std::printf("%s\n", part.at_limit ? ", as far as its range lets it" : "");
  }
  const engine::NoiseReached& noise = report.render.rho_mc;
  if (std::isfinite(noise.rms))
    std::printf("rendering noise %.3f of the sensor's over %d lit pixels, at worst %.2f\n",
                noise.rms, noise.lit_px, noise.worst);
  if (scenario.run.render_time > engine::Duration{})
    std::printf("render.deadline_ms is for runs: this picture took the time it needed\n");
  for (const engine::Rung& rung : report.render.rungs)
    if (!rung.ladder.empty())
      std::printf("%s: %s%s\n", std::string(rung.ladder).c_str(), std::string(rung.taken).c_str(),
                  left_out(rung).c_str());
  const engine::OpticsReport& optics = report.optics;
  if (optics.wing_px > 0)
    std::printf(
        "optics: light followed for %d px, on the fine grid %d; %.2f %% of a point's beyond; "
        "the target %.0f nm of path out of focus\n",
        optics.wing_px, optics.core_px, 100.0 * optics.lost_flux_share, optics.defocus_m * 1e9);
  for (const hil::JitterLine& line : scenario.slow_vibration.lines)
    std::printf("vibration: %.2f periods to an exposure, so followed as a path\n",
                line.frequency_hz * engine::seconds(scenario.run.exposure));
  const engine::DetectorReport& detector = report.detector;
  std::printf(
      "detector: %d px over the full well, %d cosmic rays, %d px whose light was no number\n",
      detector.full_well_px, detector.cosmic_rays, detector.no_light_px);
  std::fputs(text_of(FrameBudget(scenario, report.light)).c_str(), stdout);
  if (!star_text.empty()) {
    const engine::StarReport& stars = report.stars;
    std::printf(
        "%s\n%d in the frame, the brightest V %.2f at (%.2f, %.2f), %.0f e-; %d behind the "
        "Earth; %d too faint, together %.0f e-, at most %.2f e- in a pixel\n",
        star_text.c_str(), stars.in_frame, stars.brightest_v, stars.brightest_px.u,
        stars.brightest_px.v, stars.brightest_e, stars.behind_earth, stars.faint, stars.left_out_e,
        stars.left_out_peak_e);
  }
}

/// "frame.fits" -> "frame_3.fits".
std::filesystem::path numbered(const std::filesystem::path& path, std::size_t number) {
  std::filesystem::path out = path;
  out.replace_filename(path.stem().string() + "_" + std::to_string(number) +
                       path.extension().string());
  return out;
}

std::string label_of(double time_s, const engine::FrameTruth& truth) {
  char text[80];
  std::snprintf(text, sizeof text, "%.2f s, %.1f km, %.0f deg", time_s, truth.range_m * 1e-3,
                truth.phase_angle_rad / engine::kDegree);
  return text;
}

}  // namespace

int render_frames(const CommonOptions& options, const RenderOptions& render) {
  Scenario scenario = load_scenario(options);
  // What a run gathers over its frames these have from the beginning.
  scenario.render.settled = true;
  const auto [first, last] = std::minmax_element(render.times_s.begin(), render.times_s.end());
  want_frames(scenario, engine::sim_time(*first), engine::sim_time(*last));
  const std::filesystem::path out(render.out);
  const std::string sheet_png = std::filesystem::path(out).replace_extension(".png").string();
  const bool several = render.times_s.size() > 1;
  FrameSheet sheet(render.tile_px);
  quality::Meter meter(scenario.scene.camera.width_px, scenario.scene.camera.height_px);
  const std::string budget_csv =
      std::filesystem::path(out).replace_extension("").string() + "_budget.csv";
  BudgetTable budgets(budget_csv);
  for (std::size_t i = 0; i < render.times_s.size(); ++i) {
    const double time_s = render.times_s[i];
    Rig rig(scenario, options.threads);
    const engine::Shot shot = rig.predicted_shot(engine::sim_time(time_s), scenario.run.exposure);
    engine::TruthMask mask;
    engine::DnImage frame(scenario.scene.camera.width_px, scenario.scene.camera.height_px);
    const engine::FrameReport report = rig.generator().expose(shot, engine::Budget{}, frame, mask);

    const std::filesystem::path fits = several ? numbered(out, i + 1) : out;
    const std::string png = std::filesystem::path(fits).replace_extension(".png").string();
    engine::write_fits(fits.string(), frame, header_of(scenario, time_s, report));
    write_png(png, frame, scenario.detector.bits);
    budgets.add(i, FrameBudget(scenario, report.light));
    sheet.add(frame, report.truth.target_px, label_of(time_s, report.truth));
    if (!options.quiet)
      for (const std::string& note : orbit_notes(scenario, shot.shutter_open))
        std::printf("%s\n", note.c_str());
    if (!options.quiet && i == 0)
      for (const std::string& note : rig.material_notes()) std::printf("%s\n", note.c_str());
    if (options.quiet) continue;
    tell(fits.string(), png, scenario, rig.star_text(), report);
    const engine::DetectorSpec& detector = scenario.detector;
    std::printf(
        "picture: %s\n",
        text_of(meter.measure(frame, {detector.largest_dn(), detector.gain_e_dn()})).c_str());
  }
  budgets.close();
  if (const std::string note = leap_second_note(scenario); !note.empty())
    std::fprintf(stderr, "%s\n", note.c_str());
  if (several) {
    sheet.write(sheet_png);
    if (!options.quiet) std::printf("%s: all of them\n", sheet_png.c_str());
  }
  return kGood;
}

}  // namespace starloop
