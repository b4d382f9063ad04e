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
    EXPECT_TRUE(takeLampsApart(untouched, 2).none());
    EXPECT_THAT(names(untouched), ElementsAre("mixed", "lone"));
}

// One set of two lamps, of 2 and 30 in luminance, seen by two receivers, over no door and over one.
TEST(LampsApart, PutTogetherIsTheSumWithTheRecordsOfAll) {
    auto scene = mixedRoom(white()).import();
    ASSERT_TRUE(scene) << scene.error().message;
    const Scene level = *scene;
    const LampGroups parts = takeLampsApart(*scene, 3);  // groups 1 to 3 are "mixed"'s, 4 is "lone"
    Baked baked;
    for (uint32_t g = 0; g < 5; ++g) baked.terms.push_back({g, {}, {}});
    baked.terms.push_back({2, {0}, {}});
    baked.terms.push_back({3, {0}, {}});
    baked.reports.resize(baked.terms.size());
    baked.reports[2].energy = 10;
    baked.reports[2].energy_dropped = 0.5;
    baked.reports[3].energy = 2;
    baked.reports[3].energy_dropped = 0.1;
    const auto texel = [](uint32_t term, float lux, float variance, float keep) {
        return ReceiverLight{term, {glm::vec3(lux), glm::vec4(lux / 2)}, variance, keep};
    };
    Sparse<ReceiverLight>::Builder light(2);
    light.put(0,
              std::vector{texel(0, 1, 0, INFINITY), texel(2, 8, 3, 0.5f), texel(3, 4, 2, 0.25f), texel(5, 2, 1, 0.1f)});
    light.put(1,
              std::vector{texel(0, 1, 0, INFINITY), texel(3, 5, 1, 0.75f), texel(4, 7, 1, 0.2f), texel(6, 6, 1, 0.3f)});
    baked.light = light.finish();
    const auto probes = [] {
        Sparse<ProbeTermLight>::Builder rows(1);
        ProbeLight dim, bright;
        dim.radiance.fill(glm::vec3(1));
        bright.radiance.fill(glm::vec3(10));
        rows.put(0, std::vector{ProbeTermLight{2, dim, 0, 0}, ProbeTermLight{3, bright, 0, 0}});
        return rows.finish();
    };
    baked.grid.light = probes();
    baked.local_light = probes();
    const SetScales scales{{glm::vec3(1), glm::vec3(1), glm::vec3(2), glm::vec3(30), glm::vec3(1)}, {}, {}};
    putTogether(parts, scales, *scene, baked);

    EXPECT_EQ(names(*scene), names(level));
    for (size_t l = 0; l < level.lights.size(); ++l) EXPECT_EQ(scene->lights[l].light_set, level.lights[l].light_set);
    for (size_t m = 0; m < level.meshes.size(); ++m) EXPECT_EQ(scene->meshes[m].light_set, level.meshes[m].light_set);
    ASSERT_EQ(scene->combinations.size(), 1u);
    ASSERT_EQ(baked.terms.size(), 4u);  // always, mixed, lone, and mixed through the door
    EXPECT_EQ(baked.terms[3].group, 1u);
    EXPECT_THAT(baked.terms[3].doors_open, ElementsAre(0u));
    const auto row = baked.light.row(0);
    ASSERT_EQ(row.size(), 3u);
    EXPECT_EQ(row[1].term, 1u);
    EXPECT_EQ(row[1].light.irradiance_lux, glm::vec3(12));
    EXPECT_EQ(row[1].light.tilted_lux, glm::vec4(6));
    EXPECT_EQ(row[1].variance, 5);
    EXPECT_EQ(row[1].keep, 0.5f);
    EXPECT_EQ(row[2].term, 3u);
    EXPECT_THAT(baked.light.row(1),
                ElementsAre(testing::Field(&ReceiverLight::term, 0u), testing::Field(&ReceiverLight::term, 1u),
                            testing::Field(&ReceiverLight::term, 2u), testing::Field(&ReceiverLight::term, 3u)));
    for (const auto* of_probes : {&baked.grid.light, &baked.local_light}) {
        ASSERT_EQ(of_probes->row(0).size(), 1u);
        EXPECT_EQ(of_probes->row(0)[0].light.radiance[8], glm::vec3(11));
    }
    EXPECT_EQ(baked.reports[1].receivers, 4u);  // two texels and two probes
    // (2 * 10 * 0.5 + 30 * 2 * 0.1) / (2 * 10 + 30 * 2)
    EXPECT_NEAR(baked.reports[1].energy, 80, 1e-4);
    EXPECT_NEAR(baked.reports[1].energy_dropped, 0.2, 1e-6);
}

// A threshold that names the set is that of all its lamps, and of no other's.
TEST(LampsApart, HaveTheThresholdOfTheSet) {
    const LevelFile level = mixedRoom(white());
    Profile profile = smallProfile();
    profile.draft.lamps_apart = 8;
    const auto before = cookLevel(level, profile);
    profile.set_thresholds["mixed"] = 1;
    const auto after = cookLevel(level, profile);
    ASSERT_TRUE(before && after);
    const auto receivers = [](const PackData& pack, uint32_t set) {
        uint64_t sum = 0;
        for (const Contribution& c : pack.contributions)
            if (c.light_set == set) sum += c.receivers;
        return sum;
    };
    EXPECT_LT(receivers(*after, 0), receivers(*before, 0));
    EXPECT_EQ(receivers(*after, 1), receivers(*before, 1));
}

