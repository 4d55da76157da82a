#pragma once

#include <array>
#include <string>
#include <vector>

#include "engine/core/config_reader.h"
#include "engine/core/vec.h"

namespace engine {

/// The five parameters of eq 7 of Li et al. 2023, table 3.
struct FiveParameters {
  double ar = 0.557;
  double br = -261.6;
  double kb = 15.42;
  double kd = 0.047;
  double kr = 0.717;
  [[nodiscard]] bool operator==(const FiveParameters&) const = default;
};

/// How directions of bounces are drawn.
enum class BrdfSampler : std::uint8_t {
  kMixture,   ///< cosine and lobe, weighed against each other: finds all light, with least noise
  kCosine,    ///< even in projected solid angle
  kUniform,   ///< even over the hemisphere
  kPaperCone  ///< eq 13-14 of the paper: 15 deg round the mirror direction, and nothing else
};

/// How a surface scatters light. All vectors are unit, in a frame whose z is the normal.
///
/// Five-parameter model, eq 7 of Li et al. 2023. We differ from the print:
///  - alpha and gamma are exchanged: gamma = angle(n, h) and alpha = angle(i, h), h the half
///  vector.
///    As printed both of its materials send the light back to its source.
///  - `physical` (default): the diffuse term is the constant kd, a Lambert surface of albedo pi kd,
///    and the specular term is scaled, alike for both directions, so that the two together never
///    send back more than came in. Reciprocal. The printed kd/cos_i passes albedo 1 at 76 deg.
///  - `paper` keeps the printed terms, clamped so that the albedo stays 1 at most.
///  - `wrinkle_rad` > 0 blurs the lobe by the normals of a crinkled foil, normally distributed with
///    this rms in each direction: a goniometer's sample lies flat, a blanket on a spacecraft does
///    not. Our own assumption; neither the shape nor any rms is measured. The lobe keeps its
///    integral; polyimide's albedo changes by 1 % at 3 deg of wrinkles, at 15 deg by -7 % in near
///    normal light and +11 % at 80 deg.
/// A Lambert surface is kb = 0. Leaves out colour and polarisation.
class Brdf {
 public:
  enum class Variant : std::uint8_t { kPhysical, kPaper };

  Brdf(const FiveParameters& parameters, Variant variant, double wrinkle_rad = 0);

  /// 1/sr; 0 below the horizon. Finite everywhere.
  [[nodiscard]] double eval(const Eigen::Vector3d& in, const Eigen::Vector3d& out) const noexcept;
  /// Eq 7 with alpha and gamma exchanged and nothing else changed.
  [[nodiscard]] double as_printed(const Eigen::Vector3d& in,
                                  const Eigen::Vector3d& out) const noexcept;
  /// The share of light from `cos_in` that goes anywhere at all.
  [[nodiscard]] double albedo(double cos_in) const noexcept;
  /// Of that, the part that goes everywhere alike; of the printed variant, in normal light.
  [[nodiscard]] double diffuse_albedo() const noexcept;

  /// Of the specular lobe, in angles of the half vector: where it has fallen to a half; 0 without
  /// one.
  [[nodiscard]] double lobe_half_width_rad() const noexcept { return lobe_half_width_rad_; }

  struct Sample {
    Eigen::Vector3d in = Eigen::Vector3d::UnitZ();
    double weight = 0;   ///< eval * cos_in / density; 0 ends the path
    double density = 0;  ///< per steradian of `in`
  };
  /// A direction from which light may come that leaves along `out`. The numbers are even in (0, 1):
  /// two of the direction, and `choice` between the parts of the mixture.
  [[nodiscard]] Sample sample(const Eigen::Vector3d& out, BrdfSampler how,
                              const std::array<float, 2>& direction, float choice) const noexcept;
  /// Of `sample`, per steradian of `in`.
  [[nodiscard]] double pdf(const Eigen::Vector3d& in, const Eigen::Vector3d& out,
                           BrdfSampler how = BrdfSampler::kMixture) const noexcept;

 private:
  static constexpr int kAngles = 128;
  static constexpr int kLobeCells = 512;
  static constexpr int kLobeSteps = 2048;

  [[nodiscard]] double specular(const Eigen::Vector3d& in,
                                const Eigen::Vector3d& out) const noexcept;
  [[nodiscard]] double lobe(double one_minus_cos) const noexcept;
  [[nodiscard]] double printed_lobe(double one_minus_cos) const noexcept;
  [[nodiscard]] double specular_limit(double cos_in) const noexcept;
  [[nodiscard]] double specular_albedo(double cos_in) const noexcept;
  [[nodiscard]] double lobe_share(const Eigen::Vector3d& out) const noexcept;
  [[nodiscard]] Eigen::Vector3d from_lobe(const Eigen::Vector3d& out, double u,
                                          double azimuth) const noexcept;
  void blur_lobe(double wrinkle_rad);
  void tabulate_lobe();
  void tabulate_albedo();

  FiveParameters p_;
  Variant variant_;
  double lobe_half_width_rad_ = 0;
  std::vector<float> blurred_lobe_;  ///< by sqrt(1 - cos gamma), 0 to 1; empty without wrinkles
  std::array<float, kLobeCells + 1> lobe_edges_{};  ///< of 1 - cos gamma; each cell equally likely
  std::array<float, kAngles> specular_albedo_{};    ///< by the cosine: cell centres
};

/// A surface by its parameters. The tables of its Brdf take a tenth of a second to make, so they
/// are made when a scene is built, not when a scenario is read.
struct Material {
  std::string name;
  FiveParameters parameters;
  Brdf::Variant variant = Brdf::Variant::kPhysical;
  double wrinkle_rad = 0;

  [[nodiscard]] Brdf brdf() const { return {parameters, variant, wrinkle_rad}; }
};
/// Reads materials.<name> for each name below `materials`.
[[nodiscard]] std::vector<Material> read_materials(const ConfigReader& config);

}  // namespace engine
