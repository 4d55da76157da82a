#include "engine/optics/far_wings.h"

#include <algorithm>
#include <cmath>

#include "engine/core/constants.h"
#include "engine/core/contract.h"
#include "engine/core/lagrange.h"

namespace engine {
namespace {

constexpr int kCell = FarWings::kCell_px;
constexpr int kTableSteps = 1024;
constexpr int kMostFine = 16;
// Cycles per pixel.
constexpr double kFadesFrom = 0.12;
constexpr double kFadesTo = 0.24;
// Cells beside the outermost pixel that its interpolation looks at.
constexpr int kBeside = 2;
// Along a side, than pixels would have it: halves of cells at either end, and what the transform's
// rows and the interpolation look at.
constexpr int kMoreCells = 16;

std::size_t at(int i) noexcept { return static_cast<std::size_t>(i); }

/// The cell that a pixel lies in; pixels left of the frame are negative.
int cell_of(int pixel) noexcept {
  return pixel >= 0 ? pixel / kCell : -((-pixel + kCell - 1) / kCell);
}

/// For a pixel, a quarter of a cell from the middle of its own: weights of the cell on the other
/// side, its own, the next one where it lies, and that beyond.
constexpr std::array<float, 4> kCubic = lagrange_cubic(0.25);

}  // namespace

FarWings::FarWings(const WingLaw& law, double width, int longest_px, WorkerPool& pool)
    : pool_(pool),
      grid_otf_(kCell, 2, Blur::fast_length(longest_px / kCell + kMoreCells)),
      blur_(longest_px / kCell + kMoreCells, 1, pool),
      softness_px_{5.0 * width, 7.0 * width},
      table_(kTableSteps + 2, 0.0F),
      wide_(at(Blur::fast_length(longest_px / kCell + kMoreCells)) * at(longest_px)) {
  // The two together have the law's share, and its next term: that of c / (r^2 + s^2)^(3/2) is
  // - 3/2 c s^2 / r^5.
  const double s0 = softness_px_[0] * softness_px_[0];
  const double s1 = softness_px_[1] * softness_px_[1];
  const double squares = -law.next_px3 / 1.5;
  const double first = (law.share_px * s1 - squares) / (s1 - s0);
  strength_ = {2.0 * kPi * first / softness_px_[0],
               2.0 * kPi * (law.share_px - first) / softness_px_[1]};
  for (int i = 0; i <= kTableSteps; ++i)
    table_[at(i)] = static_cast<float>(otf(static_cast<double>(i) / kTableSteps / kCell));
  const int longest = longest_px / kCell + kMoreCells;
  cells_.reserve(longest, longest);
  // Of the finest picture; the system hands out real memory for what is used.
  lines_.reserve(at(kMostFine / kCell * longest_px) * at(longest));
}

RadialOtf FarWings::table() const noexcept { return {table_, 1.0 * kTableSteps * kCell}; }

double FarWings::otf(double per_px) const noexcept {
  double sum = 0;
  for (std::size_t i = 0; i < strength_.size(); ++i)
    sum += strength_[i] * std::exp(-2.0 * kPi * softness_px_[i] * per_px);
  // The cells end at a quarter of a cycle; what is left there would ring along the axes.
  const double end = std::clamp((per_px - kFadesFrom) / (kFadesTo - kFadesFrom), 0.0, 1.0);
  return sum * 0.5 * (1.0 + std::cos(kPi * end));
}

void FarWings::gather(const RadianceImage& picture, const PixelRect& region,
                      int oversampling) noexcept {
  // Light in a cell counts for it and for the next, the more the nearer: so its place is kept.
  covered_ = {cell_of(region.left) - 1, cell_of(region.top) - 1, cell_of(region.right - 1) + 2,
              cell_of(region.bottom - 1) + 2};
  cells_.resize(covered_.width(), covered_.height());
  const int fine = oversampling * kCell;  // cells of the picture to one of ours
  ENSURE(fine <= kMostFine);
  // Of the cell before, of its own and of the next one, by place within a cell.
  std::array<std::array<float, 3>, kMostFine> shares{};
  for (int k = 0; k < fine; ++k) {
    const float off = (static_cast<float>(k) + 0.5F) / static_cast<float>(fine) - 0.5F;
    shares[at(k)] = {std::max(-off, 0.0F), 1.0F - std::abs(off), std::max(off, 0.0F)};
  }
  const int first_x = (region.left - covered_.left * kCell) * oversampling;
  const int first_y = (region.top - covered_.top * kCell) * oversampling;
  // Of the radiance the mean over a cell: what a transform of cells is to be given.
  const auto mean = static_cast<float>(1.0 / (fine * fine));
  const std::size_t length = at(picture.width());
  const std::size_t needed = at(cells_.height()) * length;
  if (lines_.size() < needed) lines_.resize(needed);
  pool_.rows(0, cells_.height(), [&](int row) {
    // First down, for the picture's rows lie in one piece each.
    const auto line = std::span(lines_).subspan(at(row) * length, length);
    const int begin = std::max((row - 1) * fine - first_y, 0);
    const int end = std::min((row + 2) * fine - first_y, picture.height());
    std::ranges::fill(line, 0.0F);
    for (int y = begin; y < end; ++y) {
      const int cell = (first_y + y) / fine;
      const float share = mean * shares[at(first_y + y - cell * fine)][at(row - cell + 1)];
      if (share == 0.0F) continue;
      const float* from = picture.row(y).data();
      for (std::size_t x = 0; x < length; ++x) line[x] += share * from[x];
    }
    const auto to = cells_.row(row);
    std::ranges::fill(to, 0.0F);
    for (int x = 0; x < picture.width();) {
      const int cell = (first_x + x) / fine;
      const int next = std::min(picture.width(), (cell + 1) * fine - first_x);
      std::array<float, 3> sum{};
      for (; x < next; ++x)
        for (std::size_t i = 0; i < 3; ++i)
          sum[i] += shares[at(first_x + x - cell * fine)][i] * line[at(x)];
      for (std::size_t i = 0; i < 3; ++i) to[at(cell) + i - 1] += sum[i];
    }
  });
}

void FarWings::transform(int reach_px, const ImageMotion& motion) noexcept {
  const auto margin = [&](double moves_px) {
    return static_cast<int>(std::ceil((reach_px + moves_px) / kCell)) + kBeside;
  };
  margin_x_ = margin(motion.reach_px().u);
  margin_y_ = margin(motion.reach_px().v);
  Blur::Grid grid;
  grid.left = margin_x_;
  grid.top = margin_y_;
  grid.width = Blur::fast_length(cells_.width() + 2 * margin_x_);
  grid.height = Blur::fast_length(cells_.height() + 2 * margin_y_ + Lanes::kCount);
  grid_otf_.prepare(table(), grid.height, motion);
  blur_.transform(cells_, grid, grid_otf_);
}

void FarWings::add(PixelPoint move_px, double scale, IrradianceImage& out) noexcept {
  // Whole cells move by moving the window, the rest by turning the waves.
  const double cells_u = std::round(move_px.u / kCell);
  const double cells_v = std::round(move_px.v / kCell);
  const int left = covered_.left - margin_x_ + static_cast<int>(cells_u);
  const int top = covered_.top - margin_y_ + static_cast<int>(cells_v);
  const PixelRect window = PixelRect{(left + kBeside) * kCell, (top + kBeside) * kCell,
                                     (left + 2 * margin_x_ + cells_.width() - kBeside) * kCell,
                                     (top + 2 * margin_y_ + cells_.height() - kBeside) * kCell}
                               .clipped_to({0, 0, out.width(), out.height()});
  if (window.empty()) return;
  blur_.sample(move_px.u / kCell - cells_u, move_px.v / kCell - cells_v);

  const int first_row = cell_of(window.top) - kBeside;
  const int rows = cell_of(window.bottom - 1) + kBeside + 1 - first_row;
  const auto share = static_cast<float>(scale * blur_.scale());
  pool_.rows(0, rows, [&](int y) {
    const auto cells = blur_.row(first_row + y - top);
    float* wide = &wide_[at(y) * at(window.width())];
    for (int u = window.left; u < window.right; ++u) {
      const float* c = &cells[at(cell_of(u) - left)];
      const int d = u % kCell == 0 ? -1 : 1;  // towards which neighbour it lies
      wide[u - window.left] =
          share * (kCubic[0] * c[-d] + kCubic[1] * c[0] + kCubic[2] * c[d] + kCubic[3] * c[2 * d]);
    }
  });
  pool_.rows(window.top, window.bottom, [&](int v) {
    const int d = v % kCell == 0 ? -1 : 1;
    const auto wide = [&](int beside) {
      return &wide_[at(cell_of(v) + beside * d - first_row) * at(window.width())];
    };
    const float* a = wide(-1);
    const float* b = wide(0);
    const float* c = wide(1);
    const float* e = wide(2);
    float* to = &out.row(v)[at(window.left)];
    for (int i = 0; i < window.width(); ++i)
      to[i] += kCubic[0] * a[i] + kCubic[1] * b[i] + kCubic[2] * c[i] + kCubic[3] * e[i];
  });
}

}  // namespace engine
