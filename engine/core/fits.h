#pragma once

#include <string>
#include <variant>
#include <vector>

#include "engine/core/image.h"

namespace engine {

/// One line of a FITS header. Keyword: at most 8 of A-Z 0-9 - _; longer ones become HIERARCH cards.
struct FitsCard {
  std::string keyword;
  std::variant<double, long long, std::string> value;
  std::string comment;
};

/// Writes a 16-bit image with its header by cfitsio; an existing file is replaced only once the
/// new one is complete. FITS counts pixels from 1 and its first row is our row 0; the header says
/// so. Throws std::runtime_error with cfitsio's words.
void write_fits(const std::string& path, const DnImage& image, const std::vector<FitsCard>& cards);

/// Reads back what write_fits wrote: a 2-D primary image of 16 bits and at most 8192 x 8192.
/// Throws std::runtime_error.
[[nodiscard]] DnImage read_fits(const std::string& path);

}  // namespace engine
