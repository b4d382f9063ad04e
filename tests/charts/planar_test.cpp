// Charts of planes with many parts.
#include <charts/planar.h>
#include <gtest/gtest.h>

#include <cmath>
#include <span>

namespace dimmer::cook::test {
namespace {

// Squares of `side_m`, `gap_m` apart, in rows along both axes.
std::vector<PlanarFace> tiles(uint32_t columns, uint32_t rows, float side_m, float gap_m) {
    std::vector<PlanarFace> faces;
    for (uint32_t i = 0; i < columns * rows; ++i) {
        const glm::vec3 at = glm::vec3(i % columns, 0, i / columns) * (side_m + gap_m), x(side_m, 0, 0),
                        z(0, 0, side_m);
        for (const auto& corners : {std::array{at, at + z, at + x + z}, std::array{at, at + x + z, at + x}})
            faces.push_back({corners, {0, 1, 0}, 4, 0});
    }
    return faces;
}

// Side by side, none before the other along the first axis: of 160,000 parts in one row there are 13 billion pairs.
TEST(PlanarCharts, OfManyPartsCompareNeighboursAlone) {
    constexpr uint32_t count = 80'000;
    size_t asked = 0;
    const auto blocked = [&](glm::vec3, glm::vec3) {
        ++asked;
        return false;
    };
    for (const bool along_x : {false, true}) {
        asked = 0;
        const auto faces = along_x ? tiles(count, 1, 0.125f, 0.03125f) : tiles(1, count, 0.125f, 0.03125f);
        size_t found = 0;
        for (const PlanarChart& chart : planarCharts(faces, 1u << 20, blocked)) found += chart.faces.size();
        EXPECT_EQ(found, faces.size());
        EXPECT_LT(asked, size_t{100} * count);
    }
}

// What is turned against the rest of its plane has a chart along its own edges, as small as it is itself. A square's
// diagonals are longer than its sides, but no edges of it.
TEST(PlanarCharts, LieAlongTheEdgesOfWhatIsTurned) {
    auto faces = tiles(4, 1, 1, 0);
    for (const float degrees : {20.0f, 45.0f}) {
        const float c = std::cos(glm::radians(degrees)), s = std::sin(glm::radians(degrees));
        for (PlanarFace face : tiles(3, 3, 1, 0)) {
            for (glm::vec3& p : face.corners_m) p = {10 + degrees + c * p.x + s * p.z, 0, c * p.z - s * p.x};
            faces.push_back(face);
        }
    }
    const auto charts = planarCharts(faces, 1u << 20, {});
    ASSERT_EQ(charts.size(), 3u);
    EXPECT_NEAR(charts[0].size_m.x * charts[0].size_m.y, 4, 1e-3);
    for (const PlanarChart& chart : std::span(charts).subspan(1)) {
        EXPECT_NEAR(chart.size_m.x, 3, 1e-3);
        EXPECT_NEAR(chart.size_m.y, 3, 1e-3);
        EXPECT_NEAR(glm::dot(chart.u_axis, chart.v_axis), 0, 1e-6);
    }
}

// Walls stand between the tiles of one row: each tile is a chart of its own, however they touch.
TEST(PlanarCharts, WallsPartTilesThatTouch) {
    const auto between = [](glm::vec3 a, glm::vec3 b) { return std::floor(a.x) != std::floor(b.x); };
    const auto charts = planarCharts(tiles(50, 1, 1, 0), 1u << 20, between);
    for (const PlanarChart& chart : charts) EXPECT_LT(chart.size_m.x, 1.001f);
    EXPECT_EQ(charts.size(), 50u);
}

}  // namespace
}  // namespace dimmer::cook::test
