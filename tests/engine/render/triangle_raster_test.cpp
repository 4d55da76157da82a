#include "engine/render/triangle_raster.h"

#include <algorithm>
#include <cmath>
#include <random>

#include <gtest/gtest.h>

namespace engine {
namespace {

using Corner = TriangleRaster::Corner;

struct Scene {
  Mesh mesh;
  std::vector<Corner> corners;

  void add(const Corner& a, const Corner& b, const Corner& c) {
    const auto first = static_cast<std::uint32_t>(corners.size());
    for (const Corner& p : {a, b, c}) corners.push_back(p);
    mesh.triangles.push_back({{first, first + 1, first + 2}, 0});
  }
};

/// The triangles seen, row by row, columns * rows.
using Seen = std::vector<std::uint32_t>;

Seen look(const Scene& scene, int columns, int rows, int band_rows) {
  TriangleRaster raster(scene.corners.size(), scene.mesh.triangles.size(), 2048);
  Seen out;
  EXPECT_TRUE(raster.place(scene.mesh, scene.corners, columns, rows, band_rows));
  std::vector<std::uint32_t> band(raster.stride() * static_cast<std::size_t>(band_rows));
  std::vector<float> nearness(band.size());
  for (int b = 0; b < raster.bands(); ++b) {
    raster.see(b, band, nearness);
    for (int j = 0; j < band_rows && b * band_rows + j < rows; ++j) {
      const auto row = band.begin() + static_cast<std::ptrdiff_t>(raster.stride()) * j;
      out.insert(out.end(), row, row + columns);
    }
  }
  return out;
}

double place_x(int i, int j) { return i + static_cast<double>(TriangleRaster::x_in_step(j)); }
double place_y(int i, int j) { return j + static_cast<double>(TriangleRaster::y_in_step(i)); }

/// In sixteenths of a step a corner is where it was given.
Corner on_grid(double x, double y, double nearness) {
  return {std::round(x * 16.0) / 16.0, std::round(y * 16.0) / 16.0, nearness};
}

TEST(TriangleRaster, PointsOfAPatternProjectEvenlyOntoBothAxes) {
  for (const bool across : {true, false}) {
    std::vector<double> places;
    for (int j = 0; j < TriangleRaster::kPeriod; ++j)
      for (int i = 0; i < TriangleRaster::kPeriod; ++i)
        places.push_back(across ? place_x(i, j) : place_y(i, j));
    std::sort(places.begin(), places.end());
    for (std::size_t k = 1; k < places.size(); ++k)
      EXPECT_NEAR(places[k] - places[k - 1], 0.125, 1e-12);
  }
}

TEST(TriangleRaster, SeesTheNearestTriangleOfThoseThatCoverAPoint) {
  std::mt19937 random(11);
  std::uniform_real_distribution<double> anywhere(-30.0, 130.0);
  std::uniform_real_distribution<double> near_by(-9.0, 9.0);
  std::uniform_real_distribution<double> depth(-1.0, 1.0);
  Scene scene;
  for (int t = 0; t < 400; ++t) {
    const double x = anywhere(random);
    const double y = anywhere(random);
    const double size = t % 40 == 0 ? 12.0 : 1.0;  // some reach over all bands
    const auto corner = [&] {
      return on_grid(x + size * near_by(random), y + size * near_by(random), depth(random));
    };
    scene.add(corner(), corner(), corner());
  }
  constexpr int kColumns = 101;
  constexpr int kRows = 99;
  const Seen seen = look(scene, kColumns, kRows, 24);
  int compared = 0;
  for (int j = 0; j < kRows; ++j) {
    for (int i = 0; i < kColumns; ++i) {
      double best = -10.0;
      std::uint32_t expected = TriangleRaster::kNone;
      bool close = false;  // to an edge or to another triangle's depth
      for (std::uint32_t t = 0; t < scene.mesh.triangles.size(); ++t) {
        const Corner& a = scene.corners[3 * t];
        const Corner& b = scene.corners[3 * t + 1];
        const Corner& c = scene.corners[3 * t + 2];
        const double area = (b.x - a.x) * (c.y - a.y) - (c.x - a.x) * (b.y - a.y);
        if (area == 0.0) continue;
        const double px = place_x(i, j) - a.x;
        const double py = place_y(i, j) - a.y;
        const double second = (px * (c.y - a.y) - py * (c.x - a.x)) / area;
        const double third = (py * (b.x - a.x) - px * (b.y - a.y)) / area;
        const double least = std::min({second, third, 1.0 - second - third});
        close = close || std::abs(least) < 1e-9;
        if (least < 0.0) continue;
        const double n =
            a.nearness + second * (b.nearness - a.nearness) + third * (c.nearness - a.nearness);
        close = close || std::abs(n - best) < 1e-4;
        if (n > best) {
          best = n;
          expected = t;
        }
      }
      if (close) continue;
      ++compared;
      ASSERT_EQ(seen[static_cast<std::size_t>(j * kColumns + i)], expected) << i << " " << j;
    }
  }
  EXPECT_GT(compared, kColumns * kRows * 9 / 10);
}

TEST(TriangleRaster, OfTrianglesThatShareEdgesExactlyOneCoversEachPoint) {
  // Fans round points on the lattice's own places, where edges run through points by the dozen.
  std::mt19937 random(12);
  std::uniform_int_distribution<int> sixteenths(0, 64 * 16);
  for (int round = 0; round < 20; ++round) {
    Scene scene;
    const Corner middle = {sixteenths(random) / 16.0, sixteenths(random) / 16.0, 0.0};
    std::vector<Corner> rim;
    for (int k = 0; k <= 64; k += 8) rim.push_back({1.0 * k, 0.0, 0.0});
    for (int k = 8; k <= 64; k += 8) rim.push_back({64.0, 1.0 * k, 0.0});
    for (int k = 56; k >= 0; k -= 8) rim.push_back({1.0 * k, 64.0, 0.0});
    for (int k = 56; k >= 0; k -= 8) rim.push_back({0.0, 1.0 * k, 0.0});
    for (std::size_t k = 0; k + 1 < rim.size(); ++k) {
      if (k % 2 == 0) {
        scene.add(middle, rim[k], rim[k + 1]);
      } else {
        scene.add(rim[k + 1], middle, rim[k]);
      }
    }
    const Seen seen = look(scene, 64, 64, 8);
    EXPECT_EQ(std::count(seen.begin(), seen.end(), TriangleRaster::kNone), 0);
    // Each alone: no point has two.
    std::ptrdiff_t covered = 0;
    for (std::size_t t = 0; t < scene.mesh.triangles.size(); ++t) {
      Scene alone;
      const auto& corner = scene.mesh.triangles[t].corner;
      alone.add(scene.corners[corner[0]], scene.corners[corner[1]], scene.corners[corner[2]]);
      const Seen own = look(alone, 64, 64, 8);
      covered += std::count(own.begin(), own.end(), 0U);
    }
    EXPECT_EQ(covered, 64 * 64);
  }
}

TEST(TriangleRaster, DoesNotDependOnTheHeightOfItsBands) {
  std::mt19937 random(13);
  std::uniform_real_distribution<double> anywhere(-50.0, 150.0);
  std::uniform_real_distribution<double> depth(-1.0, 1.0);
  Scene scene;
  for (int t = 0; t < 60; ++t) {
    const auto corner = [&] { return Corner{anywhere(random), anywhere(random), depth(random)}; };
    scene.add(corner(), corner(), corner());
  }
  const Seen once = look(scene, 100, 90, 30);
  for (const int band_rows : {1, 3, 8, 24, 32}) {
    const Seen again = look(scene, 100, 90, band_rows);
    EXPECT_EQ(once, again) << band_rows;
  }
}

TEST(TriangleRaster, TakesTheLargestViewAndRefusesALargerOne) {
  const auto covers_all = [](double far, int columns) {
    Scene scene;
    scene.add({-far, -far, 0}, {far, -far, 0}, {0, far, 0});
    TriangleRaster raster(3, 1, 2048);
    if (!raster.place(scene.mesh, scene.corners, columns, 32, 32)) return -1;
    std::vector<std::uint32_t> band(raster.stride() * 32);
    std::vector<float> nearness(band.size());
    raster.see(0, band, nearness);
    return static_cast<int>(std::count(band.begin(), band.end(), 0U));
  };
  EXPECT_EQ(covers_all(32767.0, 64), 64 * 32);
  EXPECT_EQ(covers_all(32768.0, 64), -1);
  EXPECT_EQ(covers_all(std::nan(""), 64), -1);
}

TEST(TriangleRaster, LeavesOutWhatHasNoAreaOrLiesOutside) {
  Scene scene;
  scene.add({1, 1, 0}, {5, 5, 0}, {9, 9, 0});
  scene.add({2, 2, 0}, {2, 2, 0}, {2, 2, 0});
  scene.add({-9, 0, 0}, {-1, 0, 0}, {-1, 20, 0});
  scene.add({0, 40, 0}, {20, 40, 0}, {20, 60, 0});
  const Seen seen = look(scene, 20, 20, 8);
  EXPECT_EQ(std::count(seen.begin(), seen.end(), TriangleRaster::kNone), 400);
}

}  // namespace
}  // namespace engine
