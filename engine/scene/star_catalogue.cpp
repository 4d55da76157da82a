#include "engine/scene/star_catalogue.h"

#include <algorithm>
#include <bit>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <iterator>

#include "engine/core/constants.h"
#include "engine/scene/star_table.h"
#include "engine/scene/star_zones.h"

// data/stars.bin, by star_data.S.
extern "C" const unsigned char starloop_star_data[];
extern "C" const unsigned char starloop_star_data_end[];

namespace engine {
namespace {

constexpr std::size_t kHeaderBytes = 32;
constexpr std::size_t kLargestFile = 1U << 30U;
constexpr int kOffsetBits = 20;
constexpr unsigned kNoColour = 255;

[[noreturn]] void refuse(const std::string& name, const std::string& complaint) {
  throw ConfigError(name + ": is no star catalogue: " + complaint);
}

/// Little-endian, as all of Starloop's machines.
template <class Value>
Value value_at(std::span<const unsigned char> bytes, std::size_t offset) {
  static_assert(std::endian::native == std::endian::little);
  Value value{};
  std::memcpy(&value, bytes.data() + offset, sizeof value);
  return value;
}

CatalogueStar unpack(std::uint64_t bits, const StarZones::Cell& cell) {
  constexpr std::uint64_t kOffset = (1U << kOffsetBits) - 1;
  const double x = (static_cast<double>(bits & kOffset) + 0.5) / (kOffset + 1);
  const double y = (static_cast<double>(bits >> kOffsetBits & kOffset) + 0.5) / (kOffset + 1);
  const double ra = cell.ra_rad + x * cell.width_rad;
  const double dec = cell.dec_rad + y * cell.height_rad;
  const auto light = static_cast<unsigned>(bits >> 40U & 0xfffU);
  const auto shade = static_cast<unsigned>(bits >> 52U & 0xffU);
  CatalogueStar star;
  star.unit = unit_at(ra, dec);
  star.v_magnitude = static_cast<float>(-2.0 + 0.005 * light);
  if (shade != kNoColour) star.colour_b_v = static_cast<float>(-0.5 + 0.025 * shade);
  return star;
}

void keep(const CatalogueStar& star, const StarSpec& spec, StarCatalogue& out) {
  if (static_cast<double>(star.v_magnitude) > spec.limit_magnitude) return;
  out.stars.push_back(star);
  if (!std::isnan(star.colour_b_v)) return;
  out.stars.back().colour_b_v = static_cast<float>(spec.colour_b_v);
  ++out.without_colour;
}

StarCatalogue from_table(const StarTable& table, const StarSpec& spec, double now_years) {
  StarCatalogue out;
  double sum_years = 0;
  for (const TableStar& row : table.stars) {
    CatalogueStar star;
    star.v_magnitude = static_cast<float>(row.v_magnitude);
    if (row.colour_b_v) star.colour_b_v = static_cast<float>(*row.colour_b_v);
    star.unit = unit_at(row.ra_rad, row.dec_rad);
    const double years = now_years - row.years;
    if (row.has_motion)
      star.unit = moved(star.unit, row.motion_ra_rad_yr, row.motion_dec_rad_yr, years);
    const std::size_t before = out.stars.size();
    keep(star, spec, out);
    if (out.stars.size() == before || row.has_motion) continue;
    ++out.without_motion;
    sum_years += std::abs(years);
  }
  if (out.without_motion > 0) out.years = sum_years / static_cast<double>(out.without_motion);
  return out;
}

std::vector<unsigned char> bytes_of(const StarSpec& spec) {
  std::ifstream file(spec.path, std::ios::binary | std::ios::ate);
  const auto size = file ? static_cast<std::int64_t>(file.tellg()) : -1;
  if (size < 0 || static_cast<std::size_t>(size) > kLargestFile)
    throw ConfigError(spec.where + ": " + spec.path + " must be a file of at most 1 GiB");
  std::vector<unsigned char> bytes(static_cast<std::size_t>(size));
  file.seekg(0);
  file.read(reinterpret_cast<char*>(bytes.data()), size);
  if (!file) throw ConfigError(spec.where + ": " + spec.path + " cannot be read");
  return bytes;
}

}  // namespace

StarSpec read_stars(const ConfigTable& table) {
  StarSpec spec;
  const std::string source = table.text_or("catalogue", "none");
  spec.where = table.where("catalogue");
  if (source == "built-in") {
    spec.source = StarSpec::Source::kBuiltIn;
  } else if (source != "none") {
    spec.source = StarSpec::Source::kFile;
    spec.path = source;
  }
  if (source.empty())
    table.fail("catalogue", "must be \"none\", \"built-in\" or the path of a table, got \"\"");
  spec.limit_magnitude =
      table.number_or("limit_magnitude", spec.limit_magnitude, between(-30.0, 99.0));
  spec.colour_b_v = table.number_or("unknown_b_v", spec.colour_b_v, between(-0.5, 6.0));
  return spec;
}

double StarCatalogue::median_error_rad() const noexcept {
  // Hipparcos: half of the stars of V = 8 move faster, of those of V = 6 half by 0.03"/yr.
  constexpr double kMedianMotion_rad_yr = 0.02 * kDegree / 3600.0;
  return kMedianMotion_rad_yr * std::abs(years);
}

double years_after_j2000(Epoch t) noexcept {
  // The epoch counts from 2000-01-01T12:00 TAI, 32 s before J2000: 1e-6 years.
  return seconds(t.time_since_epoch()) / (365.25 * 86400.0);
}

StarCatalogue decode_stars(std::span<const unsigned char> bytes, const std::string& name,
                           const StarSpec& spec, Epoch epoch) {
  if (bytes.size() < kHeaderBytes || std::memcmp(bytes.data(), "SLSTARS1", 8) != 0)
    refuse(name, "it does not begin with SLSTARS1");
  const StarZones zones;
  if (value_at<std::uint32_t>(bytes, 8) != StarZones::kZones ||
      value_at<std::uint32_t>(bytes, 12) != StarZones::kCellsAtEquator)
    refuse(name, "other zones");
  const std::size_t count = value_at<std::uint32_t>(bytes, 16);
  const std::size_t motions = value_at<std::uint32_t>(bytes, 20);
  const auto catalogue_year = value_at<double>(bytes, 24);
  const std::size_t cells = zones.cells();
  if (bytes.size() != kHeaderBytes + 4 * cells + 8 * count + 12 * motions)
    refuse(name, "its length is not what its header says");
  if (!(catalogue_year >= 1800.0 && catalogue_year <= 2200.0)) refuse(name, "its epoch");

  StarCatalogue out;
  out.years = years_after_j2000(epoch) - (catalogue_year - 2000.0);
  out.stars.reserve(count);
  std::vector<CatalogueStar> all;
  all.reserve(count);
  std::size_t at = kHeaderBytes + 4 * cells;
  for (std::size_t c = 0; c < cells; ++c) {
    const std::size_t here = value_at<std::uint32_t>(bytes, kHeaderBytes + 4 * c);
    if (here > count - all.size()) refuse(name, "its cells hold more stars than it has");
    const StarZones::Cell cell = zones.cell(c);
    for (std::size_t i = 0; i < here; ++i, at += 8)
      all.push_back(unpack(value_at<std::uint64_t>(bytes, at), cell));
  }
  if (all.size() != count) refuse(name, "its cells hold fewer stars than it has");

  std::size_t kept_motions = 0;
  for (std::size_t i = 0; i < motions; ++i, at += 12) {
    const std::size_t star = value_at<std::uint32_t>(bytes, at);
    const auto ra_mas_yr = static_cast<double>(value_at<float>(bytes, at + 4));
    const auto dec_mas_yr = static_cast<double>(value_at<float>(bytes, at + 8));
    if (star >= count || !(std::hypot(ra_mas_yr, dec_mas_yr) < kFastestStar_mas_yr))
      refuse(name, "a motion that no star has");
    all[star].unit = moved(all[star].unit, ra_mas_yr * kMilliarcsecond_rad,
                           dec_mas_yr * kMilliarcsecond_rad, out.years);
    if (static_cast<double>(all[star].v_magnitude) <= spec.limit_magnitude) ++kept_motions;
  }
  for (const CatalogueStar& star : all) keep(star, spec, out);
  out.without_motion = out.stars.size() - std::min(kept_motions, out.stars.size());
  return out;
}

StarCatalogue read_star_catalogue(const StarSpec& spec, Epoch epoch) {
  if (spec.source == StarSpec::Source::kNone) return {};
  if (spec.source == StarSpec::Source::kBuiltIn)
    return decode_stars({starloop_star_data, starloop_star_data_end}, "built-in", spec, epoch);
  const std::vector<unsigned char> bytes = bytes_of(spec);
  constexpr std::string_view kMagic = "SLSTARS1";
  if (bytes.size() >= kMagic.size() && std::memcmp(bytes.data(), kMagic.data(), kMagic.size()) == 0)
    return decode_stars(bytes, spec.path, spec, epoch);
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  return from_table(read_star_table(text, spec.path), spec, years_after_j2000(epoch));
}

}  // namespace engine
