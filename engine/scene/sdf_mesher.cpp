#include "engine/scene/sdf_mesher.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <utility>

#include "engine/scene/sdf/features.h"
#include "engine/scene/sdf/front.h"
#include "engine/scene/sdf/marching.h"
#include "engine/scene/sdf/planar_truss.h"
#include "engine/scene/sdf/polygon_distance.h"
#include "engine/scene/sdf/surface_truss.h"

namespace engine {
namespace {

using Eigen::Vector3d;

constexpr double kLeastQuality = 0.1;
/// What mend() aims at: some are then well over the least.
constexpr double kWantedQuality = 0.3;
/// A truss that leaves the surface by more than this, in edges, has not found it.
constexpr double kMostOff = 0.35;
constexpr double kMostCells = 2e5;  ///< of a region, before a size is called too small

std::string text(const char* format, double x) {
  std::string out(120, '\0');
  out.resize(static_cast<std::size_t>(std::snprintf(out.data(), out.size(), format, x)));
  return out;
}

class Mesher {
 public:
  Mesher(const SdfShape& shape, const SdfMeshSpec& spec) : shape_(shape), spec_(spec) {}
  [[nodiscard]] SdfMesh run() &&;

 private:
  [[nodiscard]] bool look();
  [[nodiscard]] bool known_edges() const {
    return shape_.solid != nullptr || !shape_.loops_m.empty();
  }
  void fit_size(const Eigen::AlignedBox3d& seen_m);
  [[nodiscard]] std::size_t most_front_triangles() const;
  [[nodiscard]] WorkMesh whole_sheet(const Sheet& sheet) const;
  void try_front();
  void try_truss();
  void take_lattice();
  [[nodiscard]] std::string planar_balance();
  [[nodiscard]] std::string surface_balance();
  void finish(WorkMesh& mesh, const std::vector<Sheet>& sheets);
  void keep(const WorkMesh& mesh);
  void fall_back(const std::string& why) { out_.fell_back = why; }
  [[nodiscard]] Sheet own_sheet() const { return sheet_of(distance_m_, 1e-4 * smallest_m_); }
  [[nodiscard]] Sheet plane() const;

