#pragma once

#include <string>
#include <vector>

#include "engine/scene/grouped_mesh.h"

namespace engine {

/// Targets from a few readable lines: parts of simple shapes, placed, repeated and named. What can
/// be written is in data/targets/README.md; what is built in is there, too.
///
/// Whether a name is one: a built-in target's, or a file's that ends in ".toml".
[[nodiscard]] bool is_described_target(const std::string& name_or_path);

/// The target in metres, in its body frame, each triangle with the group that it moves with.
/// `notes`, when it is there, gets what a user should know: parts that were not meshed as asked.
/// Throws ConfigError with the file's line: what is missing, unknown or out of range, a part that
/// is empty, over two million triangles.
[[nodiscard]] GroupedMesh described_target(const std::string& name_or_path,
                                           std::vector<std::string>* notes = nullptr);
/// The same of a text; `name` is what complaints call it.
[[nodiscard]] GroupedMesh described_target_text(const std::string& text, const std::string& name,
                                                std::vector<std::string>* notes = nullptr);

}  // namespace engine
