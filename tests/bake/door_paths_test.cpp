// Which terms light over doors has, and how rays meet leaves.
#include <bake/baked_scene.h>
#include <bake/door_paths.h>
#include <bake/door_rays.h>
#include <bake/test_scenes.h>

#include <bit>
#include <map>

namespace dimmer::cook::test {
namespace {

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

}  // namespace
}  // namespace dimmer::cook::test
