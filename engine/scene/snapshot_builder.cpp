#include "engine/scene/snapshot_builder.h"

#include "engine/orbit/visibility.h"

namespace engine {
namespace {

// Far outside any detector, and finite: what lies behind the camera has no image.
constexpr PixelPoint kNowhere{-1e9, -1e9};

Lamp lamp_of(const Eigen::Vector3d& irradiance_w_m2, const Rotation<BodyFrame, J2000>& axes) {
  const double strength = irradiance_w_m2.norm();
  if (!(strength > 0.0)) return {};
  return {axes * direction_of<J2000>(irradiance_w_m2), strength};
}

}  // namespace

PixelPoint SnapshotBuilder::target_image(SimTime t, const CameraAttitude& attitude) const noexcept {
  const Epoch now = spec_.epoch + t.time_since_epoch();
  const SightLine line = sight_line(camera_, target_, now, spec_.light_path);
  return spec_.camera.project((attitude.axes * line.apparent).unit).value_or(kNowhere);
}

Rotation<BodyFrame, J2000> SnapshotBuilder::body_axes(const OrbitState& target) const noexcept {
  return body_offset(spec_.target_offsets) * orbital_frame(target);
}

void SnapshotBuilder::light_up(const SightLine& line, Snapshot& out) const noexcept {
  const Position<J2000> sun = sun_position(spec_.sun.model, line.emitted);
  const Eigen::Vector3d to_sun_m = sun.m - line.target.position.m;
  const Direction<J2000> to_sun = direction_of<J2000>(to_sun_m);
  const double irradiance = sun_irradiance_w_m2(spec_.sun, to_sun_m.norm());
  const Rotation<BodyFrame, J2000> axes = body_axes(line.target);

  const bool lit = shadow_margin_m(line.target.position, sun) > 0.0;
  out.sun = {axes * to_sun, lit ? irradiance : 0.0};
  out.phase_angle_rad = angle_between_rad(to_sun.unit, -line.toward_target.unit);
  switch (spec_.earth.earthshine) {
    case EarthshineModel::kNone:
      break;
    case EarthshineModel::kPaperLamp:
      out.earthshine =
          lamp_of(paper_earth_lamp(line.target.position, spec_.earth.albedo, irradiance), axes);
      break;
    case EarthshineModel::kVector:
      out.earthshine = lamp_of(
          earthshine_vector(line.target.position, to_sun, spec_.earth.albedo, irradiance), axes);
      break;
  }
}

Snapshot SnapshotBuilder::build(const Shot& shot) const noexcept {
  const SimTime middle = shot.shutter_open + shot.exposure / 2;
  const SightLine line =
      sight_line(camera_, target_, spec_.epoch + middle.time_since_epoch(), spec_.light_path);
  const Rotation<BodyFrame, J2000> axes = body_axes(line.target);

  Snapshot out;
  out.sequence = shot.sequence;
  out.seed = spec_.seed;
  out.shutter_open = shot.shutter_open;
  out.exposure = shot.exposure;
  out.camera = axes * Position<J2000>{line.camera.position.m - line.target.position.m};
  out.body_from_camera = axes * without_aberration(line) * shot.attitude.middle.axes.inverse();
  out.range_m = line.range_m;
  out.range_rate_m_s = line.range_rate_m_s;
  out.line_of_sight_rate_rad_s = line.rate_rad_s;

  out.target_px =
      spec_.camera.project((shot.attitude.middle.axes * line.apparent).unit).value_or(kNowhere);
  const PixelPoint at_open = target_image(shot.shutter_open, shot.attitude.open);
  const PixelPoint at_close = target_image(shot.shutter_open + shot.exposure, shot.attitude.close);
  out.smear_px = {at_close.u - at_open.u, at_close.v - at_open.v};

  out.sky = {shot.attitude, line.camera.position, {}};
  if (spec_.light_path == LightPath::kApparent)
    out.sky.velocity.m_s =
        line.camera.velocity.m_s + earth_velocity(spec_.epoch + middle.time_since_epoch()).m_s;
  out.background_w_m2_sr = spec_.sky_w_m2_sr;
  out.earth_behind = earth_is_behind(line.camera.position, line.target.position);
  out.roll_is_fallback = shot.attitude.middle.roll_is_fallback;
  light_up(line, out);
  return out;
}

}  // namespace engine
