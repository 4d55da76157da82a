#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "engine/orbit/utc.h"

namespace engine {

/// A file in the keyword = value notation of the CCSDS (502.0-B-2, 504.0-B-1), line by line.
/// Lines may end with CR LF; empty ones and those that begin with COMMENT are not there. All
/// failures throw ConfigError: "file:line: what was expected, what was found".
class KvnLines {
 public:
  /// At most 256 MB.
  [[nodiscard]] static KvnLines from_file(const std::string& path);
  [[nodiscard]] static KvnLines from_text(std::string text, std::string name);

  /// The next line, as line(). False at the end.
  [[nodiscard]] bool next();
  /// The next line, that must be there.
  void need(const std::string& what);
  [[nodiscard]] std::string_view line() const noexcept { return line_; }
  [[nodiscard]] const std::string& name() const noexcept { return name_; }

  /// Left and right of the = sign, without blanks around; the key is empty where there is none.
  struct Entry {
    std::string_view key;
    std::string_view value;
  };
  [[nodiscard]] Entry entry() const;
  /// What blanks separate.
  [[nodiscard]] std::vector<std::string_view> words() const;

  [[nodiscard]] double number(std::string_view text) const;
  [[nodiscard]] int whole_number(std::string_view text, int least, int most) const;
  [[nodiscard]] Epoch epoch(std::string_view text, TimeScale scale) const;
  [[nodiscard]] TimeScale time_system(std::string_view text) const;
  /// Throws unless the frame is one that is taken for J2000.
  void need_inertial(std::string_view frame) const;

  /// "file:line", of the line that is read.
  [[nodiscard]] std::string where() const;
  [[noreturn]] void fail(const std::string& complaint) const;

 private:
  KvnLines(std::string text, std::string name) : text_(std::move(text)), name_(std::move(name)) {}

  std::string text_;
  std::string name_;
  std::size_t at_ = 0;
  int number_ = 0;
  std::string_view line_;
};

}  // namespace engine
