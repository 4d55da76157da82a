#pragma once

#include <cstdint>
#include <streambuf>
#include <string>
#include <string_view>

#include "engine/scene/mesh_report.h"

namespace engine {

/// The statements of an OBJ text that make a mesh, one line at a time, each checked before the
/// importer sees it.
///
/// The importer believes its input: version 2.0.0~rc10 takes an index of fifteen digits modulo
/// 2^32, a relative one before the first vertex as it is (TALOS-2020-1212), and "nan" as zero. So
/// it gets v, f, g, o and usemtl alone, numbers that have the form of a number, indices of nine
/// digits at most after their zeros, and no texture coordinates or normals, which nothing here
/// uses. Comments, lines that are continued, and every sort of line end are dealt with here.
///
/// All failures throw ConfigError, "file:line: expected ..., found ...".
class ObjLines final : public std::streambuf {
 public:
  static constexpr std::size_t kLongestLine = 1U << 20;
  static constexpr std::size_t kMostVertices = 10'000'000;
  static constexpr std::size_t kMostCornersOfAFace = 4096;

  /// `text` outlives it; `name` is the file's.
  ObjLines(std::string_view text, std::string name, MeshReport& report);

  /// That the importer was given last, counted from 1: where its callbacks are called for.
  [[nodiscard]] std::uint32_t line() const noexcept { return line_; }
  /// Whether the vertex that it was given last is three numbers.
  [[nodiscard]] bool is_number() const noexcept { return is_number_; }
  [[noreturn]] void fail(std::uint32_t line, const std::string& complaint) const;

 protected:
  int_type underflow() override;

 private:
  [[nodiscard]] bool next_line();  ///< into line_text_; false: there is none
  /// Into statement_; false: nothing for the importer.
  [[nodiscard]] bool take_statement();
  [[nodiscard]] bool take_vertex(std::string_view rest);
  [[nodiscard]] bool take_face(std::string_view rest);
  void check_index(std::string_view index) const;
  [[noreturn]] void expected(const std::string& what, std::string_view found) const;

  std::string_view text_;  ///< what is left of it
  std::string name_;
  MeshReport& report_;
  std::uint32_t line_ = 0;
  std::uint32_t lines_taken_ = 0;
  std::int64_t vertices_ = 0;
  bool is_number_ = true;
  std::string joined_;  ///< a line that is continued
  std::string_view line_text_;
  std::string statement_;
};

}  // namespace engine
