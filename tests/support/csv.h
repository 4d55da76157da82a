#pragma once

#include <starloop_test_paths.h>
#include <cctype>
#include <cstdlib>
#include <fstream>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace test_support {

/// A table of reference figures from tests/data. A column is named by its header up to the first
/// parenthesis. Throws std::runtime_error, which fails the test that reads it.
class Csv {
 public:
  class Row {
   public:
    [[nodiscard]] const std::string& text(const std::string& column) const {
      return cells_.at(csv_->column(column));
    }
    [[nodiscard]] double number(const std::string& column) const {
      const std::string& cell = text(column);
      char* end = nullptr;
      const double value = std::strtod(cell.c_str(), &end);
      if (end == cell.c_str() || *end != '\0')
        throw std::runtime_error(csv_->name_ + ": " + column + " is no number: " + cell);
      return value;
    }
    [[nodiscard]] bool has_number(const std::string& column) const { return !text(column).empty(); }

   private:
    friend class Csv;
    Row(const Csv& csv, std::vector<std::string> cells) : csv_(&csv), cells_(std::move(cells)) {}
    const Csv* csv_;
    std::vector<std::string> cells_;
  };

  explicit Csv(const std::string& name) : name_(name) {
    std::ifstream file(std::string(STARLOOP_SOURCE_DIR "/tests/data/") + name);
    std::string line;
    if (!std::getline(file, line)) throw std::runtime_error(name + ": no such table");
    for (const std::string& header : split(line)) columns_.push_back(header);
    while (std::getline(file, line)) {
      if (line.empty() || line == "\r") continue;
      rows_.push_back(Row(*this, split(line)));
      if (rows_.back().cells_.size() != columns_.size())
        throw std::runtime_error(name + ": a row of another length: " + line);
    }
    if (rows_.empty()) throw std::runtime_error(name + ": an empty table proves nothing");
  }
  Csv(const Csv&) = delete;
  Csv& operator=(const Csv&) = delete;

  [[nodiscard]] const std::vector<Row>& rows() const { return rows_; }

 private:
  static std::vector<std::string> split(const std::string& line) {
    std::vector<std::string> cells(1);
    bool quoted = false;
    for (const char c : line) {
      if (c == '"') {
        quoted = !quoted;
      } else if (c == ',' && !quoted) {
        cells.emplace_back();
      } else if (c != '\r') {
        cells.back() += c;
      }
    }
    return cells;
  }
  [[nodiscard]] std::size_t column(const std::string& wanted) const {
    for (std::size_t i = 0; i < columns_.size(); ++i)
      if (columns_[i] == wanted || columns_[i].starts_with(wanted + "(")) return i;
    throw std::runtime_error(name_ + ": no column " + wanted);
  }

  std::string name_;
  std::vector<std::string> columns_;
  std::vector<Row> rows_;
};

}  // namespace test_support
