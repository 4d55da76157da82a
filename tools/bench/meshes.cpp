// Meshes: read, repaired, and made of signed distances.
#include <benchmark/benchmark.h>

#include "engine/core/constants.h"
#include "engine/scene/mesh_repair.h"
#include "engine/scene/obj_file.h"
#include "engine/scene/sdf/delaunay.h"
#include "engine/scene/sdf_mesher.h"

namespace {

using namespace engine;

/// A ball of a million triangles, as an exporter writes it.
const std::string& ball_text() {
  static const std::string text = [] {
    constexpr int kRings = 501;
    constexpr int kSides = 1000;
    std::string obj = "usemtl white\n";
    char line[160];
    for (int i = 0; i < kRings; ++i) {
      for (int k = 0; k < kSides; ++k) {
        const double polar = kPi * (i + 0.5) / kRings;
        const double azimuth = 2.0 * kPi * k / kSides;
        std::snprintf(line, sizeof line, "v %.6f %.6f %.6f\n", std::sin(polar) * std::cos(azimuth),
                      std::sin(polar) * std::sin(azimuth), std::cos(polar));
        obj += line;
      }
    }
    for (int i = 0; i + 1 < kRings; ++i) {
      for (int k = 0; k < kSides; ++k) {
        const int a = i * kSides + k + 1;
        const int b = i * kSides + (k + 1) % kSides + 1;
        std::snprintf(line, sizeof line, "f %d//%d %d//%d %d//%d\nf %d//%d %d//%d %d//%d\n", a, a,
                      a + kSides, a, b + kSides, a, a, a, b + kSides, a, b, a);
        obj += line;
      }
    }
    return obj;
  }();
  return text;
}
void bench_load_mesh(benchmark::State& state) {
  for (auto _ : state) {
    MeshReport report;
    ObjFile file = obj_from_text(ball_text(), "ball.obj", report);
    if (state.range(0) > 0) repair(file.grouped, std::move(file.line), report);
    if (state.range(0) > 1)
      benchmark::DoNotOptimize(smooth_normals(file.grouped.mesh, 40.0 * kDegree));
    benchmark::DoNotOptimize(file);
  }
}
BENCHMARK(bench_load_mesh)
    ->ArgName("read_repair_normals")
    ->DenseRange(0, 2, 1)
    ->Unit(benchmark::kMillisecond);

SdfShape square() { return region_of({{{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}}}); }

// What meshing costs in triangulations: a truss makes some twenty, a front none.
void bench_delaunay(benchmark::State& state) {
  const SdfMesh mesh = mesh_shape(square(), even_edges(0.05, SdfMethod::kTruss));
  for (auto _ : state) benchmark::DoNotOptimize(delaunay(mesh.places_m));
  state.counters["triangles"] = static_cast<double>(mesh.triangles.size());
}
BENCHMARK(bench_delaunay)->Unit(benchmark::kMillisecond);

void bench_meshing(benchmark::State& state, const SdfShape& shape, SdfMethod method,
                   double edge_m) {
  std::size_t triangles = 0;
  for (auto _ : state) triangles = mesh_shape(shape, even_edges(edge_m, method)).triangles.size();
  state.counters["triangles"] = static_cast<double>(triangles);
}
BENCHMARK_CAPTURE(bench_meshing, square_truss, square(), SdfMethod::kTruss, 0.05)
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(bench_meshing, square_front, square(), SdfMethod::kFront, 0.05)
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(bench_meshing, cube_front, surface_of(Solid::box({2, 2, 2})), SdfMethod::kFront,
                  0.1)
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(bench_meshing, sphere_truss, surface_of(Solid::sphere(1)), SdfMethod::kAuto, 0.1)
    ->Unit(benchmark::kMillisecond);

}  // namespace
