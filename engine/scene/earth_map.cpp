#include "engine/scene/earth_map.h"

#include <array>
#include <cstdint>
#include <string_view>

#include "engine/core/constants.h"

namespace engine {
namespace {

#include "engine/scene/earth_map_cells.inc"

constexpr int kRows = 90;
constexpr int kColumns = 180;
constexpr double kCell_deg = 2.0;
constexpr std::string_view kLetters = "~+.#";  // sea, land, desert, ice
constexpr std::size_t kKinds = 4;
constexpr std::array<double, kKinds> kCloudCover{0.72, 0.55, 0.20, 0.72};

constexpr double ramp(double x, double from, double to) {
  return x <= from ? 0.0 : x >= to ? 1.0 : (x - from) / (to - from);
}

/// A parallel of cells: what each kind of ground sends back in clear weather, and how much of the
/// clouds' light it adds.
struct Row {
  std::array<double, kKinds> clear{};
  std::array<double, kKinds> cloudy{};
  double mean_clear = 0;
  double mean_cloudy = 0;
  std::array<bool, kKinds> has{};
};

struct Map {
  std::array<std::array<std::uint8_t, kColumns>, kRows> kind{};
  std::array<Row, kRows> row{};
};

constexpr Map make_map() {
  Map map;
  for (std::size_t i = 0; i < kRows; ++i) {
    Row& row = map.row[i];
    const double north_deg = 90.0 - (static_cast<double>(i) + 0.5) * kCell_deg;
    const double off_equator_deg = north_deg < 0.0 ? -north_deg : north_deg;
    row.clear = {0.10 + 0.40 * ramp(off_equator_deg, 60.0, 80.0),
                 0.18 + 0.27 * ramp(off_equator_deg, 40.0, 70.0), 0.32, 0.66};
    for (std::size_t k = 0; k < kKinds; ++k) row.cloudy[k] = kCloudCover[k] * (1.0 - row.clear[k]);
    for (std::size_t j = 0; j < kColumns; ++j) {
      constexpr std::size_t kHalf = kColumns / 2;
      const char letter =
          j < kHalf ? kWesternCells[i * kHalf + j] : kEasternCells[i * kHalf + j - kHalf];
      const std::size_t k = kLetters.find(letter);
      map.kind[i][j] = static_cast<std::uint8_t>(k);
      row.has[k] = true;
      row.mean_clear += row.clear[k] / kColumns;
      row.mean_cloudy += row.cloudy[k] / kColumns;
    }
  }
  return map;
}
constexpr Map kMap = make_map();

/// The three neighbours on a line of cells that a place on it lies among, and their shares.
struct Among {
  int first;  ///< may be -1
  std::array<double, 3> share;

  /// `at`: 0 is the middle of the first cell.
  explicit Among(double at) noexcept {
    const double middle = std::floor(at + 0.5);
    const double f = at - middle;
    // A place that is no number is at the start: its shares are none either.
    first = middle >= 0.0 ? static_cast<int>(middle) - 1 : -1;
    share = {0.5 * (0.5 - f) * (0.5 - f), 0.75 - f * f, 0.5 * (0.5 + f) * (0.5 + f)};
  }
};

/// Beyond the pole lies the row that one comes from: both are of one kind all round.
const Row& row_at(int i) noexcept {
  return kMap.row[static_cast<std::size_t>(std::clamp(i, 0, kRows - 1))];
}

Among rows_among(double sin_latitude) noexcept {
  const double from_pole = 0.5 * kPi - std::asin(std::clamp(sin_latitude, -1.0, 1.0));
  return Among(from_pole / (kCell_deg * kDegree) - 0.5);
}

/// Of what each row's kinds have, at a place.
double spread(const Among& rows, const std::array<std::array<double, kKinds>, 3>& of_kind,
              const Eigen::Vector3d& place) noexcept {
  const double turn = std::atan2(place.y(), place.x()) + kPi;
  const Among columns(turn / (kCell_deg * kDegree) - 0.5);
  std::array<std::size_t, 3> column{};
  for (int j = 0; j < 3; ++j)
    column[static_cast<std::size_t>(j)] =
        static_cast<std::size_t>((columns.first + j + kColumns) % kColumns);
  double sum = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    const auto& kinds = kMap.kind[static_cast<std::size_t>(
        std::clamp(rows.first + static_cast<int>(i), 0, kRows - 1))];
    const std::array<double, kKinds>& value = of_kind[i];
    sum += rows.share[i] * (columns.share[0] * value[kinds[column[0]]] +
                            columns.share[1] * value[kinds[column[1]]] +
                            columns.share[2] * value[kinds[column[2]]]);
  }
  return sum;
}

}  // namespace

double place_albedo(const ZonalAlbedo& zonal, const Eigen::Vector3d& place) noexcept {
  const Among rows = rows_among(place.z());
  double clear = 0;
  double cloudy = 0;
  for (int i = 0; i < 3; ++i) {
    const Row& row = row_at(rows.first + i);
    clear += rows.share[static_cast<std::size_t>(i)] * row.mean_clear;
    cloudy += rows.share[static_cast<std::size_t>(i)] * row.mean_cloudy;
  }
  const double light = zonal.at(place.z());
  const double q = std::max(0.0, light - clear) / cloudy;
  const double dimmed = std::min(1.0, light / clear);
  std::array<std::array<double, kKinds>, 3> of_kind{};
  for (std::size_t i = 0; i < 3; ++i) {
    const Row& row = row_at(rows.first + static_cast<int>(i));
    for (std::size_t k = 0; k < kKinds; ++k)
      of_kind[i][k] = dimmed * row.clear[k] + q * row.cloudy[k];
  }
  return spread(rows, of_kind, place);
}

double clear_place_albedo(const Eigen::Vector3d& place) noexcept {
  const Among rows = rows_among(place.z());
  return spread(
      rows, {row_at(rows.first).clear, row_at(rows.first + 1).clear, row_at(rows.first + 2).clear},
      place);
}

/// By rows: where a place lies among three, its albedo is a mean of what their kinds would have
/// with its own q, and that grows with the zonal albedo and falls with the mean of clear ground.
double largest_place_albedo(const ZonalAlbedo& zonal) noexcept {
  double most = 0;
  double sin_south = 1;
  for (int i = 0; i < kRows; ++i) {
    const double sin_north = sin_south;
    sin_south = std::cos((i + 1) * kCell_deg * kDegree);
    double clear = 1;
    double cloudy = 1;
    for (int k = i - 1; k <= i + 1; ++k) {
      clear = std::min(clear, row_at(k).mean_clear);
      cloudy = std::min(cloudy, row_at(k).mean_cloudy);
    }
    const double light = zonal.largest_between(sin_south, sin_north);
    const double q = std::max(0.0, light - clear) / cloudy;
    const double dimmed = std::min(1.0, light / clear);
    for (int k = i - 1; k <= i + 1; ++k)
      for (std::size_t kind = 0; kind < kKinds; ++kind)
        if (row_at(k).has[kind])
          most = std::max(most, dimmed * row_at(k).clear[kind] + q * row_at(k).cloudy[kind]);
  }
  return most;
}

}  // namespace engine
