// The sky as a light source, against integrals over its texels.
#include <bake/baked_scene.h>
#include <bake/reference.h>
#include <bake/sampling.h>
#include <bake/sky.h>
#include <bake/test_scenes.h>

#include <random>

namespace dimmer::cook::test {
namespace {

std::shared_ptr<const Image> skyImage(uint32_t width, uint32_t height, auto&& radiance) {
    Image image{width, height, {}};
    for (uint32_t y = 0; y < height; ++y)
        for (uint32_t x = 0; x < width; ++x) image.texels.emplace_back(glm::vec3(radiance(x, y)), 1);
    return std::make_shared<const Image>(std::move(image));
}

// A black floor without anything else, seen by the sky alone.
Scene floorUnder(std::shared_ptr<const Image> image, glm::vec3 scale = glm::vec3(1)) {
    Scene scene;
    addFloor(scene, 3, addMaterial(scene, lambert(0)));
    scene.sky_image = std::move(image);
    scene.sky_radiance_cd_m2 = scale;
    return scene;
}

// Irradiance of a surface under a texel in row y that is wholly above it: the integral of the cosine from straight up.
double texelOverFloor(double width, double height, double y) {
    const double top = std::sin(pi_d * y / height), bottom = std::sin(pi_d * (y + 1) / height);
    return 2 * pi_d / width * (bottom * bottom - top * top) / 2;
}

double mean(const BakedScene& b) {
    double sum = 0;
    for (size_t i = 0; i < b.texels.size(); ++i) sum += static_cast<double>(b.lux(i).y);
    return sum / static_cast<double>(b.texels.size());
}

TEST(Sky, DirectionsAreWhereTheyAreSaidToBe) {
    const Scene scene =
        floorUnder(skyImage(8, 4, [](uint32_t x, uint32_t y) { return glm::vec3(x, y, 1); }), {1, 1, 5});
    const auto texel = [&](glm::vec3 d) { return skyRadiance(scene, glm::normalize(d)); };
    EXPECT_EQ(texel({0.01f, 1, 0.01f}).y, 0);
    EXPECT_EQ(texel({0.01f, -1, 0.01f}).y, 3);
    EXPECT_EQ(texel({1, 0.1f, 0.1f}), glm::vec3(4, 1, 5));
    EXPECT_EQ(texel({1, 0.1f, -0.1f}), glm::vec3(3, 1, 5));
    EXPECT_EQ(texel({0.1f, -0.1f, 1}), glm::vec3(5, 2, 5));
    EXPECT_EQ(texel({-1, 0.1f, 0.1f}).x, 7);
    EXPECT_EQ(texel({-1, 0.1f, -0.1f}).x, 0);
}

// Counts per texel against shares of flux, of the two texels that outshine the sky and of the 126 others: a chi-square
// of 1 degree of freedom lies below 17.3, one of 125 below 199, but for 1 in 30,000.
TEST(Sky, SamplesFollowTheFlux) {
    constexpr uint32_t width = 16, height = 8, samples = 200000;
    std::mt19937 random(3);
    const auto peak = [](uint32_t x, uint32_t y) { return y == 2 && (x == 3 || x == 4); };
    const auto image = skyImage(width, height, [&](uint32_t x, uint32_t y) {
        // Spread over three orders of magnitude; no two alike, since they tell the texels apart below. Blue counts.
        const float value = 0.05f + std::pow(unitFloat(static_cast<uint32_t>(random())), 4.0f) * 50;
        return (peak(x, y) ? 1000 + value : value) * glm::vec3(0.5f, 0.25f, 1);
    });
    const Scene scene = floorUnder(image);
    const SkySampler sampler(scene);
    ASSERT_FALSE(sampler.empty());
    double drawn_integral = 0, of_all = 0;
    for (const auto part : {SkySampler::Rest, SkySampler::Peaks}) {
        std::vector<double> counts(width * height), shares;
        double all = 0;
        uint32_t elsewhere = 0;
        for (uint32_t i = 0; i < samples; ++i) {
            const SkySample s = sampler.sample(part, {unitFloat(hash(1, i)), unitFloat(hash(2, i))});
            ASSERT_NEAR(glm::length(s.direction), 1, 1e-5f);
            const auto found = std::ranges::find(image->texels, glm::vec4(s.radiance_cd_m2, 1)) - image->texels.begin();
            ++counts[static_cast<size_t>(found)];
            elsewhere += skyRadiance(scene, s.direction) != s.radiance_cd_m2;
        }
        EXPECT_LT(elsewhere, samples / 1000);  // directions on a texel's rim may round into the next one
        for (uint32_t y = 0; y < height; ++y)
            for (uint32_t x = 0; x < width; ++x) {
                const double solid_angle =
                    2 * pi_d / width * (std::cos(pi_d * y / height) - std::cos(pi_d * (y + 1) / height));
                const glm::vec3 radiance(image->texels[y * width + x]);
                const bool here = peak(x, y) == (part == SkySampler::Peaks);
                shares.push_back(here ? solid_angle * static_cast<double>(radiance.z) : 0);
                all += shares.back();
                if (here) drawn_integral += solid_angle * static_cast<double>(sampler.density(radiance, 8));
            }
        of_all += sampler.samplesOf(part, 8);
        double chi2 = 0;
        for (size_t i = 0; i < shares.size(); ++i) {
            const double expected = shares[i] / all * samples;
            if (expected == 0)
                EXPECT_EQ(counts[i], 0);
            else
                chi2 += (counts[i] - expected) * (counts[i] - expected) / expected;
        }
        EXPECT_LT(chi2, part == SkySampler::Peaks ? 17.3 : 199);
    }
    EXPECT_NEAR(drawn_integral, of_all, 1e-4);
    EXPECT_EQ(of_all, 8);
    // Each part that sends light is asked, however few samples there are.
    EXPECT_EQ(sampler.samplesOf(SkySampler::Rest, 1), 1u);
    EXPECT_EQ(sampler.samplesOf(SkySampler::Peaks, 1), 1u);
}

// A sun of 2 x 2 texels with nine tenths of a floor's light, in a dim sky: no texel is off by more than the sky's own
// noise, a tenth of a tenth, and the mean by half of that. (How many of a few samples found the sun was chance: up to
// 23 %.)
TEST(Sky, HowManySamplesFindTheSunIsNoChance) {
    constexpr uint32_t width = 512, height = 256;
    const auto radiance = [](uint32_t x, uint32_t y) {
        return glm::vec3((x == 200 || x == 201) && (y == 30 || y == 31) ? 262144.0f : 1.0f);
    };
    double expected = 0;
    for (uint32_t row = 0; row < height / 2; ++row)
        for (uint32_t x = 0; x < width; ++x)
            expected += static_cast<double>(radiance(x, row).x) * texelOverFloor(width, height, row);
    BakedScene b(floorUnder(skyImage(width, height, radiance)));
    b.bake({.final_rays = 2048, .noise_max = 0.01f});
    for (size_t i = 0; i < b.texels.size(); ++i) EXPECT_NEAR(static_cast<double>(b.lux(i).y) / expected, 1, 0.01);
    EXPECT_NEAR(mean(b) / expected, 1, 0.005);
}

TEST(Sky, AConstantImageIsAConstantSky) {
    Scene plain = floorUnder(nullptr, {100, 200, 300});
    BakedScene constant(plain);
    constant.bake({.final_rays = 256});
    BakedScene image(floorUnder(skyImage(8, 4, [](uint32_t, uint32_t) { return glm::vec3(2); }), {50, 100, 150}));
    image.bake({.final_rays = 256});
    // No ray more than the gather's own, and no noise: every ray brings the same.
    for (size_t i = 0; i < constant.texels.size(); ++i) EXPECT_NEAR(constant.lux(i).y, 200 * pi_d, 0.1);
    // Half the samples of a whole sphere of light lie below the floor, so an image has some noise.
    double worst = 0;
    for (size_t i = 0; i < image.texels.size(); ++i)
        worst = std::max(worst, std::abs(static_cast<double>(image.lux(i).y) / (200 * pi_d) - 1));
    EXPECT_LT(worst, 0.1);
    EXPECT_NEAR(mean(image), 200 * pi_d, 0.002 * 200 * pi_d);
    EXPECT_NEAR(image.lux(0).z / image.lux(0).x, 3, 1e-4);
}

// One texel of 512 x 256 with all the light. A texel of the floor gets 4 rounds of 32 cosine rays and 8 samples; a
// cosine ray that happens to find the sun brings pi / 32 x (32 cos / pi) / (8 / solid angle) of its radiance in one
// round of 4: 1 / 32 of the irradiance. Two such are allowed, and the mean is held to 1 %.
constexpr double lucky_ray = 1.0 / 32;

TEST(Sky, ATinySunHasItsFlux) {
    constexpr uint32_t width = 512, height = 256;
    for (const uint32_t row : {8u, 60u, 100u}) {
        BakedScene b(floorUnder(skyImage(
            width, height, [&](uint32_t x, uint32_t y) { return glm::vec3(x == 200 && y == row ? 1e6f : 0.0f); })));
        b.bake({.final_rays = 128});
        const double expected = 1e6 * texelOverFloor(width, height, row);
        for (size_t i = 0; i < b.texels.size(); ++i)
            ASSERT_NEAR(static_cast<double>(b.lux(i).y), expected, 2.2 * lucky_ray * expected) << row;
        EXPECT_NEAR(mean(b), expected, 0.01 * expected);
    }
}

// The sun at 45 degrees over -X: a wall of 1 m throws 1 m of shadow towards +X.
TEST(Sky, ATinySunThrowsShadows) {
    Scene scene = floorUnder(skyImage(
        360, 180, [](uint32_t x, uint32_t y) { return glm::vec3((x == 0 || x == 359) && y == 44 ? 1e5f : 0.0f); }));
    Material wall = lambert(0);
    wall.double_sided = true;
    addQuad(scene, "wall", {0, 0.5f, 0}, {0, 0.5f, 0}, {0, 0, 3.2f}, addMaterial(scene, wall));
    BakedScene b(scene);
    b.bake({.final_rays = 128});
    const double expected = 2 * 1e5 * texelOverFloor(360, 180, 44);
    int lit = 0, dark = 0;
    double sum = 0;
    for (size_t i = 0; i < b.texels.size(); ++i) {
        if (b.meshOf(i) != "floor") continue;
        const float x = b.place(i).x;
        // A texel is 0.25 m wide, the sun 2 degrees: the border is left out.
        if (x > 0.2f && x < 0.7f) {
            ++dark;
            EXPECT_EQ(b.lux(i), glm::vec3(0)) << x;
        } else if (x < -0.2f || x > 1.3f) {
            ++lit;
            EXPECT_NEAR(static_cast<double>(b.lux(i).y), expected, 2.2 * lucky_ray * expected) << x;
            sum += static_cast<double>(b.lux(i).y);
        }
    }
    EXPECT_NEAR(sum / lit, expected, 0.01 * expected);
    EXPECT_GT(lit, 200);
    EXPECT_GT(dark, 40);
}

// An uneven sky over an open floor: the integral is a sum over the upper texels. Both ways to find the sky, and each of
// the two alone where it can, agree with it; so does the reference, which knows one way only.
TEST(Sky, WhateverTheSplitOfRaysTheSumIsTheIntegral) {
    constexpr uint32_t width = 12, height = 8;
    std::mt19937 random(9);
    const auto image = skyImage(width, height, [&](uint32_t, uint32_t) {
        const float v = static_cast<float>(random() % 1000) / 1000;
        return glm::vec3(v, v * v * v * 40, 1);
    });
    double expected = 0;
    for (uint32_t y = 0; y < height / 2; ++y)
        for (uint32_t x = 0; x < width; ++x)
            expected += static_cast<double>(image->texels[y * width + x].y) * texelOverFloor(width, height, y);
    for (const uint32_t samples : {0u, 4u, 32u}) {
        BakedScene b(floorUnder(image));
        b.bake({.final_rays = 256, .emitter_samples = samples});
        // 576 texels of 256 rays and more: 150,000 samples whose spread is about the mean's own size.
        EXPECT_NEAR(mean(b), expected, 0.01 * expected) << samples;
    }
    const Scene scene = floorUnder(image);
    const RayScene rays(scene);
    const ReferenceValue v = ReferenceTracer(rays, {}).irradiance({{0, 0, 0}, {0, 1, 0}}, 40000);
    EXPECT_NEAR(static_cast<double>(v.irradiance_lux.y), expected, 4 * static_cast<double>(v.standard_error_lux.y));
    EXPECT_LT(static_cast<double>(v.standard_error_lux.y), 0.01 * expected);
}

TEST(Sky, ABlackImageGivesNothing) {
    BakedScene b(floorUnder(skyImage(4, 2, [](uint32_t, uint32_t) { return glm::vec3(0); })));
    b.bake({});
    EXPECT_EQ(mean(b), 0);
}

}  // namespace
}  // namespace dimmer::cook::test
