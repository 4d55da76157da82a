#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "engine/scene/sdf_mesher.h"
#include "tools/starloop/plot_script.h"
#include "tools/starloop/subcommands.h"

namespace starloop {
namespace {

using engine::SdfMesh;
using engine::SdfMeshSpec;
using engine::SdfMethod;
using engine::SdfShape;
using engine::Solid;

struct NamedShape {
  std::string name;
  std::string title;
  SdfShape shape;
  SdfMethod method = SdfMethod::kAuto;
};

/// The paper's four, and the last one by the wrong method.
std::vector<NamedShape> figure_4() {
  const Solid cube = Solid::box({2, 2, 2});
  const SdfShape blunt =
      engine::surface_of([cube](const Eigen::Vector3d& p) { return cube.distance_m(p); },
                         {Eigen::Vector3d::Constant(-1.2), Eigen::Vector3d::Constant(1.2)});
  return {
      {"square", "square", engine::region_of({{{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}}}),
       SdfMethod::kTruss},
      {"sphere", "sphere", engine::surface_of(Solid::sphere(1.0)), SdfMethod::kAuto},
      {"ring", "ring", engine::surface_of(Solid::torus(0.7, 0.3)), SdfMethod::kAuto},
      {"cube", "cube, front", engine::surface_of(cube), SdfMethod::kFront},
      {"cube_truss", "cube, truss", blunt, SdfMethod::kTruss}};
}

void finish(std::ofstream& file, const std::filesystem::path& path) {
  file.close();
  if (!file) throw std::runtime_error(path.string() + ": cannot be written");
}

void write_obj(const std::filesystem::path& path, const SdfMesh& mesh) {
  std::ofstream file(path);
  file.precision(9);
  for (const Eigen::Vector3d& p : mesh.places_m)
    file << "v " << p.x() << ' ' << p.y() << ' ' << p.z() << '\n';
  for (const engine::Corners& t : mesh.triangles)
    file << "f " << t[0] + 1 << ' ' << t[1] + 1 << ' ' << t[2] + 1 << '\n';
  finish(file, path);
}

}  // namespace

int mesh_shapes(const ShapesOptions& shapes) {
  const std::filesystem::path folder = shapes.out;
  std::filesystem::create_directories(folder);
  const std::filesystem::path table = folder / "shapes.csv";
  std::ofstream csv(table);
  csv.precision(6);
  csv << "name,title,method,iterations,settled,vertices,triangles,euler,closed,smallest_quality,"
         "mean_quality,off_m,edge_m";
  for (std::size_t i = 0; i < engine::MeshFigures::kBins; ++i) csv << ",bin_" << i;
  csv << '\n';
  std::printf("%-12s %-8s %9s %6s %7s %7s %8s\n", "shape", "method", "triangles", "Euler",
              "least q", "mean q", "off, mm");
  for (const NamedShape& named : figure_4()) {
    SdfMeshSpec spec = engine::even_edges(shapes.edge_m, named.method);
    spec.fall_back = false;
    const SdfMesh mesh = engine::mesh_shape(named.shape, spec);
    const engine::MeshFigures& f = mesh.figures;
    write_obj(folder / (named.name + ".obj"), mesh);
    csv << named.name << ",\"" << named.title << "\"," << engine::name_of(mesh.method) << ','
        << mesh.iterations << ',' << mesh.settled << ',' << f.vertices << ',' << f.triangles << ','
        << f.euler << ',' << f.closed() << ',' << f.smallest_quality << ',' << f.mean_quality << ','
        << f.off_m << ',' << shapes.edge_m;
    for (const std::size_t count : f.histogram) csv << ',' << count;
    csv << '\n';
    std::printf("%-12s %-8s %9zu %6d %7.3f %7.3f %8.2f\n", named.title.c_str(),
                engine::name_of(mesh.method), f.triangles, f.euler, f.smallest_quality,
                f.mean_quality, 1e3 * f.off_m);
    if (!mesh.fell_back.empty()) std::printf("  %s\n", mesh.fell_back.c_str());
  }
  finish(csv, table);
  if (!run_plot_script("shapes.py", table.string()))
    std::printf("no picture: /usr/bin/python3 with matplotlib did not draw it\n");
  return kGood;
}

}  // namespace starloop
