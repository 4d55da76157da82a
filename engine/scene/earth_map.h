#pragma once

#include <Eigen/Core>

#include "engine/scene/zonal_albedo.h"

namespace engine {

/// The share of sunlight that the Earth sends back, by place: sea, land, desert and ice under the
/// mean clouds of the latitude and season.
///
/// Of a kind of ground that sends back s of a clear day's light: s + q w (1 - s). Its cloud cover w
/// is .72 over the sea and .55 over land (King et al. 2013, DOI 10.1109/TGRS.2012.2227333), .2 over
/// deserts. How much light clouds send back, q, is what gives each parallel its zonal albedo: the
/// map shares the zone's light out and changes nothing of its mean. Where a zone has less than its
/// clear ground, there are no clouds and all its ground is darker by one factor. s, with the air:
/// sea .10, land .18, desert .32, round numbers of ours, and ice .66 (Kato & Loeb 2005, DOI
/// 10.1029/2004JD005308). Pack ice lifts the sea to .50 from 60 to 80 deg, snow the land to .45
/// from 40 to 70 deg. In annual sunlight the clear Earth sends back .152; measured is .157 (Loeb et
/// al. 2018, DOI 10.1175/JCLI-D-17-0208.1).
/// Cells of 2 x 2 deg under a quadratic B-spline: smooth, and nowhere are there cells to be seen.
/// Leaves out: the clouds of the day, the seasons of snow and ice but for those of the zone, colour
/// (plants are brighter beyond 700 nm, the sea at its blue end), the Sun's glint on the sea.
///
/// `place` is a unit vector in EarthFixed axes. In (0, 1). Loop-safe.
[[nodiscard]] double place_albedo(const ZonalAlbedo& zonal, const Eigen::Vector3d& place) noexcept;

/// No place has more; too much by .1 at most. Some 1 us.
[[nodiscard]] double largest_place_albedo(const ZonalAlbedo& zonal) noexcept;

/// What is left without clouds: s.
[[nodiscard]] double clear_place_albedo(const Eigen::Vector3d& place) noexcept;

}  // namespace engine
