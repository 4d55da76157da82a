#include "engine/scene/star_table.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>

#include "engine/core/contract.h"

namespace engine {
namespace {

constexpr std::size_t kLongestLine = 1000;
constexpr std::size_t kMostStars = 5'000'000;
constexpr std::size_t kMostColumns = 8;

enum class Column : std::uint8_t { kRa, kDec, kMag, kBv, kBpRp, kMotionRa, kMotionDec, kEpoch };
struct ColumnRule {
  std::string_view name;
  double low;
  double high;
  bool may_be_empty;
};
/// In the order of Column.
constexpr std::array<ColumnRule, kMostColumns> kRules{{
    {"ra_deg", -180.0, 360.0, false},
    {"dec_deg", -90.0, 90.0, false},
    {"mag", -30.0, 40.0, false},
    {"b_v", -1.0, 10.0, true},
    {"bp_rp", -2.0, 15.0, true},
    {"pmra_mas_yr", -kFastestStar_mas_yr, kFastestStar_mas_yr, true},
    {"pmdec_mas_yr", -kFastestStar_mas_yr, kFastestStar_mas_yr, true},
    {"epoch", 1800.0, 2200.0, true},
}};

using Cells = std::array<std::optional<double>, kMostColumns>;

std::string quoted(std::string_view text) {
  std::string quote(1, '"');
  quote.append(text.substr(0, 60));
  quote.push_back('"');
  return quote;
}

std::string_view trimmed(std::string_view text) {
  const auto first = text.find_first_not_of(" \t\r");
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(" \t\r") - first + 1);
}

/// Takes what stands before the next `mark` off the front of `rest`.
std::string_view cut(std::string_view& rest, char mark) {
  const auto end = std::min(rest.find(mark), rest.size());
  const std::string_view piece = rest.substr(0, end);
  rest.remove_prefix(std::min(end + 1, rest.size()));
  return piece;
}

class Reader {
 public:
  Reader(std::string_view text, const std::string& name) : rest_(text), name_(name) {}

  StarTable read() {
    StarTable table;
    while (!rest_.empty()) {
      const std::string_view line = cut(rest_, '\n');
      ++number_;
      if (line.size() > kLongestLine)
        fail("is longer than " + std::to_string(kLongestLine) + " characters");
      const std::string_view content = trimmed(line);
      if (content.empty() || content.front() == '#') continue;
      if (columns_.empty()) {
        name_columns(content);
        continue;
      }
      if (table.stars.size() == kMostStars)
        fail("is beyond the " + std::to_string(kMostStars) + " stars that are allowed");
      table.stars.push_back(star_of(cells_of(content)));
    }
    if (columns_.empty()) {
      number_ = std::max(number_, 1);
      fail("must name the columns ra_deg,dec_deg,mag and more, got nothing");
    }
    return table;
  }

 private:
  [[noreturn]] void fail(const std::string& complaint) const {
    throw ConfigError(name_ + ":" + std::to_string(number_) + ": " + complaint);
  }

  [[nodiscard]] bool has(Column wanted) const {
    return std::find(columns_.begin(), columns_.end(), wanted) != columns_.end();
  }

  void name_columns(std::string_view header) {
    for (bool more = true; more;) {
      more = header.find(',') != std::string_view::npos;
      const std::string_view name = trimmed(cut(header, ','));
      const auto rule = std::find_if(kRules.begin(), kRules.end(),
                                     [&](const ColumnRule& r) { return r.name == name; });
      if (rule == kRules.end())
        fail(
            "must name columns out of ra_deg, dec_deg, mag, b_v, bp_rp, pmra_mas_yr, pmdec_mas_yr, "
            "epoch; got " +
            quoted(name));
      const auto column = static_cast<Column>(rule - kRules.begin());
      if (has(column)) fail("names the column " + quoted(name) + " twice");
      columns_.push_back(column);
    }
    for (const Column needed : {Column::kRa, Column::kDec, Column::kMag})
      if (!has(needed))
        fail("must name the column " + std::string(kRules[static_cast<std::size_t>(needed)].name));
    if (has(Column::kBv) && has(Column::kBpRp)) fail("names two colours, b_v and bp_rp");
    if (has(Column::kMotionRa) != has(Column::kMotionDec))
      fail("must name both pmra_mas_yr and pmdec_mas_yr, or neither");
  }