TEST(LampsApart, NodesMayShareANameOrHaveAnOddOne) {
    LevelFile level = mixedRoom(white());
    for (json& node : level.document["nodes"])
        if (node["name"] == "blue") node["name"] = "red";
    auto scene = level.import();
    ASSERT_TRUE(scene) << scene.error().message;
    for (PunctualLight& light : scene->lights) light.node += "\t\x1b";
    takeLampsApart(*scene, 8);
    EXPECT_THAT(names(*scene), ElementsAre("mixed, surfaces", "mixed, lamp red??", "mixed, lamp red?? (2)", "lone"));
}

// Of black walls and panels no light comes back, and that of lamps baked in full has no noise: but for where panels
// shine it is the same to a step of the format, at most a 256th of the brightest channel.
TEST(LampsApart, GiveTheLightOfTheSet) {
    LevelFile level = mixedRoom(black());
    for (json& material : level.document["materials"]) material.update(black());
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

// Outdoors and in: an open room under a sky, with a sun, a lamp in a corner and, if asked for, a set; a door's leaf
// stands in the middle.
LevelFile daylit(const json& walls, bool with_set) {
    LevelFile level;
    const int paint = level.addMaterial(walls);
    level.addNode({{"name", "ground"},
                   {"mesh", level.addSquareMesh(paint)},
                   {"translation", {1, 0, -1}},
                   {"rotation", {-std::sqrt(0.5), 0, 0, std::sqrt(0.5)}},
                   {"scale", {2, 2, 2}}});
    level.addNode({{"name", "leaf"},
                   {"mesh", addRoomMesh(level, {0.8f, 0.2f, -1.2f}, 0.4f, paint)},
                   {"extras", {{"dimmer_door", "hatch"}}}});
    const json full = {{"dimmer_bake", "full"}};
    const int sun = level.addLight("sun", {{"type", "directional"}, {"intensity", 40}, {"color", {1, 0.9, 0.7}}}, full);
    level.node(sun)["rotation"] = {-std::sqrt(0.5), 0, 0, std::sqrt(0.5)};
    const int lamp = level.addLight("corner", {{"type", "point"}, {"intensity", 3}}, full);
    level.node(lamp)["translation"] = {0.3, 0.5, -0.3};
    if (with_set) {
        const int of_set = level.addLight("bulb", {{"type", "point"}, {"intensity", 20}},
                                          {{"dimmer_light_set", "bulbs"}, {"dimmer_bake", "full"}});
        level.node(of_set)["translation"] = {1.7, 0.5, -1.7};
    }
    level.document["scenes"][0]["extras"] = {{"dimmer_sky_color", {0.8, 0.9, 1}}, {"dimmer_sky_luminance", 5}};
    return level;
}

TEST(LampsApart, LampsOfNoSetAreApartFromTheSky) {
    auto scene = daylit(white(), true).import();
    ASSERT_TRUE(scene) << scene.error().message;
    const Scene level = *scene;
    const LampGroups parts = takeLampsApart(*scene, 3);
    EXPECT_THAT(names(*scene), ElementsAre("bulbs", "always-on light, lamp sun", "always-on light, lamp corner"));
    EXPECT_THAT(parts.whole, ElementsAre(0, 1, 0, 0));
    EXPECT_THAT(scene->light_sets, ElementsAre(testing::Field(&SceneLightSet::always_on, false),
                                               testing::Field(&SceneLightSet::always_on, true),
                                               testing::Field(&SceneLightSet::always_on, true)));
    Baked nothing;
    for (uint32_t g = 0; g < 4; ++g) nothing.terms.push_back({g, {}, {}});
    nothing.reports.resize(4);
    putTogether(parts, {std::vector(4, glm::vec3(1)), {}, {}}, *scene, nothing);
    EXPECT_EQ(nothing.terms.size(), 2u);
    EXPECT_EQ(names(*scene), names(level));
    for (size_t l = 0; l < level.lights.size(); ++l) EXPECT_EQ(scene->lights[l].light_set, level.lights[l].light_set);
    // Sky and two lamps are three.
    Scene untouched = level;
    EXPECT_TRUE(takeLampsApart(untouched, 2).none());
}

// The ground of 16 texels per square metre, the leaf over it closed and open; with sets beside and without any. What
// lamps do is exact, to a step of the format (a 256th) and the filter for noise, which looks at the sum of both or at
// the sky's light alone; the sky's light has some 5 % of noise at a texel of 32 rays, in the mean of the points 0.4.
TEST(LampsApart, GiveTheLightThatIsAlwaysOn) {
    for (const bool with_set : {true, false}) {
        const LevelFile level = daylit(white(), with_set);
        const auto whole = cookApart(level, 0), apart = cookApart(level, 8);
        ASSERT_TRUE(whole && apart) << apart.error().message;
        EXPECT_EQ(whole->contributions.size(), apart->contributions.size());
        const Pack a = *Pack::fromData(PackData(*whole)), b = *Pack::fromData(PackData(*apart));
        std::vector<QueryPoint> points;
        for (int x = 1; x < 16; ++x)
            for (int z = 1; z < 16; ++z)
                points.push_back({{0.125f * static_cast<float>(x), 0, -0.125f * static_cast<float>(z)}, {0, 1, 0}});
        for (const std::string state : {"", "door:hatch=1"}) {
            glm::dvec3 before(0), after(0);
            const auto at_whole = sampled(a, points, state), at_parts = sampled(b, points, state);
            for (size_t i = 0; i < points.size(); ++i) {
                before += at_whole[i];
                after += at_parts[i];
                EXPECT_NEAR(at_parts[i].y, at_whole[i].y, 0.15 * at_whole[i].y) << state << ", point " << i;
            }
            EXPECT_GT(before.y / static_cast<double>(points.size()), 20) << state;
            for (int c = 0; c < 3; ++c) EXPECT_NEAR(after[c] / before[c], 1, 0.01) << state << ", " << c;
        }
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
