#include "engine/orbit/kvn.h"

#include <charconv>
#include <cmath>
#include <fstream>

#include "engine/core/contract.h"

namespace engine {
namespace {

constexpr std::size_t kMostBytes = 256U << 20U;
constexpr std::size_t kLongestQuote = 60;

std::string_view trimmed(std::string_view text) {
  constexpr std::string_view kBlank = " \t\r";
  const std::size_t first = text.find_first_not_of(kBlank);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(kBlank) - first + 1);
}

std::string quoted(std::string_view text) {
  std::string quote = "\"";
  quote += text.substr(0, kLongestQuote);
  return quote += '"';
}

}  // namespace

KvnLines KvnLines::from_file(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) throw ConfigError(path + ": expected a CCSDS file, found none to read");
  std::string text;
  std::vector<char> buffer(1U << 16U);
  while (file.read(buffer.data(), static_cast<std::streamsize>(buffer.size())) ||
         file.gcount() > 0) {
    text.append(buffer.data(), static_cast<std::size_t>(file.gcount()));
    if (text.size() > kMostBytes) throw ConfigError(path + ": expected at most 256 MB, found more");
  }
  if (file.bad()) throw ConfigError(path + ": expected a CCSDS file, found one unreadable");
  return {std::move(text), path};
}

KvnLines KvnLines::from_text(std::string text, std::string name) {
  return {std::move(text), std::move(name)};
}

bool KvnLines::next() {
  while (at_ < text_.size()) {
    const std::size_t end = std::min(text_.find('\n', at_), text_.size());
    line_ = trimmed(std::string_view(text_).substr(at_, end - at_));
    at_ = end + 1;
    ++number_;
    if (!line_.empty() && line_.substr(0, 7) != "COMMENT") return true;
  }
  line_ = {};
  return false;
}

void KvnLines::need(const std::string& what) {
  if (!next()) fail("expected " + what + ", found the end of the file");
}

KvnLines::Entry KvnLines::entry() const {
  const std::size_t equals = line_.find('=');
  if (equals == std::string_view::npos) return {{}, line_};
  return {trimmed(line_.substr(0, equals)), trimmed(line_.substr(equals + 1))};
}

std::vector<std::string_view> KvnLines::words() const {
  std::vector<std::string_view> all;
  std::size_t at = 0;
  while ((at = line_.find_first_not_of(" \t", at)) != std::string_view::npos) {
    const std::size_t end = std::min(line_.find_first_of(" \t", at), line_.size());
    all.push_back(line_.substr(at, end - at));
    at = end;
  }
  return all;
}

double KvnLines::number(std::string_view text) const {
  const std::string_view digits = text.substr(0, 1) == "+" ? text.substr(1) : text;
  double value = 0;
  const auto [end, fault] = std::from_chars(digits.begin(), digits.end(), value);
  if (fault != std::errc{} || end != digits.end() || !std::isfinite(value))
    fail("expected a finite number, found " + quoted(text));
  return value;
}

int KvnLines::whole_number(std::string_view text, int least, int most) const {
  int value = 0;
  const auto [end, fault] = std::from_chars(text.begin(), text.end(), value);
  if (fault != std::errc{} || end != text.end() || value < least || value > most)
    fail("expected a whole number from " + std::to_string(least) + " to " + std::to_string(most) +
         ", found " + quoted(text));
  return value;
}

Epoch KvnLines::epoch(std::string_view text, TimeScale scale) const {
  const auto t = epoch_from_text(text, scale);
  if (!t)
    fail("expected a date like 2022-01-01T00:00:00.5 or 2022-001T00:00:00.5, found " +
         quoted(text));
  return *t;
}

TimeScale KvnLines::time_system(std::string_view text) const {
  if (text == "UTC") return TimeScale::kUtc;
  if (text == "TAI") return TimeScale::kTai;
  if (text == "TT") return TimeScale::kTt;
  if (text == "GPS") return TimeScale::kGps;
  fail("expected TIME_SYSTEM to be UTC, TAI, TT or GPS, found " + quoted(text));
}

void KvnLines::need_inertial(std::string_view frame) const {
  for (const std::string_view known : {"EME2000", "J2000", "GCRF", "ICRF"})
    if (frame == known) return;
  fail("expected one of the frames EME2000, J2000, GCRF and ICRF, found " + quoted(frame));
}

std::string KvnLines::where() const { return name_ + ":" + std::to_string(number_); }

void KvnLines::fail(const std::string& complaint) const {
  throw ConfigError(where() + ": " + complaint);
}

}  // namespace engine
