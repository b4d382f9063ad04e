// Sets that are baked lamp by lamp give the light, the contributions and the charts of sets that are baked whole.
#include <gmock/gmock.h>
#include <pipeline/charted_level.h>
#include <pipeline/cooked_level.h>
#include <pipeline/lamps_apart.h>
#include <pipeline/small_level.h>

namespace dimmer::cook::test {
namespace {

using testing::ElementsAre;
using testing::Pointwise;

std::vector<std::string> names(const Scene& scene) {
    std::vector<std::string> out;
    for (const SceneLightSet& set : scene.light_sets) out.push_back(set.name);
    return out;
}

// A room of 2 m: "mixed" has two lamps and two panels of one material, "lone" one lamp; two doors, whose leaves are
// boxes within the room, and their combination for "mixed".
LevelFile mixedRoom(const json& walls) {
    LevelFile level;
    const int paint = level.addMaterial(walls), glow = addWhite(level, {{"emissiveFactor", {0.5, 0.4, 0.1}}});
    level.addNode({{"name", "room"}, {"mesh", addRoomMesh(level, {0, 0, 0}, 2, paint)}});
    const auto lamp = [&](const char* node, const char* set, const json& color, double intensity, const json& place) {
        const int index = level.addLight(node, {{"type", "point"}, {"intensity", intensity}, {"color", color}},
                                         {{"dimmer_light_set", set}, {"dimmer_bake", "full"}});
        level.node(index)["translation"] = place;
    };
    lamp("red", "mixed", {1, 0.2, 0.1}, 80, {0.4, 1.2, 0.7});
    lamp("blue", "mixed", {0.1, 0.2, 1}, 300, {1.5, 0.6, 1.3});
    lamp("alone", "lone", {1, 1, 1}, 100, {1, 1.6, 1});
    for (const double x : {0.4, 1.2})
        level.addNode({{"name", "panel"},
                       {"mesh", level.addSquareMesh(glow)},
                       {"translation", {x, 1.9, 0.2}},
                       {"scale", {0.2, 0.2, 0.2}},
                       {"extras", {{"dimmer_light_set", "mixed"}}}});
    for (const char* door : {"left", "right"})
        level.addNode({{"name", door},
                       {"mesh", addRoomMesh(level, {door[0] == 'l' ? 0.2f : 1.2f, 0.2f, 0.9f}, 0.4f, paint)},
                       {"extras", {{"dimmer_door", door}}}});
    level.document["scenes"][0]["extras"] = {{"dimmer_combinations", {{"mixed", "door:left", "door:right"}}}};
    return level;
}

json black() {
    return {{"pbrMetallicRoughness", {{"baseColorFactor", {0, 0, 0, 1}}, {"metallicFactor", 0}}},
            {"extensions", {{"KHR_materials_specular", {{"specularFactor", 0}}}}}};
}

json white() {
    return {{"pbrMetallicRoughness", {{"baseColorFactor", {0.7, 0.7, 0.7, 1}}, {"metallicFactor", 0}}}};
}

Expected<PackData> cookApart(const LevelFile& level, uint32_t lamps_apart) {
    Profile profile = smallProfile();
    profile.draft.lamps_apart = lamps_apart;
    return cookLevel(level, profile);
}

TEST(LampsApart, EveryLampIsAGroupAndAllSurfacesAreOne) {
    auto scene = mixedRoom(white()).import();
    ASSERT_TRUE(scene) << scene.error().message;
    const Scene whole = *scene;
    const LampGroups parts = takeLampsApart(*scene, 3);
    EXPECT_THAT(names(*scene), ElementsAre("mixed, surfaces", "mixed, lamp red", "mixed, lamp blue", "lone"));
    EXPECT_THAT(parts.whole, ElementsAre(0, 1, 1, 1, 2));
    EXPECT_THAT(parts.ofParts({0.1f, 0.2f, 0.3f}), ElementsAre(0.1f, 0.2f, 0.2f, 0.2f, 0.3f));
    EXPECT_THAT(scene->lights, ElementsAre(testing::Field(&PunctualLight::light_set, 1u),
                                           testing::Field(&PunctualLight::light_set, 2u),
                                           testing::Field(&PunctualLight::light_set, 3u)));
    // The combination for each part.
    ASSERT_EQ(scene->combinations.size(), 3u);
    for (uint32_t p = 0; p < 3; ++p) {
        EXPECT_EQ(scene->combinations[p].size(), 3u);
        EXPECT_EQ(scene->combinations[p][0].index, p);
        EXPECT_FALSE(scene->combinations[p][0].is_door);
        EXPECT_TRUE(scene->combinations[p][1].is_door);
    }
    // One lamp too many.
    Scene untouched = whole;
    EXPECT_TRUE(takeLampsApart(untouched, 2).sets.empty());
    EXPECT_THAT(names(untouched), ElementsAre("mixed", "lone"));
}

TEST(LampsApart, NodesMayShareAName) {
    LevelFile level = mixedRoom(white());
    for (json& node : level.document["nodes"])
        if (node["name"] == "blue") node["name"] = "red";
    auto scene = level.import();
    ASSERT_TRUE(scene) << scene.error().message;
    takeLampsApart(*scene, 8);
    EXPECT_THAT(names(*scene), ElementsAre("mixed, surfaces", "mixed, lamp red", "mixed, lamp red (2)", "lone"));
}

// Of black walls no light comes back, and that of lamps baked in full has no noise: but for where panels shine it is
// the same to a step of the format, at most a 256th of the brightest channel.
TEST(LampsApart, GiveTheLightOfTheSet) {
    LevelFile level = mixedRoom(black());
    for (json& node : level.document["nodes"])
        if (node["name"] == "panel") node["extras"].erase("dimmer_light_set");
    const auto whole = cookApart(level, 0), apart = cookApart(level, 8);
    ASSERT_TRUE(whole && apart);
    const Pack a = *Pack::fromData(PackData(*whole)), b = *Pack::fromData(PackData(*apart));
    std::vector<QueryPoint> points;
    for (int i = 1; i < 20; ++i) points.push_back({{0.1f * static_cast<float>(i), 0, 1}, {0, 1, 0}});
    for (const char* state : {"all=0,mixed=1", "all=0,mixed=1/0.5/0.2", "lone=1,mixed=1"}) {
        const auto before = sampled(a, points, state), after = sampled(b, points, state);
        double lit = 0;
        for (size_t i = 0; i < points.size(); ++i)
            for (int c = 0; c < 3; ++c) {
                lit += before[i][c];
                const double brightest = std::max({before[i].x, before[i].y, before[i].z});
                EXPECT_NEAR(after[i][c], before[i][c], brightest / 256) << state << ", point " << i << ", " << c;
            }
        EXPECT_GT(lit / static_cast<double>(points.size()), 10) << state;
    }
}

// With light from walls and panels, whose noise differs: over the floor the same light. 64 texels of a noise of about
// 10 % each are 1.3 % in the mean, two such means differ by 1.8 %; twice that.
TEST(LampsApart, GiveTheContributionsOfTheSet) {
    const LevelFile level = mixedRoom(white());
    const auto whole = cookApart(level, 0), apart = cookApart(level, 8);
    ASSERT_TRUE(whole && apart);
    const auto lists = [](const PackData& pack) {
        std::vector<std::tuple<std::optional<uint32_t>, std::vector<uint32_t>, std::vector<uint32_t>>> out;
        for (const Contribution& c : pack.contributions) out.emplace_back(c.light_set, c.doors_open, c.doors_closed);
        return out;
    };
    EXPECT_EQ(lists(*apart), lists(*whole));
    EXPECT_THAT(
        apart->elements,
        Pointwise(testing::Truly([](const auto& pair) { return std::get<0>(pair).name == std::get<1>(pair).name; }),
                  whole->elements));
    const auto scene = level.import();
    ASSERT_TRUE(scene);
    EXPECT_TRUE(chartAgain(*scene, *apart)) << "verify knows the level again";
    const Pack a = *Pack::fromData(PackData(*whole)), b = *Pack::fromData(PackData(*apart));
    std::vector<QueryPoint> points;
    for (int x = 1; x < 16; ++x)
        for (int z = 1; z < 16; ++z)
            points.push_back({{0.125f * static_cast<float>(x), 0, 0.125f * static_cast<float>(z)}, {0, 1, 0}});
    for (const char* state : {"all=0,mixed=1", "all=0,mixed=1,door:left=1,door:right=1"}) {
        glm::dvec3 before(0), after(0);
        for (const glm::dvec3& e : sampled(a, points, state)) before += e;
        for (const glm::dvec3& e : sampled(b, points, state)) after += e;
        for (int c = 0; c < 3; ++c) EXPECT_NEAR(after[c] / before[c], 1, 0.04) << state << ", " << c;
    }
}

}  // namespace
}  // namespace dimmer::cook::test
