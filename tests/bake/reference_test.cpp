// The reference path tracer against closed forms: four standard errors, and a bias of 0.1 % for the 0.2 mm by which
// paths start off the surface (on distances of a metre and more).
#include <bake/reference.h>
#include <bake/test_scenes.h>
#include <gtest/gtest.h>
#include <scene/ies.h>

#include <memory>
#include <random>

namespace dimmer::cook::test {
namespace {

constexpr double bias_share = 1e-3;
const glm::vec3 up(0, 1, 0);

ReferenceValue trace(const Scene& scene, glm::vec3 point, glm::vec3 normal, uint32_t paths,
                     const ReferenceOptions& options = {}) {
    const RayScene rays(scene);
    return ReferenceTracer(rays, options).irradiance({point, normal}, paths);
}

void expectLux(const ReferenceValue& value, double expected, double error_share_max) {
    const auto error = static_cast<double>(value.standard_error_lux.x);
    EXPECT_NEAR(static_cast<double>(value.irradiance_lux.x), expected, 4 * error + bias_share * expected);
    // A test that is this noisy would prove nothing.
    EXPECT_LE(error, error_share_max * expected);
}

TEST(Reference, PointLightOverAPlaneFollowsTheInverseSquare) {
    Scene scene;
    addFloor(scene, 20, addMaterial(scene, lambert(0)));
    addPointLight(scene, {0, 2, 0}, 100, BakeMode::Full);
    for (float x : {0.0f, 0.7f, 3.0f, 10.0f}) {
        const double d2 = static_cast<double>(x) * static_cast<double>(x) + 4;
        expectLux(trace(scene, {x, 0, 0}, up, 16), 100 * 2 / std::pow(d2, 1.5), 1e-6);
    }
    scene.lights[0].bake = BakeMode::Indirect;  // its direct light is the renderer's
    EXPECT_EQ(trace(scene, {0, 0, 0}, up, 16).irradiance_lux, glm::vec3(0));
}

// The same beam as a spot and as a measured luminaire, whose directions were drawn from all around: off a floor of 0.8
// to a point beside the lamp.
TEST(Reference, ANarrowLuminaireIsAsQuietAsASpot) {
    constexpr double half_deg = 2;
    Scene scene;
    addFloor(scene, 20, addMaterial(scene, lambert(0.8f)));
    PunctualLight& lamp = addPointLight(scene, {0, 2, 0}, 1000, BakeMode::Indirect);
    lamp.type = LightType::Spot;
    lamp.direction = {0, -1, 0};
    lamp.cone_outer_cos = lamp.cone_inner_cos = static_cast<float>(std::cos(half_deg * pi_d / 180));
    const glm::vec3 eye(1, 1, 0), down(0, -1, 0);
    const ReferenceValue spot = trace(scene, eye, down, 20000);
    auto parsed = parseLightProfile("TILT=NONE\n1 -1 1 3 1 1 2 0 0 0\n1 1 20\n0 2 2.0001\n0\n1 1 0\n", "beam.ies");
    ASSERT_TRUE(parsed) << parsed.error().message;
    lamp.type = LightType::Point;
    lamp.profile = std::make_shared<const LightProfile>(std::move(parsed->profile));
    lamp.profile_from_world = glm::mat3({1, 0, 0}, {0, 0, 1}, {0, -1, 0});
    const ReferenceValue luminaire = trace(scene, eye, down, 20000);
    // E = rho / pi * flux * cos cos / d^2 from the spot's middle, 1.4 m off; it is 14 cm wide.
    const double flux = 1000 * 2 * pi_d * (1 - std::cos(half_deg * pi_d / 180));
    for (const ReferenceValue& value : {spot, luminaire}) expectLux(value, 0.8 / pi_d * flux * 0.5 / 2, 0.02);
}

// A lamp millimetres over a floor lays half of its light on it: what comes back is that of one at a few centimetres.
TEST(Reference, ALampCloseToAFloorLosesNothing) {
    for (const double lamp_m : {0.002, 0.005, 0.05}) {
        SCOPED_TRACE(lamp_m);
        constexpr double eye_m = 2, rho = 0.5, candela = 100;
        Scene scene;
        addFloor(scene, 20, addMaterial(scene, lambert(static_cast<float>(rho))));
        addPointLight(scene, {0, static_cast<float>(lamp_m), 0}, static_cast<float>(candela), BakeMode::Indirect);
        // Over rings of the floor, of r = lamp_m tan(a): rho / pi of the lamp's light there, times the ring's form
        // factor from the eye above it.
        double expected = 0;
        constexpr int steps = 4096;
        for (int i = 0; i < steps; ++i) {
            const double angle = (i + 0.5) / steps * pi_d / 2, r = lamp_m * std::tan(angle);
            const double arrives_cd = candela * std::sin(angle);  // over 2 pi d(angle)
            const double seen = eye_m * eye_m / std::pow(r * r + eye_m * eye_m, 2);
            expected += rho / pi_d * arrives_cd * seen * 2 * pi_d * (pi_d / 2 / steps);
        }
        expectLux(trace(scene, {0, static_cast<float>(eye_m), 0}, -up, 100000), expected, 0.03);
    }
}

TEST(Reference, Furnace) {
    for (float rho : {0.5f, 0.8f}) {
        Scene scene;
        addBox(scene, {1, 1.5f, 2}, addMaterial(scene, emissive(glm::vec3(3), rho)));
        const double expected = pi_d * 3 / (1 - static_cast<double>(rho));
        for (glm::vec3 p : {glm::vec3(0, -1.5f, 0), glm::vec3(0.9f, -1.5f, 1.9f), glm::vec3(-0.5f, -1.5f, 1)})
            expectLux(trace(scene, p, up, 20000), expected, 0.01);
    }
}

// Whatever the shape of a closed room: the flux that bounces is rho / (1 - rho) of what the lamp sends out.
TEST(Reference, SphereLitFromItsCentre) {
    constexpr float rho = 0.6f, candela = 50;
    Scene scene;
    const double area = addSphere(scene, 2, 48, 24, addMaterial(scene, lambert(rho)));
    addPointLight(scene, {0, 0, 0}, candela, BakeMode::Indirect);
    const double expected = 4 * pi_d * static_cast<double>(candela) / area * 0.6 / 0.4;
    const RayScene rays(scene);
    const ReferenceTracer tracer(rays, {});
    std::mt19937 random(1);
    for (int i = 0; i < 8; ++i) {
        const auto t = static_cast<uint32_t>(random() % rays.triangles().size());
        const ReferenceValue v = tracer.irradiance({rays.pointOn(t, 0.3f, 0.3f), rays.triangles()[t].normal}, 4000);
        // A facet of 7.5 degrees is up to 0.4 % off the sphere's uniform light.
        EXPECT_NEAR(static_cast<double>(v.irradiance_lux.x), expected,
                    4 * static_cast<double>(v.standard_error_lux.x) + 0.004 * expected);
        EXPECT_LE(static_cast<double>(v.standard_error_lux.x), 0.02 * expected);
    }
}

TEST(Reference, EmissiveRectangleHasItsFormFactor) {
    Scene scene;
    addFloor(scene, 5, addMaterial(scene, lambert(0)));
    // 2 m x 1 m at a height of 1.5 m, facing down.
    addQuad(scene, "panel", {0, 1.5f, 0}, {1, 0, 0}, {0, 0, 0.5f}, addMaterial(scene, emissive(glm::vec3(200))));
    expectLux(trace(scene, {0, 0, 0}, up, 20000), pi_d * 200 * 4 * cornerFormFactor(1, 0.5, 1.5), 0.01);
    expectLux(trace(scene, {1, 0, 0.5f}, up, 20000), pi_d * 200 * cornerFormFactor(2, 1, 1.5), 0.02);
    // Single-sided: dark from behind.
    EXPECT_EQ(trace(scene, {0, 3, 0}, {0, -1, 0}, 1000).irradiance_lux, glm::vec3(0));
}

// A small panel among a hundred dark metres of others: the choice among emitters must not bias.
TEST(Reference, ManyEmittersAddUp) {
    Scene scene;
    addFloor(scene, 5, addMaterial(scene, lambert(0)));
    const uint32_t bright = addMaterial(scene, emissive(glm::vec3(500)));
    const uint32_t dim = addMaterial(scene, emissive(glm::vec3(1)));
    double expected = 0;
    for (int i = 0; i < 10; ++i) {
        const float side = i == 0 ? 0.1f : 0.5f;
        addQuad(scene, "panel", {0, 2 + i, 0}, {side, 0, 0}, {0, 0, side}, i == 0 ? bright : dim);
        const double s = static_cast<double>(side);
        // The panel below hides 0.1 m of the next at 2 m: a frame is what is left of it.
        const double hidden = i == 0 ? 0 : i == 1 ? 0.1 * 3.0 / 2.0 : s * (2.0 + i) / (1.0 + i);
        if (hidden < s) {
            const double whole = 4 * cornerFormFactor(s, s, 2.0 + i);
            const double covered = i == 0 ? 0 : 4 * cornerFormFactor(hidden, hidden, 2.0 + i);
            expected += pi_d * (i == 0 ? 500 : 1) * (whole - covered);
        }
    }
    expectLux(trace(scene, {0, 0, 0}, up, 40000), expected, 0.01);
}

// More lamps than get a shadow ray each: 40 around a lit patch of a second floor that the first one sees.
TEST(Reference, ManyLampsAddUp) {
    Scene one, many;
    for (Scene* scene : {&one, &many}) {
        addFloor(*scene, 4, addMaterial(*scene, lambert(0)));
        addQuad(*scene, "ceiling", {0, 3, 0}, {4, 0, 0}, {0, 0, 4}, addMaterial(*scene, lambert(0.7f)));
    }
    addPointLight(one, {0.5f, 1.5f, 0.5f}, 80, BakeMode::Indirect);
    for (int i = 0; i < 40; ++i) addPointLight(many, {0.5f, 1.5f, 0.5f}, 2, BakeMode::Indirect);
    // The expected value is a sum over the ceiling's patches: E_ceiling(r) rho / pi times the patch's form factor.
    double expected = 0;
    constexpr int n = 800;
    for (int i = 0; i < n; ++i)
        for (int j = 0; j < n; ++j) {
            const double x = 8 * (i + 0.5) / n - 4, z = 8 * (j + 0.5) / n - 4, dx = x - 0.5, dz = z - 0.5;
            const double lit = 80 * 1.5 / std::pow(dx * dx + dz * dz + 1.5 * 1.5, 1.5);
            const double d2 = x * x + z * z + 9;
            expected += lit * 0.7 / pi_d * 9 / (d2 * d2) * (8.0 / n) * (8.0 / n);
        }
    expectLux(trace(one, {0, 0, 0}, up, 40000), expected, 0.01);
    expectLux(trace(many, {0, 0, 0}, up, 40000), expected, 0.01);
}

// Where a step of floats is 0.5 or 1 mm paths still start off the surface, and a room stays as bright as at home.
TEST(Reference, FarFromTheOriginNothingChanges) {
    const auto roomAt = [](float x) {
        Scene scene;
        addBox(scene, {2, 1, 2}, addMaterial(scene, lambert(0.5f)));
        for (SceneMesh& mesh : scene.meshes)
            for (glm::vec3& p : mesh.positions_m) p.x += x;
        addPointLight(scene, {x + 0.5f, 0.25f, 0.5f}, 100, BakeMode::Indirect);
        return scene;
    };
    for (const glm::vec3 place : {glm::vec3(-0.5f, -1, 0.5f), glm::vec3(1.5f, -1, -1.5f)}) {
        const ReferenceValue home = trace(roomAt(0), place, up, 20000);
        ASSERT_GT(home.irradiance_lux.x, 1);
        for (const float x : {4500.0f, -10000.0f})
            expectLux(trace(roomAt(x), place + glm::vec3(x, 0, 0), up, 20000),
                      static_cast<double>(home.irradiance_lux.x), 0.01);
    }
}

TEST(Reference, OpenPlaneUnderAConstantSky) {
    Scene scene;
    addFloor(scene, 5, addMaterial(scene, lambert(0.5f)));
    scene.sky_radiance_cd_m2 = {100, 200, 300};
    const ReferenceValue v = trace(scene, {0, 0, 0}, up, 1000);
    EXPECT_NEAR(v.irradiance_lux.x, 100 * pi_d, 0.1);
    EXPECT_NEAR(v.irradiance_lux.z, 300 * pi_d, 0.3);
    // Half the hemisphere sees the sky, the other half a floor that reflects half of it.
    expectLux(trace(scene, {0, 0.01f, 0}, {1, 0, 0}, 20000), 100 * pi_d * 0.75, 0.01);
}

// A sun of four texels in a dim picture, a seventy-thousandth of the sphere: against the sum over texels, which is
// exact, and behind a wall that hides it against the dim rest of the half that is in sight. So few paths hardly meet
// the sun by chance: what they found would be either far too little, with next to no noise, or far too much.
TEST(Reference, ATinySunInThePictureOfTheSky) {
    constexpr uint32_t width = 1024, height = 512, row = 128, column = 640;
    Image image{width, height, std::vector<glm::vec4>(width * height, glm::vec4(1))};
    double expected = pi_d;
    for (uint32_t y = row; y < row + 2; ++y)
        for (uint32_t x = column; x < column + 2; ++x) {
            image.texels[y * width + x] = glm::vec4(1e6f + 1);
            const auto square = [](double s) { return s * s; };
            // Of cosine over a texel: d(azimuth) (sin^2 lower - sin^2 upper) / 2, in polar angles.
            expected += 1e6 * 2 * pi_d / width * 0.5 *
                        (square(std::sin(pi_d * (y + 1) / height)) - square(std::sin(pi_d * y / height)));
        }
    Scene scene;
    addFloor(scene, 50, addMaterial(scene, lambert(0)));
    scene.sky_image = std::make_shared<const Image>(std::move(image));
    scene.sky_radiance_cd_m2 = glm::vec3(1);
    EXPECT_GT(expected, 20 * pi_d) << "the sun would not matter";
    expectLux(trace(scene, {0, 0, 0}, up, 256), expected, 0.03);
    // Azimuth (column / width - 1/2) of a turn: 45 degrees from +x towards +z.
    addSolid(scene, "wall", {10, 10, 10}, {9, 10, 9}, addMaterial(scene, lambert(0)));
    EXPECT_LT(trace(scene, {0, 0, 0}, up, 256).irradiance_lux.x, pi_d);
}

TEST(Reference, ABlendedSheetPassesItsShare) {
    Scene scene;
    addFloor(scene, 3, addMaterial(scene, lambert(0)));
    Material sheet = lambert(0);
    sheet.alpha_mode = AlphaMode::Blend;
    sheet.alpha = 0.25f;
    addQuad(scene, "sheet", {0, 1, 0}, {2000, 0, 0}, {0, 0, 2000}, addMaterial(scene, sheet));
    scene.sky_radiance_cd_m2 = glm::vec3(100);
    expectLux(trace(scene, {0, 0, 0}, up, 20000), 0.75 * 100 * pi_d, 0.01);
    scene.sky_radiance_cd_m2 = glm::vec3(0);
    addPointLight(scene, {0, 2, 0}, 100, BakeMode::Full);
    expectLux(trace(scene, {0, 0, 0}, up, 16), 0.75 * 25, 1e-6);
    // An emitter that is itself blended shows its alpha's share.
    scene.lights.clear();
    scene.materials.back() = sheet;
    scene.materials.back().emission_cd_m2 = glm::vec3(40);
    scene.materials.back().double_sided = true;
    expectLux(trace(scene, {0, 0, 0}, up, 20000), 0.25 * 40 * pi_d, 0.02);
}

// A lamp below a ceiling: the floor gets what the ceiling's lower side reflects.
TEST(Reference, BacksBlockAndOnlyDoubleSidedOnesReflect) {
    constexpr double rho = 0.8, lamp_m = 1, ceiling_m = 2;
    Scene scene;
    addFloor(scene, 5, addMaterial(scene, lambert(0)));
    addFloor(scene, 3, addMaterial(scene, lambert(0.8f)), 2);  // faces up: its back is over the lamp
    addPointLight(scene, {0, 1, 0}, 60, BakeMode::Indirect);
    EXPECT_EQ(trace(scene, {0, 0, 0}, up, 2000).irradiance_lux, glm::vec3(0));

    double expected = 0;
    constexpr int n = 600;
    for (int i = 0; i < n; ++i)
        for (int j = 0; j < n; ++j) {
            const double x = 6 * (i + 0.5) / n - 3, z = 6 * (j + 0.5) / n - 3, r2 = x * x + z * z;
            const double lit = 60 * lamp_m / std::pow(r2 + lamp_m * lamp_m, 1.5);
            const double d2 = r2 + ceiling_m * ceiling_m;
            expected += lit * rho / pi_d * ceiling_m * ceiling_m / (d2 * d2) * (6.0 / n) * (6.0 / n);
        }
    scene.materials.back().double_sided = true;
    expectLux(trace(scene, {0, 0, 0}, up, 40000), expected, 0.01);
    // And above it, no lamp: the back's light does not come through.
    EXPECT_EQ(trace(scene, {0, 2.5f, 0}, {0, -1, 0}, 2000).irradiance_lux, glm::vec3(0));
}

// Nothing of the sun gets into a sealed attic. Lifted straight off its floor, paths near the eaves would be beyond the
// roof.
TEST(Reference, NoSunComesThroughEaves) {
    Scene scene;
    addAttic(scene, 3, 2, 0.35f, addMaterial(scene, lambert(0.8f)));
    PunctualLight sun;
    sun.type = LightType::Directional;
    sun.direction = {0, -1, 0};
    sun.intensity = glm::vec3(1e5f);
    scene.lights.push_back(sun);
    const RayScene rays(scene);
    const ReferenceTracer tracer(rays, {});
    for (const float x : {2.9f, 2.5f, -2.7f})
        EXPECT_EQ(tracer.irradiance({{x, 0, 0.1f}, up, up}, 1 << 16).irradiance_lux, glm::vec3(0)) << x;
}

TEST(Reference, WeightsScaleEverySetAlone) {
    Scene scene;
    addBox(scene, glm::vec3(1), addMaterial(scene, lambert(0.5f)));
    scene.light_sets = {{"a", 1}, {"b", 1}};
    addPointLight(scene, {0, 0, 0}, 10, BakeMode::Full).light_set = 0;
    addPointLight(scene, {0, 0.5f, 0}, 20, BakeMode::Full).light_set = 1;
    addPointLight(scene, {0.5f, 0, 0}, 30, BakeMode::Full);
    const auto lux = [&](const ReferenceOptions& o) { return trace(scene, {0, -1, 0}, up, 20000, o); };
    const ReferenceValue a = lux(onlySet(0, 2)), b = lux(onlySet(1, 2));
    ReferenceOptions none, mixed;
    none.set_weights.assign(2, glm::vec3(0));
    mixed.set_weights = {glm::vec3(0.5f), glm::vec3(1, 0.25f, 1)};
    const ReferenceValue always = lux(none), both = lux(mixed);
    const auto sum = [](float x, float y, float z) { return 0.5 * double{x} + 0.25 * double{y} + double{z}; };
    const double expected = sum(a.irradiance_lux.y, b.irradiance_lux.y, always.irradiance_lux.y);
    // Each state picks its own lamps: noise of all four adds up.
    const double noise = sum(a.standard_error_lux.y, b.standard_error_lux.y, always.standard_error_lux.y) +
                         double{both.standard_error_lux.y};
    EXPECT_LE(noise, 0.01 * expected);
    EXPECT_NEAR(double{both.irradiance_lux.y}, expected, 4 * noise);
    // Red of set b counts in full.
    const double red = 0.5 * double{a.irradiance_lux.x} + double{b.irradiance_lux.x} + double{always.irradiance_lux.x};
    EXPECT_NEAR(double{both.irradiance_lux.x}, red, 0.04 * red);
}

TEST(Reference, RefiningIsTheSameAsTracingAtOnce) {
    Scene scene;
    addBox(scene, glm::vec3(1), addMaterial(scene, emissive(glm::vec3(1), 0.5f)));
    const RayScene rays(scene);
    const ReferenceTracer tracer(rays, {});
    ReferenceEstimate in_steps;
    const ReferencePoint place{{0.3f, -1, 0.2f}, up};
    for (uint32_t n : {1, 99, 400}) tracer.refine(in_steps, place, n);
    const ReferenceValue once = tracer.irradiance(place, 500), steps = in_steps.value();
    EXPECT_EQ(in_steps.paths(), 500u);
    EXPECT_EQ(once.irradiance_lux, steps.irradiance_lux);
    EXPECT_EQ(once.standard_error_lux, steps.standard_error_lux);
}

// What one lamp adds to another, far brighter one: the brighter one's noise is in both.
TEST(Reference, ADifferenceHasTheNoiseOfWhatDiffersAlone) {
    Scene scene;
    addBox(scene, glm::vec3(1), addMaterial(scene, lambert(0.5f)));
    scene.light_sets = {{"bright", 1}, {"faint", 1}};
    addPointLight(scene, {0.4f, 0.1f, 0}, 1000, BakeMode::Indirect).light_set = 0;
    addPointLight(scene, {-0.4f, 0.1f, 0}, 1, BakeMode::Indirect).light_set = 1;
    const RayScene rays(scene);
    const std::vector<glm::vec3> first = {glm::vec3(1), glm::vec3(0)};
    const ReferenceTracer both(rays, {}), bright(rays, {.set_weights = first}), faint(rays, onlySet(1, 2));
    const ReferencePoint place{{0.3f, -1, 0.2f}, up};
    constexpr uint32_t paths = 4000;
    ReferenceEstimate difference;
    for (uint32_t n : {1u, paths - 1}) both.refineDifference(difference, bright, place, n);
    EXPECT_EQ(difference.paths(), paths);
    const ReferenceValue d = difference.value(), a = both.irradiance(place, paths), b = bright.irradiance(place, paths);
    // The same paths: but for the rounding of floats.
    EXPECT_NEAR(d.irradiance_lux.y, a.irradiance_lux.y - b.irradiance_lux.y, 1e-5f * a.irradiance_lux.y);
    EXPECT_LT(d.luminance_error_lux, 0.1f * std::hypot(a.luminance_error_lux, b.luminance_error_lux));
    const ReferenceValue alone = faint.irradiance(place, paths);
    const float noise = std::hypot(d.luminance_error_lux, alone.luminance_error_lux);
    EXPECT_LT(noise, 0.2f * alone.irradiance_lux.y);
    EXPECT_NEAR(luminance(d.irradiance_lux), luminance(alone.irradiance_lux), 4 * noise);
}

}  // namespace
}  // namespace dimmer::cook::test
