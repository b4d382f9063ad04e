// What walls do to meshes that bring an unwrap of their own.
#include <charts/two_rooms.h>
#include <charts/wall_cuts.h>

#include <glm/gtc/matrix_transform.hpp>

namespace dimmer::cook::test {
namespace {

// UVs that are no unwrap are as good as none, and said to be none.
TEST(WallCuts, MeshesWithUnusableUvsAreCutToo) {
    Scene scene = twoRooms();
    for (SceneMesh& mesh : scene.meshes) mesh.uv1 = {{0, 0}, {1, 0}, {1, 1}, {1, 0}};  // one triangle on the other
    cutAtWalls(scene, 4);
    const RayScene rays(scene);
    const auto charts = unwrap(rays, {.texels_per_metre = 4, .page_size = 256});
    ASSERT_TRUE(charts.has_value());
    expectRoomsApart(rays, *charts);
    ASSERT_EQ(charts->warnings.size(), scene.meshes.size());
    for (uint32_t m = 0; m < scene.meshes.size(); ++m) {
        EXPECT_EQ(charts->warnings[m].mesh, m);
        EXPECT_EQ(charts->warnings[m].text, "TEXCOORD_1 is no lightmap unwrap (they overlap); charts were made");
    }
}

// A level as the cooker writes it is cut already, but for a rounding step: it was said to let light past its walls.
TEST(WallCuts, AnUnwrapThatIsPartedAtWallsIsNotWarnedOf) {
    Scene scene = twoRooms();
    const glm::mat3 turned(glm::rotate(glm::mat4(1), glm::radians(20.0f), {0, 1, 0}));
    for (SceneMesh& mesh : scene.meshes) {
        for (glm::vec3& p : mesh.positions_m) p = turned * p;
        for (glm::vec3& n : mesh.normals) n = turned * n;
    }
    cutAtWalls(scene, 4);
    size_t parted = 0;
    for (SceneMesh& mesh : scene.meshes) {
        if (mesh.triangle_regions.empty() || std::abs(mesh.normals[0].y) < 0.9f) continue;
        ++parted;
        mesh.uv1.resize(mesh.positions_m.size());
        for (size_t t = 0; t < mesh.triangles.size(); ++t)
            for (int i = 0; i < 3; ++i) {
                const glm::vec3 p = mesh.positions_m[mesh.triangles[t][i]];
                const float beside = mesh.triangle_regions[t] == mesh.triangle_regions[0] ? 0 : 0.5f;
                mesh.uv1[mesh.triangles[t][i]] = {0.05f * (p.x + 5) * 0.9f + beside, 0.1f * (p.z + 5)};
            }
        mesh.triangle_regions.clear();
    }
    ASSERT_EQ(parted, 2u);
    cutAtWalls(scene, 4);
    for (const SceneMesh& mesh : scene.meshes) EXPECT_FALSE(mesh.uv1_crosses_walls) << mesh.node;
}

// What brings an unwrap of its own stays whole, and keeps nothing beside it whole.
TEST(WallCuts, AnUnwrappedNeighbourIsLeftOut) {
    Scene scene = twoRooms();
    const size_t floor = 3;  // its upper side, which goes on in a strip of 8 x 1 m
    addQuad(scene, "strip", {0, 0, 2}, {0, 0, 0.5f}, {4, 0, 0}, 0).uv1 = {{0, 0}, {0.125f, 0}, {0.125f, 1}, {0, 1}};
    cutAtWalls(scene, 4);
    EXPECT_GT(scene.meshes[floor].triangles.size(), 2u);
    EXPECT_EQ(scene.meshes.back().triangles.size(), 2u);
    EXPECT_EQ(scene.meshes.back().uv1.size(), 4u);
    EXPECT_FALSE(scene.meshes.back().uv1_crosses_walls);
}

// What brings an unwrap stays whole, and where a wall stands on its triangles that is said.
TEST(WallCuts, AnUnwrapUnderAWallIsSaid) {
    for (const float z : {0.0f, 20.0f}) {
        Scene scene = twoRooms();
        addQuad(scene, "carpet", {0, 0.002f, z}, {0, 0, 1.4f}, {3, 0, 0}, 0).uv1 = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
        cutAtWalls(scene, 4);
        EXPECT_EQ(scene.meshes.back().triangles.size(), 2u);
        const RayScene rays(scene);
        const auto charts = unwrap(rays, {.texels_per_metre = 4, .page_size = 256});
        ASSERT_TRUE(charts.has_value());
        ASSERT_EQ(charts->warnings.size(), z == 0 ? 1u : 0u);
        if (z > 0) continue;
        EXPECT_EQ(scene.meshes[charts->warnings[0].mesh].node, "carpet");
        EXPECT_NE(charts->warnings[0].text.find("thin walls stand on it"), std::string::npos);
    }
}

}  // namespace
}  // namespace dimmer::cook::test
