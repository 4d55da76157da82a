#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "engine/detector/detector.h"
#include "tools/bench/scenes.h"
#include "tools/starloop/rig.h"

namespace bench {

/// Frames of the paper's pass on one thread, each stage for itself, one period after another as in
/// a run: the camera has turned since the frame before, and what a renderer keeps on the body is
/// there.
class PassFrames {
 public:
  /// So many of them, the first so many seconds after the pass' closest point.
  PassFrames(double after_s, int frames, const std::vector<std::string>& overrides = {});

  /// Geometry and render of as many frames before: what a renderer keeps is made in these.
  void settle(int frames);

  // A stage each: of frame i, and of what the stage before made last.
  void geometry(int i);
  void render();
  void optics();
  void detector();
  /// 11 bits a pixel with their checksum, as the USB link has them.
  void link();

  [[nodiscard]] int frames() const { return static_cast<int>(shots_.size()); }
  [[nodiscard]] const engine::Shot& shot(int i) const {
    return shots_[static_cast<std::size_t>(i)];
  }
  [[nodiscard]] const starloop::Scenario& scenario() const { return scenario_; }
  [[nodiscard]] starloop::Rig& rig() { return rig_; }
  [[nodiscard]] const engine::Snapshot& snapshot() const { return snapshot_; }
  [[nodiscard]] const engine::RenderReport& rendered() const { return rendered_; }
  [[nodiscard]] const engine::Radiance& radiance() const { return radiance_; }
  [[nodiscard]] const engine::OpticsReport& projected() const { return projected_; }
  [[nodiscard]] engine::DnImage& image() { return dn_; }

 private:
  [[nodiscard]] engine::Shot shot_after(double after_s) const;

  starloop::Scenario scenario_;
  double after_s_;
  starloop::Rig rig_;
  starloop::Rig::Stages stages_;
  engine::Detector detector_;
  std::vector<engine::Shot> shots_;
  engine::Shot taken_;  ///< the last one
  engine::Snapshot snapshot_;
  engine::RenderReport rendered_;
  engine::Radiance radiance_;
  engine::OpticsReport projected_;
  engine::IrradianceImage irradiance_;
  engine::ElectronImage electrons_;
  engine::DnImage dn_;
  std::vector<std::byte> bytes_;
};

}  // namespace bench
