#pragma once

#include <string>

#include "engine/core/image.h"

namespace starloop {

/// Writes a 16-bit grey PNG, DN scaled so that the largest DN of `bits` is white. Throws
/// std::runtime_error.
void write_png(const std::string& path, const engine::DnImage& image, int bits);

}  // namespace starloop
