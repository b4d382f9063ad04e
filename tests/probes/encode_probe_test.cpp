// Probes that are nowhere negative, and what that costs.
#include <bake/sampling.h>
#include <encode/encode_probe.h>
#include <gtest/gtest.h>

#include <cmath>

namespace dimmer::cook {
namespace {

constexpr ProbeEncoding encoding{1, ColorFormat::E5B9G9R9};
constexpr uint32_t normals = 4000;

glm::vec3 direction(uint32_t i, uint32_t seed) {
    return uniformSphereDirection(sequence2d(i, seed));
}

// A few lamps in the open, of different colours: the hardest light for two bands of harmonics.
ProbeLight lamps(uint32_t seed, uint32_t count, float even) {
    ProbeLight light;
    for (uint32_t i = 0; i < count; ++i) {
        const glm::vec3 color(unitFloat(hash(seed, 3 * i)), unitFloat(hash(seed, 3 * i + 1)),
                              unitFloat(hash(seed, 3 * i + 2)));
        light.add(100.0f * color, ProbeLight::weightsOf(direction(i, seed)));
    }
    light.radiance[0] += even;
    return light;
}

float leastBySampling(const ProbeLight& light, int channel) {
    float least = 1e30f;
    for (uint32_t i = 0; i < normals; ++i) least = std::min(least, light.irradiance(direction(i, 99))[channel]);
    return least;
}

// Closed form: a lamp of 1 lux straight above gives 1/4 + cos/2 + 5/32 (3 cos^2 - 1), least at cos = -8/15.
TEST(ProbeEncoding, TheLeastIrradianceOfALampIsKnown) {
    ProbeLight light;
    light.add(glm::vec3(1), ProbeLight::weightsOf({0, 0, 1}));
    const float cos = -8.0f / 15, least = 0.25f + cos / 2 + 5.0f / 32 * (3 * cos * cos - 1);
    EXPECT_NEAR(leastIrradiance(light, 0), least, 1e-5);
    EXPECT_NEAR(light.irradiance({0, 0, 1}).x, 0.25 + 0.5 + 5.0 / 16, 1e-5);
}

TEST(ProbeEncoding, TheLeastIrradianceIsFoundAnywhere) {
    for (uint32_t seed = 1; seed <= 200; ++seed) {
        const ProbeLight light = lamps(seed, 1 + seed % 4, 0);
        for (int channel = 0; channel < 3; ++channel) {
            const float found = leastIrradiance(light, channel), sampled = leastBySampling(light, channel);
            // Samples are 0.04 rad apart: they miss a minimum by a curvature of some 300 lux times 0.04^2 / 2.
            EXPECT_LE(found, sampled + 1e-4f) << seed;
            EXPECT_GE(found, sampled - 0.25f) << seed;
        }
    }
}

TEST(ProbeEncoding, NoNormalGetsNegativeLight) {
    for (uint32_t seed = 1; seed <= 300; ++seed) {
        const ProbeLight light = lamps(seed, 1 + seed % 5, seed % 7 == 0 ? 20.0f : 0.0f);
        const ProbeLight stored = decodeProbe(encodeProbe(light, encoding), encoding);
        // 32-bit sums of some 100 lux.
        for (int channel = 0; channel < 3; ++channel) EXPECT_GE(leastBySampling(stored, channel), -1e-4f) << seed;
    }
}

// Light that a blur of its own keeps positive is stored as it is: half a step of 1/127 for each coefficient.
TEST(ProbeEncoding, LeavesSmoothLightAlone) {
    const ProbeLight light = lamps(5, 3, 400);
    const ProbeLight stored = decodeProbe(encodeProbe(light, encoding), encoding);
    for (uint32_t i = 0; i < 200; ++i) {
        const glm::vec3 n = direction(i, 3), is = stored.irradiance(n), should = light.irradiance(n);
        for (int channel = 0; channel < 3; ++channel) {
            // Three and five coefficients, each off by at most bound / 254, of harmonics whose squares sum to
            // (2l + 1) / 4 pi: at most sqrt(3 * 3 / 4 pi) 2 pi / 3 * sqrt(3) / 254 + sqrt(5 * 5 / 4 pi) pi / 4 *
            // sqrt(5) / 254 = 0.022 of the first coefficient; and 1/512 of the colour.
            EXPECT_NEAR(is[channel], should[channel], 0.022f * light.radiance[0][channel] + should[channel] / 400);
        }
    }
}

// Closed form: of the lamp above, mean / (mean - least).
TEST(ProbeEncoding, ALampKeepsTheShareThatIsPositive) {
    ProbeLight light;
    light.add(glm::vec3(1), ProbeLight::weightsOf({0, 0, 1}));
    const float cos = -8.0f / 15, least = 0.25f + cos / 2 + 5.0f / 32 * (3 * cos * cos - 1);
    EXPECT_NEAR(positiveShare(light), 0.25f / (0.25f - least), 1e-4);
    EXPECT_NEAR(leastIrradiance(flattened(light, positiveShare(light)), 1), 0, 1e-5);
}

TEST(ProbeEncoding, BlackIsBlackAndNoiseBelowZeroIsToo) {
    EXPECT_EQ(encodeProbe({}, encoding).light, 0u);
    ProbeLight noise;
    for (auto& c : noise.radiance) c = glm::vec3(-1, 2, -3);
    const ProbeLight stored = decodeProbe(encodeProbe(noise, encoding), encoding);
    EXPECT_EQ(stored.radiance[0].x, 0);
    EXPECT_GE(leastBySampling(stored, 1), -1e-5f);
}

// What de-ringing costs: irradiance of one lamp and of three against the truth, with the harmonics as they are and as
// stored, over all normals, as a share of the mean. Stated in docs/measurements.md.
TEST(ProbeEncoding, DeringingCostsLittle) {
    for (const uint32_t count : {1u, 3u}) {
        double stored_error = 0, plain_error = 0, mean = 0;
        for (uint32_t seed = 1; seed <= 100; ++seed) {
            ProbeLight light;
            for (uint32_t i = 0; i < count; ++i) light.add(glm::vec3(100), ProbeLight::weightsOf(direction(i, seed)));
            const ProbeLight stored = decodeProbe(encodeProbe(light, encoding), encoding);
            for (uint32_t i = 0; i < 200; ++i) {
                const glm::vec3 n = direction(i, 7);
                double exact = 0;
                for (uint32_t k = 0; k < count; ++k)
                    exact += 100.0 * static_cast<double>(std::max(0.0f, glm::dot(n, direction(k, seed))));
                stored_error += std::abs(static_cast<double>(stored.irradiance(n).x) - exact);
                plain_error += std::abs(static_cast<double>(light.irradiance(n).x) - exact);
                mean += exact;
            }
        }
        printf("%u lamps: error of two bands %.2f %%, de-ringed and stored %.2f %%\n", count, 100 * plain_error / mean,
               100 * stored_error / mean);
        EXPECT_LT(stored_error - plain_error, 0.1 * mean) << count;
    }
}

}  // namespace
}  // namespace dimmer::cook
