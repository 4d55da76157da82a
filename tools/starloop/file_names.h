#pragma once

#include <filesystem>
#include <string>

namespace starloop {

/// A file's name for another beside it: of "out/mtf.csv" and "_plane.csv" "out/mtf_plane.csv".
[[nodiscard]] inline std::string beside(const std::filesystem::path& file, const std::string& end) {
  std::filesystem::path other = file;
  other.replace_filename(file.stem().string() + end);
  return other.string();
}

}  // namespace starloop
