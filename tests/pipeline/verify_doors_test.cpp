// What verify says of doors: of packs that are right, too dark by half, and walled up behind the door.
#include <bake/test_scenes.h>
#include <pipeline/cooked_level.h>
#include <pipeline/draw_places.h>
#include <pipeline/verify.h>

namespace dimmer::cook::test {
namespace {

// Three rooms of 2 m in a row along x, parted by doors that fill the corridor: a lamp in the first, a little always-on
// light in the last. A second set shines on a box of its own, far away, in whose shadow leaves lie that do nothing.
Scene threeRooms(bool walled_up = false) {
    Scene scene;
    scene.file = "three rooms";
    const uint32_t white = addMaterial(scene, lambert(0.5f)), glow = addMaterial(scene, emissive(glm::vec3(20)));
    addBox(scene, {3, 1, 1}, white);
    scene.doors = {{"near", false}, {"far", false}};
    for (uint32_t d = 0; d < 2; ++d) {
        const glm::vec3 doorway(d == 0 ? -1 : 1, 0, 0);
        if (walled_up) addSolid(scene, "wall", doorway, {0.1f, 1, 1}, white);
        addSolid(scene, "leaf", walled_up ? glm::vec3(30, -3, 0) : doorway, {0.1f, 1, 1}, white, d);
    }
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

std::string lightOf(const DoorReport& d) {
    if (d.light == DoorReport::Light::Set) return d.light_set;
    return d.light == DoorReport::Light::All ? "all" : "always on";
}

using Row = std::pair<std::string, std::string>;
std::vector<Row> rowsOf(std::span<const DoorReport> doors) {
    std::vector<Row> out;
    for (const DoorReport& d : doors) out.emplace_back(d.door, lightOf(d));
    return out;
}

TEST(DrawPlaces, SpeakForAllOfThem) {
    // A tenth of the candidates has nearly all of the density, and the opposite tenth most of what is asked for.
    constexpr size_t n = 10000;
    std::vector<double> density(n, 0.01), asked(n, 1);
    for (size_t i = 0; i < n / 10; ++i) density[i] = 1, asked[n - 1 - i] = 20;
    double truth = 0, mean = 0, squares = 0;
    for (double a : asked) truth += a;
    constexpr int seeds = 400;
    for (uint32_t seed = 0; seed < seeds; ++seed) {
        const DrawnPlaces drawn = drawPlaces(density, 300, seed);
        ASSERT_EQ(drawn.index.size(), drawn.weight.size());
        EXPECT_TRUE(std::ranges::is_sorted(drawn.index));
        double sum = 0;
        for (size_t i = 0; i < drawn.index.size(); ++i) sum += drawn.weight[i] * asked[drawn.index[i]];
        mean += sum / seeds;
        squares += sum * sum / seeds;
    }
    EXPECT_NEAR(mean, truth, 4 * std::sqrt((squares - mean * mean) / seeds));
    EXPECT_LT(std::sqrt((squares - mean * mean) / seeds), 0.02 * truth);
    // A candidate may be drawn more than once, and is one place.
    const DrawnPlaces one = drawPlaces(std::array{0.0, 5.0, 0.0}, 7, 1);
    EXPECT_EQ(one.index, std::vector<size_t>{1});
    EXPECT_NEAR(one.weight[0], 1, 1e-12);
    EXPECT_TRUE(drawPlaces({}, 7, 1).index.empty());
    EXPECT_TRUE(drawPlaces(std::array{0.0, 0.0}, 7, 1).index.empty());
}

TEST(VerifyDoors, WhatARightPackDoesIsFoundRight) {
    const auto pack = cooked(threeRooms(), "draft");
    ASSERT_TRUE(pack);
    const auto doors = doorsOf(*pack);
    // Each door opens on light of one kind alone; the set far away has no part in it.
    EXPECT_EQ(rowsOf(doors),
              (std::vector<Row>{{"near", "all"}, {"near", "lamp"}, {"far", "all"}, {"far", "always on"}}));
    for (const DoorReport& d : doors) {
        EXPECT_GT(d.effect.points, 20u) << d.door << ", " << lightOf(d);
        EXPECT_LT(d.effect.error, 0.1) << d.door << ", " << lightOf(d);  // draft's noise, and texels of 25 cm
        EXPECT_EQ(d.light_there.has_value(), d.light == DoorReport::Light::All);
        EXPECT_LT(d.light_there.value_or(EffectFigures{}).error, 0.1) << d.door;
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
    for (const DoorReport& d : doors) EXPECT_NEAR(d.effect.error, 0.5, 0.05) << d.door << ", " << lightOf(d);
}

// Light behind a door that lets none through: no share of what the door does, and so said beside.
TEST(VerifyDoors, LightThatThePackInventsIsFound) {
    Scene lit = threeRooms();
    lit.lights[1].position_m = {0, 0.2f, 0.1f};  // the set "away" between both doors, for the pack
    const auto pack = cooked(lit, "draft");
    ASSERT_TRUE(pack);
    const auto doors = doorsOf(*pack);
    const auto away = std::ranges::find(doors, "away", lightOf);
    ASSERT_NE(away, doors.end());
    EXPECT_EQ(away->effect.points, 0u);
    EXPECT_EQ(away->effect.elsewhere, 1);
    for (const char* door : {"near", "far"}) {
        const auto all =
            std::ranges::find(doors, Row(door, "all"), [](const auto& d) { return Row(d.door, lightOf(d)); });
        ASSERT_NE(all, doors.end());
        EXPECT_GT(all->effect.elsewhere + all->effect.error, 0.3) << door;
    }
}

// A pack in which walls stand in the doorways, and the leaves elsewhere, scores 100 %.
TEST(VerifyDoors, IgnoringADoorScoresOne) {
    const auto pack = cooked(threeRooms(true), "draft");
    ASSERT_TRUE(pack);
    const auto doors = doorsOf(*pack);
    ASSERT_EQ(doors.size(), 4u);
    for (const DoorReport& d : doors) {
        EXPECT_GT(d.effect.points, 20u) << d.door << ", " << lightOf(d);
        EXPECT_NEAR(d.effect.measured_error, 1, 1e-3) << d.door << ", " << lightOf(d);
    }
}

}  // namespace
}  // namespace dimmer::cook::test
