// Houses on hills: thin walls on ground of small facets.
#include <bake/test_scenes.h>
#include <gtest/gtest.h>
#include <pipeline/cooked_level.h>

#include <algorithm>
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>
#include <random>
#include <span>
#include <vector>

namespace dimmer::cook::test {
namespace {

constexpr float hill_side_m = 20, hut_m = 3.13f, hut_wall_m = 0.15f, hut_room_m = hut_m - hut_wall_m;

struct Hill {
    float step_m, height_m, turn_degrees;  // of facets, of hills, of the house
};

SceneMesh groundOf(const Hill& hill, uint32_t material) {
    const auto at = [&](float x, float z) {
        return glm::vec3(x, hill.height_m * std::sin(0.45f * x + 0.3f) * std::cos(0.4f * z - 0.2f), z);
    };
    SceneMesh mesh;
    mesh.node = "ground";
    const auto n = static_cast<uint32_t>(hill_side_m / hill.step_m);
    for (uint32_t i = 0; i <= n; ++i)
        for (uint32_t j = 0; j <= n; ++j) {
            const float x = hill.step_m * static_cast<float>(i) - 0.5f * hill_side_m,
                        z = hill.step_m * static_cast<float>(j) - 0.5f * hill_side_m, e = 1e-2f;
            mesh.positions_m.push_back(at(x, z));
            mesh.normals.push_back(
                glm::normalize(glm::cross(at(x, z + e) - at(x, z - e), at(x + e, z) - at(x - e, z))));
        }
    for (uint32_t i = 0; i < n; ++i)
        for (uint32_t j = 0; j < n; ++j) {
            const uint32_t a = i * (n + 1) + j, b = a + 1, c = a + n + 1, d = c + 1;
            for (const glm::uvec3 t : {glm::uvec3(a, b, d), glm::uvec3(a, d, c)}) mesh.triangles.push_back(t);
        }
    mesh.triangle_materials.assign(mesh.triangles.size(), material);
    return mesh;
}

void addHouse(Scene& scene, const glm::mat3& turned, uint32_t material) {
    const size_t first = scene.meshes.size();
    const float middle_m = hut_m - 0.5f * hut_wall_m;
    for (const float side : {-1.0f, 1.0f}) {
        addSolid(scene, "wall", {0, 0, side * middle_m}, {hut_m, 4, 0.5f * hut_wall_m}, material);
        addSolid(scene, "wall", {side * middle_m, 0, 0}, {0.5f * hut_wall_m, 4, hut_room_m}, material);
    }
    addSolid(scene, "roof", {0, 4.1f, 0}, {hut_m, 0.1f, hut_m}, material);
    for (SceneMesh& mesh : std::span(scene.meshes).subspan(first)) {
        for (glm::vec3& p : mesh.positions_m) p = turned * p;
        for (glm::vec3& n : mesh.normals) n = turned * n;
    }
}

// On the ground within the house.
std::vector<QueryPoint> placesInside(const SceneMesh& ground, const glm::mat3& turned) {
    std::mt19937 random(1);
    std::uniform_real_distribution<float> unit(0, 1);
    std::vector<QueryPoint> places;
    while (places.size() < 2000) {
        const glm::uvec3 t = ground.triangles[random() % ground.triangles.size()];
        const glm::vec3 a = ground.positions_m[t.x], ab = ground.positions_m[t.y] - a, ac = ground.positions_m[t.z] - a;
        const float root = std::sqrt(unit(random)), v = unit(random);
        const glm::vec3 p = a + root * (1 - v) * ab + root * v * ac, own = glm::transpose(turned) * p;
        if (std::max(std::abs(own.x), std::abs(own.z)) < hut_room_m - 0.02f)
            places.push_back({p, glm::normalize(glm::cross(ab, ac))});
    }
    return places;
}

// No light gets in, exactly. A wall is plumb, and a metre up it is beside the facet that it stands on; the corner of a
// house takes less than a texel of one.
TEST(HillWalls, AHouseWithoutADoorIsDark) {
    for (const Hill& hill : {Hill{2, 2, 25}, Hill{1, 0.8f, 25}, Hill{1, 2, 0}, Hill{0.5f, 2, 0}}) {
        SCOPED_TRACE(testing::Message() << hill.step_m << " " << hill.height_m << " " << hill.turn_degrees);
        Scene scene;
        const uint32_t grey = addMaterial(scene, lambert(0.6f));
        const glm::mat3 turned(glm::rotate(glm::mat4(1), glm::radians(hill.turn_degrees), {0, 1, 0}));
        scene.meshes.push_back(groundOf(hill, grey));
        addHouse(scene, turned, grey);
        PunctualLight sun;
        sun.node = "sun";
        sun.type = LightType::Directional;
        sun.direction = glm::normalize(glm::vec3(-0.5f, -1, 0.3f));
        sun.intensity = glm::vec3(20000);
        sun.bake = BakeMode::Full;
        scene.lights.push_back(sun);
        const auto places = placesInside(scene.meshes[0], turned);
        const auto pack = cooked(scene, "draft");
        ASSERT_TRUE(pack);
        double brightest_lux = 0;
        for (const glm::dvec3 light : sampled(*pack, places, "")) brightest_lux = std::max(brightest_lux, light.y);
        EXPECT_EQ(brightest_lux, 0);
    }
}

}  // namespace
}  // namespace dimmer::cook::test
