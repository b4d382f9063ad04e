// Whole cooks of scenes whose light is a closed form, read back through the runtime's pages.
#include <bake/reference.h>
#include <bake/test_scenes.h>
#include <pipeline/cooked_level.h>

#include <random>

namespace dimmer::cook::test {
namespace {

std::vector<QueryPoint> placesOn(const Scene& scene, int count) {
    const RayScene rays(scene);
    std::mt19937 random(7);
    std::uniform_real_distribution<float> unit(0, 1);
    std::vector<QueryPoint> out;
    for (int i = 0; i < count; ++i) {
        const auto t = static_cast<uint32_t>(random() % rays.triangles().size());
        const float root = std::sqrt(unit(random)), v = unit(random);
        out.push_back({rays.pointOn(t, root * (1 - v), root * v), rays.triangles()[t].normal});
    }
    return out;
}

class ClosedFormLamp : public testing::TestWithParam<const char*> {};

// 2 %: 0.8 % for rounding to the colour format, 0.6 % for a straight line between texels 0.25 m apart (E'' / E is at
// most 3 / height^2), the rest for shadow points that stand for a texel's whole area. At draft as well: few points will
// do where they balance around the texel's centre.
TEST_P(ClosedFormLamp, OverAPlane) {
    Scene scene;
    addFloor(scene, 4, addMaterial(scene, lambert(0)));
    addPointLight(scene, {0, 2, 0}, 100, BakeMode::Full);
    const auto pack = cooked(scene, GetParam());
    ASSERT_TRUE(pack);
    std::vector<QueryPoint> points;
    std::mt19937 random(1);
    std::uniform_real_distribution<float> place(-3.5f, 3.5f);
    for (int i = 0; i < 200; ++i) points.push_back({{place(random), 0, place(random)}, {0, 1, 0}});
    const auto light = sampled(*pack, points, "");
    for (size_t i = 0; i < points.size(); ++i) {
        const glm::dvec3 p(points[i].position_m);
        const double expected = 100 * 2 / std::pow(p.x * p.x + p.z * p.z + 4, 1.5);
        EXPECT_NEAR(light[i].x, expected, 0.02 * expected) << p.x << " " << p.z;
    }
}

INSTANTIATE_TEST_SUITE_P(Quality, ClosedFormLamp, testing::Values("draft", "final"));

class ClosedFormFurnace : public testing::TestWithParam<float> {};

// E = pi L / (1 - rho) everywhere. Constant light meets the same rounding in every texel, up to 0.8 %, so the energy is
// judged over radiances that spread over an octave: six values, whose roundings leave about 0.2 % of the mean.
TEST_P(ClosedFormFurnace, IsEvenlyLit) {
    const float rho = GetParam();
    double ratio_sum = 0;
    int ratios = 0;
    for (float radiance : {1.0f, 1.26f, 1.59f}) {
        Scene scene;
        // Green a sixth of an octave above red.
        addBox(scene, {1, 1.5f, 2}, addMaterial(scene, emissive(radiance * glm::vec3(1, 1.12f, 1), rho)));
        const auto pack = cooked(scene, "final");
        ASSERT_TRUE(pack);
        const double expected = pi_d / (1 - static_cast<double>(rho)) * static_cast<double>(radiance);
        for (const glm::dvec3& e : sampled(*pack, placesOn(scene, 200), "")) {
            EXPECT_NEAR(e.x, expected, 0.02 * expected);
            EXPECT_NEAR(e.y, 1.12 * expected, 0.02 * 1.12 * expected);
            ratio_sum += e.x / expected + e.y / (1.12 * expected);
            ratios += 2;
        }
    }
    EXPECT_NEAR(ratio_sum / ratios, 1, 0.005);
    RecordProperty("energy", std::to_string(ratio_sum / ratios));
    printf("furnace, albedo %.1f: energy %+.2f %%\n", static_cast<double>(rho), 100 * (ratio_sum / ratios - 1));
}

INSTANTIATE_TEST_SUITE_P(Albedo, ClosedFormFurnace, testing::Values(0.5f, 0.8f));

// Indirect = direct x rho / (1 - rho), evenly; charts given by TEXCOORD_1.
TEST(ClosedForm, SphereLitFromItsCentre) {
    Scene scene;
    const double area = addSphere(scene, 2, 48, 24, addMaterial(scene, lambert(0.6f)));
    addPointLight(scene, {0, 0, 0}, 50, BakeMode::Indirect);
    const auto pack = cooked(scene, "final");
    ASSERT_TRUE(pack);
    const double expected = 4 * pi_d * 50 / area * 0.6 / 0.4;
    const auto light = sampled(*pack, placesOn(scene, 300), "");
    double mean = 0;
    for (const glm::dvec3& e : light) {
        // 2 %, and 0.4 % by which facets differ from a sphere.
        EXPECT_NEAR(e.x, expected, 0.024 * expected);
        mean += e.x / static_cast<double>(light.size());
    }
    EXPECT_NEAR(mean, expected, 0.02 * expected);
}

Scene roomWithSets() {
    Scene scene;
    scene.file = "room";
    addBox(scene, {2, 1.5f, 3}, addMaterial(scene, lambert(0.6f)));
    const uint32_t panel = addMaterial(scene, emissive({60, 55, 50}));
    scene.light_sets = {{"a", 1}, {"b", 1}, {"panel", 1}};
    addPointLight(scene, {1, 0, 1}, 100, BakeMode::Indirect).light_set = 0;
    addPointLight(scene, {-1, 0.5f, -2}, 20, BakeMode::Full).light_set = 1;
    addQuad(scene, "panel", {0, 1.4f, 0}, {0.5f, 0, 0}, {0, 0, 0.5f}, panel).light_set = 2;
    addPointLight(scene, {0, -1, 0}, 5, BakeMode::Indirect);
    return scene;
}

TEST(ClosedForm, SetsDecodedOneByOneAddUpToAllOn) {
    const Scene scene = roomWithSets();
    const auto pack = cooked(scene, "final");
    ASSERT_TRUE(pack);
    std::vector<QueryPoint> points = placesOn(scene, 150);
    // On the room, not on the panel, which hangs lower than its upper side's texels.
    std::erase_if(points, [](const QueryPoint& q) { return std::abs(q.position_m.y - 1.4f) < 0.05f; });
    const auto all = sampled(*pack, points, ""), base = sampled(*pack, points, "all=0");
    std::vector<glm::dvec3> sum = base, shown = base;
    for (const char* state : {"all=0,a=1", "all=0,b=1", "all=0,panel=1"}) {
        const auto one = sampled(*pack, points, state);
        for (size_t i = 0; i < points.size(); ++i) {
            sum[i] += one[i] - base[i];
            shown[i] += one[i] + base[i];
        }
    }
    const RayScene rays(scene);
    const ReferenceTracer tracer(rays, {});
    double level = 0, level_reference = 0, level_error2 = 0;
    for (size_t i = 0; i < points.size(); ++i) {
        // Every page value is rounded by at most half a step: 1/128 of it, blue 1/64.
        for (int c = 0; c < 3; ++c)
            EXPECT_NEAR(sum[i][c], all[i][c], (shown[i][c] + all[i][c]) / (c == 2 ? 64 : 128)) << i << " " << c;
        const ReferenceValue v = tracer.irradiance({points[i].position_m, points[i].normal}, 500);
        level += sum[i].y;
        level_reference += static_cast<double>(v.irradiance_lux.y);
        level_error2 += static_cast<double>(v.standard_error_lux.y * v.standard_error_lux.y);
    }
    // Against the path tracer with all on: its noise, 0.2 % for the last bounces, and roundings that do not quite
    // cancel over the level's points (0.5 %).
    EXPECT_NEAR(level, level_reference, 4 * std::sqrt(level_error2) + 0.007 * level_reference);
}

}  // namespace
}  // namespace dimmer::cook::test
