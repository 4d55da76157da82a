#include "engine/render/embree_scene.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

#include <embree3/rtcore.h>

namespace engine {
namespace {

constexpr float kLargestCoordinate_m = 1e6F;
constexpr float kFar = std::numeric_limits<float>::infinity();
constexpr unsigned kAllGeometry = ~0U;

/// Finite, near, and a direction of about unit length. False for anything that is not a number.
bool valid_ray(float ox, float oy, float oz, float dx, float dy, float dz) noexcept {
  const float length2 = dx * dx + dy * dy + dz * dz;
  return std::abs(ox) < kLargestCoordinate_m && std::abs(oy) < kLargestCoordinate_m &&
         std::abs(oz) < kLargestCoordinate_m && length2 > 0.25F && length2 < 4.0F;
}

/// The same as 1 or 0, every comparison made.
int valid_lane(float ox, float oy, float oz, float dx, float dy, float dz) noexcept {
  const float length2 = dx * dx + dy * dy + dz * dz;
  return static_cast<int>(std::abs(ox) < kLargestCoordinate_m) &
         static_cast<int>(std::abs(oy) < kLargestCoordinate_m) &
         static_cast<int>(std::abs(oz) < kLargestCoordinate_m) & static_cast<int>(length2 > 0.25F) &
         static_cast<int>(length2 < 4.0F);
}

bool start_ray(const Eigen::Vector3f& origin, const Eigen::Vector3f& direction, RTCRay& ray,
               RayCounts& counts) noexcept {
  if (!valid_ray(origin.x(), origin.y(), origin.z(), direction.x(), direction.y(), direction.z())) {
    ++counts.rejected;
    return false;
  }
  ++counts.rays;
  ray = {};
  ray.org_x = origin.x();
  ray.org_y = origin.y();
  ray.org_z = origin.z();
  ray.dir_x = direction.x();
  ray.dir_y = direction.y();
  ray.dir_z = direction.z();
  ray.tfar = kFar;
  ray.mask = kAllGeometry;
  return true;
}

using LaneMask = std::array<int, RayPacket::kLanes>;  // -1 traces a lane, 0 leaves it out

void start_rays(const RayPacket& rays, RTCRay16& out, LaneMask& mask, RayCounts& counts) noexcept {
  // Without a branch: these loops run on all lanes at once.
  alignas(64) std::array<int, RayPacket::kLanes> asked;
  for (std::size_t i = 0; i < mask.size(); ++i) asked[i] = rays.active[i] ? 1 : 0;
  int valid_rays = 0;
  int asked_rays = 0;
  for (std::size_t i = 0; i < mask.size(); ++i) {
    const int valid =
        asked[i] & valid_lane(rays.origin_x[i], rays.origin_y[i], rays.origin_z[i],
                              rays.direction_x[i], rays.direction_y[i], rays.direction_z[i]);
    valid_rays += valid;
    asked_rays += asked[i];
    mask[i] = -valid;
  }
  counts.rays += static_cast<std::uint64_t>(valid_rays);
  counts.rejected += static_cast<std::uint64_t>(asked_rays - valid_rays);
  // Lanes that are left out still have to be numbers.
  const auto copy = [&mask](const RayPacket::Lanes& from, float* __restrict to, float otherwise) {
    for (std::size_t i = 0; i < mask.size(); ++i) to[i] = mask[i] != 0 ? from[i] : otherwise;
  };
  copy(rays.origin_x, out.org_x, 0.0F);
  copy(rays.origin_y, out.org_y, 0.0F);
  copy(rays.origin_z, out.org_z, 0.0F);
  copy(rays.direction_x, out.dir_x, 0.0F);
  copy(rays.direction_y, out.dir_y, 0.0F);
  copy(rays.direction_z, out.dir_z, 1.0F);
  for (std::size_t i = 0; i < mask.size(); ++i) {
    out.tnear[i] = 0.0F;
    out.tfar[i] = kFar;
    out.time[i] = 0.0F;
    out.mask[i] = kAllGeometry;
  }
}

RTCIntersectContext context_for(RTCIntersectContextFlags flags) noexcept {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = flags;
  return context;
}

RTCIntersectContextFlags flag_of(RayCoherence coherence) noexcept {
  return coherence == RayCoherence::kParallel ? RTC_INTERSECT_CONTEXT_FLAG_COHERENT
                                              : RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;
}

/// One for all scenes of the process, and never released: letting go of the last one would have the
/// tracer start a thread of its own.
RTCDevice tracing_device() {
  // One building thread: the tree, and with it the bits, must not depend on the machine's load.
  static RTCDevice device = rtcNewDevice("threads=1");
  if (device == nullptr) throw std::runtime_error("Embree: no device");
  return device;
}

}  // namespace

struct EmbreeScene::Handles {
  RTCScene scene = nullptr;
  ~Handles() {
    if (scene != nullptr) rtcReleaseScene(scene);
  }
};

EmbreeScene::EmbreeScene(const Mesh& mesh) : handles_(std::make_unique<Handles>()) {
  RTCDevice device = tracing_device();
  RTCScene scene = handles_->scene = rtcNewScene(device);
  rtcSetSceneFlags(scene, RTC_SCENE_FLAG_ROBUST);
  rtcSetSceneBuildQuality(scene, RTC_BUILD_QUALITY_HIGH);
  RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
  auto* corners = static_cast<float*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0,
                                                              RTC_FORMAT_FLOAT3, 3 * sizeof(float),
                                                              mesh.vertices.size()));
  auto* indices = static_cast<unsigned*>(
      rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                              3 * sizeof(unsigned), mesh.triangles.size()));
  if (corners == nullptr || indices == nullptr) throw std::runtime_error("Embree: out of memory");
  for (const auto& v : mesh.vertices) {
    for (const float coordinate : {v.x(), v.y(), v.z()}) *corners++ = coordinate;
  }
  for (const auto& t : mesh.triangles) {
    for (const std::uint32_t corner : t.corner) *indices++ = corner;
  }
  rtcCommitGeometry(geometry);
  rtcAttachGeometry(scene, geometry);
  rtcReleaseGeometry(geometry);
  rtcCommitScene(scene);
  if (const RTCError error = rtcGetDeviceError(device); error != RTC_ERROR_NONE)
    throw std::runtime_error("Embree: error " + std::to_string(error));
}

