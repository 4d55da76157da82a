#pragma once

#include <vector>

#include "engine/optics/otf_cascade.h"
#include "tools/characterize/bench.h"
#include "tools/characterize/slanted_edge.h"

namespace characterize {

/// The optics by a slanted edge, and what their product of transfer functions says.
struct EdgeFigures {
  bool near_vertical = true;     ///< of two: else near the rows
  double angle_deg = 0;          ///< off the columns or the rows, as found in the image
  EdgeResponse response;         ///< along the edge's normal
  std::vector<double> analytic;  ///< modulus of OtfCascade::whole at the same frequencies
  /// A window knows nothing of waves longer than it reaches to one side: none are compared.
  double least_cycles_per_px = 0;
  double worst = 0;  ///< the largest difference, with its sign
  double worst_cycles_per_px = 0;
  double mtf_error = 0;  ///< of the measured MTF at Nyquist, where noise is largest: rms
};

/// Dark and flat frames of one bench.
struct FieldFrames {
  std::vector<float> dark_dn;  ///< means, in raster order
  std::vector<float> flat_dn;
};

struct EdgePlan {
  double angle_deg = 5;
  double reach_px = 64;    ///< of the window; less in a small frame
  int frames = 64;         ///< of each of dark, flat and edge
  double bright_w_m2 = 0;  ///< irradiance on the bright side
  double bright_e = 0;     ///< electrons there
};

/// How far to each side of the edge a frame lets us see. Throws std::runtime_error when that is too
/// little.
[[nodiscard]] double edge_reach_px(const engine::CameraGeometry& camera, bool near_vertical,
                                   const EdgePlan& plan);

/// What shot noise of so many frames does to the MTF at Nyquist, rms.
[[nodiscard]] double mtf_error(const engine::CameraGeometry& camera, bool near_vertical,
                               const EdgePlan& plan);

[[nodiscard]] FieldFrames take_field(Bench& bench, engine::Duration exposure, const PixelMask& used,
                                     const EdgePlan& plan);

/// A target at infinity (a collimator's): half of the field bright, to 64 px beyond the frame where
/// the optics ask for that. The field's frames take pattern, pedestal and scale out; pixels that
/// are not in `used` do not count. Throws std::runtime_error when the frame is too small.
[[nodiscard]] EdgeFigures measure_edge(Bench& bench, const FieldFrames& field,
                                       const engine::OtfCascade& cascade,
                                       const engine::OtfCascade::Focused& lens,
                                       engine::Duration exposure, const PixelMask& used,
                                       bool near_vertical, const EdgePlan& plan);

}  // namespace characterize
