#include "engine/core/config_reader.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <set>
#include <sstream>

#include <toml++/toml.h>

namespace engine {
namespace {

std::string number_text(double x) {
  std::ostringstream out;
  out.precision(12);
  out << x;
  return out.str();
}

std::string kind_text(const toml::node& node) {
  if (const auto* value = node.as_string()) return "\"" + value->get() + "\"";
  if (const auto value = node.value<double>(); value && node.is_number())
    return number_text(*value);
  if (const auto* value = node.as_boolean()) return value->get() ? "true" : "false";
  std::ostringstream out;
  out << "a value of type " << node.type();
  return out.str();
}

/// Nothing when it is none that the range holds.
std::optional<double> number_in(const toml::node& node, const Range& range) {
  if (!node.is_number()) return std::nullopt;
  const double value = *node.value<double>();
  if (!std::isfinite(value) || !range.holds(value)) return std::nullopt;
  return value;
}

}  // namespace

bool Range::holds(double x) const noexcept {
  if (std::isnan(x)) return false;
  return (low_excluded ? x > low : x >= low) && (high_excluded ? x < high : x <= high);
}

std::string Range::text() const {
  std::string out;
  if (std::isfinite(low)) out = (low_excluded ? "> " : ">= ") + number_text(low);
  if (std::isfinite(high)) {
    out += (out.empty() ? "" : " and ") + std::string(high_excluded ? "< " : "<= ") +
           number_text(high);
  }
  return out.empty() ? "a number" : out;
}

std::string scenario_text(const std::string& path) {
  std::FILE* file = std::fopen(path.c_str(), "rb");
  if (file == nullptr) throw ConfigError(path + ": expected a scenario file, found none to read");
  std::string text;
  char buffer[4096];
  for (std::size_t n = 0; (n = std::fread(buffer, 1, sizeof buffer, file)) > 0;)
    text.append(buffer, n);
  const bool broken = std::ferror(file) != 0;
  std::fclose(file);
  if (broken) throw ConfigError(path + ": expected a scenario file, found one that cannot be read");
  return text;
}

struct ConfigReader::Document {
  std::string name;
  toml::table root;
  std::map<std::string, std::string> overridden;  ///< dotted path -> where it was set instead
  mutable std::set<std::string> asked;            ///< dotted paths that a room has read

  [[nodiscard]] const toml::node* find(const std::string& path) const {
    asked.insert(path);
    return root.at_path(path).node();
  }

  [[nodiscard]] std::string origin(const std::string& path) const {
    return origin_of(root.at_path(path).node(), path);
  }
  /// For names that a path cannot say: they may hold dots.
  [[nodiscard]] std::string origin_of(const toml::node* node, const std::string& path) const {
    if (const auto it = overridden.find(path); it != overridden.end()) return it->second;
    if (node == nullptr || node->source().begin.line == 0) return name;
    return name + ":" + std::to_string(node->source().begin.line);
  }