  const SdfShape& shape_;
  const SdfMeshSpec& spec_;
  DistanceFunction distance_m_;  ///< with a slope of about 1, and a number everywhere
  SizeFunction size_m_;
  double smallest_m_ = 0;
  SdfMesh out_;
};

double median_slope(const DistanceFunction& f, const std::vector<Vector3d>& places, double step_m,
                    bool is_region) {
  std::vector<double> slopes;
  for (std::size_t i = 0; i < places.size(); i += 1 + places.size() / 500) {
    Vector3d g = slope(f, places[i], step_m);
    if (is_region) g.z() = 0.0;
    if (std::isfinite(g.norm())) slopes.push_back(g.norm());
  }
  if (slopes.empty()) return 1.0;
  std::nth_element(slopes.begin(), slopes.begin() + static_cast<std::ptrdiff_t>(slopes.size() / 2),
                   slopes.end());
  return slopes[slopes.size() / 2];
}

/// A first, coarse mesh: is there anything, does it fit into its box, is the function a distance?
bool Mesher::look() {
  const Vector3d sizes = shape_.box_m.sizes();
  const double side_m = sizes.maxCoeff();
  if (!shape_.distance_m || !sizes.allFinite() || !(side_m > 0.0) || !(spec_.smallest_m > 0.0) ||
      !std::isfinite(spec_.smallest_m)) {
    out_.notes.emplace_back("the shape's box or its edge length is not a size");
    return false;
  }
  distance_m_ = shape_.distance_m;
  if (known_edges()) {
    fit_size(shape_.box_m);
    return true;
  }
  const double step_m = std::min(spec_.smallest_m, side_m / 24.0);
  const MarchedSurface coarse =
      shape_.is_region
          ? stuffed_region(shape_.distance_m, shape_.box_m, step_m)
          : marched_surface(shape_.distance_m, shape_.box_m, std::max(step_m, side_m / 48.0));
  if (coarse.report.not_finite > 0)
    out_.notes.push_back(text("the distance is not a number in %.0f places: taken for outside",
                              static_cast<double>(coarse.report.not_finite)));
  if (coarse.triangles.empty()) {
    out_.notes.emplace_back("no place in its box is inside the shape: nothing to mesh");
    return false;
  }
  if (coarse.report.inside_at_sides > 0)
    out_.notes.emplace_back("the shape reaches its box's sides, and is cut off there");
  if (coarse.report.unresolved > 0)
    out_.notes.push_back(
        text("gaps or walls thinner than %.3g m may be lost", coarse.report.step_m));
  const double slope_here = median_slope(shape_.distance_m, coarse.places_m,
                                         1e-3 * coarse.report.step_m, shape_.is_region);
  double scale = 1.0;
  if (!(slope_here > 0.5 && slope_here < 2.0) && slope_here > 1e-12) {
    scale = 1.0 / slope_here;
    out_.notes.push_back(
        text("the function is no distance, its slope is %.3g: scaled", slope_here));
  }
  distance_m_ = [f = shape_.distance_m, scale, step_m](const Vector3d& p) {
    const double d = scale * f(p);
    return std::isfinite(d) ? d : step_m;
  };
  Eigen::AlignedBox3d seen;
  for (const Vector3d& p : coarse.places_m) seen.extend(p);
  fit_size(seen);
  return true;
}

/// Edges as long as the body would leave nothing of it.
void Mesher::fit_size(const Eigen::AlignedBox3d& seen_m) {
  const Vector3d sizes = seen_m.sizes();
  double least = shape_.is_region ? std::min(sizes.x(), sizes.y()) : sizes.minCoeff();
  if (known_edges()) least = sizes.maxCoeff();
  const double most_m = least / 3.0;
  smallest_m_ = std::min(spec_.smallest_m, most_m);
  if (spec_.smallest_m > most_m)
    out_.notes.push_back(text("edges are no longer than a third of the body: %.3g m", most_m));
  // Of even triangles, so many cover the body.
  const double area =
      shape_.is_region
          ? sizes.x() * sizes.y()
          : 2.0 * (sizes.x() * sizes.y() + sizes.y() * sizes.z() + sizes.z() * sizes.x());
  const double finest_m =
      std::sqrt(area / std::min(kMostCells, 0.5 * static_cast<double>(spec_.most_triangles)));
  double floor_m = 0;
  if (smallest_m_ < finest_m && area / (smallest_m_ * smallest_m_) > kMostCells) {
    floor_m = finest_m;
    smallest_m_ = std::max(smallest_m_, floor_m);
    out_.notes.push_back(text("edges are no shorter than %.3g m: too many triangles", floor_m));
  }
  size_m_ = [f = spec_.size_m, floor_m, most_m](const Vector3d& p) {
    const double h = f(p);
    return std::isfinite(h) ? std::clamp(h, floor_m > 0.0 ? floor_m : 1e-6 * most_m, most_m)
                            : most_m;
  };
}

Sheet Mesher::plane() const {
  return {[](const Vector3d& p) { return p.z(); },
          [](const Vector3d&) -> Vector3d { return Vector3d::UnitZ(); }};
}

void Mesher::keep(const WorkMesh& mesh) {
  out_.places_m.clear();
  out_.triangles.clear();
  std::vector<std::uint32_t> moved_to(mesh.vertices());
  for (std::uint32_t v = 0; v < mesh.vertices(); ++v) {
    if (mesh.round(v).empty()) continue;
    moved_to[v] = static_cast<std::uint32_t>(out_.places_m.size());
    out_.places_m.push_back(mesh.place(v));
  }
  for (std::uint32_t t = 0; t < mesh.triangles().size(); ++t) {
    if (!mesh.alive(t)) continue;
    const Corners& c = mesh.triangles()[t];
    out_.triangles.push_back({moved_to[c[0]], moved_to[c[1]], moved_to[c[2]]});
  }
  // Inside a region no place is off.
  const DistanceFunction off = [this](const Vector3d& p) {
    const double d = distance_m_(p);
    return shape_.is_region ? std::max(d, 0.0) : d;
  };
  out_.figures = figures_of(out_.places_m, out_.triangles, off);
}

void Mesher::finish(WorkMesh& mesh, const std::vector<Sheet>& sheets) {
  mend(mesh, sheets, kWantedQuality);
  keep(mesh);
}

/// A front that has slipped through itself goes on for ever: several times what would cover the
/// box's sides is enough.
std::size_t Mesher::most_front_triangles() const {
  const Vector3d s = shape_.box_m.sizes();
  const double sides_m2 = 2.0 * (s.x() * s.y() + s.y() * s.z() + s.z() * s.x());
  const double room = 1000.0 + 12.0 * sides_m2 / (smallest_m_ * smallest_m_);
  return static_cast<std::size_t>(std::min(room, static_cast<double>(spec_.most_triangles)));
}

/// A ball or a ring, or one that is a hollow: it looks inwards.
WorkMesh Mesher::whole_sheet(const Sheet& sheet) const {
  const bool hollow = sheet.distance_m(shape_.box_m.max() + shape_.box_m.sizes()) < 0.0;
  const double sign = hollow ? -1.0 : 1.0;
  MarchedSurface raw =
      marched_surface([&](const Vector3d& p) { return sign * sheet.distance_m(p); }, shape_.box_m,
                      0.5 * smallest_m_);
  if (hollow)
    for (Corners& t : raw.triangles) std::swap(t[1], t[2]);
  return thinned(raw, size_m_, spec_.seed);
}

void Mesher::try_front() {
  out_.method = SdfMethod::kFront;
  if (!shape_.solid && shape_.loops_m.empty())
    return fall_back("the shape's edges are not known: a front has nowhere to start");
  const FeatureGraph graph =
      shape_.solid ? features_of(*shape_.solid, smallest_m_) : features_of(shape_.loops_m);
  if (!graph.missing.empty())
    return fall_back("the shape's edges were not found: " + graph.missing);
  WorkMesh mesh;
  // Round a tip there is little room.
  const SizeFunction size_m = [this, &graph](const Vector3d& p) {
    double h = size_m_(p);
    for (const FeatureGraph::Tip& tip : graph.tips)
      h = std::min(h, 0.3 * h + 0.5 * (p - tip.place_m).norm());
    return h;
  };
  const FrontReport report =
      fill_by_front(graph, shape_.solid.get(), size_m, most_front_triangles(), mesh);
  if (!report.failed.empty()) return fall_back(report.failed);
  for (const std::uint32_t s : graph.seamless) mesh.append(whole_sheet(graph.sheets[s]), s);
  const TrussReport truss = relax(mesh, graph.sheets, size_m, spec_.most_iterations);
  out_.iterations = truss.iterations;
  out_.triangulations = truss.triangulations;
  out_.settled = truss.settled;
  finish(mesh, graph.sheets);
  if (!shape_.is_region && !out_.figures.closed()) fall_back("the fronts left the surface open");
}

std::string Mesher::planar_balance() {
  std::vector<Vector3d> fixed;
  for (const auto& loop : shape_.loops_m) fixed.insert(fixed.end(), loop.begin(), loop.end());
  PlanarTruss truss = planar_truss(distance_m_, size_m_, smallest_m_, shape_.box_m, fixed,
                                   spec_.most_iterations, spec_.seed);
  out_.iterations = truss.report.iterations;
  out_.triangulations = truss.report.triangulations;
  out_.settled = truss.report.settled;
  WorkMesh mesh;
  for (const Vector3d& p : truss.places_m) mesh.add_vertex({p, 0, WorkMesh::Hold::kFree});
  for (const Corners& t : truss.triangles) mesh.add_triangle(t);
  for (std::uint32_t v = 0; v < fixed.size(); ++v) mesh.vertex(v).hold = WorkMesh::Hold::kFixed;
  mesh.hold_rims();
  finish(mesh, {plane()});
  if (truss.report.settled) return {};
  return text(truss.report.gave_up
                  ? "the truss does not come to rest: its moves stay at %.2g of an edge"
                  : "the truss has not come to rest: its moves are still %.2g of an edge",
              truss.report.last_move);
}

std::string Mesher::surface_balance() {
  WorkMesh mesh =
      thinned(marched_surface(distance_m_, shape_.box_m, 0.5 * smallest_m_), size_m_, spec_.seed);
  const std::vector<Sheet> sheets = {own_sheet()};
  const TrussReport truss = relax(mesh, sheets, size_m_, spec_.most_iterations);
  out_.iterations = truss.iterations;
  out_.triangulations = truss.triangulations;
  out_.settled = truss.settled;
  finish(mesh, sheets);
  if (truss.settled) return {};
  return text("the truss has not come to rest: its moves are still %.2g of an edge",
              truss.last_move);
}

/// At rest or not, a mesh that is good is good: rest is a threshold, not a proof.
void Mesher::try_truss() {
  out_.method = SdfMethod::kTruss;
  const std::string restless = shape_.is_region ? planar_balance() : surface_balance();
  std::string why;
  if (out_.triangles.empty()) {
    why = "the truss left no triangle";
  } else if (out_.figures.tangled > 0 || (!shape_.is_region && out_.figures.rims > 0)) {
    why = "the truss left the mesh open";
  } else if (out_.figures.smallest_quality < kLeastQuality) {
    why = text("the truss left triangles of quality %.2g", out_.figures.smallest_quality);
  } else if (out_.figures.off_m > kMostOff * smallest_m_) {
    why = text("the truss is %.2g m off the border", out_.figures.off_m);
  }
  if (why.empty() && restless.empty()) return;
  if (why.empty()) {
    out_.notes.push_back(restless + "; the mesh is good all the same");
  } else {
    fall_back(restless.empty() ? why : why + "; " + restless);
  }
}

void Mesher::take_lattice() {
  out_.method = SdfMethod::kLattice;
  if (shape_.is_region) {
    const MarchedSurface raw = stuffed_region(distance_m_, shape_.box_m, smallest_m_);
    WorkMesh mesh;
    for (const Vector3d& p : raw.places_m) mesh.add_vertex({p, 0, WorkMesh::Hold::kFree});
    for (const Corners& t : raw.triangles) mesh.add_triangle(t);
    mesh.hold_rims();
    return finish(mesh, {plane()});
  }
  WorkMesh mesh =
      thinned(marched_surface(distance_m_, shape_.box_m, 0.5 * smallest_m_), size_m_, spec_.seed);
  finish(mesh, {own_sheet()});
}

SdfMesh Mesher::run() && {
  out_.method = spec_.method;
  if (!look()) return std::move(out_);
  SdfMethod method = spec_.method;
  if (method == SdfMethod::kAuto) method = known_edges() ? SdfMethod::kFront : SdfMethod::kTruss;
  if (method == SdfMethod::kTruss) try_truss();
  if (!spec_.fall_back && method == SdfMethod::kTruss) return std::move(out_);
  // A front can do what a truss cannot, where it has edges to start from.
  const std::string truss_failed = std::move(out_.fell_back);
  out_.fell_back.clear();
  const bool wants_front = method == SdfMethod::kFront || (!truss_failed.empty() && known_edges());
  if (wants_front) try_front();
  if (method == SdfMethod::kLattice || !out_.fell_back.empty() ||
      (!truss_failed.empty() && !wants_front)) {
    take_lattice();
  }
  if (!truss_failed.empty())
    out_.fell_back = truss_failed + (out_.fell_back.empty() ? "" : "; " + out_.fell_back);
  if (out_.figures.smallest_quality < kLeastQuality && !out_.triangles.empty())
    out_.notes.push_back(
        text("the sharpest triangle has a quality of %.2g", out_.figures.smallest_quality));
  return std::move(out_);
}

}  // namespace

const char* name_of(SdfMethod method) noexcept {
  switch (method) {
    case SdfMethod::kAuto:
      return "auto";
    case SdfMethod::kTruss:
      return "truss";
    case SdfMethod::kFront:
      return "front";
    case SdfMethod::kLattice:
      return "lattice";
  }
  return "";
}

SdfShape surface_of(const Solid& solid) {
  auto shared = std::make_shared<const Solid>(solid);
  SdfShape shape;
  shape.distance_m = [shared](const Vector3d& p) { return shared->distance_m(p); };
  shape.box_m = solid.bounds_m();
  shape.solid = std::move(shared);
  return shape;
}

SdfShape surface_of(DistanceFunction distance_m, const Eigen::AlignedBox3d& box_m) {
  SdfShape shape;
  shape.distance_m = std::move(distance_m);
  shape.box_m = box_m;
  return shape;
}

SdfShape region_of(DistanceFunction distance_m, const Eigen::AlignedBox3d& box_m) {
  SdfShape shape = surface_of(std::move(distance_m), box_m);
  shape.is_region = true;
  return shape;
}

SdfShape region_of(const std::vector<std::vector<Vector3d>>& loops_m) {
  Eigen::AlignedBox3d box;
  for (const auto& loop : loops_m)
    for (const Vector3d& p : loop) box.extend(p);
  SdfShape shape = region_of(polygon_distance(loops_m), box);
  shape.loops_m = loops_m;
  return shape;
}

SdfMeshSpec even_edges(double edge_m, SdfMethod method) {
  SdfMeshSpec spec;
  spec.size_m = [edge_m](const Vector3d&) { return edge_m; };
  spec.smallest_m = edge_m;
  spec.method = method;
  return spec;
}

SdfMesh mesh_shape(const SdfShape& shape, const SdfMeshSpec& spec) {
  return Mesher(shape, spec).run();
}

Mesh SdfMesh::as_mesh(const std::string& material) const {
  Mesh mesh;
  const std::uint32_t index = mesh.material(material);
  for (const Vector3d& p : places_m) mesh.vertices.emplace_back(p.cast<float>());
  for (const Corners& t : triangles) mesh.triangles.push_back({t, index});
  return mesh;
}

}  // namespace engine
