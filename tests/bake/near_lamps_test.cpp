// Lamps nearer to a surface than its texels are wide: intensity times solid angle, over area.
#include <bake/baked_scene.h>
#include <bake/test_scenes.h>

#include <algorithm>
#include <cmath>

namespace dimmer::cook::test {
namespace {

constexpr float lamp_cd = 100;

// Of a rectangle of the plane y = 0, seen from a height over it, sr: a sum over its corners as seen from the foot.
double solidAngleOfRectangle(glm::dvec3 eye, glm::dvec2 low, glm::dvec2 high) {
    const auto corner = [&](double x, double z) {
        x -= eye.x, z -= eye.z;
        return std::atan(x * z / (eye.y * std::sqrt(x * x + z * z + eye.y * eye.y)));
    };
    return corner(high.x, high.y) - corner(low.x, high.y) - corner(high.x, low.y) + corner(low.x, low.y);
}

// A dark floor of `parts` x `parts` squares, `half` metres to each side.
void addTiledFloor(Scene& scene, float half, uint32_t parts) {
    const uint32_t material = addMaterial(scene, lambert(0));
    SceneMesh& mesh = addFloor(scene, half, material);
    mesh.positions_m.clear(), mesh.normals.clear(), mesh.triangles.clear(), mesh.triangle_materials.clear();
    const float side = 2 * half / static_cast<float>(parts);
    for (uint32_t z = 0; z <= parts; ++z)
        for (uint32_t x = 0; x <= parts; ++x) {
            mesh.positions_m.emplace_back(static_cast<float>(x) * side - half, 0, static_cast<float>(z) * side - half);
            mesh.normals.emplace_back(0, 1, 0);
        }
    for (uint32_t z = 0; z < parts; ++z)
        for (uint32_t x = 0; x < parts; ++x) {
            const uint32_t a = z * (parts + 1) + x, b = a + parts + 1;
            mesh.triangles.insert(mesh.triangles.end(), {{a, b, b + 1}, {a, b + 1, a + 1}});
            mesh.triangle_materials.insert(mesh.triangle_materials.end(), 2, material);
        }
}

// A texel's points have their middle in its own and lie 0.5 mm over the floor (charts/texels.cpp), and 2 m are eight
// texels. From two texels' widths on it is the mean of four points, which is at most 6 % off: they are that far apart,
// and the inverse cube is steep. There light falls with the height of the lamp over the points.
TEST(NearLamps, ATexelGetsIntensityTimesSolidAngleOverArea) {
    for (const float height : {0.01f, 0.02f, 0.05f, 0.2f, 0.5f})
        for (const glm::vec2 foot : {glm::vec2(0, 0), glm::vec2(0.03f, -0.11f), glm::vec2(-0.97f, 0.4f)}) {
            Scene scene;
            addFloor(scene, 1, addMaterial(scene, lambert(0)));
            addPointLight(scene, {foot.x, height, foot.y}, lamp_cd, BakeMode::Full);
            BakedScene b(scene);
            ASSERT_EQ(b.texels.size(), 64u);
            b.bake({.final_rays = 32});
            for (size_t i = 0; i < b.texels.size(); ++i) {
                const glm::dvec2 centre(b.mean(i, [](glm::dvec3 p) { return p.x; }),
                                        b.mean(i, [](glm::dvec3 p) { return p.z; }));
                const glm::dvec3 lamp(scene.lights[0].position_m);
                const double expected =
                    lamp_cd * solidAngleOfRectangle(lamp, centre - 0.125, centre + 0.125) / (0.25 * 0.25);
                double nearest = 1e30;
                b.mean(i, [&](glm::dvec3 p) { return nearest = std::min(nearest, glm::distance(p, lamp)); });
                const double by_points = 0.06 + 5e-4 / static_cast<double>(height);
                EXPECT_NEAR(static_cast<double>(b.lux(i).y) / expected, 1, nearest < 0.499 ? 1e-3 : by_points)
                    << height << " over " << foot.x << ' ' << foot.y << ", " << centre.x << ' ' << centre.y;
            }
        }
}

// Also where texels end at a floor's edge, where 50 triangles share one, and where they are of 2 m, which lamps are
// looked for from each point of. What is not near is 1 % off at most, as above but all together.
TEST(NearLamps, NoMoreArrivesThanIsSent) {
    struct Floor {
        float half_m, texels_per_metre;
        uint32_t parts;
        glm::vec2 foot;
    };
    for (const Floor& f :
         {Floor{0.6f, 4, 1, {0.1f, 0.05f}}, Floor{0.6f, 4, 1, {0.57f, -0.55f}}, Floor{0.6f, 4, 24, {0.02f, 0.07f}},
          Floor{5, 0.5f, 1, {0.3f, -0.2f}}, Floor{5, 0.5f, 1, {4.6f, 0.1f}}})
        for (const float height : {0.02f, 0.1f, 0.3f}) {
            Scene scene;
            addTiledFloor(scene, f.half_m, f.parts);
            addPointLight(scene, {f.foot.x, height, f.foot.y}, lamp_cd, BakeMode::Full);
            BakedScene b(scene, f.texels_per_metre);
            b.bake({.final_rays = 32});
            double found_lm = 0;
            for (size_t i = 0; i < b.texels.size(); ++i)
                found_lm += static_cast<double>(b.lux(i).y) * static_cast<double>(b.texels.area_m2[i]);
            const glm::dvec2 half(f.half_m);
            const double sent_lm = lamp_cd * solidAngleOfRectangle(scene.lights[0].position_m, -half, half);
            EXPECT_NEAR(found_lm / sent_lm, 1, 0.01)
                << f.half_m << " m, " << f.parts << " parts, lamp " << height << " over " << f.foot.x;
        }
}

// Where a lamp is nearer to a point than a lamp can be (punctual.h), that point neither rules the texel nor is lost.
TEST(NearLamps, MayBeMillimetresOverAPoint) {
    Scene scene;
    addFloor(scene, 1, addMaterial(scene, lambert(0)));
    const glm::vec3 point = BakedScene(scene).position(27, 2);
    for (const float height : {0.0006f, 0.002f, 0.005f, 0.02f}) {
        scene.lights.clear();
        addPointLight(scene, {point.x, height, point.z}, lamp_cd, BakeMode::Full);
        BakedScene b(scene);
        b.bake({.final_rays = 32});
        const glm::dvec2 low = glm::floor(4.0 * glm::dvec2(point.x, point.z)) / 4.0;
        const double expected =
            lamp_cd * solidAngleOfRectangle(scene.lights[0].position_m, low, low + 0.25) / (0.25 * 0.25);
        EXPECT_NEAR(static_cast<double>(b.lux(27).y) / expected, 1, 1e-3) << height;
    }
}

// Lamps whose light does not come to the texel below them bring it none: one behind a plate, one that shines up.
TEST(NearLamps, BringNothingWhereNothingArrives) {
    for (const bool plate : {true, false}) {
        Scene scene;
        const uint32_t dark = addMaterial(scene, lambert(0));
        addFloor(scene, 1, dark);
        if (plate) addSolid(scene, "plate", {0, 0.05f, 0}, {0.9f, 0.005f, 0.9f}, dark);
        PunctualLight& lamp = addPointLight(scene, {0.03f, 0.08f, 0.02f}, lamp_cd, BakeMode::Full);
        if (!plate) {
            lamp.type = LightType::Spot;
            lamp.direction = {0, 1, 0};
            lamp.cone_inner_cos = 0.9f, lamp.cone_outer_cos = 0.8f;
        }
        BakedScene b(scene);
        b.bake({.final_rays = 32});
        for (size_t i = 0; i < b.texels.size(); ++i) {
            const glm::vec3 place = glm::abs(b.place(i));
            if (b.meshOf(i) != "floor" || std::max(place.x, place.z) >= 0.25f) continue;
            EXPECT_EQ(b.lux(i).y, 0);
        }
    }
}

// A plate whose edge is below the lamp keeps all light from one side of the line under it, which runs through texels.
// Of those, 64 points tell the share that is lit to 1 / 32 (Halton's first axis has one in each 64th); they get less
// than half of the light.
TEST(NearLamps, HalfBehindAPlateBringHalf) {
    constexpr float foot_x = 0.06f, half_m = 1;
    for (const float height : {0.05f, 0.1f, 0.3f}) {
        Scene scene;
        const uint32_t dark = addMaterial(scene, lambert(0));
        addFloor(scene, half_m, dark);
        addSolid(scene, "plate", {foot_x + 2, height / 2, 0}, {2, 1e-4f, 2}, dark);
        addPointLight(scene, {foot_x, height, -0.04f}, lamp_cd, BakeMode::Full);
        BakedScene b(scene, 4, 64);
        b.bake({.final_rays = 32});
        double found_lm = 0;
        for (size_t i = 0; i < b.texels.size(); ++i)
            if (b.meshOf(i) == "floor")
                found_lm += static_cast<double>(b.lux(i).y) * static_cast<double>(b.texels.area_m2[i]);
        const glm::dvec3 lamp(scene.lights[0].position_m);
        const double sent_lm = lamp_cd * solidAngleOfRectangle(lamp, glm::dvec2(-half_m), {lamp.x, half_m});
        EXPECT_NEAR(found_lm / sent_lm, 1, 1.0 / 32) << height;
    }
}

}  // namespace
}  // namespace dimmer::cook::test
