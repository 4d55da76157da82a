#include "engine/scene/brdf.h"

#include <algorithm>
#include <cmath>

#include "engine/core/constants.h"

namespace engine {
namespace {

using Eigen::Vector3d;

// Below this cosine a facet is edge-on: it shows nothing, and 1/cos would only make noise of it.
constexpr double kGrazing = 1e-6;

/// 1 - cos of the angle between two unit vectors. From the difference: the lobe is a cusp one
/// degree wide, and 1 - dot would lose it to rounding.
double one_minus_cos(const Vector3d& a, const Vector3d& b) noexcept {
  return 0.5 * (a - b).squaredNorm();
}

// theta_1 = 15 deg of eq 13, as 1 - cos.
constexpr double kPaperCone = 0.034074173710931713;

Vector3d mirrored(const Vector3d& v) noexcept { return {-v.x(), -v.y(), v.z()}; }

}  // namespace

Brdf::Brdf(const FiveParameters& parameters, Variant variant, double wrinkle_rad)
    : p_(parameters), variant_(variant) {
  if (wrinkle_rad > 0.0 && p_.kb > 0.0) blur_lobe(wrinkle_rad);
  tabulate_lobe();
  tabulate_albedo();
}

double Brdf::printed_lobe(double x) const noexcept { return std::exp(p_.br * std::pow(x, p_.ar)); }

double Brdf::lobe(double x) const noexcept {
  if (blurred_lobe_.empty()) return printed_lobe(x);
  const double place = std::sqrt(std::clamp(x, 0.0, 1.0)) * kLobeSteps;
  const auto low = std::min(static_cast<std::size_t>(place), blurred_lobe_.size() - 2);
  const double part = place - static_cast<double>(low);
  return (1.0 - part) * static_cast<double>(blurred_lobe_[low]) +
         part * static_cast<double>(blurred_lobe_[low + 1]);
}

void Brdf::blur_lobe(double wrinkle_rad) {
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

double Brdf::specular(const Vector3d& in, const Vector3d& out) const noexcept {
  const Vector3d h = (in + out).normalized();
  const double cos_alpha = in.dot(h);
  const double cos_gamma = h.z();
  const double kr2 = p_.kr * p_.kr;
  const double fresnel_like = kr2 * cos_alpha / (1.0 + (kr2 - 1.0) * cos_alpha);
  const double masking =
      std::min(1.0, 2.0 * cos_gamma * std::min(in.z(), out.z()) / cos_alpha);  // V-cavity
  return p_.kb * fresnel_like * lobe(one_minus_cos(h, Vector3d::UnitZ())) * masking /
         (in.z() * out.z());
}

double Brdf::as_printed(const Vector3d& in, const Vector3d& out) const noexcept {
  if (in.z() <= kGrazing || out.z() <= kGrazing) return 0.0;
  return specular(in, out) + p_.kd / in.z();
}

double Brdf::eval(const Vector3d& in, const Vector3d& out) const noexcept {
  if (in.z() <= kGrazing || out.z() <= kGrazing) return 0.0;
  if (variant_ == Variant::kPhysical) {
    if (p_.kb == 0.0) return p_.kd;
    return specular(in, out) * std::min(specular_limit(in.z()), specular_limit(out.z())) + p_.kd;
  }
  const double diffuse_albedo = kPi * p_.kd / in.z();
  const double total = diffuse_albedo + specular_albedo(in.z());
  return (specular(in, out) + p_.kd / in.z()) / std::max(1.0, total);
}

double Brdf::specular_albedo(double cos_in) const noexcept {
  const double cell = std::clamp(cos_in * kAngles - 0.5, 0.0, kAngles - 1.0);
  const auto low = std::min(static_cast<std::size_t>(cell), specular_albedo_.size() - 2);
  const double part = cell - static_cast<double>(low);
  return (1.0 - part) * specular_albedo_[low] + part * specular_albedo_[low + 1];
}

double Brdf::specular_limit(double cos_in) const noexcept {
  const double room = std::max(0.0, 1.0 - kPi * p_.kd);
  const double specular = specular_albedo(cos_in);
  return specular > room ? room / specular : 1.0;
}

double Brdf::albedo(double cos_in) const noexcept {
  if (cos_in <= kGrazing) return 0.0;
  const double specular = specular_albedo(cos_in);
  if (variant_ == Variant::kPhysical) return kPi * p_.kd + specular * specular_limit(cos_in);
  return std::min(1.0, kPi * p_.kd / cos_in + specular);
}

double Brdf::diffuse_albedo() const noexcept { return std::min(1.0, kPi * p_.kd); }

void Brdf::tabulate_lobe() {
  if (p_.kb > 0.0) {
    const double half = 0.5 * lobe(0.0);
    while (lobe(1.0 - std::cos(lobe_half_width_rad_)) > half && lobe_half_width_rad_ < 1.5)
      lobe_half_width_rad_ += 1e-4;
  }
  // The half vector is drawn with a density like the lobe's. x = 1 - cos gamma on a grid that is
  // fine at the cusp; then its distribution is inverted at even steps.
  constexpr int kFine = 16384;
  std::vector<double> sum(kFine + 1, 0.0);
  const auto x_at = [](int i) { return std::pow(static_cast<double>(i) / kFine, 4.0); };
  for (int i = 1; i <= kFine; ++i) {
    const double middle = 0.5 * (x_at(i - 1) + x_at(i));
    sum[static_cast<std::size_t>(i)] =
        sum[static_cast<std::size_t>(i - 1)] + lobe(middle) * (x_at(i) - x_at(i - 1));
  }
  int i = 0;
  for (int cell = 0; cell <= kLobeCells; ++cell) {
    const double want = sum.back() * cell / kLobeCells;
    while (i < kFine && sum[static_cast<std::size_t>(i)] < want) ++i;
    lobe_edges_[static_cast<std::size_t>(cell)] =
        static_cast<float>(x_at(cell == kLobeCells ? kFine : i));
  }
  // Two edges on one fine point would make a cell without width.
  for (std::size_t cell = 1; cell < lobe_edges_.size(); ++cell)
    lobe_edges_[cell] = std::max(lobe_edges_[cell], std::nextafter(lobe_edges_[cell - 1], 2.0F));
}

void Brdf::tabulate_albedo() {
  if (p_.kb == 0.0) return;
  // Integral of f cos_out over out, by the half vector: dw_out = 4 (i.h) dw_h. Even steps in the
  // lobe's own distribution put the points where the energy is.
  // One half of the azimuths: the other is its mirror image.
  constexpr int kTurns = 32;
  for (std::size_t a = 0; a < specular_albedo_.size(); ++a) {
    const double cos_in = (static_cast<double>(a) + 0.5) / kAngles;
    const Vector3d in(std::sqrt(1.0 - cos_in * cos_in), 0.0, cos_in);
    double sum = 0;
    for (std::size_t cell = 0; cell < kLobeCells; ++cell) {
      const double width = static_cast<double>(lobe_edges_[cell + 1]) - lobe_edges_[cell];
      const double x = lobe_edges_[cell] + 0.5 * width;
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

double Brdf::lobe_share(const Vector3d& out) const noexcept {
  if (p_.kb == 0.0) return 0.0;
  const double specular = specular_albedo(out.z());
  // Never less than a tenth of either: a direction that one of them finds must stay findable.
  return std::clamp(specular / (specular + kPi * p_.kd + 1e-12), 0.1, 0.9);
}

double Brdf::pdf(const Vector3d& in, const Vector3d& out, BrdfSampler how) const noexcept {
  if (in.z() <= kGrazing || out.z() <= kGrazing) return 0.0;
  if (how == BrdfSampler::kCosine) return in.z() / kPi;
  if (how == BrdfSampler::kUniform) return 0.5 / kPi;
  if (how == BrdfSampler::kPaperCone)
    return one_minus_cos(in, mirrored(out)) <= kPaperCone ? 0.5 / (kPi * kPaperCone) : 0.0;
  const double share = lobe_share(out);
  double density = (1.0 - share) * in.z() / kPi;
  if (share > 0.0) {
    const Vector3d h = (in + out).normalized();
    const double ih = in.dot(h);
    const double x = one_minus_cos(h, Vector3d::UnitZ());
    const auto edge =
        std::upper_bound(lobe_edges_.begin() + 1, lobe_edges_.end() - 1, static_cast<float>(x));
    const double width = static_cast<double>(*edge) - *(edge - 1);
    density += share / (kLobeCells * width * 2.0 * kPi) / (4.0 * ih);
  }
  return density;
}

/// By a half vector with the lobe's distribution.
Vector3d Brdf::from_lobe(const Vector3d& out, double u, double azimuth) const noexcept {
  const double cell = u * kLobeCells;
  const auto low =
      std::min(static_cast<std::size_t>(cell), static_cast<std::size_t>(kLobeCells - 1));
  const double x =
      lobe_edges_[low] + (cell - static_cast<double>(low)) *
                             (static_cast<double>(lobe_edges_[low + 1]) - lobe_edges_[low]);
  const double sin_h = std::sqrt(x * (2.0 - x));
  const Vector3d h(sin_h * std::cos(azimuth), sin_h * std::sin(azimuth), 1.0 - x);
  return 2.0 * out.dot(h) * h - out;
}

Brdf::Sample Brdf::sample(const Vector3d& out, BrdfSampler how,
                          const std::array<float, 2>& direction, float choice) const noexcept {
  const auto u = static_cast<double>(direction[0]);
  const double azimuth = 2.0 * kPi * static_cast<double>(direction[1]);
  const auto round_z = [&](double z) {
    const double radius = std::sqrt((1.0 - z) * (1.0 + z));
    return Vector3d(radius * std::cos(azimuth), radius * std::sin(azimuth), z);
  };
  Sample s;
  if (how == BrdfSampler::kUniform) {
    s.in = round_z(u);
  } else if (how == BrdfSampler::kPaperCone) {
    const Vector3d mirror = mirrored(out);
    const Vector3d x = mirror.unitOrthogonal();
    const Vector3d in_cone = round_z(1.0 - u * kPaperCone);
    s.in = in_cone.x() * x + in_cone.y() * mirror.cross(x) + in_cone.z() * mirror;
  } else if (how == BrdfSampler::kMixture && static_cast<double>(choice) < lobe_share(out)) {
    s.in = from_lobe(out, u, azimuth);
  } else {
    s.in = round_z(std::sqrt(1.0 - u));
  }
  s.density = pdf(s.in, out, how);
  if (s.density > 0.0) s.weight = eval(s.in, out) * s.in.z() / s.density;
  return s;
}

std::vector<Material> read_materials(const ConfigReader& config) {
  std::vector<Material> materials;
  const auto variant = config.table("brdf").choice_or<Brdf::Variant>(
      "variant", "physical",
      {{"physical", Brdf::Variant::kPhysical}, {"paper", Brdf::Variant::kPaper}});
  for (const std::string& name : config.tables_below("materials")) {
    const ConfigTable table = config.table("materials." + name);
    FiveParameters p;
    p.kd = table.number("kd", between(0.0, 1.0 / kPi));
    p.kb = table.number_or("kb", 0.0, at_least(0.0));
    p.ar = p.kb > 0.0 ? table.number("ar", positive()) : p.ar;
    p.br = p.kb > 0.0 ? table.number("br", from_below(-1e6, 0.0)) : p.br;
    p.kr = p.kb > 0.0 ? table.number("kr", positive()) : p.kr;
    const double wrinkle_deg = table.number_or("wrinkle_deg", 0.0, between(0.0, 30.0));
    materials.push_back({name, p, variant, wrinkle_deg * kDegree});
  }
  return materials;
}

}  // namespace engine
