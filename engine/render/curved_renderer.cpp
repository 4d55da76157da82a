#include "engine/render/curved_renderer.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "engine/core/contract.h"
#include "engine/core/lagrange.h"

namespace engine {
namespace {

constexpr int kNode = CurvedRenderer::kNode_px;
// Along each side of a region: how far it bends is looked for there.
constexpr int kPlacesOfSide = 33;
// Of a fraction of a cell: that many tables of weights, each right to a 512th of a cell.
constexpr int kPhases = 256;
// Cells before and after the one that a place falls in, that the cubic looks at.
constexpr int kBefore = 1;
constexpr int kAfter = 2;
constexpr double kNotKnown = std::numeric_limits<double>::quiet_NaN();
constexpr PixelPoint kNowhere{kNotKnown, kNotKnown};

std::size_t at(int i) noexcept { return static_cast<std::size_t>(i); }

const std::array<std::array<float, 4>, kPhases + 1>& cubics() noexcept {
  static const auto kTable = [] {
    std::array<std::array<float, 4>, kPhases + 1> table{};
    for (int i = 0; i <= kPhases; ++i) table[at(i)] = lagrange_cubic(1.0 * i / kPhases);
    return table;
  }();
  return kTable;
}

/// Calls work(place) along the sides of a region.
template <class Work>
void along_sides(const PixelRect& r, const Work& work) noexcept {
  for (int i = 0; i < kPlacesOfSide; ++i) {
    const double t = static_cast<double>(i) / (kPlacesOfSide - 1);
    const double u = r.left - 0.5 + t * r.width();
    const double v = r.top - 0.5 + t * r.height();
    work(PixelPoint{u, r.top - 0.5});
    work(PixelPoint{u, r.bottom - 0.5});
    work(PixelPoint{r.left - 0.5, v});
    work(PixelPoint{r.right - 0.5, v});
  }
}

}  // namespace

/// What is not finite has no place in the other image.
class CurvedRenderer::Bend {
 public:
  Bend(const CameraGeometry& camera, const AffineMap& map, PixelPoint target_px) noexcept
      : camera_(camera), local_(camera, map) {
    // The affine image is that of the distortion about the target, then stretched by a rolling
    // shutter. The latter is what is left when the former is taken away.
    const auto distorted = camera.map_near(local_.direction_at(target_px), {}, 1.0);
    ok_ = distorted.has_value();
    const AffineMap straight = distorted.value_or(AffineMap{}).inverse();
    rolled_.slope = map.slope * straight.slope;
    rolled_.shift = map.slope * straight.shift + map.shift;
    unrolled_ = rolled_.inverse();
  }
  [[nodiscard]] bool ok() const noexcept { return ok_; }

  /// From the curved image to the affine one.
  [[nodiscard]] PixelPoint straightened(PixelPoint p) const noexcept {
    const Eigen::Vector3d direction = camera_.direction_at(unrolled_.apply(p));
    const auto place = local_.project(direction);
    // Beyond the terms' reach there is nothing, though they may have an answer.
    return place && camera_.project(direction) ? *place : kNowhere;
  }
  /// And back.
  [[nodiscard]] PixelPoint bent(PixelPoint p) const noexcept {
    const auto place = camera_.project(local_.direction_at(p));
    return place ? rolled_.apply(*place) : kNowhere;
  }

