#include "tools/bench/bare_embree.h"

#include <algorithm>
#include <array>
#include <limits>

#include <embree3/rtcore.h>

using engine::RayCoherence;
using engine::RayPacket;

struct BareEmbree::Handles {
  RTCDevice device = rtcNewDevice("threads=1");
  RTCScene scene = rtcNewScene(device);
};

namespace {

using Mask = std::array<int, RayPacket::kLanes>;

RTCIntersectContext context_for(RayCoherence coherence) {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = coherence == RayCoherence::kParallel ? RTC_INTERSECT_CONTEXT_FLAG_COHERENT
                                                       : RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;
  return context;
}

void copy(const RayPacket& from, RTCRay16& to, Mask& mask) {
  std::copy(from.origin_x.begin(), from.origin_x.end(), to.org_x);
  std::copy(from.origin_y.begin(), from.origin_y.end(), to.org_y);
  std::copy(from.origin_z.begin(), from.origin_z.end(), to.org_z);
  std::copy(from.direction_x.begin(), from.direction_x.end(), to.dir_x);
  std::copy(from.direction_y.begin(), from.direction_y.end(), to.dir_y);
  std::copy(from.direction_z.begin(), from.direction_z.end(), to.dir_z);
  for (std::size_t i = 0; i < mask.size(); ++i) {
    to.tnear[i] = 0.0F;
    to.tfar[i] = std::numeric_limits<float>::infinity();
    to.time[i] = 0.0F;
    to.mask[i] = ~0U;
    mask[i] = from.active[i] ? -1 : 0;
  }
}

}  // namespace

BareEmbree::BareEmbree(const engine::Mesh& mesh) : handles_(std::make_unique<Handles>()) {
  rtcSetSceneFlags(handles_->scene, RTC_SCENE_FLAG_ROBUST);
  rtcSetSceneBuildQuality(handles_->scene, RTC_BUILD_QUALITY_HIGH);
  RTCGeometry geometry = rtcNewGeometry(handles_->device, RTC_GEOMETRY_TYPE_TRIANGLE);
  auto* corners = static_cast<float*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0,
                                                              RTC_FORMAT_FLOAT3, 3 * sizeof(float),
                                                              mesh.vertices.size()));
  auto* indices = static_cast<unsigned*>(
      rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                              3 * sizeof(unsigned), mesh.triangles.size()));
  for (const auto& v : mesh.vertices)
    for (const float coordinate : {v.x(), v.y(), v.z()}) *corners++ = coordinate;
  for (const auto& t : mesh.triangles)
    for (const std::uint32_t corner : t.corner) *indices++ = corner;
  rtcCommitGeometry(geometry);
  rtcAttachGeometry(handles_->scene, geometry);
  rtcReleaseGeometry(geometry);
  rtcCommitScene(handles_->scene);
}

BareEmbree::~BareEmbree() {
  rtcReleaseScene(handles_->scene);
  rtcReleaseDevice(handles_->device);
}

std::size_t BareEmbree::intersect(std::span<const RayPacket> packets,
                                  RayCoherence coherence) const {
  std::size_t met = 0;
  alignas(64) Mask mask;
  for (const RayPacket& packet : packets) {
    RTCRayHit16 query;
    copy(packet, query.ray, mask);
    std::fill(std::begin(query.hit.geomID), std::end(query.hit.geomID), RTC_INVALID_GEOMETRY_ID);
    RTCIntersectContext context = context_for(coherence);
    rtcIntersect16(mask.data(), handles_->scene, &context, &query);
    for (const unsigned id : query.hit.geomID) met += id != RTC_INVALID_GEOMETRY_ID ? 1 : 0;
  }
  return met;
}

std::size_t BareEmbree::occluded(std::span<const RayPacket> packets, RayCoherence coherence) const {
  std::size_t met = 0;
  alignas(64) Mask mask;
  for (const RayPacket& packet : packets) {
    RTCRay16 query;
    copy(packet, query, mask);
    RTCIntersectContext context = context_for(coherence);
    rtcOccluded16(mask.data(), handles_->scene, &context, &query);
    for (const float far : query.tfar) met += far < 0.0F ? 1 : 0;
  }
  return met;
}
