// Lights against the formulas of their extensions.
#include <bake/baked_scene.h>
#include <bake/punctual.h>
#include <bake/reference.h>
#include <bake/test_scenes.h>
#include <scene/ies.h>

#include <limits>

namespace dimmer::cook::test {
namespace {

PunctualLight lamp(LightType type) {
    PunctualLight light;
    light.type = type;
    light.intensity = {100, 50, 25};
    light.direction = {0, -1, 0};
    return light;
}

TEST(Punctual, InverseSquareDownToAMillimetre) {
    const PunctualLight light = lamp(LightType::Point);
    for (const float d : {0.002f, 0.5f, 3.0f, 100.0f}) {
        const Illumination lit = illuminate(light, {d, 0, 0});
        EXPECT_EQ(lit.towards_light, glm::vec3(-1, 0, 0));
        EXPECT_EQ(lit.distance_m, d);
        EXPECT_FLOAT_EQ(lit.irradiance_lux.x, 100 / (d * d));
        EXPECT_FLOAT_EQ(lit.irradiance_lux.z, 25 / (d * d));
    }
    EXPECT_FLOAT_EQ(illuminate(light, {0, 0.0001f, 0}).irradiance_lux.x, 1e8f);
    EXPECT_EQ(illuminate(light, {0, 0, 0}).irradiance_lux, glm::vec3(0));
}

TEST(Punctual, RangeIsAWindow) {
    PunctualLight light = lamp(LightType::Point);
    light.range_m = 4.0f;
    EXPECT_FLOAT_EQ(illuminate(light, {0, 0, 2}).irradiance_lux.x, 25 * (1 - 1.0f / 16));
    EXPECT_EQ(illuminate(light, {0, 0, 4}).irradiance_lux.x, 0);
    EXPECT_EQ(illuminate(light, {0, 0, 9}).irradiance_lux.x, 0);
}

TEST(Punctual, SpotFallsOffBetweenItsCones) {
    PunctualLight light = lamp(LightType::Spot);
    light.cone_inner_cos = 0.9f;
    light.cone_outer_cos = 0.5f;
    const auto share = [&](float cos_angle) {
        const glm::vec3 d(std::sqrt(1 - cos_angle * cos_angle), -cos_angle, 0);
        return illuminate(light, 2.0f * d).irradiance_lux.x / 25;
    };
    EXPECT_FLOAT_EQ(share(1), 1);
    EXPECT_FLOAT_EQ(share(0.95f), 1);
    EXPECT_NEAR(share(0.7f), 0.25f, 1e-5f);  // half way in the cosine, squared
    EXPECT_EQ(share(0.49f), 0);
    EXPECT_EQ(share(-1), 0);
}

// Within its inner cone a spot has its intensity, however narrow both are; a hard edge between equal angles.
TEST(Punctual, NarrowSpotsAreAsBrightAsWideOnes) {
    PunctualLight light = lamp(LightType::Spot);
    constexpr float degree = std::numbers::pi_v<float> / 180;
    for (const auto& [inner, outer] : {std::pair(1.0f, 1.5f), std::pair(0.0f, 0.5f), std::pair(2.0f, 2.0f)}) {
        light.cone_inner_cos = std::cos(inner * degree);
        light.cone_outer_cos = std::cos(outer * degree);
        const auto at = [&](float angle) {
            return illuminate(light, 2.0f * glm::vec3(std::sin(angle), -std::cos(angle), 0)).irradiance_lux.x;
        };
        // Cosines of floats are coarse: inside of 0.5 degrees by 6e-8 of 3.8e-5.
        EXPECT_NEAR(at(0), 25, 0.2) << outer;
        EXPECT_NEAR(at(0.9f * inner * degree), 25, 0.2) << outer;
        EXPECT_EQ(at((outer + 0.1f) * degree), 0) << outer;
    }
}

TEST(Punctual, SunIsTheSameEverywhere) {
    const PunctualLight light = lamp(LightType::Directional);
    for (const glm::vec3 p : {glm::vec3(0), glm::vec3(1e4f, -3, 7)}) {
        const Illumination lit = illuminate(light, p);
        EXPECT_EQ(lit.towards_light, glm::vec3(0, 1, 0));
        EXPECT_EQ(lit.irradiance_lux, light.intensity);
        EXPECT_EQ(lit.distance_m, std::numeric_limits<float>::infinity());
    }
}

// A Lambertian luminaire 2 m over a floor, pointing down: E = I0 h^2 / d^4. Chords over 2.5 degrees lie at most
// (2.5 degrees)^2 / 8 = 0.024 % of I0 below the cosine, which at the floor's corner, 60 degrees out, is 0.05 % of it.
TEST(Punctual, AMeasuredLuminaireLightsAFloorThroughTheBaker) {
    std::string ies = "IESNA:LM-63-2002\nTILT=NONE\n1 -1 1 37 1 1 2 0 0 0\n1 1 20\n", candela;
    for (int i = 0; i <= 36; ++i) {
        ies += std::to_string(2.5 * i) + " ";
        candela += std::to_string(300 * std::cos(2.5 * i * std::numbers::pi / 180)) + "\n";
    }
    const auto profile = parseLightProfile(ies + "\n0\n" + candela, "lamp.ies");
    ASSERT_TRUE(profile.has_value()) << profile.error().message;

    Scene scene;
    addFloor(scene, 2.4f, addMaterial(scene, lambert(0)));
    PunctualLight& light = addPointLight(scene, {0, 2, 0}, profile->profile.peak_cd, BakeMode::Full);
    light.profile = std::make_shared<const LightProfile>(profile->profile);
    // Its nadir, -Z, points down.
    light.profile_from_world = glm::transpose(glm::mat3({1, 0, 0}, {0, 0, -1}, {0, 1, 0}));
    BakedScene b(scene);
    b.bake({.final_rays = 32});
    for (size_t i = 0; i < b.texels.size(); ++i) {
        const double expected = b.mean(i, [](glm::dvec3 p) {
            const double h = 2 - p.y, d2 = p.x * p.x + p.z * p.z + h * h;
            return 300 * h * h / (d2 * d2);
        });
        ASSERT_NEAR(static_cast<double>(b.lux(i).y), expected, 0.001 * expected);
    }
}

// At the height of the ceiling or a rounding step above it, as the nodes of recessed lamps often are. I h / d^3, and
// for what a dark box of a reflectance of 0.1 sends back a little more.
TEST(Punctual, ALampInThePlaneOfACeilingShinesFromIt) {
    for (const BakeMode bake : {BakeMode::Full, BakeMode::Indirect})
        for (const float height : {0.7f, std::nextafter(0.7f, 1.0f)}) {
            Scene scene;
            const float rho = bake == BakeMode::Full ? 0 : 0.1f;
            addBox(scene, {1, 0.7f, 1}, addMaterial(scene, lambert(rho)));
            addPointLight(scene, {0.3f, height, 0.2f}, 100, bake);
            BakedScene b(scene);
            b.bake({.final_rays = 64});
            const RayScene& rays = *b.rays;
            const ReferenceTracer tracer(rays, {.seed = 3, .set_weights = {}});
            double found = 0, reference = 0, variance = 0;
            int count = 0;
            for (size_t i = 0; i < b.texels.size(); ++i) {
                if (b.normal(i).y < 0.5f) continue;
                ++count;
                if (bake == BakeMode::Full) {
                    const double expected = b.mean(i, [](glm::dvec3 p) {
                        const double d = glm::length(glm::dvec3(0.3, 0.7, 0.2) - p);
                        return 100 * (0.7 - p.y) / (d * d * d);
                    });
                    EXPECT_NEAR(static_cast<double>(b.lux(i).y) / expected, 1, 1e-5);
                    continue;
                }
                const auto v = tracer.irradiance({b.place(i), b.normal(i)}, 256);
                found += static_cast<double>(b.lux(i).y);
                reference += static_cast<double>(v.irradiance_lux.y);
                variance += std::pow(static_cast<double>(v.standard_error_lux.y), 2);
            }
            EXPECT_EQ(count, 64);
            EXPECT_EQ(bake == BakeMode::Indirect, reference > 0);
            // Of 64 texels with 64 rays each, 3 % of each texel's own noise leave 0.4 %.
            EXPECT_NEAR(found, reference, 4 * std::sqrt(variance) + 0.02 * reference) << height;
        }
}

}  // namespace
}  // namespace dimmer::cook::test
