// Walls without thickness, made of two skins back to back: a ray meets the one that faces it.
#include <bake/baked_scene.h>
#include <bake/test_scenes.h>

namespace dimmer::cook::test {
namespace {

// A wall across x = 0 of one skin that faces each way, of the order asked for; `apart_m`: between them.
Scene skins(bool other_order, float apart_m = 0) {
    Scene scene;
    const uint32_t grey = addMaterial(scene, lambert(0.5f));
    for (const bool left : {other_order, !other_order}) {
        const float x = left ? -apart_m / 2 : apart_m / 2;
        if (left)
            addQuad(scene, "left", {x, 0, 0}, {0, 0, 2}, {0, 2, 0}, grey);
        else
            addQuad(scene, "right", {x, 0, 0}, {0, 2, 0}, {0, 0, 2}, grey);
    }
    return scene;
}

TEST(BackToBack, ARayMeetsTheSkinThatFacesIt) {
    for (const bool other_order : {false, true})
        for (const float apart_m : {0.0f, 2e-6f, -2e-6f}) {
            const Scene scene = skins(other_order, apart_m);
            const RayScene rays(scene);
            for (int i = 0; i < 200; ++i) {
                const glm::vec2 u = sequence2d(static_cast<uint32_t>(i), 5);
                const glm::vec3 at(0, 3 * u.x - 1.5f, 3 * u.y - 1.5f);
                for (const float side : {-1.0f, 1.0f}) {
                    const glm::vec3 from(side * 1.7f, 0.3f, -0.2f), d = glm::normalize(at - from);
                    const auto hit = rays.nearest(from, d, 100, 0);
                    ASSERT_TRUE(hit);
                    ASSERT_FALSE(hit->back) << other_order << " " << apart_m << " " << side;
                    ASSERT_EQ(rays.scene().meshes[rays.triangles()[hit->triangle].mesh].node,
                              side < 0 ? "left" : "right");
                }
            }
        }
}

// A wall of a tenth of a millimetre whose skins face each other is met on its back, as any other is.
TEST(BackToBack, SkinsApartAreMetAsTheyStand) {
    const Scene scene = skins(false, -1e-4f);
    const RayScene rays(scene);
    const auto hit = rays.nearest({-1, 0.3f, 0.1f}, {1, 0, 0}, 100, 0);
    ASSERT_TRUE(hit);
    EXPECT_TRUE(hit->back);
}

// A closed room of albedo 0.5 around a lamp, beside one like it: phi rho / (1 - rho) / A on its walls, whichever skin
// of the wall between comes first. Texels' size and noise leave 1 %.
TEST(BackToBack, LightInAClosedRoomIsThatOfTheFurnace) {
    for (const bool other_order : {false, true}) {
        Scene scene = skins(other_order);
        const uint32_t grey = scene.meshes[0].triangle_materials[0];
        for (const float side : {-1.0f, 1.0f}) {
            const size_t first = scene.meshes.size();
            addBox(scene, {2, 2, 2}, grey);
            for (size_t m = first; m < scene.meshes.size(); ++m)
                for (glm::vec3& p : scene.meshes[m].positions_m) p.x += 2 * side;
            // The boxes' own sides at x = 0.
            std::erase_if(scene.meshes, [](const SceneMesh& mesh) {
                return mesh.node == "wall" &&
                       std::ranges::all_of(mesh.positions_m, [](glm::vec3 p) { return p.x == 0; });
            });
        }
        addPointLight(scene, {-2, 0.3f, 0.2f}, 100, BakeMode::Indirect);
        BakedScene b(scene, 4, 4);
        b.bake({.series_rays = 64, .final_rays = 256});
        double sum = 0, area_m2 = 0;
        for (size_t i = 0; i < b.texels.size(); ++i) {
            const float lux = b.lux(i).y;
            if (b.place(i).x > -0.01f && (b.place(i).x > 0.01f || b.normal(i).x > 0)) {
                EXPECT_EQ(lux, 0) << "beyond the wall: " << b.place(i).x;
                continue;
            }
            sum += static_cast<double>(lux * b.texels.area_m2[i]);
            area_m2 += static_cast<double>(b.texels.area_m2[i]);
        }
        EXPECT_NEAR(area_m2, 96, 0.5);
        EXPECT_NEAR(sum / area_m2, 400 * 3.14159265 / 96, 0.01 * 400 * 3.14159265 / 96) << other_order;
    }
}

}  // namespace
}  // namespace dimmer::cook::test