EmbreeScene::~EmbreeScene() = default;

MeshHit EmbreeScene::intersect(const Eigen::Vector3f& origin, const Eigen::Vector3f& direction,
                               RayCounts& counts) const noexcept {
  RTCRayHit query{};
  if (!start_ray(origin, direction, query.ray, counts)) return {};
  query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  RTCIntersectContext context = context_for(RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT);
  rtcIntersect1(handles_->scene, &context, &query);
  if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID) return {};
  return {query.hit.primID, query.hit.u, query.hit.v};
}

bool EmbreeScene::occluded(const Eigen::Vector3f& origin, const Eigen::Vector3f& direction,
                           RayCounts& counts) const noexcept {
  RTCRay ray;
  if (!start_ray(origin, direction, ray, counts)) return false;
  RTCIntersectContext context = context_for(RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT);
  rtcOccluded1(handles_->scene, &context, &ray);
  return ray.tfar < 0.0F;  // Embree sets it to -inf when something is in the way
}

void EmbreeScene::intersect(const RayPacket& rays, std::array<MeshHit, RayPacket::kLanes>& hits,
                            RayCounts& counts, RayCoherence coherence) const noexcept {
  RTCRayHit16 query;
  alignas(64) LaneMask mask;
  start_rays(rays, query.ray, mask, counts);
  std::fill(std::begin(query.hit.geomID), std::end(query.hit.geomID), RTC_INVALID_GEOMETRY_ID);
  RTCIntersectContext context = context_for(flag_of(coherence));
  rtcIntersect16(mask.data(), handles_->scene, &context, &query);
  for (std::size_t i = 0; i < hits.size(); ++i) {
    const bool hit = mask[i] != 0 && query.hit.geomID[i] != RTC_INVALID_GEOMETRY_ID;
    hits[i] = hit ? MeshHit{query.hit.primID[i], query.hit.u[i], query.hit.v[i]} : MeshHit{};
  }
}

void EmbreeScene::occluded(const RayPacket& rays, std::array<bool, RayPacket::kLanes>& blocked,
                           RayCounts& counts, RayCoherence coherence) const noexcept {
  RTCRay16 query;
  alignas(64) LaneMask mask;
  start_rays(rays, query, mask, counts);
  RTCIntersectContext context = context_for(flag_of(coherence));
  rtcOccluded16(mask.data(), handles_->scene, &context, &query);
  for (std::size_t i = 0; i < blocked.size(); ++i)
    blocked[i] = mask[i] != 0 && query.tfar[i] < 0.0F;
}

}  // namespace engine
