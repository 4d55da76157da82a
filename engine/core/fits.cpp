#include "engine/core/fits.h"

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <limits>
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

constexpr const char* kPixelOrder =
    "Pixel (1, 1) here is pixel (0, 0) of the camera, first row on top.";

void put_in_place(const std::string& part, const std::string& path) {
  if (std::rename(part.c_str(), path.c_str()) != 0)
    throw std::runtime_error(path + ": the finished file could not be put in place");
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
  fits_write_comment(out.file, kPixelOrder, &status);
  const auto pixels = image.pixels();
  // cfitsio takes a pointer to non-const and does not write through it.
  fits_write_img(out.file, TUSHORT, 1, static_cast<LONGLONG>(pixels.size()),
                 const_cast<std::uint16_t*>(pixels.data()), &status);
  check(status, path);
  out.close(path);
  put_in_place(part, path);
}

struct FitsCube::Open : FitsFile {};

FitsCube::FitsCube(std::string path, int width, int height, const std::vector<FitsCard>& cards)
    : path_(std::move(path)), width_(width), height_(height), open_(std::make_unique<Open>()) {
  const std::string part = path_ + ".part";
  std::remove(part.c_str());
  int status = 0;
  fits_create_diskfile(&open_->file, part.c_str(), &status);
  long size[3] = {width, height, 1};
  fits_create_img(open_->file, USHORT_IMG, 3, size, &status);
  for (const FitsCard& card : cards) write_card(open_->file, card, status);
  fits_write_comment(open_->file, kPixelOrder, &status);
  check(status, path_);
}

FitsCube::~FitsCube() = default;

void FitsCube::add(const DnImage& image, const std::vector<FitsCard>& row) {
  ENSURE(open_ != nullptr && image.width() == width_ && image.height() == height_);
  ENSURE(rows_.empty() || row.size() == rows_.front().size());
  int status = 0;
  long size[3] = {width_, height_, static_cast<long>(rows_.size()) + 1};
  // The file ends with the image, so that this only adds to it.
  fits_resize_img(open_->file, USHORT_IMG, 3, size, &status);
  long first[3] = {1, 1, size[2]};
  const auto pixels = image.pixels();
  fits_write_pix(open_->file, TUSHORT, first, static_cast<LONGLONG>(pixels.size()),
                 const_cast<std::uint16_t*>(pixels.data()), &status);
  check(status, path_);
  rows_.push_back(row);
}

void FitsCube::close() {
  if (open_ == nullptr) return;
  const std::string part = path_ + ".part";
  if (rows_.empty()) {
    open_.reset();
    std::remove(part.c_str());
    return;
  }
  write_table();
  open_->close(path_);
  open_.reset();
  put_in_place(part, path_);
}

void FitsCube::write_table() {
  fitsfile* file = open_->file;
  int status = 0;
  std::vector<char*> names;
  std::vector<char*> forms;
  std::string real = "1D";
  std::string whole = "1K";
  for (FitsCard& card : rows_.front()) {
    ENSURE(!std::holds_alternative<std::string>(card.value));
    names.push_back(card.keyword.data());
    forms.push_back(std::holds_alternative<double>(card.value) ? real.data() : whole.data());
  }
  fits_create_tbl(file, BINARY_TBL, static_cast<LONGLONG>(rows_.size()),
                  static_cast<int>(names.size()), names.data(), forms.data(), nullptr, "FRAMES",
                  &status);
  for (std::size_t c = 0; c < names.size(); ++c) {
    const int column = static_cast<int>(c) + 1;
    const std::string keyword = "TTYPE" + std::to_string(column);
    fits_modify_comment(file, keyword.c_str(), rows_.front()[c].comment.c_str(), &status);
    for (std::size_t r = 0; r < rows_.size(); ++r) {
      const auto row = static_cast<LONGLONG>(r) + 1;
      if (const auto* x = std::get_if<double>(&rows_[r][c].value)) {
        double value = *x;
        fits_write_col(file, TDOUBLE, column, row, 1, 1, &value, &status);
      } else {
        long long value = std::get<long long>(rows_[r][c].value);
        fits_write_col(file, TLONGLONG, column, row, 1, 1, &value, &status);
      }
    }
  }
  check(status, path_);
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

namespace {

/// cfitsio would unpack a file of its own accord.
void check_plain(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) throw std::runtime_error(path + ": cannot be read");
  std::string start(9, ' ');
  file.read(start.data(), static_cast<std::streamsize>(start.size()));
  if (start != "SIMPLE  =") throw std::runtime_error(path + ": expected an uncompressed FITS file");
}

void check_map(fitsfile* file, const std::string& path, int width, int height) {
  int status = 0;
  int bits = 0;
  int axes = 0;
  LONGLONG size[2] = {0, 0};
  fits_get_img_paramll(file, 2, &bits, &axes, size, &status);
  check(status, path);
  if (axes != 2)
    throw std::runtime_error(path + ": expected a primary image of 2 axes, got " +
                             std::to_string(axes) + " axes");
  if (size[0] != width || size[1] != height)
    throw std::runtime_error(path + ": expected " + std::to_string(width) + " x " +
                             std::to_string(height) + " pixels, got " + std::to_string(size[0]) +
                             " x " + std::to_string(size[1]));
  if (bits != SHORT_IMG && bits != LONG_IMG && bits != FLOAT_IMG && bits != DOUBLE_IMG)
    throw std::runtime_error(path + ": expected BITPIX 16, 32, -32 or -64, got " +
                             std::to_string(bits));
  LONGLONG header = 0;
  LONGLONG data = 0;
  LONGLONG end = 0;
  fits_get_hduaddrll(file, &header, &data, &end, &status);
  check(status, path);
  const auto wanted = static_cast<std::uintmax_t>(data + size[0] * size[1] * std::abs(bits) / 8);
  std::error_code unknown;
  const std::uintmax_t found = std::filesystem::file_size(path, unknown);
  if (unknown || found < wanted) throw std::runtime_error(path + ": ends before its image does");
}

}  // namespace

std::vector<double> read_fits_map(const std::string& path, int width, int height) {
  check_plain(path);
  int status = 0;
  FitsFile in;
  fits_open_diskfile(&in.file, path.c_str(), READONLY, &status);
  check(status, path);
  check_map(in.file, path, width, height);
  std::vector<double> map(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  double blank = std::numeric_limits<double>::quiet_NaN();
  int any_blank = 0;  // cfitsio writes to it where there are some
  fits_read_img(in.file, TDOUBLE, 1, static_cast<LONGLONG>(map.size()), &blank, map.data(),
                &any_blank, &status);
  check(status, path);
  return map;
}

}  // namespace engine
