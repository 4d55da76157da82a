#include "engine/scene/brdf_fit.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <string>
#include <tuple>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

#include "engine/core/constants.h"
#include "engine/core/contract.h"
#include "engine/scene/surface_frame.h"

namespace engine {
namespace {

using Eigen::Vector3d;
using Vector = Eigen::Matrix<double, kFitParameters, 1>;
using Matrix = BrdfFit::Correlation;

constexpr std::size_t kLeastPoints = 12;
// Off by more than this a parameter is not known.
constexpr double kUndetermined = 0.5;
// A model of so many sigmas stands clear of the noise. Not the reading: some are bright by chance.
constexpr double kClear = 3.0;
constexpr double kFurthestOff = 1e6;
constexpr int kMostSteps = 200;
constexpr int kMostWeighings = 50;
constexpr std::size_t kStartsRefined = 4;

std::size_t at(FitParameter p) noexcept { return static_cast<std::size_t>(p); }

/// In logarithms: of -br instead of br.
FiveParameters parameters_of(const Vector& u) noexcept {
  FiveParameters p;
  p.ar = std::exp(u[0]);
  p.br = -std::exp(u[1]);
  p.kb = std::exp(u[2]);
  p.kd = std::exp(u[3]);
  p.kr = std::exp(u[4]);
  return p;
}

/// Those that are held are so to the last bit.
FiveParameters parameters_of(const Vector& u, const BrdfFitSpec& spec) noexcept {
  FiveParameters p = parameters_of(u);
  const std::array<double*, kFitParameters> all{&p.ar, &p.br, &p.kb, &p.kd, &p.kr};
  for (std::size_t i = 0; i < all.size(); ++i) *all[i] = spec.fixed[i].value_or(*all[i]);
  return p;
}

/// A point with what the model asks of its directions.
struct Point {
  FacetGeometry geometry;
  double diffuse = 1;  ///< the diffuse term is so many kd
  double value = 0;
  double sigma = 0;
  std::size_t index = 0;  ///< in the file's list

  Point(const Vector3d& in, const Vector3d& out, FiveParameterBrdf::Variant variant) noexcept
      : geometry(in, out),
        diffuse(variant == FiveParameterBrdf::Variant::kPaper ? 1.0 / in.z() : 1.0) {}

  /// The model, and its derivatives by the logarithms.
  double model(const FiveParameters& p, Vector& by_log) const noexcept {
    const double f = geometry.fresnel_like(p.kr);
    const double power = geometry.x > 0.0 ? p.br * std::pow(geometry.x, p.ar) : 0.0;
    const double specular = p.kb * f * std::exp(power) * geometry.masking / geometry.cosines;
    const double log_x = geometry.x > 0.0 ? std::log(geometry.x) : 0.0;
    by_log = {specular * power * p.ar * log_x, specular * power, specular, p.kd * diffuse,
              specular * 2.0 * (1.0 - f)};
    return specular + p.kd * diffuse;
  }
};

/// Sums of a least-squares step: residuals r and their derivatives J.
struct Sums {
  Matrix jj = Matrix::Zero();
  Vector jr = Vector::Zero();
  double chi2 = 0;

  void add(double residual, const Vector& by_log) {
    jj += by_log * by_log.transpose();
    jr += by_log * residual;
    chi2 += residual * residual;
  }
};

/// Points, and how they are compared with the model.
class Problem {
 public:
  Problem(std::vector<Point> points, const BrdfFitSpec& spec) : points_(std::move(points)) {
    for (std::size_t i = 0; i < kFitParameters; ++i) free_[i] = !spec.fixed[i].has_value();
  }

