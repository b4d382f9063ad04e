// The light of models' own grids, against closed forms.
#include <bake/sampling.h>
#include <encode/encode_probe.h>
#include <gtest/gtest.h>
#include <models/model_receivers.h>
#include <models/model_scenes.h>

#include <cmath>
#include <numbers>

namespace dimmer::cook::test {
namespace {

glm::vec3 radianceOfMean(const ProbeLight& light) {
    return light.radiance[0] * 0.282094792f;
}

const ProbeLight* alwaysOn(const Baked& baked, size_t probe) {
    for (const ProbeTermLight& l : baked.local_light.row(probe))
        if (l.term == always_group) return &l.light;
    return nullptr;
}

BakeSettings quiet() {
    return {.series_rays = 64, .final_rays = 512};
}

// Everything emits L and reflects rho: the radiance is L / (1 - rho) everywhere, whatever stands where. It is so at the
// probes only where rays pass through their own model, and at the walls only where rays that end on the model read its
// grid.
TEST(LocalBake, FurnaceIsAsBrightOnWallsAndAtProbesAsWithoutTheModel) {
    constexpr float emitted = 100, rho = 0.5f, radiance = emitted / (1 - rho);
    Scene scene;
    const uint32_t material = addMaterial(scene, emissive(glm::vec3(emitted), rho));
    addBox(scene, {2, 1.5f, 2}, material);
    addCrate(scene, "crate", placed({0.3, -0.7, 0.2}, 0.5), {0.9f, 0.6f, 0.65f}, material);
    listModels(scene, {.spacing_m = 0.7f});
    BakedScene b(scene, 4);
    b.bake(quiet());
    ASSERT_EQ(b.baked.local_light.rows(), size_t{4 * 3 * 3});
    for (size_t i = 0; i < b.baked.local_light.rows(); ++i) {
        const ProbeLight* light = alwaysOn(b.baked, i);
        ASSERT_TRUE(light);
        // The series ends within 0.2 % of the sum; walls are gathered by 64 rays a bounce, whose noise hardly shows in
        // a mean over the sphere.
        EXPECT_NEAR(radianceOfMean(*light).x, radiance, 0.01f * radiance) << i;
    }
    double sum = 0;
    for (size_t i = 0; i < b.texels.size(); ++i) sum += static_cast<double>(b.lux(i).x);
    const double mean = sum / static_cast<double>(b.texels.size());
    EXPECT_NEAR(mean, static_cast<double>(pi * radiance), 0.01 * static_cast<double>(pi * radiance));
}

// A lamp above a crate in a black room: what the walls get is the crate's reflection. Of the lamp, the crate's top is
// all that is lit: candela x solid angle arrives there, and rho times that leaves it again.
TEST(LocalBake, WallsGetWhatAModelReflects) {
    constexpr float candela = 1000, rho = 0.6f;
    Scene scene;
    const uint32_t black = addMaterial(scene, lambert(0)), grey = addMaterial(scene, lambert(rho));
    addBox(scene, {6, 6, 6}, black);
    addCrate(scene, "crate", placed({0, 0, 0}), {0.5f, 0.5f, 0.5f}, grey);
    addPointLight(scene, {0, 5, 0}, candela, BakeMode::Indirect);
    listModels(scene, {.spacing_m = 0.25f, .probes_max = 1000});
    BakedScene b(scene, 2, 1);
    b.bake({.series_rays = 64, .final_rays = 2048});
    double flux = 0;
    for (size_t i = 0; i < b.texels.size(); ++i)
        flux += static_cast<double>(b.lux(i).x) * static_cast<double>(b.texels.area_m2[i]);
    // A square of half-side a seen from above its middle, at distance h: 4 asin(a^2 / (a^2 + h^2)).
    const double steradians = 4 * std::asin(0.25 / (0.25 + 4.5 * 4.5));
    const double expected = static_cast<double>(candela * rho) * steradians;
    // The top is gathered at its surface. Of 7 million rays some 8,000 hit the top, 1.1 % of noise, and less in a
    // low-discrepancy sequence.
    EXPECT_NEAR(flux, expected, 0.03 * expected);
}

// A lamp close above a plate, as buttons have: its probes stand at the corners, 2.5 times further from the lamp than
// its middle, but what it reflects is what arrives all over it.
TEST(LocalBake, WhatALampCloseAboveLightsIsAllReflected) {
    constexpr float candela = 100, rho = 0.6f, height = 0.3f;
    Scene scene;
    const uint32_t black = addMaterial(scene, lambert(0)), grey = addMaterial(scene, lambert(rho));
    addBox(scene, {3, 3, 3}, black);
    addCrate(scene, "button", placed({0, -0.03, 0}), {0.5f, 0.03f, 0.5f}, grey);
    addPointLight(scene, {0, height, 0}, candela, BakeMode::Indirect);
    listModels(scene, {});
    BakedScene b(scene, 2, 1);
    b.bake({.series_rays = 64, .final_rays = 4096});
    double flux = 0;
    for (size_t i = 0; i < b.texels.size(); ++i)
        flux += static_cast<double>(b.lux(i).x) * static_cast<double>(b.texels.area_m2[i]);
    const double steradians = 4 * std::asin(0.25 / (0.25 + double{height} * double{height}));
    const double expected = static_cast<double>(candela * rho) * steradians;
    // 32 points are drawn from, for four receivers: light on the plate varies by 72 % of its mean between points, and
    // the mean of 32 has an error of 13 %. At the corners themselves it would be 80 % too little.
    EXPECT_NEAR(flux, expected, 2 * 0.13 * expected);
}

// A model many times larger than what a lamp lights of it: each of its receivers stands for metres of it, which not the
// same lamps reach.
TEST(LocalBake, OfALargeModelEveryPartIsLitByItsOwnLamps) {
    constexpr float candela = 100, rho = 0.6f;
    constexpr float half = 8, height = 1, outer_rad = 0.9f;
    Scene scene;
    const uint32_t black = addMaterial(scene, lambert(0)), grey = addMaterial(scene, lambert(rho));
    addBox(scene, {9, 3, 9}, black);
    addCrate(scene, "stage", placed({0, -0.1, 0}), {half, 0.1f, half}, grey);
    const std::vector<glm::vec2> lamps = {{-6, -5}, {5, 6}, {-2, 3}, {4, -3}, {-5, 6}, {1, -6}, {6, 1}, {-6, 0}};
    for (const glm::vec2 at : lamps) {
        PunctualLight& spot = addPointLight(scene, {at.x, height, at.y}, candela, BakeMode::Indirect);
        spot.type = LightType::Spot;
        spot.direction = {0, -1, 0};
        spot.cone_outer_cos = std::cos(outer_rad);
        spot.cone_inner_cos = std::cos(outer_rad - 0.001f);
    }
    const double steradians =
        static_cast<double>(lamps.size()) * 2 * std::numbers::pi * (1 - std::cos(double{outer_rad}));
    listModels(scene, {});
    std::array<double, 2> flux{};
    for (const bool grid : {false, true}) {
        BakedScene b(scene, 1, 1);
        b.bake({.series_rays = 64, .final_rays = 1024, .light_grid = grid});
        for (size_t i = 0; i < b.texels.size(); ++i)
            flux[grid] += static_cast<double>(b.lux(i).x) * static_cast<double>(b.texels.area_m2[i]);
    }
    // Light grids lose a 500,000th; which of two sums is rounded how is below that.
    EXPECT_NEAR(flux[1], flux[0], 1e-4 * flux[0]);
    const double expected = static_cast<double>(candela * rho) * steradians;
    // A lamp lights 5 m2 of the 9 m2 around it, for which 16 points stand: 9 of them, between which light varies by 0.7
    // of its mean, and how many they are by a third of them: 34 % for a lamp, 12 % for eight.
    EXPECT_NEAR(flux[1], expected, 2 * 0.12 * expected);
}

TEST(LocalBake, ProbesInsideOtherGeometryCopyTheNearestInTheOpen) {
    Scene scene;
    const uint32_t material = addMaterial(scene, emissive(glm::vec3(10), 0.5f));
    addBox(scene, {2, 2, 2}, material);
    addCrate(scene, "pillar", placed({-1, 0, 0}), {1.2f, 2.5f, 2.5f}, material, Lighting::Lightmap);
    addCrate(scene, "shelf", placed({0.2, 0, 0}), {1.2f, 0.3f, 0.3f}, material);
    listModels(scene, {});
    const RayScene rays(scene);
    const ModelReceivers receivers(rays);
    const ProbePlaces& places = receivers.places();
    ASSERT_EQ(places.source.size(), 12u);  // 2.4 m at 1.5 m: 3 x 2 x 2
    for (uint32_t i = 0; i < 12; ++i) {
        // x = -1, 0.2, 1.4: the first lies 1.2 m inside of the pillar, which ends at x = 0.2; the second is let out by
        // no way to the shelf's own middle, which stands on the pillar's face.
        const uint32_t column = i % 3;
        EXPECT_EQ(places.source[i] % 3, 2u) << i;
        EXPECT_EQ(places.source[i] / 3, i / 3) << i;
        if (column == 2) {
            EXPECT_EQ(places.source[i], i);
        }
    }
}

TEST(LocalBake, OfTooManyProbesNoneIsFittedAndTheCookSaysSo) {
    Scene scene;
    const uint32_t grey = addMaterial(scene, lambert(0.5f));
    addBox(scene, {2, 2, 2}, grey);
    addCrate(scene, "crate", placed({0, 0, 0}), {0.5f, 0.5f, 0.5f}, grey);
    addPointLight(scene, {1.5f, 1.5f, 0}, 100, BakeMode::Indirect);
    listModels(scene, {.spacing_m = 0.2f, .probes_max = 1000});
    BakedScene b(scene, 1);
    b.bake({.series_rays = 8, .final_rays = 32});
    EXPECT_EQ(b.baked.local_light.rows(), 216u);
    ASSERT_EQ(b.baked.warnings.size(), 1u);
    EXPECT_NE(b.baked.warnings[0].find("'crate': of its 216 probes none is fitted"), std::string::npos);
}

TEST(LocalBake, ASetsLightIsTheSameWithAnotherSetBesideIt) {
    const auto bakedWith = [](bool second) {
        Scene scene;
        const uint32_t grey = addMaterial(scene, lambert(0.5f));
        addBox(scene, {2, 1.5f, 2}, grey);
        addCrate(scene, "crate", placed({0.3, -0.7, 0.2}, 0.5), {0.4f, 0.6f, 0.4f}, grey);
        scene.light_sets.push_back({"first", 1});
        addPointLight(scene, {1, 1, 1}, 100, BakeMode::Indirect).light_set = 0;
        if (second) {
            scene.light_sets.push_back({"second", 1});
            addPointLight(scene, {-1, 1, 1}, 300, BakeMode::Full).light_set = 1;
        }
        listModels(scene, {});
        auto b = std::make_unique<BakedScene>(scene, 2);
        b->bake(quiet());
        return b;
    };
    const auto one = bakedWith(false), two = bakedWith(true);
    ASSERT_EQ(one->baked.local_light.rows(), 8u);
    for (size_t i = 0; i < 8; ++i) {
        const auto find = [&](const Baked& baked) {
            for (const ProbeTermLight& l : baked.local_light.row(i))
                if (l.term == 1) return l.light.radiance;
            return std::array<glm::vec3, 9>{};
        };
        EXPECT_EQ(find(one->baked), find(two->baked)) << i;
        EXPECT_GT(find(one->baked)[0].x, 0) << i;
        EXPECT_EQ(two->baked.local_light.row(i).size(), 3u);
    }
}

TEST(SceneModels, BoxTurnsWithItsNodeAndHasProbesByItsSize) {
    Scene scene;
    const uint32_t grey = addMaterial(scene, lambert(0.5f));
    const glm::dmat4 at = placed({3, 1, -2}, 0.7);
    addCrate(scene, "shelf", glm::scale(at, glm::dvec3(2, 1, 0.5)), {1, 0.5f, 0.4f}, grey);
    addCrate(scene, "fine", placed({9, 0, 0}), {0.5f, 0.5f, 0.5f}, grey).grid_spacing_m = 0.3f;
    listModels(scene, {.spacing_m = 1.5f, .probes_max = 64});
    const auto grids = localGrids(scene, 100);
    ASSERT_EQ(grids.size(), 2u);
    EXPECT_EQ(grids[0].node, "shelf");
    EXPECT_EQ(grids[0].counts, (std::array<uint32_t, 3>{4, 2, 2}));  // 4 m x 1 m x 0.4 m
    EXPECT_EQ(grids[0].first_probe, 100u);
    EXPECT_EQ(grids[1].first_probe, 116u);
    // 1 m every 0.3 m is 5 a side, 125 in all; the largest spacing of the row 0.3 x 1.25^n with at most 64 has 4.
    EXPECT_EQ(grids[1].counts, (std::array<uint32_t, 3>{4, 4, 4}));
    // The last probe is the corner (2, 0.5, 0.2) of the turned box.
    const glm::dvec3 corner(at * glm::dvec4(2, 0.5, 0.2, 1));
    for (size_t axis = 0; axis < 3; ++axis) {
        double p = static_cast<double>(grids[0].origin_m[axis]);
        for (size_t i = 0; i < 3; ++i) p += static_cast<double>(grids[0].step_m[i][axis]) * (grids[0].counts[i] - 1);
        EXPECT_NEAR(p, corner[static_cast<int>(axis)], 1e-5);
    }
}

TEST(SceneModels, WhatFallsApartIntoSmallChartsGetsAGridUnlessTheLevelSaysOtherwise) {
    Scene scene;
    const uint32_t grey = addMaterial(scene, lambert(0.5f));
    const uint32_t glowing = addMaterial(scene, emissive(glm::vec3(1), 0.5f));
    addSphere(scene, 0.3f, 24, 12, grey);  // 264 quads of 4 cm x 8 cm
    addSphere(scene, 0.3f, 24, 12, grey);
    addSphere(scene, 0.3f, 24, 12, glowing);
    addSphere(scene, 10, 24, 12, grey);
    for (SceneMesh& mesh : scene.meshes) {
        mesh.uv1.clear();
        mesh.lighting = Lighting::Automatic;
    }
    scene.meshes[1].lighting = Lighting::Lightmap;
    addCrate(scene, "crate", placed({0, 0, 0}), {1, 1, 1}, grey, Lighting::Automatic);
    chooseLighting(scene);
    EXPECT_EQ(scene.meshes[0].lighting, Lighting::LocalGrid);
    for (size_t m = 1; m < scene.meshes.size(); ++m) EXPECT_EQ(scene.meshes[m].lighting, Lighting::Lightmap) << m;
}

// A ground in fine triangles had 50 probes for 900 m2, and no warning.
TEST(SceneModels, GroundsAndVaultsAreNone) {
    for (const float radius_m : {1.9f, 2.1f}) {
        Scene scene;
        addFloor(scene, 4, addMaterial(scene, lambert(0.5f)), -3).lighting = Lighting::Lightmap;
        addSphere(scene, radius_m, 96, 48, 0);
        scene.meshes[1].uv1.clear();
        scene.meshes[1].lighting = Lighting::Automatic;
        chooseLighting(scene);
        EXPECT_EQ(scene.meshes[1].lighting, radius_m < 2 ? Lighting::LocalGrid : Lighting::Lightmap) << radius_m;
    }
}

// A cave that is all curves was refused, for want of a lightmap.
TEST(SceneModels, ALevelOfCurvesAloneHasLightmaps) {
    Scene scene;
    addSphere(scene, 0.3f, 24, 12, addMaterial(scene, lambert(0.5f)));
    addFloor(scene, 4, 0, -1).lighting = Lighting::None;
    scene.meshes[0].uv1.clear();
    scene.meshes[0].lighting = Lighting::Automatic;
    chooseLighting(scene);
    EXPECT_EQ(scene.meshes[0].lighting, Lighting::Lightmap);
}

// A grid over pebbles of two rooms, merged by a tool, lit the dark room's with 4 lux of the other's lamp.
TEST(SceneModels, WhatLiesApartIsManyThings) {
    for (const float apart_m : {0.7f, 3.0f}) {
        Scene scene;
        addFloor(scene, 4, addMaterial(scene, lambert(0.5f)), -1).lighting = Lighting::Lightmap;
        addSphere(scene, 0.3f, 24, 12, 0);
        SceneMesh& mesh = scene.meshes[1];
        mesh.uv1.clear();
        mesh.lighting = Lighting::Automatic;
        const auto vertices = static_cast<uint32_t>(mesh.positions_m.size());
        const size_t triangles = mesh.triangles.size();
        for (uint32_t v = 0; v < vertices; ++v) {
            mesh.positions_m.push_back(mesh.positions_m[v] + glm::vec3(apart_m, 0, 0));
            mesh.normals.push_back(mesh.normals[v]);
        }
        for (size_t t = 0; t < triangles; ++t) {
            mesh.triangles.push_back(mesh.triangles[t] + vertices);
            mesh.triangle_materials.push_back(mesh.triangle_materials[t]);
        }
        chooseLighting(scene);
        EXPECT_EQ(mesh.lighting, apart_m < 1 ? Lighting::LocalGrid : Lighting::Lightmap) << apart_m;
    }
}

}  // namespace
}  // namespace dimmer::cook::test
