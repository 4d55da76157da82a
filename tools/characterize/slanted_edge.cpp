#include "tools/characterize/slanted_edge.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <stdexcept>

#include "engine/core/constants.h"
#include "engine/optics/mtf.h"
#include "tools/characterize/line_fit.h"

namespace characterize {
namespace {

constexpr int kFrequencies = 100;
constexpr double kSearch_px = 10;  // half the width of the window that finds the edge in a row

/// Flat over the inner half, then a cosine to 0 at 1.
double window(double x) {
  const double t = std::abs(x);
  if (t >= 1.0) return 0.0;
  return t <= 0.5 ? 1.0 : 0.5 + 0.5 * std::cos(engine::kPi * (2.0 * t - 1.0));
}

/// The middle of a row's rise about `guess`, by what is within `half_px`; not a number for a row
/// that rises nowhere, or with a pixel that is none unless the row is taken as it is.
double crossing(const EdgeImage& image, int v, double guess, double half_px, bool as_it_is) {
  double sum = 0;
  double moment = 0;
  for (int u = 0; u + 1 < image.width; ++u) {
    const double place = u + 0.5;
    const double weight = window((place - guess) / half_px);
    if (weight == 0.0) continue;
    const double rise = weight * (image.at(u + 1, v) - image.at(u, v));
    if (as_it_is && std::isnan(rise)) continue;
    sum += rise;
    moment += rise * place;
  }
  return std::abs(sum) > 0.1 ? moment / sum : std::numeric_limits<double>::quiet_NaN();
}

struct Crossings {
  std::vector<double> v;
  std::vector<double> u;
};

Crossings crossings(const EdgeImage& image, const Line& guess, double half_px, bool as_it_is) {
  Crossings found;
  for (int v = 0; v < image.height; ++v) {
    const double u = crossing(image, v, guess.at(v), half_px, as_it_is);
    if (std::isnan(u)) continue;
    found.v.push_back(v);
    found.u.push_back(u);
  }
  return found;
}

/// Of the edge: u against v.
Line find_edge(const EdgeImage& image) {
  constexpr int kRounds = 6;  // the window follows what it finds
  constexpr std::size_t kLeastRows = 8;
  Line line;
  line.intercept.value = 0.5 * (image.width - 1);
  for (int round = 0; round < kRounds; ++round) {
    const double half_px = round == 0 ? image.width : kSearch_px;
    Crossings found = crossings(image, line, half_px, round == 0);
    // Every row has a defect.
    if (found.v.size() < kLeastRows) found = crossings(image, line, half_px, true);
    if (found.v.size() < kLeastRows) throw std::runtime_error("slanted edge: there is none");
    line = fit_line(found.v, found.u, std::vector<double>(found.v.size(), 1.0));
  }
  return line;
}

struct Bin {
  double value = 0;  ///< sums
  double distance = 0;
  int count = 0;
};

std::vector<Bin> bins_of(const EdgeImage& image, const EdgeResponse& edge, int half) {
  std::vector<Bin> bins(static_cast<std::size_t>(2 * half + 1));
  const double to_distance = 1.0 / std::hypot(1.0, edge.slope);
  for (int v = 0; v < image.height; ++v) {
    for (int u = 0; u < image.width; ++u) {
      const double distance = (u - edge.offset_px - edge.slope * v) * to_distance;
      const auto bin = static_cast<long>(std::floor(distance / kEdgeBin_px + 0.5)) + half;
      if (bin < 0 || bin >= static_cast<long>(bins.size()) || std::isnan(image.at(u, v))) continue;
      Bin& here = bins[static_cast<std::size_t>(bin)];
      here.value += image.at(u, v);
      here.distance += distance;
      ++here.count;
    }
  }
  return bins;
}

void fill_spread(const EdgeImage& image, double reach_px, EdgeResponse& out) {
  const int half = static_cast<int>(std::floor(reach_px / kEdgeBin_px));
  const std::vector<Bin> bins = bins_of(image, out, half);
  std::vector<double> mean;
  for (std::size_t i = 0; i < bins.size(); ++i) {
    if (bins[i].count == 0)
      throw std::runtime_error("slanted edge: the image is too small for its window");
    mean.push_back(bins[i].value / bins[i].count);
    out.distance_px.push_back((static_cast<double>(i) - half) * kEdgeBin_px);
  }
  // A bin's pixels lie off its middle, alike from pixel to pixel: 1 % of the MTF at Nyquist.
  out.spread = mean;
  for (std::size_t i = 1; i + 1 < bins.size(); ++i) {
    const double off_px = bins[i].distance / bins[i].count - out.distance_px[i];
    out.spread[i] -= off_px * (mean[i + 1] - mean[i - 1]) / (2.0 * kEdgeBin_px);
  }
}

void transform(double reach_px, EdgeResponse& out) {
  for (int k = 0; k <= kFrequencies; ++k) {
    const double f = 0.5 * k / kFrequencies;
    std::complex<double> sum = 0;
    for (std::size_t i = 0; i + 1 < out.spread.size(); ++i) {
      const double x = out.distance_px[i] + 0.5 * kEdgeBin_px;
      sum += window(x / reach_px) * (out.spread[i + 1] - out.spread[i]) *
             std::polar(1.0, -2.0 * engine::kPi * f * x);
    }
    // Once for the bin's average, once for the difference.
    out.cycles_per_px.push_back(f);
    out.mtf.push_back(std::abs(sum) / std::pow(engine::sinc(f * kEdgeBin_px), 2));
  }
}

}  // namespace

EdgeResponse slanted_edge(const EdgeImage& image, double reach_px) {
  EdgeResponse out;
  const Line line = find_edge(image);
  out.offset_px = line.intercept.value;
  out.slope = line.slope.value;
  fill_spread(image, reach_px, out);
  transform(reach_px, out);
  return out;
}

engine::RadianceImage half_plane(const engine::PixelRect& region, int s, engine::PixelPoint on,
                                 engine::PixelPoint normal, double far_side) {
  const double cell = 1.0 / s;
  // The area of a square beyond a line: a ramp averaged over the square's two sides as the line
  // sees them (a fourth difference of squares).
  const double a = std::max(std::abs(normal.u), 1e-3) * cell;
  const double b = std::max(std::abs(normal.v), 1e-3) * cell;
  const auto ramp = [](double x) { return x > 0.0 ? x * x : 0.0; };
  engine::RadianceImage out(region.width() * s, region.height() * s);
  for (int y = 0; y < out.height(); ++y) {
    const double v = region.top + (y + 0.5) * cell - 0.5 - on.v;
    for (int x = 0; x < out.width(); ++x) {
      const double u = region.left + (x + 0.5) * cell - 0.5 - on.u;
      const double d = u * normal.u + v * normal.v;
      const double share = (ramp(d + 0.5 * (a + b)) - ramp(d + 0.5 * (a - b)) -
                            ramp(d - 0.5 * (a - b)) + ramp(d - 0.5 * (a + b))) /
                           (2.0 * a * b);
      out.at(x, y) = static_cast<float>(far_side * std::clamp(share, 0.0, 1.0));
    }
  }
  return out;
}

}  // namespace characterize
