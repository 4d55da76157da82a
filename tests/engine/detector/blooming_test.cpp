#include "engine/detector/blooming.h"

#include <algorithm>
#include <vector>

#include <gtest/gtest.h>

#include "engine/core/random.h"

namespace engine {
namespace {

constexpr float kWell_e = 1000.0F;

double sum_of(const ElectronImage& image) {
  double sum = 0;
  for (const float e : image.pixels()) sum += static_cast<double>(e);
  return sum;
}

double bloomed(ElectronImage& image, float well_e = kWell_e, std::span<const float> response = {},
               int threads = 1) {
  WorkerPool pool(threads);
  return bloom(image, well_e, response, pool);
}

/// Whole electrons everywhere, and so many pixels of a column far over the well.
ElectronImage scene(int bright, std::uint64_t seed) {
  ElectronImage image(70, 61);
  Draws draws(seed, Stream::kLight, 0, 0);
  for (float& e : image.pixels()) e = std::floor(900.0F * draws.uniform());
  for (int i = 0; i < bright; ++i)
    image.at(static_cast<int>(70 * draws.uniform_double()),
             static_cast<int>(61 * draws.uniform_double())) +=
        std::floor(9000.0F * draws.uniform());
  return image;
}

TEST(Blooming, ConservesChargeWithWhatRunsOffTheFrame) {
  for (const int bright : {1, 10, 200, 1500}) {
    ElectronImage image = scene(bright, static_cast<std::uint64_t>(bright));
    const double before = sum_of(image);
    const double lost = bloomed(image);
    // Quarters of electrons, which single precision holds: nothing is rounded.
    EXPECT_EQ(sum_of(image) + lost, before) << bright;
    for (const float e : image.pixels()) ASSERT_LE(e, kWell_e);
    if (bright == 1) {
      EXPECT_EQ(lost, 0.0);
    }
    if (bright == 1500) {
      EXPECT_GT(lost, 0.0);
    }
  }
}

TEST(Blooming, ConservesChargeInWellsOfNoWholeElectrons) {
  ElectronImage image = scene(50, 7);
  const double before = sum_of(image);
  const double lost = bloomed(image, 1000.3F);
  // A pixel of single precision is right to 3e-5 e-, 6e-8 of a well; 70 x 61 of them.
  EXPECT_NEAR(sum_of(image) + lost, before, 4270 * 3.1e-5 + 70 * 0.125);
}

TEST(Blooming, FillsTheNextPixelsUpToTheirWells) {
  ElectronImage image(3, 9);
  image.at(1, 4) = 4000.0F;
  image.at(1, 3) = 400.0F;
  EXPECT_EQ(bloomed(image), 0.0);
  const std::vector<float> want{0, 0, 900, 1000, 1000, 1000, 500, 0, 0};
  for (int v = 0; v < 9; ++v) {
    EXPECT_EQ(image.at(1, v), want[static_cast<std::size_t>(v)]) << v;
    EXPECT_EQ(image.at(0, v), 0.0F);  // columns are apart
    EXPECT_EQ(image.at(2, v), 0.0F);
  }
}

TEST(Blooming, LosesAtTheEdgeWhatHasNoPixelLeft) {
  ElectronImage image(1, 4);
  image.at(0, 0) = 4000.0F;
  EXPECT_EQ(bloomed(image), 1500.0);  // up, at once
  EXPECT_EQ(image.at(0, 1), 1000.0F);
  EXPECT_EQ(image.at(0, 2), 500.0F);
}

TEST(Blooming, DoesNotKnowUpFromDown) {
  for (const int bright : {1, 40, 1500}) {
    ElectronImage image = scene(bright, 3);
    ElectronImage turned = image;
    for (int v = 0; v < image.height(); ++v)
      std::copy(image.row(v).begin(), image.row(v).end(),
                turned.row(image.height() - 1 - v).begin());
    EXPECT_EQ(bloomed(image), bloomed(turned));
    for (int v = 0; v < image.height(); ++v)
      ASSERT_TRUE(std::ranges::equal(image.row(v), turned.row(image.height() - 1 - v))) << v;
  }
}

TEST(Blooming, LeavesAFrameAloneThatIsNotFull) {
  ElectronImage image = scene(0, 1);
  image.at(5, 5) = kWell_e;
  const ElectronImage before = image;
  EXPECT_EQ(bloomed(image), 0.0);
  EXPECT_TRUE(std::ranges::equal(image.pixels(), before.pixels()));
}

TEST(Blooming, PassesDeadPixels) {
  ElectronImage image(1, 5);
  image.at(0, 1) = 3000.0F;
  const std::vector<float> response{1.0F, 1.0F, 0.0F, 1.0F, 1.0F};
  EXPECT_EQ(bloomed(image, kWell_e, response), 0.0);
  EXPECT_EQ(image.at(0, 0), 1000.0F);
  EXPECT_EQ(image.at(0, 2), 0.0F);
  EXPECT_EQ(image.at(0, 3), 1000.0F);
}

TEST(Blooming, GivesTheSameBitsOnAnyNumberOfThreads) {
  ElectronImage want = scene(1500, 9);
  const double lost = bloomed(want);
  for (const int threads : {2, 3}) {
    ElectronImage image = scene(1500, 9);
    EXPECT_EQ(bloomed(image, kWell_e, {}, threads), lost);
    EXPECT_TRUE(std::ranges::equal(image.pixels(), want.pixels()));
  }
}

}  // namespace
}  // namespace engine
