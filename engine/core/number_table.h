#pragma once

#include <string>
#include <vector>

namespace engine {

/// A small file of numbers: a first line that names the columns ("t_s,x_urad,y_urad"), then rows,
/// separated by commas; empty lines and those that begin with # do not count.
struct NumberTable {
  struct Row {
    int line = 0;  ///< in the file, from 1
    std::vector<double> values;
  };
  std::string path;
  std::size_t form = 0;  ///< which of the columns' lists it has
  std::vector<Row> rows;

  /// Throws ConfigError: "path:line: complaint".
  [[noreturn]] void fail(int line, const std::string& complaint) const;
};

/// Throws ConfigError, with path and line, for other columns, a cell that is no finite
/// number, or more than `most_rows`.
[[nodiscard]] NumberTable read_number_table(const std::string& path, const std::string& columns,
                                            std::size_t most_rows);
/// The same for a file that may have any of these lists of columns.
[[nodiscard]] NumberTable read_number_table(const std::string& path,
                                            const std::vector<std::string>& forms,
                                            std::size_t most_rows);

}  // namespace engine
