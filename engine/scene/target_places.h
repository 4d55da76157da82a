#pragma once

#include <map>
#include <string>
#include <vector>

#include <Eigen/Geometry>

#include "engine/core/config_reader.h"

namespace engine {

/// Where the parts of a described target stand: at_m, turns, repetition in rows and round an axis,
/// and frames, which are placed as a whole.
///
/// The places of a part, or a frame, in its own frame: turned first (`turns`, each about the axes
/// that the ones before it have turned), then moved, then repeated.
[[nodiscard]] std::vector<Eigen::Isometry3d> read_places(const ConfigTable& table);

/// A frame that stands somewhere, and the group that what is in it moves with; empty: the part's.
struct PlacedGroup {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  std::string group;
};
using PlacedFrames = std::map<std::string, std::vector<PlacedGroup>>;
/// Those of the frame that a table names; the body's, when it names none.
[[nodiscard]] std::vector<PlacedGroup> frames_of(const ConfigTable& table,
                                                 const PlacedFrames& frames);
/// A frame's places in the body; it may stand in another one that is above it in the file.
[[nodiscard]] std::vector<PlacedGroup> read_frame(const ConfigTable& table,
                                                  const PlacedFrames& frames);

}  // namespace engine
