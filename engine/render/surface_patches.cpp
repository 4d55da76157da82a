#include "engine/render/surface_patches.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <unordered_map>

#include "engine/core/constants.h"
#include "engine/core/random.h"

namespace engine {
namespace {

using Eigen::Vector3f;

// Lines through the target to each cube that its bounding sphere has room for on a great circle: a
// patch that is open to a tenth of the sky is hit by 8 and more.
constexpr double kLinesACube = 60.0;
constexpr std::size_t kRaysAsScouts = 16;
constexpr int kMostRounds = 16;
const float kOneWay = std::cos(static_cast<float>(10.0 * kDegree));
// What a place may be turned from its patch.
constexpr float kSameWay = 0.5F;
constexpr int kPatchesAShare = 64;

/// Fractional parts of multiples: R2 (Roberts 2018), from a start that `index` and `who` choose.
struct Spread {
  Spread(std::uint32_t who, std::uint32_t index) noexcept {
    Draws draws(who, Stream::kLight, 0, index);
    first = draws.uniform();
    second = draws.uniform();
  }
  [[nodiscard]] std::array<float, 2> at(std::size_t i) const noexcept {
    const double a = first + 0.7548776662466927 * static_cast<double>(i);
    const double b = second + 0.5698402909980532 * static_cast<double>(i);
    return {static_cast<float>(a - std::floor(a)), static_cast<float>(b - std::floor(b))};
  }
  double first = 0;
  double second = 0;
};

/// Places in one cube that make one patch.
struct Cluster {
  std::size_t cube = 0;
  std::vector<SurfacePoint> points;  // at most kPoints
};

SurfacePatches::Patch patch_of(const Cluster& cluster) {
  SurfacePatches::Patch patch;
  patch.material = cluster.points.front().material;
  Vector3f sum = Vector3f::Zero();
  for (const SurfacePoint& p : cluster.points) {
    sum += p.normal;
    patch.place += p.place / static_cast<float>(cluster.points.size());
  }
  patch.normal = sum.normalized();
  patch.axes = basis_round(patch.normal.cast<double>()).cast<float>();
  for (std::size_t i = 0; i < SurfacePatches::kPoints; ++i)
    patch.points[i] = cluster.points[i % cluster.points.size()];
  return patch;
}

/// Finds places by rays, and sorts them into clusters: whatever a ray from outside can meet, and
/// what rays from there can meet, but never the inside of a closed part.
class Scout {
 public:
  using CubeOf = std::function<std::size_t(const Vector3f&)>;
  Scout(const TracedTarget& target, CubeOf cube_of)
      : target_(target), cube_of_(std::move(cube_of)) {}

  void send(const Vector3f& origin, const Vector3f& direction) {
    packet_.set(lanes_, origin, direction);
    if (++lanes_ == RayPacket::kLanes) finish();
  }
  void look_round(std::size_t cluster, std::size_t rays) {
    const Spread spread(2, static_cast<std::uint32_t>(cluster));
    for (std::size_t i = 0; i < rays; ++i) {
      const std::vector<SurfacePoint>& points = clusters_[cluster].points;
      const SurfacePoint from = points[i % points.size()];
      const auto [a, b] = spread.at(i);
      const Vector3f up = HemisphereBins::direction(i * HemisphereBins::kBins / rays, a, b);
      send(from.start(), basis_round(from.normal.cast<double>()).cast<float>().transpose() * up);
    }
  }
  void finish() {
    RayCounts counts;
    std::array<MeshHit, RayPacket::kLanes> hits;
    target_.scene.intersect(packet_, hits, counts);
    for (std::size_t l = 0; l < static_cast<std::size_t>(lanes_); ++l) {
      const Vector3f d(packet_.direction_x[l], packet_.direction_y[l], packet_.direction_z[l]);
      if (hits[l].triangle == MeshHit::kNone) continue;
      add(target_.facets.at(hits[l], d));
    }
    packet_ = {};
    lanes_ = 0;
  }
  [[nodiscard]] std::vector<Cluster>& clusters() noexcept { return clusters_; }

