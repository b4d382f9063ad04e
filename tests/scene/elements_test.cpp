// Light sets, doors, combinations, and the other dimmer_* keys.
#include <scene/expectations.h>

#include <cmath>

namespace dimmer::cook::test {
namespace {

const json point_light = {{"type", "point"}, {"intensity", 10}};

LevelFile levelWithLamp(const json& extras) {
    LevelFile level = LevelFile::withFloor();
    level.addLight("lamp", point_light, extras);
    return level;
}

int addGlow(LevelFile& level) {
    return level.addMaterial({{"name", "glow"}, {"emissiveFactor", {1, 1, 1}}});
}

TEST(SceneElements, LightSetsInOrderOfAppearanceShareNames) {
    LevelFile level = levelWithLamp({{"dimmer_light_set", "hall"}});
    level.addLight("lamp2", point_light, {{"dimmer_light_set", "alarm"}, {"dimmer_max_weight", 1.5}});
    level.addLight("lamp3", point_light, {{"dimmer_light_set", "hall"}, {"dimmer_max_weight", 3}});
    level.addLight("lamp4", point_light, {{"dimmer_light_set", "hall"}, {"dimmer_max_weight", 2}});
    level.addLight("lamp5", point_light);
    const auto scene = level.import();
    ASSERT_IMPORTED(scene);
    ASSERT_EQ(scene->light_sets.size(), 2u);
    EXPECT_EQ(scene->light_sets[0].name, "hall");
    EXPECT_EQ(scene->light_sets[0].max_weight, 3.0f);
    EXPECT_EQ(scene->light_sets[1].name, "alarm");
    EXPECT_EQ(scene->light_sets[1].max_weight, 1.5f);
    ASSERT_EQ(scene->lights.size(), 5u);
    EXPECT_EQ(scene->lights[2].light_set, 0u);
    EXPECT_EQ(scene->lights[1].light_set, 1u);
    EXPECT_FALSE(scene->lights[4].light_set);
}

TEST(SceneElements, KeysOfTheLightSpeakWhenTheNodeHasNone) {
    LevelFile level = levelWithLamp({{"dimmer_bake", "full"}});
    level.document["extensions"]["KHR_lights_punctual"]["lights"][0]["extras"] = {{"dimmer_light_set", "hall"},
                                                                                  {"dimmer_bake", "none"}};
    const auto scene = level.import();
    ASSERT_IMPORTED(scene);
    EXPECT_EQ(scene->lights[0].light_set, 0u);
    EXPECT_EQ(scene->lights[0].bake, BakeMode::Full);  // the node's own key wins
}

TEST(SceneElements, BakeModes) {
    for (const auto& [text, mode] :
         {std::pair{"indirect", BakeMode::Indirect}, {"full", BakeMode::Full}, {"none", BakeMode::None}}) {
        const auto scene = levelWithLamp({{"dimmer_bake", text}}).import();
        ASSERT_IMPORTED(scene);
        ASSERT_EQ(scene->lights.size(), 1u);
        EXPECT_EQ(scene->lights[0].bake, mode);
    }
    expectBadInput(levelWithLamp({{"dimmer_bake", "direct"}}).import(),
                   {"node 'lamp'", "dimmer_bake", "indirect", "direct"});
}

TEST(SceneElements, KeysOfOtherThingsAreWarnedOf) {
    LevelFile level = levelWithLamp({{"dimmer_texel_density", 4}});
    level.node(0)["extras"] = {{"dimmer_bake", "full"}};
    const auto scene = level.import();
    ASSERT_IMPORTED(scene);
    expectWarning(*scene, {"node 'floor'", "dimmer_bake"});
    expectWarning(*scene, {"node 'lamp'", "dimmer_texel_density"});
    level.node(0)["extras"] = {{"dimmer_bake", "ful"}};
    expectBadInput(level.import(), {"node 'floor'", "dimmer_bake", "'ful'"});
}

// Of an empty and a camera as of a lamp; nothing is handed down to what is below.
TEST(SceneElements, KeysOfMeshesAndLightsOnOtherNodesAreWarnedOf) {
    for (const bool camera : {false, true}) {
        LevelFile level = LevelFile::withFloor();
        json node = {{"name", "group"}};
        if (camera) {
            level.document["cameras"] = {{{"type", "perspective"}, {"perspective", {{"yfov", 1}, {"znear", 0.1}}}}};
            node["camera"] = 0;
        }
        const int group = level.addNode(node);
        const std::pair<const char*, json> keys[] = {{"dimmer_texel_density", 8},
                                                     {"dimmer_grid_spacing", 1},
                                                     {"dimmer_lighting", "none"},
                                                     {"dimmer_bake", "full"},
                                                     {"dimmer_max_weight", 2}};
        for (const auto& [key, value] : keys) {
            level.node(group)["extras"] = {{key, value}};
            const auto scene = level.import();
            ASSERT_IMPORTED(scene);
            EXPECT_EQ(scene->warnings.size(), 1u) << key;
            expectWarning(*scene, {"node 'group'", std::string("'") + key + "'", "ignored"});
        }
        level.node(group)["extras"] = {{"dimmer_bake", "ful"}};
        expectBadInput(level.import(), {"node 'group'", "dimmer_bake", "'ful'"});
        level.node(group)["extras"] = {{"dimmer_lighting", "dynamic"}};  // a place for what moves
        const auto place = level.import();
        ASSERT_IMPORTED(place);
        EXPECT_TRUE(place->warnings.empty());
        EXPECT_EQ(place->dynamic_places.size(), 1u);
    }
    LevelFile lamp = levelWithLamp({{"dimmer_lighting", "dynamic"}});
    const auto scene = lamp.import();
    ASSERT_IMPORTED(scene);
    expectWarning(*scene, {"node 'lamp'", "'dimmer_lighting'", "meshes"});
}

TEST(SceneElements, DensityHasALimit) {
    LevelFile level = LevelFile::withFloor();
    level.node(0)["extras"] = {{"dimmer_texel_density", 256}};
    EXPECT_TRUE(level.import());
    level.node(0)["extras"] = {{"dimmer_texel_density", 256.5}};
    expectBadInput(level.import(), {"node 'floor'", "dimmer_texel_density", "256"});
}

TEST(SceneElements, BlendersOrientationNodeTakesTheObjectsProperties) {
    LevelFile level = LevelFile::withFloor();
    const int object =
        level.addNode({{"name", "Lamp"}, {"extras", {{"dimmer_light_set", "hall"}, {"dimmer_bake", "full"}}}});
    level.addLight("Lamp_Orientation", point_light);
    const int orientation = object + 1;
    level.document["scenes"][0]["nodes"].erase(level.document["scenes"][0]["nodes"].size() - 1);
    level.node(object)["children"] = {orientation};
    const auto scene = level.import();
    ASSERT_IMPORTED(scene);
    EXPECT_EQ(scene->lights[0].light_set, 0u);
    EXPECT_EQ(scene->lights[0].bake, BakeMode::Full);
    EXPECT_TRUE(scene->warnings.empty());
}

TEST(SceneElements, EmissiveMeshOfASet) {
    LevelFile level = LevelFile::withFloor();
    const int mesh = level.addSquareMesh(addGlow(level));
    level.addNode(
        {{"name", "panel"}, {"mesh", mesh}, {"extras", {{"dimmer_light_set", "panels"}, {"dimmer_max_weight", 4}}}});
    const auto scene = level.import();
    ASSERT_IMPORTED(scene);
    EXPECT_FALSE(scene->meshes[0].light_set);
    EXPECT_EQ(scene->meshes[1].light_set, 0u);
    EXPECT_EQ(scene->light_sets[0].max_weight, 4.0f);
}

TEST(SceneElements, AMaterialsSetTakesOnlyThatMaterial) {
    LevelFile level = LevelFile::withFloor();
    const int always_on = addGlow(level), switched = addGlow(level);
    level.document["materials"][static_cast<size_t>(switched)]["extras"] = {{"dimmer_light_set", "sign"}};
    const int mesh = level.addSquareMesh(always_on);
    json second = level.primitive(mesh);
    second["material"] = switched;
    level.document["meshes"][static_cast<size_t>(mesh)]["primitives"].push_back(second);
    level.addNode({{"name", "shop"}, {"mesh", mesh}});
    const auto scene = level.import();
    ASSERT_IMPORTED(scene);
    ASSERT_EQ(scene->meshes.size(), 3u);
    EXPECT_FALSE(scene->meshes[1].light_set);
    EXPECT_EQ(scene->meshes[1].triangle_materials[0], static_cast<uint32_t>(always_on));
    EXPECT_EQ(scene->meshes[2].light_set, 0u);
    EXPECT_EQ(scene->meshes[2].triangle_materials[0], static_cast<uint32_t>(switched));
}

// A lamp whose mesh glows too: the material's keys are about its emission, not about the light.
TEST(SceneElements, AMaterialDoesNotSpeakForALight) {
    LevelFile level = levelWithLamp(json::object());
    const int glow = addGlow(level);
    json& material = level.document["materials"][static_cast<size_t>(glow)];
    material["extras"] = {{"dimmer_light_set", "sign"}, {"dimmer_bake", "full"}};
    level.node(1)["mesh"] = level.addSquareMesh(glow);
    const auto scene = level.import();
    ASSERT_IMPORTED(scene);
    EXPECT_FALSE(scene->lights[0].light_set);
    EXPECT_EQ(scene->lights[0].bake, BakeMode::Indirect);
    EXPECT_EQ(scene->meshes[1].light_set, 0u);
    expectWarning(*scene, {"node 'lamp'", "'dimmer_bake'"});
    // Then nothing is left that the set could dim.
    material.erase("emissiveFactor");
    expectBadInput(level.import(), {"node 'lamp'", "by material 'glow'", "'sign'", "does not shine"});
}

TEST(SceneElements, ANodesMaxWeightHoldsForItsMaterialsSet) {
    LevelFile level = LevelFile::withFloor();
    const int glow = addGlow(level);
    level.document["materials"][static_cast<size_t>(glow)]["extras"] = {{"dimmer_light_set", "sign"}};
    level.addNode({{"name", "panel"}, {"mesh", level.addSquareMesh(glow)}, {"extras", {{"dimmer_max_weight", 4}}}});
    const auto scene = level.import();
    ASSERT_IMPORTED(scene);
    ASSERT_EQ(scene->light_sets.size(), 1u);
    EXPECT_EQ(scene->light_sets[0].max_weight, 4.0f);
    EXPECT_TRUE(scene->warnings.empty());
}

TEST(SceneElements, ASetWithoutLightsIsRefused) {
    LevelFile empty = LevelFile::withFloor();
    empty.addNode({{"name", "lost"}, {"extras", {{"dimmer_light_set", "hall"}}}});
    expectBadInput(empty.import(), {"node 'lost'", "hall", "neither a light nor an emissive mesh"});

    LevelFile dull = LevelFile::withFloor();
    dull.node(0)["extras"] = {{"dimmer_light_set", "hall"}};
    expectBadInput(dull.import(), {"node 'floor'", "hall", "emission"});

    LevelFile dull_mesh = LevelFile::withFloor();
    dull_mesh.document["meshes"][0]["extras"] = {{"dimmer_light_set", "hall"}};
    expectBadInput(dull_mesh.import(), {"node 'floor'", "mesh 0", "hall"});
}

TEST(SceneElements, MaxWeightMustBePositiveAndOfThisWorld) {
    for (const json& bad : {json(0), json(-1), json("2"), json(1.01e8), json(1e39), json(1e-60)})
        expectBadInput(levelWithLamp({{"dimmer_light_set", "hall"}, {"dimmer_max_weight", bad}}).import(),
                       {"node 'lamp'", "dimmer_max_weight"});
    const auto scene = levelWithLamp({{"dimmer_max_weight", 2}}).import();
    ASSERT_IMPORTED(scene);
    expectWarning(*scene, {"node 'lamp'", "dimmer_max_weight"});
}

TEST(SceneElements, DoorsReachDownTheTreeAndJoinByName) {
    LevelFile level = LevelFile::withFloor();
    const int mesh = level.addSquareMesh(0);
    const int hinge = level.addNode({{"name", "hinge"}, {"extras", {{"dimmer_door", "front"}}}});
    const int leaf = level.addNode({{"name", "leaf"}, {"mesh", mesh}}, hinge);
    level.addNode({{"name", "handle"}, {"mesh", mesh}}, leaf);
    level.addNode({{"name", "cat_flap"}, {"mesh", mesh}, {"extras", {{"dimmer_door", "flap"}}}}, leaf);
    level.addNode({{"name", "other_leaf"}, {"mesh", mesh}, {"extras", {{"dimmer_door", "front"}}}});
    const auto scene = level.import();
    ASSERT_IMPORTED(scene);
    ASSERT_EQ(scene->doors.size(), 2u);
    EXPECT_EQ(scene->doors[0].name, "front");
    EXPECT_FALSE(scene->doors[0].pose);
    ASSERT_EQ(scene->meshes.size(), 5u);
    EXPECT_FALSE(scene->meshes[0].door);
    EXPECT_EQ(scene->meshes[1].door, 0u);
    EXPECT_EQ(scene->meshes[2].door, 0u);
    EXPECT_EQ(scene->meshes[3].door, 1u);  // the nearest name wins
    EXPECT_EQ(scene->meshes[4].door, 0u);
}

TEST(SceneElements, OpenPose) {
    LevelFile level = LevelFile::withFloor();
    json extras = {{"dimmer_door", "front"},
                   {"dimmer_door_open", "pose"},
                   {"dimmer_door_rotation", {0, 2, 0, 2}},
                   {"dimmer_door_translation", {0.5, 0, 1}}};
    const int door = level.addNode({{"name", "leaf"}, {"mesh", level.addSquareMesh(0)}, {"extras", extras}});
    auto scene = level.import();
    ASSERT_IMPORTED(scene);
    EXPECT_TRUE(scene->doors[0].pose);
    // A quarter turn about +Y (the quaternion is normalised), then the translation.
    const glm::dvec4 moved = scene->meshes[1].open_from_closed * glm::dvec4(1, 2, 3, 1);
    EXPECT_NEAR(glm::distance(moved, glm::dvec4(3.5, 2, 0, 1)), 0, 1e-12);

    level.node(door)["extras"].erase("dimmer_door_open");
    scene = level.import();
    ASSERT_IMPORTED(scene);
    expectWarning(*scene, {"node 'leaf'", "front", "dimmer_door_open"});

    for (const json& bad : {json{0, 0, 0, 0}, json{0, 1, 0}, json{0, "a", 0, 1}, json("left")}) {
        level.node(door)["extras"]["dimmer_door_rotation"] = bad;
        expectBadInput(level.import(), {"node 'leaf'", "dimmer_door_rotation"});
    }
}

// A double door: each leaf turns about its own hinge, in metres whatever the node's scale, and takes along what hangs
// below it.
TEST(SceneElements, LeavesOfOneDoorHavePosesOfTheirOwn) {
    LevelFile level = LevelFile::withFloor();
    const int mesh = level.addSquareMesh(0);
    const double s = std::sqrt(0.5);
    const auto leaf = [&](const char* name, double x, double turn) {
        return level.addNode(
            {{"name", name},
             {"mesh", mesh},
             {"translation", {x, 0, 0}},
             {"scale", {2, 1, 3}},
             {"extras",
              {{"dimmer_door", "double"}, {"dimmer_door_open", "pose"}, {"dimmer_door_rotation", {0, turn, 0, s}}}}});
    };
    leaf("left", -1, s);
    const int right = leaf("right", 1, -s);
    level.addNode({{"name", "handle"}, {"mesh", mesh}}, right);
    const auto scene = level.import();
    ASSERT_IMPORTED(scene);
    ASSERT_EQ(scene->doors.size(), 1u);
    ASSERT_EQ(scene->meshes.size(), 4u);
    const auto turned = [&](size_t m) { return scene->meshes[m].open_from_closed * glm::dvec4(0, 0, 0, 1); };
    // One metre towards +X from the left hinge is one towards -Z after a quarter turn about +Y; the right leaf alike.
    EXPECT_NEAR(glm::distance(turned(1), glm::dvec4(-1, 0, -1, 1)), 0, 1e-12);
    EXPECT_NEAR(glm::distance(turned(2), glm::dvec4(1, 0, -1, 1)), 0, 1e-12);
    EXPECT_EQ(turned(3), turned(2));
}

// Nodes below one of the same door move with it, and by their own pose before; another door's move by their own alone.
TEST(SceneElements, PosesOfOneDoorAddUpDownTheTree) {
    LevelFile level = LevelFile::withFloor();
    const int mesh = level.addSquareMesh(0);
    const double s = std::sqrt(0.5);
    const auto add = [&](const char* name, const json& extras, int parent) {
        return level.addNode({{"name", name}, {"mesh", mesh}, {"translation", {1, 0, 0}}, {"extras", extras}}, parent);
    };
    const json step = {1, 0, 0};
    const int leaf = add(
        "leaf", {{"dimmer_door", "front"}, {"dimmer_door_open", "pose"}, {"dimmer_door_rotation", {0, s, 0, s}}}, -1);
    add("panel", {{"dimmer_door", "front"}}, leaf);
    add("bolt", {{"dimmer_door", "front"}, {"dimmer_door_translation", step}}, leaf);
    add("flap", {{"dimmer_door", "flap"}, {"dimmer_door_open", "pose"}, {"dimmer_door_translation", step}}, leaf);
    const auto scene = level.import();
    ASSERT_IMPORTED(scene);
    ASSERT_EQ(scene->meshes.size(), 5u);
    const auto moved = [&](size_t m) { return scene->meshes[m].open_from_closed * glm::dvec4(2, 0, 0, 1); };
    // A quarter turn about +Y through (1, 0, 0) takes what lies n metres towards +X from there n metres towards -Z.
    EXPECT_NEAR(glm::distance(moved(2), glm::dvec4(1, 0, -1, 1)), 0, 1e-12);
    EXPECT_NEAR(glm::distance(moved(3), glm::dvec4(1, 0, -2, 1)), 0, 1e-12);
    EXPECT_NEAR(glm::distance(moved(4), glm::dvec4(3, 0, 0, 1)), 0, 1e-12);
}

// An object named the door, its mesh below got the pose: the door stays shut, and the message says where to write what.
TEST(SceneElements, APoseWithoutItsDoorIsWarnedOf) {
    LevelFile level = LevelFile::withFloor();
    const int door = level.addNode({{"name", "frame"}, {"extras", {{"dimmer_door", "front"}}}});
    const int leaf = level.addNode({{"name", "leaf"},
                                    {"mesh", level.addSquareMesh(0)},
                                    {"extras", {{"dimmer_door_open", "pose"}, {"dimmer_door_rotation", {0, 1, 0, 1}}}}},
                                   door);
    auto scene = level.import();
    ASSERT_IMPORTED(scene);
    EXPECT_EQ(scene->warnings.size(), 2u);
    expectWarning(*scene, {"node 'leaf'", "'dimmer_door_open'", "'dimmer_door'"});
    expectWarning(*scene, {"node 'leaf'", "'dimmer_door_rotation'", "'dimmer_door'"});
    level.node(leaf)["extras"]["dimmer_door"] = "front";
    scene = level.import();
    ASSERT_IMPORTED(scene);
    EXPECT_TRUE(scene->warnings.empty());
    EXPECT_TRUE(scene->doors[0].pose);
}

TEST(SceneElements, APoseThatIsNotStatedIsWarnedOf) {
    LevelFile level = LevelFile::withFloor();
    level.addNode({{"name", "leaf"},
                   {"mesh", level.addSquareMesh(0)},
                   {"extras", {{"dimmer_door", "front"}, {"dimmer_door_open", "pose"}}}});
    const auto scene = level.import();
    ASSERT_IMPORTED(scene);
    expectWarning(*scene, {"node 'leaf'", "front", "dimmer_door_translation"});
}

TEST(SceneElements, NodesOfADoorMustAgreeHowItOpens) {
    LevelFile level = LevelFile::withFloor();
    const int mesh = level.addSquareMesh(0);
    for (const char* open : {"remove", "pose"})
        level.addNode({{"name", std::string("leaf_") + open},
                       {"mesh", mesh},
                       {"extras", {{"dimmer_door", "front"}, {"dimmer_door_open", open}}}});
    expectBadInput(level.import(), {"node 'leaf_pose'", "node 'leaf_remove'", "front"});
}

TEST(SceneElements, ADoorNeedsGeometry) {
    LevelFile level = LevelFile::withFloor();
    const int door = level.addNode({{"name", "frame"}, {"extras", {{"dimmer_door", "front"}}}});
    expectBadInput(level.import(), {"node 'frame'", "door 'front'", "no geometry"});
    // A mesh that moves by itself does not make a leaf.
    level.addNode({{"name", "bell"}, {"mesh", level.addSquareMesh(0)}, {"extras", {{"dimmer_dynamic", true}}}}, door);
    expectBadInput(level.import(), {"node 'frame'", "door 'front'", "no geometry"});
}

TEST(SceneElements, SetsAndDoorsHaveSeparateNames) {
    LevelFile level = levelWithLamp({{"dimmer_light_set", "plat1"}});
    level.addNode({{"name", "lift"}, {"mesh", level.addSquareMesh(0)}, {"extras", {{"dimmer_door", "plat1"}}}});
    level.document["scenes"][0]["extras"]["dimmer_combinations"] = {{"door:plat1", "plat1"}, {"door:plat1"}};
    const auto scene = level.import();
    ASSERT_IMPORTED(scene);
    EXPECT_EQ(scene->light_sets.size(), 1u);
    EXPECT_EQ(scene->doors.size(), 1u);
    ASSERT_EQ(scene->combinations.size(), 2u);
    ASSERT_EQ(scene->combinations[0].size(), 2u);
    EXPECT_TRUE(scene->combinations[0][0].is_door);
    EXPECT_EQ(scene->combinations[0][0].index, 0u);
    EXPECT_FALSE(scene->combinations[0][1].is_door);
}

// Light that asks for no door or for one is kept in any case: whoever forgot a name is told.
TEST(SceneElements, CombinationsThatDoNothingAreSaidTo) {
    LevelFile level = levelWithLamp({{"dimmer_light_set", "hall"}});
    for (const char* name : {"front", "back"})
        level.addNode({{"name", name}, {"mesh", level.addSquareMesh(0)}, {"extras", {{"dimmer_door", name}}}});
    json& combinations = level.document["scenes"][0]["extras"]["dimmer_combinations"];
    for (const json& list : {json{"hall", "hall"}, json{"door:front", "door:front"}, json{"door:front", "hall"}}) {
        combinations = json::array();
        combinations.push_back(list);
        SCOPED_TRACE(combinations.dump());
        const auto scene = level.import();
        ASSERT_IMPORTED(scene);
        EXPECT_EQ(scene->warnings.size(), 1u);
        expectWarning(*scene, {"dimmer_combinations", "does nothing"});
    }
    combinations = json::array({json{"door:front", "door:back"}});
    const auto scene = level.import();
    ASSERT_IMPORTED(scene);
    EXPECT_TRUE(scene->warnings.empty());
}

// Reset by an editor, or written in degrees: neither opens the door as meant.
TEST(SceneElements, APoseThatIsNoneIsTold) {
    LevelFile level = levelWithLamp({});
    const int node = level.addNode(
        {{"name", "leaf"},
         {"mesh", level.addSquareMesh(0)},
         {"extras", {{"dimmer_door", "front"}, {"dimmer_door_open", "pose"}, {"dimmer_door_rotation", {0, 0, 0, 1}}}}});
    auto scene = level.import();
    ASSERT_IMPORTED(scene);
    expectWarning(*scene, {"node 'leaf'", "'front'", "states none that moves it", "dimmer_door_translation"});
    level.node(node)["extras"]["dimmer_door_rotation"] = {0, 90, 0, 0};
    scene = level.import();
    ASSERT_IMPORTED(scene);
    EXPECT_EQ(scene->warnings.size(), 1u);
    expectWarning(*scene, {"node 'leaf'", "dimmer_door_rotation", "degrees"});
    level.node(node)["extras"]["dimmer_door_rotation"] = {0, 1, 0, 1};
    scene = level.import();
    ASSERT_IMPORTED(scene);
    EXPECT_TRUE(scene->warnings.empty());
}

// A leaf that is turned below an uneven scale has axes that are not at right angles: its pose is no turn.
TEST(SceneElements, APoseBelowAnUnevenScaleIsRefused) {
    LevelFile level = LevelFile::withFloor();
    const int frame = level.addNode({{"name", "frame"}, {"scale", {1, 1, 2}}});
    const double s = std::sin(0.25), c = std::cos(0.25);
    const int leaf = level.addNode(
        {{"name", "leaf"},
         {"mesh", level.addSquareMesh(0)},
         {"rotation", {0, s, 0, c}},
         {"extras", {{"dimmer_door", "front"}, {"dimmer_door_open", "pose"}, {"dimmer_door_rotation", {0, 1, 0, 1}}}}},
        frame);
    expectBadInput(level.import(), {"node 'leaf'", "bend the leaf", "Scale that node evenly"});
    level.node(frame)["scale"] = {2, 2, 2};
    ASSERT_IMPORTED(level.import());
    level.node(frame)["scale"] = {1, 1, 2};
    level.node(leaf).erase("rotation");  // along the scale
    ASSERT_IMPORTED(level.import());
}

TEST(SceneElements, CombinationsOfUnknownElementsAreRefused) {
    LevelFile level = levelWithLamp({{"dimmer_light_set", "hall"}});
    level.addNode({{"name", "leaf"}, {"mesh", level.addSquareMesh(0)}, {"extras", {{"dimmer_door", "front"}}}});
    json& combinations = level.document["scenes"][0]["extras"]["dimmer_combinations"];
    combinations = json::array({json::array({"door:back", "hall"})});
    expectBadInput(level.import(), {"dimmer_combinations", "door:back"});
    combinations = json::array({json::array({"front", "hall"})});
    // A name of a door without its prefix gets a hint.
    expectBadInput(level.import(), {"dimmer_combinations", "write 'door:front'"});
    for (const json& bad : {json("front"), json{1, 2}, json{"front"}, json::array({json::array({"door:front", 1})})}) {
        combinations = bad;
        expectBadInput(level.import(), {"dimmer_combinations", "list of lists"});
    }
}

// As an editor's custom property, which is a text: the same combination.
TEST(SceneElements, CombinationsMayBeText) {
    LevelFile level = levelWithLamp({{"dimmer_light_set", "hall"}});
    for (const char* name : {"front", "back"})
        level.addNode({{"name", name}, {"mesh", level.addSquareMesh(0)}, {"extras", {{"dimmer_door", name}}}});
    json& combinations = level.document["scenes"][0]["extras"]["dimmer_combinations"];
    combinations = R"([["door:front", "door:back", "hall"]])";
    const auto scene = level.import();
    ASSERT_IMPORTED(scene);
    ASSERT_EQ(scene->combinations.size(), 1u);
    EXPECT_EQ(scene->combinations[0].size(), 3u);
    for (const char* bad : {"", "[", "[1]", R"(["hall"])", R"({"a": [["hall"]]})", R"([["door:front", 1]])"}) {
        combinations = bad;
        expectBadInput(level.import(), {"dimmer_combinations", "list of lists"});
    }
}

TEST(SceneElements, NamesThatAStateCannotSayAreRefused) {
    for (const char* name : {" hall", "hall ", " ", "", "a,b", "a=b", "all", "always", "door:x"})
        expectBadInput(levelWithLamp({{"dimmer_light_set", name}}).import(), {"node 'lamp'", name});
}

TEST(SceneElements, UnknownKeysGetTheNearestKnownOne) {
    LevelFile level = levelWithLamp({{"dimmer_lightset", "hall"}, {"dimer_bake", 1}, {"quake_wait", 2}});
    level.document["materials"][0]["extras"] = {{"dimmer_sky_color", {1, 1, 1}}};
    level.document["scenes"][0]["extras"] = {{"dimmer_sky_colour", {1, 1, 1}}};
    const auto scene = level.import();
    ASSERT_IMPORTED(scene);
    EXPECT_EQ(scene->warnings.size(), 3u);
    expectWarning(*scene, {"node 'lamp'", "'dimmer_lightset'", "'dimmer_light_set'"});
    expectWarning(*scene, {"material 'white'", "'dimmer_sky_color'", "belongs in the extras of the scene"});
    expectWarning(*scene, {"scene", "'dimmer_sky_colour'", "'dimmer_sky_color'"});
}

TEST(SceneElements, KeysInAnotherSpellingAreTold) {
    for (const char* key : {"Dimmer_light_set", "DIMMER_LIGHT_SET", "dimmer-light-set", "dimmer light set"}) {
        const auto scene = levelWithLamp({{key, "hall"}}).import();
        ASSERT_IMPORTED(scene);
        EXPECT_TRUE(scene->light_sets.empty());
        EXPECT_EQ(scene->warnings.size(), 1u);
        expectWarning(*scene, {"node 'lamp'", key, "did you mean 'dimmer_light_set'"});
    }
}

TEST(SceneElements, KeysWhereNothingReadsThemAreTold) {
    LevelFile level = levelWithLamp("dimmer_light_set=hall");
    level.document["extras"] = {{"dimmer_sky_luminance", 10}, {"dimmer_light_set", "hall"}, {"mood", "calm"}};
    const auto scene = level.import();
    ASSERT_IMPORTED(scene);
    EXPECT_EQ(scene->warnings.size(), 3u);
    expectWarning(*scene, {"node 'lamp'", "a text", "object"});
    expectWarning(*scene, {"the file's own extras", "'dimmer_sky_luminance'", "extras of the scene"});
    expectWarning(*scene, {"the file's own extras", "'dimmer_light_set'", "extras of a node"});
}

TEST(SceneElements, OtherScenesAreTold) {
    LevelFile level = levelWithLamp({});
    level.document["scenes"].push_back({{"name", "backstage"}, {"nodes", json::array({0})}});
    const auto scene = level.import();
    ASSERT_IMPORTED(scene);
    EXPECT_EQ(scene->warnings.size(), 1u);
    expectWarning(*scene, {"the level is scene 0", "other one is left out"});
}

TEST(SceneElements, WrongTypesNameNodeAndKey) {
    const std::pair<const char*, json> cases[] = {
        {"dimmer_door", 1},         {"dimmer_lighting", "lightmaps"}, {"dimmer_dynamic", 2},
        {"dimmer_dynamic", "yes"},  {"dimmer_texel_density", "8"},    {"dimmer_texel_density", -8},
        {"dimmer_grid_spacing", 0}, {"dimmer_play_area", "big"},      {"dimmer_light_set", 3}};
    for (const auto& [key, value] : cases) {
        LevelFile level = LevelFile::withFloor();
        level.node(0)["extras"] = {{key, value}};
        expectBadInput(level.import(), {"node 'floor'", key});
    }
}

TEST(SceneElements, HowMeshesReceiveLight) {
    const std::pair<json, Lighting> cases[] = {{{{"dimmer_lighting", "lightmap"}}, Lighting::Lightmap},
                                               {{{"dimmer_lighting", "local_grid"}}, Lighting::LocalGrid},
                                               {{{"dimmer_lighting", "dynamic"}}, Lighting::Dynamic},
                                               {{{"dimmer_lighting", "none"}}, Lighting::None},
                                               {{{"dimmer_dynamic", 1}}, Lighting::Dynamic},
                                               {{{"dimmer_dynamic", 1.0}}, Lighting::Dynamic},
                                               {{{"dimmer_dynamic", true}}, Lighting::Dynamic},
                                               {{{"dimmer_dynamic", false}}, Lighting::Automatic},
                                               {{{"dimmer_dynamic", 0}}, Lighting::Automatic}};
    for (const auto& [extras, lighting] : cases) {
        LevelFile level = LevelFile::withFloor();
        level.node(0)["extras"] = extras;
        level.node(0)["extras"]["dimmer_texel_density"] = 16;
        level.node(0)["extras"]["dimmer_grid_spacing"] = 0.5;
        const auto scene = level.import();
        ASSERT_IMPORTED(scene);
        EXPECT_EQ(scene->meshes[0].lighting, lighting) << extras;
        EXPECT_EQ(scene->meshes[0].texels_per_metre, 16.0f);
        EXPECT_EQ(scene->meshes[0].grid_spacing_m, 0.5f);
        EXPECT_TRUE(scene->dynamic_places.empty());
    }
    const json contradictions[] = {{{"dimmer_dynamic", 1}, {"dimmer_lighting", "lightmap"}},
                                   {{"dimmer_dynamic", 0}, {"dimmer_lighting", "dynamic"}}};
    for (const json& extras : contradictions) {
        LevelFile level = LevelFile::withFloor();
        level.node(0)["extras"] = extras;
        expectBadInput(level.import(), {"node 'floor'", "dimmer_dynamic", "dimmer_lighting"});
    }
    LevelFile alike = LevelFile::withFloor();
    alike.node(0)["extras"] = {{"dimmer_dynamic", 0}, {"dimmer_lighting", "lightmap"}};
    ASSERT_IMPORTED(alike.import());
}

// Nothing would tell that the number does nothing.
TEST(SceneElements, KeysOfAnotherLightingAreTold) {
    const std::pair<const char*, std::vector<const char*>> ignored[] = {
        {"lightmap", {"dimmer_grid_spacing"}},
        {"local_grid", {"dimmer_texel_density"}},
        {"dynamic", {"dimmer_texel_density", "dimmer_grid_spacing"}},
        {"none", {"dimmer_texel_density", "dimmer_grid_spacing"}}};
    for (const auto& [lighting, keys] : ignored) {
        LevelFile level = LevelFile::withFloor();
        level.node(0)["extras"] = {
            {"dimmer_lighting", lighting}, {"dimmer_texel_density", 16}, {"dimmer_grid_spacing", 0.5}};
        const auto scene = level.import();
        ASSERT_IMPORTED(scene);
        EXPECT_EQ(scene->warnings.size(), keys.size()) << lighting;
        for (const char* key : keys) expectWarning(*scene, {"node 'floor'", std::string("'") + key + "'", "ignored"});
    }
    LevelFile open = LevelFile::withFloor();  // either may hold
    open.node(0)["extras"] = {{"dimmer_texel_density", 16}, {"dimmer_grid_spacing", 0.5}};
    const auto scene = open.import();
    ASSERT_IMPORTED(scene);
    EXPECT_TRUE(scene->warnings.empty());
}

TEST(SceneElements, EmptyNodesArePlacesAndPlayAreasAreNoGeometry) {
    LevelFile level = LevelFile::withFloor();
    level.addNode({{"name", "barrel_place"}, {"translation", {1, 2, 3}}, {"extras", {{"dimmer_dynamic", 1}}}});
    level.addNode({{"name", "area"}, {"mesh", level.addSquareMesh(0)}, {"extras", {{"dimmer_play_area", 1}}}});
    const auto scene = level.import();
    ASSERT_IMPORTED(scene);
    ASSERT_EQ(scene->dynamic_places.size(), 1u);
    EXPECT_EQ(glm::dvec3(scene->dynamic_places[0].world_from_node[3]), glm::dvec3(1, 2, 3));
    EXPECT_EQ(scene->meshes.size(), 1u);
}

}  // namespace
}  // namespace dimmer::cook::test
