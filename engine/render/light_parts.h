#pragma once

#include <array>
#include <cstddef>
#include <span>

namespace engine {

/// A spot of a small picture. Any units, the same throughout.
struct LightSpot {
  double x = 0;
  double y = 0;
  double light = 0;
};

/// A small picture of light as few points.
///
/// The picture is cut through its centre of light across its long axis, each half again, and so
/// on. Four points stand for each part: they have its light, its centre and its second moments.
/// Blurred by a spread of light that is smooth over a part, the points look as the picture does:
/// what is left is of third order in the size of a part. Compare the moments of a patch of stars or
/// of a beam (ISO 11146); the choice of cuts is ours.
/// Thread: one at a time. Loop-safe.
class LightParts {
 public:
  static constexpr int kLevels = 3;  ///< 1, 4 and 16 parts
  static constexpr std::size_t kPointsAPart = 4;
  static constexpr std::size_t kMostParts = 16;
  using Points = std::array<LightSpot, kMostParts * kPointsAPart>;

  /// How far the points are from the picture, as means over the light: norms of the tensors that a
  /// Taylor series of the spread of light is multiplied by.
  struct Mismatch {
    double third = 0;
    double fourth = 0;
  };

  /// Reorders `spots`. Light that is not positive is left out.
  void cut(std::span<LightSpot> spots) noexcept;

  [[nodiscard]] double light() const noexcept { return parts_[0][0].light; }
  [[nodiscard]] double centre_x() const noexcept { return parts_[0][0].x; }
  [[nodiscard]] double centre_y() const noexcept { return parts_[0][0].y; }
  /// Of the whole picture about its centre, along both axes together.
  [[nodiscard]] double variance() const noexcept { return parts_[0][0].xx + parts_[0][0].yy; }
  [[nodiscard]] const Mismatch& mismatch(int level) const noexcept {
    return mismatch_[static_cast<std::size_t>(level)];
  }
  /// The number of points; those without light are left out.
  std::size_t points(int level, Points& out) const noexcept;

 private:
  struct Part {
    double light = 0;
    double x = 0;
    double y = 0;
    double xx = 0;  // second moments about the centre
    double xy = 0;
    double yy = 0;
    [[nodiscard]] double long_axis_rad() const noexcept;
    [[nodiscard]] std::array<LightSpot, kPointsAPart> points() const noexcept;
  };
  void divide(std::span<LightSpot> spots, int depth, std::size_t index) noexcept;
  [[nodiscard]] static Part part_of(std::span<const LightSpot> spots) noexcept;
  [[nodiscard]] static Mismatch mismatch_of(std::span<const LightSpot> spots,
                                            const Part& part) noexcept;

  std::array<std::array<Part, kMostParts>, kLevels> parts_{};
  std::array<Mismatch, kLevels> mismatch_{};
};

}  // namespace engine
