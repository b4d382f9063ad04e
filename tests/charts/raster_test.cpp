// Triangles on a grid, against asking every cell.
#include <charts/polygon.h>
#include <charts/raster.h>
#include <gtest/gtest.h>

#include <random>

namespace dimmer::cook::test {
namespace {

using Triangle = std::array<glm::vec2, 3>;

bool covers(const Triangle& t, uint32_t x, uint32_t y) {
    return polygonArea(clipToCell(t, x, y)) > 1e-6f;
}

// Any, needles, and such with corners on the grid.
TEST(Raster, CellsNearATriangleAreAllThatItCovers) {
    std::mt19937 random(1);
    for (int i = 0; i < 300; ++i) {
        const uint32_t side = i < 15 ? 256 : 64;
        std::uniform_real_distribution<float> place(0, static_cast<float>(side)), near(-0.3f, 0.3f);
        Triangle t;
        for (glm::vec2& p : t) p = {place(random), place(random)};
        if (i % 3 == 1) t[2] = glm::clamp(t[1] + glm::vec2(near(random), near(random)), 0.0f, static_cast<float>(side));
        if (i % 3 == 2)
            for (glm::vec2& p : t) p = glm::floor(p / 16.0f) * 16.0f;
        std::vector<uint8_t> visited(size_t{side} * side);
        forEachCellNear(t, glm::uvec2(side), [&](uint32_t x, uint32_t y) { ++visited[y * side + x]; });
        for (uint32_t y = 0; y < side; ++y)
            for (uint32_t x = 0; x < side; ++x) {
                ASSERT_LE(visited[y * side + x], 1);
                ASSERT_GE(visited[y * side + x], covers(t, x, y) ? 1 : 0) << i << ": " << x << ", " << y;
            }
    }
}

// From corner to corner of a page of 4,096 the box has 16.8 million cells.
TEST(Raster, ANeedleVisitsTheCellsAlongIt) {
    for (const float width : {0.01f, 1.0f}) {
        size_t visits = 0;
        const Triangle t = {glm::vec2(0, 0), glm::vec2(4096, 4095 - width), glm::vec2(4096, 4095)};
        forEachCellNear(t, glm::uvec2(4096), [&](uint32_t, uint32_t) { ++visits; });
        EXPECT_GE(visits, 4096u);
        EXPECT_LT(visits, 5u * 4096);
    }
}

}  // namespace
}  // namespace dimmer::cook::test
