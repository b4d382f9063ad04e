// Spots whose beam is narrower than a few texels: all that they send arrives, where it should.
#include <bake/baked_scene.h>
#include <bake/test_scenes.h>

#include <algorithm>
#include <cmath>

namespace dimmer::cook::test {
namespace {

constexpr float spot_cd = 100, height_m = 2.6f;

struct Beam {
    float tan;           // of its half angle
    bool soft;           // from its axis on, instead of at its edge
    glm::vec3 lands{0};  // its axis, on the floor
    glm::vec3 from{0, height_m, 0};
};

void addSpot(Scene& scene, const Beam& beam) {
    PunctualLight& spot = addPointLight(scene, beam.from, spot_cd, BakeMode::Full);
    spot.type = LightType::Spot;
    spot.direction = glm::normalize(beam.lands - beam.from);
    spot.cone_outer_cos = 1 / std::sqrt(1 + beam.tan * beam.tan);
    spot.cone_inner_cos = beam.soft ? 1 : spot.cone_outer_cos;
}

// The cone formula of KHR_lights_punctual falls from the inner to the outer cosine as a square, whose mean is a third.
// Over as little as a millionth, at least (punctual.cpp), and the cosines are floats: both count for narrow beams.
double sentLm(const Scene& scene) {
    const PunctualLight& spot = scene.lights[0];
    const auto outer = static_cast<double>(spot.cone_outer_cos);
    const double inner = std::max(static_cast<double>(spot.cone_inner_cos), outer + 1e-6);
    return static_cast<double>(spot_cd) * 2 * pi_d * (1 - inner + (inner - outer) / 3);
}

double foundLm(const BakedScene& b, const char* mesh) {
    double sum = 0;
    for (size_t i = 0; i < b.texels.size(); ++i)
        if (b.meshOf(i) == mesh) sum += static_cast<double>(b.lux(i).y) * static_cast<double>(b.texels.area_m2[i]);
    return sum;
}

// Beams of 2.6 cm to 2.3 texels across; of the narrowest, floats tell a direction's place in the cone to half a per
// cent.
TEST(NarrowBeams, AllOfThemArrives) {
    for (const float tan : {0.005f, 0.02f, 0.06f, 0.1f})
        for (const bool soft : {false, true})
            for (const auto& [lands, from] : {std::pair(glm::vec3(0.1f, 0, 0.07f), glm::vec3(0.1f, height_m, 0.07f)),
                                              std::pair(glm::vec3(0.25f, 0, -0.5f), glm::vec3(0.25f, height_m, -0.5f)),
                                              std::pair(glm::vec3(0.4f, 0, 0.3f), glm::vec3(-1, height_m, 1))}) {
                const Beam beam{tan, soft, lands, from};
                Scene scene;
                addFloor(scene, 3, addMaterial(scene, lambert(0)));
                addSpot(scene, beam);
                BakedScene b(scene);
                b.bake({.final_rays = 32});
                EXPECT_NEAR(foundLm(b, "floor") / sentLm(scene), 1, 0.01) << tan << soft << lands.x;
            }
}

// A beam of 5 cm within a texel of 25 lights that one alone, with what it sends over the texel's area.
TEST(NarrowBeams, LightTheTexelThatTheyLandIn) {
    const Beam beam{0.01f, false, {0.2f, 0, 0.2f}, {0.2f, height_m, 0.2f}};
    Scene scene;
    addFloor(scene, 1, addMaterial(scene, lambert(0)));
    addSpot(scene, beam);
    BakedScene b(scene);
    b.bake({.final_rays = 32});
    size_t lit = 0;
    for (size_t i = 0; i < b.texels.size(); ++i) {
        if (!(b.lux(i).y > 0)) continue;
        ++lit;
        EXPECT_LT(glm::distance(b.place(i), beam.lands), 0.25f);
        EXPECT_NEAR(static_cast<double>(b.lux(i).y), sentLm(scene) / (0.25 * 0.25), 1e-3 * sentLm(scene) / 0.0625);
    }
    EXPECT_EQ(lit, 1u);
}

// Half of a beam falls on a plate: of 1,024 directions half do, but for some ten at its edge.
TEST(NarrowBeams, ArriveWhereNothingIsInTheirWay) {
    const Beam beam{0.03f, false, {0.12f, 0, 0.12f}, {0.12f, height_m, 0.12f}};
    Scene scene;
    const uint32_t dark = addMaterial(scene, lambert(0));
    addFloor(scene, 1, dark);
    addQuad(scene, "plate", {beam.lands.x + 1, 1, 0}, {0, 0, 2}, {1, 0, 0}, dark);
    addSpot(scene, beam);
    BakedScene b(scene);
    b.bake({.final_rays = 32});
    EXPECT_NEAR(foundLm(b, "floor") / sentLm(scene), 0.5, 1.0 / 64);
    EXPECT_NEAR(foundLm(b, "plate") / sentLm(scene), 0.5, 1.0 / 64);
}

}  // namespace
}  // namespace dimmer::cook::test
