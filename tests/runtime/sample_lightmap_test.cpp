#include <dimmer/cpu_runtime.h>
#include <format/texel.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "random_pack.h"

namespace dimmer {
namespace {

constexpr uint32_t no_direction = 1023u | 512u << 10 | 512u << 20;

// One page; exposure 2, so that forgetting it shows.
Pack pageOf(uint32_t width, uint32_t height) {
    PackData data;
    data.exposure = 2;
    data.page_count = 1;
    data.page_width = width;
    data.page_height = height;
    data.base_pages.resize(size_t{width} * height);
    auto pack = Pack::fromData(std::move(data));
    if (!pack) throw std::runtime_error(pack.error().message);
    return *pack;
}

TEST(SampleLightmap, TheSurfacesOwnNormalGetsTheStoredIrradianceExactly) {
    const Pack pack = pageOf(1, 1);
    test::Random random(1);
    for (uint32_t r10 = 0; r10 < 1024; r10 += 3) {
        for (int i = 0; i < 100; ++i) {
            const uint32_t irradiance = test::randomIrradiance(random, 1);
            const uint32_t direction = r10 | (test::randomDirection(random) & 0x3ffffc00);
            const auto e =
                sampleLightmap(pack, std::array{irradiance}, std::array{direction}, 0, {0.5f, 0.5f}, {0, 0, 1});
            const auto [r, g, b] = decodeR11G11B10(irradiance);
            ASSERT_EQ(e, (std::array{r / 2, g / 2, b / 2})) << r10;
        }
    }
}

TEST(SampleLightmap, FollowsTheHighlightModel) {
    const Pack pack = pageOf(1, 1);
    // r = 0.2 (204.6, so 205/1023); d_x = 0.75, so b_x = (1-r) d_x / d_z = 0.907 (46.4 steps, so 46).
    const uint32_t direction = 205u | (512u + 46u) << 10 | 512u << 20;
    const double r = 205.0 / 1023, b_x = 46 * 5.0 / 256;
    const uint32_t irradiance = encodeR11G11B10(8, 4, 2);
    for (double degrees = -90; degrees <= 90; degrees += 5) {
        const double n_x = std::sin(degrees * M_PI / 180), n_z = std::cos(degrees * M_PI / 180);
        const double expected = r + std::max(0.0, n_x * b_x + (1 - r) * n_z);
        const auto e = sampleLightmap(pack, std::array{irradiance}, std::array{direction}, 0, {0.5f, 0.5f},
                                      {static_cast<float>(n_x), 0, static_cast<float>(n_z)});
        EXPECT_NEAR(e[0], 4 * expected, 1e-5);
        EXPECT_NEAR(e[1], 2 * expected, 1e-5);
        EXPECT_NEAR(e[2], 1 * expected, 1e-5);
    }
}

TEST(SampleLightmap, TheLinearModelClampsTheSumAndNotTheHighlightAlone) {
    PackData data = pageOf(1, 1).data();
    data.direction_model = DirectionModel::Linear;
    data.color_format = ColorFormat::E5B9G9R9;
    const Pack pack = *Pack::fromData(std::move(data));
    // As above; (8, 4, 2) with the exponent field of 8: 256 steps of 2^-5.
    const uint32_t direction = 205u | (512u + 46u) << 10 | 512u << 20;
    const uint32_t irradiance = 256u | 128u << 9 | 64u << 18 | 19u << 27;
    const double r = 205.0 / 1023, b_x = 46 * 5.0 / 256;
    for (double degrees = -90; degrees <= 90; degrees += 5) {
        const double n_x = std::sin(degrees * M_PI / 180), n_z = std::cos(degrees * M_PI / 180);
        const double expected = std::max(0.0, r + n_x * b_x + (1 - r) * n_z);
        const auto e = sampleLightmap(pack, std::array{irradiance}, std::array{direction}, 0, {0.5f, 0.5f},
                                      {static_cast<float>(n_x), 0, static_cast<float>(n_z)});
        EXPECT_NEAR(e[0], 4 * expected, 1e-5);
        EXPECT_NEAR(e[1], 2 * expected, 1e-5);
        EXPECT_NEAR(e[2], 1 * expected, 1e-5);
    }
}

TEST(SampleLightmap, InterpolatesBetweenTexelCentresAndClampsAtEdges) {
    const Pack pack = pageOf(4, 2);
    std::vector<uint32_t> irradiance, direction(8, no_direction);
    for (uint32_t i = 0; i < 8; ++i) irradiance.push_back(encodeR11G11B10(static_cast<float>(1 << i), 0, 0));
    auto at = [&](double x, double y) {  // in texels
        return sampleLightmap(pack, irradiance, direction, 0, {static_cast<float>(x / 4), static_cast<float>(y / 2)},
                              {0, 0, 1})[0] *
               2;
    };
    for (uint32_t i = 0; i < 8; ++i) EXPECT_FLOAT_EQ(at(i % 4 + 0.5, i / 4 + 0.5), static_cast<float>(1 << i));
    EXPECT_FLOAT_EQ(at(1, 0.5), 1.5f);  // between 1 and 2
    EXPECT_FLOAT_EQ(at(0.5, 1), (1 + 16) / 2.0f);
    EXPECT_FLOAT_EQ(at(1.75, 1.25), 0.25f * (0.75f * 2 + 0.25f * 4) + 0.75f * (0.75f * 32 + 0.25f * 64));
    EXPECT_FLOAT_EQ(at(0, 0), 1);
    EXPECT_FLOAT_EQ(at(-3, 9), 16);
    EXPECT_FLOAT_EQ(at(4, 2), 128);
    EXPECT_FLOAT_EQ(at(99, 0), 8);
}

TEST(SampleLightmap, ATexelWithoutDirectionPullsItsNeighbourTowardsNone) {
    const Pack pack = pageOf(2, 1);
    const uint32_t irradiance = encodeR11G11B10(2, 2, 2);
    // r = 0, b_x = 0.75 (38.4 steps, so 38), and none: halfway r = 0.5 and half of b.
    const std::array direction{0u | (512u + 38u) << 10 | 512u << 20, no_direction};
    const double r = 0.5, b_x = 19 * 5.0 / 256;
    const double n_x = 0.6, n_z = 0.8;
    const auto e =
        sampleLightmap(pack, std::array{irradiance, irradiance}, direction, 0, {0.5f, 0.5f}, {0.6f, 0, 0.8f});
    EXPECT_NEAR(e[0], r + n_x * b_x + (1 - r) * n_z, 1e-5);
}

// Those of another pack: black rather than what stands behind them in memory.
TEST(SampleLightmap, PagesOfFewerTexelsAreDark) {
    const Pack pack = pageOf(4, 2);
    const std::vector<uint32_t> irradiance(8, encodeR11G11B10(2, 2, 2)), direction(8, no_direction);
    const auto at = [&](size_t irradiance_texels, size_t direction_texels) {
        return sampleLightmap(pack, std::span(irradiance).first(irradiance_texels),
                              std::span(direction).first(direction_texels), 0, {0.5f, 0.5f}, {0, 0, 1})[0];
    };
    EXPECT_EQ(at(8, 8), 1);
    EXPECT_EQ(at(7, 8), 0);
    EXPECT_EQ(at(8, 7), 0);
    EXPECT_EQ(at(0, 0), 0);
}

TEST(SampleLightmap, AnUnknownPageIsDark) {
    const Pack pack = pageOf(1, 1);
    const std::array texel{encodeR11G11B10(1, 1, 1)}, direction{no_direction};
    EXPECT_THAT(sampleLightmap(pack, texel, direction, 1, {0.5f, 0.5f}, {0, 0, 1}), testing::Each(0.0f));
}

}  // namespace
}  // namespace dimmer
