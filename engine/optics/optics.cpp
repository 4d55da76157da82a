#include "engine/optics/optics.h"

#include <algorithm>
#include <cmath>

#include "engine/core/constants.h"

namespace engine {
namespace {

constexpr int kSmallestWing_px = 8;
// Whole waves of light are spread over this much of the field before anybody sees them.
constexpr double kUnseenSmear_px = 1e-3;

/// Lengths with small factors only, and a multiple of four: short transforms.
std::vector<int> fast_lengths(int largest) {
  std::vector<int> lengths;
  for (int n = 32;; n += 4) {
    int rest = n;
    for (const int factor : {2, 3, 5})
      while (rest % factor == 0) rest /= factor;
    if (rest == 1) lengths.push_back(n);
    if (rest == 1 && n >= largest) return lengths;
  }
}

int fast_length(int at_least) noexcept {
  for (int n = (std::max(at_least, 32) + 3) / 4 * 4;; n += 4) {
    int rest = n;
    for (const int factor : {2, 3, 5})
      while (rest % factor == 0) rest /= factor;
    if (rest == 1) return n;
  }
}

std::size_t at(int i) noexcept { return static_cast<std::size_t>(i); }

}  // namespace

OpticsSpec read_optics(const ConfigTable& table, const CameraGeometry& camera) {
  OpticsSpec spec;
  spec.camera = camera;
  spec.band.focal_length_m = camera.focal_length_m;
  spec.band.aperture_m = table.number("aperture_m", positive());
  spec.band.obscuration = table.number_or("obscuration", 0.0, from_below(0.0, 1.0));
  spec.transmission = table.number("transmission", between(1e-6, 1.0));
  spec.largest_wing_px =
      static_cast<int>(table.integer_or("largest_wing_px", 64, between(kSmallestWing_px, 512)));
  const double cells_per_m = 3.0 / camera.pixel_pitch_m;
  const double cutoff_per_m = spec.band.aperture_m / (camera.focal_length_m * spec.band.band_low_m);
  if (cutoff_per_m > 0.5 * cells_per_m) {
    table.fail("aperture_m", "passes " + std::to_string(cutoff_per_m * 1e-3) +
                                 " lp/mm, more than the " + std::to_string(0.5e-3 * cells_per_m) +
                                 " that three cells to a pixel can carry");
  }
  return spec;
}

double throughput_sr(const OpticsSpec& spec) noexcept {
  const double d_over_f = spec.band.aperture_m / spec.band.focal_length_m;
  const double open = 1.0 - spec.band.obscuration * spec.band.obscuration;
  return kPi / 4.0 * d_over_f * d_over_f * spec.transmission * open;
}

Optics::Optics(const OpticsSpec& spec, double faint_w_m2, WorkerPool& pool)
    : spec_(spec),
      diffraction_(spec.band),
      throughput_sr_(engine::throughput_sr(spec)),
      faint_w_m2_(faint_w_m2),
      pool_(pool) {
  // Light from beyond the frame, and beyond that room for the wings and for as much smear.
  const int side = std::max(spec.camera.width_px, spec.camera.height_px) + 6 * spec.largest_wing_px;
  std::vector<int> lengths = fast_lengths(side);
  const int longest = lengths.back() * kOversampling;
  for (std::size_t i = 0, n = lengths.size(); i < n; ++i)
    lengths.push_back(lengths[i] * kOversampling);
  const int shares = pool.threads() * 2;
  for (int i = 0; i < shares; ++i) lines_.emplace_back(lengths);
  line_in_.assign(at(shares), std::vector<Complex>(at(longest)));
  line_out_.assign(at(shares), std::vector<Complex>(at(longest)));
  line_real_.assign(at(shares), std::vector<float>(at(longest)));
  behind_.assign(at(shares), std::vector<float>(at(side)));
  // Of these the system hands out real memory only for what a frame uses.
  spectrum_.resize(at(longest) * (at(longest) / 2 + 1));
  folded_.resize(at(longest / kOversampling) * (at(longest / kOversampling) / 2 + 1));
}

double Optics::noise_blur_px() const noexcept {
  constexpr int kSteps = 128;  // over a quarter of the plane; a thousandth off at 64
  const double pitch_m = spec_.camera.pixel_pitch_m;
  const double step = diffraction_.cutoff_per_m() * pitch_m / kSteps;  // cycles per pixel
  double integral = 0;
  for (int i = 0; i < kSteps; ++i) {
    for (int k = 0; k < kSteps; ++k) {
      const double fx = (i + 0.5) * step;
      const double fy = (k + 0.5) * step;
      const double otf = diffraction_.at(std::hypot(fx, fy) / pitch_m) * sinc(fx) * sinc(fy);
      integral += 4.0 * step * step * otf * otf;
    }
  }
  return std::sqrt(1.0 / (4.0 * kPi * integral));
}

/// Calls work(share, index) for every index in [0, count); a share never runs twice at once.
template <class Work>
void Optics::share(int count, const Work& work) noexcept {
  const int shares = static_cast<int>(lines_.size());
  pool_.rows(0, shares, [&](int s) {
    for (int i = count * s / shares; i < count * (s + 1) / shares; ++i) work(at(s), i);
  });
}

int Optics::wing_for(const Radiance& in) const noexcept {
  double flux = 0;  // of the target, in pixels of even irradiance
  for (const float cell : in.grid.pixels()) flux += static_cast<double>(cell);
  if (!in.earth.empty() && !in.region.empty()) {
    // What is hidden spreads as what is sent does; the two together bound their difference.
    double hidden = 0;
    for (const float cell : in.cover.pixels()) hidden += static_cast<double>(cell);
    flux += hidden * std::abs(in.earth.at({0.5 * (in.region.left + in.region.right),
                                           0.5 * (in.region.top + in.region.bottom)}));
  }
  flux *= throughput_sr_ / (kOversampling * kOversampling);
  const double points_to_flux = throughput_sr_ / std::pow(spec_.camera.ifov_rad(), 2);
  for (const PointSource& p : in.points) flux += p.irradiance_w_m2 * points_to_flux;
  // Averaged over a turn an Airy pattern falls as lambda N / (pi^3 p r^3), r in pixels.
  const double wavelength_m = 0.5 * (spec_.band.band_low_m + spec_.band.band_high_m);
  const double airy = wavelength_m * spec_.camera.focal_length_m /
                      (spec_.band.aperture_m * spec_.camera.pixel_pitch_m * std::pow(kPi, 3));
  const double reach_px = std::cbrt(airy * flux / faint_w_m2_);
  return static_cast<int>(
      std::clamp(std::ceil(reach_px), 1.0 * kSmallestWing_px, 1.0 * spec_.largest_wing_px));
}

Optics::Grid Optics::grid_for(const Radiance& in, int wing_px) const noexcept {
  const auto smear = [&](double motion) {
    return static_cast<int>(std::min(std::ceil(std::abs(motion) / 2.0), 1.0 * wing_px));
  };
  const int margin_x = wing_px + smear(in.motion_px.u);
  const int margin_y = wing_px + smear(in.motion_px.v);
  Grid grid;
  grid.pixels_x = fast_length(in.region.width() + 2 * margin_x);
  grid.pixels_y = fast_length(in.region.height() + 2 * margin_y);
  grid.left = in.region.left - margin_x;
  grid.top = in.region.top - margin_y;
  const double cells_per_m = kOversampling / spec_.camera.pixel_pitch_m;
  const double cutoff = diffraction_.cutoff_per_m() / cells_per_m * grid.cells_x();
  grid.columns = std::min(grid.cells_x() / 2, static_cast<int>(cutoff)) + 1;
  return grid;
}

OpticsReport Optics::project(const Radiance& in, IrradianceImage& out) noexcept {
  ENSURE(in.oversampling == kOversampling);
  out.resize(spec_.camera.width_px, spec_.camera.height_px);
  std::fill(out.pixels().begin(), out.pixels().end(),
            static_cast<float>(in.uniform_w_m2_sr * throughput_sr_));
  if (!in.earth.empty()) {
    share(out.height(), [&](std::size_t, int v) {
      in.earth.add_row(v, 0, static_cast<float>(throughput_sr_), out.row(v));
    });
  }
  OpticsReport report;
  if (in.region.empty()) return report;

  report.wing_px = wing_for(in);
  const Grid grid = grid_for(in, report.wing_px);
  report.window =
      PixelRect{grid.left, grid.top, grid.left + grid.pixels_x, grid.top + grid.pixels_y}
          .clipped_to(spec_.camera.frame());
  const double wavelength_m = 0.5 * (spec_.band.band_low_m + spec_.band.band_high_m);
  report.lost_flux_share =
      2.0 * wavelength_m * spec_.camera.focal_length_m /
      (spec_.band.aperture_m * spec_.camera.pixel_pitch_m * kPi * kPi * report.wing_px);
  transform_rows(in, grid);
  blur_columns(in, grid);
  fold_columns(grid);
  sample_rows(grid, out);
  return report;
}

/// A row of the grid without what the target hides. `behind` is for the background's pixels.
void Optics::copy_cells(const Radiance& in, int row, std::span<float> behind,
                        std::span<float> line) const noexcept {
  const auto cells = in.grid.row(row);
  std::copy(cells.begin(), cells.end(), line.begin());
  if (in.earth.empty()) return;
  std::fill(behind.begin(), behind.end(), static_cast<float>(in.uniform_w_m2_sr));
  in.earth.add_row(in.region.top + row / kOversampling, in.region.left, 1.0F, behind);
  const auto cover = in.cover.row(row);
  for (std::size_t i = 0; i < line.size(); ++i) line[i] -= cover[i] * behind[i / at(kOversampling)];
}

void Optics::transform_rows(const Radiance& in, const Grid& grid) noexcept {
  // The middle cell of a pixel is its centre; it must fall on every third cell of the grid, so the
  // first cell of the region lies one before.
  const int first_column = (in.region.left - grid.left) * kOversampling - 1;
  const int first_row = (in.region.top - grid.top) * kOversampling - 1;
  const int rows = in.grid.height();
  ENSURE(in.earth.empty() || in.cover.pixels().size() == in.grid.pixels().size());
  share(grid.columns, [&](std::size_t, int column) {
    const auto line = spectrum_.begin() + static_cast<std::ptrdiff_t>(column) * grid.cells_y();
    std::fill(line, line + first_row, Complex{});
    std::fill(line + first_row + rows, line + grid.cells_y(), Complex{});
  });
  share(rows, [&](std::size_t s, int row) {
    const auto line = std::span(line_real_[s]).first(at(grid.cells_x()));
    std::fill(line.begin(), line.end(), 0.0F);
    copy_cells(in, row, std::span(behind_[s]).first(at(in.region.width())),
               line.subspan(at(first_column), at(in.grid.width())));
    const auto half = std::span(line_out_[s]).first(line.size() / 2 + 1);
    lines_[s].forward(std::span<const float>(line), half);
    for (int column = 0; column < grid.columns; ++column)
      spectrum_[at(column) * at(grid.cells_y()) + at(first_row + row)] = half[at(column)];
  });
}

void Optics::blur_columns(const Radiance& in, const Grid& grid) noexcept {
  share(grid.columns, [&](std::size_t s, int column) {
    const auto line =
        std::span(spectrum_).subspan(at(column) * at(grid.cells_y()), at(grid.cells_y()));
    const auto copy = std::span(line_in_[s]).first(line.size());
    std::copy(line.begin(), line.end(), copy.begin());
    lines_[s].forward(std::span<const Complex>(copy), line);
    if (!in.points.empty()) add_points(in, grid, column, copy, line);
    multiply_otf(in, grid, column, line);
  });
}

/// `sum` is for what the points add.
void Optics::add_points(const Radiance& in, const Grid& grid, int column, std::span<Complex> sum,
                        std::span<Complex> spectrum) const noexcept {
  const double fx = static_cast<double>(column) / grid.pixels_x;  // cycles per pixel
  const double cell = 1.0 / kOversampling;
  // A cell's solid angle turns the irradiance of a point into the radiance of one cell. A point is
  // no average over a cell: what multiply_otf() takes out for that goes in here.
  const double to_radiance = std::pow(kOversampling / spec_.camera.ifov_rad(), 2) * sinc(fx * cell);
  const int rows = grid.cells_y();
  std::ranges::fill(sum, Complex{});
  for (const PointSource& p : in.points) {
    const double x = p.place.u - grid.left;
    const double y = p.place.v - grid.top;
    const double amplitude = p.irradiance_w_m2 * to_radiance;
    // Turned by the same angle from wave to wave: a thousand turns are good to 1e-13.
    const std::complex<double> turn = std::polar(1.0, -2.0 * kPi * y / grid.pixels_y);
    std::complex<double> up = std::polar(amplitude, -2.0 * kPi * fx * x);  // at frequency k
    std::complex<double> down = up;                                        // and -k
    sum[0] += Complex(up);
    for (int k = 1; k <= rows / 2; ++k) {
      up = {up.real() * turn.real() - up.imag() * turn.imag(),
            up.real() * turn.imag() + up.imag() * turn.real()};
      down = {down.real() * turn.real() + down.imag() * turn.imag(),
              down.imag() * turn.real() - down.real() * turn.imag()};
      sum[at(k)] += Complex(up);
      if (k < rows - k) sum[at(rows - k)] += Complex(down);
    }
  }
  for (int k = 0; k < rows; ++k) {
    const double fy = static_cast<double>(std::min(k, rows - k)) / grid.pixels_y;
    spectrum[at(k)] += sum[at(k)] * static_cast<float>(sinc(fy * cell));
  }
}

void Optics::multiply_otf(const Radiance& in, const Grid& grid, int column,
                          std::span<Complex> spectrum) const noexcept {
  const double cell = 1.0 / kOversampling;
  const double fx = static_cast<double>(column) / grid.pixels_x;  // cycles per pixel
  const double pixel_x = sinc(fx) / sinc(fx * cell);
  const double per_m = 1.0 / spec_.camera.pixel_pitch_m;
  const bool smears = std::hypot(in.motion_px.u, in.motion_px.v) > kUnseenSmear_px;
  for (int k = 0; k < grid.cells_y(); ++k) {
    const int signed_k = k <= grid.cells_y() / 2 ? k : k - grid.cells_y();
    const double fy = static_cast<double>(signed_k) / grid.pixels_y;
    double otf = diffraction_.at(std::sqrt(fx * fx + fy * fy) * per_m);
    if (otf != 0.0) {
      otf *= pixel_x * sinc(fy) / sinc(fy * cell);
      if (smears) otf *= sinc(fx * in.motion_px.u + fy * in.motion_px.v);
    }
    spectrum[at(k)] *= static_cast<float>(otf);
  }
}

void Optics::fold_columns(const Grid& grid) noexcept {
  // Taking every third cell adds up the spectrum's aliases: exact, and a ninth of the inverse work.
  const int m_x = grid.pixels_x;
  const int m_y = grid.pixels_y;
  const int n_x = grid.cells_x();
  const int n_y = grid.cells_y();
  share(m_x / 2 + 1, [&](std::size_t s, int column) {
    const auto sum = std::span(line_in_[s]).first(at(m_y));
    std::fill(sum.begin(), sum.end(), Complex{});
    for (int alias = 0; alias < kOversampling; ++alias) {
      const int kx = column + alias * m_x;
      const bool mirrored = kx > n_x / 2;
      const int stored = mirrored ? n_x - kx : kx;
      if (stored >= grid.columns) continue;
      const Complex* line = &spectrum_[at(stored) * at(n_y)];
      for (int ky = 0; ky < n_y; ++ky) {
        const Complex value = mirrored ? std::conj(line[ky == 0 ? 0 : n_y - ky]) : line[ky];
        sum[at(ky % m_y)] += value;
      }
    }
    lines_[s].inverse(std::span<const Complex>(sum),
                      std::span(folded_).subspan(at(column) * at(m_y), at(m_y)));
  });
}

void Optics::sample_rows(const Grid& grid, IrradianceImage& out) noexcept {
  const float scale = static_cast<float>(
      throughput_sr_ / (static_cast<double>(grid.cells_x()) * static_cast<double>(grid.cells_y())));
  const PixelRect frame = spec_.camera.frame();
  share(grid.pixels_y, [&](std::size_t s, int row) {
    const int v = grid.top + row;
    if (v < frame.top || v >= frame.bottom) return;
    const auto half = std::span(line_in_[s]).first(at(grid.pixels_x / 2 + 1));
    for (int column = 0; column <= grid.pixels_x / 2; ++column)
      half[at(column)] = folded_[at(column) * at(grid.pixels_y) + at(row)];
    const auto line = std::span(line_real_[s]).first(at(grid.pixels_x));
    lines_[s].inverse(std::span<const Complex>(half), line);
    const auto target = out.row(v);
    for (int i = std::max(0, -grid.left); i < grid.pixels_x && grid.left + i < frame.right; ++i)
      target[at(grid.left + i)] += scale * line[at(i)];
  });
}

}  // namespace engine
