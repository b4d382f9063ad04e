// The grid of lights: it leaves out work, and of light next to nothing.
#include <bake/baked_scene.h>
#include <bake/direct.h>
#include <bake/light_grid.h>
#include <bake/reached_cells.h>
#include <bake/test_scenes.h>
#include <models/model_scenes.h>
#include <tbb/global_control.h>

#include <limits>
#include <map>
#include <random>
#include <set>
#include <string>

namespace dimmer::cook::test {
namespace {

// A row of closed rooms along x, 8 m apart and 6 x 4 x 6 m each, with one lamp in every one.
Scene rooms(int count) {
    Scene scene;
    const uint32_t white = addMaterial(scene, lambert(0.5f));
    for (int r = 0; r < count; ++r) {
        const size_t first = scene.meshes.size();
        addBox(scene, {3, 2, 3}, white);
        for (size_t m = first; m < scene.meshes.size(); ++m)
            for (glm::vec3& p : scene.meshes[m].positions_m) p.x += 8.0f * static_cast<float>(r);
        const float x = 8.0f * static_cast<float>(r);
        addPointLight(scene, {x + 0.5f, 0.5f, -0.7f}, 60, BakeMode::Indirect);
    }
    return scene;
}

std::set<uint32_t> listedAt(const LightGrid& grid, glm::vec3 point) {
    const auto list = grid.listed(point);
    return {list.begin(), list.end()};
}

TEST(LightGrid, ListsTheLampsOfTheRoomAlone) {
    const Scene scene = rooms(12);
    const RayScene rays(scene);
    const LightGrid grid(rays);
    for (uint32_t r = 0; r < 12; ++r) {
        const float x = 8.0f * static_cast<float>(r);
        // Walls, corners, and the air between; a room away nothing is left, whatever the cells' width of 2 m.
        for (const glm::vec3 p : {glm::vec3(2.99f, -1.99f, 2.99f), glm::vec3(-2.99f, 1.99f, -2.99f), glm::vec3(0)})
            EXPECT_EQ(listedAt(grid, p + glm::vec3(x, 0, 0)), std::set<uint32_t>{r});
    }
}

// Cells that grew with the level listed lamps of five rooms here.
TEST(LightGrid, WhatStandsFarAwayWidensNoCell) {
    Scene scene = rooms(6);
    addQuad(scene, "far away", {2000, 0, 0}, {0, 1, 0}, {0, 0, 1}, 0);
    const RayScene rays(scene);
    const LightGrid grid(rays);
    for (uint32_t r = 0; r < 6; ++r)
        for (const glm::vec3 p : {glm::vec3(2.99f, -1.99f, 2.99f), glm::vec3(-2.99f, 1.99f, -2.99f), glm::vec3(0)})
            EXPECT_EQ(listedAt(grid, p + glm::vec3(8.0f * static_cast<float>(r), 0, 0)), std::set<uint32_t>{r});
}

// A plain of 10 km, and lamps that see all of it, or as far as their range goes: nothing is missed, and no list is
// long.
TEST(LightGrid, LargeLevelsTakeNoMoreCellsForALamp) {
    Scene scene;
    addFloor(scene, 5000, addMaterial(scene, lambert(0.5f)));
    addQuad(scene, "mast", {0, 200, 0}, {0, 200, 0}, {0, 0, 0.01f}, 0);
    addPointLight(scene, {-4000, 300, 30}, 1e6f, BakeMode::Indirect);
    addPointLight(scene, {-4000, 50, 30}, 100, BakeMode::Indirect).range_m = 150.0f;
    const RayScene rays(scene);
    const LightGrid grid(rays);
    EXPECT_LE(grid.entryCount(), 2 * cells_of_light_max);
    for (float x = -4999; x < 5000; x += 113)
        for (float z = -4999; z < 5000; z += 113) ASSERT_EQ(listedAt(grid, {x, 0, z}).count(0), 1u) << x << " " << z;
    EXPECT_EQ(listedAt(grid, {-3870, 0, 30}), (std::set<uint32_t>{0, 1}));
    EXPECT_EQ(listedAt(grid, {-3600, 0, 30}), std::set<uint32_t>{0});
}

TEST(LightGrid, OfSomeGroupsTellsOnlyTheirLights) {
    Scene scene = rooms(1);
    scene.light_sets = {{"a", 1}, {"b", 1}};
    for (const BakeMode mode : {BakeMode::Indirect, BakeMode::Full})
        for (const uint32_t set : {0u, 1u}) addPointLight(scene, {0, 0, 0.1f}, 60, mode).light_set = set;
    const RayScene rays(scene);
    const LightGrid all(rays);
    for (const std::vector<uint8_t>& groups : std::vector<std::vector<uint8_t>>{{1, 0, 0}, {0, 1, 0}, {1, 0, 1}}) {
        std::vector<uint32_t> some, alone;
        all.ofGroups(groups).forEach({1, 1, 1}, [&](uint32_t light) { some.push_back(light); });
        LightGrid(rays, true, groups).forEach({1, 1, 1}, [&](uint32_t light) { alone.push_back(light); });
        EXPECT_EQ(some, alone);
        EXPECT_FALSE(some.empty());
    }
}

class CountedStages : public SilentProgress {
   public:
    void stage(std::string_view name, uint64_t) override { ++count[std::string(name)]; }
    std::map<std::string, int> count;
};

// Not for pairs of doors, models' grids and the sites of the global grid again.
TEST(LightGrid, ABakeLooksOnceWhereLampsShine) {
    Scene scene;
    const uint32_t white = addMaterial(scene, lambert(0.6f));
    addBox(scene, {3, 1, 1}, white);
    scene.doors = {{"a", false}, {"b", false}};
    for (uint32_t d = 0; d < 2; ++d)
        addSolid(scene, "leaf", {-1 + 2 * static_cast<float>(d), 0, 0}, {0.1f, 1, 1}, white, d);
    addPointLight(scene, {-0.2f, 0.2f, 0.1f}, 100, BakeMode::Indirect);
    addCrate(scene, "crate", placed({0.3, -0.7, 0.2}, 0.5), {0.3f, 0.3f, 0.3f}, white);
    listModels(scene, {.spacing_m = 0.7f});
    const BakedScene b(scene);
    CountedStages stages;
    BakeSettings settings{.series_rays = 32, .final_rays = 1};
    settings.grid.probes_max = 50;
    bake(*b.rays, b.charts, b.texels, settings, stages);
    for (const char* stage : {"direct light and links", "direct light and links for pairs of doors", "local grids",
                              "light at probe sites", "rays from lamps"})
        EXPECT_EQ(stages.count[stage], 1) << stage;
}

TEST(LightGrid, LampsThatAreOffAreAskedForNowhere) {
    Scene scene = rooms(2);
    scene.lights[0].intensity = glm::vec3(0);
    addPointLight(scene, {0, 0, 0}, 0, BakeMode::Full);
    const RayScene rays(scene);
    std::set<uint32_t> asked;
    const LightGrid grid(rays);
    for (const glm::vec3 p : {glm::vec3(0), glm::vec3(8, 0, 0)})
        grid.forEach(p, [&](uint32_t light) { asked.insert(light); });
    EXPECT_EQ(asked, std::set<uint32_t>{1});
}

TEST(LightGrid, SpotsReachTheirConeAndRangesEnd) {
    Scene scene;
    addFloor(scene, 40, addMaterial(scene, lambert(0.5f)));
    addPointLight(scene, {0, 10, 0}, 100, BakeMode::Indirect).range_m = 15.0f;
    PunctualLight& spot = addPointLight(scene, {0, 10, 0}, 100, BakeMode::Indirect);
    spot.type = LightType::Spot;
    spot.direction = {0, -1, 0};
    spot.cone_inner_cos = 0.95f;
    spot.cone_outer_cos = 0.9f;  // a circle of 4.8 m on the floor
    const RayScene rays(scene);
    const LightGrid grid(rays);
    EXPECT_EQ(listedAt(grid, {3, 0, 3}), (std::set<uint32_t>{0, 1}));
    EXPECT_EQ(listedAt(grid, {9, 0, 0}), (std::set<uint32_t>{0}));
    EXPECT_EQ(listedAt(grid, {25, 0, 0}), (std::set<uint32_t>{}));
}

std::set<uint32_t> askedAt(const LightGrid& grid, glm::vec3 point) {
    std::set<uint32_t> asked;
    grid.forEach(point, [&](uint32_t light) { EXPECT_TRUE(asked.insert(light).second) << light; });
    return asked;
}

TEST(LightGrid, WhatIsSeenItselfOrFarOutsideIsAskedForEverywhere) {
    Scene scene = rooms(6);
    scene.lights[1].bake = BakeMode::None;
    scene.lights[2].bake = BakeMode::Full;
    scene.lights[3].type = LightType::Directional;
    scene.lights[4].position_m = {0, 5000, 0};
    const RayScene rays(scene);
    EXPECT_EQ(askedAt(LightGrid(rays), {0, 0, 0}), (std::set<uint32_t>{0, 2, 3, 4}));
    EXPECT_EQ(askedAt(LightGrid(rays, false), {0, 0, 0}), (std::set<uint32_t>{0, 2, 3, 4, 5}));
    scene.lights.resize(1);
    scene.lights[0].bake = BakeMode::None;
    EXPECT_EQ(askedAt(LightGrid(rays), {0, 0, 0}), (std::set<uint32_t>{}));
}

// How much stops light is the shadow rays' to say: of 4,096 rays one in 10,000 would pass both panes.
TEST(LightGrid, WhatHidesAllButALittleHidesNothing) {
    Scene scene;
    addFloor(scene, 12, addMaterial(scene, lambert(0.5f)));
    Material glass = lambert(0.5f);
    glass.alpha_mode = AlphaMode::Blend;
    glass.alpha = 0.99f;
    const uint32_t pane = addMaterial(scene, glass);
    addQuad(scene, "two panes", {0, 6, 0}, {0, 6, 0}, {0, 0, 12}, pane);
    addQuad(scene, "two panes", {0.1f, 6, 0}, {0, 6, 0}, {0, 0, 12}, pane);
    addPointLight(scene, {-6, 1, 0}, 100, BakeMode::Indirect);
    const LightGrid behind_glass{RayScene(scene)};
    EXPECT_EQ(listedAt(behind_glass, {9, 0, 0}), std::set<uint32_t>{0});
    scene.materials[pane].alpha_mode = AlphaMode::Opaque;
    const LightGrid behind_a_wall{RayScene(scene)};
    EXPECT_EQ(listedAt(behind_a_wall, {3, 0, 0}), std::set<uint32_t>{});
}

// Neighbouring rays are 3 m apart where they meet the far end of this street, further than cells are wide.
TEST(LightGrid, NothingIsMissedInTheOpen) {
    Scene scene;
    addFloor(scene, 60, addMaterial(scene, lambert(0.5f)));
    addQuad(scene, "mast", {0, 1.5f, 0}, {0, 1.5f, 0}, {0, 0, 0.01f}, 0);
    addPointLight(scene, {-59, 1.4f, 3}, 100, BakeMode::Indirect);
    const RayScene rays(scene);
    const LightGrid grid(rays);
    for (float x = -59.5f; x < 60; x += 1)
        for (float z = -59.5f; z < 60; z += 1) ASSERT_EQ(askedAt(grid, {x, 0, z}).size(), 1u) << x << " " << z;
}

struct Direct {
    std::vector<std::vector<std::pair<uint32_t, glm::vec3>>> rows;  // (term, lux) per receiver
    uint64_t rays = 0;
};
Direct directOf(const BakedScene& b, bool enabled) {
    const LightGrid grid(*b.rays, enabled);
    Direct out;
    const DoorPaths paths(b.scene);
    const EmitterSampler emitters(*b.rays, meshGroups(b.scene));
    const Gatherer gatherer(*b.rays, b.charts, b.texels, emitters, paths);
    TermAccumulator<Gathered> reflected(paths.termCount()), stored(paths.termCount());
    std::vector<SamplePoint> points;
    for (size_t i = 0; i < b.texels.size(); ++i) {
        out.rays += directLight(gatherer, grid, gatherer.at(i, points), reflected, stored);
        auto& row = out.rows.emplace_back();
        for (const uint32_t g : reflected.touched()) row.emplace_back(g, reflected[g].irradiance_lux);
        reflected.clear();
        stored.clear();
    }
    return out;
}

// In closed rooms nothing is lost at all, and a receiver costs its own room's lamp alone.
TEST(LightGrid, ClosedRoomsAreTheSameForTheRaysOfTheirOwnLamps) {
    const BakedScene b(rooms(12), 2);
    const Direct with = directOf(b, true), without = directOf(b, false);
    EXPECT_EQ(with.rows, without.rows);
    uint64_t own = 0;
    for (size_t i = 0; i < b.texels.size(); ++i) own += b.texels.sampleCount(i);
    EXPECT_LE(with.rays, own);
    EXPECT_GT(without.rays, 3 * with.rays);
}

// Texels of 5 m, and spots whose circles are no wider: a cell of the grid that lies elsewhere in the texel.
TEST(LightGrid, NothingIsLostInTexelsWiderThanItsCells) {
    Scene scene;
    addFloor(scene, 40, addMaterial(scene, lambert(0.5f)));
    std::mt19937 random(3);
    std::uniform_real_distribution<float> across(-38, 38);
    for (int i = 0; i < 40; ++i) {
        PunctualLight& spot = addPointLight(scene, {across(random), 10, across(random)}, 100, BakeMode::Indirect);
        spot.type = LightType::Spot;
        spot.direction = {0, -1, 0};
        spot.cone_inner_cos = 0.99f;
        spot.cone_outer_cos = 0.98f;  // a circle of 2 m
    }
    const BakedScene b(scene, 0.2f, 16);
    EXPECT_EQ(directOf(b, true).rows, directOf(b, false).rows);
}

// A long room, a black wall across it that leaves an opening of `width_m` at z = 1, and 60 lamps on its -X side.
Scene lampsBehindAWall(float width_m) {
    Scene scene;
    addBox(scene, {12, 2, 6}, addMaterial(scene, lambert(0.5f)));
    Material wall = lambert(0);
    wall.double_sided = true;
    const uint32_t black = addMaterial(scene, wall);
    const float left = 0.5f * (7 - 0.5f * width_m), right = 0.5f * (5 - 0.5f * width_m);
    addQuad(scene, "wall", {0, 0, left - 6}, {0, 2, 0}, {0, 0, left}, black);
    addQuad(scene, "wall", {0, 0, 6 - right}, {0, 2, 0}, {0, 0, right}, black);
    std::mt19937 random(2);
    std::uniform_real_distribution<float> unit(-1, 1);
    for (int i = 0; i < 60; ++i)
        addPointLight(scene, {-8 + 3 * unit(random), unit(random), 4 * unit(random)}, 50, BakeMode::Indirect);
    return scene;
}

// Rays of a lamp are 0.055 rad apart, the opening is 0.1 rad wide from where the furthest lamp stands.
TEST(LightGrid, NothingIsLostThroughADoorway) {
    const BakedScene b(lampsBehindAWall(1.2f), 3, 2);
    const Direct with = directOf(b, true), without = directOf(b, false);
    EXPECT_EQ(with.rows, without.rows);
    size_t lit_behind = 0;
    for (size_t i = 0; i < b.texels.size(); ++i) lit_behind += b.place(i).x > 1 && !without.rows[i].empty();
    EXPECT_GT(lit_behind, 100u);
    EXPECT_LT(with.rays, without.rays);
}

// A hatch of 0.8 x 0.6 m, 25 m from the lamp: a 4,000th of the directions around it, between two of its rays as like as
// not. What it lights behind is found from there, wherever the lamp stands.
TEST(LightGrid, NothingIsLostThroughAHatchFarAway) {
    size_t lit_behind = 0;
    for (const glm::vec3 lamp : {glm::vec3(-12, 0.5f, -3), glm::vec3(-12.3f, 1.1f, 0), glm::vec3(-11, -0.7f, 4.2f)}) {
        Scene scene;
        addBox(scene, {16, 2, 6}, addMaterial(scene, lambert(0.5f)));
        Material wall = lambert(0.5f);
        wall.double_sided = true;
        const uint32_t grey = addMaterial(scene, wall);
        addQuad(scene, "left", {12, 0, -3.2f}, {0, 2, 0}, {0, 0, 2.8f}, grey);
        addQuad(scene, "right", {12, 0, 3.2f}, {0, 2, 0}, {0, 0, 2.8f}, grey);
        addQuad(scene, "above", {12, 1.15f, 0}, {0, 0.85f, 0}, {0, 0, 0.4f}, grey);
        addQuad(scene, "below", {12, -1.15f, 0}, {0, 0.85f, 0}, {0, 0, 0.4f}, grey);
        addPointLight(scene, lamp, 800, BakeMode::Indirect);
        const BakedScene b(scene, 4, 4);
        const Direct with = directOf(b, true), without = directOf(b, false);
        EXPECT_EQ(with.rows, without.rows) << lamp.x << " " << lamp.y << " " << lamp.z;
        for (size_t i = 0; i < b.texels.size(); ++i) lit_behind += b.place(i).x > 12.1f && !without.rows[i].empty();
    }
    EXPECT_GT(lit_behind, 30u);
}

// A slit of 1 cm is 0.001 rad: most lamps' rays miss it, and on their own side nothing is lost all the same.
TEST(LightGrid, ThroughASlitLightMayBeLostButNotBeforeIt) {
    const BakedScene b(lampsBehindAWall(0.01f), 3, 2);
    const Direct with = directOf(b, true), without = directOf(b, false);
    bool lost = false;
    for (size_t i = 0; i < b.texels.size(); ++i) {
        if (b.place(i).x < -0.1f) {
            ASSERT_EQ(with.rows[i], without.rows[i]) << b.place(i).x;
        }
        lost |= with.rows[i] != without.rows[i];
    }
    EXPECT_TRUE(lost) << "a wider slit than the grid leaves out: the test says nothing";
}

// Sets are independent: one more, first in the file, changes no byte of another.
TEST(LightGrid, ASetMoreChangesNoOther) {
    Scene one = rooms(5);
    one.light_sets = {{"a", 1}};
    for (PunctualLight& l : one.lights) l.light_set = 0;
    Scene two = one;
    two.light_sets = {{"a", 1}, {"b", 1}};
    PunctualLight extra = one.lights[0];
    extra.position_m += glm::vec3(0.3f, 0, 0);
    extra.light_set = 1;
    two.lights.insert(two.lights.begin(), extra);
    const BakedScene first(one, 2), second(two, 2);
    const Direct of_one = directOf(first, true), of_two = directOf(second, true);
    for (size_t i = 0; i < of_one.rows.size(); ++i)
        for (const auto& entry : of_one.rows[i]) ASSERT_EQ(std::ranges::count(of_two.rows[i], entry), 1) << i;
}

TEST(LightGrid, ThreadsChangeNothing) {
    const Scene scene = rooms(6);
    const RayScene rays(scene);
    const LightGrid many(rays);
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, 1);
    const LightGrid one(rays);
    for (float x = -3; x < 45; x += 0.5f) EXPECT_EQ(listedAt(many, {x, -1.9f, 0.3f}), listedAt(one, {x, -1.9f, 0.3f}));
}

// As exporters write that know no range.
TEST(LightGrid, ALampsRangeMayBeAnyNumber) {
    Scene scene;
    addFloor(scene, 10, addMaterial(scene, lambert(0.5f)));
    addPointLight(scene, {0, 3, 0}, 100, BakeMode::Indirect).range_m = std::numeric_limits<float>::max();
    const RayScene rays(scene);
    EXPECT_EQ(listedAt(LightGrid(rays), {9, 0, -9}), (std::set<uint32_t>{0}));
}

}  // namespace
}  // namespace dimmer::cook::test
