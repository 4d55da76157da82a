#include "engine/optics/far_wings.h"

#include <cmath>

#include <gtest/gtest.h>

#include "engine/core/constants.h"

namespace engine {
namespace {

constexpr int kSide_px = 256;
constexpr WingLaw kLaw{0.0403, 0.01};

/// One cell of a third of a pixel, of so much light that shares come out, and its wings.
struct OneCell {
  OneCell(int cell_u, int cell_v, int reach_px = 128)
      : pool(1), wings(kLaw, 1.0, kSide_px + 300, pool) {
    image.resize(kSide_px, kSide_px);
    RadianceImage picture(12, 12);
    picture.at(cell_u, cell_v) = 9.0F;
    wings.gather(picture, {126, 126, 130, 130}, 3);
    wings.transform(reach_px, {});
    wings.add({}, 1.0, image);
    centre = {126.0 + (cell_u - 1) / 3.0, 126.0 + (cell_v - 1) / 3.0};
  }
  [[nodiscard]] double at(int u, int v) const { return static_cast<double>(image.at(u, v)); }
  WorkerPool pool;
  FarWings wings;
  IrradianceImage image;
  PixelPoint centre;
};

/// In real space: two laws c / (r^2 + s^2)^(3/2).
double softened(double r) {
  const double s0 = 25.0;
  const double s1 = 49.0;
  const double first = (kLaw.share_px * s1 + kLaw.next_px3 / 1.5) / (s1 - s0);
  return first / std::pow(r * r + s0, 1.5) + (kLaw.share_px - first) / std::pow(r * r + s1, 1.5);
}

TEST(FarWings, FollowTheirLawFarOut) {
  const OneCell cell(4, 4);
  for (const int d : {30, 45, 60}) {
    const double r = d - 1.0;  // the cell is the middle of pixel 127
    ASSERT_DOUBLE_EQ(cell.centre.u, 127.0);
    const double want = kLaw.share_px / (r * r * r) + kLaw.next_px3 / std::pow(r, 5);
    // Copies of it lie 288 px apart each way: the sum of 1/n^3 over a square lattice is 9.03. The
    // next term but one is (s / r)^4 of it.
    const double copies = 9.03 * std::pow(r / 288.0, 3);
    EXPECT_NEAR(cell.at(126 + d, 127) / want, 1.0 + copies, 10.0 * std::pow(6.0 / r, 4) + 0.01)
        << d;
  }
}

TEST(FarWings, AreTheTransformOfTheirOtfEverywhere) {
  for (const int cell_u : {3, 4, 5, 6, 7, 8}) {
    const OneCell cell(cell_u, 4);
    for (int v = 110; v < 146; v += 3) {
      for (int u = 110; u < 146; ++u) {
        const double r = std::hypot(u - cell.centre.u, v - cell.centre.v);
        // Interpolated by cubics: .017 h^4 of the fourth derivative, 45 c / s^7 in the middle,
        // along either axis; the pixel's square, 1/24 of the second, 3 c / s^5; copies, 4e-7 each.
        EXPECT_NEAR(cell.at(u, v), softened(r), 2.0 * 1.25e-5 + 2.0 * 3.3e-6 + 4e-6)
            << cell_u << ": " << u << ", " << v;
      }
    }
  }
}

TEST(FarWings, KeepThePlaceOfTheirLight) {
  // Wherever in a cell of two pixels the light is.
  for (const int cell_u : {3, 4, 5, 6, 7, 8}) {
    const OneCell cell(cell_u, cell_u);
    double sum = 0;
    double sum_u = 0;
    double sum_v = 0;
    for (int v = 127 - 40; v <= 127 + 40; ++v) {
      for (int u = 127 - 40; u <= 127 + 40; ++u) {
        sum += cell.at(u, v);
        sum_u += cell.at(u, v) * (u - cell.centre.u);
        sum_v += cell.at(u, v) * (v - cell.centre.v);
      }
    }
    // The window's middle is up to 4/3 px off: it has a strip more at one end and less at the
    // other, 40 px away, of 8.8e-4 c of light to a column: .0475 of that of all the wings. Light
    // put into the wrong cell would pull by half a pixel and more.
    const double off = 127.0 - cell.centre.u;
    EXPECT_NEAR(sum_u / sum, off * 0.0475, 0.005) << cell_u;
    EXPECT_NEAR(sum_v / sum, off * 0.0475, 0.005) << cell_u;
  }
}

TEST(FarWings, MoveAsTheyAreTold) {
  OneCell still(4, 4);
  IrradianceImage cells(kSide_px, kSide_px);
  IrradianceImage parts(kSide_px, kSide_px);
  still.wings.add({8.0, -2.0}, 1.0, cells);
  still.wings.add({7.0, -3.0}, 1.0, parts);
  for (int v = 100; v < 150; ++v) {
    for (int u = 100; u < 150; ++u) {
      ASSERT_NEAR(static_cast<double>(cells.at(u + 8, v - 2)), still.at(u, v), 1e-9);
      // By odd pixels another quarter of the cells is interpolated.
      ASSERT_NEAR(static_cast<double>(parts.at(u + 7, v - 3)), still.at(u, v), 2.0 * 1.25e-5);
    }
  }
}

}  // namespace
}  // namespace engine
