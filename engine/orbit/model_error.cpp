#include "engine/orbit/model_error.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace engine {

ModelError::ModelError(const OrbitSpec& spec, Epoch epoch, Epoch last)
    : model_(spec.model), epoch_(epoch) {
  if (spec.ephemeris) interpolation_m_ = spec.ephemeris->interpolation_error_m();
  if (model_ != OrbitModel::kTwoBody) return;
  OrbitSpec oblate = spec;
  oblate.model = OrbitModel::kJ2;
  const EpochSpan span{epoch, std::min(last, epoch + kLongestIntegration)};
  modelled_ = make_propagator(spec, epoch, span);
  better_ = make_propagator(oblate, epoch, span);
}

Eigen::Vector3d ModelError::off_m(Epoch t) const noexcept {
  return better_->at(t).position.m - modelled_->at(t).position.m;
}

double ModelError::at_m(Epoch t) const noexcept {
  if (model_ == OrbitModel::kTwoBody) return off_m(t).norm();
  if (model_ == OrbitModel::kEphemeris) return interpolation_m_;
  const double t_s = std::abs(seconds(t - epoch_));
  const double days = t_s / 86400.0;
  return std::min(1.5e-5 * t_s * t_s, 2e3 * days) + 7.65e3 * days * days;
}

double ModelError::across_m(Epoch t, const Direction<J2000>& line) const noexcept {
  return model_ == OrbitModel::kTwoBody ? off_m(t).cross(line.unit).norm() : at_m(t);
}

std::string_view ModelError::cause() const noexcept {
  constexpr std::array<std::string_view, 3> kCauses{
      "the Earth's oblateness is left out", "higher zonals and drag are left out, in low orbit",
      "interpolation, a row left out"};
  return kCauses[static_cast<std::size_t>(model_)];
}

}  // namespace engine
