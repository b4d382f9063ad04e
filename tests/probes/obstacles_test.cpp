// What is found among a tetrahedron's own triangles is what rays find.
#include <bake/sampling.h>
#include <bake/test_scenes.h>
#include <gtest/gtest.h>
#include <probes/obstacles.h>

namespace dimmer::cook::test {
namespace {

Scene furnishedRoom() {
    Scene scene;
    const uint32_t white = addMaterial(scene, lambert(0.5f));
    addBox(scene, {3, 1.5f, 3}, white);
    addSolid(scene, "wall", {0.5f, 0, 0}, {0.05f, 1.4f, 2}, white);  // no two faces in one plane
    addSolid(scene, "table", {-1, -0.8f, 0.3f}, {0.6f, 0.02f, 0.4f}, white);
    for (uint32_t i = 0; i < 12; ++i) {
        const glm::vec3 u = sequence3d(i, 5);
        addSolid(scene, "box", glm::vec3(-2.5f, -1.4f, -2.5f) + u * glm::vec3(5, 2.5f, 5), glm::vec3(0.1f) + 0.1f * u,
                 white);
    }
    return scene;
}

std::array<glm::vec3, 4> tetrahedron(uint32_t i, float size_m) {
    std::array<glm::vec3, 4> corners;
    const glm::vec3 centre = (sequence3d(i, 1) - 0.5f) * glm::vec3(6, 3, 6);
    for (uint32_t k = 0; k < 4; ++k) corners[k] = centre + size_m * (sequence3d(4 * i + k, 2) - 0.5f);
    return corners;
}

Barycentric pointIn(uint32_t i) {
    glm::vec4 b(unitFloat(hash(i, 1)), unitFloat(hash(i, 2)), unitFloat(hash(i, 3)), unitFloat(hash(i, 4)));
    b /= b.x + b.y + b.z + b.w;
    return {b.x, b.y, b.z, b.w};
}

TEST(Obstacles, AreThoseThatRaysMeet) {
    const Scene scene = furnishedRoom();
    const RayScene rays(scene);
    const TriangleCells cells(rays);
    size_t hidden = 0, differ = 0, asked = 0;
    for (uint32_t i = 0; i < 400; ++i) {
        const auto corners = tetrahedron(i, 0.3f + 0.01f * static_cast<float>(i % 300));
        const Obstacles own(rays, &cells, corners), traced(rays, nullptr, corners);
        for (uint32_t p = 0; p < 50; ++p) {
            const auto found = own.from(pointIn(50 * i + p), {true, true, true, true});
            const auto met = traced.from(pointIn(50 * i + p), {true, true, true, true});
            for (size_t v = 0; v < 4; ++v) {
                ++asked;
                hidden += met[v].any;
                // Of a hit's triangles only the planes and sides count: two of one quad share an edge.
                const auto normal = [&](uint32_t t) { return rays.triangles()[t].normal; };
                differ +=
                    found[v].any != met[v].any ||
                    (met[v].any && (found[v].back != met[v].back || normal(found[v].first) != normal(met[v].first) ||
                                    normal(found[v].last) != normal(met[v].last)));
            }
        }
    }
    EXPECT_GT(hidden, asked / 5);
    // Rays that pass within rounding (a millionth of a metre) of an edge: at most one in ten thousand.
    EXPECT_LE(differ, asked / 10000);
}

TEST(Obstacles, NoneIsSaidOfTheOpenAlone) {
    const Scene scene = furnishedRoom();
    const RayScene rays(scene);
    const TriangleCells cells(rays);
    size_t open = 0;
    for (uint32_t i = 0; i < 2000; ++i) {
        const auto corners = tetrahedron(i, 0.6f);
        if (!Obstacles(rays, &cells, corners).none()) continue;
        ++open;
        for (size_t a = 0; a < 4; ++a)
            for (size_t b = 0; b < a; ++b) EXPECT_FALSE(rays.blocked(corners[a], corners[b]));
    }
    EXPECT_GT(open, 400u);  // a quarter of the boxes that hold them meet nothing
}

}  // namespace
}  // namespace dimmer::cook::test
