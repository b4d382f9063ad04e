// Spots whose beam is narrower than a few texels: all that they send arrives, where it should.
#include <bake/baked_scene.h>
#include <bake/test_scenes.h>
#include <fmt/format.h>
#include <scene/ies.h>

#include <algorithm>
#include <cmath>
#include <memory>

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

// A luminaire whose intensity falls with the angle as a bell does, to half of its peak at `half_deg`, and about it a
// faint light everywhere below. Straight between whole and half degrees, as the file has it.
struct Bell {
    double half_deg, faint;
    double shareAt(double v_deg) const { return faint + (1 - faint) * std::exp2(-v_deg * v_deg / half_deg / half_deg); }

    std::shared_ptr<const LightProfile> profile() const {
        std::string text = fmt::format("IESNA:LM-63-2002\nTILT=NONE\n1 -1 1 {} 1 1 2 0 0 0\n1 1 20\n", steps + 1);
        for (int i = 0; i <= steps; ++i) text += fmt::format("{} ", 90.0 * i / steps);
        text += "\n0\n";
        for (int i = 0; i <= steps; ++i) text += fmt::format("{} ", shareAt(90.0 * i / steps));
        auto parsed = parseLightProfile(text, "bell.ies");
        EXPECT_TRUE(parsed) << parsed.error().message;
        return std::make_shared<const LightProfile>(std::move(parsed->profile));
    }
    // Within `end_deg` of the axis, by the midpoint rule.
    double sentLm(double end_deg) const {
        constexpr int parts = 40;  // of a step
        double sum = 0;
        for (int i = 0; i < steps * parts; ++i) {
            const double at = (i + 0.5) / parts, step_deg = 90.0 / steps, deg = at * step_deg;
            if (deg > end_deg) break;
            const double low = std::floor(at), part = at - low;
            const double share = (1 - part) * shareAt(low * step_deg) + part * shareAt((low + 1) * step_deg);
            sum += share * std::sin(deg * pi_d / 180) * step_deg / parts * pi_d / 180;
        }
        return static_cast<double>(spot_cd) * 2 * pi_d * sum;
    }
    static constexpr int steps = 180;
};

// Of beams a third of a texel across to three: eight points a texel found between a tenth and twice of it. A hundredth
// of the peak all around is no beam, and is found by points: they tell a disk's edge to a tenth of a texel. 1,024
// directions integrate the narrowest, which falls by half within four of the file's steps, to 1.6 %.
TEST(NarrowBeams, OfMeasuredLuminairesArrive) {
    for (const double faint : {0.0, 0.015})
        for (const double half_deg : {2.0, 5.0, 12.0})
            for (const glm::vec2 at : {glm::vec2(0.1f, 0.07f), {0.25f, -0.5f}, {0.37f, 0.21f}}) {
                constexpr float lamp_m = 0.5f, floor_m = 3;
                const Bell bell{half_deg, faint};
                Scene scene;
                addFloor(scene, floor_m, addMaterial(scene, lambert(0)));
                PunctualLight& lamp = addPointLight(scene, {at.x, lamp_m, at.y}, spot_cd, BakeMode::Full);
                lamp.profile = bell.profile();
                lamp.direction = {0, -1, 0};
                // Its nadir is -Z; here it shines down. The floor's rim cuts off what is faint: all within 2.4 m lands.
                lamp.profile_from_world = glm::mat3({1, 0, 0}, {0, 0, 1}, {0, -1, 0});
                BakedScene b(scene);
                b.bake({.final_rays = 32});
                double found = 0;
                const double end_m = 2;
                for (size_t i = 0; i < b.texels.size(); ++i)
                    if (glm::distance(glm::vec2(b.place(i).x, b.place(i).z), at) < end_m)
                        found += static_cast<double>(b.lux(i).y) * static_cast<double>(b.texels.area_m2[i]);
                const double sent = bell.sentLm(std::atan(end_m / static_cast<double>(lamp_m)) * 180 / pi_d);
                EXPECT_NEAR(found / sent, 1, 0.02) << half_deg << " " << faint << " " << at.x;
            }
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
