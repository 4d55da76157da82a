#include "engine/optics/otf_cascade.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/core/constants.h"
#include "engine/optics/mtf.h"

namespace engine {
namespace {

// Of the OTF: what defocus may change and be left out. A fifth of a percent of a full well is 60 e-
// of an edge, a third of its noise.
constexpr double kUnseenShare = 2e-3;
// A star's defocus beside a target in focus; beyond this its peak is a tenth.
constexpr double kLargestOfStars_waves = 0.75;
// Where the lens in focus passes less, what defocus makes of that is not told.
constexpr double kLeastLens = 1e-3;
constexpr int kVibrationSteps = 8192;  // 1e-5 off for ten pixels of amplitude

double largest_defocus_m(const OpticsSpec& spec) noexcept {
  if (spec.focus != Focus::kTarget) return std::numeric_limits<double>::infinity();
  return kLargestOfStars_waves * middle_wavelength_m(spec);
}

}  // namespace

OtfCascade::OtfCascade(const OpticsSpec& spec)
    : pitch_m_(spec.camera.pixel_pitch_m),
      jitter_px_(spec.jitter_rad / spec.camera.ifov_rad()),
      vibration_px_(spec.vibration.amplitude_rad / spec.camera.ifov_rad()),
      along_u_(std::cos(spec.vibration.direction_rad)),
      along_v_(std::sin(spec.vibration.direction_rad)),
      mtf_(spec.mtf),
      lens_(std::make_unique<LensOtf>(spec.lens, largest_defocus_m(spec))),
      in_focus_(lens_->slice(0.0)),
      unseen_m_(lens_->unseen_defocus_m(kUnseenShare)) {
  if (vibration_px_ == 0.0) return;
  for (int i = 0; i <= kVibrationSteps; ++i)
    vibration_.push_back(
        static_cast<float>(vibration_otf(cutoff_per_px() * i / kVibrationSteps, vibration_px_)));
}

double OtfCascade::seen_defocus_m(double defocus_m) const noexcept {
  if (!(std::abs(defocus_m) > unseen_m_)) return 0.0;
  return std::clamp(defocus_m, -lens_->largest_defocus_m(), lens_->largest_defocus_m());
}

double OtfCascade::cutoff_per_px() const noexcept { return lens_->cutoff_per_m() * pitch_m_; }

double OtfCascade::vibration(double fu, double fv) const noexcept {
  if (vibration_.empty()) return 1.0;
  const double place = std::abs(fu * along_u_ + fv * along_v_) / cutoff_per_px() * kVibrationSteps;
  const auto low = std::min(static_cast<std::size_t>(place), vibration_.size() - 2);
  const double part = std::min(place - static_cast<double>(low), 1.0);
  return (1.0 - part) * static_cast<double>(vibration_[low]) +
         part * static_cast<double>(vibration_[low + 1]);
}

/// Jitter and the measured table.
double OtfCascade::unsteady(double f) const noexcept {
  return jitter_otf(f, jitter_px_) * mtf_.at(f / pitch_m_);
}

std::complex<double> OtfCascade::at(double fu, double fv, const Focused& lens) const noexcept {
  return lens.at(fu / pitch_m_, fv / pitch_m_) * (unsteady(std::hypot(fu, fv)) * vibration(fu, fv));
}

double OtfCascade::at_radial(double f, const Focused& lens) const noexcept {
  return lens.at_radial(f / pitch_m_) * unsteady(f);
}

std::complex<double> OtfCascade::whole(double fu, double fv, const Focused& lens) const noexcept {
  return at(fu, fv, lens) * (sinc(fu) * sinc(fv));
}

std::array<OtfCascade::Term, OtfCascade::kTerms> OtfCascade::terms(
    double fu, double fv, const Focused& lens) const noexcept {
  const double f = std::hypot(fu, fv);
  const std::complex<double> sharp = in_focus_.at(fu / pitch_m_, fv / pitch_m_);
  const std::complex<double> now = lens.at(fu / pitch_m_, fv / pitch_m_);
  return {Term{"lens", sharp},
          {"defocus", std::abs(sharp) > kLeastLens ? now / sharp : 0.0},
          {"jitter", jitter_otf(f, jitter_px_)},
          {"vibration", vibration(fu, fv)},
          {"table", mtf_.at(f / pitch_m_)},
          {"pixel", sinc(fu) * sinc(fv)}};
}

}  // namespace engine
