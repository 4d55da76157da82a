#include "engine/scene/box_tree.h"

#include <algorithm>

namespace engine {

BoxTree::BoxTree(const std::vector<Box>& boxes) {
  items_.reserve(boxes.size());
  for (const Box& box : boxes) items_.push_back({box, static_cast<std::uint32_t>(items_.size())});
  nodes_.reserve(boxes.size() / 2 + 2 * kLeaf);
  if (!items_.empty()) add_node(0, items_.size());
}

void BoxTree::add_node(std::size_t first, std::size_t end) {
  const std::size_t here = nodes_.size();
  Node node{items_[first].box, 0, static_cast<std::uint32_t>(first), 0};
  const auto twice_middle = [](const Item& item) { return (item.box.low + item.box.high).eval(); };
  Box middles{twice_middle(items_[first]), twice_middle(items_[first])};
  for (std::size_t i = first; i < end; ++i) {
    node.box.extend(items_[i].box.low);
    node.box.extend(items_[i].box.high);
    middles.extend(twice_middle(items_[i]));
  }
  if (end - first <= kLeaf) node.items = static_cast<std::uint32_t>(end - first);
  nodes_.push_back(node);
  if (node.items == 0) {
    Eigen::Index axis = 0;
    (middles.high - middles.low).maxCoeff(&axis);
    const auto at = [this](std::size_t i) {
      return items_.begin() + static_cast<std::ptrdiff_t>(i);
    };
    const std::size_t middle = first + (end - first) / 2;
    std::nth_element(at(first), at(middle), at(end), [axis](const Item& a, const Item& b) {
      const float of_a = a.box.low[axis] + a.box.high[axis];
      const float of_b = b.box.low[axis] + b.box.high[axis];
      return of_a != of_b ? of_a < of_b : a.index < b.index;
    });
    add_node(first, middle);
    add_node(middle, end);
  }
  nodes_[here].beyond = static_cast<std::uint32_t>(nodes_.size());
}

}  // namespace engine
