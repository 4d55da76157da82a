#include "engine/scene/five_parameter_brdf.h"

#include <algorithm>
#include <cmath>

#include "engine/core/constants.h"
#include "engine/scene/surface_frame.h"

namespace engine {

using Eigen::Vector3d;

namespace {

double lobe_of(const FiveParameters& p, double x) noexcept {
  return std::exp(p.br * std::pow(x, p.ar));
}

}  // namespace

FacetGeometry::FacetGeometry(const Vector3d& in, const Vector3d& out) noexcept {
  const Vector3d h = (in + out).normalized();
  cos_alpha = in.dot(h);
  x = one_minus_cos(h, Vector3d::UnitZ());
  masking = std::min(1.0, 2.0 * h.z() * std::min(in.z(), out.z()) / cos_alpha);  // V-cavity
  cosines = in.z() * out.z();
}

double FacetGeometry::fresnel_like(double kr) const noexcept {
  const double kr2 = kr * kr;
  return kr2 * cos_alpha / (1.0 + (kr2 - 1.0) * cos_alpha);
}

FiveParameterBrdf::FiveParameterBrdf(const FiveParameters& parameters, Variant variant,
                                     double wrinkle_rad)
    : p_(parameters), variant_(variant) {
  if (p_.kb == 0.0) return;
  if (wrinkle_rad > 0.0) blur_lobe(wrinkle_rad);
  tabulate_lobe();
  tabulate_albedo();
}

double FiveParameterBrdf::printed_lobe(double x) const noexcept { return lobe_of(p_, x); }

double FiveParameterBrdf::lobe(double x) const noexcept {
  if (blurred_lobe_.empty()) return printed_lobe(x);
  const double place = std::sqrt(std::clamp(x, 0.0, 1.0)) * kLobeSteps;
  const auto low = std::min(static_cast<std::size_t>(place), blurred_lobe_.size() - 2);
  const double part = place - static_cast<double>(low);
  return (1.0 - part) * static_cast<double>(blurred_lobe_[low]) +
         part * static_cast<double>(blurred_lobe_[low + 1]);
}

void FiveParameterBrdf::blur_lobe(double wrinkle_rad) {
  // In the plane of q = 2 sin(gamma / 2), where equal areas are equal solid angles: the lobe at
  // distance r, spread by a normal distribution round the origin, is read off at distance q.
  // exp(-z) I0(z) stays finite where I0 alone does not.
  const double s2 = wrinkle_rad * wrinkle_rad;
  const auto scaled_bessel = [](double z) {
    // Abramowitz & Stegun 9.7.1 beyond 30: 2e-6.
    if (z > 30.0) return (1.0 + 1.0 / (8.0 * z) + 9.0 / (128.0 * z * z)) / std::sqrt(2.0 * kPi * z);
    return std::exp(-z) * std::cyl_bessel_i(0.0, z);
  };
  constexpr int kRings = 400;
  std::vector<float> blurred(kLobeSteps + 1);
  for (int i = 0; i <= kLobeSteps; ++i) {
    const double q = std::sqrt(2.0) * i / kLobeSteps;
    // Rings where the spread reaches, fine at the cusp.
    const double reach = std::min(std::sqrt(2.0), q + 6.0 * wrinkle_rad);
    double sum = 0;
    for (int k = 0; k < kRings; ++k) {
      const double t = (k + 0.5) / kRings;
      const double r = reach * t * t;
      const double dr = reach * 2.0 * t / kRings;
      sum += printed_lobe(0.5 * r * r) * std::exp(-0.5 * (q - r) * (q - r) / s2) *
             scaled_bessel(q * r / s2) * r * dr / s2;
    }
    blurred[static_cast<std::size_t>(i)] = static_cast<float>(sum);
  }
  blurred_lobe_ = std::move(blurred);
}

double FiveParameterBrdf::specular(const Vector3d& in, const Vector3d& out) const noexcept {
  const FacetGeometry g(in, out);
  return p_.kb * g.fresnel_like(p_.kr) * lobe(g.x) * g.masking / g.cosines;
}

double FiveParameterBrdf::as_printed(const Vector3d& in, const Vector3d& out) const noexcept {
  if (in.z() <= kGrazing || out.z() <= kGrazing) return 0.0;
  return specular(in, out) + p_.kd / in.z();
}

double FiveParameterBrdf::eval(const Vector3d& in, const Vector3d& out) const noexcept {
  if (in.z() <= kGrazing || out.z() <= kGrazing) return 0.0;
  if (variant_ == Variant::kPhysical) {
    if (p_.kb == 0.0) return p_.kd;
    return specular(in, out) * std::min(specular_limit(in.z()), specular_limit(out.z())) + p_.kd;
  }
  const double diffuse_albedo = kPi * p_.kd / in.z();
  const double total = diffuse_albedo + specular_albedo(in.z());
  return (specular(in, out) + p_.kd / in.z()) / std::max(1.0, total);
}

double FiveParameterBrdf::specular_albedo(double cos_in) const noexcept {
  const double cell = std::clamp(cos_in * kAngles - 0.5, 0.0, kAngles - 1.0);
  const auto low = std::min(static_cast<std::size_t>(cell), specular_albedo_.size() - 2);
  const double part = cell - static_cast<double>(low);
  return (1.0 - part) * specular_albedo_[low] + part * specular_albedo_[low + 1];
}

double FiveParameterBrdf::specular_limit(double cos_in) const noexcept {
  const double room = std::max(0.0, 1.0 - kPi * p_.kd);
  const double specular = specular_albedo(cos_in);
  return specular > room ? room / specular : 1.0;
}

double FiveParameterBrdf::albedo(double cos_in) const noexcept {
  if (cos_in <= kGrazing) return 0.0;
  const double specular = specular_albedo(cos_in);
  if (variant_ == Variant::kPhysical) return kPi * p_.kd + specular * specular_limit(cos_in);
  return std::min(1.0, kPi * p_.kd / cos_in + specular);
}

double FiveParameterBrdf::albedo_as_printed(double cos_in) const noexcept {
  return cos_in <= kGrazing ? 0.0 : kPi * p_.kd / cos_in + specular_albedo(cos_in);
}

double FiveParameterBrdf::albedo_before_limit(double cos_in) const noexcept {
  if (variant_ == Variant::kPaper) return albedo_as_printed(cos_in);
  return cos_in <= kGrazing ? 0.0 : kPi * p_.kd + specular_albedo(cos_in);
}

double FiveParameterBrdf::diffuse_albedo() const noexcept { return std::min(1.0, kPi * p_.kd); }

void FiveParameterBrdf::tabulate_lobe() {
  const double half = 0.5 * lobe(0.0);
  while (lobe(1.0 - std::cos(lobe_half_width_rad_)) > half && lobe_half_width_rad_ < 1.5)
    lobe_half_width_rad_ += 1e-4;
  lobe_sampler_ = HalfVectorLobe([this](double x) { return lobe(x); });
}

void FiveParameterBrdf::tabulate_albedo() {
  // Integral of f cos_out over out, by the half vector: dw_out = 4 (i.h) dw_h. Even steps in the
  // lobe's own distribution put the points where the energy is.
  // One half of the azimuths: the other is its mirror image.
  constexpr int kTurns = 32;
  for (std::size_t a = 0; a < specular_albedo_.size(); ++a) {
    const double cos_in = (static_cast<double>(a) + 0.5) / kAngles;
    const Vector3d in(std::sqrt(1.0 - cos_in * cos_in), 0.0, cos_in);
    double sum = 0;
    for (std::size_t cell = 0; cell < HalfVectorLobe::kCells; ++cell) {
      const auto [x, width] = lobe_sampler_.cell(cell);
      const double sin_h = std::sqrt(x * (2.0 - x));
      for (int turn = 0; turn < kTurns; ++turn) {
        const double azimuth = kPi * (turn + 0.5) / kTurns;
        const Vector3d h(sin_h * std::cos(azimuth), sin_h * std::sin(azimuth), 1.0 - x);
        const double ih = in.dot(h);
        const Vector3d out = 2.0 * ih * h - in;
        if (ih <= 0.0 || out.z() <= kGrazing) continue;
        sum += specular(in, out) * out.z() * 4.0 * ih * width * (2.0 * kPi / kTurns);
      }
    }
    specular_albedo_[a] = static_cast<float>(sum);
  }
}

double FiveParameterBrdf::lobe_share(const Vector3d& out) const noexcept {
  if (p_.kb == 0.0) return 0.0;
  const double specular = specular_albedo(out.z());
  // Never less than a tenth of either: a direction that one of them finds must stay findable.
  return std::clamp(specular / (specular + kPi * p_.kd + 1e-12), 0.1, 0.9);
}

}  // namespace engine
