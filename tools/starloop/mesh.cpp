#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include <Eigen/Geometry>
#include <nlohmann/json.hpp>

#include "engine/scene/mesh_spec.h"
#include "tools/starloop/file_names.h"
#include "tools/starloop/mesh_views.h"
#include "tools/starloop/plot_script.h"
#include "tools/starloop/subcommands.h"

namespace starloop {
namespace {

using nlohmann::json;

/// Triangles and area by name.
struct Share {
  std::size_t triangles = 0;
  double area_m2 = 0;
};

template <class IndexOf>
std::vector<Share> shares(const engine::Mesh& mesh, std::size_t names, const IndexOf& index_of) {
  std::vector<Share> all(names);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const auto& [a, b, c] = mesh.triangles[t].corner;
    const Eigen::Vector3d ab = (mesh.vertices[b] - mesh.vertices[a]).cast<double>();
    const Eigen::Vector3d ac = (mesh.vertices[c] - mesh.vertices[a]).cast<double>();
    Share& share = all[index_of(t)];
    ++share.triangles;
    share.area_m2 += 0.5 * ab.cross(ac).norm();
  }
  return all;
}

std::vector<Share> material_shares(const engine::Mesh& mesh) {
  return shares(mesh, mesh.material_names.size(),
                [&](std::size_t t) { return mesh.triangles[t].material; });
}
std::vector<Share> group_shares(const engine::GroupedMesh& grouped) {
  return shares(grouped.mesh, grouped.group_names.size(),
                [&](std::size_t t) { return grouped.group[t]; });
}

json shares_json(const std::vector<std::string>& names, const std::vector<Share>& shares) {
  json all = json::array();
  for (std::size_t i = 0; i < names.size(); ++i)
    all.push_back(
        {{"name", names[i]}, {"triangles", shares[i].triangles}, {"area_m2", shares[i].area_m2}});
  return all;
}

json point_json(const Eigen::Vector3d& p) { return {p.x(), p.y(), p.z()}; }

json report_json(const std::string& name, const engine::GroupedMesh& grouped,
                 const engine::MeshReport& r) {
  const auto defect = [](const engine::MeshDefect& d) {
    return json{{"count", d.count}, {"first_lines", d.lines}};
  };
  return {{"mesh", name},
          {"file", {{"faces", r.faces}, {"vertices", r.vertices}}},
          {"left_out",
           {{"few_corners", defect(r.few_corners)},
            {"not_finite", defect(r.not_finite)},
            {"zero_area", defect(r.zero_area)},
            {"duplicate", defect(r.duplicate)}}},
          {"mended",
           {{"welded_vertices", r.welded},
            {"weld_m", r.weld_m},
            {"flipped", defect(r.flipped)},
            {"tangled", defect(r.tangled)}}},
          {"told",
           {{"open_edges", defect(r.open_edges)},
            {"non_manifold_edges", defect(r.non_manifold_edges)},
            {"t_junctions", defect(r.t_junctions)},
            {"t_junctions_complete", r.t_junctions_complete},
            {"slivers", defect(r.slivers)},
            {"one_sided_pieces", r.one_sided},
            {"pieces_not_looked_round", r.not_looked},
            {"not_faces", defect(r.not_faces)},
            {"unknown_statements", defect(r.unknown)}}},
          {"triangles", r.triangles},
          {"vertices", r.kept_vertices},
          {"edges", r.edges},
          {"euler_characteristic", r.euler_characteristic},
          {"pieces", r.pieces},
          {"closed_pieces", r.closed_pieces},
          {"area_m2", r.area_m2},
          {"volume_m3", r.volume_m3},
          {"low_m", point_json(r.low_m)},
          {"high_m", point_json(r.high_m)},
          {"materials", shares_json(grouped.mesh.material_names, material_shares(grouped.mesh))},
          {"groups", shares_json(grouped.group_names, group_shares(grouped))},
          {"warnings", r.warnings}};
}

void print_shares(const char* what, const std::vector<std::string>& names,
                  const std::vector<Share>& shares) {
  constexpr std::size_t kEnough = 12;
  for (std::size_t i = 0; i < std::min(names.size(), kEnough); ++i)
    std::printf("%-10s %-28s %8zu triangles  %10.4g m2\n", i == 0 ? what : "",
                ("\"" + names[i] + "\"").c_str(), shares[i].triangles, shares[i].area_m2);
  if (names.size() > kEnough) std::printf("%-10s ... and %zu more\n", "", names.size() - kEnough);
}

void print_lines(const char* what, const std::vector<std::string>& lines) {
  for (std::size_t i = 0; i < lines.size(); ++i)
    std::printf("%-10s %s\n", i == 0 ? what : "", lines[i].c_str());
}

void print_report(const std::string& name, const engine::GroupedMesh& grouped,
                  const engine::MeshReport& r) {
  const Eigen::Vector3d size = r.high_m - r.low_m;
  std::printf("%s: %zu faces, %zu vertices; %zu triangles in the scene\n", name.c_str(), r.faces,
              r.vertices, r.triangles);
  std::printf("%-10s %.4g x %.4g x %.4g m: x %.4g to %.4g, y %.4g to %.4g, z %.4g to %.4g\n",
              "size", size.x(), size.y(), size.z(), r.low_m.x(), r.high_m.x(), r.low_m.y(),
              r.high_m.y(), r.low_m.z(), r.high_m.z());
  std::printf(
      "%-10s %.4g m2; %zu of %zu pieces are closed, of %.4g m3; Euler characteristic %lld\n",
      "surface", r.area_m2, r.closed_pieces, r.pieces, r.volume_m3,
      static_cast<long long>(r.euler_characteristic));
  print_shares("materials", grouped.mesh.material_names, material_shares(grouped.mesh));
  print_shares("groups", grouped.group_names, group_shares(grouped));
  print_lines("mended", r.repairs());
  print_lines("told", r.remarks());
  print_lines("warning", r.warnings);
  if (r.clean())
    std::printf("%-10s every edge is of two faces, nothing was left out or turned\n", "clean");
}

json views_json(const std::vector<MeshView>& views) {
  json all = json::array();
  for (const MeshView& view : views) {
    json lines = json::array();
    for (const MeshView::Line& line : view.lines)
      lines.push_back({line.end_m[0].x(), line.end_m[0].y(), line.end_m[1].x(), line.end_m[1].y(),
                       line.open ? 1 : 0, line.hidden ? 1 : 0});
    all.push_back({{"title", view.title},
                   {"right", point_json(view.right)},
                   {"up", point_json(view.up)},
                   {"low_m", {view.low_m.x(), view.low_m.y()}},
                   {"side_m", view.side_m},
                   {"lines", lines}});
  }
  return all;
}

/// Lies beside a picture until it is drawn, or cannot be.
class HelperFile {
 public:
  explicit HelperFile(std::string path) : path_(std::move(path)) {}
  ~HelperFile() {
    std::error_code ignored;
    std::filesystem::remove(path_, ignored);
  }
  HelperFile(const HelperFile&) = delete;
  HelperFile& operator=(const HelperFile&) = delete;
  [[nodiscard]] const std::string& path() const noexcept { return path_; }

