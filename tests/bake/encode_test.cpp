// The directional models fitted to light whose falloff is known in closed form.
#include <bake/sampling.h>
#include <encode/encode.h>
#include <gtest/gtest.h>

#include <limits>

namespace dimmer::cook {
namespace {

// E(n) / E_z of a fit, in double, from the definition in docs/format.md.
double falloff(const Highlight& h, glm::dvec3 n, DirectionModel model) {
    const double r = h.ambient, highlight = h.bx * n.x + h.by * n.y + (1 - r) * n.z;
    return model == DirectionModel::Ahd ? r + std::max(0.0, highlight) : std::max(0.0, r + highlight);
}

glm::dvec3 direction(double polar_deg, double azimuth_deg) {
    const double p = polar_deg * M_PI / 180, a = azimuth_deg * M_PI / 180;
    return {std::sin(p) * std::cos(a), std::sin(p) * std::sin(a), std::cos(p)};
}

Gathered lamp(double polar_deg, double azimuth_deg, float lux) {
    Gathered light;
    light.add(glm::vec3(lux), Gathered::weightsOf(glm::vec3(direction(polar_deg, azimuth_deg))));
    return light;
}

// The upper hemisphere's constant radiance: a normal tilted by t gets (1 + cos t) / 2.
Gathered overcast(float lux) {
    Gathered light;
    constexpr uint32_t rays = 1u << 16;
    for (uint32_t i = 0; i < rays; ++i)
        light.add(glm::vec3(lux / rays),
                  Gathered::weightsOf(cosineDirection({(static_cast<float>(i) + 0.5f) / rays, radicalInverse(2, i)})));
    return light;
}

TEST(Encode, OneLampFallsOffWithItsCosine) {
    for (const auto model : {DirectionModel::Ahd, DirectionModel::Linear})
        // Up to where the farthest of the fitted normals still sees it.
        for (double polar : {0.0, 20.0, 40.0})
            for (double azimuth : {0.0, 30.0, 45.0, 200.0}) {
                const Highlight fit = fitHighlight(lamp(polar, azimuth, 100), model);
                for (double tilt = 0; tilt <= 60; tilt += 10)
                    for (double around = 0; around < 360; around += 30) {
                        const glm::dvec3 n = direction(tilt, around), d = direction(polar, azimuth);
                        // 1e-4: floats, and a damping of 1e-4 in the fit.
                        EXPECT_NEAR(falloff(fit, n, model), std::max(0.0, glm::dot(n, d)) / d.z, 2e-4)
                            << polar << " " << azimuth << " " << tilt << " " << around;
                    }
            }
}

TEST(Encode, ALampNearTheSurfaceIsClampedInAhdAndOnlyThere) {
    const Highlight fit = fitHighlight(lamp(75, 0, 100), DirectionModel::Ahd);
    for (double tilt = -60; tilt <= 60; tilt += 10) {
        const glm::dvec3 n = direction(tilt, 0), d = direction(75, 0);
        EXPECT_NEAR(falloff(fit, n, DirectionModel::Ahd), std::max(0.0, glm::dot(n, d)) / d.z, 1e-3) << tilt;
    }
}

TEST(Encode, AnOvercastSkyFallsOffWithTheHalfOfTheHemisphere) {
    const Gathered sky = overcast(50);
    EXPECT_NEAR(sky.irradiance_lux.x, 50, 1e-3);
    for (const auto model : {DirectionModel::Ahd, DirectionModel::Linear}) {
        const Highlight fit = fitHighlight(sky, model);
        for (double tilt = 0; tilt <= 60; tilt += 10)
            for (double around = 0; around < 360; around += 45) {
                const glm::dvec3 n = direction(tilt, around);
                // The bound on light along the surface (z_min in gather.cpp) cuts sin(t) z_min / pi, 0.42 %, at the
                // normals that are fitted; the model carries on to twice that at 60 degrees.
                EXPECT_NEAR(falloff(fit, n, model), (1 + n.z) / 2, 0.0088) << tilt;
            }
    }
}

TEST(Encode, IrradianceOnTheOwnNormalIsKeptToTheFormatsRounding) {
    Gathered light = overcast(3);
    light += lamp(50, 100, 2);
    light.irradiance_lux *= glm::vec3(1, 0.5f, 0.25f);
    for (const auto format : {ColorFormat::R11G11B10F, ColorFormat::E5B9G9R9}) {
        const TexelRecord record = encodeTexel(light, {4, format, DirectionModel::Ahd});
        const auto stored = decodeColor(format, record.irradiance);
        // Half a step: of each channel, 1/128 and 1/64; of the largest, 1/512.
        for (size_t c = 0; c < 3; ++c) {
            const float exact = 4 * light.irradiance_lux[static_cast<int>(c)];
            const float half_step =
                format == ColorFormat::R11G11B10F ? exact / (c == 2 ? 64 : 128) : 4 * light.irradiance_lux.x / 512;
            EXPECT_NEAR(stored[c], exact, half_step);
        }
    }
    EXPECT_EQ(encodeTexel({}, {}).direction, direction_none);
}

// The largest power of two at which the sum of all at their largest weights takes half of the format's range, 32256;
// within 2^-40 and 2^40.
TEST(Encode, ExposureLeavesRoomForTheLargestWeights) {
    Baked baked;
    baked.light = Sparse<ReceiverLight>::build(1, [](size_t, size_t, auto emit) {
        const std::vector<ReceiverLight> row = {{.term = 0, .light = overcast(1)}, {.term = 1, .light = overcast(1)}};
        emit(std::span<const ReceiverLight>(row));
    });
    const auto exposure = [&](float first, float second) {
        return chooseExposure(baked, std::vector<float>{first, second});
    };
    EXPECT_EQ(exposure(1, 2), 0x1p13f);  // 3 lux
    EXPECT_EQ(exposure(1, 0), 0x1p14f);  // 1 lux: each is stored as it is at weight 1
    EXPECT_EQ(exposure(1, 1e9f), 0x1p-15f);
    for (const float absurd : {1e30f, 3e38f, std::numeric_limits<float>::max()})
        EXPECT_EQ(exposure(absurd, absurd), 0x1p-40f) << absurd;
}

}  // namespace
}  // namespace dimmer::cook