 private:
  const CameraGeometry& camera_;
  LocalCamera local_;
  AffineMap rolled_;
  AffineMap unrolled_;
  bool ok_ = false;
};

CurvedRenderer::CurvedRenderer(const CameraGeometry& camera, const GridWish& wish,
                               std::unique_ptr<Renderer> affine, WorkerPool& pool)
    : camera_(camera), wish_(wish), affine_(std::move(affine)), pool_(pool) {
  const PixelRect most = camera.frame().grown_by(wish.beyond_frame_px);
  const int s = wish.oversampling;
  nodes_.reserve(at(most.width() / kNode + 3) * at(most.height() / kNode + 3));
  spare_grid_.reserve(most.width() * s, most.height() * s);
  spare_cover_.reserve(most.width() * s, most.height() * s);
  (void)cubics();  // made now, not in the first frame
}

RenderReport CurvedRenderer::render(const Snapshot& snapshot, Budget budget,
                                    Radiance& out) noexcept {
  RenderReport report = affine_->render(snapshot, budget, out);
  if (out.region.empty()) return report;
  const Bend bend(camera_, snapshot.image_map, snapshot.target_px);
  double most_px = 0;
  along_sides(out.region, [&](PixelPoint p) {
    const PixelPoint q = bend.bent(p);
    const double off_px = std::hypot(q.u - p.u, q.v - p.v);
    if (std::isfinite(off_px)) most_px = std::max(most_px, off_px);
  });
  const bool seen = bend.ok() && most_px > kSeen_px;
  report.add({"distortion", seen ? "curved" : "affine", kNotKnown});
  if (!seen) return report;

  const auto redraw = [&](PixelRect& region, RadianceImage& grid, CoverImage& cover) {
    const PixelRect from = region;
    region = bent_region(bend, from);
    find_nodes(bend, region);
    draw(from, region, out.oversampling, grid, cover);
  };
  if (out.companions_in_sight && !out.targets_region.empty())
    redraw(out.targets_region, out.targets_grid, out.targets_cover);
  redraw(out.region, out.grid, out.cover);
  return report;
}

/// The box about a region's bent sides.
PixelRect CurvedRenderer::bent_region(const Bend& bend, const PixelRect& region) const noexcept {
  const PixelRect limits = camera_.frame().grown_by(wish_.beyond_frame_px);
  PixelPoint low{1.0 * region.right, 1.0 * region.bottom};
  PixelPoint high{1.0 * region.left, 1.0 * region.top};
  along_sides(region, [&](PixelPoint p) {
    const PixelPoint q = bend.bent(p);
    // Beyond the terms' reach: as far as there is a frame.
    const bool seen = std::isfinite(q.u) && std::isfinite(q.v);
    low = {std::min(low.u, seen ? q.u : limits.left), std::min(low.v, seen ? q.v : limits.top)};
    high = {std::max(high.u, seen ? q.u : limits.right),
            std::max(high.v, seen ? q.v : limits.bottom)};
  });
  const auto pixel = [](double x, int least, int most) {
    return static_cast<int>(std::clamp(x, 1.0 * least, 1.0 * most));
  };
  // Sides bow between the places that were looked at, by less than a pixel.
  return {pixel(std::floor(low.u), limits.left, limits.right),
          pixel(std::floor(low.v), limits.top, limits.bottom),
          pixel(std::ceil(high.u) + 1.0, limits.left, limits.right),
          pixel(std::ceil(high.v) + 1.0, limits.top, limits.bottom)};
}

void CurvedRenderer::find_nodes(const Bend& bend, const PixelRect& region) noexcept {
  nodes_across_ = region.width() / kNode + 2;
  const int down = region.height() / kNode + 2;
  nodes_.resize(at(nodes_across_) * at(down));
  pool_.rows(0, down, [&](int y) {
    for (int x = 0; x < nodes_across_; ++x) {
      const PixelPoint p{region.left - 0.5 + x * kNode, region.top - 0.5 + y * kNode};
      const PixelPoint q = bend.straightened(p);
      nodes_[at(y) * at(nodes_across_) + at(x)] = {q.u - p.u, q.v - p.v};
    }
  });
}

void CurvedRenderer::draw(const PixelRect& from_region, const PixelRect& region, int oversampling,
                          RadianceImage& grid, CoverImage& cover) noexcept {
  std::swap(grid, spare_grid_);
  std::swap(cover, spare_cover_);
  grid.resize(region.width() * oversampling, region.height() * oversampling);
  cover.resize(grid.width(), grid.height());
  const RadianceImage& from = spare_grid_;
  ENSURE(spare_cover_.pixels().size() == from.pixels().size());
  const double cell_px = 1.0 / oversampling;
  const auto& weights = cubics();
  pool_.rows(0, grid.height(), [&](int y) {
    const auto light = grid.row(y);
    const auto share = cover.row(y);
    std::ranges::fill(light, 0.0F);
    std::ranges::fill(share, 0.0F);
    const double down_px = (y + 0.5) * cell_px;  // from the region's upper side
    const int node_y = static_cast<int>(down_px) / kNode;
    const double t = down_px / kNode - node_y;
    const PixelPoint* above = &nodes_[at(node_y) * at(nodes_across_)];
    const PixelPoint* below = above + nodes_across_;
    const auto node = [&](int x) {
      return PixelPoint{above[x].u + t * (below[x].u - above[x].u),
                        above[x].v + t * (below[x].v - above[x].v)};
    };
    for (int x = 0; x < grid.width(); ++x) {
      const double across_px = (x + 0.5) * cell_px;
      const int node_x = static_cast<int>(across_px) / kNode;
      const double s = across_px / kNode - node_x;
      const PixelPoint a = node(node_x);
      const PixelPoint b = node(node_x + 1);
      // Places count in cells of the other image, from the centre of its first.
      const double u =
          (region.left - from_region.left + across_px + a.u + s * (b.u - a.u)) * oversampling - 0.5;
      const double v =
          (region.top - from_region.top + down_px + a.v + s * (b.v - a.v)) * oversampling - 0.5;
      // Not a number, or outside.
      if (!(u >= -kAfter && u < from.width() + kBefore && v >= -kAfter &&
            v < from.height() + kBefore))
        continue;
      const int first_x = static_cast<int>(std::floor(u));
      const int first_y = static_cast<int>(std::floor(v));
      const auto& across = weights[at(static_cast<int>(std::lround((u - first_x) * kPhases)))];
      const auto& down = weights[at(static_cast<int>(std::lround((v - first_y) * kPhases)))];
      float light_sum = 0;
      float share_sum = 0;
      for (int j = std::max(-kBefore, -first_y); j <= std::min(kAfter, from.height() - 1 - first_y);
           ++j) {
        float light_row = 0;
        float share_row = 0;
        for (int i = std::max(-kBefore, -first_x);
             i <= std::min(kAfter, from.width() - 1 - first_x); ++i) {
          light_row += across[at(i + kBefore)] * from.at(first_x + i, first_y + j);
          share_row += across[at(i + kBefore)] * spare_cover_.at(first_x + i, first_y + j);
        }
        light_sum += down[at(j + kBefore)] * light_row;
        share_sum += down[at(j + kBefore)] * share_row;
      }
      light[at(x)] = light_sum;
      share[at(x)] = std::clamp(share_sum, 0.0F, 1.0F);
    }
  });
}

}  // namespace engine
