#include "tools/starloop/mesh_views.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <Eigen/Geometry>
#include <opencv2/imgcodecs.hpp>

#include "engine/render/embree_scene.h"

namespace starloop {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::Vector3f;

constexpr int kSide_px = 720;
constexpr double kMargin = 1.08;
constexpr std::size_t kMostLines = 20'000;

MeshView view_from(const std::string& title, const Vector3d& toward, const Vector3d& up) {
  MeshView view;
  view.title = title;
  view.right = up.cross(toward).normalized();
  view.up = toward.cross(view.right).normalized();
  return view;
}

std::vector<MeshView> all_views() {
  const Vector3d corner = Vector3d(1.0, 0.7, 0.5).normalized();
  return {view_from("from +x", Vector3d::UnitX(), Vector3d::UnitZ()),
          view_from("from +y", Vector3d::UnitY(), Vector3d::UnitZ()),
          view_from("from +z", Vector3d::UnitZ(), Vector3d::UnitY()),
          view_from("from +x +y +z", corner, Vector3d::UnitZ()),
          view_from("from -x -y -z", -corner, Vector3d::UnitZ())};
}

/// Rays against a mesh that has been moved to its middle: a float is finest there.
class Viewer {
 public:
  Viewer(const engine::Mesh& mesh, const engine::MeshReport& report)
      : middle_m_(0.5 * (report.low_m + report.high_m)),
        radius_m_(std::max(0.5 * (report.high_m - report.low_m).norm(), 1e-9)),
        mesh_(centred(mesh, middle_m_)),
        scene_(mesh_) {}

  /// How far the body reaches in a view, from its middle.
  [[nodiscard]] double reach_m(const MeshView& view) const {
    double reach = 0;
    for (const Vector3f& v : mesh_.vertices)
      reach = std::max({reach, std::abs(view.right.dot(v.cast<double>())),
                        std::abs(view.up.dot(v.cast<double>()))});
    return reach;
  }

  void draw(MeshView& view, double side_m, cv::Mat& picture) {
    view.side_m = side_m;
    const Vector2d middle(view.right.dot(middle_m_), view.up.dot(middle_m_));
    view.low_m = middle - Vector2d::Constant(0.5 * view.side_m);
    const Vector3d toward = view.right.cross(view.up);
    for (int row = 0; row < kSide_px; ++row) {
      for (int column = 0; column < kSide_px; ++column) {
        const double u = ((column + 0.5) / kSide_px - 0.5) * view.side_m;
        const double v = (0.5 - (row + 0.5) / kSide_px) * view.side_m;
        const Vector3d from = u * view.right + v * view.up + 1.5 * radius_m_ * toward;
        picture.at<cv::Vec3b>(row, column) = colour(from.cast<float>(), toward.cast<float>());
      }
    }
  }

  [[nodiscard]] MeshView::Line line(const MeshView& view,
                                    const engine::MeshReport::EdgePlace& edge) {
    MeshView::Line line;
    line.open = edge.open;
    for (std::size_t i = 0; i < 2; ++i) {
      const Vector3d end = edge.end_m[i].cast<double>();
      line.end_m[i] = {view.right.dot(end), view.up.dot(end)};
    }
    // So far before the edge that no face that meets there is in the way.
    const Vector3d toward = view.right.cross(view.up);
    const Vector3d middle = 0.5 * (edge.end_m[0] + edge.end_m[1]).cast<double>() - middle_m_;
    const Vector3d before = middle + 2e-3 * radius_m_ * toward;
    line.hidden = scene_.occluded(before.cast<float>(), toward.cast<float>(), counts_);
    return line;
  }

 private:
  [[nodiscard]] static engine::Mesh centred(engine::Mesh mesh, const Vector3d& middle_m) {
    for (Vector3f& v : mesh.vertices) v = (v.cast<double>() - middle_m).cast<float>();
    return mesh;
  }

  [[nodiscard]] cv::Vec3b colour(const Vector3f& from, const Vector3f& toward) {
    const engine::MeshHit hit = scene_.intersect(from, -toward, counts_);
    if (hit.triangle == engine::MeshHit::kNone) return {255, 255, 255};
    const engine::Mesh::Triangle& t = mesh_.triangles[hit.triangle];
    const Vector3f a = mesh_.vertices[t.corner[0]];
    const Vector3f across =
        (mesh_.vertices[t.corner[1]] - a).cross(mesh_.vertices[t.corner[2]] - a).normalized();
    // A lamp beside the viewer's shoulder, so that faces at right angles differ.
    const Vector3f lamp = (toward + 0.35F * Vector3f(0.6F, -0.5F, 0.7F)).normalized();
    const float facing = across.dot(toward) < 0.0F ? -across.dot(lamp) : across.dot(lamp);
    const float light = 0.3F + 0.7F * std::max(facing, 0.0F);
    const auto& rgb = kMaterialColours[t.material % kMaterialColours.size()];
    cv::Vec3b bgr;
    for (int k = 0; k < 3; ++k)
      bgr[k] = static_cast<std::uint8_t>(
          std::lround(light * static_cast<float>(rgb[static_cast<std::size_t>(2 - k)])));
    return bgr;
  }

  Vector3d middle_m_;
  double radius_m_;
  engine::Mesh mesh_;
  engine::EmbreeScene scene_;
  engine::RayCounts counts_;
};

}  // namespace

std::vector<MeshView> draw_views(const engine::Mesh& mesh, const engine::MeshReport& report,
                                 const std::string& png) {
  Viewer viewer(mesh, report);
  std::vector<MeshView> views = all_views();
  cv::Mat strip(kSide_px, kSide_px * static_cast<int>(views.size()), CV_8UC3);
  double side_m = 0;
  for (const MeshView& view : views)
    side_m = std::max(side_m, 2.0 * kMargin * viewer.reach_m(view));
  int left = 0;
  for (MeshView& view : views) {
    cv::Mat picture = strip.colRange(left, left + kSide_px);
    left += kSide_px;
    viewer.draw(view, side_m, picture);
    for (const auto& edge : report.edge_places)
      if (view.lines.size() < kMostLines) view.lines.push_back(viewer.line(view, edge));
  }
  bool written = false;
  try {
    written = cv::imwrite(png, strip);
  } catch (const cv::Exception&) {  // no such folder
  }
  if (!written) throw std::runtime_error(png + ": cannot be written");
  return views;
}

}  // namespace starloop