 private:
  std::string path_;
};

/// Names of groups and materials are the file's, in whatever encoding.
std::string text_of(const json& report, int indent) {
  return report.dump(indent, ' ', false, json::error_handler_t::replace);
}

/// The picture's name: a PNG where none says what it is.
std::string picture_name(const std::string& out) {
  return std::filesystem::path(out).has_extension() ? out : out + ".png";
}

void draw(const std::string& out, json report, const engine::GroupedMesh& grouped,
          const engine::MeshReport& mesh_report) {
  const HelperFile views(beside(out, "_views.png"));
  const HelperFile labels(beside(out, "_views.json"));
  report["views"] = views_json(draw_views(grouped.mesh, mesh_report, views.path()));
  report["colours"] = kMaterialColours;
  bool drawn = false;
  if (std::ofstream file(labels.path()); file << text_of(report, -1) << std::flush)
    drawn = run_plot_script("mesh.py", labels.path(), out);
  if (!drawn) throw std::runtime_error(out + " cannot be drawn: is python3-matplotlib there?");
}

}  // namespace

int report_mesh(const MeshOptions& options) {
  engine::MeshSpec spec;
  spec.name = options.file;
  spec.units = options.units;
  if (!options.axes.empty()) spec.axes = engine::mesh_axes(options.axes, "--axes");
  engine::MeshReport report;
  const engine::GroupedMesh grouped = engine::load_mesh(spec, report);
  const json as_json = report_json(spec.name, grouped, report);
  if (options.as_json) {
    std::printf("%s\n", text_of(as_json, 2).c_str());
  } else {
    print_report(spec.name, grouped, report);
  }
  if (options.out.empty()) return kGood;
  const std::string picture = picture_name(options.out);
  draw(picture, as_json, grouped, report);
  if (!options.as_json) std::printf("%-10s %s\n", "picture", picture.c_str());
  return kGood;
}

}  // namespace starloop
