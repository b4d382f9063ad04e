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

}  // namespace
}  // namespace dimmer::cook::test
