#include "engine/render/body_light.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "engine/core/constants.h"

namespace engine {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;

constexpr int kPatchesAShare = 64;
// Of the target's radius: 2 px of a target of 100 px.
constexpr double kCubesARadius = 30.0;
constexpr double kDirectionsARadian = 125.0;
// By the cosine the mean direction is 48 deg off the normal.
constexpr double kMeanCosine = 2.0 / 3.0;

const EarthLight kNoCap;

/// The nearest of fixed directions.
Vector3f rounded(const Vector3d& unit) noexcept {
  const Vector3d steps = (unit * kDirectionsARadian).array().round();
  return steps.normalized().cast<float>();
}

}  // namespace

BodyLight::BodyLight(const TracedTarget& target, int bounces, WorkerPool& pool)
    : target_(target), bounces_(bounces), patches_(target, kCubesARadius, pool) {
  for (std::uint32_t m = 0; m < target.mesh.material_names.size(); ++m)
    binned_.emplace_back(target.facets.brdf(m));
  const std::size_t n = patches_.size();
  for (Kept& kept : lamps_) {
    kept.lit_share.resize(n);
    kept.leaving.resize(n);
    kept.bounced.resize(n);
    kept.arriving.resize(n);
  }
  for (std::vector<float>* v : {&sent_, &next_, &to_camera_[0], &to_camera_[1], &leaving_})
    v->resize(std::max<std::size_t>(n, 1));
}

template <class Work>
void BodyLight::each_patch(WorkerPool& pool, const Work& work) const noexcept {
  const std::size_t n = patches_.size();
  const int shares = static_cast<int>((n + kPatchesAShare - 1) / kPatchesAShare);
  pool.rows(0, shares, [&](int share) {
    const std::size_t first = static_cast<std::size_t>(share) * kPatchesAShare;
    for (std::size_t p = first; p < std::min(n, first + kPatchesAShare); ++p) work(p);
  });
}

/// Which of their points the lamp reaches.
void BodyLight::ask(Kept& kept, std::size_t first, std::size_t end) const noexcept {
  RayPacket packet;
  std::array<std::size_t, RayPacket::kLanes> patch_of{};
  std::size_t lanes = 0;
  RayCounts counts;
  const auto send = [&] {
    std::array<bool, RayPacket::kLanes> blocked{};
    target_.scene.occluded(packet, blocked, counts);
    for (std::size_t l = 0; l < lanes; ++l)
      if (!blocked[l]) kept.lit_share[patch_of[l]] += 1.0F / SurfacePatches::kPoints;
    packet = {};
    lanes = 0;
  };
  for (std::size_t p = first; p < end; ++p) {
    kept.lit_share[p] = 0.0F;
    for (const SurfacePoint& point : patches_.patch(p).points) {
      if (point.normal.dot(kept.toward) <= 0.0F) continue;
      packet.set(static_cast<int>(lanes), point.start(), kept.toward);
      patch_of[lanes++] = p;
      if (lanes == RayPacket::kLanes) send();
    }
  }
  if (lanes > 0) send();
}

/// What sent_ brings to a patch.
void BodyLight::gather(std::size_t patch, HemisphereBins::Values& arriving) const noexcept {
  const auto seen = patches_.seen_from(patch);
  for (std::size_t bin = 0; bin < HemisphereBins::kBins; ++bin) {
    float sum = 0.0F;
    for (std::size_t i = 0; i < SurfacePatches::kRaysABin; ++i) {
      const std::uint32_t other = seen[bin * SurfacePatches::kRaysABin + i];
      if (other < SurfacePatches::kSky) sum += sent_[other];
    }
    arriving[bin] += sum / SurfacePatches::kRaysABin;
  }
}

