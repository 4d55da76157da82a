#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "engine/core/vec.h"

namespace engine {

/// How a direction of scatter is named: the two ways of BrdfPoints.
enum class ScatterAngles : std::uint8_t { kPlanes, kPolar };

struct BrdfPoint {
  int line = 0;  ///< in the file, from 1
  double theta_in_deg = 0;
  double first_deg = 0;   ///< in_plane or theta_out
  double second_deg = 0;  ///< out_of_plane or azimuth
  double brdf_per_sr = 0;
  double sigma_per_sr = 0;  ///< 0: the file does not say
};

/// Measured points of a BRDF, as a goniometer's file has them.
///
/// A CSV file whose first line names the columns, in one of these ways, with or without the last:
///   theta_in_deg,in_plane_deg,out_of_plane_deg,brdf_per_sr,sigma_per_sr
///   theta_in_deg,theta_out_deg,azimuth_deg,brdf_per_sr,sigma_per_sr
/// theta_in_deg is the angle of the incident light from the normal, 0 to below 90.
/// in_plane_deg turns from the normal within the plane of incidence, positive on the side of the
/// mirror direction, which is in_plane = theta_in; back to the source is in_plane = -theta_in.
/// out_of_plane_deg then leaves that plane, to either side. So the light leaves along
/// (cos o sin p, sin o, cos o cos p), x being forward and z the normal: one axis of a goniometer on
/// top of the other.
/// theta_out_deg is counted from the normal, azimuth_deg round it: 0 forward, on the side of the
/// mirror direction, 180 back (phi_s of ASTM E2387); -180 to 360.
/// sigma_per_sr is one standard deviation of brdf_per_sr.
struct BrdfPoints {
  std::string path;
  ScatterAngles angles = ScatterAngles::kPlanes;
  bool have_sigma = false;
  std::vector<BrdfPoint> points;

  /// Throws ConfigError: "path:line: complaint".
  [[noreturn]] void fail(int line, const std::string& complaint) const;
};

/// The direction that light comes from, for this angle of incidence: x is forward, the mirror's
/// side.
[[nodiscard]] Eigen::Vector3d incident_direction(double theta_in_rad) noexcept;
/// The direction that it leaves by.
[[nodiscard]] Eigen::Vector3d scatter_direction(ScatterAngles angles, double first_rad,
                                                double second_rad) noexcept;
[[nodiscard]] Eigen::Vector3d incident_direction(const BrdfPoint& point) noexcept;
[[nodiscard]] Eigen::Vector3d scatter_direction(ScatterAngles angles,
                                                const BrdfPoint& point) noexcept;

/// Throws ConfigError with path and line for angles out of range, values that are negative or above
/// 1e9 and sigmas that are not positive.
[[nodiscard]] BrdfPoints read_brdf_points(const std::string& path);

}  // namespace engine
