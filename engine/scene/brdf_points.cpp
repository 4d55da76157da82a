#include "engine/scene/brdf_points.h"

#include <cmath>
#include <cstdio>

#include "engine/core/config_reader.h"
#include "engine/core/constants.h"
#include "engine/core/contract.h"
#include "engine/core/number_table.h"

namespace engine {
namespace {

using Eigen::Vector3d;

constexpr std::size_t kMostPoints = 1'000'000;
// A mirror of a quarter of an arc second has no more.
constexpr double kMost_per_sr = 1e9;

void need(const NumberTable& table, int line, const char* column, double value,
          const Range& range) {
  if (range.holds(value)) return;
  char got[40];
  std::snprintf(got, sizeof got, "%g", value);
  table.fail(line, std::string(column) + " must be " + range.text() + ", got " + got);
}

}  // namespace

void BrdfPoints::fail(int line, const std::string& complaint) const {
  throw ConfigError(path + ":" + std::to_string(line) + ": " + complaint);
}

Vector3d incident_direction(double theta_in_rad) noexcept {
  return {-std::sin(theta_in_rad), 0.0, std::cos(theta_in_rad)};
}

Vector3d scatter_direction(ScatterAngles angles, double first_rad, double second_rad) noexcept {
  if (angles == ScatterAngles::kPolar)
    return {std::sin(first_rad) * std::cos(second_rad), std::sin(first_rad) * std::sin(second_rad),
            std::cos(first_rad)};
  return {std::cos(second_rad) * std::sin(first_rad), std::sin(second_rad),
          std::cos(second_rad) * std::cos(first_rad)};
}

Vector3d incident_direction(const BrdfPoint& point) noexcept {
  return incident_direction(point.theta_in_deg * kDegree);
}

Vector3d scatter_direction(ScatterAngles angles, const BrdfPoint& point) noexcept {
  return scatter_direction(angles, point.first_deg * kDegree, point.second_deg * kDegree);
}

BrdfPoints read_brdf_points(const std::string& path) {
  const std::string planes = "theta_in_deg,in_plane_deg,out_of_plane_deg,brdf_per_sr";
  const std::string polar = "theta_in_deg,theta_out_deg,azimuth_deg,brdf_per_sr";
  const std::string sigma = ",sigma_per_sr";
  const NumberTable table =
      read_number_table(path, {planes, polar, planes + sigma, polar + sigma}, kMostPoints);
  BrdfPoints all;
  all.path = path;
  all.angles = table.form % 2 == 0 ? ScatterAngles::kPlanes : ScatterAngles::kPolar;
  all.have_sigma = table.form >= 2;
  all.points.reserve(table.rows.size());
  const bool in_planes = all.angles == ScatterAngles::kPlanes;
  for (const NumberTable::Row& row : table.rows) {
    BrdfPoint p{row.line, row.values[0], row.values[1], row.values[2], row.values[3]};
    need(table, row.line, "theta_in_deg", p.theta_in_deg, from_below(0.0, 90.0));
    if (in_planes) {
      need(table, row.line, "in_plane_deg", p.first_deg, between(-90.0, 90.0));
      need(table, row.line, "out_of_plane_deg", p.second_deg, between(-90.0, 90.0));
    } else {
      need(table, row.line, "theta_out_deg", p.first_deg, between(0.0, 90.0));
      need(table, row.line, "azimuth_deg", p.second_deg, between(-180.0, 360.0));
    }
    need(table, row.line, "brdf_per_sr", p.brdf_per_sr, between(0.0, kMost_per_sr));
    if (all.have_sigma) {
      p.sigma_per_sr = row.values[4];
      need(table, row.line, "sigma_per_sr", p.sigma_per_sr, positive());
    }
    all.points.push_back(p);
  }
  if (all.points.empty()) throw ConfigError(path + ": expected measured points, found none");
  return all;
}

}  // namespace engine
