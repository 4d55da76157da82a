#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include <Eigen/Core>

#include "engine/scene/brdf.h"
#include "engine/scene/earth_light.h"

namespace engine {

/// The directions above a surface in 64 bins, each with an equal share of what falls on it by the
/// cosine: squares of a unit square laid on the hemisphere's disc (Shirley & Chiu 1997, A low
/// distortion map between disk and square, JGT 2(3)).
struct HemisphereBins {
  static constexpr int kSide = 8;
  static constexpr std::size_t kBins = std::size_t{kSide} * kSide;
  using Values = std::array<float, kBins>;
  /// Each bin in four.
  static constexpr int kFineSide = 2 * kSide;
  using FineValues = std::array<float, std::size_t{kFineSide} * kFineSide>;

  /// A unit vector in the bin; `a` and `b` in [0, 1) say where. z is the normal.
  [[nodiscard]] static Eigen::Vector3f direction(std::size_t bin, float a, float b) noexcept;
  /// Of FineValues, the one that direction() lies in.
  [[nodiscard]] static std::size_t fine(std::size_t bin, float a, float b) noexcept {
    const std::size_t x = 2 * (bin % kSide) + (a < 0.5F ? 0 : 1);
    const std::size_t y = 2 * (bin / kSide) + (b < 0.5F ? 0 : 1);
    return y * kFineSide + x;
  }
  /// What comes from the Earth's cap, in W/m^2/sr, to a surface of these axes (rows; the last one
  /// is the normal): of each quarter at one place in it, at another one in each. The sum over all
  /// is right to 1 %.
  static void see(const EarthLight& cap, const Eigen::Matrix3f& axes, FineValues& out) noexcept;
};

/// How a surface sends to the camera what arrives by bins: eval() of its BRDF, summed up before.
///
/// For lobes wider than the bins, some 15 deg; of a narrower lobe only the diffuse part is here,
/// and mirror_share() says what is left for a ray to find.
/// Thread: any. Loop-safe but for the constructor.
class BinnedBrdf {
 public:
  explicit BinnedBrdf(const Brdf& brdf);

  /// Radiance towards the unit vector `out`, z the normal, when `arriving` comes in. At most its
  /// largest value.
  [[nodiscard]] float reflected(const HemisphereBins::Values& arriving,
                                const Eigen::Vector3f& out) const noexcept;
  /// Whether what arrives from one direction counts as much as from any other; of each bin this
  /// share is sent.
  [[nodiscard]] bool even() const noexcept { return weights_.empty(); }
  [[nodiscard]] float even_share() const noexcept { return diffuse_share_; }
  /// What reflected() multiplies a bin's light by where it is known which quarter of the bin it
  /// comes from. Pre: !even().
  void weigh(const Eigen::Vector3f& out, HemisphereBins::FineValues& weights) const noexcept;
  /// Of light that leaves at this cosine, the albedo of the lobe that is too narrow for the bins.
  [[nodiscard]] float mirror_share(float cos_out) const noexcept;

 private:
  static constexpr std::size_t kCosines = 12;
  static constexpr std::size_t kAzimuths = 24;

  /// Of the tables, the rows round a direction, and their shares.
  struct Rows {
    std::array<std::size_t, 4> index{};
    std::array<float, 4> share{};
  };
  [[nodiscard]] static Rows rows_round(const Eigen::Vector3f& out) noexcept;
  void tabulate(const Brdf& brdf);

  float diffuse_share_ = 0;  ///< of a bin's light, if every direction gets the same
  bool narrow_ = false;
  // By cosine and azimuth of `out`; empty: diffuse.
  std::vector<HemisphereBins::Values> weights_;
  std::vector<HemisphereBins::FineValues> fine_weights_;
  std::array<float, kCosines> mirror_share_{};
};

}  // namespace engine
