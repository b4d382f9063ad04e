// What a ray tells of where it starts.
#include <bake/test_scenes.h>
#include <charts/blocking_rays.h>
#include <charts/wall_traces.h>
#include <gtest/gtest.h>

#include <vector>

namespace dimmer::cook::test {
namespace {

constexpr glm::vec3 east{1, 0, 0}, above{0, 1, 0};

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

    // Of half a metre to each side; off the origin, so that no ray below meets a diagonal.
    void addBox(glm::vec3 centre) { addSolid(scene_, "box", centre + glm::vec3(0, 0.13f, 0.29f), glm::vec3(0.5f), 0); }
    void addSkin(float x, float towards) {
        addQuad(scene_, "skin", {x, 0.13f, 0.29f}, {0, 1, 0}, {0, 0, towards}, 0);
        ASSERT_GT(towards * scene_.meshes.back().normals[0].x, 0.9f);
    }

    Scene scene_;
    std::vector<PlanarFace> faces_;
};

TEST_F(BlockingRay, StartsInABoxOrBesideIt) {
    addBox({2, 0, 0});
    EXPECT_TRUE(rays().startsInSolid({2, 0, 0}, east));
    EXPECT_TRUE(rays().startsInSolid({2, 0, 0}, above));
    EXPECT_FALSE(rays().startsInSolid({0, 0, 0}, east));  // into it and out again
    EXPECT_FALSE(rays().startsInSolid({4, 0, 0}, east));  // nothing
}

TEST_F(BlockingRay, BoxesThatTouchAreOne) {
    addBox({2, 0, 0});
    addBox({3, 0, 0});
    EXPECT_TRUE(rays().startsInSolid({2, 0, 0}, east));  // out of one, into the next and out
    EXPECT_FALSE(rays().startsInSolid({0, 0, 0}, east));
}

TEST_F(BlockingRay, BoxesThatOverlapAreOne) {
    addBox({2, 0, 0});
    addBox({2.9f, 0, 0});
    EXPECT_TRUE(rays().startsInSolid({2, 0, 0}, east));
    EXPECT_TRUE(rays().startsInSolid({2.45f, 0, 0}, east));  // in both
    EXPECT_FALSE(rays().startsInSolid({0, 0, 0}, east));
}

TEST_F(BlockingRay, FarAway) {
    addBox({2000, 0, 0});
    EXPECT_FALSE(rays().startsInSolid({0, 0, 0}, east));
    EXPECT_TRUE(rays().startsInSolid({2000, 0, 0}, east));
}

// The end of a level is no end of it, however the way there is rounded.
TEST_F(BlockingRay, LeavesTheLevel) {
    for (int i = 0; i < 200; ++i) {
        const glm::vec3 centre = static_cast<float>(i) * glm::vec3(0.017f, 0.37f, 7.1f);
        scene_.meshes.clear();
        addBox(centre);
        for (int axis = 0; axis < 3; ++axis)
            for (const float side : {-1.0f, 1.0f}) {
                glm::vec3 direction(0);
                direction[axis] = side;
                EXPECT_TRUE(rays().startsInSolid(centre, direction)) << i << ", " << axis << ", " << side;
            }
    }
}

// A wall of paper between two rooms of skins: whichever of the two comes first, neither room is solid.
TEST_F(BlockingRay, PaperIsNoSolid) {
    for (const float at_m : {1.9985f, 1.999f, 2.0f, 2.001f, 2.003f})  // rays are looked along up to 1 m, 2 m ...
        for (const float gap_m : {-1.5e-3f, 0.0f, 1.5e-3f}) {
            SCOPED_TRACE(::testing::Message() << at_m << " + " << gap_m);
            scene_.meshes.clear();
            addSkin(at_m, -1);
            addSkin(at_m + gap_m, 1);
            addSkin(5, -1);
            EXPECT_FALSE(rays().startsInSolid({0, 0, 0}, east));
            EXPECT_FALSE(rays().startsInSolid({3, 0, 0}, east));
        }
}

// Both triangles of a quad are met on its diagonal, or neither: a box behind it has one back too many, or too few.
TEST_F(BlockingRay, OnAnEdgeIsInDoubt) {
    addBox({2, 0, 0});
    const SceneMesh& side = scene_.meshes[1];
    ASSERT_GT(side.normals[0].x, 0.9f);
    const glm::vec3 middle = 0.5f * (side.positions_m[0] + side.positions_m[2]);
    EXPECT_FALSE(rays().startsInSolid({2, middle.y, middle.z}, east));
    EXPECT_TRUE(rays().startsInSolid({2, middle.y + 0.01f, middle.z}, east));
}

// As rays of light do: the face of a wall that a back touches.
TEST_F(BlockingRay, MeetsTheFaceOfTwo) {
    addSkin(2, 1);
    EXPECT_TRUE(rays().meets({0, 0, 0}, east).is_back);
    addSkin(2.001f, -1);
    const BlockingRays::Met met = rays().meets({0, 0, 0}, east);
    EXPECT_FALSE(met.is_back);
    EXPECT_NEAR(met.at_m, 2, same_line_m);
}

}  // namespace
}  // namespace dimmer::cook::test
