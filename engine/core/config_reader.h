#pragma once

#include <cstdint>
#include <limits>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "engine/core/contract.h"

namespace engine {

/// Which numbers a key may hold, and how to say so.
struct Range {
  double low = -std::numeric_limits<double>::infinity();
  double high = std::numeric_limits<double>::infinity();
  bool low_excluded = false;
  bool high_excluded = false;

  [[nodiscard]] bool holds(double x) const noexcept;
  [[nodiscard]] std::string text() const;  ///< "> 0", ">= 0 and < 1"
};
[[nodiscard]] constexpr Range any_number() noexcept { return {}; }
[[nodiscard]] constexpr Range positive() noexcept {
  Range r;
  r.low = 0.0;
  r.low_excluded = true;
  return r;
}
[[nodiscard]] constexpr Range at_least(double low) noexcept {
  Range r;
  r.low = low;
  return r;
}
[[nodiscard]] constexpr Range between(double low, double high) noexcept {
  Range r;
  r.low = low;
  r.high = high;
  return r;
}
[[nodiscard]] constexpr Range from_below(double low, double high) noexcept {
  Range r = between(low, high);
  r.high_excluded = true;
  return r;
}

class ConfigTable;

/// The bytes of a scenario file. Throws ConfigError.
[[nodiscard]] std::string scenario_text(const std::string& path);

/// A scenario: TOML text, and the line that each value stands on.
///
/// Every value is asked for by name and checked there; what nobody asked for is an unknown key, and
/// an error. `--set` values go through the same checks. All failures throw ConfigError.
class ConfigReader {
 public:
  [[nodiscard]] static ConfigReader from_file(const std::string& path);
  [[nodiscard]] static ConfigReader from_text(std::string_view text, const std::string& name);
  ~ConfigReader();
  ConfigReader(ConfigReader&&) noexcept;
  ConfigReader& operator=(ConfigReader&&) noexcept;

  /// "table.key=value", the value as TOML would write it; bare words and dates count as
  /// text.
  void set(const std::string& assignment);

  /// A table by its dotted name; one that is not there reads as empty.
  [[nodiscard]] ConfigTable table(const std::string& name) const;
  /// The names of the tables directly below `name`, in alphabetical order.
  [[nodiscard]] std::vector<std::string> tables_below(const std::string& name) const;
  /// The same in the order in which the file has them.
  [[nodiscard]] std::vector<std::string> tables_in_order(const std::string& name) const;
  /// Throws for the first key that no one has asked for: it is not one of `what`.
  void reject_unknown_keys(const std::string& what = "a scenario") const;

  [[nodiscard]] const std::string& name() const noexcept;

 private:
  friend class ConfigTable;
  struct Document;
  explicit ConfigReader(std::unique_ptr<Document> document);
  std::unique_ptr<Document> document_;
};

/// One table of a scenario. The reader outlives it.
class ConfigTable {
 public:
  [[nodiscard]] bool has(const std::string& key) const;

  [[nodiscard]] double number(const std::string& key, const Range& range) const;
  [[nodiscard]] double number_or(const std::string& key, double fallback, const Range& range) const;
  [[nodiscard]] std::int64_t integer(const std::string& key, const Range& range) const;
  [[nodiscard]] std::int64_t integer_or(const std::string& key, std::int64_t fallback,
                                        const Range& range) const;
  [[nodiscard]] std::string text(const std::string& key) const;
  [[nodiscard]] std::string text_or(const std::string& key, const std::string& fallback) const;
  /// A list of just so many numbers.
  [[nodiscard]] std::vector<double> numbers(const std::string& key, std::size_t count,
                                            const Range& range) const;
  /// A list of lists, each of just so many numbers.
  [[nodiscard]] std::vector<std::vector<double>> rows(const std::string& key, std::size_t columns,
                                                      const Range& range) const;
  /// Numbers, however many; empty when it is not there.
  [[nodiscard]] std::vector<double> numbers_or_none(const std::string& key,
                                                    const Range& range) const;
  /// A text, or a list of texts; empty when it is not there.
  [[nodiscard]] std::vector<std::string> texts(const std::string& key) const;
  /// What stands in a table whose keys are the user's own names, in alphabetical order.
  struct NamedText {
    std::string name;
    std::string text;
    std::string where;  ///< "file:line: table.name"
  };
  [[nodiscard]] std::vector<NamedText> named_texts() const;
  [[nodiscard]] bool flag_or(const std::string& key, bool fallback) const;  ///< true or false
  [[nodiscard]] bool is_text(const std::string& key) const;

  template <class Value>
  using Choices = std::vector<std::pair<std::string, Value>>;
  /// One of a few words.
  template <class Value>
  [[nodiscard]] Value choice_or(const std::string& key, const std::string& fallback,
                                const Choices<Value>& choices) const {
    const std::string word = text_or(key, fallback);
    std::string words;
    for (const auto& [name, value] : choices) {
      if (name == word) return value;
      words += (words.empty() ? "\"" : ", \"") + name + "\"";
    }
    fail(key, "must be one of " + words + ", got \"" + word + "\"");
  }

  /// "file:line: table.key", for a complaint that comes later.
  [[nodiscard]] std::string where(const std::string& key) const;
  /// Throws where(key) + " " + complaint.
  [[noreturn]] void fail(const std::string& key, const std::string& complaint) const;

 private:
  friend class ConfigReader;
  ConfigTable(const ConfigReader::Document& document, std::string name);
  [[nodiscard]] std::string path(const std::string& key) const;

  const ConfigReader::Document* document_;
  std::string name_;
};

}  // namespace engine
