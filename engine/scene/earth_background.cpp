#include "engine/scene/earth_background.h"

#include <algorithm>
#include <cmath>

namespace engine {
namespace {

using Eigen::Vector3d;

// Above so many scale heights the air of the longest chord hides less than 1e-6.
constexpr double kHighest_scale_heights = 16.0;

/// max(c, 0) averaged over the Sun's disc, taken as a square: from night to day without a kink.
double cos_sun_of_disc(double cos_sun) noexcept {
  constexpr double kHalf = kSunAngularRadius_rad;
  if (cos_sun >= kHalf) return cos_sun;
  if (cos_sun <= -kHalf) return 0.0;
  return (cos_sun + kHalf) * (cos_sun + kHalf) / (4.0 * kHalf);
}

}  // namespace

void EarthBackground::reserve(const CameraGeometry& camera, int beyond_frame_px) {
  camera_ = camera;
  region_ = camera.frame().grown_by(beyond_frame_px);
  columns_ = (region_.width() - 1) / kBlock_px + 2;
  rows_ = (region_.height() - 1) / kBlock_px + 2;
  const auto nodes = static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_);
  light_.assign(nodes, 0.0F);
  passes_at_.assign(nodes, 0.0F);
  fine_.assign(nodes, 0);
  empty_ = true;
}

void EarthBackground::draw(const EarthInFrame& earth, double sky_w_m2_sr) noexcept {
  empty_ = true;
  const EarthDisc<CameraFrame>& disc = earth.disc;
  if (light_.empty() || !disc.seen()) return;
  const bool airless = !(earth.air.optical_depth > 0.0);
  const double scale_height = earth.air.scale_height_m / kEarthRadius_m;
  top_of_air_radii_ = airless ? 1.0 : 1.0 + kHighest_scale_heights * scale_height;
  const double reach = std::asin(std::min(1.0, top_of_air_radii_ / disc.distance_radii));
  const Vector3d c = disc.to_centre.unit;
  const double corner =
      std::atan((0.5 * std::hypot(columns_, rows_) + 1.0) * kBlock_px * camera_.ifov_rad());
  const double off_boresight = std::atan2(std::hypot(c.x(), c.y()), c.z());
  if (off_boresight > reach + corner) return;

  earth_ = earth;
  sky_w_m2_sr_ = sky_w_m2_sr;
  bool any = false;
  for (int j = 0; j < rows_; ++j) {
    for (int i = 0; i < columns_; ++i) {
      const Vector3d unit =
          camera_
              .direction_at({1.0 * region_.left + i * kBlock_px, 1.0 * region_.top + j * kBlock_px})
              .normalized();
      const double passes_at = disc.passes_at_radii(unit);
      light_[node(i, j)] = static_cast<float>(toward(unit, passes_at));
      passes_at_[node(i, j)] = static_cast<float>(std::min(passes_at, 1e9));
      any = any || passes_at < top_of_air_radii_;
    }
  }
  // Lengths across the line of sight at the limb, in radii.
  const double to_limb = std::sqrt(disc.distance_radii * disc.distance_radii - 1.0);
  const double pixel = to_limb * camera_.ifov_rad();
  sub_samples_ = airless || pixel > 0.5 * scale_height ? 3 : 1;
  // Smaller than a block the Earth may lie between the nodes.
  const bool small = 1.0 / disc.distance_radii < 4.0 * kBlock_px * camera_.ifov_rad();
  if (!any && !small) return;
  empty_ = false;
  // The second derivative of 1 - exp(-tau) by the height is .31 / H^2 at most.
  const double block = kBlock_px * pixel;
  find_fine_blocks(
      block, airless || block * block * 0.31 / 8.0 > kUnseenShare * scale_height * scale_height);
}

double EarthBackground::toward(const Vector3d& unit, double passes_at_radii) const noexcept {
  if (!(passes_at_radii < top_of_air_radii_)) return 0.0;
  const EarthDisc<CameraFrame>& disc = earth_.disc;
  const Vector3d vertical = disc.vertical_at(unit, passes_at_radii);
  const double light =
      cos_sun_of_disc(vertical.dot(disc.to_sun.unit)) * disc.zenith_radiance_w_m2_sr(vertical) -
      sky_w_m2_sr_;
  if (passes_at_radii < 1.0) return light;
  const double scale_height = earth_.air.scale_height_m / kEarthRadius_m;
  const double depth = earth_.air.optical_depth * std::sqrt(2.0 * kPi / scale_height) *
                       std::exp((1.0 - passes_at_radii) / scale_height);
  return -std::expm1(-depth) * light;
}

double EarthBackground::at(PixelPoint place) const noexcept {
  if (empty_) return 0.0;
  const Vector3d unit = camera_.direction_at(place).normalized();
  return toward(unit, earth_.disc.passes_at_radii(unit));
}

