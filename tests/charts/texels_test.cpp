// Where the sample points of texels lie.
#include <bake/test_scenes.h>
#include <charts/texels.h>
#include <charts/unwrap.h>
#include <gtest/gtest.h>

namespace dimmer::cook::test {
namespace {

// A point of a face's plane in texels of its page: the face's own map from corners to texels, carried on linearly.
glm::dvec2 texelsOf(const RayScene& rays, const Unwrap& charts, const SamplePoint& sample) {
    const uint32_t triangle = charts.faces[sample.face].triangle;
    const auto& uv = charts.uv_texels[sample.face];
    const glm::dvec3 a = rays.corner(triangle, 0), ab = glm::dvec3(rays.corner(triangle, 1)) - a,
                     ac = glm::dvec3(rays.corner(triangle, 2)) - a, ap = glm::dvec3(sample.position_m) - a;
    const glm::dvec3 normal = glm::cross(ab, ac);
    const double area = glm::dot(normal, normal);
    const double v = glm::dot(glm::cross(ap, ac), normal) / area, w = glm::dot(glm::cross(ab, ap), normal) / area;
    return (1 - v - w) * glm::dvec2(uv[0]) + v * glm::dvec2(uv[1]) + w * glm::dvec2(uv[2]);
}

// Pages are looked up at texels' centres: points that lean to one side would shift the light by as much.
TEST(Texels, PointsBalanceAroundTheCentre) {
    Scene scene;
    addFloor(scene, 2, addMaterial(scene, lambert(0.5f)));
    const RayScene rays(scene);
    const auto charts = unwrap(rays, {.texels_per_metre = 4, .page_size = 256});
    ASSERT_TRUE(charts.has_value());
    for (const uint32_t count : {1u, 2u, 3u, 4u, 5u, 8u, 13u, 16u, 64u}) {
        const Texels texels = sampleTexels(rays, *charts, count);
        size_t whole = 0;
        for (size_t i = 0; i < texels.size(); ++i) {
            if (texels.area_m2[i] < 0.0624f) continue;  // of 0.0625: a texel on the border
            ++whole;
            ASSERT_EQ(texels.sampleCount(i), count);
            glm::dvec2 sum(0);
            for (uint32_t s = 0; s < count; ++s) sum += texelsOf(rays, *charts, texels.sample(i, s));
            const glm::dvec2 centre = glm::floor(sum / static_cast<double>(count)) + 0.5;
            // Floats of metres over texels of 0.25 m leave 1e-5 texels; Halton points as they come lie up to 0.17 off.
            EXPECT_NEAR(sum.x / count, centre.x, 1e-4) << count;
            EXPECT_NEAR(sum.y / count, centre.y, 1e-4) << count;
        }
        EXPECT_GT(whole, 200u);
    }
}

// 400 m at 4 texels per metre are 1600 texels; a page of 256 keeps 254 of them: 6.3 times as coarse.
TEST(Charts, SaysWhatIsTooLargeForAPage) {
    Scene scene;
    scene.file = "plain.glb";
    addFloor(scene, 200, addMaterial(scene, lambert(0.5f)));
    const RayScene rays(scene);
    const auto coarse = unwrap(rays, {.texels_per_metre = 4, .page_size = 256});
    ASSERT_TRUE(coarse.has_value());
    ASSERT_EQ(coarse->warnings.size(), 1u);
    const std::string node = "plain.glb: node '" + scene.meshes[0].node + "'";
    for (const std::string& part : {node, std::string("6.3 times as coarse"), std::string("page_size")})
        EXPECT_TRUE(coarse->warnings[0].contains(part)) << coarse->warnings[0];
    EXPECT_TRUE(unwrap(rays, {.texels_per_metre = 4, .page_size = 4096})->warnings.empty());
}

// What a remedy says of a lower density: charts as unwrap() then makes them, and the pages that it packs.
TEST(Charts, OfLongerTexelsAreForetold) {
    Scene scene;
    const uint32_t white = addMaterial(scene, lambert(0.5f));
    for (int i = 0; i < 40; ++i) {
        const auto side = static_cast<float>(i);
        addQuad(scene, "quad", {0, 5 * side, 0}, {1.3f + 0.37f * static_cast<float>(i % 5), 0, 0},
                {0, 0, 0.7f + 0.21f * side}, white);
    }
    const RayScene rays(scene);
    const auto fine = unwrap(rays, {.texels_per_metre = 8, .page_size = 2048});
    ASSERT_TRUE(fine.has_value());
    const auto texelsOf = [](const Unwrap& u) {
        return static_cast<double>(u.page_width) * u.page_height * u.page_count;
    };
    std::vector<glm::uvec2> sizes;
    for (const Chart& c : fine->charts) sizes.emplace_back(c.width, c.height);
    EXPECT_EQ(static_cast<double>(pageTexels(sizes, 2048)), texelsOf(*fine));
    for (const float density : {6.0f, 4.0f, 2.0f}) {
        const auto coarse = unwrap(rays, {.texels_per_metre = density, .page_size = 2048});
        ASSERT_TRUE(coarse.has_value());
        std::vector<glm::uvec2> foretold;
        for (const glm::uvec2 c : sizes) foretold.push_back(chartSize(c, double{8 / density}));
        // Each side is at most one texel too long: of some 10 to 60 texels a quarter at the most; pages come in steps.
        const double ratio = static_cast<double>(pageTexels(foretold, 2048)) / texelsOf(*coarse);
        EXPECT_GE(ratio, 0.9) << density;
        EXPECT_LE(ratio, 1.3) << density;
    }
}

}  // namespace
}  // namespace dimmer::cook::test