 private:
  void add(const SurfacePoint& point) {
    const std::size_t cube = cube_of_(point.place);
    std::vector<std::size_t>& here = in_cube_[cube];
    const auto fit = std::find_if(here.begin(), here.end(), [&](std::size_t c) {
      const SurfacePoint& first = clusters_[c].points.front();
      return first.material == point.material && first.normal.dot(point.normal) > kOneWay;
    });
    if (fit == here.end()) {
      here.push_back(clusters_.size());
      clusters_.push_back({cube, {point}});
    } else if (clusters_[*fit].points.size() < SurfacePatches::kPoints) {
      clusters_[*fit].points.push_back(point);
    }
  }

  const TracedTarget& target_;
  CubeOf cube_of_;
  RayPacket packet_;
  int lanes_ = 0;
  std::vector<Cluster> clusters_;
  std::unordered_map<std::size_t, std::vector<std::size_t>> in_cube_;
};

}  // namespace

std::size_t SurfacePatches::Grid::cube_of(const Vector3f& place) const noexcept {
  const Vector3f cell = (place - low) * per_m;
  // The place of a facet seen edge-on may be no number: the first cube.
  const auto along = [this](float x) {
    return x > 0.0F ? static_cast<std::size_t>(std::min(x, static_cast<float>(side - 1))) : 0;
  };
  return (along(cell.z()) * side + along(cell.y())) * side + along(cell.x());
}

SurfacePatches::SurfacePatches(const TracedTarget& target, double cubes_a_radius,
                               WorkerPool& pool) {
  const auto radius_m = static_cast<float>(target.bounding_radius_m);
  grid_.low = Vector3f::Constant(-radius_m);
  grid_.per_m = static_cast<float>(cubes_a_radius) / radius_m;
  grid_.side = 2 * static_cast<std::size_t>(std::ceil(cubes_a_radius));
  find(target);
  links_.assign(patches_.size() * kRays, kNone);
  trace(target, pool);
}

void SurfacePatches::find(const TracedTarget& target) {
  const auto radius_m = static_cast<float>(target.bounding_radius_m);
  Scout scout(target, [this](const Vector3f& place) { return grid_.cube_of(place); });
  const float cubes = grid_.per_m * radius_m;
  const auto lines = static_cast<std::uint32_t>(kLinesACube * kPi * std::pow(cubes, 2.0));
  for (std::uint32_t i = 0; i < lines; ++i) {
    Draws draws(1, Stream::kLight, 0, i);
    const float z = 2.0F * draws.uniform() - 1.0F;
    const float azimuth = 2.0F * static_cast<float>(kPi) * draws.uniform();
    const float across = std::sqrt(1.0F - z * z);
    const Vector3f direction(across * std::cos(azimuth), across * std::sin(azimuth), z);
    const Vector3f on_disc = HemisphereBins::direction(draws.bits() % HemisphereBins::kBins,
                                                       draws.uniform(), draws.uniform());
    const Eigen::Matrix3f axes = basis_round(direction.cast<double>()).cast<float>();
    const Vector3f offset =
        axes.row(0).transpose() * on_disc.x() + axes.row(1).transpose() * on_disc.y();
    scout.send(1.01F * radius_m * (offset - direction), direction);
  }
  scout.finish();
  std::size_t begin = 0;
  for (int round = 0; round < kMostRounds && begin < scout.clusters().size(); ++round) {
    const std::size_t end = scout.clusters().size();
    for (std::size_t c = begin; c < end; ++c) scout.look_round(c, kRaysAsScouts);
    scout.finish();
    begin = end;
  }

  std::vector<Cluster>& clusters = scout.clusters();
  std::stable_sort(clusters.begin(), clusters.end(),
                   [](const Cluster& a, const Cluster& b) { return a.cube < b.cube; });
  first_in_cube_.assign(grid_.size() + 1, 0);
  for (const Cluster& c : clusters) {
    patches_.push_back(patch_of(c));
    ++first_in_cube_[c.cube + 1];
  }
  for (std::size_t c = 1; c < first_in_cube_.size(); ++c)
    first_in_cube_[c] += first_in_cube_[c - 1];
}

void SurfacePatches::trace(const TracedTarget& target, WorkerPool& pool) {
  const int shares = static_cast<int>((patches_.size() + kPatchesAShare - 1) / kPatchesAShare);
  const auto trace_patch = [&](std::size_t p) {
    RayPacket packet;
    std::array<std::size_t, RayPacket::kLanes> ray_of{};
    std::size_t lanes = 0;
    RayCounts counts;
    const Spread spread(3, static_cast<std::uint32_t>(p));
    const Eigen::Matrix3f to_body = patches_[p].axes.transpose();
    const auto send = [&] {
      std::array<MeshHit, RayPacket::kLanes> hits;
      target.scene.intersect(packet, hits, counts);
      for (std::size_t l = 0; l < lanes; ++l) {
        const Vector3f d(packet.direction_x[l], packet.direction_y[l], packet.direction_z[l]);
        std::uint32_t& link = links_[p * kRays + ray_of[l]];
        link = kSky;
        if (hits[l].triangle == MeshHit::kNone) continue;
        link = at(target.facets.at(hits[l], d));
      }
      packet = {};
      lanes = 0;
    };
    for (std::size_t bin = 0; bin < HemisphereBins::kBins; ++bin) {
      for (std::size_t i = 0; i < kRaysABin; ++i) {
        const std::size_t ray = bin * kRaysABin + i;
        const auto [a, b] = spread.at(ray);
        const Vector3f direction = to_body * HemisphereBins::direction(bin, a, b);
        const SurfacePoint& from = patches_[p].points[(bin + i * 3) % kPoints];
        // A point of a curved patch may face away from a direction that the patch's mean does not.
        if (from.normal.dot(direction) <= 0.0F) continue;
        packet.set(static_cast<int>(lanes), from.start(), direction);
        ray_of[lanes++] = ray;
        if (lanes == RayPacket::kLanes) send();
      }
    }
    if (lanes > 0) send();
  };
  pool.rows(0, shares, [&](int share) {
    const std::size_t begin = static_cast<std::size_t>(share) * kPatchesAShare;
    for (std::size_t p = begin; p < std::min(patches_.size(), begin + kPatchesAShare); ++p)
      trace_patch(p);
  });
}

std::uint32_t SurfacePatches::at(const SurfacePoint& place) const noexcept {
  std::uint32_t best = kNone;
  float least_same = kSameWay;
  const std::size_t cube = grid_.cube_of(place.place);
  for (std::uint32_t p = first_in_cube_[cube]; p < first_in_cube_[cube + 1]; ++p) {
    const Patch& patch = patches_[p];
    const float same = patch.normal.dot(place.normal);
    if (same <= least_same || patch.material != place.material) continue;
    least_same = same;
    best = p;
  }
  if (best != kNone) return best;
  // A corner of the surface that no ray found: the nearest patch in the cubes around.
  float nearest = std::numeric_limits<float>::infinity();
  const float cube_m = 1.0F / grid_.per_m;
  for (int n = 0; n < 27; ++n) {
    const Eigen::Vector3i step(n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1);
    const std::size_t beside = grid_.cube_of(place.place + cube_m * step.cast<float>());
    for (std::uint32_t p = first_in_cube_[beside]; p < first_in_cube_[beside + 1]; ++p) {
      if (patches_[p].normal.dot(place.normal) <= kSameWay) continue;
      const float away = (patches_[p].place - place.place).squaredNorm();
      if (away >= nearest) continue;
      nearest = away;
      best = p;
    }
  }
  return best;
}

}  // namespace engine
