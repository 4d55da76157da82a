#include "engine/render/texel_grid.h"

#include <cmath>

namespace engine {
namespace {

using Eigen::Vector3f;

constexpr std::size_t kManyTexels = std::size_t{1} << 21U;
constexpr float kMostSteps = 4096.0F;

std::uint16_t steps_along(float edge_m, float texel_m) noexcept {
  const float steps = std::ceil(edge_m / texel_m);
  // An edge that is no number has one step.
  return steps > 1.0F ? static_cast<std::uint16_t>(std::min(steps, kMostSteps)) : std::uint16_t{1};
}

}  // namespace

TexelGrid::TexelGrid(const TracedTarget& target)
    : target_(target),
      sides_(2 * target.mesh.triangles.size()),
      most_texels_(std::max(kManyTexels, sides_.size())) {
  frames_.reserve(target.mesh.triangles.size());
  for (std::uint32_t f = 0; f < target.mesh.triangles.size(); ++f) {
    const std::array<Vector3f, 3> corner = {target.facets.on_side(f, 0, 0, 0).place,
                                            target.facets.on_side(f, 1, 0, 0).place,
                                            target.facets.on_side(f, 0, 1, 0).place};
    Frame frame;
    for (std::uint8_t top = 0; top < 3; ++top) {
      const Vector3f& start = corner[(top + 1U) % 3U];
      const Vector3f edge = corner[(top + 2U) % 3U] - start;
      const float edge_m = edge.norm();
      if (!(edge_m > frame.edge_m)) continue;
      const Vector3f up = corner[top] - start;
      const float foot_m = up.dot(edge) / edge_m;
      frame = {top, foot_m / edge_m, edge_m, (up - foot_m / edge_m * edge).norm()};
    }
    frames_.push_back(frame);
  }
}

float TexelGrid::cut(float texel_m) noexcept {
  constexpr float kCoarser = 1.4142F;
  constexpr int kMostTries = 64;
  std::uint64_t number = number_through(texel_m);
  for (int t = 0; number > most_texels_ && t < kMostTries; ++t)
    number = number_through(texel_m *= kCoarser);
  texels_ = static_cast<std::uint32_t>(number);
  return texel_m;
}

std::uint64_t TexelGrid::number_through(float texel_m) noexcept {
  std::uint64_t number = 0;
  for (std::size_t f = 0; f < frames_.size(); ++f) {
    const std::uint16_t along = steps_along(frames_[f].edge_m, texel_m);
    const std::uint16_t up = steps_along(frames_[f].height_m, texel_m);
    for (std::size_t side = 0; side < 2; ++side) {
      sides_[2 * f + side] = {static_cast<std::uint32_t>(number), along, up};
      number += std::uint64_t{along} * up;
    }
  }
  return number;
}

TexelGrid::Texel TexelGrid::texel(std::uint32_t number) const noexcept {
  const auto after =
      std::upper_bound(sides_.begin(), sides_.end(), number,
                       [](std::uint32_t value, const Side& side) { return value < side.first; });
  const auto index = static_cast<std::uint32_t>(after - sides_.begin() - 1);
  const Side& s = sides_[index];
  const std::uint32_t inside = number - s.first;
  const std::array<float, 2> span = {1.0F / static_cast<float>(s.along),
                                     1.0F / static_cast<float>(s.up)};
  const std::uint32_t along = inside / s.up;
  const std::uint32_t up = inside % s.up;
  return {index / 2,
          index % 2,
          {static_cast<float>(along) * span[0], static_cast<float>(up) * span[1]},
          span};
}

SurfacePoint TexelGrid::place(const Texel& texel, float a, float b) const noexcept {
  const auto [second, third] = frames_[texel.facet].weights(texel.low[0] + a * texel.span[0],
                                                            texel.low[1] + b * texel.span[1]);
  return target_.facets.on_side(texel.facet, second, third, texel.side);
}

std::array<float, 2> TexelGrid::Frame::weights(float along, float up) const noexcept {
  // How high the facet is there.
  const float beside = along < foot ? along / foot : (1.0F - along) / (1.0F - foot);
  std::array<float, 3> weight{};
  weight[top] = std::clamp(std::min(up, beside), 0.0F, 1.0F);
  weight[(top + 2U) % 3U] = std::clamp(along - foot * weight[top], 0.0F, 1.0F - weight[top]);
  weight[(top + 1U) % 3U] = 1.0F - weight[top] - weight[(top + 2U) % 3U];
  return {weight[1], weight[2]};
}

}  // namespace engine
