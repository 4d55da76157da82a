#include "tools/bench/image_rays.h"

#include <cmath>

#include "engine/core/constants.h"
#include "engine/render/path_tracer.h"

namespace bench {

using namespace engine;
using Eigen::Vector3d;
using Eigen::Vector3f;

void Packets::add(const Vector3f& origin, const Vector3f& direction) {
  if (used_ == RayPacket::kLanes) used_ = 0;
  if (used_ == 0) all_.emplace_back();
  all_.back().set(used_++, origin, direction);
  ++rays_;
}

ImageRays rays_of(const TracedTarget& target, const Snapshot& snapshot,
                  const CameraGeometry& camera, int samples) {
  ImageRays rays;
  const TracedFrame frame(snapshot, camera, target.bounding_radius_m, 0.0);
  Footprint footprint(camera, 16, target.mesh.vertices.size());
  footprint.project(target.mesh, snapshot);
  const PixelRect region = footprint.region();
  const Vector3f to_sun = snapshot.sun.toward.unit.cast<float>();
  RayCounts counts;
  std::uint32_t number = 0;
  for (int v = region.top; v < region.bottom; ++v) {
    for (int u = region.left; u < region.right; ++u) {
      if (!footprint.marked(u, v)) continue;
      for (int i = 0; i < samples; ++i) {
        const SampleNumbers numbers(SequenceKind::kSobol, 7, number++);
        const auto place = numbers.pair(0);
        const Vector3d d = frame.at_zero + (u - 0.5 + static_cast<double>(place[0])) * frame.per_u +
                           (v - 0.5 + static_cast<double>(place[1])) * frame.per_v;
        const Vector3f start = (frame.origin + frame.advance * d).cast<float>();
        rays.camera.add(start, d.cast<float>());
        const MeshHit hit = target.scene.intersect(start, d.cast<float>(), counts);
        if (hit.triangle == MeshHit::kNone) continue;
        const SurfacePoint at = target.facets.at(hit, d.cast<float>());
        rays.shadow.add(at.start(), to_sun);
        if (i % 7 != 0) continue;  // one in seven bounces
        const auto e = numbers.pair(2);
        const double turn = 2.0 * kPi * static_cast<double>(e[1]);
        const double sine = std::sqrt(static_cast<double>(e[0]));
        const Vector3f along =
            (basis_round(at.normal.cast<double>()).transpose() *
             Vector3d(sine * std::cos(turn), sine * std::sin(turn), std::sqrt(1.0 - sine * sine)))
                .cast<float>();
        rays.bounce.add(at.start(), along);
        const MeshHit next = target.scene.intersect(at.start(), along, counts);
        if (next.triangle == MeshHit::kNone) continue;
        rays.bounce_shadow.add(target.facets.at(next, along).start(), to_sun);
      }
    }
  }
  return rays;
}

}  // namespace bench
