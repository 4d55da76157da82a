#include "tools/starloop/quality_ladders.h"

#include <algorithm>
#include <array>
#include <utility>

#include "tools/starloop/rig.h"
#include "tools/starloop/stage_images.h"

namespace starloop {
namespace {

constexpr std::array kSmear_px{0.0, 1.0, 2.0, 4.0, 8.0, 16.0};
constexpr std::array kDefocus_nm{0.0, 30.0, 60.0, 120.0, 200.0, 300.0};
constexpr std::array kNoiseTimes{1.0, 3.0, 10.0, 20.0, 40.0, 80.0, 160.0};
constexpr std::array kLightShare{1.0, 0.5, 0.2, 0.1, 0.05, 0.02};
constexpr int kDefocusTerm = 4;

void turn(engine::CameraAttitude& attitude, double rad) {
  attitude.axes.matrix =
      Eigen::AngleAxisd(rad, Eigen::Vector3d::UnitY()).toRotationMatrix() * attitude.axes.matrix;
}

/// What all ladders share: one scene, rendered for the widest optics, and the stages after it.
class Bench {
 public:
  Bench(const Scenario& scenario, const Scenario& widest, double time_s, int threads)
      : scenario_(scenario),
        camera_(scenario.scene.camera),
        rig_(scenario, threads),
        parts_(rig_.make_stages(widest)),
        optics_(optics_with(0.0)),
        shot_(rig_.predicted_shot(engine::sim_time(time_s), scenario.run.exposure)),
        meter_(camera_.width_px, camera_.height_px) {
    sharp_ = light_of(optics_, 0.0);
  }

  [[nodiscard]] engine::IrradianceImage smeared(double px) { return light_of(optics_, px); }
  [[nodiscard]] engine::IrradianceImage defocused(double nm) {
    engine::Optics optics = optics_with(nm * 1e-9);
    return light_of(optics, 0.0);
  }
  [[nodiscard]] const engine::IrradianceImage& sharp() const noexcept { return sharp_; }

  [[nodiscard]] QualityLadder::Step step(double value, const engine::IrradianceImage& light,
                                         double noise_times = 1.0, double light_share = 1.0) {
    engine::DetectorSpec spec = scenario_.detector;
    spec.read_noise_e *= noise_times;
    const engine::Detector detector(spec, rig_.pool(), sensor_maps(scenario_));
    const auto exposure =
        engine::from_seconds(light_share * engine::seconds(scenario_.run.exposure));
    engine::ElectronImage electrons(camera_.width_px, camera_.height_px);
    QualityLadder::Step step{value, {}, {}};
    step.frame.resize(camera_.width_px, camera_.height_px);
    detector.expose(light, exposure, scenario_.scene.seed, 0, electrons);
    detector.digitize(electrons, scenario_.scene.seed, 0, step.frame);
    step.quality = meter_.measure(step.frame, {spec.largest_dn(), spec.gain_e_dn()});
    return step;
  }

 private:
  [[nodiscard]] engine::Optics optics_with(double defocus_m) {
    engine::OpticsSpec spec = scenario_.optics;
    spec.lens.zernike_m[kDefocusTerm] += defocus_m;
    return {spec, faint_irradiance_w_m2(scenario_), rig_.pool()};
  }
  [[nodiscard]] engine::IrradianceImage light_of(engine::Optics& optics, double smear_px) {
    engine::Shot shot = shot_;
    const double half_rad = 0.5 * smear_px * camera_.ifov_rad();
    if (smear_px != 0.0) shot.attitude.known_between = false;
    turn(shot.attitude.open, -half_rad);
    turn(shot.attitude.close, half_rad);
    const engine::Snapshot snapshot = parts_.scene.build(shot);
    return projected(optics,
                     render_radiance(camera_, snapshot, parts_.optics.wish(), *parts_.renderer),
                     camera_);
  }

  const Scenario& scenario_;
  engine::CameraGeometry camera_;
  Rig rig_;
  Rig::Stages parts_;
  engine::Optics optics_;
  engine::Shot shot_;
  engine::IrradianceImage sharp_;
  quality::Meter meter_;
};

}  // namespace

std::string QualityLadder::frame_name(std::size_t step) const {
  std::string file = name + "_" + std::to_string(step) + ".png";
  std::ranges::replace(file, ' ', '_');
  return file;
}

std::vector<QualityLadder> quality_ladders(CommonOptions options, double time_s) {
  // A rig for stages needs no generator of its own.
  options.overrides.insert(options.overrides.end(), {"run.pattern=true", "stars.catalogue=none"});
  Scenario scenario = load_scenario(options);
  want_frames(scenario, engine::sim_time(time_s), engine::sim_time(time_s));
  const double own_nm = scenario.optics.lens.zernike_m[kDefocusTerm] * 1e9;
  options.overrides.push_back("optics.zernike_nm.z4=" +
                              std::to_string(own_nm + kDefocus_nm.back()));
  Scenario widest = load_scenario(options);
  want_frames(widest, engine::sim_time(time_s), engine::sim_time(time_s));
  Bench bench(scenario, widest, time_s, options.threads);

  std::vector<QualityLadder> ladders(4);
  ladders[0] = {"smear", "px", {}};
  for (const double px : kSmear_px) ladders[0].steps.push_back(bench.step(px, bench.smeared(px)));
  ladders[1] = {"defocus", "nm rms", {}};
  for (const double nm : kDefocus_nm)
    ladders[1].steps.push_back(bench.step(own_nm + nm, bench.defocused(nm)));
  ladders[2] = {"read noise", "e- rms", {}};
  for (const double times : kNoiseTimes)
    ladders[2].steps.push_back(
        bench.step(times * scenario.detector.read_noise_e, bench.sharp(), times));
  ladders[3] = {"light", "share", {}};
  for (const double share : kLightShare)
    ladders[3].steps.push_back(bench.step(share, bench.sharp(), 1.0, share));
  return ladders;
}

}  // namespace starloop
