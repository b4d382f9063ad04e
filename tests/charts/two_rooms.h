// Two rooms on one floor, and whether a page keeps their light apart.
#pragma once

#include <bake/test_scenes.h>
#include <charts/texels.h>
#include <charts/unwrap.h>
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace dimmer::cook::test {

// A floor and a ceiling that run on, from one room of 4 x 3 m into another, under a wall of 0.2 m around x = 0 with a
// doorway of 0.9 m: two stretches of wall of 1.05 m each, and 0.65 m of lintel between.
inline constexpr float half_wall_m = 0.1f;
inline Scene twoRooms() {
    Scene scene;
    const uint32_t white = addMaterial(scene, lambert(0.5f));
    addSolid(scene, "floor", {0, -0.1f, 0}, {4, 0.1f, 1.5f}, white);
    addSolid(scene, "ceiling", {0, 2.8f, 0}, {4, 0.1f, 1.5f}, white);
    addSolid(scene, "wall", {0, 1.35f, -0.975f}, {half_wall_m, 1.35f, 0.525f}, white);
    addSolid(scene, "wall", {0, 1.35f, 0.975f}, {half_wall_m, 1.35f, 0.525f}, white);
    addSolid(scene, "lintel", {0, 2.375f, 0}, {half_wall_m, 0.325f, 0.45f}, white);
    return scene;
}

// A texel of both rooms would carry light of the one into the other, and so would a page that filters between two.
// `turned`: the scene, from where twoRooms() has it.
inline void expectRoomsApart(const RayScene& rays, const Unwrap& charts, const glm::mat3& turned = glm::mat3(1)) {
    const Texels texels = sampleTexels(rays, charts, 4);
    struct Sides {
        bool left = false, right = false;
    };
    std::vector<Sides> sides(charts.charts.size());
    size_t points = 0;
    for (size_t i = 0; i < texels.size(); ++i)
        for (uint32_t s = 0; s < texels.sampleCount(i); ++s) {
            const glm::vec3 p = glm::transpose(turned) * samplePoint(rays, charts, texels, i, s).position_m;
            const uint32_t face = texels.sample(i, s).face;
            const bool in_rooms = p.y > -0.05f && p.y < 2.75f && std::abs(p.x) > half_wall_m;
            if (!in_rooms || std::abs(charts.frames[face].normal.y) < 0.9f) continue;
            ++points;
            Sides& of_chart = sides[charts.face_chart[face]];
            (p.x < 0 ? of_chart.left : of_chart.right) = true;
        }
    EXPECT_GT(points, 40u);  // 48 m2, four points a texel
    for (const Sides& s : sides) EXPECT_FALSE(s.left && s.right);
}

}  // namespace dimmer::cook::test
