// Boxes in a tree: to find those near a place without asking all.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

namespace dimmer::cook {

// Immutable after construction; queries are thread-safe.
class BoxTree {
   public:
    struct Box {
        glm::vec3 min_m, max_m;
    };
    static Box boxOf(std::span<const glm::vec3> points);  // of one at least

    BoxTree() = default;
    // Of finite coordinates.
    explicit BoxTree(std::vector<Box> boxes);

    // The boxes that have a point in common with another one, ascending.
    std::vector<uint32_t> touching(const Box& box) const;

   private:
    // In depth-first order: what hangs under a node comes right behind it.
    struct Node {
        Box box;
        uint32_t first = 0, count = 0;  // of a leaf, into order_
        uint32_t behind = 0;            // the node after all that hang under this one
    };
    void build(uint32_t first, uint32_t count);

    std::vector<Box> boxes_;
    std::vector<uint32_t> order_;
    std::vector<Node> nodes_;
};

}  // namespace dimmer::cook
