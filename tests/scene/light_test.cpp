// Punctual lights, sky and viewpoints.
#include <scene/expectations.h>

#include <cmath>
#include <numbers>

namespace dimmer::cook::test {
namespace {

const float half = std::numbers::sqrt2_v<float> / 2;

TEST(SceneLights, Point) {
    LevelFile level = LevelFile::withFloor();
    const json light = {{"type", "point"}, {"color", {1, 0.5, 0.25}}, {"intensity", 60}, {"range", 8}};
    level.addLight("lamp", light);
    level.node(1)["translation"] = {1, 2, 3};
    const auto scene = level.import();
    ASSERT_IMPORTED(scene);
    ASSERT_EQ(scene->lights.size(), 1u);
    const PunctualLight& lamp = scene->lights[0];
    EXPECT_EQ(lamp.node, "lamp");
    EXPECT_EQ(lamp.type, LightType::Point);
    EXPECT_EQ(lamp.position_m, glm::vec3(1, 2, 3));
    EXPECT_EQ(lamp.intensity, glm::vec3(60, 30, 15));
    EXPECT_EQ(lamp.range_m, 8.0f);
    EXPECT_EQ(lamp.bake, BakeMode::Indirect);
}

TEST(SceneLights, DefaultsAreTheExtensions) {
    LevelFile level = LevelFile::withFloor();
    level.addLight("lamp", {{"type", "spot"}, {"spot", json::object()}});
    const auto scene = level.import();
    ASSERT_IMPORTED(scene);
    EXPECT_EQ(scene->lights[0].intensity, glm::vec3(1));
    EXPECT_FALSE(scene->lights[0].range_m);
    EXPECT_EQ(scene->lights[0].cone_inner_cos, 1.0f);
    EXPECT_FLOAT_EQ(scene->lights[0].cone_outer_cos, half);  // 45 degrees
}

TEST(SceneLights, SpotAndSunShineAlongTheNodesMinusZ) {
    LevelFile level = LevelFile::withFloor();
    const double pi = std::numbers::pi;
    level.addLight("spot", {{"type", "spot"}, {"spot", {{"innerConeAngle", pi / 6}, {"outerConeAngle", pi / 3}}}});
    level.addLight("sun", {{"type", "directional"}, {"intensity", 20000}});
    // -90 degrees about X turns -Z to -Y; scale, as editors leave it behind, changes nothing.
    for (const int node : {1, 2}) level.node(node)["rotation"] = {-half, 0, 0, half};
    level.node(2)["scale"] = {3, 3, 3};
    const auto scene = level.import();
    ASSERT_IMPORTED(scene);
    for (const PunctualLight& light : scene->lights) expectNear(light.direction, {0, -1, 0});
    EXPECT_FLOAT_EQ(scene->lights[0].cone_inner_cos, std::sqrt(0.75f));
    EXPECT_FLOAT_EQ(scene->lights[0].cone_outer_cos, 0.5f);
    EXPECT_EQ(scene->lights[1].type, LightType::Directional);
    EXPECT_EQ(scene->lights[1].intensity, glm::vec3(20000));
}

TEST(SceneLights, BadLightsAreRefused) {
    const json bad[] = {{{"type", "area"}},
                        {{"type", "point"}, {"intensity", -1}},
                        {{"type", "point"}, {"intensity", 1e39}},
                        {{"type", "point"}, {"color", {1, -1, 1}}},
                        {{"type", "point"}, {"range", -2}},
                        {{"type", "point"}, {"range", 0}},
                        {{"type", "spot"}, {"spot", {{"innerConeAngle", 1.0}, {"outerConeAngle", 0.5}}}},
                        {{"type", "spot"}, {"spot", {{"outerConeAngle", 2.0}}}},
                        {{"type", "spot"}, {"spot", {{"innerConeAngle", -0.1}}}}};
    for (const json& light : bad) {
        LevelFile level = LevelFile::withFloor();
        level.addLight("lamp", light);
        SCOPED_TRACE(light.dump());
        expectBadInput(level.import(), {"node 'lamp'"});
    }
}

// The parser takes each for what is not there: a white lamp, a cone of 45 degrees.
TEST(SceneLights, ValuesOfTheWrongTypeAreRefused) {
    const std::pair<const char*, json> wrong[] = {
        {"color", {1, 1}},  {"color", "#ff0000"},      {"color", {"1", "0", "0"}},
        {"intensity", "3"}, {"intensity", nullptr},    {"intensity", json::array()},
        {"range", "3"},     {"range", json::object()}, {"spot", 1},
        {"type", 3}};
    for (const auto& [key, value] : wrong) {
        LevelFile level = LevelFile::withFloor();
        level.addLight("lamp", {{"type", "point"}});
        level.document["extensions"]["KHR_lights_punctual"]["lights"][0][key] = value;
        SCOPED_TRACE(value.dump());
        expectBadInput(level.import(), {"light 0", std::string("'") + key + "'"});
    }
    LevelFile without_cone = LevelFile::withFloor();
    without_cone.addLight("lamp", {{"type", "spot"}});
    expectBadInput(without_cone.import(), {"light 0", "'spot'", "point"});
    for (const char* angle : {"innerConeAngle", "outerConeAngle"}) {
        LevelFile level = LevelFile::withFloor();
        level.addLight("lamp", {{"type", "spot"}, {"spot", {{angle, "0.2"}}}});
        expectBadInput(level.import(), {"light 0", angle});
    }
}

TEST(SceneLights, Sky) {
    LevelFile level = LevelFile::withFloor();
    json& extras = level.document["scenes"][0]["extras"];
    extras = {{"dimmer_sky_color", {0.6, 0.75, 1}}, {"dimmer_sky_luminance", 600}};
    auto scene = level.import();
    ASSERT_IMPORTED(scene);
    expectNear(scene->sky_radiance_cd_m2, {360, 450, 600}, 1e-3f);

    extras = {{"dimmer_sky_color", {0.6, 0.75, 1}}};
    scene = level.import();
    ASSERT_IMPORTED(scene);
    EXPECT_EQ(scene->sky_radiance_cd_m2, glm::vec3(0));
    expectWarning(*scene, {"dimmer_sky_luminance"});

    for (const json& bad : {json{{"dimmer_sky_color", {1, 1}}}, json{{"dimmer_sky_luminance", "bright"}}}) {
        extras = bad;
        expectBadInput(level.import(), {"scene", bad.begin().key()});
    }
    extras = {{"dimmer_sky_color", {1, -1, 1}}, {"dimmer_sky_luminance", 1}};
    expectBadInput(level.import(), {"scene", "dimmer_sky_color"});
    extras = {{"dimmer_sky_color", {1e30, 1, 1}}, {"dimmer_sky_luminance", 1e30}};
    expectBadInput(level.import(), {"scene", "dimmer_sky_color"});
}

TEST(SceneViewpoints, PlayerStartFirstThenCameras) {
    LevelFile level = LevelFile::withFloor();
    level.document["cameras"] =
        json::array({{{"type", "perspective"}, {"perspective", {{"yfov", 0.5}, {"znear", 0.1}}}}});
    level.addNode({{"name", "overview"}, {"camera", 0}, {"translation", {0, 9, 0}}, {"rotation", {-half, 0, 0, half}}});
    // 90 degrees about Y turns -Z to -X.
    level.addNode({{"name", "player_start"}, {"translation", {1, 0, 2}}, {"rotation", {0, half, 0, half}}});
    const auto scene = level.import();
    ASSERT_IMPORTED(scene);
    ASSERT_EQ(scene->viewpoints.size(), 2u);
    EXPECT_EQ(scene->viewpoints[0].name, "player_start");
    EXPECT_EQ(scene->viewpoints[0].position_m, glm::vec3(1, 0, 2));
    expectNear(scene->viewpoints[0].forward, {-1, 0, 0});
    EXPECT_EQ(scene->viewpoints[1].name, "overview");
    expectNear(scene->viewpoints[1].forward, {0, -1, 0});
    EXPECT_EQ(scene->viewpoints[1].vertical_fov_rad, 0.5f);
}

}  // namespace
}  // namespace dimmer::cook::test
