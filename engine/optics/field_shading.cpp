#include "engine/optics/field_shading.h"

#include <algorithm>
#include <cmath>

namespace engine {

FieldShading::FieldShading(const OpticsSpec& spec)
    : width_px_(spec.camera.width_px),
      height_px_(spec.camera.height_px),
      glare_(spec.veiling_glare),
      sums_(static_cast<std::size_t>(height_px_)) {
  if (spec.vignetting.none()) return;
  shares_.reserve(static_cast<std::size_t>(width_px_) * static_cast<std::size_t>(height_px_));
  const PixelPoint centre = spec.camera.principal_point();
  const double corner_px = spec.camera.sensor_half_diagonal_px();
  for (int v = 0; v < height_px_; ++v) {
    for (int u = 0; u < width_px_; ++u) {
      const double s = std::hypot(u - centre.u, v - centre.v) / corner_px;
      double share = spec.vignetting.polynomial(std::min(s * s, 1.0));
      if (spec.vignetting.cos4) {
        const auto direction = spec.camera.direction_at({1.0 * u, 1.0 * v});
        share /= std::pow(direction.squaredNorm(), 2);
      }
      shares_.push_back(static_cast<float>(share));
    }
  }
}

double FieldShading::at(PixelPoint place) const noexcept {
  if (!vignettes()) return 1.0;
  const auto nearest = [](double x, int count) {
    return static_cast<std::size_t>(std::clamp(std::round(x), 0.0, count - 1.0));
  };
  const std::size_t row = nearest(place.v, height_px_) * static_cast<std::size_t>(width_px_);
  return static_cast<double>(shares_[row + nearest(place.u, width_px_)]);
}

void FieldShading::vignette(int v, std::span<float> row) const noexcept {
  if (!vignettes()) return;
  const float* share = &shares_[static_cast<std::size_t>(v) * static_cast<std::size_t>(width_px_)];
  for (std::size_t i = 0; i < row.size(); ++i) row[i] *= share[i];
}

void FieldShading::vignette(IrradianceImage& image, WorkerPool& pool) const noexcept {
  if (!vignettes()) return;
  pool.rows(0, image.height(), [&](int v) { vignette(v, image.row(v)); });
}

double FieldShading::veil(IrradianceImage& image, WorkerPool& pool) noexcept {
  if (!(glare_ > 0.0)) return 0.0;
  pool.rows(0, image.height(), [&](int v) {
    double sum = 0;
    for (const float light : image.row(v)) sum += static_cast<double>(light);
    sums_[static_cast<std::size_t>(v)] = sum;
  });
  double all = 0;
  for (const double sum : sums_) all += sum;
  const auto even = static_cast<float>(glare_ * all / static_cast<double>(image.pixels().size()));
  const auto stays = static_cast<float>(1.0 - glare_);
  pool.rows(0, image.height(), [&](int v) {
    for (float& light : image.row(v)) light = stays * light + even;
  });
  return static_cast<double>(even);
}

}  // namespace engine
