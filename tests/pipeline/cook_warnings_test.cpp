// What a cook says of levels that look wrong as a whole: their light, their size, their place.
#include <bake/baked_scene.h>
#include <bake/test_scenes.h>
#include <charts/texels.h>
#include <gmock/gmock.h>
#include <pipeline/cook_warnings.h>
#include <pipeline/set_scales.h>
#include <trace/ray_scene.h>

#include <random>

namespace dimmer::cook::test {
namespace {

using testing::HasSubstr;

TEST(CoarseExposure, NamesTheSetThatAsksForIt) {
    Scene scene;
    scene.file = "level.glb";
    scene.light_sets = {{"hall", 1}, {"sun", 1e11f}};
    EXPECT_FALSE(coarseExposure(scene, 0x1p-14f, 2));  // 1 lux is the smallest that is stored well
    EXPECT_FALSE(coarseExposure(scene, 64, 2));
    const auto warning = coarseExposure(scene, 0x1p-30f, 2);
    ASSERT_TRUE(warning);
    EXPECT_THAT(*warning, testing::AllOf(HasSubstr("level.glb: "), HasSubstr("6.55e+04 lux"), HasSubstr("'sun'"),
                                         HasSubstr("1e+11")));
    const auto of_hall = coarseExposure(scene, 0x1p-30f, 1);  // it is the bright one, whatever others may be set to
    ASSERT_TRUE(of_hall);
    EXPECT_THAT(*of_hall, testing::AllOf(HasSubstr("'hall'"), HasSubstr("intensity"), testing::Not(HasSubstr("sun"))));
    EXPECT_THAT(*coarseExposure(scene, 0x1p-30f, always_group),
                testing::AllOf(HasSubstr("always on"), HasSubstr("intensity")));
}

TEST(WithoutLight, IsSaidOfLevelsThatStayBlack) {
    Scene scene;
    scene.file = "level.glb";
    scene.materials.resize(1);
    ASSERT_TRUE(withoutLight(scene));
    EXPECT_THAT(*withoutLight(scene), testing::AllOf(HasSubstr("level.glb: "), HasSubstr("no light")));
    Scene lamp = scene, sky = scene, panel = scene;
    lamp.lights.emplace_back();
    sky.sky_radiance_cd_m2 = {0, 0, 1};
    panel.materials[0].emission_cd_m2 = {1, 0, 0};
    for (const Scene& lit : {lamp, sky, panel}) EXPECT_FALSE(withoutLight(lit));
}

// A lamp over a floor, one without intensity, and a sun behind a dome.
TEST(AllInTheDark, IsSaidWhereLightsLightNothing) {
    Scene lit;
    lit.file = "level.glb";
    const uint32_t grey = addMaterial(lit, lambert(0.5f));
    addFloor(lit, 2, grey);
    Scene enclosed = lit, black = lit;
    addPointLight(lit, {0, 1, 0}, 10, BakeMode::Indirect);
    addPointLight(black, {0, 1, 0}, 0, BakeMode::Full);
    addBox(enclosed, {4, 4, 4}, grey);
    PunctualLight& sun = addPointLight(enclosed, {0, 0, 0}, 1e5f, BakeMode::Full);
    sun.type = LightType::Directional;
    sun.direction = {0, -1, 0};
    const auto warningOf = [](const Scene& scene, double energy_lm) {
        const BakedScene b(scene, 2, 2);
        return allInTheDark(*b.rays, b.charts, b.texels, energy_lm);
    };
    EXPECT_FALSE(warningOf(lit, 0));
    EXPECT_FALSE(warningOf(black, 1e-9));
    Scene drawn = lit;  // by a renderer alone
    drawn.lights[0].bake = BakeMode::None;
    divideByScales(drawn);
    EXPECT_FALSE(warningOf(drawn, 0));
    for (const Scene* dark : {&black, &enclosed}) {
        const auto warning = warningOf(*dark, 0);
        ASSERT_TRUE(warning);
        EXPECT_THAT(*warning, testing::AllOf(HasSubstr("level.glb: "), HasSubstr("black")));
    }
    lit.lights.clear();
    EXPECT_FALSE(warningOf(lit, 0)) << "said already";
}

// A room of 4 x 2.4 x 4 m in metres, decimetres and centimetres, at 4 texels per metre.
TEST(TooSmallForTexels, IsSaidOfLevelsInAnotherUnit) {
    for (const float scale : {1.0f, 0.1f, 0.01f}) {
        Scene scene;
        scene.file = "level.glb";
        addBox(scene, glm::vec3(2, 1.2f, 2) * scale, addMaterial(scene, lambert(0.5f)));
        const BakedScene b(scene, 4, 4);
        const auto warning = tooSmallForTexels(*b.rays, b.charts, b.texels);
        EXPECT_EQ(warning.has_value(), scale < 1) << scale;
        if (!warning) continue;
        EXPECT_THAT(*warning, testing::AllOf(HasSubstr("level.glb: "), HasSubstr("in metres,")));
    }
}

// What is small altogether is no level, however wide most of it is: a yard of 1 m.
TEST(TooSmallForTexels, IsSaidOfWhatIsSmallerThanAPerson) {
    for (const float half_m : {0.5f, 1.0f}) {
        Scene scene;
        scene.file = "level.glb";
        addFloor(scene, half_m, addMaterial(scene, lambert(0.5f)));
        const BakedScene b(scene, 8, 4);
        const auto warning = tooSmallForTexels(*b.rays, b.charts, b.texels);
        EXPECT_EQ(warning.has_value(), half_m < 1);
        if (!warning) continue;
        EXPECT_THAT(*warning, HasSubstr("level.glb: is 1.00 x 0.00 x 1.00 m large, smaller than a person"));
    }
}

// A sliver may have no area left on its page, and by that infinitely many texels.
TEST(TooLargeForTexels, CountsNoSlivers) {
    Scene scene;
    addBox(scene, {2, 1.4f, 2}, addMaterial(scene, lambert(0.5f)));
    const RayScene rays(scene);
    auto charts = unwrap(rays, {.texels_per_metre = 1.5f, .page_size = 2048});
    ASSERT_TRUE(charts.has_value());
    charts->texel_area_m2[3] = 0;
    EXPECT_FALSE(tooLargeForTexels(rays, *charts));
}

// A room of 4 m, and one of 400 numbers that are centimetres.
TEST(TooLargeForTexels, IsSaidOfLevelsInAnotherUnit) {
    for (const float half_m : {2.0f, 200.0f}) {
        Scene scene;
        scene.file = "level.glb";
        addBox(scene, half_m * glm::vec3(1, 0.7f, 1), addMaterial(scene, lambert(0.5f)));
        const RayScene rays(scene);
        const auto charts = unwrap(rays, {.texels_per_metre = 1.5f, .page_size = 2048});
        ASSERT_TRUE(charts.has_value());
        const auto warning = tooLargeForTexels(rays, *charts);
        ASSERT_EQ(warning.has_value(), half_m > 2);
        if (!warning) continue;
        // 2 * 400 * 400 + 4 * 400 * 280 m2, 2.25 texels each.
        EXPECT_THAT(*warning, testing::AllOf(HasSubstr("level.glb: is 400 x 280 x 400 m"), HasSubstr("12 faces"),
                                             HasSubstr("has 1.7 million texels"), HasSubstr("in metres,")));
    }
}

// Ground of 10 m in triangles of 25 cm, with sharp edges between all: its charts are narrow, and it is not.
TEST(TooSmallForTexels, IsNotSaidOfFineTriangles) {
    Scene scene;
    SceneMesh& ground = addFloor(scene, 5, addMaterial(scene, lambert(0.5f)));
    ground.positions_m.clear(), ground.normals.clear(), ground.uv1.clear();
    ground.triangles.clear(), ground.triangle_materials.clear();
    constexpr uint32_t cells = 40;
    std::mt19937 random(3);
    std::uniform_real_distribution<float> height_m(0, 1);
    for (uint32_t j = 0; j <= cells; ++j)
        for (uint32_t i = 0; i <= cells; ++i) {
            const float x = 0.25f * static_cast<float>(i) - 5, z = 0.25f * static_cast<float>(j) - 5;
            ground.positions_m.push_back({x, height_m(random), z});
            ground.normals.push_back({0, 1, 0});
        }
    for (uint32_t j = 0; j < cells; ++j)
        for (uint32_t i = 0; i < cells; ++i) {
            const uint32_t a = j * (cells + 1) + i, b = a + 1, c = a + cells + 1;
            ground.triangles.push_back({a, c, b});
            ground.triangles.push_back({b, c, c + 1});
            ground.triangle_materials.insert(ground.triangle_materials.end(), 2, 0);
        }
    ground.lighting = Lighting::Lightmap;
    const BakedScene b(scene, 4, 4);
    ASSERT_GT(b.charts.charts.size(), 1000u);
    EXPECT_FALSE(tooSmallForTexels(*b.rays, b.charts, b.texels));
}

TEST(FarFromOrigin, IsSaidOfLevelsFarOff) {
    for (const float at_m : {0.0f, 1500.0f, -5000.0f}) {
        Scene scene;
        scene.file = "level.glb";
        scene.materials.resize(1);
        scene.meshes.emplace_back();
        scene.meshes[0].positions_m = {{at_m, 0, 0}, {at_m + 1, 0, 0}, {at_m, 0, 1}};
        scene.meshes[0].triangles = {{0, 1, 2}};
        scene.meshes[0].triangle_materials = {0};
        const auto warning = farFromOrigin(RayScene(scene));
        EXPECT_EQ(warning.has_value(), at_m == -5000);
        if (!warning) continue;
        EXPECT_THAT(*warning, testing::AllOf(HasSubstr("level.glb: "), HasSubstr("5000 m")));
    }
}

}  // namespace
}  // namespace dimmer::cook::test
