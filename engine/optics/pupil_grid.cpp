#include "engine/optics/pupil_grid.h"

#include <algorithm>
#include <cmath>

#include <unsupported/Eigen/FFT>

#include "engine/core/constants.h"

namespace engine {
namespace {

using Complex = std::complex<double>;

int fast_length(int at_least) noexcept {
  for (int n = (at_least + 3) / 4 * 4;; n += 4) {
    int rest = n;
    for (const int factor : {2, 3, 5})
      while (rest % factor == 0) rest /= factor;
    if (rest == 1) return n;
  }
}

std::size_t index(int i) noexcept { return static_cast<std::size_t>(i); }

}  // namespace

struct PupilGrid::Transforms {
  explicit Transforms(int length) : in(index(length)), out(index(length)), real(index(length)) {
    fft.SetFlag(Eigen::FFT<double>::Unscaled);
    fft.SetFlag(Eigen::FFT<double>::HalfSpectrum);
  }
  Eigen::FFT<double> fft;
  std::vector<Complex> in;
  std::vector<Complex> out;
  std::vector<double> real;
};

PupilGrid::PupilGrid(const Pupil& pupil, double cell, int lags)
    : side_(static_cast<int>(std::ceil(2.0 / cell - 1e-9))),
      lags_(lags),
      length_(fast_length(side_ + lags + 1)),
      rows_(index(std::max(side_, lags + 1)) * index(length_)),
      transforms_(std::make_unique<Transforms>(length_)) {
  find_cells(pupil, cell);
}

PupilGrid::~PupilGrid() = default;
PupilGrid::PupilGrid(PupilGrid&&) noexcept = default;
PupilGrid& PupilGrid::operator=(PupilGrid&&) noexcept = default;

void PupilGrid::find_cells(const Pupil& pupil, double cell) {
  constexpr int kLines = 8;  // through each cell; along a line the open part is exact
  const double edge = -0.5 * side_ * cell;
  std::vector<double> column(index(side_));
  for (int i = 0; i < side_; ++i) {
    std::fill(column.begin(), column.end(), 0.0);
    for (int k = 0; k < kLines; ++k) {
      OpenLine line(-1.0, 1.0);
      pupil.hide(edge + (i + (k + 0.5) / kLines) * cell, 0.0, line);
      for (const auto& piece : line) {
        for (int j = std::max(static_cast<int>((piece.low - edge) / cell), 0); j < side_; ++j) {
          const double low = std::max(piece.low, edge + j * cell);
          const double high = std::min(piece.high, edge + (j + 1) * cell);
          if (low >= high) break;
          column[index(j)] += (high - low) / (cell * kLines);
        }
      }
    }
    for (int j = 0; j < side_; ++j) {
      const double open = column[index(j)];
      if (open <= 0.0) continue;
      // The path in a cell's middle, although it may be closed there: the difference between two
      // cells is then that of their shift, whatever their shares.
      const double x = edge + (i + 0.5) * cell;
      const double y = edge + (j + 0.5) * cell;
      cells_.push_back(
          {index(j) * index(length_) + index(i), open, pupil.wavefront_m(x, y), x * x + y * y});
      open_area_ += open;
    }
  }
}

void PupilGrid::overlap(double wavelength_m, double w20_m) {
  std::fill(rows_.begin(), rows_.end(), Complex{});
  for (const Cell& cell : cells_) {
    const double path_m = cell.wavefront_m + w20_m * cell.radius2;
    rows_[cell.place] = std::polar(cell.open, 2.0 * kPi * path_m / wavelength_m);
  }
  transform();
}

void PupilGrid::flat_overlap() {
  std::fill(rows_.begin(), rows_.end(), Complex{});
  for (const Cell& cell : cells_) rows_[cell.place] = cell.open;
  transform();
}

/// Forward, squared modulus, forward again: the overlap at shifts of either sign along x, and at
/// those of positive sign along y.
void PupilGrid::transform() {
  auto& [fft, in, out, real] = *transforms_;
  const auto length = index(length_);
  const auto row_of = [&](int row) { return rows_.data() + index(row) * length; };
  for (int row = 0; row < side_; ++row) {
    std::copy_n(row_of(row), length, in.begin());
    fft.fwd(row_of(row), in.data(), length_);
  }
  for (std::size_t column = 0; column < length; ++column) {
    std::fill(in.begin(), in.end(), Complex{});
    for (int row = 0; row < side_; ++row) in[index(row)] = row_of(row)[column];
    fft.fwd(out.data(), in.data(), length_);
    for (std::size_t i = 0; i < length; ++i) real[i] = std::norm(out[i]);
    fft.fwd(out.data(), real.data(), length_);
    for (int row = 0; row <= lags_; ++row) row_of(row)[column] = out[index(row)];
  }
  const double scale = 1.0 / (static_cast<double>(length_) * length_);
  for (int row = 0; row <= lags_; ++row) {
    std::transform(row_of(row), row_of(row) + length, in.begin(),
                   [scale](const Complex& c) { return scale * c; });
    fft.fwd(row_of(row), in.data(), length_);
  }
}

Complex PupilGrid::at(int dx, int dy) const noexcept {
  const int column = dx >= 0 ? dx : dx + length_;
  return rows_[index(dy) * index(length_) + index(column)];
}

}  // namespace engine
