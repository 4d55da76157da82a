#pragma once

#include <cstddef>
#include <memory>
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

/// A cube of 16-bit images that grows plane by plane, and a binary table FRAMES with a row for
/// each: what would be the header of a file of its own. It stands under its name only once it is
/// closed; until then "<path>.part" grows, which a program that dies leaves behind without its
/// table. All throw std::runtime_error.
class FitsCube {
 public:
  FitsCube(std::string path, int width, int height, const std::vector<FitsCard>& cards);
  ~FitsCube();
  FitsCube(const FitsCube&) = delete;
  FitsCube& operator=(const FitsCube&) = delete;

  /// Pre: an image of that size, and numbers under the same keywords every time.
  void add(const DnImage& image, const std::vector<FitsCard>& row);
  /// A cube without planes is no file.
  void close();

 private:
  struct Open;
  void write_table();

  std::string path_;
  int width_;
  int height_;
  std::unique_ptr<Open> open_;
  std::vector<std::vector<FitsCard>> rows_;
};

/// Reads back what write_fits wrote: a 2-D primary image of 16 bits and at most 8192 x 8192.
/// Throws std::runtime_error.
[[nodiscard]] DnImage read_fits(const std::string& path);

/// Reads a map of a camera's pixels: an uncompressed primary image of 2 axes, exactly width x
/// height, BITPIX 16, 32, -32 or -64, times BSCALE plus BZERO; all checked before any pixel is
/// read. What the file leaves blank is not a number. Throws std::runtime_error.
[[nodiscard]] std::vector<double> read_fits_map(const std::string& path, int width, int height);

}  // namespace engine