  void reject_unknown(const toml::table& table, const std::string& prefix,
                      const std::string& what) const {
    for (const auto& [key, node] : table) {
      const std::string path = prefix + std::string(key.str());
      if (const auto* below = node.as_table()) {
        reject_unknown(*below, path + ".", what);
      } else if (!asked.contains(path)) {
        throw ConfigError(origin(path) + ": " + path + " is not a key of " + what);
      }
    }
  }
};

ConfigReader::ConfigReader(std::unique_ptr<Document> document) : document_(std::move(document)) {}
ConfigReader::~ConfigReader() = default;
ConfigReader::ConfigReader(ConfigReader&&) noexcept = default;
ConfigReader& ConfigReader::operator=(ConfigReader&&) noexcept = default;

ConfigReader ConfigReader::from_text(std::string_view text, const std::string& name) {
  auto document = std::make_unique<Document>();
  document->name = name;
  try {
    document->root = toml::parse(text, name);
  } catch (const toml::parse_error& e) {
    throw ConfigError(name + ":" + std::to_string(e.source().begin.line) + ": " +
                      std::string(e.description()));
  }
  return ConfigReader(std::move(document));
}

ConfigReader ConfigReader::from_file(const std::string& path) {
  return from_text(scenario_text(path), path);
}

void ConfigReader::set(const std::string& assignment) {
  const std::string origin = "--set " + assignment;
  const auto equals = assignment.find('=');
  const auto last_dot = assignment.rfind('.', equals);
  if (equals == std::string::npos || last_dot == std::string::npos || last_dot == 0 ||
      last_dot + 1 == equals) {
    throw ConfigError(origin + ": expected table.key=value");
  }
  const std::string path = assignment.substr(0, equals);
  const std::string value = assignment.substr(equals + 1);
  toml::table parsed;
  try {
    parsed = toml::parse("v = " + value);
    const toml::node& v = *parsed.get("v");
    if (v.is_date() || v.is_time() || v.is_date_time()) parsed.insert_or_assign("v", value);
  } catch (const toml::parse_error&) {
    parsed.insert_or_assign("v", value);  // a bare word
  }
  // A bare date is one, too: scenarios have their dates as text.
  if (const auto* node = parsed.get("v");
      node->is_date_time() || node->is_date() || node->is_time())
    parsed.insert_or_assign("v", value);
  toml::table* table = &document_->root;
  std::istringstream parts(path.substr(0, last_dot));
  for (std::string part; std::getline(parts, part, '.');) {
    if (table->get(part) == nullptr) table->insert(part, toml::table{});
    table = table->get(part)->as_table();
    if (table == nullptr) throw ConfigError(origin + ": " += part += " is a value, not a table");
  }
  const std::string key = path.substr(last_dot + 1);
  if (const auto* old = table->get(key); old != nullptr && old->is_table())
    throw ConfigError(origin + ": " + path + " is a table, not a value");
  table->insert_or_assign(key, *parsed.get("v"));
  document_->overridden[path] = origin;
}

ConfigTable ConfigReader::table(const std::string& name) const { return {*document_, name}; }

std::vector<std::string> ConfigReader::tables_below(const std::string& name) const {
  std::vector<std::string> names;
  const auto* table = document_->root.at_path(name).as_table();
  if (table == nullptr) return names;
  for (const auto& [key, node] : *table)
    if (node.is_table()) names.emplace_back(key.str());
  return names;
}

std::vector<std::string> ConfigReader::tables_in_order(const std::string& name) const {
  std::vector<std::string> names = tables_below(name);
  const auto* table = document_->root.at_path(name).as_table();
  const auto line = [&](const std::string& key) {
    const toml::source_position& at = table->get(key)->source().begin;
    return std::pair(at.line, at.column);
  };
  std::stable_sort(names.begin(), names.end(),
                   [&](const auto& a, const auto& b) { return line(a) < line(b); });
  return names;
}

void ConfigReader::reject_unknown_keys(const std::string& what) const {
  document_->reject_unknown(document_->root, "", what);
}

const std::string& ConfigReader::name() const noexcept { return document_->name; }

ConfigTable::ConfigTable(const ConfigReader::Document& document, std::string name)
    : document_(&document), name_(std::move(name)) {
  const toml::node* node = document.root.at_path(name_).node();
  if (node != nullptr && !node->is_table())
    throw ConfigError(document.origin(name_) + ": " + name_ + " must be a table, got " +
                      kind_text(*node));
}

std::string ConfigTable::path(const std::string& key) const { return name_ + "." + key; }

bool ConfigTable::has(const std::string& key) const {
  return document_->find(path(key)) != nullptr;
}

std::string ConfigTable::where(const std::string& key) const {
  return document_->origin(path(key)) + ": " + path(key);
}

void ConfigTable::fail(const std::string& key, const std::string& complaint) const {
  throw ConfigError(where(key) + " " + complaint);
}

double ConfigTable::number(const std::string& key, const Range& range) const {
  const toml::node* node = document_->find(path(key));
  if (node == nullptr) fail(key, "is missing, expected " + range.text());
  const auto value = number_in(*node, range);
  if (!value) fail(key, "must be " + range.text() + ", got " + kind_text(*node));
  return *value;
}

std::vector<double> ConfigTable::numbers(const std::string& key, std::size_t count,
                                         const Range& range) const {
  const std::string wanted =
      "must be a list of " + std::to_string(count) + " numbers, each " + range.text();
  if (!has(key)) fail(key, "is missing: it " + wanted);
  const toml::array* list = document_->find(path(key))->as_array();
  if (list == nullptr) fail(key, wanted + ", got " + kind_text(*document_->find(path(key))));
  if (list->size() != count) fail(key, wanted + ", got " + std::to_string(list->size()));
  std::vector<double> all;
  for (const toml::node& node : *list) {
    const auto value = number_in(node, range);
    if (!value) fail(key, wanted + ", got in it " + kind_text(node));
    all.push_back(*value);
  }
  return all;
}

std::vector<std::vector<double>> ConfigTable::rows(const std::string& key, std::size_t columns,
                                                   const Range& range) const {
  const std::string wanted =
      "must be a list of lists of " + std::to_string(columns) + " numbers, each " + range.text();
  if (!has(key)) fail(key, "is missing: it " + wanted);
  const toml::array* list = document_->find(path(key))->as_array();
  if (list == nullptr) fail(key, wanted + ", got " + kind_text(*document_->find(path(key))));
  std::vector<std::vector<double>> all;
  for (const toml::node& row : *list) {
    const toml::array* cells = row.as_array();
    if (cells == nullptr || cells->size() != columns) fail(key, wanted);
    std::vector<double>& numbers = all.emplace_back();
    for (const toml::node& node : *cells) {
      const auto value = number_in(node, range);
      if (!value) fail(key, wanted + ", got in it " + kind_text(node));
      numbers.push_back(*value);
    }
  }
  return all;
}

std::vector<double> ConfigTable::numbers_or_none(const std::string& key, const Range& range) const {
  if (!has(key)) return {};
  const toml::array* list = document_->find(path(key))->as_array();
  if (list == nullptr) fail(key, "must be a list of numbers, each " + range.text());
  return numbers(key, list->size(), range);
}

double ConfigTable::number_or(const std::string& key, double fallback, const Range& range) const {
  return has(key) ? number(key, range) : fallback;
}

std::int64_t ConfigTable::integer(const std::string& key, const Range& range) const {
  const double value = number(key, range);
  if (value != std::floor(value) || std::abs(value) > 9e15)
    fail(key, "must be a whole number, got " + number_text(value));
  return static_cast<std::int64_t>(value);
}

std::int64_t ConfigTable::integer_or(const std::string& key, std::int64_t fallback,
                                     const Range& range) const {
  return has(key) ? integer(key, range) : fallback;
}

std::string ConfigTable::text(const std::string& key) const {
  const toml::node* node = document_->find(path(key));
  if (node == nullptr) fail(key, "is missing, expected text");
  if (!node->is_string()) fail(key, "must be text, got " + kind_text(*node));
  return node->as_string()->get();
}

std::string ConfigTable::text_or(const std::string& key, const std::string& fallback) const {
  return has(key) ? text(key) : fallback;
}

std::vector<std::string> ConfigTable::texts(const std::string& key) const {
  if (!has(key)) return {};
  const toml::array* list = document_->find(path(key))->as_array();
  if (list == nullptr) return {text(key)};
  std::vector<std::string> all;
  for (const toml::node& node : *list) {
    if (!node.is_string()) fail(key, "must be a list of texts, got in it " + kind_text(node));
    all.push_back(node.as_string()->get());
  }
  return all;
}

std::vector<ConfigTable::NamedText> ConfigTable::named_texts() const {
  std::vector<NamedText> all;
  const auto* table = document_->root.at_path(name_).as_table();
  if (table == nullptr) return all;
  for (const auto& [name, node] : *table) {
    const std::string its_path = path(std::string(name.str()));
    document_->asked.insert(its_path);
    const std::string its_where = document_->origin_of(&node, its_path) + ": " + its_path;
    if (!node.is_string()) throw ConfigError(its_where + " must be text, got " + kind_text(node));
    all.push_back({std::string(name.str()), node.as_string()->get(), its_where});
  }
  return all;
}

bool ConfigTable::flag_or(const std::string& key, bool fallback) const {
  if (!has(key)) return fallback;
  const toml::node* node = document_->find(path(key));
  if (!node->is_boolean()) fail(key, "must be true or false, got " + kind_text(*node));
  return node->as_boolean()->get();
}

bool ConfigTable::is_text(const std::string& key) const {
  const toml::node* node = document_->find(path(key));
  return node != nullptr && node->is_string();
}

}  // namespace engine