  /// In logarithms: forgiving far from the solution, where values are off by factors.
  [[nodiscard]] Sums in_logarithms(const Vector& u) const {
    // Where the noise is as large as the reading the logarithm says little.
    constexpr double kLeastNoise = 0.05;
    return sums(u, [](const Point& p, double model, Vector& by_log) {
      if (!(p.value > 0.0) || !(model > 0.0)) {
        by_log.setZero();
        return p.value > 0.0 ? 1e3 : 0.0;
      }
      const double weight = 1.0 / std::hypot(kLeastNoise, p.sigma / p.value);
      by_log *= -weight / model;
      return weight * std::log(p.value / model);
    });
  }
  /// By the noise of each point.
  [[nodiscard]] Sums by_noise(const Vector& u, const std::vector<double>& noise) const {
    return sums(u, [&](const Point& p, double model, Vector& by_log) {
      const double sigma = noise[static_cast<std::size_t>(&p - points_.data())];
      by_log *= -1.0 / sigma;
      return (p.value - model) / sigma;
    });
  }
  /// Stated; or the model's own value.
  [[nodiscard]] std::vector<double> noise_at(const Vector& u) const {
    const FiveParameters parameters = parameters_of(u);
    std::vector<double> noise;
    Vector unused;
    for (const Point& p : points_)
      noise.push_back(p.sigma > 0.0 ? p.sigma
                                    : std::max(p.model(parameters, unused),
                                               std::numeric_limits<double>::min() * 1e20));
    return noise;
  }
  /// Levenberg and Marquardt. `u` is moved to the minimum; false when it was not reached.
  template <class Compare>
  bool minimise(Vector& u, const Compare& compare) const {
    double damping = 1e-3;
    Sums here = compare(u);
    if (!std::isfinite(here.chi2)) return false;
    for (int step = 0; step < kMostSteps; ++step) {
      Matrix damped = here.jj;
      for (Eigen::Index i = 0; i < damped.rows(); ++i)
        damped(i, i) += damping * std::max(here.jj(i, i), 1e-12 * here.jj.diagonal().maxCoeff());
      Vector move = damped.ldlt().solve(-here.jr);
      if (!move.allFinite()) return false;
      // No parameter by more than a factor of four at once.
      move = move.cwiseMax(-1.4).cwiseMin(1.4);
      const Vector there = (u + move).cwiseMax(-kFarthest).cwiseMin(kFarthest);
      const Sums sums_there = compare(there);
      if (std::isfinite(sums_there.chi2) && sums_there.chi2 <= here.chi2) {
        const bool settled = (there - u).cwiseAbs().maxCoeff() < 1e-10 ||
                             here.chi2 - sums_there.chi2 <= 1e-14 * here.chi2;
        u = there;
        here = sums_there;
        damping = std::max(1e-12, 0.1 * damping);
        if (settled) return true;
      } else {
        damping *= 10.0;
        if (damping > 1e12) return true;  // no way down
      }
    }
    return false;
  }
  [[nodiscard]] const std::vector<Point>& points() const noexcept { return points_; }
  [[nodiscard]] std::size_t free_parameters() const noexcept {
    return static_cast<std::size_t>(std::ranges::count(free_, true));
  }
  [[nodiscard]] bool is_free(std::size_t i) const noexcept { return free_[i]; }

 private:
  static constexpr double kFarthest = 30.0;  // e to this is beyond any surface

  template <class Residual>
  [[nodiscard]] Sums sums(const Vector& u, const Residual& residual) const {
    const FiveParameters parameters = parameters_of(u);
    Sums sums;
    for (const Point& p : points_) {
      Vector by_log;
      const double model = p.model(parameters, by_log);
      const double r = residual(p, model, by_log);
      for (std::size_t i = 0; i < kFitParameters; ++i)
        if (!free_[i]) by_log[static_cast<Eigen::Index>(i)] = 0.0;
      sums.add(r, by_log);
    }
    for (std::size_t i = 0; i < kFitParameters; ++i) {
      const auto k = static_cast<Eigen::Index>(i);
      if (!free_[i]) sums.jj(k, k) = 1.0;
    }
    return sums;
  }

