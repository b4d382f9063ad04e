// What a ray meets first.
#include <bake/test_scenes.h>
#include <charts/blocking_rays.h>
#include <charts/wall_traces.h>
#include <gtest/gtest.h>

#include <vector>

namespace dimmer::cook::test {
namespace {

constexpr glm::vec3 east{1, 0, 0};

class BlockingRay : public ::testing::Test {
   protected:
    // Rays among all that is in the scene, which blocks with its fronts alone.
    BlockingRays rays() {
        faces_.clear();
        Blocking blocking;
        for (const SceneMesh& mesh : scene_.meshes)
            for (const auto& triangle : mesh.triangles) {
                PlanarFace& face = faces_.emplace_back();
                for (size_t i = 0; i < 3; ++i) face.corners_m[i] = mesh.positions_m[triangle[i]];
                face.normal = mesh.normals[triangle[0]];
                blocking.faces.push_back(static_cast<uint32_t>(blocking.faces.size()));
                blocking.double_sided.push_back(false);
            }
        return {faces_, blocking};
    }

    void addSkin(float x, float towards) {
        addQuad(scene_, "skin", {x, 0.13f, 0.29f}, {0, 1, 0}, {0, 0, towards}, 0);
        ASSERT_GT(towards * scene_.meshes.back().normals[0].x, 0.9f);
    }

    Scene scene_;
    std::vector<PlanarFace> faces_;
};

// As rays of light do: the face of a wall that a back touches.
TEST_F(BlockingRay, MeetsTheFaceOfTwo) {
    for (const float at_m : {1.5f, 1.9985f, 2.0f, 2.001f, 2.003f}) {  // rays are looked along up to 1 m, 2 m, ...
        SCOPED_TRACE(at_m);
        scene_.meshes.clear();
        addSkin(at_m, 1);
        EXPECT_GT(rays().meets({0, 0, 0}, -east).at_m, 1e30f);  // nothing
        EXPECT_TRUE(rays().meets({0, 0, 0}, east).is_back);
        addSkin(at_m + 1.5e-3f, -1);
        const BlockingRays::Met met = rays().meets({0, 0, 0}, east);
        EXPECT_FALSE(met.is_back);
        EXPECT_NEAR(met.at_m, at_m, same_line_m);
    }
}

}  // namespace
}  // namespace dimmer::cook::test
