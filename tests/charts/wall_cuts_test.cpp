// Where walls cut what they stand on.
#include <bake/test_scenes.h>
#include <charts/texels.h>
#include <charts/unwrap.h>
#include <charts/wall_cuts.h>
#include <gtest/gtest.h>

namespace dimmer::cook::test {
namespace {

// A floor and a ceiling that run on, from one room of 4 x 3 m into another, under a wall of 0.2 m around x = 0 with a
// doorway of 0.9 m: two stretches of wall of 1.05 m each, and 0.65 m of lintel between.
constexpr float half_wall_m = 0.1f;
Scene twoRooms() {
    Scene scene;
    const uint32_t white = addMaterial(scene, lambert(0.5f));
    addSolid(scene, "floor", {0, -0.1f, 0}, {4, 0.1f, 1.5f}, white);
    addSolid(scene, "ceiling", {0, 2.8f, 0}, {4, 0.1f, 1.5f}, white);
    addSolid(scene, "wall", {0, 1.35f, -0.975f}, {half_wall_m, 1.35f, 0.525f}, white);
    addSolid(scene, "wall", {0, 1.35f, 0.975f}, {half_wall_m, 1.35f, 0.525f}, white);
    addSolid(scene, "lintel", {0, 2.375f, 0}, {half_wall_m, 0.325f, 0.45f}, white);
    return scene;
}

// A texel of both rooms would carry light of the one into the other, and so would a page that filters between two.
void expectRoomsApart(const RayScene& rays, const Unwrap& charts) {
    const Texels texels = sampleTexels(rays, charts, 4);
    struct Sides {
        bool left = false, right = false;
    };
    std::vector<Sides> sides(charts.charts.size());
    size_t points = 0;
    for (size_t i = 0; i < texels.size(); ++i)
        for (uint32_t s = 0; s < texels.sampleCount(i); ++s) {
            const glm::vec3 p = texels.sample(i, s).position_m;
            const uint32_t face = texels.sample(i, s).face;
            const bool in_rooms = p.y > -0.05f && p.y < 2.75f && std::abs(p.x) > half_wall_m;
            if (!in_rooms || std::abs(charts.frames[face].normal.y) < 0.9f) continue;
            ++points;
            Sides& of_chart = sides[charts.face_chart[face]];
            (p.x < 0 ? of_chart.left : of_chart.right) = true;
        }
    EXPECT_GT(points, 40u);  // 48 m2, four points a texel
    for (const Sides& s : sides) EXPECT_FALSE(s.left && s.right);
}

// At few texels per metre no stretch of wall between doorways is long: it is the whole wall that counts.
TEST(WallCuts, RoomsWithADoorwayShareNoChartAtAnyDensity) {
    for (const float density : {1.0f, 2.0f, 4.0f, 8.0f}) {
        SCOPED_TRACE(density);
        Scene scene = twoRooms();
        cutAtWalls(scene, density);
        const RayScene rays(scene);
        const auto charts = unwrap(rays, {.texels_per_metre = density, .page_size = 256});
        ASSERT_TRUE(charts.has_value());
        expectRoomsApart(rays, *charts);
    }
}

// UVs that are no unwrap are as good as none, and said to be none.
TEST(WallCuts, MeshesWithUnusableUvsAreCutToo) {
    Scene scene = twoRooms();
    scene.file = "rooms.glb";
    for (SceneMesh& mesh : scene.meshes) mesh.uv1 = {{0, 0}, {1, 0}, {1, 1}, {1, 0}};  // one triangle on the other
    cutAtWalls(scene, 4);
    const RayScene rays(scene);
    const auto charts = unwrap(rays, {.texels_per_metre = 4, .page_size = 256});
    ASSERT_TRUE(charts.has_value());
    expectRoomsApart(rays, *charts);
    ASSERT_EQ(charts->warnings.size(), scene.meshes.size());
    EXPECT_EQ(charts->warnings[0],
              "rooms.glb: node 'floor': TEXCOORD_1 is no lightmap unwrap (they overlap); charts were made");
}

// What brings an unwrap of its own stays whole, and keeps nothing beside it whole.
TEST(WallCuts, AnUnwrappedNeighbourIsLeftOut) {
    Scene scene = twoRooms();
    const size_t floor = 3;  // its upper side, which goes on in a strip of 8 x 1 m
    addQuad(scene, "strip", {0, 0, 2}, {0, 0, 0.5f}, {4, 0, 0}, 0).uv1 = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
    cutAtWalls(scene, 4);
    EXPECT_GT(scene.meshes[floor].triangles.size(), 2u);
    EXPECT_EQ(scene.meshes.back().triangles.size(), 2u);
    EXPECT_EQ(scene.meshes.back().uv1.size(), 4u);
}

// Nobody is parted by pillars that one walks between.
TEST(WallCuts, ARowOfPillarsIsNoWall) {
    for (const float density : {1.0f, 2.0f, 4.0f, 8.0f}) {
        Scene scene;
        const uint32_t white = addMaterial(scene, lambert(0.5f));
        addSolid(scene, "floor", {0, -0.1f, 0}, {4, 0.1f, 5}, white);
        for (int i = 0; i < 6; ++i)  // 0.3 m each, 1.7 m between them
            addSolid(scene, "pillar", {0, 1.35f, -5 + 2 * static_cast<float>(i)}, {0.1f, 1.35f, 0.15f}, white);
        const size_t before = scene.meshes[3].triangles.size();  // the floor's upper side
        cutAtWalls(scene, density);
        EXPECT_EQ(scene.meshes[3].triangles.size(), before) << density;
    }
}

}  // namespace
}  // namespace dimmer::cook::test
