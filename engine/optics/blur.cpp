#include "engine/optics/blur.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "engine/core/constants.h"

namespace engine {
namespace {

constexpr int kShortest = 16;

std::size_t at(int i) noexcept { return static_cast<std::size_t>(i); }

/// Small factors only: a short transform.
bool is_fast(int n) noexcept {
  for (const int factor : {2, 3, 5})
    while (n % factor == 0) n /= factor;
  return n == 1;
}

void transpose(std::array<Lanes, Lanes::kCount>& square) noexcept {
  engine::transpose(square[0], square[1], square[2], square[3]);
}

std::complex<float> phase_of(double turns) noexcept {
  return std::complex<float>(std::polar(1.0, -2.0 * kPi * turns));
}

/// Calls work(from, to) for the `passed` frequencies from 0 on up, and those from -1 on down.
template <class Work>
void each_passed(std::size_t passed, std::size_t height, const Work& work) noexcept {
  work(0, passed);
  work(std::max(passed, height + 1 - passed), height);
}

}  // namespace

int Blur::fast_length(int at_least) noexcept {
  int n = (std::max(at_least, kShortest) + 3) / 4 * 4;
  while (!is_fast(n)) n += 4;
  return n;
}

Blur::Blur(int longest, int step, WorkerPool& pool) : step_(step), pool_(pool) {
  std::vector<int> lengths;
  for (int n = fast_length(0);; n = fast_length(n + 1)) {
    lengths.push_back(n);
    if (step > 1) lengths.push_back(n * step);
    if (n >= longest) break;
  }
  const int side = lengths.back();
  longest_ = side;
  const int samples = side / step;
  const int shares = pool.threads() * 2;
  for (int i = 0; i < shares; ++i) lines_.emplace_back(lengths);
  line_in_.assign(at(shares), std::vector<Complex>(at(side)));
  line_out_.assign(at(shares), std::vector<Complex>(at(side)));
  line_real_.assign(at(shares), std::vector<Lanes>(at(side)));
  const std::size_t groups = at(side / 2 / Lanes::kCount + 1);
  turned_.resize(at(side));
  passed_.resize(groups);
  spectrum_.resize(groups * at(side));
  folded_.resize(groups * at(samples));
  samples_.resize(at(samples) * at(samples));
}

/// Calls work(share, index) for every index in [0, count); a share never runs twice at once.
template <class Work>
void Blur::share(int count, const Work& work) noexcept {
  const int shares = static_cast<int>(lines_.size());
  pool_.rows(0, shares, [&](int s) {
    for (int i = count * s / shares; i < count * (s + 1) / shares; ++i) work(at(s), i);
  });
}

void Blur::transform(const RadianceImage& picture, const Grid& grid, const GridOtf& otf) noexcept {
  transform_rows(picture, grid, otf);
  share(groups(), [&](std::size_t s, int g) {
    const auto waves = multiply_columns(s, g, otf);
    Complex* line = &spectrum_[at(g) * waves.size()];
    each_passed(passed_[at(g)], waves.size(), [&](std::size_t from, std::size_t to) {
      std::copy(&waves[from], &waves[to], &line[from]);
    });
  });
}

void Blur::sample(double move_x, double move_y) noexcept {
  prepare_move(move_x, move_y);
  share(groups(), [&](std::size_t s, int g) {
    fold_columns(s, g, std::span(spectrum_).subspan(at(g) * at(grid_.height), at(grid_.height)));
  });
  sample_rows();
}

void Blur::transform_and_sample(const RadianceImage& picture, const Grid& grid, const GridOtf& otf,
                                double move_x, double move_y) noexcept {
  transform_rows(picture, grid, otf);
  prepare_move(move_x, move_y);
  share(groups(), [&](std::size_t s, int g) { fold_columns(s, g, multiply_columns(s, g, otf)); });
  sample_rows();
}

/// Four rows side by side; those below the picture are dark.
void Blur::load_rows(const RadianceImage& picture, int first, std::span<Lanes> line) noexcept {
  constexpr int kLanes = Lanes::kCount;
  const auto lanes = line.subspan(at(grid_.left), at(picture.width()));
  std::fill(line.begin(), lanes.begin(), Lanes{});
  std::fill(lanes.end(), line.end(), Lanes{});
  const int rows = std::min(kLanes, picture.height() - first);
  std::size_t x = 0;
  for (; rows == kLanes && x + kLanes <= lanes.size(); x += kLanes) {
    Square square;
    for (int lane = 0; lane < kLanes; ++lane)
      std::memcpy(&square[at(lane)].v, &picture.row(first + lane)[x], sizeof(Lanes::Vector));
    transpose(square);
    std::ranges::copy(square, &lanes[x]);
  }
  for (; x < lanes.size(); ++x) {
    lanes[x] = Lanes{};
    for (int lane = 0; lane < rows; ++lane) lanes[x].v[lane] = picture.row(first + lane)[x];
  }
}

void Blur::transform_rows(const RadianceImage& picture, const Grid& grid,
                          const GridOtf& otf) noexcept {
  constexpr int kLanes = Lanes::kCount;
  filled_ = (picture.height() + kLanes - 1) / kLanes * kLanes;
  ENSURE(grid.width <= longest_ && grid.height <= longest_);
  ENSURE(grid.left >= 0 && grid.left + picture.width() <= grid.width);
  ENSURE(grid.top >= 0 && grid.top + filled_ <= grid.height);
  grid_ = grid;
  columns_ = std::min(grid.width / 2, static_cast<int>(otf.cutoff() * grid.width)) + 1;
  share((picture.height() + kLanes - 1) / kLanes, [&](std::size_t s, int four) {
    const auto line = std::span(line_real_[s]).first(at(grid_.width));
    load_rows(picture, four * kLanes, line);
    // The last group may reach beyond the spectrum: what stands there is nothing.
    const auto half = std::span(line_out_[s]).first(line.size() / 2 + 1);
    lines_[s].forward(std::span<const Lanes>(line), half);
    const Complex* wave = line_out_[s].data();
    std::fill(&line_out_[s][at(columns_)], &line_out_[s][at(groups() * kLanes)], Complex{});
    Complex* column = &spectrum_[at(grid_.top + four * kLanes)];
    for (int g = 0; g < groups(); ++g, wave += kLanes, column += grid_.height) {
      Square re;
      Square im;
      for (std::size_t c = 0; c < re.size(); ++c) {
        re[c] = wave[c].real();
        im[c] = wave[c].imag();
      }
      transpose(re);
      transpose(im);
      for (std::size_t lane = 0; lane < re.size(); ++lane)
        column[lane] = Complex(re[lane], im[lane]);
    }
  });
}

/// The product of four columns' waves and the transfer function; only what passes is one.
std::span<const Blur::Complex> Blur::multiply_columns(std::size_t s, int g,
                                                      const GridOtf& otf) noexcept {
  const auto line = std::span(spectrum_).subspan(at(g) * at(grid_.height), at(grid_.height));
  std::ranges::fill(line.first(at(grid_.top)), Complex{});
  std::ranges::fill(line.subspan(at(grid_.top + filled_)), Complex{});
  const auto waves = std::span(line_out_[s]).first(line.size());
  lines_[s].forward(std::span<const Complex>(line), waves);
  Lanes fx;
  for (int c = 0; c < Lanes::kCount; ++c)
    fx.v[c] = static_cast<float>(static_cast<double>(g * Lanes::kCount + c) / grid_.width);
  const auto factors = std::span(line_in_[s]).first(line.size());
  passed_[at(g)] = otf.fill_column(fx, factors);
  each_passed(passed_[at(g)], line.size(), [&](std::size_t from, std::size_t to) {
    for (std::size_t k = from; k < to; ++k) waves[k] *= factors[k];
  });
  return waves;
}

void Blur::prepare_move(double move_x, double move_y) noexcept {
  move_x_ = move_x;
  moves_ = move_x != 0.0 || move_y != 0.0;
  for (int k = 0; moves_ && k < grid_.height; ++k) {
    const int wave = k <= grid_.height / 2 ? k : k - grid_.height;
    turned_[at(k)] = phase_of(static_cast<double>(wave) / grid_.height * move_y);
  }
}

void Blur::fold_columns(std::size_t s, int g, std::span<const Complex> line) noexcept {
  const std::size_t samples = at(samples_y());
  const auto sum = std::span(line_in_[s]).first(samples);
  Lanes re;
  Lanes im;
  for (int c = 0; moves_ && c < Lanes::kCount; ++c) {
    const auto turned =
        phase_of(static_cast<double>(g * Lanes::kCount + c) / grid_.width * move_x_);
    re.v[c] = turned.real();
    im.v[c] = turned.imag();
  }
  std::ranges::fill(sum, Complex{});
  each_passed(passed_[at(g)], line.size(), [&](std::size_t from, std::size_t to) {
    std::size_t j = from % samples;
    for (std::size_t k = from; k < to; ++k, j = j + 1 < samples ? j + 1 : 0)
      sum[j] += moves_ ? line[k] * Complex(re, im) * Complex(turned_[k].real(), turned_[k].imag())
                       : line[k];
  });
  lines_[s].inverse(std::span<const Complex>(sum),
                    std::span(folded_).subspan(at(g) * samples, samples));
}

void Blur::sample_rows() noexcept {
  constexpr int kLanes = Lanes::kCount;
  const int width = samples_x();
  const int height = samples_y();
  share(height / kLanes, [&](std::size_t s, int four) {
    const auto half = std::span(line_in_[s]).first(at(width / 2 + 1));
    std::ranges::fill(half, Complex{});
    for (int column = 0; column < columns_; column += kLanes) {
      const Complex* group = &folded_[at(column / kLanes) * at(height) + at(four * kLanes)];
      Square re;
      Square im;
      for (std::size_t lane = 0; lane < re.size(); ++lane) {
        re[lane] = group[lane].real();
        im[lane] = group[lane].imag();
      }
      transpose(re);
      transpose(im);
      for (int c = column; c < std::min(column + kLanes, columns_); ++c) {
        // The wave itself and its mirror image, each where sampling folds it to.
        const int k = c % width;
        const int mirrored = (width - k) % width;
        if (k <= width / 2) half[at(k)] += Complex(re[at(c - column)], im[at(c - column)]);
        const bool mirrors = c > 0 && 2 * c < grid_.width;
        if (mirrors && mirrored <= width / 2)
          half[at(mirrored)] += Complex(re[at(c - column)], -im[at(c - column)]);
      }
    }
    const auto line = std::span(line_real_[s]).first(at(width));
    lines_[s].inverse(std::span<const Complex>(half), line);
    for (int x = 0; x < width; x += kLanes) {
      Square square;
      std::copy_n(&line[at(x)], kLanes, square.begin());
      transpose(square);
      for (int lane = 0; lane < kLanes; ++lane)
        std::memcpy(&samples_[at(four * kLanes + lane) * at(width) + at(x)], &square[at(lane)].v,
                    sizeof(Lanes::Vector));
    }
  });
}

std::span<const float> Blur::row(int y) const noexcept {
  return std::span(samples_).subspan(at(y) * at(samples_x()), at(samples_x()));
}

}  // namespace engine
