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
// Of a lamp's light, in which it is worked out anew; and by how much what is shown may be off.
constexpr std::size_t kFramesToRenew = 32;
constexpr float kMostOff_rad = 50e-3F;
constexpr double kCameraTurned_rad = 1.0 * kDegree;
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
  for (std::size_t k = 0; k < kLamps; ++k) {
    for (Kept* kept : {&lamps_[k], &making_[k].kept}) {
      kept->lit_share.resize(n);
      kept->leaving.resize(n);
      kept->bounced.resize(n);
      kept->arriving.resize(n);
    }
    making_[k].sent.resize(n);
    making_[k].next.resize(n);
    to_camera_[k].resize(n);
  }
}

template <class Work>
void BodyLight::each_patch(std::size_t first, std::size_t end, WorkerPool& pool,
                           const Work& work) const noexcept {
  const int shares = static_cast<int>((end - first + kPatchesAShare - 1) / kPatchesAShare);
  pool.rows(0, shares, [&](int share) {
    const std::size_t from = first + static_cast<std::size_t>(share) * kPatchesAShare;
    for (std::size_t p = from; p < std::min(end, from + kPatchesAShare); ++p) work(p);
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

/// What all that is sent brings to a patch.
void BodyLight::gather(const std::vector<float>& sent, std::size_t patch,
                       HemisphereBins::Values& arriving) const noexcept {
  const auto seen = patches_.seen_from(patch);
  for (std::size_t bin = 0; bin < HemisphereBins::kBins; ++bin) {
    float sum = 0.0F;
    for (std::size_t i = 0; i < SurfacePatches::kRaysABin; ++i) {
      const std::uint32_t other = seen[bin * SurfacePatches::kRaysABin + i];
      if (other < SurfacePatches::kSky) sum += sent[other];
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

/// What patches send on of the light that comes to them straight from the lamp.
void BodyLight::begin_with(Making& making, std::size_t first, std::size_t end, const Lamp& light,
                           const EarthLight& cap, WorkerPool& pool) const noexcept {
  Kept& kept = making.kept;
  if (cap.dark()) {
    const int shares = static_cast<int>((end - first + kPatchesAShare - 1) / kPatchesAShare);
    pool.rows(0, shares, [&](int share) {
      const std::size_t from = first + static_cast<std::size_t>(share) * kPatchesAShare;
      ask(kept, from, std::min(end, from + kPatchesAShare));
    });
  }
  each_patch(first, end, pool, [&](std::size_t p) {
    const SurfacePatches::Patch& patch = patches_.patch(p);
    if (cap.dark()) {
      const double c = static_cast<double>(patch.normal.dot(kept.toward));
      const double albedo = c > 0.0 ? target_.facets.brdf(patch.material).albedo(c) : 0.0;
      making.sent[p] = static_cast<float>(c * albedo / kPi) * kept.lit_share[p];
    } else {
      making.sent[p] = sent_on(p, cap) / static_cast<float>(light.irradiance_w_m2);
    }
    kept.leaving[p] = making.sent[p];
    kept.bounced[p] = 0.0F;
    kept.arriving[p].fill(0.0F);
  });
}

void BodyLight::bounce(Making& making, std::size_t first, std::size_t end, bool last,
                       WorkerPool& pool) const noexcept {
  Kept& kept = making.kept;
  each_patch(first, end, pool, [&](std::size_t p) {
    HemisphereBins::Values now{};
    gather(making.sent, p, now);
    float sum = 0.0F;
    for (std::size_t bin = 0; bin < now.size(); ++bin) {
      kept.arriving[p][bin] += now[bin];
      sum += now[bin];
    }
    const double albedo = target_.facets.brdf(patches_.patch(p).material).albedo(kMeanCosine);
    making.next[p] = static_cast<float>(albedo) * sum / HemisphereBins::kBins;
    kept.leaving[p] += making.next[p];
    if (!last) kept.bounced[p] += making.next[p];
  });
}

bool BodyLight::renew(std::size_t lamp, const Lamp& light, const EarthLight& cap, Renewal renewal,
                      WorkerPool& pool) noexcept {
  const Vector3f toward = rounded(light.toward.unit);
  Making& making = making_[lamp];
  const Vector3f& shown = lamps_[lamp].toward;
  // A direction that is no number is off, too.
  const bool off = !((shown - toward).norm() < kMostOff_rad);
  const bool all = shown.isZero() || (renewal == Renewal::kAtOnce && toward != shown) ||
                   (renewal == Renewal::kAsNeeded && off);
  if (!making.begun || (all && making.kept.toward != toward)) {
    if (toward == shown) return false;
    making.begun = true;
    making.done = 0;
    making.kept.toward = toward;
  }
  const std::size_t n = patches_.size();
  const std::size_t work = work_of_all();
  std::size_t left = all ? work : work / kFramesToRenew + 1;
  while (left > 0 && making.done < work) {
    const std::size_t stage = making.done / n;
    const std::size_t first = making.done % n;
    const std::size_t end = std::min(n, first + left);
    if (stage == 0) {
      begin_with(making, first, end, light, cap, pool);
    } else {
      bounce(making, first, end, stage == static_cast<std::size_t>(bounces_), pool);
      if (end == n) std::swap(making.sent, making.next);
    }
    left -= end - first;
    making.done += end - first;
  }
  if (making.done < work) return false;
  std::swap(lamps_[lamp], making.kept);
  making.begun = false;
  return true;
}

/// For 1 W/m^2.
void BodyLight::send_to_camera(std::size_t lamp, WorkerPool& pool) noexcept {
  each_patch(0, patches_.size(), pool, [&](std::size_t p) {
    const SurfacePatches::Patch& patch = patches_.patch(p);
    const Vector3f to_camera =
        (camera_m_ - patch.points[0].place.cast<double>()).normalized().cast<float>();
    const Vector3f out = patch.axes * to_camera;
    to_camera_[lamp][p] =
        out.z() > 0.0F ? binned_[patch.material].reflected(lamps_[lamp].arriving[p], out) : 0.0F;
  });
}

void BodyLight::light_up(const Snapshot& snapshot, Renewal renewal, WorkerPool& pool) noexcept {
  const auto lamps = lamps_of(snapshot);
  const double to_target_m = snapshot.camera.m.norm() - target_.bounding_radius_m;
  // Not a number either.
  const bool turned =
      renewal == Renewal::kAtOnce ||
      !((snapshot.camera.m - camera_m_).norm() < kCameraTurned_rad * std::max(to_target_m, 0.0));
  if (turned) camera_m_ = snapshot.camera.m;
  for (std::size_t k = 0; k < kLamps; ++k) {
    irradiance_w_m2_[k] = static_cast<float>(lamps[k]->irradiance_w_m2);
    // Not a number either.
    if (!(irradiance_w_m2_[k] > 0.0F)) irradiance_w_m2_[k] = 0.0F;
    const bool on = irradiance_w_m2_[k] > 0.0F;
    const bool renewed = on && renew(k, *lamps[k], k == 1 ? snapshot.earth : kNoCap, renewal, pool);
    if (on && (renewed || turned || !current_[k])) send_to_camera(k, pool);
    current_[k] = on || (current_[k] && !turned);
  }
}

}  // namespace engine