  std::vector<Point> points_;
  std::array<bool, kFitParameters> free_{};
};

std::vector<Point> points_for(const BrdfPoints& all, const BrdfFitSpec& spec) {
  std::vector<Point> points;
  std::set<std::tuple<double, double, double>> directions;
  for (std::size_t i = 0; i < all.points.size(); ++i) {
    const BrdfPoint& p = all.points[i];
    const Vector3d in = incident_direction(p);
    const Vector3d out = scatter_direction(all.angles, p);
    if (in.z() <= kGrazing || out.z() <= kGrazing) continue;
    Point point(in, out, spec.variant);
    point.value = p.brdf_per_sr;
    point.sigma = p.sigma_per_sr;
    point.index = i;
    points.push_back(point);
    directions.insert({p.theta_in_deg, p.first_deg, p.second_deg});
  }
  const std::string need = " are needed, and has ";
  if (points.size() < kLeastPoints)
    throw ConfigError(all.path + ": " + std::to_string(kLeastPoints) + " points above the horizon" +
                      need + std::to_string(points.size()));
  if (directions.size() < kLeastPoints)
    throw ConfigError(all.path + ": " + std::to_string(kLeastPoints) + " different directions" +
                      need + std::to_string(directions.size()));
  if (std::ranges::none_of(points, [](const Point& p) { return p.value > 0.0; }))
    throw ConfigError(all.path + ": has no light: brdf_per_sr is 0 everywhere");
  return points;
}

/// The value below which this share of all lie.
double quantile(std::vector<double> values, double share) {
  const auto at = static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::ranges::nth_element(values, values.begin() + at);
  return values[static_cast<std::size_t>(at)];
}

/// Shapes of the lobe by their exponents and widths, each with the diffuse term of the dimmest
/// points and the height of the brightest.
std::vector<Vector> starts_for(const Problem& problem, const BrdfFitSpec& spec) {
  std::vector<double> dim;
  for (const Point& p : problem.points())
    if (p.value > 0.0) dim.push_back(p.value / p.diffuse);
  const double kd = 0.8 * quantile(dim, 0.1);
  std::vector<Vector> starts;
  for (const double ar : {0.35, 0.5, 0.75, 1.0}) {
    for (const double half_width_deg : {0.3, 0.8, 2.5, 8.0}) {
      for (const double kr : {0.6, 1.0, 2.0}) {
        FiveParameters p{ar, 0.0, 1.0, kd, kr};
        p.br = -std::log(2.0) / std::pow(1.0 - std::cos(half_width_deg * kDegree), ar);
        std::vector<double> heights;
        Vector by_log;
        for (const Point& point : problem.points()) {
          const double specular = point.model(p, by_log) - kd * point.diffuse;
          const double rest = point.value - kd * point.diffuse;
          if (rest > 0.0 && specular > 0.1) heights.push_back(rest / specular);
        }
        p.kb = heights.empty() ? 1.0 : quantile(heights, 0.5);
        const std::array<double, kFitParameters> guess{p.ar, -p.br, p.kb, p.kd, p.kr};
        Vector u;
        for (std::size_t i = 0; i < kFitParameters; ++i)
          u[static_cast<Eigen::Index>(i)] =
              std::log(std::max(1e-12, std::abs(spec.fixed[i].value_or(guess[i]))));
        starts.push_back(u);
      }
    }
  }
  return starts;
}

/// The best minimum in logarithms that is found from the best starts.
Vector best_in_logarithms(const Problem& problem, const BrdfFitSpec& spec) {
  const auto compare = [&](const Vector& u) { return problem.in_logarithms(u); };
  std::vector<std::pair<double, Vector>> found;
  for (const Vector& u : starts_for(problem, spec)) found.emplace_back(compare(u).chi2, u);
  const auto by_chi2 = [](const auto& a, const auto& b) { return a.first < b.first; };
  std::ranges::stable_sort(found, by_chi2);
  found.resize(std::min(found.size(), kStartsRefined));
  for (auto& [chi2, u] : found) {
    static_cast<void>(problem.minimise(u, compare));
    chi2 = compare(u).chi2;
  }
  return std::ranges::min_element(found, by_chi2)->second;
}

/// Of the free parameters' logarithms; a direction that the points do not feel is next to infinite.
Matrix covariance_of(const Problem& problem, const Matrix& jj) {
  // Scaled by what each parameter alone would be known to, so that none is small by its units.
  Vector scale;
  for (Eigen::Index i = 0; i < scale.size(); ++i)
    scale[i] = jj(i, i) > 0.0 ? 1.0 / std::sqrt(jj(i, i)) : 1.0;
  const Eigen::SelfAdjointEigenSolver<Matrix> solved(scale.asDiagonal() * jj * scale.asDiagonal());
  const Vector values = solved.eigenvalues().cwiseMax(1e-14);
  Matrix covariance = scale.asDiagonal() * solved.eigenvectors() *
                      values.cwiseInverse().asDiagonal() * solved.eigenvectors().transpose() *
                      scale.asDiagonal();
  for (std::size_t i = 0; i < kFitParameters; ++i) {
    if (problem.is_free(i)) continue;
    covariance.row(static_cast<Eigen::Index>(i)).setZero();
    covariance.col(static_cast<Eigen::Index>(i)).setZero();
  }
  return covariance;
}

void state_uncertainty(const Problem& problem, const Sums& sums, bool have_sigma, BrdfFit& fit) {
  fit.degrees = fit.points - problem.free_parameters();
  const double scatter = sums.chi2 / static_cast<double>(fit.degrees);
  fit.reduced_chi2 = have_sigma ? scatter : 1.0;
  const Matrix covariance =
      (have_sigma ? std::max(1.0, scatter) : scatter) * covariance_of(problem, sums.jj);
  for (std::size_t i = 0; i < kFitParameters; ++i) {
    if (!problem.is_free(i)) continue;
    const auto row = static_cast<Eigen::Index>(i);
    fit.sigma[i] =
        std::sqrt(covariance(row, row)) * std::abs(fit.value(static_cast<FitParameter>(i)));
    for (Eigen::Index k = 0; k < row; ++k) {
      const double both = std::sqrt(covariance(row, row) * covariance(k, k));
      fit.correlation(row, k) = fit.correlation(k, row) =
          both > 0.0 ? covariance(row, k) / both : 0.0;
    }
  }
}

}  // namespace

double BrdfFit::value(FitParameter which) const noexcept {
  const std::array<double, kFitParameters> all{parameters.ar, parameters.br, parameters.kb,
                                               parameters.kd, parameters.kr};
  return all[at(which)];
}

bool BrdfFit::undetermined(FitParameter which) const noexcept {
  return !(sigma[at(which)] < kUndetermined * std::abs(value(which)));
}

double fitted_per_sr(const FiveParameters& parameters, FiveParameterBrdf::Variant variant,
                     const Vector3d& in, const Vector3d& out) noexcept {
  Vector unused;
  return Point(in, out, variant).model(parameters, unused);
}

BrdfFit fit_brdf(const BrdfPoints& points, const BrdfFitSpec& spec) {
  const Problem problem(points_for(points, spec), spec);
  Vector u = best_in_logarithms(problem, spec);
  BrdfFit fit;
  Sums sums;
  for (int weighing = 0; weighing < kMostWeighings && !fit.converged; ++weighing) {
    const Vector before = u;
    const std::vector<double> noise = problem.noise_at(u);
    const auto compare = [&](const Vector& v) { return problem.by_noise(v, noise); };
    const bool settled = problem.minimise(u, compare);
    sums = compare(u);
    fit.converged = settled && (points.have_sigma || (u - before).cwiseAbs().maxCoeff() < 1e-7);
  }
  fit.parameters = parameters_of(u, spec);
  fit.points = problem.points().size();
  state_uncertainty(problem, sums, points.have_sigma, fit);
  fit.model_per_sr.assign(points.points.size(), 0.0);
  double sum2 = 0;
  std::size_t clear = 0;
  Vector unused;
  for (const Point& p : problem.points()) {
    const double model = p.model(fit.parameters, unused);
    fit.model_per_sr[p.index] = model;
    // Noise about nothing is no share of anything.
    if (points.have_sigma && !(model > kClear * p.sigma)) continue;
    sum2 += std::pow(std::min(std::abs(p.value / model - 1.0), kFurthestOff), 2);
    ++clear;
  }
  if (clear > 0) fit.relative_rms = std::sqrt(sum2 / static_cast<double>(clear));
  return fit;
}

}  // namespace engine
