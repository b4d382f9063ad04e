#include <bake/sampling.h>
#include <gtest/gtest.h>
#include <trace/leaf_boxes.h>

#include <vector>

namespace dimmer::cook::test {
namespace {

struct LeafBox {
    glm::vec3 low, high;
};

// In double precision, by clipping the ray at each of the six planes.
bool meets(const LeafBox& box, glm::dvec3 from, glm::dvec3 direction, double distance) {
    double near = 0, far = distance;
    for (int a = 0; a < 3; ++a) {
        const double low = static_cast<double>(box.low[a]) - from[a], high = static_cast<double>(box.high[a]) - from[a];
        if (direction[a] == 0) {
            if (low > 0 || high < 0) return false;
            continue;
        }
        near = std::max(near, std::min(low / direction[a], high / direction[a]));
        far = std::min(far, std::max(low / direction[a], high / direction[a]));
    }
    return near <= far;
}

// 1 to 160 thin boxes; rays from anywhere, some along an axis, some that start at a box's corner: none that meets one
// is missed, and up to 128 boxes most that meet none are told apart.
TEST(LeafBoxes, MissNoRayThatMeetsALeaf) {
    for (const uint32_t count : {1u, 2u, 7u, 8u, 9u, 16u, 17u, 128u, 129u, 160u}) {
        LeafBoxes boxes;
        std::vector<LeafBox> all;
        for (uint32_t b = 0; b < count; ++b) {
            const glm::vec3 centre = 40.0f * (sequence3d(b, count) - 0.5f);
            glm::vec3 half(1, 2, 0.05f);
            std::swap(half.z, half[static_cast<int>(b % 3)]);
            all.push_back({centre - half, centre + half});
            boxes.add(all.back().low, all.back().high);
        }
        uint32_t missed = 0, met = 0, apart = 0;
        constexpr uint32_t rays = 4000;
        for (uint32_t i = 0; i < rays; ++i) {
            glm::vec3 from = 50.0f * (sequence3d(i, 77) - 0.5f);
            if (i % 5 == 0) from = all[i % count].low;
            glm::vec3 direction = glm::normalize(sequence3d(i, 99) - 0.5f);
            if (i % 7 == 0) direction = i % 2 ? glm::vec3(0, -1, 0) : glm::vec3(1, 0, -0.0f);
            const float distance = i % 3 ? 1e30f : 10;
            const bool may = boxes.mayHit(from, direction, distance);
            bool does = false;
            for (const LeafBox& box : all) does |= meets(box, from, direction, static_cast<double>(distance));
            missed += does && !may;
            met += does;
            apart += !does && !may;
        }
        EXPECT_EQ(missed, 0u) << count;
        EXPECT_GT(met, rays / 50) << count;
        // Those from corners touch the margin of a millimetre: a fifth are not told apart.
        if (count <= 128)
            EXPECT_GT(apart, (rays - met) * 3 / 4) << count;
        else
            EXPECT_EQ(apart, 0u) << count;
    }
}

}  // namespace
}  // namespace dimmer::cook::test