double EarthBackground::mean_over_pixel(int u, int v) const noexcept {
  if (sub_samples_ == 1) return at({1.0 * u, 1.0 * v});
  double sum = 0;
  for (int j = 0; j < sub_samples_; ++j)
    for (int i = 0; i < sub_samples_; ++i)
      sum += at({u + (i + 0.5) / sub_samples_ - 0.5, v + (j + 0.5) / sub_samples_ - 0.5});
  return sum / (sub_samples_ * sub_samples_);
}

/// Beside a node: an eighth of the second differences, of the inner nodes at the edges.
double EarthBackground::interpolation_error(int column, int row) const noexcept {
  const int i = std::clamp(column, 1, std::max(1, columns_ - 2));
  const int j = std::clamp(row, 1, std::max(1, rows_ - 2));
  double sum = 0;
  if (columns_ > 2) {
    const auto line = [&](int k) { return static_cast<double>(light_[node(k, row)]); };
    sum += std::abs(line(i - 1) - 2.0 * line(i) + line(i + 1));
  }
  if (rows_ > 2) {
    const auto line = [&](int k) { return static_cast<double>(light_[node(column, k)]); };
    sum += std::abs(line(j - 1) - 2.0 * line(j) + line(j + 1));
  }
  return sum / 8.0;
}

void EarthBackground::find_fine_blocks(double block_radii, bool thin_air) noexcept {
  const EarthDisc<CameraFrame>& disc = earth_.disc;
  const double dark = kDarkShare * disc.sun_irradiance_w_m2 / kPi * disc.largest_albedo();
  // How far the limb may bulge into a block whose corners it does not pass between.
  const double half_rad = 0.5 * std::hypot(kBlock_px, kBlock_px) * camera_.ifov_rad();
  const double bulge =
      disc.distance_radii * half_rad * std::min(1.0, half_rad * disc.distance_radii);
  const double top = (thin_air ? top_of_air_radii_ : 1.0) + bulge;
  // The ground's light ends at the limb as a square root does: too steep for differences there.
  const double bottom = 1.0 - bulge - block_radii;
  for (int j = 0; j + 1 < rows_; ++j) {
    for (int i = 0; i + 1 < columns_; ++i) {
      double error = 0;
      double most = 0;
      double nearest = HUGE_VAL;
      double furthest = 0;
      for (int corner = 0; corner < 4; ++corner) {
        const int di = corner % 2;
        const int dj = corner / 2;
        error = std::max(error, interpolation_error(i + di, j + dj));
        most = std::max(most, std::abs(static_cast<double>(light_[node(i + di, j + dj)])));
        const auto passes_at = static_cast<double>(passes_at_[node(i + di, j + dj)]);
        nearest = std::min(nearest, passes_at);
        furthest = std::max(furthest, passes_at);
      }
      const bool at_limb = nearest < top && furthest > bottom;
      fine_[node(i, j)] = at_limb || error > kUnseenShare * most + dark ? 1 : 0;
    }
  }
}

void EarthBackground::add_row(int v, int left, float scale, std::span<float> out) const noexcept {
  if (empty_) return;
  v = std::clamp(v, region_.top, region_.bottom - 1);
  const int right = left + static_cast<int>(out.size());
  for (int u = left; u < right;) {
    const int inside = std::clamp(u, region_.left, region_.right - 1);
    const int column = (inside - region_.left) / kBlock_px;
    int end = region_.left + (column + 1) * kBlock_px;
    if (u != inside) end = u < inside ? region_.left : right;
    end = std::min(end, right);
    if (u != inside) {
      float edge = 0.0F;
      add_block(v, inside, inside + 1, column, scale, &edge);
      for (int k = u; k < end; ++k) out[static_cast<std::size_t>(k - left)] += edge;
    } else {
      add_block(v, u, end, column, scale, &out[static_cast<std::size_t>(u - left)]);
    }
    u = end;
  }
}

/// Pixels [from, to) of row `v`, all in the block that begins at a column of nodes.
void EarthBackground::add_block(int v, int from, int to, int column, float scale,
                                float* out) const noexcept {
  const int row = (v - region_.top) / kBlock_px;
  if (fine_[node(column, row)] != 0) {
    for (int u = from; u < to; ++u)
      out[u - from] += scale * static_cast<float>(mean_over_pixel(u, v));
    return;
  }
  constexpr float kStep = 1.0F / kBlock_px;
  const float down = kStep * static_cast<float>(v - region_.top - row * kBlock_px);
  const auto between = [&](int k) {
    const float above = light_[node(k, row)];
    return scale * (above + down * (light_[node(k, row + 1)] - above));
  };
  const float first = between(column);
  const float step = kStep * (between(column + 1) - first);
  const int start = from - region_.left - column * kBlock_px;
  for (int u = 0; u < to - from; ++u) out[u] += first + step * static_cast<float>(start + u);
}

}  // namespace engine
