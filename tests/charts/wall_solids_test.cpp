// Solids that touch one another are one, and cut what they stand on as one.
#include <bake/test_scenes.h>
#include <charts/wall_cuts.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <set>
#include <string_view>
#include <utility>
#include <vector>

namespace dimmer::cook::test {
namespace {

// Of each region of a mesh, from where to where it goes along x.
std::vector<std::pair<float, float>> regionsAlongX(const SceneMesh& mesh) {
    std::map<uint32_t, std::pair<float, float>> reach;
    for (size_t t = 0; t < mesh.triangles.size(); ++t)
        for (int i = 0; i < 3; ++i) {
            const float x = mesh.positions_m[mesh.triangles[t][i]].x;
            const uint32_t region = mesh.triangle_regions.empty() ? 0 : mesh.triangle_regions[t];
            auto& [low, high] = reach.try_emplace(region, x, x).first->second;
            low = std::min(low, x), high = std::max(high, x);
        }
    std::vector<std::pair<float, float>> regions;
    for (const auto& [region, from_to] : reach) regions.push_back(from_to);
    std::ranges::sort(regions);
    return regions;
}

// A flight of steps that are boxes, each beside the next one or some way into it, was ten walls that stand on the wall
// behind, which fell into strips up to the ceiling.
TEST(WallSolids, StepsOfBoxesCutNoWall) {
    for (const float overlap_m : {0.0f, 0.02f}) {
        SCOPED_TRACE(overlap_m);
        Scene scene;
        const uint32_t white = addMaterial(scene, lambert(0.5f));
        addQuad(scene, "wall", {3, 2.5f, 0}, {3, 0, 0}, {0, 2.5f, 0}, white);
        ASSERT_GT(scene.meshes[0].normals[0].z, 0.9f);
        for (int i = 0; i < 10; ++i) {
            const float top_m = 0.2f * static_cast<float>(i + 1);
            addSolid(scene, "step", {0.6f + 0.3f * static_cast<float>(i), 0.5f * top_m, 0.6f},
                     {0.15f + 0.5f * overlap_m, 0.5f * top_m, 0.6f}, white);
        }
        cutAtWalls(scene, 4);
        EXPECT_EQ(regionsAlongX(scene.meshes[0]).size(), 1u);
    }
}

// As thick as two of the boxes together, and cut once, between them.
TEST(WallSolids, AWallOfTwoLayersIsCutInItsMiddle) {
    Scene scene;
    const uint32_t white = addMaterial(scene, lambert(0.5f));
    addQuad(scene, "floor", {0, 0, 0}, {0, 0, 1.5f}, {4, 0, 0}, white);
    addSolid(scene, "bricks", {-0.06f, 1.35f, 0}, {0.06f, 1.35f, 1.5f}, white);
    addSolid(scene, "plaster", {0.02f, 1.35f, 0}, {0.02f, 1.35f, 1.5f}, white);
    cutAtWalls(scene, 4);
    const auto regions = regionsAlongX(scene.meshes[0]);
    ASSERT_EQ(regions.size(), 2u);
    EXPECT_NEAR(regions[0].second, -0.04f, 1e-3f);  // of -0.12 to 0.04
    EXPECT_NEAR(regions[1].first, -0.04f, 1e-3f);
}

// Walls of paper, a skin for each room, are as two boxes that touch: faces away from each other in one place. What is
// on either side of them is air, whatever stands against them: also in the open, from where the next house is seen as
// backs alone, and under the floor of a gallery, whose back is overhead.
TEST(WallSolids, ChestsAgainstPaperDoNotJoinTheRooms) {
    enum class Beside { Room, Open, Gallery };
    for (const Beside beside : {Beside::Room, Beside::Open, Beside::Gallery}) {
        SCOPED_TRACE(static_cast<int>(beside));
        Scene scene;
        const uint32_t white = addMaterial(scene, lambert(0.5f));
        addQuad(scene, "floor", {0, 0, 0}, {0, 0, 1.5f}, {5, 0, 0}, white);
        addQuad(scene, "ceiling", {2.5f, 2.7f, 0}, {2.5f, 0, 0}, {0, 0, 1.5f}, white);
        const auto addSkin = [&](float x, float towards) {
            addQuad(scene, "skin", {x, 1.35f, 0}, {0, 1.35f, 0}, {0, 0, towards * 1.5f}, white);
            ASSERT_GT(towards * scene.meshes.back().normals[0].x, 0.9f);
        };
        addSkin(0, 1), addSkin(5, -1);
        if (beside != Beside::Open) addSkin(-5, 1), addSkin(0, -1);
        if (beside == Beside::Open) addSkin(-4, -1);  // of the next house, which looks into that
        if (beside == Beside::Room) addQuad(scene, "ceiling", {-2.5f, 2.7f, 0}, {2.5f, 0, 0}, {0, 0, 1.5f}, white);
        if (beside == Beside::Gallery) addQuad(scene, "gallery", {-2.5f, 2.7f, 0}, {0, 0, 1.5f}, {2.5f, 0, 0}, white);
        for (const float z : {-1.0f, 0.0f, 1.0f}) addSolid(scene, "chest", {0.2f, 0.5f, z}, {0.2f, 0.5f, 0.5f}, white);
        cutAtWalls(scene, 4);
        const auto regions = regionsAlongX(scene.meshes[0]);
        ASSERT_GE(regions.size(), 2u);
        // What is under the chests may be of either side's.
        for (const auto& [from, to] : regions) EXPECT_TRUE(to < 0.39f || from > -1e-3f) << from << " to " << to;
    }
}

// An open leaf against a thin wall is no part of it: it leaves when the door closes, and has a cut of its own till
// then.
TEST(WallSolids, ALeafAgainstAWallMovesNoCut) {
    Scene scene;
    const uint32_t white = addMaterial(scene, lambert(0.5f));
    scene.doors.push_back({});
    addQuad(scene, "floor", {0, 0, 0}, {0, 0, 1.5f}, {4, 0, 0}, white);
    addSolid(scene, "wall", {-0.01f, 1.35f, 0}, {0.01f, 1.35f, 1.5f}, white);
    const size_t first = scene.meshes.size();
    addSolid(scene, "leaf", {0.03f, 1, 0}, {0.03f, 1, 0.45f}, white);
    for (size_t m = first; m < scene.meshes.size(); ++m) scene.meshes[m].door = 0, scene.meshes[m].is_open_leaf = true;
    cutAtWalls(scene, 4);
    const auto regions = regionsAlongX(scene.meshes[0]);
    ASSERT_EQ(regions.size(), 3u);
    EXPECT_NEAR(regions[0].second, -0.01f, 1e-3f);  // the middle of the wall, all along it
    EXPECT_NEAR(regions[1].second, 0, 1e-3f);       // where the leaf touches it
}

}  // namespace
}  // namespace dimmer::cook::test
