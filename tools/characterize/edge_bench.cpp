#include "tools/characterize/edge_bench.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "engine/core/constants.h"
#include "engine/optics/mtf.h"

namespace characterize {
namespace {

using engine::PixelPoint;

constexpr double kLeastReach_px = 12;
constexpr int kMostRows = 1024;  // that the edge crosses

/// Columns and rows change places for an edge along the rows.
struct View {
  bool turned;
  int width;
  int height;
  View(const engine::CameraGeometry& camera, bool near_vertical)
      : turned(!near_vertical),
        width(near_vertical ? camera.width_px : camera.height_px),
        height(near_vertical ? camera.height_px : camera.width_px) {}

  /// That the edge crosses, in the middle of the frame.
  [[nodiscard]] int rows() const noexcept { return std::min(kMostRows, height / 2); }
  /// How far it goes aside over half of them.
  [[nodiscard]] double half_drift_px(const EdgePlan& plan) const noexcept {
    return 0.5 * std::tan(plan.angle_deg * engine::kDegree) * rows();
  }
  [[nodiscard]] std::size_t pixel(int u, int v) const noexcept {
    return turned ? static_cast<std::size_t>(u) * static_cast<std::size_t>(height) +
                        static_cast<std::size_t>(v)
                  : static_cast<std::size_t>(v) * static_cast<std::size_t>(width) +
                        static_cast<std::size_t>(u);
  }
  /// In the frame.
  [[nodiscard]] PixelPoint place(PixelPoint p) const noexcept {
    return turned ? PixelPoint{p.v, p.u} : p;
  }
};

engine::Radiance edge_light(const Bench& bench, PixelPoint on, PixelPoint normal,
                            double bright_w_m2) {
  engine::Radiance light;
  const engine::GridWish wish = bench.wish();
  light.oversampling = wish.oversampling;
  light.region = bench.camera().frame().grown_by(wish.beyond_frame_px);
  light.grid =
      half_plane(light.region, wish.oversampling, on, normal, bright_w_m2 / bench.throughput_sr());
  return light;
}

/// (edge - dark) / (flat - dark) of a part of the frame, as the view has it.
EdgeImage normalised(const View& view, const engine::PixelRect& part, const FieldFrames& field,
                     const std::vector<float>& edge_dn, const PixelMask& used) {
  EdgeImage image{part.width(), part.height(), {}};
  for (int v = part.top; v < part.bottom; ++v) {
    for (int u = part.left; u < part.right; ++u) {
      const std::size_t i = view.pixel(u, v);
      image.value.push_back(used[i] != 0 ? (edge_dn[i] - field.dark_dn[i]) /
                                               (field.flat_dn[i] - field.dark_dn[i])
                                         : std::numeric_limits<float>::quiet_NaN());
    }
  }
  return image;
}

void compare(const engine::OtfCascade& cascade, const engine::OtfCascade::Focused& lens,
             const View& view, EdgeFigures& out) {
  const double length = std::hypot(1.0, out.response.slope);
  const PixelPoint normal = view.place({1.0 / length, -out.response.slope / length});
  for (std::size_t i = 0; i < out.response.mtf.size(); ++i) {
    const double f = out.response.cycles_per_px[i];
    out.analytic.push_back(std::abs(cascade.whole(f * normal.u, f * normal.v, lens)));
    const double off = out.response.mtf[i] - out.analytic.back();
    if (f < out.least_cycles_per_px || std::abs(off) <= std::abs(out.worst)) continue;
    out.worst = off;
    out.worst_cycles_per_px = f;
  }
}

}  // namespace

double edge_reach_px(const engine::CameraGeometry& camera, bool near_vertical,
                     const EdgePlan& plan) {
  const View view(camera, near_vertical);
  const double room_px = 0.5 * view.width - view.half_drift_px(plan) - 2.0;
  if (room_px < kLeastReach_px)
    throw std::runtime_error("the frame is too small for a slanted edge, 32 pixels are the least");
  return std::min(plan.reach_px, room_px);
}

double mtf_error(const engine::CameraGeometry& camera, bool near_vertical, const EdgePlan& plan) {
  const double reach_px = edge_reach_px(camera, near_vertical, plan);
  const double per_bin = View(camera, near_vertical).rows() * kEdgeBin_px;
  // Of the edge and of the flat field, on the bright side; there the window is worth three quarters
  // of its reach.
  const double spread = std::sqrt(2.0 / (plan.frames * plan.bright_e * per_bin));
  const double bins = 0.75 * reach_px / kEdgeBin_px;
  const double difference = 2.0 * std::sin(0.5 * engine::kPi * kEdgeBin_px);
  const double modulus = 1.0 / std::sqrt(2.0);
  return spread * std::sqrt(bins) * difference * modulus /
         std::pow(engine::sinc(0.5 * kEdgeBin_px), 2);
}

FieldFrames take_field(Bench& bench, engine::Duration exposure, const PixelMask& used,
                       const EdgePlan& plan) {
  bench.illuminate(0.0);
  FieldFrames field;
  field.dark_dn = bench.stack(exposure, plan.frames, used).mean_image_dn();
  bench.illuminate(plan.bright_w_m2);
  field.flat_dn = bench.stack(exposure, plan.frames, used).mean_image_dn();
  return field;
}

EdgeFigures measure_edge(Bench& bench, const FieldFrames& field, const engine::OtfCascade& cascade,
                         const engine::OtfCascade::Focused& lens, engine::Duration exposure,
                         const PixelMask& used, bool near_vertical, const EdgePlan& plan) {
  const engine::CameraGeometry& camera = bench.camera();
  const View view(camera, near_vertical);
  const int rows = view.rows();
  const double reach_px = edge_reach_px(camera, near_vertical, plan);
  const PixelPoint middle = view.place({0.5 * (view.width - 1), 0.5 * (view.height - 1)});
  const PixelPoint normal = view.place(
      {std::cos(plan.angle_deg * engine::kDegree), -std::sin(plan.angle_deg * engine::kDegree)});
  bench.illuminate(edge_light(bench, middle, normal, plan.bright_w_m2));
  const ImageStack edge = bench.stack(exposure, plan.frames, used);

  const int half = std::min(static_cast<int>(std::ceil(reach_px + view.half_drift_px(plan))) + 2,
                            view.width / 2);
  const int top = (view.height - rows) / 2;
  const engine::PixelRect part{view.width / 2 - half, top, view.width / 2 + half, top + rows};
  EdgeFigures out;
  out.near_vertical = near_vertical;
  out.response = slanted_edge(normalised(view, part, field, edge.mean_image_dn(), used), reach_px);
  out.least_cycles_per_px = 1.0 / reach_px;
  out.mtf_error = mtf_error(camera, near_vertical, plan);
  out.angle_deg = std::atan(out.response.slope) / engine::kDegree;
  compare(cascade, lens, view, out);
  return out;
}

}  // namespace characterize
