#include "engine/scene/obj_lines.h"

#include <algorithm>
#include <array>
#include <cctype>

#include "engine/core/contract.h"

namespace engine {
namespace {

constexpr bool is_blank(char c) noexcept { return c == ' ' || c == '\t' || c == '\v' || c == '\f'; }
constexpr bool ends_line(char c) noexcept { return c == '\r' || c == '\n'; }

/// Up to the first character that is such a one.
template <class Is>
std::size_t length_before(std::string_view text, const Is& is) noexcept {
  return static_cast<std::size_t>(std::ranges::find_if(text, is) - text.begin());
}

std::string_view trimmed(std::string_view text) noexcept {
  while (!text.empty() && is_blank(text.front())) text.remove_prefix(1);
  while (!text.empty() && is_blank(text.back())) text.remove_suffix(1);
  return text;
}

/// Cuts the first word off; empty when there is none, or a comment begins.
std::string_view next_word(std::string_view& text) {
  text = trimmed(text);
  if (text.empty() || text.front() == '#') return {};
  const std::size_t length = length_before(text, is_blank);
  const std::string_view word = text.substr(0, length);
  text.remove_prefix(length);
  return word;
}

/// A comment ends with its line, even one like "# from C:\models\".
bool has_comment(std::string_view text) noexcept {
  for (std::size_t i = 0; i < text.size(); ++i)
    if (text[i] == '#' && (i == 0 || is_blank(text[i - 1]))) return true;
  return false;
}

std::size_t digits_at(std::string_view text) noexcept {
  std::size_t n = 0;
  while (n < text.size() && text[n] >= '0' && text[n] <= '9') ++n;
  return n;
}

void cut_sign(std::string_view& text) noexcept {
  if (!text.empty() && (text.front() == '+' || text.front() == '-')) text.remove_prefix(1);
}

/// [sign] digits [. digits] [e [sign] digits], with a digit before the e.
bool has_form_of_number(std::string_view text) noexcept {
  constexpr std::size_t kLongestExponent = 4;
  cut_sign(text);
  const std::size_t whole = digits_at(text);
  text.remove_prefix(whole);
  std::size_t decimals = 0;
  if (!text.empty() && text.front() == '.') {
    text.remove_prefix(1);
    decimals = digits_at(text);
    text.remove_prefix(decimals);
  }
  if (whole + decimals == 0) return false;
  if (text.empty()) return true;
  if (text.front() != 'e' && text.front() != 'E') return false;
  text.remove_prefix(1);
  cut_sign(text);
  return !text.empty() && text.size() <= kLongestExponent && digits_at(text) == text.size();
}

/// What printf makes of no number: nan, -nan(ind), inf, Infinity, 1.#QNAN, -1.#IND, 1.#INF.
bool says_no_number(std::string_view text) {
  std::string word(text);
  std::ranges::transform(word, word.begin(), [](unsigned char c) { return std::tolower(c); });
  return word.find("nan") != std::string::npos || word.find("inf") != std::string::npos ||
         word.find("#ind") != std::string::npos;
}

/// Statements of the format that say nothing about a face's shape or material.
bool is_other_statement(std::string_view word) {
  constexpr auto kKnown = std::to_array<std::string_view>(
      {"vt",     "vn",    "vp",       "s",        "mtllib", "mg",         "cstype",    "deg",
       "bmat",   "step",  "parm",     "trim",     "hole",   "scrv",       "sp",        "end",
       "con",    "bevel", "c_interp", "d_interp", "lod",    "shadow_obj", "trace_obj", "maplib",
       "usemap", "ctech", "stech",    "call",     "csh"});
  return std::ranges::find(kKnown, word) != kKnown.end();
}

bool is_without_surface(std::string_view word) {
  return word == "l" || word == "p" || word == "curv" || word == "curv2" || word == "surf";
}

}  // namespace

ObjLines::ObjLines(std::string_view text, std::string name, MeshReport& report)
    : text_(text), name_(std::move(name)), report_(report) {
  constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";
  if (text_.starts_with(kByteOrderMark)) text_.remove_prefix(kByteOrderMark.size());
}

void ObjLines::fail(std::uint32_t line, const std::string& complaint) const {
  throw ConfigError(name_ + ":" + std::to_string(line) + ": " + complaint);
}

void ObjLines::expected(const std::string& what, std::string_view found) const {
  constexpr std::size_t kEnough = 60;
  std::string shown(found.substr(0, kEnough));
  for (char& c : shown)
    if (std::iscntrl(static_cast<unsigned char>(c)) != 0) c = '?';
  if (found.size() > kEnough) shown += "...";
  fail(line_, "expected " + what + ", found \"" + shown + "\"");
}

bool ObjLines::next_line() {
  joined_.clear();
  line_ = lines_taken_ + 1;
  while (!text_.empty()) {
    const std::size_t length = length_before(text_, ends_line);
    std::string_view part = text_.substr(0, length);
    text_.remove_prefix(length);
    if (!text_.empty()) text_.remove_prefix(text_.starts_with("\r\n") ? 2 : 1);
    ++lines_taken_;
    if (part.size() + joined_.size() > kLongestLine)
      fail(lines_taken_, "expected a line of at most 1 MiB, found a longer one");
    if (part.find('\0') != std::string_view::npos)
      fail(lines_taken_, "expected the text of an OBJ mesh, found a zero byte");
    const bool continued = part.ends_with('\\') && !has_comment(part);
    if (continued) part.remove_suffix(1);
    if (joined_.empty() && !continued) {
      line_text_ = part;
      return true;
    }
    joined_.append(part).push_back(' ');
    line_text_ = joined_;
    if (!continued || text_.empty()) return true;
  }
  return false;
}

bool ObjLines::take_vertex(std::string_view rest) {
  if (++vertices_ > static_cast<std::int64_t>(kMostVertices))
    fail(line_, "expected at most 10 million vertices, found one more");
  statement_.assign(1, 'v');
  is_number_ = true;
  const std::string_view all = rest;
  for (int i = 0; i < 3; ++i) {
    const std::string_view word = next_word(rest);
    if (!has_form_of_number(word)) {
      if (!says_no_number(word)) expected("a vertex of three numbers", trimmed(all));
      is_number_ = false;
    }
    statement_.append(" ").append(word);
  }
  if (!is_number_) statement_.assign(std::string_view("v 0 0 0"));
  return true;
}

void ObjLines::check_index(std::string_view index) const {
  constexpr std::size_t kMostDigits = 9;
  std::string_view digits = index;
  cut_sign(digits);
  if (digits.empty() || digits_at(digits) != digits.size())
    expected("the index of a vertex", index);
  digits.remove_prefix(std::min(digits.find_first_not_of('0'), digits.size()));
  if (digits.empty()) expected("the index of a vertex, which count from 1", index);
  const bool relative = index.front() == '-';
  std::int64_t number = 0;
  if (digits.size() <= kMostDigits)
    for (const char c : digits) number = 10 * number + (c - '0');
  if (number == 0 || (relative && number > vertices_))
    expected("the index of one of the vertices, " + std::to_string(vertices_) + " up to here",
             index);
}

bool ObjLines::take_face(std::string_view rest) {
  ++report_.faces;
  statement_.assign(1, 'f');
  std::size_t corners = 0;
  for (std::string_view word = next_word(rest); !word.empty(); word = next_word(rest)) {
    if (++corners > kMostCornersOfAFace)
      fail(line_, "expected a face of at most 4096 corners, found one of more");
    const std::size_t slash = std::min(word.find('/'), word.size());
    if (word.find_first_not_of("0123456789+-/", slash) != std::string_view::npos)
      expected("a corner as vertex/texture/normal", word);
    const std::string_view index = word.substr(0, slash);
    check_index(index);
    statement_.append(" ").append(index);
  }
  if (corners >= 3) return true;
  report_.few_corners.add(line_);
  return false;
}

bool ObjLines::take_statement() {
  std::string_view rest = line_text_;
  const std::string_view word = next_word(rest);
  if (word.empty()) return false;
  if (word == "v") return take_vertex(rest);
  if (word == "f" || word == "fo") return take_face(rest);
  if (word == "g" || word == "o" || word == "usemtl") {
    statement_.assign(word).append(" ").append(trimmed(rest));
    return true;
  }
  if (is_without_surface(word)) {
    report_.not_faces.add(line_);
  } else if (!is_other_statement(word)) {
    report_.unknown.add(line_);
  }
  return false;
}

ObjLines::int_type ObjLines::underflow() {
  while (next_line()) {
    if (!take_statement()) continue;
    statement_.push_back('\n');
    setg(statement_.data(), statement_.data(), statement_.data() + statement_.size());
    return traits_type::to_int_type(statement_.front());
  }
  return traits_type::eof();
}

}  // namespace engine
