// Charts of planes with many parts.
#include <charts/planar.h>
#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <cmath>
#include <span>
#include <vector>

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
    std::atomic<size_t> asked = 0;  // on all threads
    const auto blocked = [&](glm::vec3, glm::vec3) {
        ++asked;
        return false;
    };
    for (const bool along_x : {false, true}) {
        asked = 0;
        const auto faces = along_x ? tiles(count, 1, 0.125f, 0.03125f) : tiles(1, count, 0.125f, 0.03125f);
        size_t found = 0;
        for (const ProjectedChart& chart : planarCharts(faces, 1u << 20, {blocked, {}})) found += chart.faces.size();
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
    const auto charts = planarCharts(faces, 1u << 20);
    ASSERT_EQ(charts.size(), 3u);
    EXPECT_NEAR(charts[0].size_m.x * charts[0].size_m.y, 4, 1e-3);
    for (const ProjectedChart& chart : std::span(charts).subspan(1)) {
        EXPECT_NEAR(chart.size_m.x, 3, 1e-3);
        EXPECT_NEAR(chart.size_m.y, 3, 1e-3);
        EXPECT_NEAR(glm::dot(chart.u_axis, chart.v_axis), 0, 1e-6);
    }
}

// A tessellated floor, a wall across its middle and a ceiling: what stands there says where to look, and the charts are
// those of looking everywhere.
TEST(PlanarCharts, LookForWallsWhereSomethingStands) {
    constexpr float wall_x = 1.5f, wall_m = 2, ceiling_m = 2.5f, side_m = 3;
    std::atomic<size_t> asked = 0;  // on all threads
    bool has_wall = true;
    const auto blocked = [&](glm::vec3 a, glm::vec3 b) {
        ++asked;
        return has_wall && (a.x < wall_x) != (b.x < wall_x) && a.y < wall_m && b.y < wall_m;
    };
    const auto standing = [&](const BoxTree::Box& box) {
        std::vector<std::array<glm::vec3, 3>> triangles;
        if (has_wall && box.min_m.x <= wall_x && box.max_m.x >= wall_x)
            triangles = {{glm::vec3(wall_x, 0, 0), {wall_x, wall_m, 0}, {wall_x, wall_m, side_m}},
                         {glm::vec3(wall_x, 0, 0), {wall_x, wall_m, side_m}, {wall_x, 0, side_m}}};
        if (box.max_m.y >= ceiling_m)
            triangles.push_back({glm::vec3(0, ceiling_m, 0), {2 * side_m, ceiling_m, 0}, {0, ceiling_m, 2 * side_m}});
        return triangles;
    };
    const auto faces = tiles(30, 30, side_m / 30, 0);
    const auto everywhere = planarCharts(faces, 1u << 20, {blocked, {}});
    const size_t asked_everywhere = asked.exchange(0);
    const auto charts = planarCharts(faces, 1u << 20, {blocked, standing});
    ASSERT_GE(charts.size(), 2u);
    ASSERT_EQ(charts.size(), everywhere.size());
    for (size_t c = 0; c < charts.size(); ++c) {
        EXPECT_EQ(charts[c].faces, everywhere[c].faces);
        EXPECT_LE(charts[c].size_m.x, wall_x + 1e-3f);
    }
    EXPECT_GT(asked, 0u);
    // Lines of at most two texels, half a metre, cross a wall in the middle of 3 m: every sixth, or of longer ones all.
    EXPECT_LT(asked, asked_everywhere / 2);

    has_wall = false;
    asked = 0;
    EXPECT_EQ(planarCharts(faces, 1u << 20, {blocked, standing}).size(), 1u);
    EXPECT_EQ(asked, 0u);
}

// Walls stand between the tiles of one row: each tile is a chart of its own, however they touch.
TEST(PlanarCharts, WallsPartTilesThatTouch) {
    const auto between = [](glm::vec3 a, glm::vec3 b) { return std::floor(a.x) != std::floor(b.x); };
    const auto charts = planarCharts(tiles(50, 1, 1, 0), 1u << 20, {between, {}});
    for (const ProjectedChart& chart : charts) EXPECT_LT(chart.size_m.x, 1.001f);
    EXPECT_EQ(charts.size(), 50u);
}

}  // namespace
}  // namespace dimmer::cook::test
