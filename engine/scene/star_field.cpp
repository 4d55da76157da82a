#include "engine/scene/star_field.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include <Eigen/LU>

#include "engine/core/constants.h"
#include "engine/orbit/sight_line.h"

namespace engine {
namespace {

constexpr int kMostRounds = 60;      // in which the limit rises until all stars have room
constexpr double kLimitRises = 1.5;  // about half a magnitude

/// The angle by which one attitude is turned against another.
double turn_rad(const Eigen::Matrix3d& a, const Eigen::Matrix3d& b) noexcept {
  return std::acos(std::clamp(0.5 * ((a * b.transpose()).trace() - 1.0), -1.0, 1.0));
}

/// Whether the straight line of an image, so thick, can meet the frame.
bool meets(const CameraGeometry& camera, const PointSource& p, double reach_px) noexcept {
  const double across = 0.5 * std::abs(p.motion_px.u) + reach_px;
  const double down = 0.5 * std::abs(p.motion_px.v) + reach_px;
  return p.place.u + across > -0.5 && p.place.u - across < camera.width_px - 0.5 &&
         p.place.v + down > -0.5 && p.place.v - down < camera.height_px - 0.5;
}

bool in_frame(const CameraGeometry& camera, const PixelPoint& p) noexcept {
  return p.u >= -0.5 && p.u < camera.width_px - 0.5 && p.v >= -0.5 && p.v < camera.height_px - 0.5;
}

}  // namespace

/// What is the same for all stars of a frame.
struct StarField::Frame {
  const SkyView& sky;
  const StarLimits& limits;
  double faint_w_m2;
  Eigen::Vector3d boresight;
  double least_cosine;
  Eigen::Vector3d from_earth;  ///< unit
  double earth_sine;           ///< of half the Earth's angle
  bool at_rest;
  bool full = false;
  double least_drawn_w_m2 = std::numeric_limits<double>::infinity();
};

StarField::StarField(const StarCatalogue& catalogue, const CameraGeometry& camera,
                     const StarLight& light)
    : camera_(camera), first_(zones_.cells() + 1), stars_(catalogue.stars.size()) {
  const std::vector<CatalogueStar>& stars = catalogue.stars;
  std::vector<std::uint32_t> cell(stars.size());
  for (std::size_t i = 0; i < stars.size(); ++i) {
    cell[i] = static_cast<std::uint32_t>(zones_.index_of(stars[i].unit));
    ++first_[cell[i] + 1];
  }
  std::partial_sum(first_.begin(), first_.end(), first_.begin());
  std::vector<std::size_t> next(first_.begin(), first_.end() - 1);
  for (std::size_t i = 0; i < stars.size(); ++i) {
    const double irradiance = light.irradiance_w_m2(static_cast<double>(stars[i].v_magnitude),
                                                    static_cast<double>(stars[i].colour_b_v));
    stars_[next[cell[i]]++] = {stars[i].unit, static_cast<float>(irradiance), stars[i].v_magnitude};
  }
}

StarsFound StarField::find(const SkyView& sky, const StarLimits& limits,
                           std::vector<PointSource>& out) const noexcept {
  const std::size_t before = out.size();
  const AttitudeTrack& track = sky.attitude;
  const Eigen::Vector3d boresight = track.middle.axes.matrix.row(2);
  const double turned = std::max(turn_rad(track.open.axes.matrix, track.middle.axes.matrix),
                                 turn_rad(track.close.axes.matrix, track.middle.axes.matrix));
  const double tilt = 1.01 * sky.velocity.m_s.norm() / kSpeedOfLight_m_s;
  const double radius = std::min(camera_.half_diagonal_field_rad() +
                                     limits.largest_reach_px * camera_.ifov_rad() + turned + tilt,
                                 kPi);
  const double distance_m = sky.camera.m.norm();
  Frame frame{sky,
              limits,
              limits.faint_w_m2,
              boresight,
              std::cos(radius),
              distance_m > 0.0 ? Eigen::Vector3d(sky.camera.m / distance_m) : boresight,
              distance_m > 0.0 ? std::min(kEarthRadius_m / distance_m, 1.0) : 0.0,
              turned < 1e-3 * camera_.ifov_rad()};
  StarsFound found;
  for (int round = 0; round < kMostRounds; ++round) {
    out.resize(before);
    found = {};
    frame.full = false;
    frame.least_drawn_w_m2 = std::numeric_limits<double>::infinity();
    zones_.near(boresight, radius, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = first_[begin]; i < first_[end]; ++i)
        look_at(stars_[i], frame, found, out);
    });
    if (!frame.full) break;
    for (std::size_t i = before; i < out.size(); ++i)
      frame.least_drawn_w_m2 = std::min(frame.least_drawn_w_m2, out[i].irradiance_w_m2);
    frame.faint_w_m2 = kLimitRises * std::max(frame.faint_w_m2, frame.least_drawn_w_m2);
  }
  return found;
}

void StarField::look_at(const Star& star, Frame& frame, StarsFound& found,
                        std::vector<PointSource>& out) const noexcept {
  if (star.unit.dot(frame.boresight) < frame.least_cosine) return;
  const AttitudeTrack& track = frame.sky.attitude;
  const Eigen::Vector3d seen = aberrated(star.unit, frame.sky.velocity);
  const auto place = camera_.project(track.middle.axes.matrix * seen);
  if (!place) return;
  PointSource point{*place, static_cast<double>(star.irradiance_w_m2), {}};
  if (!frame.at_rest) {
    const auto open = camera_.project(track.open.axes.matrix * seen);
    const auto close = camera_.project(track.close.axes.matrix * seen);
    if (!open || !close) return;
    point.motion_px = {close->u - open->u, close->v - open->v};
  }
  if (!camera_.straight()) {
    const Eigen::Vector3d in_camera = track.middle.axes.matrix * seen;
    const auto map = camera_.map_near(in_camera, point.motion_px, frame.sky.exposure_s);
    if (!map) return;
    // What is stretched has the light of more pixels of an even field.
    point.place = map->apply(*camera_.project_straight(in_camera));
    point.irradiance_w_m2 *= map->slope.determinant();
  }
  const double reach_px = frame.limits.reach_px(point.irradiance_w_m2);
  if (!meets(camera_, point, reach_px)) return;
  ++found.near;
  const double down = star.unit.dot(frame.from_earth);
  if (down < 0.0 && star.unit.cross(frame.from_earth).norm() < frame.earth_sine) {
    ++found.behind_earth;
    return;
  }
  // A streak has no pixel that gets more than its light over its length.
  const double length_px = std::hypot(point.motion_px.u, point.motion_px.v);
  const double thinned = std::max(1.0, length_px * frame.limits.peak_share);
  const bool faint = point.irradiance_w_m2 <= frame.limits.faint_w_m2 * thinned;
  const bool wanted = !faint && point.irradiance_w_m2 > frame.faint_w_m2 * thinned;
  if (wanted && out.size() == out.capacity()) frame.full = true;
  if (!wanted || frame.full) {
    ++(faint ? found.faint : found.no_room);
    found.left_out_w_m2 += point.irradiance_w_m2;
    found.largest_left_out_w_m2 = std::max(found.largest_left_out_w_m2, point.irradiance_w_m2);
    return;
  }
  ++found.drawn;
  out.push_back(point);
  if (!in_frame(camera_, point.place)) return;
  ++found.in_frame;
  if (found.in_frame > 1 && point.irradiance_w_m2 <= found.brightest.irradiance_w_m2) return;
  found.brightest = point;
  found.brightest_v = static_cast<double>(star.v_magnitude);
}

}  // namespace engine
