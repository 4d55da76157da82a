#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <span>
#include <string>
#include <vector>

#include "engine/core/constants.h"
#include "engine/core/fits.h"
#include "tools/starloop/file_names.h"
#include "tools/starloop/plot_script.h"
#include "tools/starloop/rig.h"
#include "tools/starloop/stage_images.h"
#include "tools/starloop/subcommands.h"

namespace starloop {
namespace {

struct Stage {
  const char* letter;
  const char* text;
  bool vibrates;
  bool noisy;
};
constexpr std::array<Stage, 4> kStages{{{"a", "no vibration, no noise", false, false},
                                        {"b", "vibration", true, false},
                                        {"c", "photon noise", false, true},
                                        {"d", "vibration and photon noise", true, true}}};

/// Of the pixels that the target lights.
struct Figures {
  int lit_px = 0;
  int peak_dn = 0;
  double mean_dn = 0;
  double rms_off_dn = 0;  ///< from the first stage
};

engine::OpticsSpec without_vibration(engine::OpticsSpec spec) {
  spec.vibration = {};
  return spec;
}

/// No noise but the light's own, and pixels all alike.
engine::DetectorSpec photons_alone(engine::DetectorSpec spec) {
  spec.read_noise_e = 0;
  spec.dark_e_s = 0;
  spec.background_e_s = 0;
  spec.cosmic_rays_cm2_s = 0;
  spec.blooming = engine::Blooming::kNone;
  return spec;
}

/// What pixels collect on average.
engine::ElectronImage mean_electrons(const engine::IrradianceImage& light,
                                     const engine::DetectorSpec& detector,
                                     engine::Duration exposure) {
  engine::ElectronImage out(light.width(), light.height());
  const double e_per_w_m2 = detector.electrons_per_irradiance(exposure);
  std::ranges::transform(light.pixels(), out.pixels().begin(), [&](float w_m2) {
    return static_cast<float>(std::clamp(w_m2 * e_per_w_m2, 0.0, detector.full_well_e));
  });
  return out;
}

Figures figures_of(const engine::DnImage& frame, const engine::DnImage& first,
                   const std::vector<bool>& lit) {
  Figures figures;
  double square = 0;
  for (std::size_t i = 0; i < lit.size(); ++i) {
    if (!lit[i]) continue;
    const int dn = frame.pixels()[i];
    ++figures.lit_px;
    figures.peak_dn = std::max(figures.peak_dn, dn);
    figures.mean_dn += dn;
    square += std::pow(dn - first.pixels()[i], 2);
  }
  const int count = std::max(figures.lit_px, 1);
  figures.mean_dn /= count;
  figures.rms_off_dn = std::sqrt(square / count);
  return figures;
}

std::vector<engine::FitsCard> header_of(const Scenario& s, double time_s, const Stage& stage,
                                        const Figures& figures) {
  const engine::VibrationSpec& vibration = s.optics.vibration;
  return {
      {"ORIGIN", "Starloop", "program that made this frame"},
      {"SCENARIO", s.name, "scenario"},
      {"TIME", time_s, "[s] shutter opens, after the scenario's epoch"},
      {"EXPTIME", engine::seconds(s.run.exposure), "[s] exposure"},
      {"SEED", static_cast<long long>(s.scene.seed), "of all random numbers"},
      {"STAGE", std::string(stage.letter), "after figure 14 of Li et al. 2023"},
      {"SHOWS", std::string(stage.text), "besides light, lens, pixels and quantiser"},
      {"VIBRAT", stage.vibrates ? vibration.amplitude_rad * 1e6 : 0.0, "[urad] amplitude"},
      {"VIBDIR", vibration.direction_rad / engine::kDegree, "[deg] from u towards v"},
      {"BUNIT", "DN", "digital numbers"},
      {"GAIN", s.detector.gain_e_dn(), "[e-/DN]"},
      {"PEDESTAL", s.detector.pedestal_dn, "[DN]"},
      {"SATURATE", static_cast<long long>(s.detector.largest_dn()), "[DN] largest value"},
      {"LITPX", static_cast<long long>(figures.lit_px), "that the target gives 1 DN or more"},
      {"PEAK", static_cast<long long>(figures.peak_dn), "[DN] of these"},
      {"MEAN", figures.mean_dn, "[DN] of these"},
      {"RMSOFF", figures.rms_off_dn, "[DN] of these, from stage a"},
  };
}

/// Pixels where either image is a DN or more above the sky.
std::vector<bool> lit_in(const engine::ElectronImage& still, const engine::ElectronImage& shaken,
                         double sky_e, double gain_e_dn) {
  std::vector<bool> lit(still.pixels().size());
  for (std::size_t i = 0; i < lit.size(); ++i)
    lit[i] = std::max(still.pixels()[i], shaken.pixels()[i]) - sky_e >= gain_e_dn;
  return lit;
}

void say_what_is_missing(const Scenario& scenario) {
  if (!scenario.slow_vibration.lines.empty()) {
    std::fprintf(stderr,
                 "optics.vibration_urad has less than %g periods in an exposure: it is a path, and "
                 "in all four stages\n",
                 engine::VibrationSpec::kFewPeriods);
  } else if (scenario.optics.vibration.amplitude_rad == 0.0) {
    std::fprintf(stderr,
                 "the scenario has no vibration: (b) is as (a), and (d) as (c); "
                 "--set optics.vibration_urad=3 gives it some\n");
  }
  if (scenario.stars.source != engine::StarSpec::Source::kNone)
    std::fprintf(stderr, "the stages are without stars\n");
}

}  // namespace

int render_stages(const CommonOptions& options, const StagesOptions& stages) {
  Scenario scenario = load_scenario(options);
  say_what_is_missing(scenario);
  scenario.stars.source = engine::StarSpec::Source::kNone;
  scenario.render.settled = true;
  scenario.run.pattern = true;  // the rig needs no generator of its own
  want_frames(scenario, engine::sim_time(stages.time_s), engine::sim_time(stages.time_s));
  Rig rig(scenario, options.threads);
  Rig::Stages parts = rig.make_stages(scenario);
  engine::Optics still_optics(without_vibration(scenario.optics), faint_irradiance_w_m2(scenario),
                              rig.pool());
  const engine::DetectorSpec spec = photons_alone(scenario.detector);
  const engine::Detector detector(spec, rig.pool());
  const engine::Duration exposure = scenario.run.exposure;
  const engine::CameraGeometry& camera = scenario.scene.camera;

  const engine::Snapshot snapshot =
      parts.scene.build(rig.predicted_shot(engine::sim_time(stages.time_s), exposure));
  const engine::Radiance radiance =
      render_radiance(camera, snapshot, parts.optics.wish(), *parts.renderer);
  const engine::IrradianceImage still = projected(still_optics, radiance, camera);
  const engine::IrradianceImage shaken = projected(parts.optics, radiance, camera);
  const engine::ElectronImage still_e = mean_electrons(still, spec, exposure);
  const engine::ElectronImage shaken_e = mean_electrons(shaken, spec, exposure);
  const double sky_e = radiance.uniform_w_m2_sr * parts.optics.throughput_sr() *
                       spec.electrons_per_irradiance(exposure);
  const std::vector<bool> lit = lit_in(still_e, shaken_e, sky_e, spec.gain_e_dn());

  engine::DnImage first;
  engine::DnImage frame;
  engine::ElectronImage electrons;
  for (const Stage& stage : kStages) {
    if (stage.noisy) {
      detector.expose(stage.vibrates ? shaken : still, exposure, snapshot.seed, 0, electrons);
    } else {
      electrons = stage.vibrates ? shaken_e : still_e;
    }
    detector.digitize(electrons, snapshot.seed, 0, frame);
    if (&stage == kStages.data()) first = frame;
    const Figures figures = figures_of(frame, first, lit);
    const std::string fits = beside(stages.out, std::string("_") + stage.letter + ".fits");
    engine::write_fits(fits, frame, header_of(scenario, stages.time_s, stage, figures));
    if (!options.quiet)
      std::printf("%s: %s: peak %d DN, mean of %d lit px %.3f DN, rms off (a) %.3f DN\n",
                  fits.c_str(), stage.text, figures.peak_dn, figures.lit_px, figures.mean_dn,
                  figures.rms_off_dn);
  }
  const bool drawn = run_plot_script("stages.py", stages.out);
  if (!options.quiet)
    std::printf("%s: %s\n", stages.out.c_str(),
                drawn ? "the four of them"
                      : "no picture: /usr/bin/python3 with matplotlib did not draw it");
  return kGood;
}

}  // namespace starloop
