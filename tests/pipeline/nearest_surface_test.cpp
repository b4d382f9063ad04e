// Which surface a tool means that asks for a place.
#include <gtest/gtest.h>
#include <trace/nearest_surface.h>

namespace dimmer::cook::test {
namespace {

// The square of 2 m around the origin at this height, seen from above.
Mesh floorAt(float height_m, std::optional<uint32_t> door = {}) {
    Mesh mesh;
    mesh.door = door;
    for (const auto& [x, z] : {std::pair(-1.0f, -1.0f), {-1, 1}, {1, 1}, {1, -1}})
        mesh.vertices.push_back({{x, height_m, z}, {0, 1, 0}, {0.5f + 0.5f * x, 0.5f + 0.5f * z}});
    mesh.indices = {0, 1, 2, 0, 2, 3};
    return mesh;
}

// The lower side of a double-sided leaf faces up where it stands on the floor: open, the leaf is gone.
TEST(NearestSurface, OfTwoInOnePlaceIsTheOneThatStays) {
    for (const bool leaf_first : {false, true}) {
        std::vector<Mesh> meshes = {floorAt(0), floorAt(0, 1u)};
        if (leaf_first) std::swap(meshes[0], meshes[1]);
        const NearestSurface surfaces(meshes, 64, 64);
        for (const float height_m : {0.0f, 0.01f, -0.01f}) {
            const auto place = surfaces.find({0.3f, height_m, 0.2f}, {0, 1, 0}, 0.1f);
            ASSERT_TRUE(place);
            EXPECT_FALSE(meshes[place->mesh].door) << leaf_first << " " << height_m;
        }
    }
    // A leaf that is nearer is meant.
    const std::vector<Mesh> meshes = {floorAt(0), floorAt(0.02f, 1u)};
    EXPECT_EQ(NearestSurface(meshes, 64, 64).find({0, 0.03f, 0}, {0, 1, 0}, 0.1f)->mesh, 1u);
}

}  // namespace
}  // namespace dimmer::cook::test
