#include "tools/bench/pass_frames.h"

#include "drivers/usb_packet.h"

namespace bench {

using namespace engine;

namespace {

constexpr auto kFormat = drivers::PixelFormat::kPacked11;

starloop::Scenario flyby_without_generator(const std::vector<std::string>& overrides) {
  starloop::Scenario scenario = scenario_of("flyby", overrides);
  scenario.run.pattern = true;  // the rig's own generator is not used
  return scenario;
}

}  // namespace

PassFrames::PassFrames(double after_s, int frames, const std::vector<std::string>& overrides)
    : scenario_(flyby_without_generator(overrides)),
      after_s_(after_s),
      rig_(scenario_, 1),
      stages_(rig_.make_stages(scenario_)),
      detector_(scenario_.detector, rig_.pool(), sensor_maps(scenario_)) {
  const CameraGeometry& camera = scenario_.scene.camera;
  radiance_.earth.reserve(camera, stages_.optics.wish().beyond_frame_px);
  dn_.resize(camera.width_px, camera.height_px);
  bytes_.resize(drivers::kUsbHeaderBytes + drivers::kUsbNewsBytes +
                drivers::usb_payload_bytes(kFormat, camera.width_px, camera.height_px));
  for (int i = 0; i < frames; ++i) {
    shots_.push_back(shot_after(after_s + i * seconds(scenario_.run.period)));
    shots_.back().sequence = static_cast<std::uint64_t>(i);
  }
}

Shot PassFrames::shot_after(double after_s) const {
  return rig_.predicted_shot(sim_time(kClosest_s + after_s), scenario_.run.exposure);
}

void PassFrames::settle(int frames) {
  for (int k = frames; k > 0; --k) {
    snapshot_ = stages_.scene.build(shot_after(after_s_ - k * seconds(scenario_.run.period)));
    render();
  }
}

void PassFrames::geometry(int i) {
  taken_ = shot(i);
  snapshot_ = stages_.scene.build(taken_);
}

void PassFrames::render() {
  radiance_.earth.draw(snapshot_.earth_in_frame, snapshot_.background_w_m2_sr);
  rendered_ = stages_.renderer->render(snapshot_, Budget{}, radiance_);
  radiance_.range_m = snapshot_.range_m;
  radiance_.path = snapshot_.path;
}

void PassFrames::optics() {
  projected_ = stages_.optics.project(radiance_, irradiance_);
  stages_.optics.veil(irradiance_);
}

void PassFrames::detector() {
  detector_.expose(irradiance_, taken_.exposure, snapshot_.seed, taken_.sequence, electrons_);
  detector_.digitize(electrons_, snapshot_.seed, taken_.sequence, dn_);
}

void PassFrames::link() {
  hil::Frame frame;
  frame.sequence = taken_.sequence;
  frame.exposure = taken_.exposure;
  frame.pixels = &dn_;
  ENSURE(drivers::encode_usb_frame(frame, kFormat, bytes_));
}

}  // namespace bench
