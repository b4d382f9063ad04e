// The demo's level, game_sample/levels/house*.gltf: what it promises to have, and that no light can leak through it.
#include <gtest/gtest.h>
#include <scene/scene.h>

#include <algorithm>
#include <map>
#include <random>
#include <set>

namespace dimmer::cook {
namespace {

Scene load(const char* file) {
    auto scene = importLevel(std::filesystem::path(DIMMER_SOURCE_DIR) / "game_sample/levels" / file);
    EXPECT_TRUE(scene) << scene.error().message;
    return scene ? *scene : Scene{};
}

struct Hit {
    float distance_m = std::numeric_limits<float>::max();
    bool front = true;
    std::string node;
};

// Moeller and Trumbore, "Fast, Minimum Storage Ray/Triangle Intersection", 1997, over all triangles.
Hit trace(const Scene& scene, glm::vec3 origin, glm::vec3 direction) {
    Hit nearest;
    for (const SceneMesh& mesh : scene.meshes)
        for (const glm::uvec3& triangle : mesh.triangles) {
            const glm::vec3 a = mesh.positions_m[triangle.x];
            const glm::vec3 ab = mesh.positions_m[triangle.y] - a, ac = mesh.positions_m[triangle.z] - a;
            const glm::vec3 p = glm::cross(direction, ac), s = origin - a, q = glm::cross(s, ab);
            const float determinant = glm::dot(ab, p);
            if (std::abs(determinant) < 1e-9f) continue;
            const float u = glm::dot(s, p) / determinant, v = glm::dot(direction, q) / determinant;
            const float distance = glm::dot(ac, q) / determinant;
            if (u < 0 || v < 0 || u + v > 1 || distance < 1e-5f || distance >= nearest.distance_m) continue;
            nearest = {distance, determinant > 0, mesh.node};
        }
    return nearest;
}

TEST(House, HasTwelveLightSetsOfOneToFourLights) {
    const Scene scene = load("house.gltf");
    EXPECT_EQ(scene.light_sets.size(), 12u);
    std::map<uint32_t, int> lights;
    for (const PunctualLight& light : scene.lights)
        if (light.light_set) ++lights[*light.light_set];
    EXPECT_EQ(lights.size(), 12u);
    for (const auto& [set, count] : lights) {
        EXPECT_GE(count, 1) << scene.light_sets[set].name;
        EXPECT_LE(count, 4) << scene.light_sets[set].name;
    }
    EXPECT_GT(scene.sky_radiance_cd_m2.b, 0);
    EXPECT_TRUE(scene.warnings.empty()) << scene.warnings.front();
}

TEST(House, HasThreeDoorsOneOfThemDouble) {
    const Scene scene = load("house.gltf");
    std::map<std::string, int> leaves;
    for (const SceneMesh& mesh : scene.meshes)
        if (mesh.door) ++leaves[scene.doors[*mesh.door].name];
    EXPECT_EQ(leaves, (std::map<std::string, int>{{"den", 1}, {"front", 1}, {"living", 2}}));
}

TEST(House, FullDiffersOnlyInTheBakeOfItsLightsAndInWhatGridsLight) {
    const Scene indirect = load("house.gltf"), full = load("house_full.gltf");
    ASSERT_EQ(indirect.lights.size(), full.lights.size());
    for (size_t i = 0; i < full.lights.size(); ++i) {
        EXPECT_EQ(indirect.lights[i].bake, BakeMode::Indirect);
        EXPECT_EQ(full.lights[i].bake, BakeMode::Full);
        EXPECT_EQ(indirect.lights[i].node, full.lights[i].node);
    }
    ASSERT_EQ(indirect.meshes.size(), full.meshes.size());
    size_t grid_lit = 0;
    for (size_t i = 0; i < full.meshes.size(); ++i) {
        EXPECT_EQ(indirect.meshes[i].positions_m, full.meshes[i].positions_m);
        EXPECT_EQ(indirect.meshes[i].triangles, full.meshes[i].triangles);
        EXPECT_NE(indirect.meshes[i].lighting, Lighting::LocalGrid) << indirect.meshes[i].node;
        grid_lit += full.meshes[i].lighting == Lighting::LocalGrid;
    }
    EXPECT_EQ(grid_lit, 10u);  // furniture of the demo
    EXPECT_EQ(indirect.dynamic_places.size(), 4u);
    EXPECT_EQ(full.dynamic_places.size(), 12u);
}

// Whatever is seen from inside a room shows its front: no crack, no wall seen from within, no face turned round.
TEST(House, NoRayMeetsTheBackOfAnything) {
    const Scene scene = load("house.gltf");
    std::mt19937 random(5);
    std::normal_distribution<float> normal;
    std::set<std::string> backs;
    std::vector<glm::vec3> places;
    for (const PunctualLight& light : scene.lights)
        if (light.type != LightType::Directional) places.push_back(light.position_m);
    for (const SceneViewpoint& view : scene.viewpoints) places.push_back(view.position_m);
    ASSERT_GT(places.size(), 25u);
    for (const glm::vec3& place : places)
        for (int ray = 0; ray < 100; ++ray) {
            const glm::vec3 direction = glm::normalize(glm::vec3(normal(random), normal(random), normal(random)));
            if (const Hit hit = trace(scene, place, direction); !hit.front) backs.insert(hit.node);
        }
    EXPECT_EQ(backs, std::set<std::string>{});
}

}  // namespace
}  // namespace dimmer::cook