  [[nodiscard]] Cells cells_of(std::string_view line) const {
    const auto found = static_cast<std::size_t>(std::count(line.begin(), line.end(), ',')) + 1;
    if (found != columns_.size())
      fail("must have " + std::to_string(columns_.size()) + " values, got " +
           std::to_string(found));
    Cells cells;
    for (const Column column : columns_) {
      const auto i = static_cast<std::size_t>(column);
      cells[i] = number_of(trimmed(cut(line, ',')), kRules[i]);
    }
    return cells;
  }

  [[nodiscard]] std::optional<double> number_of(std::string_view cell,
                                                const ColumnRule& rule) const {
    if (cell.empty() && rule.may_be_empty) return std::nullopt;
    std::string_view digits = cell;
    if (digits.starts_with('+')) digits.remove_prefix(1);
    double value = 0;
    const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
    // A value that is not a number is in no range.
    if (error != std::errc{} || end != digits.data() + digits.size() ||
        !(value >= rule.low && value <= rule.high))
      fail(std::string(rule.name) + " must be a number from " + plain(rule.low) + " to " +
           plain(rule.high) + ", got " + quoted(cell));
    return value;
  }
  static std::string plain(double whole) { return std::to_string(static_cast<long>(whole)); }

  [[nodiscard]] TableStar star_of(const Cells& cells) const {
    const auto at = [&](Column c) { return cells[static_cast<std::size_t>(c)]; };
    TableStar star;
    star.ra_rad = *at(Column::kRa) * kDegree;
    star.dec_rad = *at(Column::kDec) * kDegree;
    star.v_magnitude = *at(Column::kMag);
    star.colour_b_v = at(Column::kBv);
    if (const auto c = at(Column::kBpRp)) {
      const double x = std::clamp(*c, -0.5, 5.0);
      star.v_magnitude -= -0.02704 + x * (0.01424 + x * (-0.2156 + x * 0.01426));
      star.colour_b_v = b_v_of_gaia_colour(*c);
    }
    if (at(Column::kMotionRa).has_value() != at(Column::kMotionDec).has_value())
      fail("has one half of a motion: pmra_mas_yr and pmdec_mas_yr, or neither");
    star.has_motion = at(Column::kMotionRa).has_value();
    star.motion_ra_rad_yr = at(Column::kMotionRa).value_or(0.0) * kMilliarcsecond_rad;
    star.motion_dec_rad_yr = at(Column::kMotionDec).value_or(0.0) * kMilliarcsecond_rad;
    star.years = at(Column::kEpoch).value_or(2000.0) - 2000.0;
    return star;
  }

  std::string_view rest_;
  std::string name_;
  int number_ = 0;  ///< of the line
  std::vector<Column> columns_;
};

}  // namespace

double b_v_of_gaia_colour(double bp_rp) noexcept {
  // B2V, A0V, F0V, F5V, G2V, K0V, K5V, M0V, M4V; straight on beyond.
  constexpr std::array<std::array<double, 2>, 9> kMainSequence{{{-0.30, -0.21},
                                                                {0.00, 0.00},
                                                                {0.38, 0.295},
                                                                {0.587, 0.438},
                                                                {0.823, 0.650},
                                                                {0.983, 0.816},
                                                                {1.41, 1.134},
                                                                {1.84, 1.42},
                                                                {2.70, 1.65}}};
  std::size_t i = 1;
  while (i + 1 < kMainSequence.size() && bp_rp > kMainSequence[i][0]) ++i;
  const auto& low = kMainSequence[i - 1];
  const auto& high = kMainSequence[i];
  const double b_v = low[1] + (bp_rp - low[0]) * (high[1] - low[1]) / (high[0] - low[0]);
  return std::clamp(b_v, -0.35, 6.0);
}

StarTable read_star_table(std::string_view text, const std::string& name) {
  return Reader(text, name).read();
}

}  // namespace engine
