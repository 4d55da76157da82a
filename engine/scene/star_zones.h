#pragma once

#include <Eigen/Core>

#include <array>
#include <cstddef>

namespace engine {

/// The sky in cells of about a degree and a half: zones of declination, each cut evenly in right
/// ascension. What a catalogue is stored by, and looked up by.
class StarZones {
 public:
  static constexpr int kZones = 120;
  static constexpr int kCellsAtEquator = 240;

  /// From its southern edge and its lower right ascension on.
  struct Cell {
    double ra_rad = 0;
    double dec_rad = 0;
    double width_rad = 0;
    double height_rad = 0;
  };

  StarZones();

  [[nodiscard]] std::size_t cells() const noexcept { return first_[kZones]; }
  [[nodiscard]] Cell cell(std::size_t index) const noexcept;
  [[nodiscard]] std::size_t index_of(const Eigen::Vector3d& unit) const noexcept;

  /// Calls visit(begin, end) for runs of cells that together hold all within `radius_rad` of
  /// `centre`; no cell comes twice.
  template <class Visit>
  void near(const Eigen::Vector3d& centre, double radius_rad, const Visit& visit) const {
    const Reach reach(centre, radius_rad);
    for (int zone = 0; zone < kZones; ++zone) {
      const Run run = run_of(zone, reach);
      if (run.first.begin < run.first.end) visit(run.first.begin, run.first.end);
      if (run.second.begin < run.second.end) visit(run.second.begin, run.second.end);
    }
  }

 private:
  struct Reach {
    Reach(const Eigen::Vector3d& centre, double radius);
    double ra_rad;
    double dec_rad;
    double radius_rad;
  };
  struct Span {
    std::size_t begin = 0;
    std::size_t end = 0;
  };
  /// Of one zone; two spans where it crosses right ascension 0.
  struct Run {
    Span first;
    Span second;
  };
  [[nodiscard]] Run run_of(int zone, const Reach& reach) const noexcept;
  [[nodiscard]] int cells_of(int zone) const noexcept {
    const auto z = static_cast<std::size_t>(zone);
    return static_cast<int>(first_[z + 1] - first_[z]);
  }

  std::array<std::size_t, kZones + 1> first_{};
};

/// A direction by right ascension and declination.
[[nodiscard]] Eigen::Vector3d unit_at(double ra_rad, double dec_rad) noexcept;

/// Where a star is after some years of even, straight motion; `ra` is times cos dec.
[[nodiscard]] Eigen::Vector3d moved(const Eigen::Vector3d& unit, double motion_ra_rad_yr,
                                    double motion_dec_rad_yr, double years) noexcept;

}  // namespace engine
