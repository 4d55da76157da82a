#include "engine/optics/pupil_grid.h"

#include <cmath>
#include <complex>

#include <gtest/gtest.h>

#include "engine/core/constants.h"

namespace engine {
namespace {

using Complex = std::complex<double>;

LensSpec spider_with_coma() {
  LensSpec lens;
  lens.obscuration = 0.2;
  lens.spider_vanes = 3;
  lens.spider_width_m = 0.01;
  lens.zernike_m[8] = 30e-9;
  return lens;
}

TEST(PupilGrid, CellsAddUpToTheOpenArea) {
  const LensSpec lens = spider_with_coma();
  const double cell = 0.0125;
  const PupilGrid grid(Pupil(lens), cell, 10);
  // Exact along y; eight lines a cell along x, across edges of some ten radii that a line meets in
  // a place of its cell which is random: (cell/8)^2 a column of cells.
  EXPECT_NEAR(grid.open_area() * cell * cell, kPi * lens.open_share(), 2e-4);
}

TEST(PupilGrid, OverlapIsThatOfThePupil) {
  const LensSpec lens = spider_with_coma();
  const Pupil pupil(lens);
  const double cell = 0.0125;
  PupilGrid grid(pupil, cell, 160);
  const double defocus_m = 500e-9;
  grid.overlap(650e-9, defocus_m);
  for (const auto& [x, y] : {std::pair(3, 2), {-20, 31}, {0, 77}, {60, 0}, {-90, 90}, {100, 119}}) {
    const Complex want = pupil.otf(0.5 * cell * x, 0.5 * cell * y, 650e-9, defocus_m);
    // An edge that runs along itself lies under itself by up to a sixth of a cell too little.
    EXPECT_NEAR(std::abs(grid.at(x, y) / grid.open_area() - want), 0.0, 2e-3) << x << " " << y;
  }
}

TEST(PupilGrid, TransformIsTheSumOverCells) {
  LensSpec lens;
  lens.obscuration = 0.3;
  const double cell = 0.25;  // eight cells
  PupilGrid grid(Pupil(lens), cell, 8);
  grid.flat_overlap();
  // Without a path the sum of all overlaps is the area's square; those with dy < 0 mirror others.
  double sum = 0;
  for (int x = -8; x <= 8; ++x)
    for (int y = 0; y <= 8; ++y) sum += (y == 0 ? 1.0 : 2.0) * grid.at(x, y).real();
  EXPECT_NEAR(sum, grid.open_area() * grid.open_area(), 1e-10);
  EXPECT_NEAR(grid.at(8, 0).real(), 0.0, 1e-12);
}

}  // namespace
}  // namespace engine
