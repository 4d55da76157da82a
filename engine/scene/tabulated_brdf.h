#pragma once

#include <array>
#include <memory>
#include <vector>

#include "engine/core/vec.h"
#include "engine/scene/brdf_grid.h"
#include "engine/scene/half_vector_lobe.h"

namespace engine {

/// A measured surface as the renderer needs it: reciprocal, and never sending back more than came
/// in.
///
/// Reciprocity (`reciprocal`, the default) is made by the mean of both ways through the table; what
/// was measured one way then helps where nobody measured the other. Without it the table stands as
/// it is, from light to camera. Where the albedo is above 1 the value is scaled down, alike for
/// both directions. The albedo is integrated finely about the mirror direction and about one lobe
/// more of each incidence (BrdfGrid::lobe_aside: one that looks back at its source, say); a third
/// one, if it is a few degrees wide or less, may be missed. All vectors are unit, in a frame whose
/// z is the normal.
///
/// Thread: any. Loop-safe but for the constructor, which takes half a second; a few with lobes that
/// are not at the mirror.
class TabulatedBrdf {
 public:
  TabulatedBrdf(std::shared_ptr<const BrdfGrid> grid, bool reciprocal);

  /// 1/sr; 0 below the horizon. Finite everywhere.
  [[nodiscard]] double eval(const Eigen::Vector3d& in, const Eigen::Vector3d& out) const noexcept;
  /// The share of light from `cos_in` that goes anywhere at all.
  [[nodiscard]] double albedo(double cos_in) const noexcept;
  /// The same before it was limited.
  [[nodiscard]] double albedo_as_measured(double cos_in) const noexcept;
  /// What would go anywhere if all directions got what half of them fall short of, next to normal
  /// light: all of a Lambert surface, and what a mirror's lobe stands on.
  [[nodiscard]] double diffuse_albedo() const noexcept { return diffuse_albedo_; }
  /// Of what stands out of that about the mirror direction, next to normal light, in angles of the
  /// half vector: where it has fallen to a half. Of a surface that is even there and nowhere else:
  /// at the incidence where most stands out. 0 of one that is even to a fiftieth at every
  /// incidence.
  [[nodiscard]] double lobe_half_width_rad() const noexcept { return lobe_half_width_rad_; }

  /// Of the draws, how many should go by the lobe: in [0, 1].
  [[nodiscard]] double lobe_share(const Eigen::Vector3d& out) const noexcept;
  [[nodiscard]] const HalfVectorLobe& lobe_sampler() const noexcept { return lobe_sampler_; }

  [[nodiscard]] const BrdfGrid& grid() const noexcept { return *grid_; }
  /// Where light from incident_direction() at this cosine may have lobes off the mirror direction.
  [[nodiscard]] std::vector<Eigen::Vector3d> lobes_aside(double cos_in) const;

 private:
  static constexpr int kAngles = 128;
  using ByCosine = std::array<float, kAngles>;  ///< cell centres

  [[nodiscard]] double unlimited(const Eigen::Vector3d& in,
                                 const Eigen::Vector3d& out) const noexcept;
  [[nodiscard]] double limit(double cos_in) const noexcept;
  /// What stands out of the even part when the half vector is tilted, the mean of azimuths.
  [[nodiscard]] double excess(const Eigen::Vector3d& in, double one_minus_cos) const noexcept;
  /// A lobe off the mirror direction, for light from incident_direction().
  struct Aside {
    double theta_in_rad = 0;
    Eigen::Vector3d out;
  };
  void find_asides();
  /// All over the hemisphere.
  [[nodiscard]] std::vector<double> sorted_values(const Eigen::Vector3d& in) const;
  void find_even_part();
  void find_lobe();
  void tabulate_albedo();

  std::shared_ptr<const BrdfGrid> grid_;
  bool reciprocal_;
  std::vector<Aside> asides_;
  std::size_t lobe_at_ = 0;  ///< the incidence that the lobe's width is taken from
  double even_per_sr_ = 0;
  double diffuse_albedo_ = 0;
  double lobe_half_width_rad_ = 0;
  bool limited_ = false;
  ByCosine measured_albedo_{};
  ByCosine albedo_{};
  HalfVectorLobe lobe_sampler_;  ///< none without a lobe
};

}  // namespace engine
