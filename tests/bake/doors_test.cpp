// Doors in the bake: terms of light groups over open and closed doors, against scenes that leave the doors out.
#include <bake/baked_scene.h>
#include <bake/door_pairs.h>
#include <bake/door_paths.h>
#include <bake/door_rays.h>
#include <bake/reference.h>
#include <bake/test_scenes.h>
#include <pipeline/reference_state.h>
#include <scene/open_pose.h>

#include <bit>
#include <map>

namespace dimmer::cook::test {
namespace {

// A corridor of four rooms of 2 m in a row along x, parted by doors that fill it from wall to wall; two light sets and
// a little always-on light.
Scene corridor() {
    Scene scene;
    const uint32_t white = addMaterial(scene, lambert(0.6f)), leaf = addMaterial(scene, lambert(0.8f));
    const uint32_t glow = addMaterial(scene, emissive(glm::vec3(30)));
    addBox(scene, {4, 1, 1}, white);
    scene.doors = {{"a", false}, {"b", false}, {"c", false}};
    for (uint32_t d = 0; d < 3; ++d)
        addSolid(scene, "leaf", {-2 + 2 * static_cast<float>(d), 0, 0}, {0.1f, 1, 1}, leaf, d);
    scene.light_sets = {{"first", 1}, {"third", 1}};
    addPointLight(scene, {-3, 0.2f, 0.1f}, 100, BakeMode::Full).light_set = 0;
    addPointLight(scene, {1, -0.2f, 0.3f}, 100, BakeMode::Indirect).light_set = 1;
    addQuad(scene, "panel", {3, 0.95f, 0}, {0.3f, 0, 0}, {0, 0, 0.3f}, glow);
    return scene;
}

TEST(DoorPaths, OneDoorIsKeptByItselfAndMoreByName) {
    Scene scene;
    scene.doors.resize(3);
    scene.light_sets.resize(2);
    const auto count = [&] { return DoorPaths(scene).termCount(); };
    EXPECT_EQ(count(), 3u * (1 + 2 * 3));
    scene.combinations = {{{true, 0}, {true, 2}}};
    EXPECT_EQ(count(), 3u * (1 + 2 * 3 + 4));  // both open, both closed, one of each
    scene.combinations = {{{true, 0}, {true, 2}, {false, 1}}};
    EXPECT_EQ(count(), 3u * (1 + 2 * 3) + 4);  // for that set alone
    scene.combinations = {{{true, 0}, {true, 1}, {true, 2}}};
    EXPECT_EQ(count(), 3u * 27);
    scene.doors.clear();
    scene.combinations.clear();
    EXPECT_EQ(count(), 3u);
}

TEST(DoorPaths, AddUpAndContradict) {
    Scene scene;
    scene.doors.resize(2);
    scene.light_sets.resize(1);
    scene.combinations = {{{true, 0}, {true, 1}}};
    const DoorPaths paths(scene);
    constexpr uint32_t a_closed = 0, a_open = 1, b_closed = 2;
    const uint32_t through_a = paths.with(free_path, a_open);
    EXPECT_EQ(paths.with(through_a, a_open), through_a);
    EXPECT_EQ(paths.with(through_a, a_closed), no_path);
    EXPECT_EQ(paths.leaf(through_a, no_condition, a_closed), Leaf::Absent);
    EXPECT_EQ(paths.leaf(free_path, no_condition, a_closed), Leaf::Either);
    EXPECT_EQ(paths.leaf(free_path, a_closed, a_closed), Leaf::There);
    EXPECT_EQ(paths.leaf(free_path, a_open, a_closed), Leaf::Absent);
    const uint32_t set_off_b = paths.term(1, paths.with(free_path, b_closed));
    const uint32_t both = paths.moved(set_off_b, through_a, no_condition);
    ASSERT_NE(both, no_term);
    EXPECT_EQ(paths.terms()[both].group, 1u);
    EXPECT_EQ(paths.terms()[both].doors_open, std::vector<uint32_t>{0});
    EXPECT_EQ(paths.terms()[both].doors_closed, std::vector<uint32_t>{1});
    // A leaf's own texels do not name its condition; what leaves them does.
    EXPECT_EQ(paths.moved(set_off_b, free_path, b_closed), 1u);
    EXPECT_EQ(paths.leaving(1, b_closed), set_off_b);
    EXPECT_EQ(paths.moved(both, free_path, a_closed), no_term);
}

// Where no combination names two doors together, each is baked with the other closed.
TEST(DoorPaths, DoorsAreBakedEachWithTheOthersClosed) {
    Scene scene;
    scene.doors.resize(3);
    scene.light_sets.resize(1);
    constexpr uint32_t a_open = 1, b_closed = 2, b_open = 3, c_closed = 4, c_open = 5;
    {
        const DoorPaths paths(scene);
        const auto over = [&](uint32_t condition) { return paths.with(free_path, condition); };
        EXPECT_EQ(paths.with(over(a_open), b_closed), over(a_open));
        EXPECT_EQ(paths.with(over(b_closed), a_open), over(a_open));
        EXPECT_EQ(paths.with(over(c_closed), b_closed), over(b_closed));
        EXPECT_EQ(paths.with(over(a_open), b_open), no_path);
        // It does not need the other closed: there its leaf stands, and it may be asked what is behind.
        EXPECT_FALSE(paths.needs(over(a_open), b_closed));
        EXPECT_EQ(paths.leaf(over(a_open), no_condition, b_closed), Leaf::Either);
        const uint32_t off_b = paths.term(1, over(b_closed));
        EXPECT_EQ(paths.moved(off_b, over(a_open), no_condition), paths.term(1, over(a_open)));
        EXPECT_EQ(paths.leaving(paths.term(1, over(a_open)), c_closed), paths.term(1, over(a_open)));
    }
    {
        const std::vector<DoorIndices> in_sight = {{1, 2}};
        const DoorPaths paths(scene, in_sight);
        EXPECT_EQ(paths.termCount(), 2u * (1 + 2 * 3 + 1));
        const uint32_t b = paths.with(free_path, b_closed), both = paths.with(b, c_closed);
        EXPECT_NE(both, b);
        EXPECT_EQ(paths.with(both, b_open), no_path);
        EXPECT_EQ(paths.with(both, a_open), paths.with(free_path, a_open));
    }
    scene.combinations = {{{true, 0}, {true, 1}, {false, 0}}};  // for the set's light alone
    const DoorPaths paths(scene);
    const uint32_t a = paths.with(free_path, a_open), ab = paths.with(a, b_closed);
    EXPECT_NE(ab, a);
    EXPECT_NE(paths.term(1, ab), paths.term(1, a));
    EXPECT_EQ(paths.term(always_group, ab), paths.term(always_group, a));
    EXPECT_EQ(paths.with(ab, c_closed), ab);
    EXPECT_EQ(paths.term(always_group, paths.with(a, b_open)), no_term);
    EXPECT_EQ(paths.with(ab, c_open), no_path);
}

// A hall of doors that all see each other has paths for each pair: of pairs of these there are a billion.
TEST(DoorPaths, OfAHallJoinOnlyWhatIsAskedFor) {
    constexpr uint32_t doors = 256;
    Scene scene;
    scene.doors.resize(doors);
    std::vector<DoorIndices> in_sight;
    for (uint32_t a = 0; a < doors; ++a)
        for (uint32_t b = a + 1; b < doors; ++b) in_sight.emplace_back(a, b);
    const DoorPaths paths(scene, in_sight);
    ASSERT_EQ(paths.pathCount(), 1 + 2 * doors + doors * (doors - 1) / 2);
    const auto closed = [](uint32_t door) { return 2 * door; };
    for (const uint32_t step : {1u, 2u, 255u})  // more pairs than are remembered, then again what they displaced
        for (uint32_t a = 0; a < doors; a += step)
            for (uint32_t b = a + 1; b < doors; b += step) {
                const uint32_t from_a = paths.with(free_path, closed(a)), from_b = paths.with(free_path, closed(b));
                const uint32_t both = paths.with(from_a, closed(b));
                ASSERT_EQ(paths.terms()[paths.term(always_group, both)].doors_closed, (std::vector<uint32_t>{a, b}));
                ASSERT_EQ(paths.with(from_b, closed(a)), both);
                ASSERT_EQ(paths.with(both, closed(a) + 1), no_path);
                const uint32_t light = paths.term(always_group, from_b);
                ASSERT_EQ(paths.moved(light, both, no_condition), paths.term(always_group, both));
                ASSERT_EQ(paths.moved(paths.term(always_group, both), from_a, closed(b)),
                          paths.term(always_group, from_a));
            }
}

// Leaves on the way to the wall, nearest first, through what the wall's glass lets pass; none behind it. Of more than
// fit the nearest are kept, in whatever order a ray meets them.
TEST(DoorRays, MeetTheLeavesBeforeTheWall) {
    Scene scene;
    Material glass = lambert(0.5f);
    glass.alpha_mode = AlphaMode::Blend;
    glass.alpha = 0;
    const uint32_t pane = addMaterial(scene, glass), wood = addMaterial(scene, lambert(0.5f));
    scene.doors.resize(1);
    constexpr uint32_t leaves_before = 40, leaves_behind = 20;
    // Aslant: their boxes overlap, so that a tree hands them out in no order.
    const auto addLeafAt = [&](float x) { addQuad(scene, "leaf", {x, 0, 0}, {9, 9, 0}, {0, 0, 9}, wood).door = 0; };
    for (uint32_t i = 0; i < leaves_behind; ++i) addLeafAt(6 + 0.1f * static_cast<float>(i));
    for (uint32_t i = leaves_before; i > 0; --i) addLeafAt(0.1f * static_cast<float>(i));
    addQuad(scene, "glass", {0.55f, 0, 0}, {0, 1, 0}, {0, 0, 1}, pane);
    addQuad(scene, "wall", {5, 0, 0}, {0, 2, 0}, {0, 0, 2}, wood);
    const RayScene rays(scene);
    const glm::vec3 origin(0, 0, 0.2f), along(1, 0, 0);
    for (const float far : {0.32f, 0.72f, 4.5f, 100.0f}) {
        LeafHits leaves, passed;
        const auto wall = rays.nearest(origin, along, far, 1, Surfaces::Walls, no_model, &leaves);
        EXPECT_EQ(wall.has_value(), far > 5);
        const auto expected = std::min(static_cast<uint32_t>(far * 10 + 0.01f), LeafHits::max);
        ASSERT_EQ(leaves.count, expected) << far;
        for (uint32_t i = 0; i < expected; ++i)
            EXPECT_NEAR(leaves.hits[i].distance_m, 0.1f * static_cast<float>(i + 1), 1e-5f);
        const float light = rays.transmittance(origin, along, far, Surfaces::Walls, no_model, &passed);
        EXPECT_EQ(light, far > 5 ? 0 : 1);
        if (light > 0) {
            EXPECT_EQ(passed.count, expected) << far;
        }
    }
}

TEST(DoorRays, PartAtLeavesThatLetSomeLightThrough) {
    Scene scene;
    Material glass = lambert(0.5f);
    glass.alpha_mode = AlphaMode::Blend;
    glass.alpha = 0.25f;
    const uint32_t pane = addMaterial(scene, glass), wood = addMaterial(scene, lambert(0.5f));
    scene.doors.resize(2);
    addQuad(scene, "pane", {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, pane).door = 0;
    addQuad(scene, "wood", {2, 0, 0}, {0, 1, 0}, {0, 0, 1}, wood).door = 1;
    const RayScene rays(scene);
    const auto ways = [&](const DoorPaths& paths, float distance) {
        std::map<uint32_t, float> found;
        forEachWay(rays, paths, no_condition, no_model, {0, 0.1f, 0.2f}, {1, 0, 0}, distance,
                   [&](float share, uint32_t path) { found[path] += share; });
        return found;
    };
    const DoorPaths single(scene);
    const uint32_t open_pane = single.with(free_path, 1), open_wood = single.with(free_path, 3);
    EXPECT_EQ(ways(single, 0.9f), (std::map<uint32_t, float>{{free_path, 1}}));
    EXPECT_EQ(ways(single, 1.5f), (std::map<uint32_t, float>{{free_path, 0.75f}, {open_pane, 0.25f}}));
    EXPECT_EQ(ways(single, 3), (std::map<uint32_t, float>{{open_wood, 0.75f}}));
    scene.combinations = {{{true, 0}, {true, 1}}};
    const DoorPaths both(scene);
    const uint32_t wood_first = both.with(free_path, 3);
    EXPECT_EQ(ways(both, 3), (std::map<uint32_t, float>{{wood_first, 0.75f}, {both.with(wood_first, 1), 0.25f}}));
}

// Behind an open door another one is taken to be closed: what of it stands there open is not there, however often a way
// passes it.
TEST(DoorRays, DoNotPartAtWhatOpenLeavesOfOtherDoorsLetThrough) {
    Scene scene;
    Material glass = lambert(0.5f);
    glass.alpha_mode = AlphaMode::Blend;
    glass.alpha = 0.25f;
    const uint32_t pane = addMaterial(scene, glass), wood = addMaterial(scene, lambert(0.5f));
    scene.doors.resize(2);
    addQuad(scene, "wood", {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, wood).door = 0;
    for (int i = 0; i < 8; ++i) {
        SceneMesh& open = addQuad(scene, "pane", {2 + 0.1f * static_cast<float>(i), 0, 0}, {0, 1, 0}, {0, 0, 1}, pane);
        open.door = 1;
        open.is_open_leaf = true;
    }
    const DoorPaths paths(scene);
    std::map<uint32_t, float> found;
    forEachWay(RayScene(scene), paths, no_condition, no_model, {0, 0.1f, 0.2f}, {1, 0, 0}, 3,
               [&](float share, uint32_t path) { found[path] += share; });
    EXPECT_EQ(found, (std::map<uint32_t, float>{{paths.with(free_path, 1), 1}}));
}

// The light of a state: terms weighted by what they need. Bit d of `open`: door d; bit s of `sets`: set s.
glm::dvec3 inState(const BakedScene& b, size_t receiver, uint32_t open, uint32_t sets) {
    glm::dvec3 sum(0);
    for (const ReceiverLight& l : b.baked.light.row(receiver)) {
        const Term& t = b.baked.terms[l.term];
        bool on = t.group == always_group || (sets >> (t.group - 1) & 1);
        for (uint32_t d : t.doors_open) on &= open >> d & 1;
        for (uint32_t d : t.doors_closed) on &= !(open >> d & 1);
        if (on) sum += glm::dvec3(l.light.irradiance_lux);
    }
    return sum;
}

// Sums of baked light and reference over every `step`-th texel of the walls, in one state.
struct Compared {
    double baked = 0, reference = 0, noise = 0;  // lux; standard error of the sum
    double absolute = 0;                         // sum of |baked - reference|
};
Compared compare(const BakedScene& b, const Scene& level, uint32_t open, uint32_t sets, size_t points, uint32_t paths,
                 auto&& at) {
    ReferenceState state{{}, {}};
    for (uint32_t d = 0; d < level.doors.size(); ++d) state.door_open.push_back(open >> d & 1);
    const Scene stands = sceneInState(level, state);
    const RayScene rays(stands);
    ReferenceOptions options{.seed = 7, .set_weights = {}};
    for (uint32_t s = 0; s < level.light_sets.size(); ++s) options.set_weights.emplace_back(sets >> s & 1);
    const ReferenceTracer tracer(rays, options);
    std::vector<size_t> walls;
    for (size_t i = 0; i < b.texels.size(); ++i)
        if (b.meshOf(i) == "wall" && at(b.place(i))) walls.push_back(i);
    Compared out;
    double variance = 0;
    for (size_t k = 0; k < points; ++k) {
        const size_t i = walls[k * walls.size() / points];
        // Averaged over the texel's own points, as the bake is.
        double reference = 0;
        const uint32_t n = b.texels.sampleCount(i);
        for (uint32_t p = 0; p < n; ++p) {
            const auto v = tracer.irradiance({b.texels.sample(i, p).position_m, b.normal(i)}, paths / n);
            reference += static_cast<double>(v.irradiance_lux.y) / n;
            variance += std::pow(static_cast<double>(v.standard_error_lux.y) / n, 2);
        }
        const double baked = inState(b, i, open, sets).y;
        out.baked += baked;
        out.reference += reference;
        out.absolute += std::abs(baked - reference);
    }
    out.noise = std::sqrt(variance);
    return out;
}

constexpr auto everywhere = [](glm::vec3) { return true; };

BakeSettings exact() {
    return {.series_rays = 512, .final_rays = 1024, .emitter_samples = 8, .tail_max = 1e-4f, .threshold = 0};
}

// Every one of the 32 states of three doors and two sets, every term kept, against the path tracer in a scene where
// open doors are gone.
TEST(Doors, EveryStateIsExactWithAllTermsKept) {
    Scene scene = corridor();
    scene.combinations = {{{true, 0}, {true, 1}, {true, 2}}};
    BakedScene b(scene);
    b.bake(exact());
    double worst = 0, absolute = 0;
    for (uint32_t open = 0; open < 8; ++open)
        for (uint32_t sets = 0; sets < 4; ++sets) {
            const Compared c = compare(b, scene, open, sets, 40, 768, everywhere);
            // Four standard deviations of the reference's noise, and 2 % for the texels' size and the baker's own.
            EXPECT_LE(std::abs(c.baked - c.reference), 4 * c.noise + 0.02 * c.reference) << open << " " << sets;
            worst = std::max(worst, std::abs(c.baked / c.reference - 1));
            absolute += c.absolute / c.reference / 32;
        }
    printf("32 states: worst sum off by %.2f %%, mean absolute difference %.2f %%\n", 100 * worst, 100 * absolute);
}

// Without combinations, with all doors closed and with any one open, the light of a state is all there.
TEST(Doors, OneOpenDoorIsExactWhereTheOthersAreClosed) {
    const Scene scene = corridor();
    BakedScene b(scene);
    b.bake(exact());
    for (uint32_t open : {0u, 1u, 2u, 4u})
        for (uint32_t sets : {0u, 3u}) {
            const Compared c = compare(b, scene, open, sets, 40, 768, everywhere);
            // As in EveryStateIsExactWithAllTermsKept. Without what asks how a second door stands it is 6 to 13 % off.
            EXPECT_LE(std::abs(c.baked - c.reference), 4 * c.noise + 0.02 * c.reference) << open << " " << sets;
            printf("doors %u, sets %u: off by %.2f %%\n", open, sets, 100 * (c.baked / c.reference - 1));
        }
}

TEST(DoorPairs, ThoseInSightOfEachOtherAreFound) {
    Scene scene = corridor();
    EXPECT_EQ(doorsInSight(RayScene(scene)), (std::vector<DoorIndices>{{0, 1}, {0, 2}, {1, 2}}));
    // Larger than the corridor: here each face of a leaf is a mesh, whose points rounding may put above the ceiling.
    addSolid(scene, "partition", {-1, 0, 0}, {0.1f, 1.1f, 1.1f}, 0);
    EXPECT_EQ(doorsInSight(RayScene(scene)), (std::vector<DoorIndices>{{1, 2}}));
}

// A leaf against another one's back is hidden until that opens, and then it is what there is to see.
TEST(Doors, ALeafBehindALeafReflectsOnceTheFirstIsOpen) {
    Scene scene;
    const uint32_t white = addMaterial(scene, lambert(0.6f));
    addBox(scene, {2, 1, 1}, white);
    scene.doors = {{"front", false}, {"back", false}};
    for (uint32_t d = 0; d < 2; ++d)
        addSolid(scene, "leaf", {0.25f + 0.5f * static_cast<float>(d), 0, 0}, {0.25f, 1, 1}, white, d);
    scene.light_sets = {{"lamp", 1}};
    addPointLight(scene, {-1, 0.2f, 0.1f}, 100, BakeMode::Indirect).light_set = 0;
    BakedScene b(scene);
    b.bake(exact());
    const auto before_both = [](glm::vec3 p) { return p.x < -0.05f; };
    for (uint32_t open : {0u, 1u}) {
        const Compared c = compare(b, scene, open, 1, 40, 2048, before_both);
        EXPECT_NEAR(c.baked / c.reference, 1, 0.02 + 4 * c.noise / c.reference) << open;
        printf("door %u: off by %.2f %%\n", open, 100 * (c.baked / c.reference - 1));
    }
}

// One leaf that closes a corridor at x = -1 and, open, stands across it at x = 1: light reaches the middle alone.
Scene slidingDoor() {
    Scene scene;
    const uint32_t white = addMaterial(scene, lambert(0.6f)), leaf = addMaterial(scene, lambert(0.8f));
    addBox(scene, {3, 1, 1}, white);
    scene.doors = {{"slides", true}};
    addSolid(scene, "leaf", {-1, 0, 0}, {0.1f, 1, 1}, leaf, 0);
    for (SceneMesh& mesh : scene.meshes)
        if (mesh.door) mesh.open_from_closed[3] = {2, 0, 0, 1};
    scene.light_sets = {{"lamp", 1}};
    addPointLight(scene, {-2.2f, 0.2f, 0.1f}, 100, BakeMode::Indirect).light_set = 0;
    return scene;
}

TEST(Doors, AnOpenPoseBlocksAndReflects) {
    const Scene closed = slidingDoor();
    Scene both = closed;
    addOpenLeaves(both);
    BakedScene b(both);
    b.bake(exact());
    const auto room = [](float from, float to) { return [=](glm::vec3 p) { return p.x > from && p.x < to; }; };
    const auto left = room(-3, -1.15f), middle = room(-0.85f, 0.85f), right = room(1.15f, 3);
    for (uint32_t open : {0u, 1u}) {
        const Compared near = compare(b, closed, open, 1, 40, 4096, left);
        EXPECT_NEAR(near.baked / near.reference, 1, 0.02 + 4 * near.noise / near.reference) << open;
        // What an open door leaves of the room behind it: nothing at all, as the leaf stands across it.
        EXPECT_EQ(compare(b, closed, open, 1, 40, 8, right).baked, 0) << open;
    }
    const Compared lit = compare(b, closed, 1, 1, 40, 4096, middle), dark = compare(b, closed, 0, 1, 40, 8, middle);
    EXPECT_NEAR(lit.baked / lit.reference, 1, 0.02 + 4 * lit.noise / lit.reference);
    EXPECT_GT(lit.baked, 0);
    EXPECT_EQ(dark.baked, 0);
}

// A wall that a closed leaf covers is lit once the door is open.
TEST(Doors, WhatAnOpeningUncoversIsLit) {
    Scene scene;
    const uint32_t white = addMaterial(scene, lambert(0.6f));
    addBox(scene, {2, 1, 1}, white);
    scene.doors = {{"plug", false}};
    addSolid(scene, "leaf", {1.5f, 0, 0}, {0.5f, 1, 1}, white, 0);
    scene.light_sets = {{"lamp", 1}};
    addPointLight(scene, {-1, 0.2f, 0.1f}, 100, BakeMode::Full).light_set = 0;
    BakedScene b(scene);
    b.bake(exact());
    const auto covered = [](glm::vec3 p) { return p.x > 1.05f; };
    const Compared open = compare(b, scene, 1, 1, 40, 2048, covered), closed = compare(b, scene, 0, 1, 40, 8, covered);
    EXPECT_NEAR(open.baked / open.reference, 1, 0.02 + 4 * open.noise / open.reference);
    EXPECT_EQ(closed.baked, 0);
}

// A corridor of three doors: neighbours share a room, the outer two do not. What is suggested goes away once named, and
// is what a bake that keeps it adds.
TEST(Doors, PairsThatDependOnEachOtherAreFound) {
    Scene scene = corridor();
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
TEST(Doors, PairsAreMeasuredTheSameOneByOne) {
    Scene scene;
    const uint32_t white = addMaterial(scene, lambert(0.6f));
    scene.doors = {{"a", false}, {"b", false}, {"c", false}, {"d", false}};
    scene.light_sets = {{"lamp", 1}, {"other", 1}};
    for (uint32_t room = 0; room < 2; ++room) {
        const float away_m = 10 * static_cast<float>(room);
        addBox(scene, {3, 1, 1}, white);
        for (glm::vec3& p : scene.meshes.back().positions_m) p.z += away_m;
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
    const Series series = expandSeries(gatherer, settings, quiet);
    const std::vector<uint8_t> all(paths.groupCount(), 1);
    const auto together = doorFlux(gatherer, series, settings, all, quiet),
               one_by_one = doorFlux(gatherer, series, settings, all, quiet, nullptr, 0);
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
TEST(Doors, APairIsFoundWhereOneOfThemAloneChangesNothing) {
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

// Naming a pair splits the light of one open door into more and fainter terms, each with a threshold of its own. Where
// the first of them has records, nothing of the others is lost: it is as bright there as in a bake that keeps them all.
TEST(Doors, FaintTermsOfANamedPairCountForTheOneThatAsksForLess) {
    Scene scene = corridor();
    scene.combinations = {{{true, 0}, {true, 1}}, {{true, 1}, {true, 2}}};
    BakedScene kept(scene), cut(scene);
    BakeSettings settings{.series_rays = 128, .final_rays = 128, .emitter_samples = 2, .threshold = 0.3f};
    cut.bake(settings);
    settings.threshold = 0;
    kept.bake(settings);
    constexpr uint32_t set = 1;
    const auto ofFirstDoor = [](const BakedScene& b, size_t texel, bool alone) {
        double lux = 0;
        for (const ReceiverLight& l : b.baked.light.row(texel)) {
            const Term& t = b.baked.terms[l.term];
            if (t.group == set && t.doors_open == std::vector{0u} && (t.doors_closed.empty() || !alone))
                lux += static_cast<double>(l.light.irradiance_lux.y);
        }
        return lux;
    };
    double all = 0, named = 0, parts = 0;
    for (size_t i = 0; i < cut.texels.size(); ++i) {
        if (ofFirstDoor(cut, i, true) == 0) continue;
        all += ofFirstDoor(kept, i, false);
        named += ofFirstDoor(cut, i, false);
        for (const ReceiverLight& l : kept.baked.light.row(i)) {
            const Term& t = kept.baked.terms[l.term];
            const auto row = cut.baked.light.row(i);
            const bool lost = std::ranges::find(row, l.term, &ReceiverLight::term) == row.end();
            if (lost && t.group == set && t.doors_open == std::vector{0u})
                parts += static_cast<double>(l.light.irradiance_lux.y);
        }
    }
    printf("%.4f of the light is there, %.4f of it faint terms'\n", named / all, parts / all);
    // The rays are the same; the series lets go what lies below a tenth of 1 % of the thresholds' bases.
    EXPECT_NEAR(named / all, 1, 0.005);
    EXPECT_GT(parts / all, 0.02);  // there is something to lose
}

// A bright room, and one of the same size behind a doorway that the lamps of both sets light by a little of their
// bounces.
Scene brightAndDark() {
    Scene scene;
    const uint32_t white = addMaterial(scene, lambert(0.6f));
    addBox(scene, {4, 1.25f, 2}, white);
    const auto block = [&](glm::vec3 low, glm::vec3 high, std::optional<uint32_t> door = {}) {
        addSolid(scene, door ? "leaf" : "partition", 0.5f * (low + high), 0.5f * (high - low), white, door);
    };
    block({-0.1f, -1.25f, -2}, {0.1f, 1.25f, -0.25f});
    block({-0.1f, -1.25f, 0.25f}, {0.1f, 1.25f, 2});
    block({-0.1f, -0.65f, -0.25f}, {0.1f, 1.25f, 0.25f});
    scene.doors = {{"door", false}};
    block({-0.05f, -1.25f, -0.25f}, {0.05f, -0.65f, 0.25f}, 0);
    scene.light_sets = {{"near", 1}, {"far", 1}};
    addPointLight(scene, {-1.5f, 0.6f, 1.2f}, 100, BakeMode::Indirect).light_set = 0;
    addPointLight(scene, {-3.5f, 0.4f, -1.5f}, 100, BakeMode::Indirect).light_set = 1;
    return scene;
}

// What the thresholds leave of the light that a door lets into a dark room, each light set alone: against the path
// tracer. Records that end at the set's own threshold lose much more of it.
TEST(Doors, FaintLightThroughADoorIsKeptWhereItIsAllThereIs) {
    const Scene scene = brightAndDark();
    const auto dark = [](glm::vec3 p) { return p.x > 0.15f; };
    BakedScene kept(scene), cut(scene);
    BakeSettings settings{.series_rays = 64, .final_rays = 256, .emitter_samples = 0};
    kept.bake(settings);
    settings.door_share = 1;
    cut.bake(settings);
    const auto flux = [&](const BakedScene& b, uint32_t set) {
        double sum = 0;
        for (size_t i = 0; i < b.texels.size(); ++i)
            if (dark(b.place(i))) sum += inState(b, i, 1, set).y * static_cast<double>(b.texels.area_m2[i]);
        return sum;
    };
    for (const uint32_t set : {1u, 2u}) {
        const Compared c = compare(kept, scene, 1, set, 120, 2048, dark);
        const double error = c.baked / c.reference - 1, noise = c.noise / c.reference,
                     lost = 1 - flux(cut, set) / flux(kept, set);
        printf("set %u: sum off by %+.2f %% +- %.2f %%; ending with the set loses %.1f %%\n", set, 100 * error,
               100 * noise, 100 * lost);
        // 3 % for what lies below the thresholds, 2 % for the texels' size and the baker's own noise.
        EXPECT_NEAR(error, 0, 0.05 + 4 * noise) << set;
        EXPECT_GT(lost, 0.15) << set;
    }
    for (size_t t = 0; t < kept.baked.terms.size(); ++t) {
        if (kept.baked.terms[t].free()) continue;
        const float least = kept.baked.reports[t].threshold_lux, most = cut.baked.reports[t].threshold_lux;
        EXPECT_LE(least, most) << t;
        EXPECT_GE(least, 0.199f * most) << t;
    }
}

// Faint light that changes slowly is active in one piece: no texel without it among four that have it, none with it
// among four that do not. By each texel's own few rays alone 4 % are one or the other.
TEST(Doors, FaintLightIsActiveInOnePiece) {
    const Scene scene = brightAndDark();
    BakedScene b(scene);
    b.bake({.series_rays = 32, .final_rays = 32, .emitter_samples = 0});
    size_t with = 0, odd = 0;
    for (uint32_t t = 0; t < b.baked.terms.size(); ++t) {
        if (b.baked.terms[t].doors_open.empty()) continue;
        const auto has = [&](size_t i) {
            return std::ranges::find(b.baked.light.row(i), t, &ReceiverLight::term) != b.baked.light.row(i).end();
        };
        for (size_t i = 0; i < b.texels.size(); ++i) {
            size_t neighbours = 0, having = 0;
            for (const auto& [dx, dy] : {std::pair(-1, 0), {1, 0}, {0, -1}, {0, 1}})
                if (const uint32_t n = neighbourInChart(b.charts, b.texels, i, dx, dy); n != no_index)
                    ++neighbours, having += has(n);
            with += has(i);
            odd += neighbours == 4 && (has(i) ? having == 0 : having == 4);
        }
    }
    printf("%zu of %zu texels are odd\n", odd, with);
    ASSERT_GT(with, 1000u);
    EXPECT_LE(odd, with / 200);
}

}  // namespace
}  // namespace dimmer::cook::test
