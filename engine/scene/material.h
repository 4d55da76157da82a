#pragma once

#include <memory>
#include <string>
#include <vector>

#include "engine/core/config_reader.h"
#include "engine/core/constants.h"
#include "engine/scene/brdf.h"

namespace engine {

/// What a scenario takes of the parameters: a Lambert surface sends back all at most, and a lobe is
/// not narrower than a table of it can be.
inline constexpr double kMostKd = 1.0 / kPi;
inline constexpr double kLeastBr = -1e6;

/// A surface as the scenario describes it. The tables of its Brdf take a tenth of a second to make,
/// so they are made when a scene is built, not when a scenario is read.
struct Material {
  std::string name;
  FiveParameters parameters;
  Brdf::Variant variant = Brdf::Variant::kPhysical;
  double wrinkle_rad = 0;
  std::shared_ptr<const BrdfGrid> table =
      nullptr;             ///< measured, instead of the parameters; null: none
  bool reciprocal = true;  ///< what is made of the table

  [[nodiscard]] Brdf brdf() const;
  /// Whether two of them scatter light alike, whatever their names.
  [[nodiscard]] bool alike(const Material& other) const;
  /// Whether it sends more one way than another.
  [[nodiscard]] bool shines() const noexcept { return table != nullptr || parameters.kb > 0.0; }
  /// Brdf::diffuse_albedo(), without the Brdf's tables; of a measured one the most it can be.
  [[nodiscard]] double diffuse_albedo() const noexcept;
  /// The most that may go another way.
  [[nodiscard]] double glossy_albedo() const noexcept;
};
/// Reads materials.<name> for each name below `materials`, and the files that they name.
[[nodiscard]] std::vector<Material> read_materials(const ConfigReader& config);

}  // namespace engine
