#include "tools/selftest/corner.h"

namespace corners {

std::vector<Room> all_corners() {
  return {kepler_corners(),   orbit_corners(),    visibility_corners(),
          attitude_corners(), scene_corners(),    render_corners(),
          optics_corners(),   detector_corners(), loop_corners()};
}

}  // namespace corners
