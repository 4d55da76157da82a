#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

namespace engine {

/// Boxes by where they lie, for those who look through a mesh once, when it is read: which of many
/// may a point or a ray meet. (Rays of a picture have a tree of their own, in render/.)
///
/// Each node is cut at the median of its boxes' middles across their longest spread: n boxes are
/// log2(n) deep however they lie. A search takes some 2 log2(n) steps where boxes are apart, and up
/// to 2 n where they lie in one another: so each search has a number of steps that it may take.
/// Thread: any, once built. Same tree for the same boxes.
class BoxTree {
 public:
  struct Box {
    Eigen::Vector3f low = Eigen::Vector3f::Zero();
    Eigen::Vector3f high = Eigen::Vector3f::Zero();

    [[nodiscard]] bool touches(const Box& other) const noexcept {
      return low.x() <= other.high.x() && low.y() <= other.high.y() && low.z() <= other.high.z() &&
             high.x() >= other.low.x() && high.y() >= other.low.y() && high.z() >= other.low.z();
    }
    void extend(const Eigen::Vector3f& p) {
      low = low.cwiseMin(p);
      high = high.cwiseMax(p);
    }
  };

  /// Pre: every number is one; low <= high; under 2^31 boxes.
  explicit BoxTree(const std::vector<Box>& boxes);

  enum class Found : std::uint8_t { kYes, kNo, kGaveUp };
  /// Whether `is_it(index)` holds for a box that `may_meet`, and so do all that it is in. Stops at
  /// the first. A look at a box is a step, taken off `steps`; with none left it gives up.
  template <class MayMeet, class IsIt>
  [[nodiscard]] Found any(const MayMeet& may_meet, const IsIt& is_it, std::uint64_t& steps) const;

 private:
  struct Item {
    Box box;
    std::uint32_t index = 0;
  };
  /// Those below it stand behind it, up to `beyond`.
  struct Node {
    Box box;
    std::uint32_t beyond = 0;
    std::uint32_t first = 0;  ///< of its items
    std::uint32_t items = 0;  ///< 0: not a leaf
  };
  static constexpr std::size_t kLeaf = 4;

  void add_node(std::size_t first, std::size_t end);

  std::vector<Item> items_;
  std::vector<Node> nodes_;
};

template <class MayMeet, class IsIt>
BoxTree::Found BoxTree::any(const MayMeet& may_meet, const IsIt& is_it,
                            std::uint64_t& steps) const {
  for (std::size_t i = 0; i < nodes_.size();) {
    const Node& node = nodes_[i];
    if (steps <= node.items) return Found::kGaveUp;
    --steps;
    if (!may_meet(node.box)) {
      i = node.beyond;
      continue;
    }
    steps -= node.items;
    for (std::uint32_t k = node.first; k < node.first + node.items; ++k)
      if (may_meet(items_[k].box) && is_it(items_[k].index)) return Found::kYes;
    ++i;
  }
  return Found::kNo;
}

}  // namespace engine
