// Light divided by its groups' scales: what it was comes back, and no number is large.
#include <bake/door_paths.h>
#include <gtest/gtest.h>
#include <pipeline/set_scales.h>
#include <pipeline/small_level.h>

#include <set>

namespace dimmer::cook::test {
namespace {

// Panels of one material, always on and in two sets, under a sky and a sun; a lamp in one of the sets.
Scene panels(double sun_lux, double sky_cd_m2) {
    LevelFile level;
    const int glow = addWhite(level, {{"emissiveFactor", {0.3, 0.7, 0.1}}});
    for (const char* set : {"", "first", "second"}) {
        json panel = {{"name", "panel"},
                      {"mesh", level.addSquareMesh(glow)},
                      {"translation", {0, level.document["nodes"].size(), 0}}};
        if (*set) panel["extras"]["dimmer_light_set"] = set;
        level.addNode(panel);
    }
    level.addLight("sun", {{"type", "directional"}, {"intensity", sun_lux}, {"color", {1, 0.5, 0.25}}});
    level.addLight("bulb", {{"type", "point"}, {"intensity", 7}, {"color", {1, 0.1, 0}}},
                   {{"dimmer_light_set", "second"}});
    level.document["scenes"][0]["extras"] = {{"dimmer_sky_color", {0.5, 0.7, 1}}, {"dimmer_sky_luminance", sky_cd_m2}};
    return *level.import();
}

// 16 bits of mantissa.
void expectNear(glm::vec3 found, glm::vec3 expected) {
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(found[c], expected[c], 1e-5 * static_cast<double>(expected[c]));
}

TEST(SetScales, TimesTheScaleEverythingIsAsItWas) {
    const Scene level = panels(40, 5);
    Scene scene = level;
    const SetScales scales = divideByScales(scene);
    ASSERT_EQ(scales.of_group.size(), 3u);
    for (size_t l = 0; l < level.lights.size(); ++l)
        expectNear(scene.lights[l].intensity * scales.of_group[groupOf(scene.lights[l].light_set)],
                   level.lights[l].intensity);
    expectNear(scene.sky_radiance_cd_m2 * scales.of_group[always_group], level.sky_radiance_cd_m2);
    std::set<uint32_t> materials;
    for (size_t m = 0; m < level.meshes.size(); ++m) {
        const uint32_t now = scene.meshes[m].triangle_materials[0], before = level.meshes[m].triangle_materials[0];
        const glm::vec3 emission = level.materials[before].emission_cd_m2;
        expectNear(scene.materials[now].emission_cd_m2 * scales.of_group[groupOf(scene.meshes[m].light_set)], emission);
        EXPECT_EQ(scales.emission_cd_m2[now], emission);
        EXPECT_EQ(scales.copy_of[now], before);
        materials.insert(now);
    }
    EXPECT_EQ(materials.size(), 3u) << "a material for each scale";
    // Of what is always on one number, of sets one for each channel.
    EXPECT_EQ(scales.of_group[always_group], glm::vec3(40));
    EXPECT_EQ(scales.of_group[1], level.materials[level.meshes[0].triangle_materials[0]].emission_cd_m2);
}

// Divided by such a lamp's scale the surface would be infinite.
TEST(SetScales, ASurfaceBesideALampThatIsAllButOffKeepsItsLight) {
    Scene scene = panels(40, 5);
    for (Material& m : scene.materials) m.emission_cd_m2 *= 1e4f;
    const auto bulb = std::ranges::find(scene.lights, "bulb", &PunctualLight::node);
    ASSERT_NE(bulb, scene.lights.end());
    const Scene level = scene;
    bulb->intensity = glm::vec3(1e-37f);
    const uint32_t group = groupOf(bulb->light_set);
    const SetScales scales = divideByScales(scene);
    for (size_t m = 0; m < level.meshes.size(); ++m)
        if (groupOf(level.meshes[m].light_set) == group)
            expectNear(scene.materials[scene.meshes[m].triangle_materials[0]].emission_cd_m2 * scales.of_group[group],
                       level.materials[level.meshes[m].triangle_materials[0]].emission_cd_m2);
}

// A lamp that is all but off beside a bright sky: variances are squares of squares of light, and must stay finite.
TEST(SetScales, NothingThatIsAlwaysOnIsLarge) {
    for (const auto& [sun, sky] : {std::pair(1e-17, 1e4), std::pair(1e-36, 1e4), std::pair(1e5, 1e-6)}) {
        Scene scene = panels(sun, sky);
        divideByScales(scene);
        for (int c = 0; c < 3; ++c) {
            EXPECT_LE(scene.sky_radiance_cd_m2[c], 1) << sun;
            EXPECT_LE(scene.lights[0].intensity[c], 1) << sun;
            for (const Material& m : scene.materials) EXPECT_LE(m.emission_cd_m2[c], 1) << sun;
        }
    }
}

}  // namespace
}  // namespace dimmer::cook::test
