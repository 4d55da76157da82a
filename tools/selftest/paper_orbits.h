#pragma once

#include "engine/core/constants.h"
#include "engine/orbit/kepler.h"
#include "engine/orbit/utc.h"

namespace corners {

/// Both satellites of table 5 of Li et al. 2023, two-body, from 2022 on.
struct PaperOrbits {
  engine::KeplerElements camera_elements{6868.8546e3,
                                         0.0066917,
                                         97.4154 * engine::kDegree,
                                         140.0776 * engine::kDegree,
                                         200.0074 * engine::kDegree,
                                         183.0867 * engine::kDegree};
  engine::KeplerElements target_elements{6796.7142e3,
                                         0.0006096,
                                         51.6417 * engine::kDegree,
                                         117.6201 * engine::kDegree,
                                         40.2943 * engine::kDegree,
                                         7.3764 * engine::kDegree};
  engine::Epoch epoch = engine::epoch_from_utc("2022-01-01T00:00:00").value();
  engine::KeplerPropagator camera{camera_elements, epoch};
  engine::KeplerPropagator target{target_elements, epoch};

  [[nodiscard]] engine::Epoch at(double t_s) const { return epoch + engine::from_seconds(t_s); }
};

inline constexpr double kIfov_rad = 6.5e-6 / 4.5;  ///< of its camera, table 4
inline constexpr double kClosestOfPass3_s = 309781.705969;

}  // namespace corners
