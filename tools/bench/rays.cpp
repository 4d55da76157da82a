// How fast rays are, beside Embree by itself on the same mesh and the same rays in one run; and the
// path tracer beside the sum of its rays, each at Embree's best rate for its kind.
//   build/release/bench_rays                  the built-in telescope
//   build/release/bench_rays hubble.obj 100   any mesh, so many pixels across
//   build/release/bench_rays hubble.obj 100 50   the path tracer alone, so many frames: for a
//   profiler
// CPU time, the least of several rounds taken in turn: other programs then count for little.
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <string>
#include <vector>

#include "engine/core/constants.h"
#include "engine/render/path_tracer.h"
#include "engine/scene/mesh_spec.h"
#include "engine/scene/telescope.h"
#include "hil/steady_clock.h"
#include "tools/bench/bare_embree.h"
#include "tools/bench/image_rays.h"
#include "tools/bench/least_times.h"

namespace {

using namespace engine;
using bench::ImageRays;
using bench::LeastTimes;
using bench::Packets;
using bench::rays_of;
using Eigen::Vector3d;

constexpr int kRounds = 9;
constexpr int kSamples = 50;

/// The least CPU time of each, in turn.
std::vector<double> least_s(const std::vector<std::function<void()>>& all) {
  LeastTimes times(all.size());
  for (int round = 0; round < kRounds; ++round)
    for (std::size_t i = 0; i < all.size(); ++i) times.time(i, all[i]);
  std::vector<double> least;
  for (std::size_t i = 0; i < all.size(); ++i) least.push_back(times.least_s(i));
  return least;
}

Snapshot view_of(double range_m) {
  Snapshot s;
  s.seed = 1;
  const Vector3d z = Vector3d(-0.6, -0.5, 0.62).normalized();
  s.camera.m = -range_m * z;
  s.range_m = range_m;
  const Vector3d x = z.cross(Vector3d::UnitZ()).normalized();
  s.body_from_camera.matrix.col(0) = x;
  s.body_from_camera.matrix.col(1) = z.cross(x);
  s.body_from_camera.matrix.col(2) = z;
  s.sun = {direction_of<BodyFrame>({0.9, 0.1, -0.5}), 630.0};
  s.earthshine = {direction_of<BodyFrame>({0.0, 0.1, 1.0}), 40.0};
  return s;
}

double range_for(const TracedTarget& target, const CameraGeometry& camera, double pixels_across) {
  return 2.0 * target.bounding_radius_m / (pixels_across * camera.ifov_rad());
}

struct Rates {
  double bare_s = 0;  ///< a ray, the better of both of Embree's flags
  double ours_s = 0;
};

Rates rates_of(const char* name, const BareEmbree& bare, const EmbreeScene& scene,
               const Packets& packets, bool shadow, RayCoherence how) {
  const auto plain = [&](RayCoherence coherence) {
    return [&, coherence] {
      static_cast<void>(shadow ? bare.occluded(packets.all(), coherence)
                               : bare.intersect(packets.all(), coherence));
    };
  };
  const auto ours = [&] {
    RayCounts counts;
    for (const RayPacket& packet : packets.all()) {
      std::array<MeshHit, RayPacket::kLanes> hits;
      std::array<bool, RayPacket::kLanes> blocked;
      if (shadow) {
        scene.occluded(packet, blocked, counts, how);
      } else {
        scene.intersect(packet, hits, counts, how);
      }
    }
  };
  const auto s = least_s({plain(RayCoherence::kParallel), plain(RayCoherence::kScattered), ours});
  const Rates rates{std::min(s[0], s[1]) / packets.rays(), s[2] / packets.rays()};
  std::printf(
      "%-16s %9.0f rays  Embree %6.1f Mray/s (coherent %5.1f, incoherent %5.1f)  ours %6.1f  "
      "ratio %.2f\n",
      name, packets.rays(), 1e-6 / rates.bare_s, 1e-6 * packets.rays() / s[0],
      1e-6 * packets.rays() / s[1], 1e-6 / rates.ours_s, rates.bare_s / rates.ours_s);
  return rates;
}

void render_only(const Mesh& mesh, const std::vector<Material>& materials, double pixels_across,
                 int frames) {
  const auto target = std::make_shared<TracedTarget>(mesh, materials);
  RenderSpec spec;
  spec.samples_per_pixel = kSamples;
  spec.grid.beyond_frame_px = 16;
  const Snapshot snapshot = view_of(range_for(*target, spec.camera, pixels_across));
  WorkerPool pool(1);
  PathTracer tracer(spec, target, pool);
  Radiance out;
  LeastTimes whole(1);
  whole.time(0, [&] {
    for (int i = 0; i < frames; ++i) static_cast<void>(tracer.render(snapshot, {}, out));
  });
  std::printf("%.3f CPU-ms a frame\n", whole.least_s(0) / frames * 1e3);
}

void compare(const char* name, const Mesh& mesh, const std::vector<Material>& materials,
             double pixels_across) {
  const auto target = std::make_shared<TracedTarget>(mesh, materials);
  RenderSpec spec;
  spec.samples_per_pixel = kSamples;
  spec.grid.beyond_frame_px = 16;
  const double range_m = 2.0 * target->bounding_radius_m / (pixels_across * spec.camera.ifov_rad());
  const Snapshot snapshot = view_of(range_m);
  // The image in the middle of the frame, as the camera looks at the origin.
  const ImageRays kinds = rays_of(*target, snapshot, spec.camera, kSamples);
  std::printf("\n%s: %zu triangles, %.0f px across, %d samples a pixel, 1 bounce\n", name,
              mesh.triangles.size(), pixels_across, kSamples);
  const BareEmbree bare(mesh);
  const EmbreeScene& scene = target->scene;
  const auto parallel = RayCoherence::kParallel;
  const auto scattered = RayCoherence::kScattered;
  const Rates camera = rates_of("camera", bare, scene, kinds.camera, false, parallel);
  const Rates shadow = rates_of("Sun shadow", bare, scene, kinds.shadow, true, parallel);
  const Rates bounce = rates_of("bounce", bare, scene, kinds.bounce, false, scattered);
  const Rates far_shadow =
      rates_of("bounce's shadow", bare, scene, kinds.bounce_shadow, true, scattered);

  RenderReport report;
  std::vector<double> wall_s;
  for (const int threads : {1, 2}) {
    WorkerPool pool(threads);
    PathTracer tracer(spec, target, pool);
    Radiance out;
    double least = 1e9;
    const auto frame = [&] {
      const Duration start = hil::SteadyClock::stopwatch();
      report = tracer.render(snapshot, {}, out);
      least = std::min(least, seconds(hil::SteadyClock::stopwatch() - start));
    };
    const double frame_s = least_s({frame})[0];
    wall_s.push_back(least);
    if (threads > 1) continue;
    const RaysByKind& n = report.rays_by_kind;
    const auto of = [](std::uint64_t rays, const Rates& r) {
      return static_cast<double>(rays) * r.bare_s;
    };
    const double bound_s = of(n.camera, camera) + of(n.shadow, shadow) + of(n.bounce, bounce) +
                           of(n.bounce_shadow, far_shadow);
    std::printf(
        "path tracer: %.2f CPU-ms a frame; its rays alone at Embree's rates %.2f; ratio "
        "%.2f\n",
        frame_s * 1e3, bound_s * 1e3, bound_s / frame_s);
    std::printf("  rays: camera %.0f, shadow %.0f, bounce %.0f, bounce's shadow %.0f (thousands)\n",
                1e-3 * static_cast<double>(n.camera), 1e-3 * static_cast<double>(n.shadow),
                1e-3 * static_cast<double>(n.bounce), 1e-3 * static_cast<double>(n.bounce_shadow));
  }
  std::printf("  wall: 1 thread %.2f ms, 2 threads %.2f ms, %.0f %% of twice as fast\n",
              wall_s[0] * 1e3, wall_s[1] * 1e3, 50.0 * wall_s[0] / wall_s[1]);
}

std::vector<Material> lambert_for(const Mesh& mesh) {
  std::vector<Material> materials;
  for (const std::string& name : mesh.material_names)
    materials.push_back({name, {1.0, -1.0, 0.0, 0.5 / kPi, 1.0}});
  return materials;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    const double pixels = argc > 2 ? std::atof(argv[2]) : 100.0;
    if (argc > 1) {
      MeshReport report;
      MeshSpec spec;
      spec.name = argv[1];
      const Mesh mesh = load_mesh(spec, report).mesh;
      if (argc > 3) {
        render_only(mesh, lambert_for(mesh), pixels, std::atoi(argv[3]));
        return 0;
      }
      compare("mesh, Lambert .5", mesh, lambert_for(mesh), pixels);
      return 0;
    }
    const Mesh mesh = telescope_mesh();
    compare("telescope, Lambert .5", mesh, lambert_for(mesh), pixels);
    compare("telescope, table 3", mesh,
            {{"silicon", {}},
             {"polyimide",
              {0.458, -51.90, 28.38, 0.077, 1.865},
              Brdf::Variant::kPhysical,
              15.0 * kDegree},
             {"black", {1.0, -1.0, 0.0, 0.00955, 1.0}}},
            pixels);
  } catch (const std::exception& e) {
    std::fprintf(stderr, "%s\n", e.what());
    return 1;
  }
  return 0;
}
