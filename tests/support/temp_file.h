#pragma once

#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <string>
#include <string_view>

namespace test_support {

/// A file name of this process alone; what stands there at the end is removed.
class TempFile {
 public:
  explicit TempFile(const std::string& suffix)
      : path_(folder() + "/starloop_" + std::to_string(::getpid()) + "_" + suffix) {}
  TempFile(const std::string& suffix, std::string_view content) : TempFile(suffix) {
    std::ofstream(path_, std::ios::binary) << content;
  }
  ~TempFile() { std::remove(path_.c_str()); }
  TempFile(const TempFile&) = delete;
  TempFile& operator=(const TempFile&) = delete;

  [[nodiscard]] const std::string& path() const { return path_; }

 private:
  static std::string folder() {
    const char* chosen = std::getenv("TMPDIR");
    return chosen != nullptr ? chosen : "/tmp";
  }
  std::string path_;
};

}  // namespace test_support
