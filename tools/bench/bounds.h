#pragma once

#include <cstdint>
#include <vector>

#include "tools/bench/bare_embree.h"
#include "tools/bench/image_rays.h"
#include "tools/bench/pass_frames.h"
#include "tools/bench/transform.h"
#include "tools/starloop/scene_bodies.h"

namespace bench {

// What the stages of a frame cannot well do without, as plain as it can be had. None of it depends
// on how a stage goes about its work.

/// Where both bodies and the Sun are, once: of geometry.
class Places {
 public:
  explicit Places(PassFrames& frames) : rig_(frames.rig()), epoch_(frames.scenario().scene.epoch) {}
  void find();

 private:
  const starloop::Rig& rig_;
  engine::Epoch epoch_;
};

/// Embree by itself with a camera ray to each cell of the picture, and a ray to the Sun from each
/// place that they hit: of the renderer.
class PictureRays {
 public:
  /// Of the frame that was last rendered.
  explicit PictureRays(PassFrames& frames);
  void trace() const;
  /// Rays that go anywhere from the body, as those that a renderer sends for bounced light.
  void trace_bounced() const;
  [[nodiscard]] double bounced() const { return rays_.bounce.rays(); }

 private:
  starloop::SceneBodies bodies_;
  BareEmbree embree_;
  ImageRays rays_;
};

/// A transform there and back of the grid on which a frame was last spread: of the optics.
[[nodiscard]] Transform transform_of(const PassFrames& frames);

/// Of the detector: the random numbers, and the bytes that go through.
class SensorBounds {
 public:
  explicit SensorBounds(std::size_t pixels);
  /// A normal number a pixel. Shot noise, read noise: a stage that draws both needs two.
  void draw_numbers();
  /// Light is read, electrons are written; electrons are read, and DN written.
  void move_bytes();

 private:
  std::vector<float> light_;
  std::vector<float> electrons_;
  std::vector<std::uint16_t> dn_;
  std::uint64_t frame_ = 0;
};

/// Of links: the pixels copied.
class FrameCopy {
 public:
  explicit FrameCopy(std::size_t pixels) : from_(pixels), to_(pixels) {}
  void copy();

 private:
  std::vector<std::uint16_t> from_;
  std::vector<std::uint16_t> to_;
};

}  // namespace bench
