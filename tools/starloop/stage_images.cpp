#include "tools/starloop/stage_images.h"

namespace starloop {

engine::Radiance render_radiance(const engine::CameraGeometry& camera,
                                 const engine::Snapshot& snapshot, const engine::GridWish& wish,
                                 engine::Renderer& renderer) {
  engine::Radiance radiance;
  radiance.earth.reserve(camera, wish.beyond_frame_px);
  radiance.earth.draw(snapshot.earth_in_frame, snapshot.background_w_m2_sr);
  renderer.render(snapshot, engine::Budget{}, radiance);
  radiance.range_m = snapshot.range_m;
  radiance.path = snapshot.path;
  return radiance;
}

engine::IrradianceImage projected(engine::Optics& optics, const engine::Radiance& radiance,
                                  const engine::CameraGeometry& camera) {
  engine::IrradianceImage out(camera.width_px, camera.height_px);
  optics.project(radiance, out);
  optics.veil(out);
  return out;
}

}  // namespace starloop
