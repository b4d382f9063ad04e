// Pairs of doors: in sight of each other, and what light needs both.
#include <bake/baked_scene.h>
#include <bake/door_pairs.h>
#include <bake/door_paths.h>
#include <bake/test_scenes.h>

#include <cmath>

namespace dimmer::cook::test {
namespace {

TEST(DoorPairs, ThoseInSightOfEachOtherAreFound) {
    Scene scene = corridorWithDoors();
    EXPECT_EQ(doorsInSight(RayScene(scene)), (std::vector<DoorIndices>{{0, 1}, {0, 2}, {1, 2}}));
    // Larger than the corridor: here each face of a leaf is a mesh, whose points rounding may put above the ceiling.
    addSolid(scene, "partition", {-1, 0, 0}, {0.1f, 1.1f, 1.1f}, 0);
    EXPECT_EQ(doorsInSight(RayScene(scene)), (std::vector<DoorIndices>{{1, 2}}));
}

// A corridor of three doors: neighbours share a room, the outer two do not. What is suggested goes away once named, and
// is what a bake that keeps it adds.
TEST(DoorPairs, ThoseThatDependOnEachOtherAreFound) {
    Scene scene = corridorWithDoors();
    const auto found = [](const Scene& level) {
        BakedScene b(level);
        b.bake({.series_rays = 32, .final_rays = 1});
        return b.baked.dependent_doors;
    };
    const auto pairs = found(scene);
    ASSERT_EQ(pairs.size(), 2u);
    for (const DoorPair& pair : pairs) EXPECT_EQ(pair.second, pair.first + 1);
    scene.combinations = {{{true, 0}, {true, 1}}};
    ASSERT_EQ(found(scene).size(), 1u);
    EXPECT_EQ(found(scene)[0].first, 1u);

    // The predicted loss against the flux of the terms of a bake that keeps them all.
    scene.combinations = {{{true, 0}, {true, 1}, {true, 2}}};
    BakedScene b(scene);
    b.bake({.series_rays = 256, .final_rays = 32, .threshold = 0});
    double alone[2] = {}, off = 0;
    for (size_t t = 0; t < b.baked.terms.size(); ++t) {
        const Term& term = b.baked.terms[t];
        const double energy = b.baked.reports[t].energy;
        const bool others_closed = std::ranges::count(term.doors_open, 2u) == 0;
        for (uint32_t d : {0u, 1u})
            if (term.isAbout(d) &&
                term.doors_open.size() == static_cast<size_t>(std::ranges::count(term.doors_open, d)))
                alone[d] += energy;
        if (term.isAbout(0) && term.isAbout(1) && others_closed && !term.doors_open.empty()) off += energy;
    }
    const DoorPair& first = pairs[0].first == 0 ? pairs[0] : pairs[1];
    // Few rays against many: a tenth.
    EXPECT_NEAR(static_cast<double>(first.loss) / (off / std::min(alone[0], alone[1])), 1, 0.1);
}

// Pairs that do not fit into one series with all others are measured by several. Two rooms with two doors each, so that
// no light asks for doors of both pairs (where that counts depends on which pairs are kept together): the same paths,
// and what is left is how light is rounded and thresholds fall out.
TEST(DoorPairs, AreMeasuredTheSameOneByOne) {
    Scene scene;
    const uint32_t white = addMaterial(scene, lambert(0.6f));
    scene.doors = {{"a", false}, {"b", false}, {"c", false}, {"d", false}};
    scene.light_sets = {{"lamp", 1}, {"other", 1}};
    for (uint32_t room = 0; room < 2; ++room) {
        const float away_m = 10 * static_cast<float>(room);
        const size_t first_wall = scene.meshes.size();
        addBox(scene, {3, 1, 1}, white);
        for (size_t wall = first_wall; wall < scene.meshes.size(); ++wall)
            for (glm::vec3& p : scene.meshes[wall].positions_m) p.z += away_m;
        for (uint32_t d = 0; d < 2; ++d)
            addSolid(scene, "leaf", {-1 + 2 * static_cast<float>(d), 0, away_m}, {0.1f, 1, 1}, white, 2 * room + d);
        addPointLight(scene, {-0.2f, 0.2f, 0.1f + away_m}, 100, BakeMode::Full).light_set = room;
    }
    const BakedScene b(scene);
    const EmitterSampler emitters(*b.rays, meshGroups(scene));
    const DoorPaths paths(scene, doorsInSight(*b.rays));
    const Gatherer gatherer(*b.rays, b.charts, b.texels, emitters, paths);
    const BakeSettings settings{.series_rays = 32, .final_rays = 1};
    SilentProgress quiet;
    const Series series = expandSeries(gatherer, LightGrid(*b.rays), settings, quiet);
    const std::vector<uint8_t> all(paths.groupCount(), 1);
    const auto together = doorFlux(gatherer, LightGrid(*b.rays), series, settings, all, quiet),
               one_by_one = doorFlux(gatherer, LightGrid(*b.rays), series, settings, all, quiet, nullptr, 0);
    size_t compared = 0;
    ASSERT_EQ(together.size(), one_by_one.size());
    for (size_t g = 0; g < together.size(); ++g) {
        ASSERT_GE(together[g].pairs.size(), 2u);
        ASSERT_EQ(together[g].pairs.size(), one_by_one[g].pairs.size());
        for (size_t p = 0; p < together[g].pairs.size(); ++p) {
            const double flux = together[g].pairs[p].flux;
            EXPECT_NEAR(one_by_one[g].pairs[p].flux, flux, 0.01 * flux) << g << " " << p;
            compared += flux > 0;
        }
        for (size_t d = 0; d < scene.doors.size(); ++d)
            EXPECT_NEAR(one_by_one[g].alone[d], together[g].alone[d], 0.01 * together[g].alone[d]) << g << " " << d;
    }
    EXPECT_GT(compared, 1u);
}

// Three rooms in a row, lit in the first alone: the second door by itself changes nothing, and the last room is black
// unless the two are named.
TEST(DoorPairs, AreFoundWhereOneDoorAloneChangesNothing) {
    Scene scene;
    const uint32_t white = addMaterial(scene, lambert(0.6f));
    addBox(scene, {3, 1, 1}, white);
    scene.doors = {{"a", false}, {"b", false}};
    for (uint32_t d = 0; d < 2; ++d)
        addSolid(scene, "leaf", {-1 + 2 * static_cast<float>(d), 0, 0}, {0.1f, 1, 1}, white, d);
    scene.light_sets = {{"lamp", 1}, {"other", 1}};
    for (uint32_t set : {0u, 1u})
        addPointLight(scene, {-2.2f, 0.2f, 0.1f + 0.3f * static_cast<float>(set)}, 100, BakeMode::Full).light_set = set;
    const auto found = [](const Scene& level) {
        BakedScene b(level);
        b.bake({.series_rays = 32, .final_rays = 1});
        return b.baked.dependent_doors;
    };
    const auto pairs = found(scene);
    ASSERT_EQ(pairs.size(), 1u);
    EXPECT_TRUE(pairs[0].first == 0 && pairs[0].second == 1 && std::isinf(pairs[0].loss));
    // Named for one set, the other's light is still missing; for both, all is there.
    scene.combinations = {{{true, 0}, {true, 1}, {false, 0}}};
    EXPECT_EQ(found(scene).size(), 1u);
    scene.combinations.push_back({{true, 0}, {true, 1}, {false, 1}});
    EXPECT_TRUE(found(scene).empty());
}

// Two doors at the ends of a corridor that turns twice: no surface sees both, and what comes through both is all the
// light of the last room.
TEST(DoorPairs, AreFoundAroundTwoBends) {
    Scene scene;
    const uint32_t white = addMaterial(scene, lambert(0.85f));
    addBox(scene, {4.5f, 1.25f, 2}, white);
    const auto wall = [&](float x0, float x1, float z0, float z1) {
        addSolid(scene, "wall", {(x0 + x1) / 2, 0, (z0 + z1) / 2}, {(x1 - x0) / 2, 1.25f, (z1 - z0) / 2}, white);
    };
    scene.doors = {{"a", false}, {"b", false}};
    for (uint32_t d = 0; d < 2; ++d) {
        const float x = d == 0 ? -1.5f : 1.5f;
        wall(x - 0.05f, x + 0.05f, -2, -1.8f);
        wall(x - 0.05f, x + 0.05f, -0.8f, 2);
        addSolid(scene, "leaf", {x, 0, -1.3f}, {0.03f, 1.25f, 0.5f}, white, d);
    }
    wall(-0.05f, 0.05f, -2, 0.6f);       // the corridor goes around this
    wall(-1.45f, -0.65f, -0.3f, -0.2f);  // and past these, behind which the doors are
    wall(0.65f, 1.45f, -0.3f, -0.2f);
    scene.light_sets = {{"lamp", 1}};
    addPointLight(scene, {-3.3f, 0.75f, -0.8f}, 500, BakeMode::Full).light_set = 0;
    BakedScene b(scene);
    const EmitterSampler emitters(*b.rays, meshGroups(scene));
    const DoorPaths paths(scene, doorsInSight(*b.rays));
    const Gatherer gatherer(*b.rays, b.charts, b.texels, emitters, paths);
    SilentProgress quiet;
    const Series series = expandSeries(gatherer, LightGrid(*b.rays), {.series_rays = 32, .final_rays = 1}, quiet);
    for (size_t i = 0; i < series.doors_seen.rows(); ++i) ASSERT_LT(series.doors_seen.row(i).size(), 2u);
    b.bake({.series_rays = 32, .final_rays = 1});
    ASSERT_EQ(b.baked.dependent_doors.size(), 1u);
}

}  // namespace
}  // namespace dimmer::cook::test
