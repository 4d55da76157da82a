#include "engine/scene/obj_file.h"

#include <cstdio>
#include <istream>
#include <limits>
#include <map>
#include <memory>

#include <tiny_obj_loader.h>

#include "engine/core/contract.h"
#include "engine/scene/obj_lines.h"
#include "engine/scene/polygon.h"

namespace engine {
namespace {

constexpr std::size_t kMostCorners = 10'000'000;
constexpr std::size_t kMostBytes = 1U << 30;
constexpr const char* kUnnamed = "default";

std::string file_text(const std::string& path) {
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::fopen(path.c_str(), "rb"),
                                                             &std::fclose);
  if (file == nullptr) throw ConfigError(path + ": expected an OBJ mesh, found no file to read");
  std::string text;
  constexpr std::size_t kPiece = 1U << 20;
  for (std::size_t n = 1; n > 0;) {
    const std::size_t had = text.size();
    if (had > kMostBytes)
      throw ConfigError(path + ": expected an OBJ mesh of at most 1 GiB, found more");
    text.resize(had + kPiece);
    n = std::fread(text.data() + had, 1, kPiece, file.get());
    text.resize(had + n);
    if (text.find('\0', had) != std::string::npos) break;  // no text: that is told by its line
  }
  if (std::ferror(file.get()) != 0)
    throw ConfigError(path + ": expected an OBJ mesh, found what cannot be read");
  return text;
}

/// Names in the order that they are first used in.
class Names {
 public:
  explicit Names(std::vector<std::string>& names) : names_(names) {}
  void choose(const std::string& name) {
    chosen_ = name.empty() ? kUnnamed : name;
    known_ = false;
  }
  [[nodiscard]] std::uint32_t index() {
    if (known_) return index_;
    const auto [it, is_new] =
        index_of_.try_emplace(chosen_, static_cast<std::uint32_t>(names_.size()));
    if (is_new) names_.push_back(chosen_);
    known_ = true;
    return index_ = it->second;
  }

 private:
  std::vector<std::string>& names_;
  std::map<std::string, std::uint32_t> index_of_;
  std::string chosen_ = kUnnamed;
  std::uint32_t index_ = 0;
  bool known_ = false;
};

/// What the importer calls for each statement.
class Collector {
 public:
  Collector(const ObjLines& lines, MeshReport& report)
      : lines_(lines),
        report_(report),
        materials_(mesh().material_names),
        groups_(file_.grouped.group_names) {}

  static tinyobj::callback_t callbacks() {
    tinyobj::callback_t call;
    call.vertex_cb = [](void* to, float x, float y, float z, float) {
      static_cast<Collector*>(to)->vertex({x, y, z});
    };
    call.index_cb = [](void* to, tinyobj::index_t* corners, int count) {
      static_cast<Collector*>(to)->face({corners, static_cast<std::size_t>(count)});
    };
    call.usemtl_cb = [](void* to, const char* name, int) {
      static_cast<Collector*>(to)->materials_.choose(name);
    };
    call.group_cb = [](void* to, const char** names, int count) {
      std::string all;
      for (int i = 0; i < count; ++i) (all += i > 0 ? " " : "") += names[i];
      static_cast<Collector*>(to)->groups_.choose(all);
    };
    call.object_cb = [](void* to, const char* name) {
      static_cast<Collector*>(to)->groups_.choose(name);
    };
    return call;
  }

  [[nodiscard]] ObjFile finish() {
    report_.vertices = mesh().vertices.size();
    std::size_t first = 0;
    for (const Face& face : faces_) {
      cut(face, std::span(corners_).subspan(first, face.corners));
      first += face.corners;
    }
    return std::move(file_);
  }

 private:
  struct Face {
    std::uint32_t corners;
    std::uint32_t line;
    std::uint32_t material;
    std::uint32_t group;
  };

  [[nodiscard]] Mesh& mesh() noexcept { return file_.grouped.mesh; }

  void vertex(const Eigen::Vector3f& v) {
    constexpr float kNoNumber = std::numeric_limits<float>::quiet_NaN();
    mesh().vertices.push_back(lines_.is_number() ? v : Eigen::Vector3f::Constant(kNoNumber));
  }

  void face(std::span<const tinyobj::index_t> corners) {
    if (corners_.size() + corners.size() > kMostCorners)
      lines_.fail(lines_.line(), "expected at most 10 million corners of faces, found more");
    const auto so_far = static_cast<std::int64_t>(mesh().vertices.size());
    for (const tinyobj::index_t& corner : corners) {
      const std::int64_t index = corner.vertex_index;
      corners_.push_back(static_cast<std::uint32_t>(index > 0 ? index - 1 : so_far + index));
    }
    faces_.push_back({static_cast<std::uint32_t>(corners.size()), lines_.line(), materials_.index(),
                      groups_.index()});
  }

  void cut(const Face& face, std::span<const std::uint32_t> corners) {
    places_.clear();
    triangles_.clear();
    for (const std::uint32_t corner : corners) {
      if (corner >= mesh().vertices.size()) {
        lines_.fail(face.line, "expected the index of one of the " +
                                   std::to_string(mesh().vertices.size()) + " vertices, found \"" +
                                   std::to_string(corner + 1) + "\"");
      }
      places_.push_back(mesh().vertices[corner]);
    }
    if (!cut_polygon(places_, triangles_)) report_.tangled.add(face.line);
    for (const auto& [a, b, c] : triangles_) {
      mesh().triangles.push_back({{corners[a], corners[b], corners[c]}, face.material});
      file_.grouped.group.push_back(face.group);
      file_.line.push_back(face.line);
    }
  }

  const ObjLines& lines_;
  MeshReport& report_;
  ObjFile file_;
  Names materials_;
  Names groups_;
  std::vector<std::uint32_t> corners_;  ///< of all faces, one after the other
  std::vector<Face> faces_;
  std::vector<Eigen::Vector3f> places_;
  std::vector<std::array<std::uint32_t, 3>> triangles_;
};

}  // namespace

ObjFile obj_from_text(std::string_view text, const std::string& name, MeshReport& report) {
  ObjLines lines(text, name, report);
  Collector collector(lines, report);
  std::istream stream(&lines);
  stream.exceptions(std::ios::badbit);  // complaints of the lines pass through the importer
  if (!tinyobj::LoadObjWithCallback(stream, Collector::callbacks(), &collector))
    throw ConfigError(name + ": expected an OBJ mesh, found what the importer refuses");
  if (report.faces == 0) throw ConfigError(name + ": expected an OBJ mesh, found no face");
  return collector.finish();
}

ObjFile read_obj(const std::string& path, MeshReport& report) {
  return obj_from_text(file_text(path), path, report);
}

}  // namespace engine
