// Boxes in a tree, against asking all of them.
#include <charts/box_tree.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <numeric>
#include <random>

namespace dimmer::cook::test {
namespace {

// Corners are whole numbers, so that many boxes have a side, an edge or a corner alone in common; one in four is flat
// along an axis, some are but a point.
BoxTree::Box randomBox(std::mt19937& random) {
    std::uniform_int_distribution<int> place(-10, 10), size(0, 3);
    BoxTree::Box box;
    for (int axis = 0; axis < 3; ++axis) {
        box.min_m[axis] = static_cast<float>(place(random));
        box.max_m[axis] = box.min_m[axis] + static_cast<float>(size(random));
    }
    return box;
}

std::vector<uint32_t> touchingOfAll(const std::vector<BoxTree::Box>& boxes, const BoxTree::Box& box) {
    std::vector<uint32_t> found;
    for (uint32_t i = 0; i < boxes.size(); ++i) {
        bool in_common = true;
        for (int axis = 0; axis < 3; ++axis)
            in_common = in_common && std::max(boxes[i].min_m[axis], box.min_m[axis]) <=
                                         std::min(boxes[i].max_m[axis], box.max_m[axis]);
        if (in_common) found.push_back(i);
    }
    return found;
}

TEST(BoxTree, FindsWhatAskingAllFinds) {
    std::mt19937 random(1);
    for (const size_t count : {1u, 2u, 3u, 4u, 5u, 8u, 9u, 17u, 100u, 3000u}) {
        std::vector<BoxTree::Box> boxes;
        for (size_t i = 0; i < count; ++i) boxes.push_back(randomBox(random));
        const BoxTree tree(boxes);
        for (int i = 0; i < 300; ++i) {
            const BoxTree::Box box = randomBox(random);
            EXPECT_EQ(tree.touching(box), touchingOfAll(boxes, box)) << count;
        }
    }
}

TEST(BoxTree, OfNoBoxesFindsNone) {
    const BoxTree::Box all{glm::vec3(-1e30f), glm::vec3(1e30f)};
    EXPECT_TRUE(BoxTree().touching(all).empty());
    EXPECT_TRUE(BoxTree(std::vector<BoxTree::Box>()).touching(all).empty());
}

// No side along which to part them.
TEST(BoxTree, FindsAllOfThoseInOnePlace) {
    const BoxTree tree(std::vector<BoxTree::Box>(1000, {glm::vec3(1), glm::vec3(1)}));
    std::vector<uint32_t> all(1000);
    std::iota(all.begin(), all.end(), 0u);
    EXPECT_EQ(tree.touching({glm::vec3(0), glm::vec3(1)}), all);
    EXPECT_TRUE(tree.touching({glm::vec3(0), {1, 1, 0.999f}}).empty());
}

TEST(BoxTree, ABoxHoldsItsPointsAndNoMore) {
    const std::array<glm::vec3, 3> points = {{{1, -2, 3}, {0, 5, 3}, {-1, 0, 3}}};
    const BoxTree::Box box = BoxTree::boxOf(points);
    EXPECT_EQ(box.min_m, glm::vec3(-1, -2, 3));
    EXPECT_EQ(box.max_m, glm::vec3(1, 5, 3));
}

}  // namespace
}  // namespace dimmer::cook::test
