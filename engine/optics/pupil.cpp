#include "engine/optics/pupil.h"

#include <algorithm>
#include <cmath>

#include "engine/core/constants.h"
#include "engine/core/contract.h"

namespace engine {
namespace {

/// Noll's order: the degree n, the turns m, and whether the sine is meant.
struct NollTerm {
  int n = 0;
  int m = 0;
  bool sine = false;
};

NollTerm noll(std::size_t j) noexcept {
  NollTerm term;
  int before = 0;  // terms of lower degree
  const int count = static_cast<int>(j);
  while (before + term.n + 1 < count) before += ++term.n;
  // Within a degree m grows, each m > 0 twice.
  const int place = count - before - 1;
  term.m = term.n % 2 == 0 ? (place + 1) / 2 * 2 : place / 2 * 2 + 1;
  term.sine = term.m != 0 && j % 2 == 1;
  return term;
}

double factorial(int n) noexcept {
  double product = 1;
  for (int i = 2; i <= n; ++i) product *= i;
  return product;
}

double sqrt_of_positive(double x) noexcept { return std::sqrt(std::max(x, 0.0)); }

/// The rectangle from the centre along (c, s), `half` wide to both sides, on the line at x.
void hide_vane(double x, double c, double s, double half, OpenLine& line) noexcept {
  constexpr double kFar = 4.0;
  constexpr double kParallel = 1e-12;
  double low = -kFar;
  double high = kFar;
  if (std::abs(c) > kParallel) {
    const double middle = x * s / c;
    low = middle - half / std::abs(c);
    high = middle + half / std::abs(c);
  } else if (std::abs(x) > half) {
    return;
  }
  if (s > kParallel) {
    low = std::max(low, -x * c / s);
  } else if (s < -kParallel) {
    high = std::min(high, -x * c / s);
  } else if (x * c < 0.0) {
    return;
  }
  line.cut(low, high);
}

}  // namespace

ZernikeTerm::ZernikeTerm(std::size_t j, double factor) noexcept {
  const auto [n, m, sine] = noll(j);
  turns_ = m;
  sine_ = sine;
  const double norm = factor * std::sqrt(m == 0 ? n + 1.0 : 2.0 * (n + 1.0));
  for (int k = 0; k <= (n - m) / 2; ++k) {
    const double size =
        factorial(n - k) / (factorial(k) * factorial((n + m) / 2 - k) * factorial((n - m) / 2 - k));
    powers_[static_cast<std::size_t>((n - m) / 2 - k)] = norm * (k % 2 == 0 ? size : -size);
  }
}

double ZernikeTerm::at(double x, double y) const noexcept {
  const double r2 = x * x + y * y;
  double radial = 0;
  for (std::size_t i = powers_.size(); i-- > 0;) radial = radial * r2 + powers_[i];
  double c = 1;  // r^m cos(m theta), r^m sin(m theta)
  double s = 0;
  for (int i = 0; i < turns_; ++i) {
    const double next = c * x - s * y;
    s = c * y + s * x;
    c = next;
  }
  return radial * (sine_ ? s : c);
}

bool ZernikeTerm::takes(const ZernikeTerm& other) noexcept {
  if (turns_ != other.turns_ || sine_ != other.sine_) return false;
  for (std::size_t i = 0; i < powers_.size(); ++i) powers_[i] += other.powers_[i];
  return true;
}

GaussRule::GaussRule(int count) {
  for (int i = 0; i < count; ++i) {
    double x = -std::cos(kPi * (i + 0.75) / (count + 0.5));
    double slope = 1;
    for (int step = 0; step < 20; ++step) {
      double last = 1;
      double value = x;
      for (int n = 2; n <= count; ++n) {
        const double next = ((2.0 * n - 1.0) * x * value - (n - 1.0) * last) / n;
        last = value;
        value = next;
      }
      slope = count * (x * value - last) / (x * x - 1.0);
      x -= value / slope;
    }
    nodes.push_back(x);
    weights.push_back(2.0 / ((1.0 - x * x) * slope * slope));
  }
}

OpenLine::OpenLine(double low, double high) noexcept {
  if (low < high) pieces_[size_++] = {low, high};
}

void OpenLine::cut(double low, double high) noexcept {
  if (!(low < high)) return;
  for (std::size_t i = 0; i < size_;) {
    Piece& piece = pieces_[i];
    if (high <= piece.low || low >= piece.high) {
      ++i;
    } else if (low <= piece.low && high >= piece.high) {
      std::copy(pieces_.begin() + i + 1, pieces_.begin() + size_, pieces_.begin() + i);
      --size_;
    } else if (low <= piece.low) {
      piece.low = high;
      ++i;
    } else if (high >= piece.high) {
      piece.high = low;
      ++i;
    } else {
      ENSURE(size_ < pieces_.size());
      std::copy_backward(pieces_.begin() + i, pieces_.begin() + size_, pieces_.begin() + size_ + 1);
      ++size_;
      pieces_[i].high = low;
      pieces_[i + 1].low = high;
      i += 2;
    }
  }
}

void OpenLine::keep(double low, double high) noexcept {
  constexpr double kFar = 1e3;
  if (!(low < high)) {
    size_ = 0;
    return;
  }
  cut(-kFar, low);
  cut(high, kFar);
}

Pupil::Pupil(const LensSpec& lens)
    : lens_(lens),
      curvature_m_(2.0 * std::sqrt(3.0) * lens.zernike_m[4]),
      radial_(lens.spider_vanes == 0) {
  for (std::size_t j = 5; j <= LensSpec::kLastZernike; ++j) {
    if (lens.zernike_m[j] == 0.0) continue;
    const ZernikeTerm term(j, lens.zernike_m[j]);
    radial_ = radial_ && term.radial();
    const auto takes = [&](ZernikeTerm& known) { return known.takes(term); };
    if (!std::any_of(terms_.begin(), terms_.end(), takes)) terms_.push_back(term);
  }
}

double Pupil::wavefront_m(double x, double y) const noexcept {
  double sum = 0;
  for (const ZernikeTerm& term : terms_) sum += term.at(x, y);
  return sum;
}

double Pupil::steepest_m() const noexcept {
  constexpr int kSteps = 50;
  constexpr double kStep = 1e-4;
  double steepest = 0;
  const auto path_m = [&](double x, double y) {
    return wavefront_m(x, y) + curvature_m_ * (x * x + y * y);
  };
  for (int i = -kSteps; i <= kSteps; ++i) {
    for (int k = -kSteps; k <= kSteps; ++k) {
      const double x = static_cast<double>(i) / kSteps;
      const double y = static_cast<double>(k) / kSteps;
      if (x * x + y * y > 1.0) continue;
      steepest = std::max(steepest, std::hypot(path_m(x + kStep, y) - path_m(x - kStep, y),
                                               path_m(x, y + kStep) - path_m(x, y - kStep)) /
                                        (2.0 * kStep));
    }
  }
  return steepest;
}

void Pupil::hide(double x, double turn_rad, OpenLine& line) const noexcept {
  const double rim = sqrt_of_positive(1.0 - x * x);
  line.keep(-rim, rim);
  const double e = lens_.obscuration;
  const double hole = sqrt_of_positive(e * e - x * x);
  line.cut(-hole, hole);
  for (int i = 0; i < lens_.spider_vanes; ++i) {
    const double angle = lens_.spider_angle_rad + 2.0 * kPi * i / lens_.spider_vanes - turn_rad;
    hide_vane(x, std::cos(angle), std::sin(angle), lens_.spider_width_m / lens_.aperture_m, line);
  }
}

std::vector<double> overlap_corners(double shift, double obscuration) {
  const double e = obscuration;
  const double end = 1.0 - 0.5 * shift;
  std::vector<double> corners{0.0, end};
  if (e > 0.0) {
    for (const double x : {std::abs(0.5 * shift - e), 0.5 * shift + e,
                           shift > 0.0 ? (1.0 - e * e) / (2.0 * shift) : end})
      if (x > 0.0 && x < end) corners.push_back(x);
  }
  std::sort(corners.begin(), corners.end());
  return corners;
}

double Pupil::phase(const Shift& shift, double x, double y) const noexcept {
  double sum = -shift.curvature * x;
  if (terms_.empty()) return sum;
  const double a = x - 0.5 * shift.length;
  const double b = x + 0.5 * shift.length;
  const double c = shift.cosine;
  const double s = shift.sine;
  return sum + shift.per_m * (wavefront_m(c * a - s * y, s * a + c * y) -
                              wavefront_m(c * b - s * y, s * b + c * y));
}

std::complex<double> Pupil::across(const Shift& shift, double x) const noexcept {
  constexpr double kPart = 0.5;  // 16 nodes to so much
  OpenLine line(-1.0, 1.0);
  hide(x - 0.5 * shift.length, shift.turn_rad, line);
  hide(x + 0.5 * shift.length, shift.turn_rad, line);
  std::complex<double> sum = 0;
  for (const auto& piece : line) {
    const double length = piece.high - piece.low;
    if (terms_.empty()) {
      sum += length * std::polar(1.0, phase(shift, x, 0.0));
      continue;
    }
    const int parts = static_cast<int>(length / kPart) + 1;
    const double half = 0.5 * length / parts;
    for (int part = 0; part < parts; ++part)
      for (std::size_t i = 0; i < gauss_.nodes.size(); ++i)
        sum +=
            half * gauss_.weights[i] *
            std::polar(1.0, phase(shift, x, piece.low + half * (2 * part + 1 + gauss_.nodes[i])));
  }
  return sum;
}

std::complex<double> Pupil::otf(double nu_x, double nu_y, double wavelength_m,
                                double defocus_m) const {
  const double nu = std::hypot(nu_x, nu_y);
  if (nu >= 1.0) return 0.0;
  const double turn = nu > 0.0 ? std::atan2(nu_y, nu_x) : 0.0;
  const double per_m = 2.0 * kPi / wavelength_m;
  const double w20_m = defocus_m + curvature_m_;
  const Shift shift{2.0 * nu,       turn,  std::cos(turn),
                    std::sin(turn), per_m, 4.0 * per_m * w20_m * nu};
  // A spider's edges need finer parts, and much defocus does.
  const int parts =
      (lens_.spider_vanes > 0 ? 40 : 4) + static_cast<int>(0.5 * std::abs(w20_m) / wavelength_m);
  const std::vector<double> corners = overlap_corners(shift.length, lens_.obscuration);
  std::complex<double> sum = 0;
  for (std::size_t panel = 0; panel + 1 < corners.size(); ++panel) {
    const double middle = 0.5 * (corners[panel] + corners[panel + 1]);
    const double half = 0.5 * (corners[panel + 1] - corners[panel]);
    for (int part = 0; part < parts; ++part) {
      for (std::size_t i = 0; i < gauss_.nodes.size(); ++i) {
        // A sine's map takes the roots at the panel's ends away.
        const double t = 0.5 * kPi * ((2 * part + 1 + gauss_.nodes[i]) / parts - 1.0);
        const double weight = half * 0.5 * kPi / parts * gauss_.weights[i] * std::cos(t);
        const double x = middle + half * std::sin(t);
        sum += weight * (across(shift, x) + across(shift, -x));
      }
    }
  }
  return sum / (kPi * lens_.open_share()) *
         shannon_factor(lens_.wavefront_rms_m / wavelength_m, nu);
}

}  // namespace engine
