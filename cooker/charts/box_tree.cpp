#include <charts/box_tree.h>

#include <algorithm>
#include <numeric>

namespace dimmer::cook {
namespace {

constexpr uint32_t boxes_per_leaf = 4;

bool touch(const BoxTree::Box& a, const BoxTree::Box& b) {
    return glm::all(glm::lessThanEqual(a.min_m, b.max_m)) && glm::all(glm::lessThanEqual(b.min_m, a.max_m));
}

}  // namespace

BoxTree::Box BoxTree::boxOf(std::span<const glm::vec3> points) {
    Box box{points[0], points[0]};
    for (const glm::vec3& p : points) {
        box.min_m = glm::min(box.min_m, p);
        box.max_m = glm::max(box.max_m, p);
    }
    return box;
}

BoxTree::BoxTree(std::vector<Box> boxes) : boxes_(std::move(boxes)), order_(boxes_.size()) {
    std::iota(order_.begin(), order_.end(), 0u);
    if (!boxes_.empty()) build(0, static_cast<uint32_t>(boxes_.size()));
}

// Halves the boxes along the side on which their middles lie farthest apart.
void BoxTree::build(uint32_t first, uint32_t count) {
    const auto number = static_cast<uint32_t>(nodes_.size());
    const std::span<uint32_t> of_node = std::span(order_).subspan(first, count);
    const auto twiceMiddle = [&](uint32_t i) { return boxes_[i].min_m + boxes_[i].max_m; };
    Box whole = boxes_[of_node[0]], middles{twiceMiddle(of_node[0]), twiceMiddle(of_node[0])};
    for (const uint32_t i : of_node) {
        whole.min_m = glm::min(whole.min_m, boxes_[i].min_m);
        whole.max_m = glm::max(whole.max_m, boxes_[i].max_m);
        middles.min_m = glm::min(middles.min_m, twiceMiddle(i));
        middles.max_m = glm::max(middles.max_m, twiceMiddle(i));
    }
    nodes_.push_back({.box = whole, .first = first});
    if (count <= boxes_per_leaf) {
        nodes_[number].count = count;
    } else {
        const glm::vec3 side = middles.max_m - middles.min_m;
        const int axis = side.x >= side.y && side.x >= side.z ? 0 : side.y >= side.z ? 1 : 2;
        const uint32_t half = count / 2;
        std::ranges::nth_element(of_node, of_node.begin() + half, {}, [&](uint32_t i) { return twiceMiddle(i)[axis]; });
        build(first, half);
        build(first + half, count - half);
    }
    nodes_[number].behind = static_cast<uint32_t>(nodes_.size());
}

std::vector<uint32_t> BoxTree::touching(const Box& box) const {
    std::vector<uint32_t> found;
    for (uint32_t n = 0; n < nodes_.size();) {
        const Node& node = nodes_[n];
        if (!touch(node.box, box)) {
            n = node.behind;
            continue;
        }
        for (uint32_t i = node.first; i < node.first + node.count; ++i)
            if (touch(boxes_[order_[i]], box)) found.push_back(order_[i]);
        ++n;
    }
    std::ranges::sort(found);
    return found;
}

}  // namespace dimmer::cook
