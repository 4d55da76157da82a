#include "engine/core/image.h"

#include <gtest/gtest.h>

namespace engine {
namespace {

TEST(Image, KeepsRowsOneAfterTheOther) {
  DnImage image(3, 2);
  for (std::uint16_t i = 0; i < 6; ++i) image.pixels()[i] = i;
  EXPECT_EQ(image.at(0, 0), 0);
  EXPECT_EQ(image.at(2, 0), 2);
  EXPECT_EQ(image.at(0, 1), 3);
  EXPECT_EQ(image.row(1).size(), 3U);
  EXPECT_EQ(&image.row(1)[2], &image.at(2, 1));
}

TEST(Image, DoesNotMoveWithinItsLargestArea) {
  IrradianceImage image;
  image.reserve(100, 50);
  image.resize(100, 50);
  const float* place = image.pixels().data();
  for (const auto& [w, h] : {std::pair(1, 1), {50, 100}, {0, 0}, {0, 7}, {100, 50}}) {
    image.resize(w, h);
    EXPECT_EQ(image.pixels().data(), place);
    EXPECT_EQ(image.pixels().size(), static_cast<std::size_t>(w) * static_cast<std::size_t>(h));
  }
}

TEST(PixelRect, CountsItsRightAndBottomEdgesOut) {
  const PixelRect frame{0, 0, 10, 8};
  EXPECT_EQ(frame.width(), 10);
  EXPECT_EQ(frame.height(), 8);
  EXPECT_FALSE(frame.empty());
  EXPECT_TRUE((PixelRect{3, 3, 3, 9}).empty());
  EXPECT_TRUE((PixelRect{}).empty());
  const PixelRect cut = PixelRect{-5, 2, 4, 20}.clipped_to(frame);
  EXPECT_EQ(cut.left, 0);
  EXPECT_EQ(cut.top, 2);
  EXPECT_EQ(cut.right, 4);
  EXPECT_EQ(cut.bottom, 8);
  EXPECT_TRUE((PixelRect{20, 20, 30, 30}).clipped_to(frame).empty());
  EXPECT_EQ(frame.grown_by(3).width(), 16);
}

}  // namespace
}  // namespace engine
