#include "engine/core/number_table.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>

#include "engine/core/contract.h"

namespace engine {
namespace {

constexpr std::size_t kLongestLine = 1000;

/// Reads at most kLongestLine characters: a file without line ends is not taken in whole.
bool next_line(std::istream& in, std::string& line) {
  line.clear();
  int c = in.get();
  if (c == std::istream::traits_type::eof()) return false;
  for (; c != std::istream::traits_type::eof() && c != '\n'; c = in.get()) {
    line.push_back(static_cast<char>(c));
    if (line.size() > kLongestLine) break;
  }
  if (!line.empty() && line.back() == '\r') line.pop_back();
  return true;
}

void read_row(const NumberTable& table, const std::string& line, std::size_t columns,
              NumberTable::Row& row) {
  const char* at = line.c_str();
  for (std::size_t i = 0; i < columns; ++i) {
    char* end = nullptr;
    const double value = std::strtod(at, &end);
    while (end != at && (*end == ' ' || *end == '\t')) ++end;
    const bool last = i + 1 == columns;
    if (end == at || !std::isfinite(value) || *end != (last ? '\0' : ','))
      table.fail(row.line, "must be " + std::to_string(columns) +
                               " finite numbers with commas between, got \"" + line.substr(0, 60) +
                               "\"");
    row.values.push_back(value);
    at = end + 1;
  }
}

}  // namespace

void NumberTable::fail(int line, const std::string& complaint) const {
  throw ConfigError(path + ":" + std::to_string(line) + ": " + complaint);
}

NumberTable read_number_table(const std::string& path, const std::string& columns,
                              std::size_t most_rows) {
  return read_number_table(path, std::vector<std::string>{columns}, most_rows);
}

NumberTable read_number_table(const std::string& path, const std::vector<std::string>& forms,
                              std::size_t most_rows) {
  std::string wanted;
  for (const std::string& columns : forms)
    wanted += (wanted.empty() ? "\"" : " or \"") + columns + "\"";
  NumberTable table;
  table.path = path;
  std::ifstream file(path, std::ios::binary);
  if (!file) throw ConfigError(path + ": expected a table, found no file to read");
  std::size_t count = 0;
  bool named = false;
  std::string line;
  for (int number = 1; next_line(file, line); ++number) {
    if (line.size() > kLongestLine)
      table.fail(number, "is longer than " + std::to_string(kLongestLine) + " characters");
    if (line.empty() || line[0] == '#') continue;
    if (!named) {
      std::erase(line, ' ');
      const auto form = std::ranges::find(forms, line);
      if (form == forms.end())
        table.fail(number,
                   "must name the columns " + wanted + ", got \"" + line.substr(0, 60) + "\"");
      table.form = static_cast<std::size_t>(form - forms.begin());
      count = static_cast<std::size_t>(std::ranges::count(line, ',')) + 1;
      named = true;
      continue;
    }
    if (table.rows.size() == most_rows)
      table.fail(number, "is beyond the " + std::to_string(most_rows) + " rows that are allowed");
    NumberTable::Row row;
    row.line = number;
    read_row(table, line, count, row);
    table.rows.push_back(std::move(row));
  }
  if (file.bad()) throw ConfigError(path + ": expected a table, found one unreadable");
  if (!named) table.fail(1, "must name the columns " + wanted + ", got nothing");
  return table;
}

}  // namespace engine
