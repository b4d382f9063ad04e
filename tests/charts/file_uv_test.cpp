// Unwraps that files bring: taken whole, or piece by piece where that takes fewer texels.
#include <bake/test_scenes.h>
#include <charts/file_uv.h>
#include <charts/unwrap.h>
#include <gtest/gtest.h>

#include <cmath>

namespace dimmer::cook::test {
namespace {

// Two squares of 1 m, one mesh, at two places of the unwrap, each 0.1 of it to a side.
Scene twoSquares(glm::vec2 first, glm::vec2 second) {
    Scene scene;
    const uint32_t white = addMaterial(scene, lambert(0.5f));
    addQuad(scene, "floor", {0, 0, 0}, {0, 0, 0.5f}, {0.5f, 0, 0}, white);
    SceneMesh other = addQuad(scene, "floor", {3, 0, 0}, {0, 0, 0.5f}, {0.5f, 0, 0}, white);
    scene.meshes.pop_back();
    SceneMesh& mesh = scene.meshes.back();
    for (const glm::uvec3 t : other.triangles) mesh.triangles.push_back(t + 4u);
    mesh.positions_m.insert(mesh.positions_m.end(), other.positions_m.begin(), other.positions_m.end());
    mesh.normals.insert(mesh.normals.end(), other.normals.begin(), other.normals.end());
    mesh.triangle_materials.assign(4, white);
    for (const glm::vec2 low : {first, second})
        for (const glm::vec2 corner : {glm::vec2(0, 0), {0.1f, 0}, {0.1f, 0.1f}, {0, 0.1f}})
            mesh.uv1.push_back(low + corner);
    return scene;
}

Unwrap chartsOf(const Scene& scene) {
    const RayScene rays(scene);
    auto charts = unwrap(rays, {.texels_per_metre = 10, .page_size = 1024});
    EXPECT_TRUE(charts) << charts.error().message;
    EXPECT_TRUE(charts->warnings.empty());
    return std::move(*charts);
}

TEST(FileUv, PiecesFarApartAreChartsOfTheirOwn) {
    const Scene scene = twoSquares({0, 0}, {0.9f, 0.9f});
    const Unwrap charts = chartsOf(scene);
    ASSERT_EQ(charts.charts.size(), 2u);
    for (const auto& chart : charts.charts) {
        EXPECT_TRUE(chart.curved);
        EXPECT_NEAR(chart.width, 10 + 2, 1);  // 1 m at 10 texels, and padding; rounding up
        EXPECT_NEAR(chart.height, 10 + 2, 1);
    }
    EXPECT_EQ(charts.page_width, 64u);  // the least
}

// The halves of a square of 1 m that is cut along its diagonal, so far apart on the unwrap.
Scene twoHalves(float apart_uv) {
    Scene scene;
    SceneMesh& mesh = addQuad(scene, "floor", {0, 0, 0}, {0, 0, 0.5f}, {0.5f, 0, 0}, addMaterial(scene, lambert(0.5f)));
    for (const int corner : {0, 2}) {
        mesh.positions_m.push_back(mesh.positions_m[static_cast<size_t>(corner)]);
        mesh.normals.push_back(mesh.normals[0]);
    }
    mesh.triangles[1] = {4, 5, 3};
    const glm::vec2 apart(apart_uv);
    mesh.uv1 = {glm::vec2(0.1f, 0),        {0, 0}, {0, 0.1f}, glm::vec2(0.1f, 0.1f) + apart, apart + glm::vec2(0.1f, 0),
                apart + glm::vec2(0, 0.1f)};
    return scene;
}

// Pieces that lie in each other's corners take less together, padding of their own and all.
TEST(FileUv, PiecesWithRoomBetweenStayOneChart) {
    const Unwrap charts = chartsOf(twoHalves(0.03f));
    ASSERT_EQ(charts.charts.size(), 1u);
    EXPECT_NEAR(charts.charts[0].width, 13 + 2, 1);
    EXPECT_EQ(chartsOf(twoHalves(0.005f)).charts.size(), 2u);
}

// 1 m is 10 texels, and a square 0.1 of the unwrap. With less than two texels between them, whose two edges filtering
// reads at both, one would show the other's light.
TEST(FileUv, PiecesTooCloseToFilterGetChartsOfTheirOwn) {
    for (const float gap_texels : {0.0f, 0.1f, 0.5f, 1.0f, 1.5f}) {
        const Unwrap charts = chartsOf(twoSquares({0, 0}, {0.1f + 0.01f * gap_texels, 0}));
        EXPECT_EQ(charts.charts.size(), 2u) << gap_texels;
    }
}

std::vector<std::array<glm::vec2, 3>> squareAt(glm::vec2 low, float side) {
    const glm::vec2 b = low + glm::vec2(side, 0), c = low + side, d = low + glm::vec2(0, side);
    return {{low, b, c}, {low, c, d}};
}

TEST(FileUv, FewTexelsInTouchAreNoBleeding) {
    const auto large = squareAt({1, 1}, 40);
    EXPECT_FALSE(piecesBleed({large}, {64, 64}));
    EXPECT_FALSE(piecesBleed({large, squareAt({43.5f, 1}, 10)}, {64, 64}));
    EXPECT_TRUE(piecesBleed({large, squareAt({41.5f, 1}, 10)}, {64, 64}));
    EXPECT_FALSE(piecesBleed({large, squareAt({41.5f, 41.5f}, 10)}, {64, 64})) << "at a corner";
    EXPECT_FALSE(piecesBleed({large, squareAt({41.00001f + 1, 1}, 0.00001f)}, {64, 64})) << "too small to have a texel";
    EXPECT_TRUE(piecesBleed({squareAt({1, 1}, 4), squareAt({5, 5}, 4)}, {16, 16})) << "one is a quarter of a few";
    EXPECT_TRUE(piecesBleed({large, large}, {64, 64}));
}

std::string faultOf(glm::vec2 first, glm::vec2 second, glm::vec2 scale, glm::vec2 shift = {}) {
    Scene scene = twoSquares(first, second);
    for (glm::vec2& uv : scene.meshes[0].uv1) uv = scale * uv + shift;
    dropInvalidUnwraps(scene, 1);
    for (const glm::vec2 uv : scene.meshes[0].uv1) EXPECT_EQ(uv, glm::clamp(uv, 0.0f, 1.0f));
    EXPECT_EQ(scene.meshes[0].uv1.empty(), !scene.meshes[0].uv1_fault.empty());
    return scene.meshes[0].uv1_fault;
}

// Of an atlas a mesh may take one texel in thousands, however long: overlaps were looked for all over it, and not
// found.
TEST(FileUv, OverlapsAreFoundHoweverSmallTheUnwrap) {
    for (const glm::vec2 scale : {glm::vec2(1), {0.01f, 0.01f}, {1, 0.01f}, {0.01f, 1}}) {
        EXPECT_EQ(faultOf({0, 0}, {0.05f, 0.05f}, scale), "they overlap") << scale.x << " " << scale.y;
        EXPECT_EQ(faultOf({0, 0}, {0.1f, 0}, scale), "");
    }
    EXPECT_EQ(faultOf({0, 0}, {0.1f, 0}, {1, 1e-4f}), "they span next to nothing");
    EXPECT_EQ(faultOf({0, 0}, {0, 0.1f}, {1e-4f, 1}), "they span next to nothing");
}

// A floor of 2 x 2 m for each, a square of the unwrap: `along` metres by 2, and beside it 2 by `along`.
Scene twoWays(float along) {
    Scene scene;
    SceneMesh& mesh = addQuad(scene, "floor", {0, 0, 0}, {0, 0, 1}, {1, 0, 0}, 0);
    scene.materials.push_back(lambert(0.5f));
    mesh.positions_m = {{0, 0, 0}, {0, 0, 2}, {along, 0, 2}, {along, 0, 0}};
    mesh.uv1 = {{0, 0}, {0, 0.4f}, {0.4f, 0.4f}, {0.4f, 0}};
    for (int i = 0; i < 4; ++i) {
        const glm::vec3 p = mesh.positions_m[static_cast<size_t>(i)];
        mesh.positions_m.push_back({p.z, 1, p.x});
        mesh.normals.push_back({0, 1, 0});
    }
    mesh.uv1.insert(mesh.uv1.end(), {{0.5f, 0}, {0.9f, 0}, {0.9f, 0.4f}, {0.5f, 0.4f}});
    mesh.triangles.insert(mesh.triangles.end(), {{4, 6, 5}, {4, 7, 6}});
    mesh.triangle_materials.insert(mesh.triangle_materials.end(), 2, 0);
    return scene;
}

// Squares of the unwrap on rectangles that lie both ways: texels as long as they are wide, 2.4 and 3 times.
TEST(FileUv, WhatIsStretchedIsNotTaken) {
    for (const float along_m : {2.0f, 4.8f, 6.0f}) {
        Scene scene = twoWays(along_m);
        dropInvalidUnwraps(scene, 2);
        EXPECT_EQ(scene.meshes[0].uv1_fault, along_m < 6 ? "" : "they are stretched, up to 3 : 1");
    }
    // Sheared along, it is not the sides' ratio that counts.
    for (const float half_m : {1.0f, 3.0f}) {
        Scene scene;
        SceneMesh& sheared = addQuad(scene, "floor", {0, 0, 0}, {0, 0, 1}, {1, 0, 0}, 0);
        scene.materials.push_back(lambert(0.5f));
        sheared.positions_m = {
            {-1 - 3 * half_m, 0, -1}, {-1 + 3 * half_m, 0, 1}, {1 + 3 * half_m, 0, 1}, {1 - 3 * half_m, 0, -1}};
        sheared.uv1 = {{0, 0}, {0, 1}, {1, 1}, {1, 0}};
        dropInvalidUnwraps(scene, 10);
        EXPECT_TRUE(sheared.uv1_fault.starts_with("they are stretched")) << half_m;
    }
}

// What is narrower than a texel was given one by whoever made the unwrap, the cook itself among them.
TEST(FileUv, WhatIsNarrowMayBeWidened) {
    for (const auto& [texels_per_metre, taken] : {std::pair{0.4f, true}, {0.49f, true}, {0.6f, false}}) {
        Scene scene = twoWays(10);  // 2 m wide, and five times as long
        dropInvalidUnwraps(scene, texels_per_metre);
        EXPECT_EQ(scene.meshes[0].uv1_fault.empty(), taken) << texels_per_metre;
    }
    // Its length is that of its texels, not the mean of both: 10 m at 0.4 a metre, by one.
    Scene scene = twoWays(10);
    const RayScene rays(scene);
    const auto charts = unwrap(rays, {.texels_per_metre = 0.4f, .page_size = 64});
    ASSERT_TRUE(charts.has_value());
    for (const Chart& chart : charts->charts) EXPECT_NEAR(chart.width, 4 + 2, 1) << "both squares of the unwrap";
}

// An unwrap over a page of 4 x 1: a square metre is a quarter as wide as high.
TEST(FileUv, PagesThatAreNoSquaresAreMadeSquare) {
    for (const glm::vec2 page : {glm::vec2(0.25f, 1), {1, 0.25f}}) {
        Scene scene = twoSquares({0, 0}, {0.2f, 0});
        for (glm::vec2& uv : scene.meshes[0].uv1) uv *= page;
        dropInvalidUnwraps(scene, 4);
        const SceneMesh& mesh = scene.meshes[0];
        EXPECT_EQ(mesh.uv1_fault, "");
        for (const glm::uvec3 t : mesh.triangles) {
            const float a = glm::distance(mesh.uv1[t.x], mesh.uv1[t.y]),
                        b = glm::distance(mesh.uv1[t.y], mesh.uv1[t.z]);
            EXPECT_NEAR(a / b,
                        glm::distance(mesh.positions_m[t.x], mesh.positions_m[t.y]) /
                            glm::distance(mesh.positions_m[t.y], mesh.positions_m[t.z]),
                        1e-4f);
        }
    }
}

TEST(FileUv, RoundingBeyondThePageIsNone) {
    const glm::vec2 low(0, 0), high(0.9f, 0.9f);
    EXPECT_EQ(faultOf(low, high, glm::vec2(1), glm::vec2(-1e-9f)), "");
    EXPECT_EQ(faultOf(low, high, glm::vec2(1), glm::vec2(2e-7f)), "");
    EXPECT_EQ(faultOf(low, high, glm::vec2(1), glm::vec2(-1e-4f)), "they leave 0..1");
    EXPECT_EQ(faultOf(low, high, glm::vec2(1), glm::vec2(1e-4f)), "they leave 0..1");
    EXPECT_EQ(faultOf(low, high, glm::vec2(std::nanf(""))), "they leave 0..1");
}

// Islands may touch in the unwrap: one piece is what shares a corner there and in space.
TEST(FileUv, PiecesShareNoCorner) {
    Scene scene = twoSquares({0, 0}, {0.1f, 0.1f});  // at one corner they meet
    SceneMesh& mesh = scene.meshes[0];
    using Pieces = std::vector<std::vector<uint32_t>>;
    EXPECT_EQ(unwrapPieces(mesh, std::vector<uint32_t>{0, 1, 2, 3}), (Pieces{{0, 1}, {2, 3}}));
    const glm::vec3 to_first = mesh.positions_m[2] - mesh.positions_m[4];
    for (size_t i = 4; i < 8; ++i) mesh.positions_m[i] += to_first;
    EXPECT_EQ(unwrapPieces(mesh, std::vector<uint32_t>{0, 1, 2, 3}), (Pieces{{0, 1, 2, 3}}));
    const Scene apart = twoSquares({0, 0}, {0.5f, 0.1f});
    EXPECT_EQ(unwrapPieces(apart.meshes[0], std::vector<uint32_t>{0, 2, 1, 3}), (Pieces{{0, 2}, {1, 3}}));
    EXPECT_TRUE(unwrapPieces(mesh, {}).empty());
}

}  // namespace
}  // namespace dimmer::cook::test
