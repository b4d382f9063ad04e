// The meshes that a pack hands to an engine: sides, winding, UVs.
#include <charts/unwrap.h>
#include <gmock/gmock.h>
#include <pipeline/level_meshes.h>
#include <pipeline/small_level.h>

#include <algorithm>

namespace dimmer::cook::test {
namespace {

glm::vec3 vec(const std::array<float, 3>& a) {
    return {a[0], a[1], a[2]};
}

struct Result {
    Unwrap charts;
    std::vector<Mesh> meshes;
};

Result build(const LevelFile& level, uint32_t page_size = 128) {
    const auto scene = level.import();
    EXPECT_TRUE(scene) << scene.error().message;
    const RayScene rays(*scene);
    auto charts = unwrap(rays, {.texels_per_metre = 4, .page_size = page_size});
    EXPECT_TRUE(charts) << charts.error().message;
    Result result{std::move(*charts), {}};
    result.meshes = levelMeshes(rays, result.charts);
    return result;
}

struct LitCorner {
    glm::vec3 position_m, normal;
    glm::vec2 uv;
};

// Calls visit(mesh, corners) for every triangle.
template <class Visit>
void forTriangles(const std::vector<Mesh>& meshes, Visit&& visit) {
    for (const Mesh& mesh : meshes)
        for (size_t i = 0; i + 2 < mesh.indices.size(); i += 3) {
            std::array<LitCorner, 3> corners;
            for (size_t k = 0; k < 3; ++k) {
                const MeshVertex& v = mesh.vertices[mesh.indices[i + k]];
                corners[k] = {vec(v.position_m), vec(v.normal), {v.lightmap_uv[0], v.lightmap_uv[1]}};
            }
            visit(mesh, corners);
        }
}

double area(const std::array<LitCorner, 3>& c) {
    return 0.5 * static_cast<double>(
                     glm::length(glm::cross(c[1].position_m - c[0].position_m, c[2].position_m - c[0].position_m)));
}

double totalArea(const std::vector<Mesh>& meshes) {
    double sum = 0;
    forTriangles(meshes, [&](const Mesh&, const auto& corners) { sum += area(corners); });
    return sum;
}

// Rooms, a double-sided screen and a mirrored copy, on small pages.
LevelFile mixedLevel() {
    LevelFile level = twoCells();
    const int screen = level.addSquareMesh(addWhite(level, {{"doubleSided", true}}));
    level.addNode({{"name", "screen"}, {"mesh", screen}, {"translation", {1, 1, 1}}});
    const int square = level.addSquareMesh(addWhite(level));
    level.addNode({{"name", "mirrored"}, {"mesh", square}, {"translation", {4, 0, 0}}, {"scale", {-1, 2, 1}}});
    return level;
}

TEST(LevelMeshes, WindingAgreesWithNormals) {
    const auto result = build(mixedLevel(), 32);
    EXPECT_GT(result.charts.page_count, 1u);  // small pages: a mesh may be parted among them
    size_t triangles = 0;
    forTriangles(result.meshes, [&](const Mesh& mesh, const auto& c) {
        const glm::vec3 front = glm::cross(c[1].position_m - c[0].position_m, c[2].position_m - c[0].position_m);
        for (const LitCorner& corner : c) {
            // The level is flat-shaded: both normals are the same line, within rounding of unit vectors.
            EXPECT_GT(glm::dot(glm::normalize(front), corner.normal), 0.9999f) << mesh.node;
        }
        ++triangles;
    });
    EXPECT_GT(triangles, 20u);
}

TEST(LevelMeshes, NoSurfaceIsLostOrDoubled) {
    const auto result = build(mixedLevel());
    // Two rooms of six walls of 2 x 2 m, a screen of 1 m2 with two sides, a square of 1 x 2 m.
    EXPECT_NEAR(totalArea(result.meshes), 2 * 6 * 4 + 2 + 2, 1e-3);
}

TEST(LevelMeshes, UvsLieInsideOneChartWithoutItsPadding) {
    const auto result = build(mixedLevel());
    const glm::vec2 size(result.charts.page_width, result.charts.page_height);
    forTriangles(result.meshes, [&](const Mesh& mesh, const auto& c) {
        ASSERT_LT(mesh.page, result.charts.page_count);
        const bool inside = std::ranges::any_of(result.charts.charts, [&](const Chart& chart) {
            // A thousandth of a texel for the rounding of UVs.
            const glm::vec2 low = glm::vec2(chart.x + 1, chart.y + 1) - 0.001f;
            const glm::vec2 high = glm::vec2(chart.x + chart.width - 1, chart.y + chart.height - 1) + 0.001f;
            return chart.page == mesh.page && std::ranges::all_of(c, [&](const LitCorner& corner) {
                       const glm::vec2 texel = corner.uv * size;
                       return texel.x >= low.x && texel.y >= low.y && texel.x <= high.x && texel.y <= high.y;
                   });
        });
        EXPECT_TRUE(inside) << mesh.node;
    });
}

TEST(LevelMeshes, ADoubleSidedSurfaceHasTwoSides) {
    LevelFile level;
    level.addNode({{"name", "screen"}, {"mesh", level.addSquareMesh(addWhite(level, {{"doubleSided", true}}))}});
    const auto result = build(level);
    std::vector<LitCorner> front, back;
    forTriangles(result.meshes, [&](const Mesh& mesh, const auto& c) {
        EXPECT_EQ(mesh.node, "screen");
        auto& side = c[0].normal.z > 0 ? front : back;
        side.insert(side.end(), c.begin(), c.end());
    });
    ASSERT_EQ(front.size(), 6u);
    ASSERT_EQ(back.size(), 6u);
    for (const LitCorner& f : front) {
        EXPECT_EQ(f.normal, glm::vec3(0, 0, 1));
        const auto twin = std::ranges::find(back, f.position_m, &LitCorner::position_m);
        ASSERT_NE(twin, back.end());
        EXPECT_EQ(twin->normal, glm::vec3(0, 0, -1));
        EXPECT_NE(twin->uv, f.uv);  // a lightmap of its own
    }
}

TEST(LevelMeshes, ColourEmissionAndElements) {
    LevelFile level;
    const int glow =
        addWhite(level, {{"emissiveFactor", {1, 0.5, 0}},
                         {"extensions", {{"KHR_materials_emissive_strength", {{"emissiveStrength", 40}}}}}});
    const int plain =
        level.addMaterial({{"pbrMetallicRoughness", {{"baseColorFactor", {0.2, 0.5, 0.8, 1}}, {"metallicFactor", 0}}}});
    level.addNode(
        {{"name", "panel"}, {"mesh", level.addSquareMesh(glow)}, {"extras", {{"dimmer_light_set", "panels"}}}});
    level.addNode({{"name", "leaf"},
                   {"mesh", level.addSquareMesh(plain)},
                   {"translation", {0, 0, -2}},
                   {"extras", {{"dimmer_door", "front"}}}});
    const auto result = build(level);
    ASSERT_EQ(result.meshes.size(), 2u);
    const Mesh &panel = result.meshes[0], &leaf = result.meshes[1];
    EXPECT_EQ(panel.node, "panel");
    EXPECT_THAT(panel.emission_cd_m2, testing::ElementsAre(40, 20, 0));
    EXPECT_EQ(panel.emission_set, 0u);
    EXPECT_FALSE(panel.door);
    EXPECT_EQ(leaf.door, 1u);  // behind the one light set
    EXPECT_FALSE(leaf.emission_set);
    // docs/level.md: rho = c (1 - rs) + rs with rs = 0.04 + 0.96 / 21 for a dielectric.
    const float rs = 0.04f + 0.96f / 21;
    for (const auto& [i, c] : {std::pair{0u, 0.2f}, {1u, 0.5f}, {2u, 0.8f}})
        EXPECT_NEAR(leaf.reflectance[i], c * (1 - rs) + rs, 1e-5f);
}

TEST(LevelMeshes, EachHasTheColourOfItsOwnMaterial) {
    LevelFile level;
    std::vector<int> materials;
    for (const float grey : {0.2f, 0.8f})
        materials.push_back(level.addMaterial(
            {{"pbrMetallicRoughness", {{"baseColorFactor", {grey, grey, grey, 1}}, {"metallicFactor", 0}}}}));
    for (const int i : {0, 1, 0, 1})
        level.addNode({{"mesh", level.addSquareMesh(materials[static_cast<size_t>(i)])},
                       {"translation", {2 * static_cast<int>(level.document["nodes"].size()), 0, 0}}});
    const auto result = build(level);
    ASSERT_EQ(result.meshes.size(), 4u);
    const float rs = 0.04f + 0.96f / 21;  // as above
    for (size_t m = 0; m < 4; ++m)
        EXPECT_NEAR(result.meshes[m].reflectance[0], (m % 2 ? 0.8f : 0.2f) * (1 - rs) + rs, 1e-5f) << m;
}

// Vertices are shared within a chart: an engine should not upload six for a square.
TEST(LevelMeshes, VerticesAreShared) {
    LevelFile level;
    level.addNode({{"name", "square"}, {"mesh", level.addSquareMesh(addWhite(level))}});
    const auto result = build(level);
    ASSERT_EQ(result.meshes.size(), 1u);
    EXPECT_EQ(result.meshes[0].vertices.size(), 4u);
    EXPECT_EQ(result.meshes[0].indices.size(), 6u);
}

// Held against a level that it is not of, a pack is told to be of another one.
TEST(LevelMeshes, ThoseOfAnotherLevelAreTold) {
    LevelFile level = twoCells();
    const std::vector<Mesh> meshes = build(level).meshes;
    EXPECT_EQ(nodeThatDiffers(*level.import(), meshes), "");
    level.node(0)["translation"] = {0.1, 0, 0};
    EXPECT_EQ(nodeThatDiffers(*level.import(), meshes), level.node(0)["name"]);
    level = twoCells();
    level.node(0)["name"] = "renamed";
    EXPECT_EQ(nodeThatDiffers(*level.import(), meshes), twoCells().node(0)["name"]);
}

}  // namespace
}  // namespace dimmer::cook::test
