#include "engine/scene/snapshot_builder.h"

#include <cmath>
#include <utility>

#include "engine/orbit/earth_rotation.h"
#include "engine/orbit/visibility.h"

namespace engine {
namespace {

// Far outside any detector, and finite: what lies behind the camera has no image.
constexpr PixelPoint kNowhere{-1e9, -1e9};
// Nobody sees that a motion is not even when it is so little off: the OTF at Nyquist by 2e-3.
constexpr double kEven_px = 0.02;

Lamp lamp_of(const Eigen::Vector3d& irradiance_w_m2, const Rotation<BodyFrame, J2000>& axes) {
  const double strength = irradiance_w_m2.norm();
  if (!(strength > 0.0)) return {};
  return {axes * direction_of<J2000>(irradiance_w_m2), strength};
}

}  // namespace

SnapshotBuilder::SnapshotBuilder(const SceneSpec& spec, const Propagator& camera,
                                 const Propagator& target, std::vector<Companion> companions,
                                 std::vector<ArticulatedPart> parts)
    : spec_(spec),
      camera_(camera),
      target_(target),
      companions_(std::move(companions)),
      parts_(std::move(parts)),
      attitude_(spec.target_attitude, spec.epoch) {
  ENSURE(companions_.size() <= kMostCompanions);
  ENSURE(parts_.size() <= kMostParts);
  for (const ArticulatedPart& part : parts_) {
    ENSURE(part.spec().owner <= companions_.size());
    ENSURE(part.spec().followed <= companions_.size());
  }
}

PixelPoint SnapshotBuilder::image_of(const Propagator& body, SimTime t,
                                     const CameraAttitude& attitude) const noexcept {
  const Epoch now = spec_.epoch + t.time_since_epoch();
  const SightLine line = sight_line(camera_, body, now, spec_.light_path);
  return spec_.camera.project((attitude.axes * line.apparent).unit).value_or(kNowhere);
}

void SnapshotBuilder::see(const Propagator& body, const SightLine& line, const BodyAxes& axes,
                          const Shot& shot, BodyView& out) const noexcept {
  const CameraAttitude& middle = shot.attitude.middle;
  out.camera = axes * Position<J2000>{line.camera.position.m - line.target.position.m};
  out.body_from_camera = axes * without_aberration(line) * middle.axes.inverse();
  out.range_m = line.range_m;
  const PixelPoint at_open = image_of(body, shot.shutter_open, shot.attitude.open);
  const PixelPoint at_close =
      image_of(body, shot.shutter_open + shot.exposure, shot.attitude.close);
  out.smear_px = {at_close.u - at_open.u, at_close.v - at_open.v};
  const Eigen::Vector3d apparent = (middle.axes * line.apparent).unit;
  const auto map = spec_.camera.map_near(apparent, out.smear_px, seconds(shot.exposure));
  // Where the camera sees nothing no renderer may draw either, whatever a pinhole would see.
  out.image_map =
      map.value_or(AffineMap{Eigen::Matrix2d::Identity(), Eigen::Vector2d(kNowhere.u, kNowhere.v)});
  out.target_px =
      map ? map->apply(spec_.camera.project_straight(apparent).value_or(kNowhere)) : kNowhere;
}

void SnapshotBuilder::follow(const Shot& shot, Snapshot& out) const noexcept {
  const AttitudeTrack& track = shot.attitude;
  if (!track.known_between) return;
  // Off the line from its first place to its last, by the place at mid-exposure.
  const auto trace = [](const auto& place_after, ImagePath& path) {
    constexpr int kSteps = ImagePath::kSteps;
    const PixelPoint first = place_after(0);
    const PixelPoint last = place_after(kSteps);
    const PixelPoint middle = place_after(kSteps / 2);
    ImageMotion even{{last.u - first.u, last.v - first.v}, {}};
    for (int i = 0; i <= kSteps; ++i) {
      const PixelPoint here = place_after(i);
      const PixelPoint off{here.u - middle.u - even.after(i).u,
                           here.v - middle.v - even.after(i).v};
      path.off_px[static_cast<std::size_t>(i)] = off;
      path.bends = path.bends || std::hypot(off.u, off.v) > kEven_px;
    }
  };
  trace(
      [&](int step) {
        return image_of(target_, shot.shutter_open + AttitudeTrack::time_of(step, shot.exposure),
                        track.after(step));
      },
      out.path);
  const Eigen::Vector3d star = track.middle.axes.matrix.row(2);
  trace(
      [&](int step) {
        return spec_.camera.project(track.after(step).axes.matrix * star).value_or(kNowhere);
      },
      out.boresight_path);
}

EarthshineChoice SnapshotBuilder::light_up(const SightLine& line, const BodyAxes& axes,
                                           const Position<J2000>& sun,
                                           BodyView& out) const noexcept {
  const Eigen::Vector3d to_sun_m = sun.m - line.target.position.m;
  const Direction<J2000> to_sun = direction_of<J2000>(to_sun_m);
  const double irradiance = sun_irradiance_w_m2(spec_.sun, to_sun_m.norm());

  const double lit = lit_fraction(spec_.shadow, line.target.position, sun);
  out.sun = {axes * to_sun, lit * irradiance};
  out.phase_angle_rad = angle_between_rad(to_sun.unit, -line.toward_target.unit);
  return light_by_earth(line, axes, sun, out);
}

template <class Frame>
EarthDisc<Frame> SnapshotBuilder::earth_from(const Position<J2000>& observer,
                                             const Rotation<Frame, J2000>& axes,
                                             const Position<J2000>& sun, Epoch now) const noexcept {
  EarthDisc<Frame> disc;
  disc.to_centre = axes * direction_of<J2000>(-observer.m);
  disc.to_sun = axes * direction_of<J2000>(sun.m);
  disc.north = axes * Direction<J2000>{Eigen::Vector3d::UnitZ()};  // of J2000: .1 deg of latitude
  disc.distance_radii = observer.m.norm() / kEarthRadius_m;
  disc.sun_irradiance_w_m2 = sun_irradiance_w_m2(spec_.sun, sun.m.norm());
  const AlbedoModel model = spec_.earth.albedo_model;
  disc.albedo =
      model == AlbedoModel::kEven ? ZonalAlbedo{{spec_.earth.albedo, 0, 0}} : zonal_albedo(now);
  disc.albedo_by_place = model == AlbedoModel::kMap;
  if (disc.albedo_by_place)
    disc.greenwich =
        axes * (earth_rotation(now).inverse() * Direction<EarthFixed>{Eigen::Vector3d::UnitX()});
  return disc;
}

EarthshineChoice SnapshotBuilder::light_by_earth(const SightLine& line, const BodyAxes& axes,
                                                 const Position<J2000>& sun,
                                                 BodyView& out) const noexcept {
  const EarthshineModel wanted = spec_.earth.earthshine;
  if (wanted == EarthshineModel::kPaperLamp) {
    const double irradiance =
        sun_irradiance_w_m2(spec_.sun, (sun.m - line.target.position.m).norm());
    out.earthshine =
        lamp_of(paper_earth_lamp(line.target.position, spec_.earth.albedo, irradiance), axes);
    return choose_earthshine(wanted, {}, spec_.earthshine_sensor);
  }
  EarthDisc<BodyFrame> disc = earth_from(line.target.position, axes, sun, line.emitted);
  EarthLight light(disc);
  EarthshineChoice choice = choose_earthshine(wanted, light, spec_.earthshine_sensor);
  if (!disc.albedo_by_place) choice.albedo = spec_.earth.albedo_model;
  if (choice.model == EarthshineModel::kNone) return choice;
  if (disc.albedo_by_place && choice.albedo != AlbedoModel::kMap) {
    disc.albedo_by_place = false;
    light = EarthLight(disc);
  }
  const Eigen::Vector3d& irradiance_w_m2 = light.vector_irradiance_w_m2();
  if (!light.dark())
    out.earthshine = {direction_of<BodyFrame>(irradiance_w_m2), irradiance_w_m2.norm()};
  if (choice.model != EarthshineModel::kVector) out.earth = light;
  return choice;
}

SnapshotBuilder::Placed SnapshotBuilder::place(std::size_t body, const Shot& shot) const noexcept {
  const Epoch middle = spec_.epoch + (shot.shutter_open + shot.exposure / 2).time_since_epoch();
  if (body == 0) {
    const SightLine line = sight_line(camera_, target_, middle, spec_.light_path);
    return {line, attitude_.axes(line.emitted, line.target)};
  }
  const Companion& companion = companions_[body - 1];
  const SightLine line = sight_line(camera_, companion.place, middle, spec_.light_path);
  return {line, companion.axes(line.emitted)};
}

void SnapshotBuilder::add_companions(const SightLine& line, const BodyAxes& axes,
                                     const Position<J2000>& sun, const Shot& shot,
                                     Snapshot& out) const noexcept {
  for (std::size_t i = 0; i < companions_.size(); ++i) {
    const Companion& companion = companions_[i];
    CompanionView& view = out.companion[out.companions++];
    const Placed own = place(i + 1, shot);
    see(companion.place, own.line, own.axes, shot, view);
    light_up(own.line, own.axes, sun, view);
    view.centre = axes * Position<J2000>{companion.place.at(line.emitted).position.m -
                                         line.target.position.m};
    view.from_target = own.axes * axes.inverse();
  }
}

Eigen::Vector3d SnapshotBuilder::toward_followed(const PartSpec& part, const Placed& owner,
                                                 const Snapshot& seen) noexcept {
  const BodyView& body =
      part.owner == 0 ? seen : static_cast<const BodyView&>(seen.companion[part.owner - 1]);
  switch (part.follows) {
    case PartFollows::kSun:
      return body.sun.toward.unit;
    case PartFollows::kEarth:
      return (owner.axes * Position<J2000>{-owner.line.target.position.m}).m - part.hinge_m;
    case PartFollows::kCamera:
      return body.camera.m - part.hinge_m;
    case PartFollows::kBody: {
      const auto centre = [&](std::size_t i) -> Eigen::Vector3d {
        return i == 0 ? Eigen::Vector3d::Zero() : seen.companion[i - 1].centre.m;
      };
      const Eigen::Vector3d way = centre(part.followed) - centre(part.owner);
      if (part.owner == 0) return way - part.hinge_m;
      return seen.companion[part.owner - 1].from_target.matrix * way - part.hinge_m;
    }
    case PartFollows::kNothing:
      break;
  }
  return Eigen::Vector3d::Zero();
}

void SnapshotBuilder::add_parts(const Position<J2000>& sun, const Shot& shot,
                                Snapshot& out) const noexcept {
  const Duration middle = (shot.shutter_open + shot.exposure / 2).time_since_epoch();
  for (const ArticulatedPart& part : parts_) {
    const PartSpec& spec = part.spec();
    const Placed owner = place(spec.owner, shot);
    const PartPose pose = part.pose(toward_followed(spec, owner, out), middle);
    const Rotation<BodyFrame, BodyFrame> turn{pose.from_owner};
    PartView& view = out.part[out.parts++];
    const Rotation<BodyFrame, BodyFrame> owner_from_target =
        spec.owner == 0 ? Rotation<BodyFrame, BodyFrame>{Eigen::Matrix3d::Identity()}
                        : out.companion[spec.owner - 1].from_target;
    const BodyView& body =
        spec.owner == 0 ? out : static_cast<const BodyView&>(out.companion[spec.owner - 1]);
    static_cast<BodyView&>(view) = body;
    view.camera = turn * Position<BodyFrame>{body.camera.m - spec.hinge_m};
    view.body_from_camera = turn * body.body_from_camera;
    light_up(owner.line, turn * owner.axes, sun, view);
    view.centre = owner_from_target.inverse() * Position<BodyFrame>{spec.hinge_m};
    if (spec.owner > 0) view.centre.m += out.companion[spec.owner - 1].centre.m;
    view.from_target = turn * owner_from_target;
    view.owner = spec.owner;
    view.angle_rad = pose.angle_rad;
    view.second_angle_rad = pose.second_angle_rad;
    view.at_limit = pose.at_limit;
  }
}

Snapshot SnapshotBuilder::build(const Shot& shot) const noexcept {
  const SimTime middle = shot.shutter_open + shot.exposure / 2;
  const auto [line, axes] = place(0, shot);
  const Position<J2000> sun = spec_.light_path == LightPath::kApparent
                                  ? apparent_sun_position(spec_.sun.model, line.emitted)
                                  : sun_position(spec_.sun.model, line.emitted);

  Snapshot out;
  out.sequence = shot.sequence;
  out.seed = spec_.seed;
  out.shutter_open = shot.shutter_open;
  out.exposure = shot.exposure;
  see(target_, line, axes, shot, out);
  follow(shot, out);
  out.range_rate_m_s = line.range_rate_m_s;
  out.line_of_sight_rate_rad_s = line.rate_rad_s;

  out.sky = {shot.attitude, line.camera.position, {}, seconds(shot.exposure)};
  if (spec_.light_path == LightPath::kApparent)
    out.sky.velocity.m_s =
        line.camera.velocity.m_s + earth_velocity(spec_.epoch + middle.time_since_epoch()).m_s;
  out.background_w_m2_sr = spec_.sky_w_m2_sr;
  out.earth_behind = earth_is_behind(line.camera.position, line.target.position);
  if (spec_.earth.in_frame) {
    const Rotation<CameraFrame, J2000> camera_axes =
        shot.attitude.middle.axes * without_aberration(line).inverse();
    out.earth_in_frame.disc = earth_from(line.camera.position, camera_axes, sun, line.emitted);
    out.earth_in_frame.air = spec_.earth.air;
  }
  out.roll_is_fallback = shot.attitude.middle.roll_is_fallback;
  out.attitude_is_fallback = attitude_.is_fallback(line.target);
  out.earthshine_rung = light_up(line, axes, sun, out);
  add_companions(line, axes, sun, shot, out);
  add_parts(sun, shot, out);
  return out;
}

}  // namespace engine