/// Of the cap's light, what leaves the patch.
float BodyLight::sent_on(std::size_t patch, const EarthLight& cap) const noexcept {
  const SurfacePatches::Patch& p = patches_.patch(patch);
  const auto seen = patches_.seen_from(patch);
  HemisphereBins::FineValues light;
  HemisphereBins::see(cap, p.axes, light);
  double sum = 0;
  for (std::size_t bin = 0; bin < HemisphereBins::kBins; ++bin) {
    const auto rays = seen.subspan(bin * SurfacePatches::kRaysABin, SurfacePatches::kRaysABin);
    const auto open = static_cast<double>(std::ranges::count(rays, SurfacePatches::kSky));
    for (const float a : {0.0F, 0.5F})
      for (const float b : {0.0F, 0.5F})
        sum += 0.25 * open * static_cast<double>(light[HemisphereBins::fine(bin, a, b)]);
  }
  const double albedo = target_.facets.brdf(p.material).albedo(kMeanCosine);
  return static_cast<float>(albedo * sum / static_cast<double>(SurfacePatches::kRays));
}

void BodyLight::renew(Kept& kept, const Lamp& lamp, const EarthLight& cap,
                      WorkerPool& pool) noexcept {
  kept.toward = rounded(lamp.toward.unit);
  const std::size_t n = patches_.size();
  const int shares = static_cast<int>((n + kPatchesAShare - 1) / kPatchesAShare);
  if (cap.dark()) {
    pool.rows(0, shares, [&](int share) {
      const std::size_t first = static_cast<std::size_t>(share) * kPatchesAShare;
      ask(kept, first, std::min(n, first + kPatchesAShare));
    });
  }
  each_patch(pool, [&](std::size_t p) {
    const SurfacePatches::Patch& patch = patches_.patch(p);
    if (cap.dark()) {
      const double c = static_cast<double>(patch.normal.dot(kept.toward));
      const double albedo = c > 0.0 ? target_.facets.brdf(patch.material).albedo(c) : 0.0;
      sent_[p] = static_cast<float>(c * albedo / kPi) * kept.lit_share[p];
    } else {
      sent_[p] = sent_on(p, cap) / static_cast<float>(lamp.irradiance_w_m2);
    }
    kept.leaving[p] = sent_[p];
    kept.bounced[p] = 0.0F;
    kept.arriving[p].fill(0.0F);
  });
  for (int bounce = 1; bounce <= bounces_; ++bounce) {
    each_patch(pool, [&](std::size_t p) {
      HemisphereBins::Values now{};
      gather(p, now);
      float sum = 0.0F;
      for (std::size_t bin = 0; bin < now.size(); ++bin) {
        kept.arriving[p][bin] += now[bin];
        sum += now[bin];
      }
      const double albedo = target_.facets.brdf(patches_.patch(p).material).albedo(kMeanCosine);
      next_[p] = static_cast<float>(albedo) * sum / HemisphereBins::kBins;
      kept.leaving[p] += next_[p];
      if (bounce < bounces_) kept.bounced[p] += next_[p];
    });
    std::swap(sent_, next_);
  }
}

void BodyLight::light_up(const Snapshot& snapshot, WorkerPool& pool) noexcept {
  const auto lamps = lamps_of(snapshot);
  std::array<float, kLamps> irradiance{};
  for (std::size_t k = 0; k < kLamps; ++k) {
    irradiance[k] = static_cast<float>(lamps[k]->irradiance_w_m2);
    // Not a number either.
    if (!(irradiance[k] > 0.0F)) irradiance[k] = 0.0F;
    if (irradiance[k] == 0.0F) continue;
    if (rounded(lamps[k]->toward.unit) != lamps_[k].toward)
      renew(lamps_[k], *lamps[k], k == 1 ? snapshot.earth : kNoCap, pool);
  }
  each_patch(pool, [&](std::size_t p) {
    const SurfacePatches::Patch& patch = patches_.patch(p);
    leaving_[p] = 0.0F;
    for (std::size_t k = 0; k < kLamps; ++k)
      if (irradiance[k] > 0.0F) leaving_[p] += irradiance[k] * lamps_[k].leaving[p];
    const Vector3f to_camera =
        (snapshot.camera.m - patch.points[0].place.cast<double>()).normalized().cast<float>();
    const Vector3f out = patch.axes * to_camera;
    for (std::size_t k = 0; k < kLamps; ++k) {
      to_camera_[k][p] = 0.0F;
      if (irradiance[k] > 0.0F && out.z() > 0.0F)
        to_camera_[k][p] =
            irradiance[k] * binned_[patch.material].reflected(lamps_[k].arriving[p], out);
    }
  });
}

}  // namespace engine
