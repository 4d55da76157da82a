#include "engine/scene/tabulated_brdf.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "engine/core/constants.h"
#include "engine/scene/hemisphere_integral.h"
#include "engine/scene/surface_frame.h"

namespace engine {
namespace {

using Eigen::Vector3d;

// Below this share of the even part a surface has no lobe: a Lambert surface, as goniometers go.
constexpr double kEven = 0.02;
// One whose light goes elsewhere than to the mirror is as wide as anything.
constexpr double kShapeless_rad = 0.5;

template <class Table>
double by_cosine(const Table& table, double cos_in) noexcept {
  const auto cells = static_cast<double>(table.size());
  const double cell = std::clamp(cos_in * cells - 0.5, 0.0, cells - 1.0);
  const auto low = std::min(static_cast<std::size_t>(cell), table.size() - 2);
  const double part = cell - static_cast<double>(low);
  return (1.0 - part) * static_cast<double>(table[low]) +
         part * static_cast<double>(table[low + 1]);
}

}  // namespace

TabulatedBrdf::TabulatedBrdf(std::shared_ptr<const BrdfGrid> grid, bool reciprocal)
    : grid_(std::move(grid)), reciprocal_(reciprocal) {
  find_asides();
  tabulate_albedo();
  find_even_part();
  find_lobe();
}

void TabulatedBrdf::find_asides() {
  for (std::size_t i = 0; i < grid_->incidences(); ++i) {
    const auto& out = grid_->lobe_aside(i);
    if (!out) continue;
    const double theta_rad = grid_->incidence_rad(i);
    asides_.push_back({theta_rad, *out});
    const double sin_out = std::hypot(out->x(), out->y());
    if (!reciprocal_ || !(sin_out > 0.0)) continue;
    // The same path the other way, turned so that its light comes from x below 0.
    const Vector3d back = incident_direction(theta_rad);
    const double x = -(back.x() * out->x() + back.y() * out->y()) / sin_out;
    const double y = std::abs(back.x() * out->y() - back.y() * out->x()) / sin_out;
    asides_.push_back({std::atan2(sin_out, out->z()), {x, y, back.z()}});
  }
}

std::vector<Vector3d> TabulatedBrdf::lobes_aside(double cos_in) const {
  // Two incidences are interpolated, each both ways.
  constexpr std::size_t kMost = 4;
  const double theta_rad = std::acos(std::clamp(cos_in, 0.0, 1.0));
  std::vector<Aside> nearest = asides_;
  std::ranges::stable_sort(nearest, {},
                           [&](const Aside& a) { return std::abs(a.theta_in_rad - theta_rad); });
  nearest.resize(std::min(nearest.size(), kMost));
  std::vector<Vector3d> lobes;
  for (const Aside& a : nearest) {
    const Vector3d out = grid_->carried(a.theta_in_rad, a.out, theta_rad);
    constexpr double kSame = 1e-6;
    if (std::ranges::none_of(lobes,
                             [&](const Vector3d& l) { return one_minus_cos(l, out) < kSame; }))
      lobes.push_back(out);
  }
  return lobes;
}

double TabulatedBrdf::unlimited(const Vector3d& in, const Vector3d& out) const noexcept {
  if (in.z() <= kGrazing || out.z() <= kGrazing) return 0.0;
  if (!reciprocal_) return grid_->at(in, out);
  return 0.5 * (grid_->at(in, out) + grid_->at(out, in));
}

double TabulatedBrdf::limit(double cos_in) const noexcept {
  return 1.0 / std::max(1.0, by_cosine(measured_albedo_, cos_in));
}

double TabulatedBrdf::eval(const Vector3d& in, const Vector3d& out) const noexcept {
  const double f = unlimited(in, out);
  if (!limited_) return f;
  return f * (reciprocal_ ? std::min(limit(in.z()), limit(out.z())) : limit(in.z()));
}

double TabulatedBrdf::albedo(double cos_in) const noexcept {
  return cos_in <= kGrazing ? 0.0 : std::min(1.0, by_cosine(albedo_, cos_in));
}

double TabulatedBrdf::albedo_as_measured(double cos_in) const noexcept {
  return cos_in <= kGrazing ? 0.0 : by_cosine(measured_albedo_, cos_in);
}

void TabulatedBrdf::tabulate_albedo() {
  const auto integral = [&](double cos_in, const auto& f) {
    if (asides_.empty()) return hemisphere_integral<96, 32>(cos_in, f);
    return hemisphere_integral<96, 32>(cos_in, lobes_aside(cos_in), f);
  };
  const auto tabulate = [&](const auto& f) {
    ByCosine table{};
    for (std::size_t a = 0; a < table.size(); ++a)
      table[a] = static_cast<float>(integral((static_cast<double>(a) + 0.5) / kAngles, f));
    return table;
  };
  const auto as_measured = [this](const Vector3d& in, const Vector3d& out) {
    return unlimited(in, out);
  };
  albedo_ = measured_albedo_ = tabulate(as_measured);
  // Nothing is tabulated nearer to the normal than 5 deg, and what holds there may be more; nor
  // right where a lobe off the mirror was measured, that fades between incidences.
  const auto raise = [&](double cos_in) {
    const auto most = static_cast<float>(integral(cos_in, as_measured));
    const double cell = std::clamp(cos_in * kAngles - 0.5, 0.0, kAngles - 1.0);
    for (const double side : {std::floor(cell), std::ceil(cell)}) {
      float& there = measured_albedo_[static_cast<std::size_t>(side)];
      there = std::max(there, most);
    }
  };
  raise(1.0);
  for (const Aside& a : asides_) raise(std::cos(a.theta_in_rad));
  limited_ = *std::ranges::max_element(measured_albedo_) > 1.0F;
  if (limited_)
    albedo_ = tabulate([this](const Vector3d& in, const Vector3d& out) { return eval(in, out); });
}

std::vector<double> TabulatedBrdf::sorted_values(const Vector3d& in) const {
  constexpr int kRings = 16;
  constexpr int kTurns = 64;
  std::vector<double> values;
  for (int ring = 0; ring < kRings; ++ring) {
    const double r2 = (ring + 0.5) / kRings;
    for (int turn = 0; turn < kTurns; ++turn) {
      const double azimuth = 2.0 * kPi * (turn + 0.5) / kTurns;
      const double r = std::sqrt(r2);
      values.push_back(
          eval(in, {r * std::cos(azimuth), r * std::sin(azimuth), std::sqrt(1.0 - r2)}));
    }
  }
  std::ranges::sort(values);
  return values;
}

void TabulatedBrdf::find_even_part() {
  bool even = asides_.empty();
  bool even_first = even;
  double most_out = 0;
  for (std::size_t i = 0; i < grid_->incidences(); ++i) {
    const Vector3d in = incident_direction(grid_->incidence_rad(i));
    const std::vector<double> values = sorted_values(in);
    if (i == 0) {
      even_per_sr_ = values[values.size() / 2];
      diffuse_albedo_ = std::min(kPi * even_per_sr_, albedo(in.z()));
    }
    const double most = std::max(values.back(), eval(in, mirrored(in)));
    even = even && values.back() - values.front() <= kEven * even_per_sr_ &&
           std::abs(most / even_per_sr_ - 1.0) <= kEven;
    if (i == 0) even_first = even;
    const double stands_out = even_first ? excess(in, 0.0) : 0.0;
    if (!(stands_out > most_out)) continue;
    most_out = stands_out;
    lobe_at_ = i;
  }
  lobe_half_width_rad_ = even ? 0.0 : kShapeless_rad;
}

double TabulatedBrdf::excess(const Vector3d& in, double x) const noexcept {
  constexpr int kTurns = 16;
  const double sin_h = std::sqrt(x * (2.0 - x));
  double sum = 0;
  for (int turn = 0; turn < kTurns; ++turn) {
    const double azimuth = kPi * (turn + 0.5) / kTurns;
    const Vector3d h(sin_h * std::cos(azimuth), sin_h * std::sin(azimuth), 1.0 - x);
    const Vector3d out = 2.0 * in.dot(h) * h - in;
    if (in.dot(h) > 0.0 && out.z() > kGrazing) sum += std::max(0.0, eval(in, out) - even_per_sr_);
  }
  return sum / kTurns;
}

void TabulatedBrdf::find_lobe() {
  if (lobe_half_width_rad_ == 0.0) return;
  const Vector3d in_lobe = incident_direction(grid_->incidence_rad(lobe_at_));
  const double half = 0.5 * excess(in_lobe, 0.0);
  constexpr double kStep_rad = 2e-4;
  double width = 0;
  while (half > 0.0 && width < kShapeless_rad && excess(in_lobe, 1.0 - std::cos(width)) > half)
    width += kStep_rad;
  if (half > 0.0) lobe_half_width_rad_ = std::max(width, kStep_rad);

  // The mean of all incidences' lobes, each with the same weight, is what half vectors are drawn
  // with.
  constexpr int kNodes = 256;
  const auto x_at = [](int i) { return std::pow(static_cast<double>(i) / kNodes, 4.0); };
  std::vector<double> profile(kNodes + 1, 0.0);
  for (std::size_t k = 0; k < grid_->incidences(); ++k) {
    const Vector3d in = incident_direction(grid_->incidence_rad(k));
    std::vector<double> own(profile.size());
    double sum = 0;
    for (int i = 0; i <= kNodes; ++i) {
      own[static_cast<std::size_t>(i)] = excess(in, x_at(i));
      sum += own[static_cast<std::size_t>(i)] * (x_at(std::min(i + 1, kNodes)) - x_at(i));
    }
    for (std::size_t i = 0; sum > 0.0 && i < own.size(); ++i) profile[i] += own[i] / sum;
  }
  // So much everywhere that no half vector is rare where the table has a lobe of its own.
  constexpr double kLeast = 0.05;
  for (double& p : profile) p += kLeast * static_cast<double>(grid_->incidences());
  lobe_sampler_ = HalfVectorLobe([&](double x) {
    const double place = std::pow(x, 0.25) * kNodes;
    const auto low = std::min(static_cast<std::size_t>(place), profile.size() - 2);
    const double part = place - static_cast<double>(low);
    return (1.0 - part) * profile[low] + part * profile[low + 1];
  });
}

double TabulatedBrdf::lobe_share(const Vector3d& out) const noexcept {
  if (lobe_half_width_rad_ == 0.0) return 0.0;
  const double all = albedo(out.z());
  // Never less than a tenth of either: a direction that one of them finds must stay findable.
  return std::clamp(std::max(0.0, all - diffuse_albedo_) / (all + 1e-12), 0.1, 0.9);
}

}  // namespace engine
