// Levels that nobody here made; counts from the table in their README (shared/levels). Skipped where they are absent.
#include <scene/expectations.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <random>

namespace dimmer::cook::test {
namespace {

const std::filesystem::path levels = std::filesystem::path(DIMMER_SOURCE_DIR) / "../shared/levels";

struct LevelFacts {
    const char* file;
    size_t triangles, points, spots, suns, light_sets, lights_in_sets, doors, dynamic, local_grid;
    glm::vec3 bounds_min, bounds_max;
    bool sky;
};

const LevelFacts facts[] = {
    {"lq_old_start.glb", 2338, 9, 0, 1, 5, 9, 1, 30, 8, {-35.5f, -11.81f, -59.5f}, {31.75f, 8.75f, -0.25f}, true},
    {"lq_e2m2.glb", 15360, 143, 5, 0, 17, 46, 11, 39, 44, {-57.25f, -9, -51}, {63, 26, 54}, false},
    {"lq_e2m3.glb", 15992, 455, 0, 1, 29, 277, 33, 48, 7, {-27, -37, -21}, {102, 50.5f, 109}, true},
};

class RealLevel : public testing::TestWithParam<LevelFacts> {};

TEST_P(RealLevel, HasWhatItsReadmeSays) {
    const LevelFacts& expected = GetParam();
    if (!std::filesystem::exists(levels / expected.file)) GTEST_SKIP() << expected.file << " is not here";
    const auto scene = importLevel(levels / expected.file);
    ASSERT_IMPORTED(scene);

    size_t triangles = 0, local_grid = 0;
    glm::vec3 low(INFINITY), high(-INFINITY);
    for (const SceneMesh& mesh : scene->meshes) {
        triangles += mesh.triangles.size();
        local_grid += mesh.lighting == Lighting::LocalGrid;
        for (const glm::vec3& position : mesh.positions_m)
            low = glm::min(low, position), high = glm::max(high, position);
        ASSERT_EQ(mesh.normals.size(), mesh.positions_m.size());
        ASSERT_EQ(mesh.triangle_materials.size(), mesh.triangles.size());
        for (const glm::uvec3& t : mesh.triangles) {
            const glm::vec3 cross = glm::cross(mesh.positions_m[t.y] - mesh.positions_m[t.x],
                                               mesh.positions_m[t.z] - mesh.positions_m[t.x]);
            // "normals agree with windings"
            ASSERT_GT(glm::dot(glm::normalize(cross), mesh.normals[t.x]), 0.9f) << mesh.node;
        }
    }
    EXPECT_EQ(triangles, expected.triangles);
    EXPECT_EQ(local_grid, expected.local_grid);
    expectNear(low, expected.bounds_min, 0.01f);
    expectNear(high, expected.bounds_max, 0.01f);

    const auto count = [&](LightType type) {
        return static_cast<size_t>(std::ranges::count(scene->lights, type, &PunctualLight::type));
    };
    EXPECT_EQ(count(LightType::Point), expected.points);
    EXPECT_EQ(count(LightType::Spot), expected.spots);
    EXPECT_EQ(count(LightType::Directional), expected.suns);
    EXPECT_EQ(scene->light_sets.size(), expected.light_sets);
    EXPECT_EQ(static_cast<size_t>(
                  std::ranges::count_if(scene->lights, [](const auto& l) { return l.light_set.has_value(); })),
              expected.lights_in_sets);
    EXPECT_EQ(scene->doors.size(), expected.doors);
    EXPECT_EQ(scene->dynamic_places.size(), expected.dynamic);
    EXPECT_EQ(scene->sky_radiance_cd_m2 != glm::vec3(0), expected.sky);
    ASSERT_FALSE(scene->viewpoints.empty());
    EXPECT_EQ(scene->viewpoints[0].name, "player_start");
    EXPECT_TRUE(scene->warnings.empty()) << scene->warnings.front();
}

INSTANTIATE_TEST_SUITE_P(LibreQuake, RealLevel, testing::ValuesIn(facts), [](const auto& level) {
    return std::string(level.param.file, std::string_view(level.param.file).find('.'));
});

TEST(RealLevels, TwoRooms) {
    const auto path = levels / "two_rooms.glb";
    if (!std::filesystem::exists(path)) GTEST_SKIP() << "two_rooms.glb is not here";
    const auto scene = importLevel(path);
    ASSERT_IMPORTED(scene);
    // Read off the file's JSON.
    ASSERT_EQ(scene->lights.size(), 3u);
    EXPECT_EQ(scene->lights[2].bake, BakeMode::None);
    ASSERT_EQ(scene->light_sets.size(), 2u);
    EXPECT_EQ(scene->light_sets[0].name, "desk");  // the panel comes before the lamps
    EXPECT_EQ(scene->light_sets[1].name, "lamp");
    ASSERT_EQ(scene->doors.size(), 1u);
    EXPECT_EQ(scene->doors[0].name, "mid");
    ASSERT_EQ(scene->materials.size(), 8u);
    EXPECT_EQ(scene->materials[3].specular, 0.5f);
    EXPECT_EQ(scene->materials[5].metallic, 1.0f);
    expectNear(scene->materials[7].emission_cd_m2, {300, 300, 270}, 1e-3f);
    const auto mesh = [&](const char* node) { return std::ranges::find(scene->meshes, node, &SceneMesh::node); };
    ASSERT_NE(mesh("door_leaf"), scene->meshes.end());
    EXPECT_EQ(mesh("door_leaf")->door, 0u);
    EXPECT_EQ(mesh("panel")->light_set, 0u);
    EXPECT_EQ(mesh("cat")->lighting, Lighting::Dynamic);
    EXPECT_TRUE(scene->warnings.empty());
}

TEST(RealLevels, MutationsOfARealLevelGetAnAnswer) {
    std::ifstream stream(levels / "lq_old_start.glb", std::ios::binary);
    if (!stream) GTEST_SKIP() << "lq_old_start.glb is not here";
    const std::vector<uint8_t> whole{std::istreambuf_iterator<char>(stream), {}};
    std::mt19937 random(3);
    for (int i = 0; i < 150; ++i) {
        std::vector<uint8_t> bytes = whole;
        if (i % 3 == 0) bytes.resize(random() % bytes.size());
        // The JSON comes first: hit it more often than its share.
        const size_t reach = i % 2 == 0 ? bytes.size() : std::min<size_t>(bytes.size(), 40000);
        if (reach > 0) bytes[random() % reach] ^= static_cast<uint8_t>(1u << random() % 8);
        const auto scene = importBytes("level.glb", bytes);
        if (i % 3 == 0) {
            EXPECT_FALSE(scene.has_value());
        } else if (!scene) {
            EXPECT_THAT(scene.error().message, testing::HasSubstr("level.glb"));
        }
    }
}

}  // namespace
}  // namespace dimmer::cook::test
