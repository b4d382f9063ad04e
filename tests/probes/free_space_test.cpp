// What counts as open air, where that is known by construction.
#include <bake/sampling.h>
#include <bake/test_scenes.h>
#include <gtest/gtest.h>
#include <probes/free_space.h>

namespace dimmer::cook::test {
namespace {

TEST(FreeSpace, InsideOfARoomAndOutsideOfWhatStandsThere) {
    Scene scene;
    const uint32_t grey = addMaterial(scene, lambert(0.5f));
    addBox(scene, {2, 2, 2}, grey);
    addSolid(scene, "pillar", {1, 0, 0}, {0.4f, 2, 0.4f}, grey);
    const RayScene rays(scene);
    EXPECT_TRUE(inTheOpen(rays, {0, 0, 0}));
    EXPECT_FALSE(inTheOpen(rays, {1, 0, 0}));  // in the pillar
    EXPECT_FALSE(inTheOpen(rays, {3, 0, 0}));  // outside: nothing but backs
    EXPECT_FALSE(inTheOpen(rays, {0, 9, 0}));
    EXPECT_FALSE(inTheOpen(rays, {-1.98f, 0, 0}));  // 2 cm from a wall
    EXPECT_TRUE(inTheOpen(rays, {-1.98f, 0, 0}, no_model, 0.01f));
}

// Steps of boxes side by side, the last against the walls: most of what a ray meets in one is the front of the next.
// And a block of cubes, which within shows nothing but fronts.
TEST(FreeSpace, NoPlaceWithinSolidsThatTouch) {
    Scene scene;
    const uint32_t grey = addMaterial(scene, lambert(0.5f));
    addBox(scene, {4, 2, 3}, grey);
    std::vector<glm::vec3> within;
    for (int i = 0; i < 8; ++i) {
        const float half = 0.1f * static_cast<float>(i + 1), x = 1.75f + 0.3f * static_cast<float>(i);
        addSolid(scene, "step", {x, half - 2, -2.5f}, {0.15f, half, 0.5f}, grey);
        within.push_back({x, half - 2, -2.5f});
    }
    for (int i = 0; i < 27; ++i) {
        const glm::vec3 centre(0.4 * (i % 3) - 3, 0.4 * (i / 3 % 3) - 1, 0.4 * (i / 9));
        addSolid(scene, "cube", centre, glm::vec3(0.2f), grey);
        within.push_back(centre);
    }
    const RayScene rays(scene);
    for (const glm::vec3& centre : within)
        for (uint32_t i = 0; i < 20; ++i)
            EXPECT_FALSE(inTheOpen(rays, centre + 0.2f * sequence3d(i, 3) - 0.1f)) << centre.x << ' ' << centre.y;
    EXPECT_TRUE(inTheOpen(rays, {0.5f, 0, -2.5f}));
}

// A lamp's pane in a niche whose back it touches: without the pane the niche is open to its back.
TEST(FreeSpace, AModelThatIsNotThereTouchesNothing) {
    Scene scene;
    const uint32_t grey = addMaterial(scene, lambert(0.5f));
    addBox(scene, {0.5f, 0.5f, 0.5f}, grey);
    addSolid(scene, "pane", {0, 0, 0.45f}, {0.5f, 0.5f, 0.05f}, grey);
    addSolid(scene, "rock", {0, 0, 0}, {3, 3, 3}, grey);  // that the niche is in
    for (size_t m = 6; m < 12; ++m) scene.meshes[m].model = 0;
    const RayScene rays(scene);
    EXPECT_FALSE(inTheOpen(rays, {0.1f, 0.1f, 0.44f}));
    EXPECT_TRUE(inTheOpen(rays, {0.1f, 0.1f, 0.44f}, 0));
}

// Rooms whose walls have no thickness, beside each other and in a hull that faces outwards; on ground, and where behind
// their outer walls is nothing.
TEST(FreeSpace, RoomsOfPaperAreOpen) {
    Scene scene;
    const uint32_t grey = addMaterial(scene, lambert(0.5f));
    addBox(scene, {2, 2, 2}, grey);
    const size_t room = scene.meshes.size();
    for (size_t i = 0; i < room; ++i) {
        SceneMesh beside = scene.meshes[i];
        for (glm::vec3& p : beside.positions_m) p.x += 4;
        scene.meshes.push_back(beside);
    }
    addSolid(scene, "hull", {2, 0, 0}, {4, 2, 2}, grey);
    const auto expectOpen = [&](std::initializer_list<float> places_x) {
        const RayScene rays(scene);
        for (const float x : places_x)
            for (uint32_t i = 0; i < 20; ++i)
                EXPECT_TRUE(inTheOpen(rays, glm::vec3(x, 0, 0) + 0.2f * sequence3d(i, 3) - 0.1f)) << x;
    };
    expectOpen({0, 4, 1.8f});
    addFloor(scene, 30, grey, -2.5f);
    expectOpen({0, 4, 1.8f, 10});
}

// Far outside most rays meet nothing, some the room's backs, and fewer the front of a screen that stands there. By 24
// rays alone 15 of these places would pass, as they happen to meet the screen and not the room.
TEST(FreeSpace, NoPlaceOutsidePassesByLuck) {
    Scene scene;
    const uint32_t grey = addMaterial(scene, lambert(0.5f));
    addBox(scene, {3, 3, 3}, grey);
    addQuad(scene, "screen", {0, -12, 0}, {0.4f, 0, 0}, {0, 0, -0.4f}, grey);
    const RayScene rays(scene);
    uint32_t open = 0, near_screen = 0;
    for (uint32_t i = 0; i < 4000; ++i) {
        const glm::vec3 u = sequence3d(i, 3);
        const glm::vec3 p = {12 * u.x - 6, -11 + 4 * u.y, 12 * u.z - 6};
        // Closer to the screen it is more of what is seen than the room: there nobody can tell.
        if (glm::distance(p, {0, -12, 0}) < 2.5f) {
            ++near_screen;
            continue;
        }
        open += inTheOpen(rays, p);
    }
    EXPECT_LT(near_screen, 1000u);
    EXPECT_EQ(open, 0u);
}

// The leaf's foot lies in the floor's plane: from below a ray meets either.
TEST(FreeSpace, ADoorsFootDoesNotOpenWhatLiesBelowTheFloor) {
    Scene scene;
    const uint32_t grey = addMaterial(scene, lambert(0.5f));
    addBox(scene, {3, 3, 3}, grey);
    scene.doors.push_back({.name = "gate"});
    addSolid(scene, "gate", {0, -1, 0}, {2.8f, 2, 2.8f}, grey, 0);
    const RayScene rays(scene);
    for (uint32_t i = 0; i < 1000; ++i) {
        const glm::vec3 u = sequence3d(i, 5);
        EXPECT_FALSE(inTheOpen(rays, {4 * u.x - 2, -3.1f - u.y, 4 * u.z - 2})) << i;
    }
    EXPECT_FALSE(inTheOpen(rays, {0, -1, 0}));  // in the closed leaf
    EXPECT_TRUE(inTheOpen(rays, {0, 2, 0}));    // above it
}

// In the middle of a cube the nearest wall is 5 m off; 24 rays meet it within 5 / cos(25 degrees), as one of them
// is that near to an axis.
TEST(FreeSpace, FarFromSurfacesPlacesAreChosenAsOftenAsTheyAreNear) {
    Scene scene;
    addBox(scene, {5, 5, 5}, addMaterial(scene, lambert(0.5f)));
    const RayScene rays(scene);
    constexpr float near_m = 1;
    EXPECT_TRUE(chosenInTheOpen(rays, {0, 0, 0}, near_m, 0.17f));
    EXPECT_FALSE(chosenInTheOpen(rays, {0, 0, 0}, near_m, 0.21f));
    EXPECT_TRUE(chosenInTheOpen(rays, {4.5f, 0, 0}, near_m, 0.99f));
    EXPECT_FALSE(chosenInTheOpen(rays, {6, 0, 0}, near_m, 0));      // outside
    EXPECT_FALSE(chosenInTheOpen(rays, {4.98f, 0, 0}, near_m, 0));  // 2 cm from a wall
}

}  // namespace
}  // namespace dimmer::cook::test
