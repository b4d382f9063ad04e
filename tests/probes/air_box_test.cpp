// Where there may be air that somebody moves through.
#include <bake/baked_scene.h>
#include <bake/test_scenes.h>
#include <gtest/gtest.h>
#include <probes/air_box.h>
#include <probes/free_space.h>

#include <glm/gtc/matrix_transform.hpp>

namespace dimmer::cook::test {
namespace {

constexpr float eye_level_m = 1.7f;

Scene lawn() {
    Scene scene;
    addQuad(scene, "lawn", {0, 0, 0}, {0, 0, 15}, {15, 0, 0}, addMaterial(scene, lambert(0.5f)));
    scene.sky_radiance_cd_m2 = glm::vec3(1000);
    return scene;
}

void expectBounds(const Scene& scene) {
    const RayScene rays(scene);
    const Box box = airBox(rays);
    EXPECT_EQ(box.min_m, rays.boundsMin());
    EXPECT_EQ(box.max_m, rays.boundsMax());
}

// A plane has no volume, and a kerb hardly any: there was no grid, or none at eye level.
TEST(AirBox, OverOpenGroundThereIsRoomToStand) {
    for (const bool kerb : {false, true}) {
        Scene scene = lawn();
        if (kerb) addSolid(scene, "kerb", {0, 0.15f, 14.8f}, {15, 0.15f, 0.2f}, 0);
        const RayScene rays(scene);
        EXPECT_GT(airBox(rays).max_m.y, eye_level_m + 0.5f);
        EXPECT_LT(airBox(rays).max_m.y, 4);
        EXPECT_GT(openPlaces(rays, 50, 1).size(), 40u);
    }
}

// A roof is no ground, nor is what a building's walls end at.
TEST(AirBox, ABuildingIsNoHigher) {
    Scene scene;
    const uint32_t white = addMaterial(scene, lambert(0.5f));
    addBox(scene, {3, 1.5f, 3}, white);
    addSolid(scene, "shell", {0, 0, 0}, {3.2f, 1.7f, 3.2f}, white);
    expectBounds(scene);
    // On a lawn, which leaves room beside it.
    addQuad(scene, "lawn", {0, -1.71f, 0}, {0, 0, 15}, {15, 0, 0}, white);
    expectBounds(scene);
}

TEST(AirBox, HoldsPlayAreasAndWhatMoves) {
    Scene scene = lawn();
    const glm::mat4 world_from_box = glm::scale(glm::translate(glm::mat4(1), glm::vec3(2, 3, 0)), glm::vec3(1, 3, 20));
    scene.play_areas.push_back({glm::inverse(world_from_box)});
    scene.dynamic_places.emplace_back().world_from_node[3] = {-17, 1, 0, 1};
    addQuad(scene, "kite", {0, 9, 0}, {0, 0, 1}, {1, 0, 0}, 0).lighting = Lighting::Dynamic;
    const Box box = airBox(RayScene(scene));
    EXPECT_NEAR(box.max_m.z, 20, 1e-3);
    EXPECT_NEAR(box.min_m.z, -20, 1e-3);
    EXPECT_NEAR(box.min_m.x, -17, 1e-3);
    EXPECT_NEAR(box.max_m.x, 15, 1e-3);
    EXPECT_NEAR(box.max_m.y, 9, 1e-3);
    // A play area as large as a county is a mistake in a unit, and would leave the level no probe.
    scene.play_areas.push_back({glm::scale(glm::mat4(1), glm::vec3(1e-5f))});
    EXPECT_LE(airBox(RayScene(scene)).max_m.x, 15 + 30 + 1e-3f);
}

// The floor of errors in the dark followed the brightest places: around a lamp whose direct light is baked they are
// thousands of times as bright as its hall, of which placement then asked nothing: 186 probes of 2,390.
TEST(AirBox, ALampBakedInFullTakesNoProbesFromItsHall) {
    size_t probes[2];
    for (const BakeMode mode : {BakeMode::Indirect, BakeMode::Full}) {
        Scene scene;
        addBox(scene, {6, 2, 6}, addMaterial(scene, lambert(0.5f)));
        addPointLight(scene, {1, 1, 2}, 1000, mode);
        BakedScene level(scene, 1);
        BakeSettings settings;
        settings.final_rays = 64;
        settings.grid.probes_max = 400;
        level.bake(settings);
        probes[mode == BakeMode::Full] = level.baked.grid.light.rows();
    }
    EXPECT_GT(probes[1], probes[0] / 2);
}

TEST(AirBox, WithoutAnyAirNoGridIsMadeAndTheBakeSaysSo) {
    Scene scene;
    addQuad(scene, "wall", {0, 0, 0}, {0, 1, 0}, {1, 0, 0}, addMaterial(scene, lambert(0.5f)));
    BakedScene level(scene);
    BakeSettings settings;
    settings.grid.probes_max = 60;
    level.bake(settings);
    EXPECT_EQ(level.baked.grid.light.rows(), 0u);
    ASSERT_EQ(level.baked.warnings.size(), 1u);
    EXPECT_TRUE(level.baked.warnings[0].starts_with("no global grid: no place in the level's box"))
        << level.baked.warnings[0];
}

}  // namespace
}  // namespace dimmer::cook::test
