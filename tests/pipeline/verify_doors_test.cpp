// What verify says of doors: of packs that are right, too dark by half, and walled up behind the door.
#include <bake/test_scenes.h>
#include <pipeline/cooked_level.h>
#include <pipeline/verify.h>

namespace dimmer::cook::test {
namespace {

// Three rooms of 2 m in a row along x, parted by doors that fill the corridor: a lamp in the first, a little always-on
// light in the last. A second set shines in a box of its own, far away.
Scene threeRooms(bool walled_up = false) {
    Scene scene;
    scene.file = "three rooms";
    const uint32_t white = addMaterial(scene, lambert(0.5f)), glow = addMaterial(scene, emissive(glm::vec3(20)));
    addBox(scene, {3, 1, 1}, white);
    scene.doors = {{"near", false}, {"far", false}};
    addSolid(scene, "leaf", {-1, 0, 0}, {0.1f, 1, 1}, white, 0);
    addSolid(scene, "leaf", {1, 0, 0}, {0.1f, 1, 1}, white, 1);
    for (float x : {-1.0f, 1.0f})
        if (walled_up) addSolid(scene, "wall", {x, 0, 0}, {0.09f, 1, 1}, white);  // within the leaf
    scene.light_sets = {{"lamp", 1}, {"away", 1}};
    addPointLight(scene, {-2, 0.2f, 0.1f}, 100, BakeMode::Indirect).light_set = 0;
    addPointLight(scene, {30, 0, 0}, 100, BakeMode::Indirect).light_set = 1;
    addQuad(scene, "panel", {2, 0.95f, 0}, {0.3f, 0, 0}, {0, 0, 0.3f}, glow);
    addSolid(scene, "box", {30, -1, 0}, {1, 0.1f, 1}, white);
    return scene;
}

std::vector<DoorReport> doorsOf(const Pack& pack, const std::string& state = "") {
    SilentProgress progress;
    const auto report = verify(
        threeRooms(), pack, {.state = state, .points = 60, .paths_max = 4096, .sets = false, .doors = true}, progress);
    EXPECT_TRUE(report) << report.error().message;
    return report ? report->doors : std::vector<DoorReport>{};
}

using Row = std::pair<std::string, std::string>;
std::vector<Row> rowsOf(std::span<const DoorReport> doors) {
    std::vector<Row> out;
    for (const DoorReport& d : doors) out.emplace_back(d.door, d.light);
    return out;
}

TEST(VerifyDoors, WhatARightPackDoesIsFoundRight) {
    const auto pack = cooked(threeRooms(), "draft");
    ASSERT_TRUE(pack);
    const auto doors = doorsOf(*pack);
    // Each door opens on light of one kind alone; the set far away has no part in it.
    EXPECT_EQ(rowsOf(doors),
              (std::vector<Row>{{"near", "all"}, {"near", "lamp"}, {"far", "all"}, {"far", "always on"}}));
    for (const DoorReport& d : doors) {
        EXPECT_GT(d.effect.points, 20u) << d.door << ", " << d.light;
        EXPECT_LT(d.effect.error, 0.1) << d.door << ", " << d.light;  // draft's noise, and texels of 25 cm
        EXPECT_EQ(d.light_error.has_value(), d.light == "all");
        EXPECT_LT(d.light_error.value_or(0), 0.1) << d.door;
    }
}

TEST(VerifyDoors, DoorsThatTheStateOpensStayOpen) {
    const auto pack = cooked(threeRooms(), "draft");
    ASSERT_TRUE(pack);
    const auto doors = doorsOf(*pack, "door:near=1");
    EXPECT_EQ(rowsOf(doors), (std::vector<Row>{{"far", "all"}, {"far", "always on"}, {"far", "lamp"}}));
}

// Half the light everywhere is half of what each door does.
TEST(VerifyDoors, HalfTheLightIsHalfOff) {
    const auto right = cooked(threeRooms(), "draft");
    ASSERT_TRUE(right);
    PackData data = right->data();
    data.exposure *= 2;
    const auto pack = Pack::fromData(std::move(data));
    ASSERT_TRUE(pack) << pack.error().message;
    const auto doors = doorsOf(*pack);
    ASSERT_EQ(doors.size(), 4u);
    for (const DoorReport& d : doors) EXPECT_NEAR(d.effect.error, 0.5, 0.05) << d.door << ", " << d.light;
}

// A pack in which nothing comes through scores 100 %: drawn by the pack alone, no place there would have been looked
// at.
TEST(VerifyDoors, IgnoringADoorScoresOne) {
    const auto pack = cooked(threeRooms(true), "draft");
    ASSERT_TRUE(pack);
    const auto doors = doorsOf(*pack);
    ASSERT_EQ(doors.size(), 4u);
    for (const DoorReport& d : doors) {
        EXPECT_GT(d.effect.points, 20u) << d.door << ", " << d.light;
        // The wall stands 1 cm behind the leaf's face, in the midst of texels of 25 cm.
        EXPECT_NEAR(d.effect.error, 1, 0.1) << d.door << ", " << d.light;
    }
}

}  // namespace
}  // namespace dimmer::cook::test
