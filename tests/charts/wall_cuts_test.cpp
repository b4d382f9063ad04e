// Where walls cut what they stand on.
#include <charts/two_rooms.h>
#include <charts/unwrap.h>
#include <charts/wall_cuts.h>
#include <gtest/gtest.h>

#include <glm/gtc/matrix_transform.hpp>

#include <functional>
#include <map>
#include <numbers>
#include <set>
#include <span>

namespace dimmer::cook::test {
namespace {

// At few texels per metre no stretch of wall between doorways is long: it is the whole wall that counts.
TEST(WallCuts, RoomsWithADoorwayShareNoChartAtAnyDensity) {
    for (const float density : {1.0f, 2.0f, 4.0f, 8.0f}) {
        SCOPED_TRACE(density);
        Scene scene = twoRooms();
        cutAtWalls(scene, density);
        const RayScene rays(scene);
        const auto charts = unwrap(rays, {.texels_per_metre = density, .page_size = 256});
        ASSERT_TRUE(charts.has_value());
        expectRoomsApart(rays, *charts);
    }
}

// Each part of a floor goes on to the middle of its walls. From in there its own room is beyond a wall; it is one chart
// all the same, as another would be filtered apart: a step of light across the room.
TEST(WallCuts, ARoomsFloorIsOneChart) {
    for (const float density : {4.0f, 8.0f}) {
        SCOPED_TRACE(density);
        Scene scene = twoRooms();
        cutAtWalls(scene, density);
        const RayScene rays(scene);
        const auto charts = unwrap(rays, {.texels_per_metre = density, .page_size = 256});
        ASSERT_TRUE(charts.has_value());
        const Texels texels = sampleTexels(rays, *charts, 4);
        std::set<uint32_t> left, right;
        for (size_t i = 0; i < texels.size(); ++i)
            for (uint32_t s = 0; s < texels.sampleCount(i); ++s) {
                const uint32_t face = texels.sample(i, s).face;
                const glm::vec3 p = samplePoint(rays, *charts, texels, i, s).position_m;
                const bool on_floor = std::abs(p.y) < 0.05f && charts->frames[face].normal.y > 0.9f;
                if (on_floor && std::abs(p.x) > half_wall_m) (p.x < 0 ? left : right).insert(charts->face_chart[face]);
            }
        EXPECT_EQ(left.size(), 1u);
        EXPECT_EQ(right.size(), 1u);
    }
}

// A room whose walls end where the level does, on a floor as large: behind them is no room, and they cut it in their
// middles alone.
TEST(WallCuts, WallsAtTheEndOfALevelAreNoSkins) {
    Scene scene;
    const uint32_t grey = addMaterial(scene, lambert(0.5f));
    const glm::vec3 half(2.05f, 1.5f, 3.1f);  // of the room; walls of 0.2 m
    for (const float side : {-1.0f, 1.0f}) {
        addSolid(scene, "wall", {side * (half.x + 0.1f), half.y, 0}, {0.1f, half.y, half.z}, grey);
        addSolid(scene, "wall", {0, half.y, side * (half.z + 0.1f)}, {half.x + 0.2f, half.y, 0.1f}, grey);
    }
    addQuad(scene, "floor", {0, 0, 0}, {0, 0, half.z + 0.2f}, {half.x + 0.2f, 0, 0}, grey);
    addSolid(scene, "ceiling", {0, 2 * half.y + 0.1f, 0}, {half.x + 0.2f, 0.1f, half.z + 0.2f}, grey);
    cutAtWalls(scene, 4);
    uint32_t cuts_x = 0, cuts_z = 0;
    for (const SceneMesh& mesh : scene.meshes)
        for (const glm::vec3 p : mesh.positions_m) {
            if (mesh.node != "floor") continue;
            cuts_x += std::abs(std::abs(p.x) - half.x - 0.1f) < 1e-3f;
            cuts_z += std::abs(std::abs(p.z) - half.z - 0.1f) < 1e-3f;
            if (std::abs(p.x) >= half.x + 0.05f || std::abs(p.z) >= half.z + 0.05f) continue;
            EXPECT_GT(half.x - std::abs(p.x), 0.01f) << p.z;
            EXPECT_GT(half.z - std::abs(p.z), 0.01f) << p.x;
        }
    EXPECT_GE(cuts_x, 4u);
    EXPECT_GE(cuts_z, 4u);
}

// A building that does not stand along the world's axes has its charts along its own: of floors too, which have no
// direction by themselves.
TEST(WallCuts, RoomsThatAreTurnedShareNoChart) {
    for (const float degrees : {15.0f, 30.0f, 45.0f, 75.0f}) {
        SCOPED_TRACE(degrees);
        const glm::mat3 turned(glm::rotate(glm::mat4(1), glm::radians(degrees), {0, 1, 0}));
        Scene scene = twoRooms();
        for (SceneMesh& mesh : scene.meshes) {
            for (glm::vec3& p : mesh.positions_m) p = turned * p;
            for (glm::vec3& n : mesh.normals) n = turned * n;
        }
        cutAtWalls(scene, 4);
        const RayScene rays(scene);
        const auto charts = unwrap(rays, {.texels_per_metre = 4, .page_size = 256});
        ASSERT_TRUE(charts.has_value());
        expectRoomsApart(rays, *charts, turned);
    }
}

// A hall of another outline: walls along the world's axes part its floor as they always did.
TEST(WallCuts, WallsPartAFloorWhoseOutlineIsTurned) {
    Scene scene = twoRooms();
    std::erase_if(scene.meshes, [](const SceneMesh& mesh) { return mesh.node == "floor" || mesh.node == "ceiling"; });
    const glm::mat3 diamond(glm::rotate(glm::mat4(1), glm::radians(45.0f), {0, 1, 0}));
    for (const float y : {-0.1f, 2.8f}) {
        const size_t first = scene.meshes.size();
        addSolid(scene, "slab", {0, 0, 0}, {3, 0.1f, 3}, 0);
        for (SceneMesh& side : std::span(scene.meshes).subspan(first)) {
            // Off the middle, so that no triangle ends at the wall.
            for (glm::vec3& p : side.positions_m) p = diamond * p + glm::vec3(0.5f, y, 0);
            for (glm::vec3& n : side.normals) n = diamond * n;
        }
    }
    // The wall reaches from corner to corner: what is beside twoRooms()' own ends parts the rooms too.
    for (const float side : {-1.0f, 1.0f})
        addSolid(scene, "wall", {0, 1.35f, side * 2.95f}, {half_wall_m, 1.35f, 1.45f}, 0);
    cutAtWalls(scene, 4);
    const RayScene rays(scene);
    const auto charts = unwrap(rays, {.texels_per_metre = 4, .page_size = 256});
    ASSERT_TRUE(charts.has_value());
    expectRoomsApart(rays, *charts);
}

// Hand-made walls lean a little, or stand a little askew; and what is no receiver parts rooms too. None of these did,
// and each took a third to two thirds of the lit side's light past the wall.
TEST(WallCuts, WallsPartRoomsHoweverTheyStand) {
    const auto nothing = [](Scene&) {};
    const auto moved = [](auto&& by) {
        return [by](Scene& scene) {
            for (SceneMesh& mesh : scene.meshes)
                for (glm::vec3& p : mesh.positions_m)
                    if (mesh.node == "wall") p.x += by(p);
        };
    };
    const auto lit = [](Lighting lighting) {
        return [lighting](Scene& scene) {
            for (SceneMesh& mesh : scene.meshes)
                if (mesh.node == "wall") mesh.lighting = lighting;
        };
    };
    const auto onFoot = [](float half_m) {
        return [half_m](Scene& scene) {
            for (SceneMesh& mesh : scene.meshes)
                for (glm::vec3& p : mesh.positions_m)
                    if (mesh.node == "wall") p.y = std::max(p.y, 0.1f);
            addSolid(scene, "foot", {0, 0.05f, 0}, {half_m, 0.05f, 1.5f}, 0);
        };
    };
    const std::vector<std::pair<const char*, std::function<void(Scene&)>>> ways = {
        {"plumb", nothing},
        {"leans", moved([](glm::vec3 p) { return 0.02f * (p.y / 2.7f - 0.5f); })},
        {"askew", moved([](glm::vec3 p) { return 0.01f * p.z; })},
        {"is no receiver", lit(Lighting::None)},
        // Each let up to 72 % of the bright room's light past: no face of it is in one plane low and high.
        {"has skirtings", onFoot(0.095f)},
        {"stands on a strip", onFoot(0.02f)},
        {"has a grid of its own", lit(Lighting::LocalGrid)},
    };
    for (const auto& [name, change] : ways) {
        SCOPED_TRACE(name);
        Scene scene;
        const uint32_t white = addMaterial(scene, lambert(0.5f));
        addSolid(scene, "floor", {0, -0.1f, 0}, {4, 0.1f, 1.5f}, white);
        addSolid(scene, "ceiling", {0, 2.8f, 0}, {4, 0.1f, 1.5f}, white);
        addSolid(scene, "wall", {0, 1.35f, 0}, {0.08f, 1.35f, 1.5f}, white);
        change(scene);
        cutAtWalls(scene, 4);
        const RayScene rays(scene);
        const auto charts = unwrap(rays, {.texels_per_metre = 4, .page_size = 256});
        ASSERT_TRUE(charts.has_value());
        expectRoomsApart(rays, *charts);
    }
}

// Whatever the angle to the floor's own axes; the walls of the room, which it meets at that angle too, are parted as
// well. 8 cm behind one at 30 degrees there were 73 of 285 lux.
TEST(WallCuts, WallsAtAnAnglePartRooms) {
    for (const float degrees : {3.0f, 30.0f, 45.0f}) {
        SCOPED_TRACE(degrees);
        const glm::mat3 turned(glm::rotate(glm::mat4(1), glm::radians(degrees), {0, 1, 0}));
        Scene scene;
        const uint32_t white = addMaterial(scene, lambert(0.5f));
        addSolid(scene, "floor", {0, -0.1f, 0}, {4, 0.1f, 1.5f}, white);
        addSolid(scene, "ceiling", {0, 2.8f, 0}, {4, 0.1f, 1.5f}, white);
        for (const float side : {-1.0f, 1.0f})
            addQuad(scene, "side", {0, 1.35f, side * 1.5f}, {0, 1.35f, 0}, {side * 4, 0, 0}, white);
        ASSERT_LT(scene.meshes.back().normals[0].z, -0.9f);  // at z = 1.5
        const size_t first = scene.meshes.size();
        addSolid(scene, "wall", {0, 1.35f, 0}, {0.05f, 1.35f, 4}, white);
        for (SceneMesh& mesh : std::span(scene.meshes).subspan(first)) {
            for (glm::vec3& p : mesh.positions_m) p = turned * p;
            for (glm::vec3& n : mesh.normals) n = turned * n;
        }
        cutAtWalls(scene, 4);
        for (const SceneMesh& mesh : std::span(scene.meshes).first(first)) {
            const bool in_room = mesh.node == "side" || (mesh.node == "floor" && mesh.normals[0].y > 0.5f) ||
                                 (mesh.node == "ceiling" && mesh.normals[0].y < -0.5f);
            if (!in_room) continue;
            SCOPED_TRACE(mesh.node);
            ASSERT_EQ(mesh.triangle_regions.size(), mesh.triangles.size());
            std::map<uint32_t, std::pair<float, float>> reach;  // across the wall
            for (size_t t = 0; t < mesh.triangles.size(); ++t)
                for (int i = 0; i < 3; ++i) {
                    const float x = (glm::transpose(turned) * mesh.positions_m[mesh.triangles[t][i]]).x;
                    auto& [low, high] = reach.try_emplace(mesh.triangle_regions[t], x, x).first->second;
                    low = std::min(low, x), high = std::max(high, x);
                }
            EXPECT_EQ(reach.size(), 2u);
            for (const auto& [region, of] : reach) EXPECT_FALSE(of.first < -0.05f && of.second > 0.05f) << region;
        }
    }
}

// Stretches of a round wall are short, one by one: 0.26 m here, one texel. Outside it is one part, or the rectangles of
// what lies around it would fill the page.
TEST(WallCuts, ARoundTowerPartsTheGround) {
    constexpr int sides = 24;
    constexpr float inner_m = 1, outer_m = 1.2f;
    Scene scene;
    const uint32_t white = addMaterial(scene, lambert(0.5f));
    addQuad(scene, "ground", {0, 0, 0}, {0, 0, 8}, {8, 0, 0}, white);
    const auto corner = [](float radius_m, int i) {
        const float turn = 2 * std::numbers::pi_v<float> * static_cast<float>(i) / sides;
        return radius_m * glm::vec3(std::cos(turn), 0, std::sin(turn));
    };
    for (int i = 0; i < sides; ++i) {
        const auto side = [&](float radius_m, float front) {
            const glm::vec3 a = corner(radius_m, i), b = corner(radius_m, i + 1);
            addQuad(scene, "tower", 0.5f * (a + b) + glm::vec3(0, 1.5f, 0), {0, 1.5f, 0}, front * 0.5f * (b - a),
                    white);
        };
        side(inner_m, -1), side(outer_m, 1);
    }
    ASSERT_GT(scene.meshes[2].normals[0].x, 0.9f);   // outer side
    ASSERT_LT(scene.meshes[1].normals[0].x, -0.9f);  // inner side
    cutAtWalls(scene, 4);
    const SceneMesh& ground = scene.meshes[0];
    ASSERT_FALSE(ground.triangle_regions.empty());
    std::set<uint32_t> inside, outside;
    for (size_t t = 0; t < ground.triangles.size(); ++t) {
        glm::vec3 middle(0);
        for (int i = 0; i < 3; ++i) middle += ground.positions_m[ground.triangles[t][i]] / 3.0f;
        (glm::length(middle) < 0.5f * (inner_m + outer_m) ? inside : outside).insert(ground.triangle_regions[t]);
    }
    EXPECT_EQ(inside.size(), 1u);
    EXPECT_EQ(outside.size(), 1u);
    EXPECT_NE(inside, outside);
}

// What is larger than a page has larger texels, and walls that are thick for smaller ones are thin.
TEST(WallCuts, AThickWallPartsAGroundThatIsStoredCoarsely) {
    Scene scene;
    const uint32_t white = addMaterial(scene, lambert(0.5f));
    addQuad(scene, "ground", {0, 0, 0}, {0, 0, 20}, {50, 0, 0}, white);
    addSolid(scene, "wall", {0, 1.5f, 0}, {0.6f, 1.5f, 20}, white);
    cutAtWalls(scene, 4, 128);
    const SceneMesh& ground = scene.meshes[0];
    EXPECT_EQ(std::set<uint32_t>(ground.triangle_regions.begin(), ground.triangle_regions.end()).size(), 2u);
}

// A leaf that fills a corridor hangs over its floor, and parts it.
TEST(WallCuts, ALeafOverAGapPartsTheFloor) {
    for (const float gap_m : {0.0f, 0.012f, 0.03f}) {
        SCOPED_TRACE(gap_m);
        Scene scene;
        const uint32_t white = addMaterial(scene, lambert(0.5f));
        scene.doors.emplace_back();
        addSolid(scene, "floor", {0, -0.1f, 0}, {4, 0.1f, 1.5f}, white);
        addSolid(scene, "ceiling", {0, 2.8f, 0}, {4, 0.1f, 1.5f}, white);
        addSolid(scene, "leaf", {0, 1.35f + gap_m / 2, 0}, {0.02f, 1.35f - gap_m / 2, 1.5f}, white, 0);
        cutAtWalls(scene, 4);
        const RayScene rays(scene);
        const auto charts = unwrap(rays, {.texels_per_metre = 4, .page_size = 256});
        ASSERT_TRUE(charts.has_value());
        expectRoomsApart(rays, *charts);
    }
}

// On a ramp a wall is cut at where it meets the ramp, which is not square to it.
TEST(WallCuts, AWallPartsARamp) {
    constexpr float slope = 0.15f;
    Scene scene;
    const uint32_t white = addMaterial(scene, lambert(0.5f));
    addQuad(scene, "ramp", {0, 0, 0}, {0, 0, 1.5f}, {4, 4 * slope, 0}, white);
    addSolid(scene, "wall", {0.1f, 1, 0}, {0.05f, 2, 1.5f}, white);
    ASSERT_GT(scene.meshes[0].normals[0].y, 0.9f);
    cutAtWalls(scene, 4);
    const SceneMesh& ramp = scene.meshes[0];
    ASSERT_EQ(ramp.triangle_regions.size(), ramp.triangles.size());
    std::map<uint32_t, std::pair<float, float>> reach;
    for (size_t t = 0; t < ramp.triangles.size(); ++t)
        for (int i = 0; i < 3; ++i) {
            const float x = ramp.positions_m[ramp.triangles[t][i]].x;
            auto& [low, high] = reach.try_emplace(ramp.triangle_regions[t], x, x).first->second;
            low = std::min(low, x), high = std::max(high, x);
        }
    ASSERT_EQ(reach.size(), 2u);
    for (const auto& [region, of] : reach) EXPECT_FALSE(of.first < 0.05f && of.second > 0.15f) << region;
}

// Of three bays between two skins that look away from each other each has its floor to itself.
TEST(WallCuts, SkinsBackToBackPartTheRoomBetween) {
    Scene scene;
    const uint32_t white = addMaterial(scene, lambert(0.5f));
    addSolid(scene, "floor", {0, -0.1f, 0}, {5, 0.1f, 1.5f}, white);
    addSolid(scene, "ceiling", {0, 2.8f, 0}, {5, 0.1f, 1.5f}, white);
    for (const float side : {-1.0f, 1.0f})
        addQuad(scene, "skin", {side * 1.5f, 1.35f, 0}, {0, 1.35f, 0}, {0, 0, side * 1.5f}, white);
    ASSERT_GT(scene.meshes.back().normals[0].x, 0.9f);
    cutAtWalls(scene, 4);
    const SceneMesh& floor = scene.meshes[3];
    ASSERT_EQ(floor.triangle_regions.size(), floor.triangles.size());
    EXPECT_EQ(std::set<uint32_t>(floor.triangle_regions.begin(), floor.triangle_regions.end()).size(), 3u);
}

// A wall of one skin is a wall: a floor that runs on behind it took 97 lux of the lit room past it.
TEST(WallCuts, SingleSkinsPartRooms) {
    for (const float front : {1.0f, -1.0f}) {
        SCOPED_TRACE(front);
        Scene scene;
        const uint32_t white = addMaterial(scene, lambert(0.5f));
        addSolid(scene, "floor", {0, -0.1f, 0}, {4, 0.1f, 1.5f}, white);
        addSolid(scene, "ceiling", {0, 2.8f, 0}, {4, 0.1f, 1.5f}, white);
        addQuad(scene, "skin", {0, 1.35f, 0}, {0, 1.35f, 0}, {0, 0, front * 1.5f}, white);
        cutAtWalls(scene, 4);
        const RayScene rays(scene);
        const auto charts = unwrap(rays, {.texels_per_metre = 4, .page_size = 256});
        ASSERT_TRUE(charts.has_value());
        expectRoomsApart(rays, *charts);
    }
}

// Skins around a room that look into it, on a lawn: sun lies on the lawn up to them, and not in the room.
TEST(WallCuts, AShellOfSkinsPartsItsRoomFromTheLawn) {
    Scene scene;
    const uint32_t white = addMaterial(scene, lambert(0.5f));
    addQuad(scene, "lawn", {0, 0, 0}, {0, 0, 8}, {8, 0, 0}, white);
    for (const float side : {-1.0f, 1.0f}) {
        addQuad(scene, "skin", {side * 2, 1.3f, 0}, {0, 1.3f, 0}, {0, 0, -side * 1.5f}, white);
        addQuad(scene, "skin", {0, 1.3f, side * 1.5f}, {0, 1.3f, 0}, {side * 2, 0, 0}, white);
    }
    ASSERT_GT(scene.meshes[1].normals[0].x, 0.9f);  // of the skin at x = -2
    cutAtWalls(scene, 4);
    const SceneMesh& lawn = scene.meshes[0];
    ASSERT_FALSE(lawn.triangle_regions.empty());
    std::map<uint32_t, std::pair<bool, bool>> of;  // in the room, beside it
    for (size_t t = 0; t < lawn.triangles.size(); ++t) {
        glm::vec3 middle(0);
        for (int i = 0; i < 3; ++i) middle += lawn.positions_m[lawn.triangles[t][i]] / 3.0f;
        const bool in_room = std::abs(middle.x) < 2 && std::abs(middle.z) < 1.5f;
        (in_room ? of[lawn.triangle_regions[t]].first : of[lawn.triangle_regions[t]].second) = true;
    }
    for (const auto& [region, sides] : of) EXPECT_FALSE(sides.first && sides.second) << region;
}

// Behind a skin at a floor's edge there is nothing to part from, though the floor goes on beside it.
TEST(WallCuts, ASkinAtAFloorsEdgeCutsNothing) {
    Scene scene;
    const uint32_t white = addMaterial(scene, lambert(0.5f));
    addQuad(scene, "floor", {0, 0, 1}, {0, 0, 1}, {4, 0, 0}, white);
    addQuad(scene, "floor", {-2, 0, -1}, {0, 0, 1}, {2, 0, 0}, white);
    addQuad(scene, "skin", {0, 1.3f, -1}, {0, 1.3f, 0}, {0, 0, -1}, white);
    cutAtWalls(scene, 4);
    for (const SceneMesh& mesh : scene.meshes) EXPECT_EQ(mesh.triangles.size(), 2u) << mesh.node;
}

// What lacks the sides that nobody sees is no skin: there is nothing to part inside a cupboard, nor inside a step.
TEST(WallCuts, FurnitureWithoutItsHiddenSidesCutsNothing) {
    Scene scene;
    const uint32_t white = addMaterial(scene, lambert(0.5f));
    addQuad(scene, "floor", {2, 0, 0}, {0, 0, 4}, {4, 0, 0}, white);
    addQuad(scene, "wall", {-2, 1.5f, 0}, {0, 1.5f, 0}, {0, 0, 4}, white);
    // A cupboard 1 m deep, 2 m wide and high, against the wall: no back, no bottom.
    addQuad(scene, "front", {-1, 1, 0}, {0, 1, 0}, {0, 0, 1}, white);
    addQuad(scene, "top", {-1.5f, 2, 0}, {0, 0, 1}, {0.5f, 0, 0}, white);
    for (const float side : {-1.0f, 1.0f})
        addQuad(scene, "side", {-1.5f, 1, side}, {0, 1, 0}, {-side * 0.5f, 0, 0}, white);
    ASSERT_GT(scene.meshes[0].normals[0].y, 0.9f);
    ASSERT_GT(scene.meshes[1].normals[0].x, 0.9f);
    ASSERT_GT(scene.meshes[2].normals[0].x, 0.9f);
    ASSERT_GT(scene.meshes[4].normals[0].z * scene.meshes[4].positions_m[0].z, 0.9f);
    cutAtWalls(scene, 4);
    for (const SceneMesh& mesh : scene.meshes) EXPECT_EQ(mesh.triangles.size(), 2u) << mesh.node;
}

// Between the jambs of a narrow doorway a leaf stands from one to the other, lower over either than a wall over a
// floor. Not cut, the jambs carried light of the lit room past the closed leaf: up to 5 % of it.
TEST(WallCuts, ALeafPartsTheJambsOfANarrowDoorway) {
    for (const float half_m : {0.5f, 0.35f, 0.3f}) {
        SCOPED_TRACE(half_m);
        Scene scene;
        const uint32_t white = addMaterial(scene, lambert(0.5f));
        for (const float side : {-1.0f, 1.0f})
            addSolid(scene, "wall", {0, 1, side * (half_m + 1)}, {0.2f, 1, 1}, white);
        addSolid(scene, "leaf", {0, 1, 0}, {0.025f, 1, half_m}, white);
        cutAtWalls(scene, 4);
        const RayScene rays(scene);
        const auto charts = unwrap(rays, {.texels_per_metre = 4, .page_size = 256});
        ASSERT_TRUE(charts.has_value());
        std::map<uint32_t, std::pair<float, float>> reach;  // along x, per chart of a jamb
        for (size_t f = 0; f < charts->faces.size(); ++f) {
            if (std::abs(charts->frames[f].normal.z) < 0.9f) continue;
            for (uint32_t c = 0; c < 3; ++c) {
                const glm::vec3 p = rays.corner(charts->faces[f].triangle, c);
                if (std::abs(std::abs(p.z) - half_m) > 1e-4f) continue;
                auto& [low, high] = reach.try_emplace(charts->face_chart[f], p.x, p.x).first->second;
                low = std::min(low, p.x), high = std::max(high, p.x);
            }
        }
        EXPECT_GE(reach.size(), 4u);
        for (const auto& [chart, of] : reach) EXPECT_FALSE(of.first < -0.1f && of.second > 0.1f);
    }
}

// Nobody is parted by pillars that one walks between.
TEST(WallCuts, ARowOfPillarsIsNoWall) {
    for (const float density : {1.0f, 2.0f, 4.0f, 8.0f}) {
        Scene scene;
        const uint32_t white = addMaterial(scene, lambert(0.5f));
        addSolid(scene, "floor", {0, -0.1f, 0}, {4, 0.1f, 5}, white);
        for (int i = 0; i < 6; ++i)  // 0.3 m each, 1.7 m between them
            addSolid(scene, "pillar", {0, 1.35f, -5 + 2 * static_cast<float>(i)}, {0.1f, 1.35f, 0.15f}, white);
        const size_t before = scene.meshes[3].triangles.size();  // the floor's upper side
        cutAtWalls(scene, density);
        EXPECT_EQ(scene.meshes[3].triangles.size(), before) << density;
    }
}

// What blocks elsewhere, however far and of whatever size, cuts nothing here: not a bit of the rooms changes.
TEST(WallCuts, MeshesElsewhereChangeNothing) {
    Scene rooms = twoRooms(), level = twoRooms();
    for (int i = 0; i < 400; ++i) {
        const glm::vec3 at(7 + 3 * static_cast<float>(i % 20), static_cast<float>(i % 7), static_cast<float>(i / 20));
        addSolid(level, "crate", at, glm::vec3(0.1f + 0.02f * static_cast<float>(i % 5)), 0);
    }
    addSolid(level, "hill", {-3000, 0, 2000}, {500, 300, 800}, 0);
    cutAtWalls(rooms, 4);
    cutAtWalls(level, 4);
    const size_t floor = 3;  // its upper side
    EXPECT_GT(rooms.meshes[floor].triangles.size(), 2u);
    for (size_t m = 0; m < rooms.meshes.size(); ++m) {
        EXPECT_TRUE(level.meshes[m].positions_m == rooms.meshes[m].positions_m) << m;
        EXPECT_TRUE(level.meshes[m].triangles == rooms.meshes[m].triangles) << m;
        EXPECT_TRUE(level.meshes[m].triangle_regions == rooms.meshes[m].triangle_regions) << m;
    }
}

// One floor under 8 x 8 rooms of 4 m: between any two that are neighbours stands a solid of its own, 0.2 m thick, from
// corner to corner but for 0.1 m at each.
constexpr int rooms_a_side = 8;
constexpr float room_m = 4;
Scene manyRooms(const glm::dmat4& pose) {
    Scene scene;
    const uint32_t white = addMaterial(scene, lambert(0.5f));
    constexpr float half_m = 0.5f * rooms_a_side * room_m;
    addQuad(scene, "floor", {half_m, 0, half_m}, {0, 0, half_m}, {half_m, 0, 0}, white);
    constexpr float stretch_m = 0.5f * room_m - half_wall_m;
    for (int i = 1; i < rooms_a_side; ++i)
        for (int k = 0; k < rooms_a_side; ++k) {
            const float across = room_m * static_cast<float>(i), along = room_m * (static_cast<float>(k) + 0.5f);
            addSolid(scene, "wall", {across, 1.35f, along}, {half_wall_m, 1.35f, stretch_m}, white);
            addSolid(scene, "wall", {along, 1.35f, across}, {stretch_m, 1.35f, half_wall_m}, white);
        }
    for (SceneMesh& mesh : scene.meshes) {
        for (glm::vec3& p : mesh.positions_m) p = glm::vec3(pose * glm::dvec4(p, 1));
        for (glm::vec3& n : mesh.normals) n = glm::vec3(glm::dmat3(pose) * glm::dvec3(n));
    }
    return scene;
}

// Each piece of the floor, and each region, is of one room; nothing of the floor is lost.
void expectOneRoomEach(const SceneMesh& floor, const glm::dmat4& pose) {
    ASSERT_EQ(floor.triangle_regions.size(), floor.triangles.size());
    std::map<uint32_t, glm::ivec2> room_of_region;
    double area = 0;
    for (size_t t = 0; t < floor.triangles.size(); ++t) {
        std::array<glm::dvec3, 3> c;
        for (int i = 0; i < 3; ++i)
            c[static_cast<size_t>(i)] = glm::inverse(pose) * glm::dvec4(floor.positions_m[floor.triangles[t][i]], 1);
        area += 0.5 * glm::length(glm::cross(c[1] - c[0], c[2] - c[0]));
        const glm::dvec3 middle = (c[0] + c[1] + c[2]) / 3.0;
        const glm::ivec2 room(glm::floor(glm::dvec2(middle.x, middle.z) / double{room_m}));
        EXPECT_EQ(room_of_region.try_emplace(floor.triangle_regions[t], room).first->second, room) << t;
        // Cuts lie in the walls' middle; coordinates around 1000 m come in steps of 6e-5 m, of which some add up.
        for (const glm::dvec3& p : c) {
            const glm::dvec2 within = glm::dvec2(p.x, p.z) - double{room_m} * glm::dvec2(room);
            EXPECT_TRUE(glm::all(glm::greaterThan(within, glm::dvec2(-2e-3)))) << t;
            EXPECT_TRUE(glm::all(glm::lessThan(within, glm::dvec2(double{room_m} + 2e-3)))) << t;
        }
    }
    EXPECT_GE(room_of_region.size(), size_t{rooms_a_side * rooms_a_side});
    const double whole = double{rooms_a_side * room_m} * double{rooms_a_side * room_m};
    EXPECT_NEAR(area, whole, 1e-4 * whole);
}

// Level and around the origin; and on a ramp, a kilometre off.
TEST(WallCuts, EachOfManyRoomsHasItsFloorToItself) {
    const glm::dmat4 ramp = glm::rotate(glm::translate(glm::dmat4(1), {1000, 200, -500}), std::atan(0.75), {1, 0, 0});
    for (const glm::dmat4& pose : {glm::dmat4(1), ramp}) {
        Scene scene = manyRooms(pose);
        cutAtWalls(scene, 4);
        expectOneRoomEach(scene.meshes[0], pose);
    }
}

// Looked at again in every part that is cut off, against all others, these took minutes.
TEST(WallCuts, ALongRowOfCellsIsCutAtEachWall) {
    constexpr uint32_t walls = 4000;
    Scene scene;
    const uint32_t white = addMaterial(scene, lambert(0.5f));
    const float half_m = 0.25f * (walls + 1);
    addSolid(scene, "floor", {half_m, -0.1f, 0}, {half_m, 0.1f, 1.5f}, white);
    for (uint32_t i = 0; i < walls; ++i)
        addSolid(scene, "wall", {0.5f * static_cast<float>(i + 1), 1, 0}, {0.05f, 1, 1.5f}, white);
    cutAtWalls(scene, 8);
    // All of the floor's upper side, each cell 0.5 m wide, and each a part of its own.
    constexpr size_t upper_side = 3;  // addSolid: x, y and z, low before high
    const SceneMesh& floor = scene.meshes[upper_side];
    ASSERT_EQ(floor.triangle_regions.size(), floor.triangles.size());
    std::map<uint32_t, std::pair<float, float>> cells;
    for (size_t t = 0; t < floor.triangles.size(); ++t)
        for (int i = 0; i < 3; ++i) {
            const glm::vec3 p = floor.positions_m[floor.triangles[t][i]];
            if (floor.triangle_regions[t] == 0) continue;
            auto& [low, high] = cells.try_emplace(floor.triangle_regions[t], p.x, p.x).first->second;
            low = std::min(low, p.x), high = std::max(high, p.x);
        }
    EXPECT_EQ(cells.size(), walls + 1);
    for (const auto& [region, cell] : cells) EXPECT_NEAR(cell.second - cell.first, 0.5f, 1e-3f);
}

// 200 km out floats are 1/64 m apart, more than the margin by which cuts keep off a rectangle's edge: a cut that
// rounding put on the edge gave back the piece that it was made on, for ever.
TEST(WallCuts, EndFarFromTheOrigin) {
    for (const float away_m : {70000.0f, 200000.0f}) {
        Scene scene = twoRooms();
        for (SceneMesh& mesh : scene.meshes)
            for (glm::vec3& p : mesh.positions_m) p += glm::vec3(away_m, 0, away_m);
        cutAtWalls(scene, 4);
        size_t triangles = 0;
        for (const SceneMesh& mesh : scene.meshes) triangles += mesh.triangles.size();
        EXPECT_GE(triangles, away_m < 1e5f ? 61u : 60u);  // five boxes; at 70 km floats still tell the wall's place
        EXPECT_LT(triangles, 1000u);
    }
}

}  // namespace
}  // namespace dimmer::cook::test
