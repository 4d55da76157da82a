#include "engine/scene/box_tree.h"

#include <algorithm>
#include <cstdint>
#include <random>
#include <vector>

#include <gtest/gtest.h>

namespace engine {
namespace {

using Eigen::Vector3f;

bool holds(const BoxTree::Box& box, const Vector3f& p) {
  return (p.array() >= box.low.array()).all() && (p.array() <= box.high.array()).all();
}

std::vector<BoxTree::Box> random_boxes(std::size_t count, float size) {
  std::minstd_rand chance(3);
  std::uniform_real_distribution<float> where(0.0F, 1.0F);
  std::vector<BoxTree::Box> boxes;
  for (std::size_t i = 0; i < count; ++i) {
    const Vector3f low(where(chance), where(chance), where(chance));
    boxes.push_back({low, low + size * Vector3f(where(chance), where(chance), where(chance))});
  }
  return boxes;
}

TEST(BoxTree, FindsWhatLookingAtEveryBoxFinds) {
  std::minstd_rand chance(5);
  std::uniform_real_distribution<float> where(0.0F, 1.0F);
  for (const std::size_t count : {0U, 1U, 4U, 5U, 777U}) {
    const std::vector<BoxTree::Box> boxes = random_boxes(count, 0.3F);
    const BoxTree tree(boxes);
    for (int i = 0; i < 200; ++i) {
      const Vector3f p(where(chance), where(chance), where(chance));
      // Each that holds the point is offered once, and no other.
      std::vector<std::uint32_t> offered;
      std::uint64_t steps = 1'000'000;
      const auto found = tree.any([&](const BoxTree::Box& box) { return holds(box, p); },
                                  [&](std::uint32_t k) {
                                    offered.push_back(k);
                                    return false;
                                  },
                                  steps);
      std::ranges::sort(offered);
      std::vector<std::uint32_t> want;
      for (std::uint32_t k = 0; k < count; ++k)
        if (holds(boxes[k], p)) want.push_back(k);
      ASSERT_EQ(offered, want) << count;
      ASSERT_EQ(found, BoxTree::Found::kNo);
    }
  }
}

TEST(BoxTree, TakesFewStepsAmongBoxesThatAreApartAndNoMoreThanItMay) {
  constexpr std::size_t kCount = 100'000;
  const BoxTree apart(random_boxes(kCount, 1e-3F));
  const auto search = [](const BoxTree& tree, std::uint64_t& steps) {
    return tree.any([](const BoxTree::Box& box) { return holds(box, Vector3f::Constant(0.5F)); },
                    [](std::uint32_t /*index*/) { return false; }, steps);
  };
  std::uint64_t steps = 1'000;
  EXPECT_EQ(search(apart, steps), BoxTree::Found::kNo);
  // All in one place: every box holds the point.
  const BoxTree same(std::vector<BoxTree::Box>(kCount, {Vector3f::Zero(), Vector3f::Ones()}));
  steps = 1'000;
  EXPECT_EQ(search(same, steps), BoxTree::Found::kGaveUp);
  EXPECT_LE(steps, 1'000U);
  steps = 3 * kCount;
  EXPECT_EQ(search(same, steps), BoxTree::Found::kNo);
}

}  // namespace
}  // namespace engine
