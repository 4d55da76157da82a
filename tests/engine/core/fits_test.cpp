#include "engine/core/fits.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <fstream>
#include <iterator>
#include <stdexcept>

#include <gtest/gtest.h>

#include "tests/support/fits_bytes.h"
#include "tests/support/temp_file.h"

namespace engine {
namespace {

using test_support::TempFile;

DnImage ramp(int width, int height) {
  DnImage image(width, height);
  for (std::size_t i = 0; i < image.pixels().size(); ++i)
    image.pixels()[i] = static_cast<std::uint16_t>(i * 257U);
  return image;
}

std::string bytes_of(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

TEST(Fits, ReadsBackWhatItWrote) {
  const TempFile file("image.fits");
  for (const auto& [width, height] : {std::pair(1, 1), {37, 11}, {512, 256}}) {
    const DnImage image = ramp(width, height);  // all sixteen bits
    write_fits(file.path(), image, {});
    const DnImage back = read_fits(file.path());
    ASSERT_EQ(back.width(), width);
    ASSERT_EQ(back.height(), height);
    EXPECT_TRUE(std::ranges::equal(back.pixels(), image.pixels()));
  }
}

TEST(Fits, WritesItsCards) {
  const TempFile file("cards.fits");
  write_fits(file.path(), ramp(4, 4),
             {{"EXPTIME", 0.001, "[s] exposure"},
              {"SEED", 42LL, ""},
              {"NAME", std::string("flyby"), "scenario"},
              {"TARGET PIXEL U", 512.25, "a long keyword"}});
  const std::string bytes = bytes_of(file.path());
  EXPECT_EQ(bytes.size() % 2880, 0U);
  EXPECT_NE(bytes.find("EXPTIME ="), std::string::npos);
  EXPECT_NE(bytes.find("[s] exposure"), std::string::npos);
  EXPECT_NE(bytes.find("'flyby"), std::string::npos);
  EXPECT_NE(bytes.find("HIERARCH TARGET PIXEL U"), std::string::npos);
}

TEST(Fits, ReplacesAnOldFileAndLeavesNoPart) {
  const TempFile file("old.fits", "something else");
  write_fits(file.path(), ramp(5, 5), {});
  EXPECT_EQ(read_fits(file.path()).width(), 5);
  EXPECT_FALSE(std::ifstream(file.path() + ".part").good());
}

TEST(Fits, TakesNamesLiterally) {
  // cfitsio's extended syntax would cut a region out of this one.
  const TempFile file("a[1:2,1:2].fits");
  write_fits(file.path(), ramp(8, 8), {});
  EXPECT_EQ(read_fits(file.path()).width(), 8);
}

// Read without our code: FITS 4.0, sections 3.3 and 7.3. Blocks of 2880 bytes, numbers big-endian,
// unsigned pixels stored less 32768.
TEST(FitsCube, HoldsEveryPlaneAndARowOfNumbersForEach) {
  constexpr std::size_t kBlock = 2880;
  const TempFile file("cube.fits");
  FitsCube cube(file.path(), 7, 3, {{"SEED", 42LL, ""}});
  for (std::uint16_t k = 0; k < 150; ++k) {
    DnImage plane(7, 3);
    for (std::size_t i = 0; i < 21; ++i)
      plane.pixels()[i] = static_cast<std::uint16_t>(k * 400U + i);
    cube.add(plane, {{"FRAMENO", 10LL * k, "number"}, {"TIME", 0.5 * k, "[s]"}});
    EXPECT_FALSE(std::ifstream(file.path()).good()) << "half a cube under its name";
  }
  cube.close();
  EXPECT_FALSE(std::ifstream(file.path() + ".part").good());

  const std::string bytes = bytes_of(file.path());
  ASSERT_EQ(bytes.size() % kBlock, 0U);
  EXPECT_NE(bytes.find("NAXIS3  =                  150"), std::string::npos);
  EXPECT_NE(bytes.find("SEED    =                   42"), std::string::npos);
  const auto number = [&bytes](std::size_t at, std::size_t width) {
    std::uint64_t n = 0;
    for (std::size_t i = 0; i < width; ++i) n = n << 8 | static_cast<unsigned char>(bytes[at + i]);
    return n;
  };
  const std::size_t data = kBlock;  // the header is one block
  for (std::size_t k = 0; k < 150; ++k)
    for (std::size_t i = 0; i < 21; ++i)
      ASSERT_EQ(number(data + 2 * (21 * k + i), 2) ^ 0x8000U, k * 400 + i) << k << " " << i;
  const std::size_t table = data + (2 * 21 * 150 + kBlock - 1) / kBlock * kBlock;
  EXPECT_EQ(bytes.substr(table, 20), "XTENSION= 'BINTABLE'");
  EXPECT_NE(bytes.find("'FRAMENO", table), std::string::npos);
  for (std::size_t k = 0; k < 150; ++k) {
    const std::size_t row = table + kBlock + 16 * k;
    ASSERT_EQ(number(row, 8), 10 * k);
    ASSERT_EQ(std::bit_cast<double>(number(row + 8, 8)), 0.5 * static_cast<double>(k));
  }
}

TEST(FitsCube, WithoutPlanesIsNoFileAndAPlaceThatIsNoneIsRefused) {
  const TempFile file("empty_cube.fits");
  FitsCube cube(file.path(), 4, 4, {});
  cube.close();
  EXPECT_FALSE(std::ifstream(file.path()).good());
  EXPECT_FALSE(std::ifstream(file.path() + ".part").good());
  EXPECT_THROW(FitsCube("/nowhere/x.fits", 4, 4, {}), std::runtime_error);
}

TEST(Fits, RefusesWhatIsNoImageOfItsKind) {
  EXPECT_THROW(static_cast<void>(read_fits("/nowhere/x.fits")), std::runtime_error);
  EXPECT_THROW(write_fits("/nowhere/x.fits", ramp(2, 2), {}), std::runtime_error);
  const TempFile text("text.fits", "not a FITS file at all");
  EXPECT_THROW(static_cast<void>(read_fits(text.path())), std::runtime_error);
  // A header that claims more than there is, and one that claims too much.
  const TempFile whole("whole.fits");
  write_fits(whole.path(), ramp(64, 64), {});
  std::string bytes = bytes_of(whole.path());
  const TempFile cut("cut.fits", std::string_view(bytes).substr(0, 2880));
  EXPECT_THROW(static_cast<void>(read_fits(cut.path())), std::runtime_error);
  const auto at = bytes.find("NAXIS1  =                   64");
  ASSERT_NE(at, std::string::npos);
  bytes.replace(at, 30, "NAXIS1  =           2000000000");
  const TempFile huge("huge.fits", bytes);
  EXPECT_THROW(static_cast<void>(read_fits(huge.path())), std::runtime_error);
}

using test_support::fits_bytes;
using test_support::fits_card;

const std::vector<double> kSix{0.0, 1.0, 2.0, 3.0, 4.0, 500.0};

TEST(FitsMap, ReadsEachKindOfNumber) {
  for (const int bitpix : {16, 32, -32, -64}) {
    const TempFile file("map.fits", fits_bytes(bitpix, {3, 2}, kSix));
    EXPECT_EQ(read_fits_map(file.path(), 3, 2), kSix) << bitpix;
  }
}

TEST(FitsMap, ScalesAndKnowsWhatIsBlank) {
  const TempFile file("scaled.fits",
                      fits_bytes(16, {3, 2}, {0, 1, 2, 3, 4, -99},
                                 {fits_card("BSCALE", "0.5"), fits_card("BZERO", "10.0"),
                                  fits_card("BLANK", "-99")}));
  const std::vector<double> map = read_fits_map(file.path(), 3, 2);
  for (int i = 0; i < 5; ++i) EXPECT_EQ(map[static_cast<std::size_t>(i)], 10.0 + 0.5 * i);
  EXPECT_TRUE(std::isnan(map[5]));
}

/// What is said of a file that is no map of 3 x 2.
std::string complaint_about(const std::string& bytes) {
  const TempFile file("bad.fits", bytes);
  try {
    static_cast<void>(read_fits_map(file.path(), 3, 2));
  } catch (const std::runtime_error& e) {
    const std::string text = e.what();
    EXPECT_EQ(text.rfind(file.path() + ": ", 0), 0U) << text;
    return text.substr(file.path().size() + 2);
  }
  return "nothing";
}

TEST(FitsMap, RefusesWhatIsNoMapBeforeItReadsAPixel) {
  EXPECT_EQ(complaint_about(""), "expected an uncompressed FITS file");
  EXPECT_EQ(complaint_about("\x1f\x8b\x08 gzip"), "expected an uncompressed FITS file");
  EXPECT_EQ(complaint_about(fits_bytes(-32, {2, 3}, kSix)), "expected 3 x 2 pixels, got 2 x 3");
  EXPECT_EQ(complaint_about(fits_bytes(-32, {3, 2, 1}, kSix)),
            "expected a primary image of 2 axes, got 3 axes");
  // A tile-compressed image is a table behind an empty primary image.
  EXPECT_EQ(complaint_about(fits_bytes(8, {}, {})),
            "expected a primary image of 2 axes, got 0 axes");
  EXPECT_EQ(complaint_about(fits_bytes(8, {3, 2}, kSix)),
            "expected BITPIX 16, 32, -32 or -64, got 8");
  EXPECT_EQ(complaint_about(fits_bytes(64, {3, 2}, kSix)),
            "expected BITPIX 16, 32, -32 or -64, got 64");
  const std::string whole = fits_bytes(-64, {3, 2}, kSix);
  EXPECT_EQ(complaint_about(whole.substr(0, 2880 + 47)), "ends before its image does");
  EXPECT_NE(complaint_about(whole.substr(0, 500)), "nothing");
  // An image of 8 exabytes in a small file.
  EXPECT_EQ(complaint_about(fits_bytes(-64, {2000000000, 2000000000}, kSix)),
            "expected 3 x 2 pixels, got 2000000000 x 2000000000");
  EXPECT_THROW(read_fits_map("/nowhere/map.fits", 3, 2), std::runtime_error);
}

}  // namespace
}  // namespace engine
