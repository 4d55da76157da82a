#include "engine/core/fits.h"

#include <cstdio>
#include <stdexcept>
#include <utility>

#include <fitsio.h>

namespace engine {
namespace {

constexpr long kLargestSide = 8192;

void check(int status, const std::string& path) {
  if (status == 0) return;
  char words[FLEN_STATUS] = "";
  fits_get_errstatus(status, words);
  throw std::runtime_error(path + ": FITS: " + words);
}

/// Closes whatever happens; cfitsio accepts a null file.
class FitsFile {
 public:
  ~FitsFile() {
    int status = 0;
    if (file != nullptr) fits_close_file(file, &status);
  }
  void close(const std::string& path) {
    int status = 0;
    fits_close_file(std::exchange(file, nullptr), &status);
    check(status, path);
  }
  fitsfile* file = nullptr;
};

void write_card(fitsfile* file, const FitsCard& card, int& status) {
  if (const auto* x = std::get_if<double>(&card.value)) {
    fits_write_key_dbl(file, card.keyword.c_str(), *x, -15, card.comment.c_str(), &status);
  } else if (const auto* n = std::get_if<long long>(&card.value)) {
    fits_write_key_lng(file, card.keyword.c_str(), *n, card.comment.c_str(), &status);
  } else {
    fits_write_key_str(file, card.keyword.c_str(), std::get<std::string>(card.value).c_str(),
                       card.comment.c_str(), &status);
  }
}

}  // namespace

void write_fits(const std::string& path, const DnImage& image, const std::vector<FitsCard>& cards) {
  const std::string part = path + ".part";
  std::remove(part.c_str());
  int status = 0;
  FitsFile out;
  // diskfile: the name is taken as it is, not as cfitsio's extended syntax.
  fits_create_diskfile(&out.file, part.c_str(), &status);
  long size[2] = {image.width(), image.height()};
  fits_create_img(out.file, USHORT_IMG, 2, size, &status);
  for (const FitsCard& card : cards) write_card(out.file, card, status);
  fits_write_comment(out.file, "Pixel (1, 1) here is pixel (0, 0) of the camera, first row on top.",
                     &status);
  const auto pixels = image.pixels();
  // cfitsio takes a pointer to non-const and does not write through it.
  fits_write_img(out.file, TUSHORT, 1, static_cast<LONGLONG>(pixels.size()),
                 const_cast<std::uint16_t*>(pixels.data()), &status);
  check(status, path);
  out.close(path);
  if (std::rename(part.c_str(), path.c_str()) != 0)
    throw std::runtime_error(path + ": the finished file could not be put in place");
}

DnImage read_fits(const std::string& path) {
  int status = 0;
  FitsFile in;
  fits_open_diskfile(&in.file, path.c_str(), READONLY, &status);
  check(status, path);
  int bits = 0;
  int axes = 0;
  long size[2] = {0, 0};
  fits_get_img_param(in.file, 2, &bits, &axes, size, &status);
  check(status, path);
  if (bits != SHORT_IMG || axes != 2 || size[0] < 1 || size[1] < 1 || size[0] > kLargestSide ||
      size[1] > kLargestSide) {
    throw std::runtime_error(path + ": expected a 16-bit image of 2 axes, at most 8192 a side");
  }
  DnImage image(static_cast<int>(size[0]), static_cast<int>(size[1]));
  fits_read_img(in.file, TUSHORT, 1, static_cast<LONGLONG>(image.pixels().size()), nullptr,
                image.pixels().data(), nullptr, &status);
  check(status, path);
  return image;
}

}  // namespace engine
