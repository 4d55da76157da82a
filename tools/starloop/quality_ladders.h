#pragma once

#include <string>
#include <vector>

#include "tools/quality/image_quality.h"
#include "tools/starloop/scenario.h"

namespace starloop {

/// One thing that is turned up, the rest of a frame being as it was.
struct QualityLadder {
  struct Step {
    double value = 0;
    quality::ImageQuality quality;
    engine::DnImage frame;
  };
  std::string name;
  std::string unit;
  std::vector<Step> steps;

  /// Of a step's picture: "smear_3.png".
  [[nodiscard]] std::string frame_name(std::size_t step) const;
};

/// One frame of a scenario, the camera looking at the target, and what it is like when smear,
/// defocus and read noise are turned up and light is turned down: from its first step, the frame as
/// the scenario has it, each is a ladder on which the score must fall. Smear: the boresight turns
/// along u by so many pixels over the exposure, besides what it does. Defocus: Noll's term 4, rms,
/// of `optics.zernike_nm.z4`. Light: a share of the exposure, without its smear.
/// Stars are left out. Throws engine::ConfigError, where the scenario's wavefront leaves no room
/// for the defocus, too.
[[nodiscard]] std::vector<QualityLadder> quality_ladders(CommonOptions options, double time_s);

}  // namespace starloop
