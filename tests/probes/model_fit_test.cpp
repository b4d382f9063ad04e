// Models' probes fitted to their surface, against light that is known.
#include <bake/sampling.h>
#include <encode/encode_probe.h>
#include <gtest/gtest.h>
#include <probes/envelope.h>
#include <probes/model_fit.h>
#include <probes/spherical_harmonics.h>

#include <cmath>

namespace dimmer::cook::test {
namespace {

constexpr glm::uvec3 cube(2);

// Of a model of 2 x 2 x 2 probes, the corners of a unit cube, on all normals.
std::vector<ModelPlace> placesInCube(uint32_t count) {
    std::vector<ModelPlace> places;
    for (uint32_t i = 0; i < count; ++i) {
        const glm::vec3 at = sequence3d(i, 1), n = uniformSphereDirection(sequence2d(i, 2));
        ModelPlace place{.point = {at}, .near = {}, .transfer = normalTransfer({n.x, n.y, n.z})};
        for (uint32_t k = 0; k < 8; ++k) {
            place.near.number[k] = k;
            place.near.share[k] = (k & 1 ? at.x : 1 - at.x) * (k & 2 ? at.y : 1 - at.y) * (k & 4 ? at.z : 1 - at.z);
        }
        places.push_back(place);
    }
    return places;
}

glm::vec3 read(const ModelPlace& place, std::span<const ProbeLight> probes) {
    glm::vec3 lux(0);
    for (size_t k = 0; k < 8; ++k)
        for (size_t c = 0; c < sh_count; ++c)
            lux += place.near.share[k] * place.transfer.coefficients[c] * probes[place.near.number[k]].radiance[c];
    return lux;
}

// A lone lamp far away, `turn` around y, as harmonics have it.
ProbeLight lamp(float turn, float cd_m2) {
    ProbeLight light;
    light.add(glm::vec3(cd_m2, cd_m2, 2 * cd_m2), ProbeLight::weightsOf({std::cos(turn), 0, std::sin(turn)}));
    return light;
}

TEST(ModelFit, FindsTheProbesThatMadeTheLight) {
    // Mostly even, so that no normal is near to a negative irradiance.
    std::vector<ProbeLight> made, probes;
    for (uint32_t i = 0; i < 8; ++i) {
        made.push_back(lamp(static_cast<float>(i), 1.0f + static_cast<float>(i % 3)));
        made.back().radiance[0] += glm::vec3(3);
        probes.push_back(made.back() * 0.9f);  // what was gathered there is somewhat off
        probes.back().radiance[3] += 0.2f;
    }
    const auto places = placesInCube(400);
    std::vector<glm::vec3> lux;
    for (const ModelPlace& p : places) lux.push_back(read(p, made));
    const auto meanError = [&] {
        double error = 0;
        for (size_t i = 0; i < places.size(); ++i)
            for (int c = 0; c < 3; ++c)
                error += static_cast<double>(std::abs(read(places[i], probes)[c] - lux[i][c]) / lux[i][c]) / 3;
        return error / static_cast<double>(places.size());
    };
    const double before = meanError();
    fitModel(places, lux, probes, cube);
    // What was gathered still has a tenth of a say, spread over what the places know little of.
    EXPECT_GT(before, 0.05);
    EXPECT_LT(meanError(), before / 10);
}

// Light from a half of the sky that no three bands can have without a negative lobe: cut off at 0 and nothing behind.
TEST(ModelFit, NoNormalGetsNegativeLightAndDeringingTakesNothing) {
    const auto places = placesInCube(400);
    std::vector<glm::vec3> lux;
    for (size_t i = 0; i < places.size(); ++i) {
        const glm::vec3 n = uniformSphereDirection(sequence2d(static_cast<uint32_t>(i), 2));
        lux.emplace_back(100 * std::max(n.y, 0.0f) + 1);
    }
    ProbeLight gathered;
    gathered.add(glm::vec3(100), ProbeLight::weightsOf({0, 1, 0}));
    ASSERT_LT(positiveShare(gathered), 0.9f);
    std::vector<ProbeLight> probes(8, gathered), flat(8, flattened(gathered, 0.95f * positiveShare(gathered)));
    fitModel(places, lux, probes, cube);
    double fitted = 0, deringed = 0;
    for (ProbeLight& p : probes) {
        // Normals lie some 18 degrees apart: between two of them a lobe falls by less than the 5 % that it keeps.
        EXPECT_GT(positiveShare(p), 0.97f);
        p = flattened(p, positiveShare(p));
    }
    for (size_t i = 0; i < places.size(); ++i) {
        const auto square = [&](std::span<const ProbeLight> p) {
            const float error = read(places[i], p).x - lux[i].x;
            return static_cast<double>(error * error / (std::max(read(places[i], flat).x, 0.0f) + 2.5f));
        };
        fitted += square(probes);
        deringed += square(flat);
    }
    // The least of what keeps 5 % of its mean on every normal, of which what is flattened is one.
    EXPECT_LT(fitted, deringed);
}

// Places that ask for half of the probes leave the others as they were gathered.
TEST(ModelFit, WhatNoPlaceAsksForStaysAsGathered) {
    auto places = placesInCube(200);
    std::vector<glm::vec3> lux;
    for (ModelPlace& p : places) {
        for (size_t k = 4; k < 8; ++k) p.near.share[k - 4] += p.near.share[k], p.near.share[k] = 0;
        lux.emplace_back(7);
    }
    ProbeLight even;
    even.radiance[0] = glm::vec3(1);
    std::vector<ProbeLight> probes(8, even);
    fitModel(places, lux, probes, cube);
    for (size_t i = 4; i < 8; ++i)
        for (size_t c = 0; c < sh_count; ++c) EXPECT_NEAR(probes[i].radiance[c].x, even.radiance[c].x, 1e-5f);
    // The others are lit by 7 lux, but for the tenth that 0.89 lux as gathered has in what a probe is asked for.
    for (size_t i = 0; i < 4; ++i) EXPECT_NEAR(probes[i].irradiance().x, 7, 0.2 * (7 - 0.886));
}

// Probes A and B, and places that read A alone, B alone, or half of each, where the halves ask for more than the others
// together: the least squares have A and B miss theirs as the inverses of the weights, which are 1 / (light as gathered
// + a tenth of its mean).
TEST(ModelFit, DarkPlacesCountForMore) {
    auto places = placesInCube(600);
    constexpr float dark = 1, bright = 100;
    std::vector<glm::vec3> lux;
    for (size_t i = 0; i < places.size(); ++i) {
        places[i].near.share = {};
        places[i].near.share[0] = i % 3 == 0 ? 1.0f : i % 3 == 1 ? 0.0f : 0.5f;
        places[i].near.share[1] = 1 - places[i].near.share[0];
        lux.emplace_back(i % 3 == 0 ? dark : i % 3 == 1 ? bright : 1.5f * (dark + bright));
    }
    std::vector<ProbeLight> probes(8);
    const float dc_per_lux = 1 / (ProbeLight{{glm::vec3(1)}}.irradiance().x);
    probes[0].radiance[0] = glm::vec3(dark * dc_per_lux);
    probes[1].radiance[0] = glm::vec3(bright * dc_per_lux);
    fitModel(places, lux, probes, cube);
    const double floor = 0.1 * (double{dark} + bright) / 2;
    const double expected = (dark + floor) / (bright + floor);
    const double a = static_cast<double>(probes[0].irradiance().x - dark);
    const double b = static_cast<double>(probes[1].irradiance().x - bright);
    EXPECT_GT(a, 0.1);
    // What was gathered has at most a tenth of the mean of all 72 numbers' say, of which two probes' 18 have all: a
    // fortieth of it is A's, and B's weight is a seventeenth.
    EXPECT_NEAR(a / b, expected, 0.15 * expected);
}

TEST(ModelFit, WhereAllIsDarkProbesStay) {
    const auto places = placesInCube(100);
    const std::vector<glm::vec3> dark(places.size(), glm::vec3(0));
    std::vector<ProbeLight> probes(8, lamp(1, 2));
    fitModel(places, dark, probes, cube);
    for (const ProbeLight& p : probes) EXPECT_EQ(p.radiance, lamp(1, 2).radiance);
}

// One channel dark, all probes dark: nothing to weigh by, and no division by it.
TEST(ModelFit, DarkProbesAndChannelsGiveFiniteLight) {
    const auto places = placesInCube(60);  // fewer than there are unknowns
    std::vector<glm::vec3> lux(places.size(), glm::vec3(0));
    for (size_t i = 0; i < lux.size(); i += 2) lux[i] = glm::vec3(5, 0, 1e-30f);
    std::vector<ProbeLight> probes(8);
    fitModel(places, lux, probes, cube);
    float most = 0;
    for (const ProbeLight& p : probes)
        for (const glm::vec3& c : p.radiance) {
            EXPECT_TRUE(std::isfinite(c.x) && std::isfinite(c.z));
            EXPECT_EQ(c.y, 0);
            most = std::max(most, c.x);
        }
    EXPECT_GT(most, 0.1f);
}

// Light from above, from below and from all around, with lobes that are cut off at other normals: each channel is
// fitted as it would be by itself, whatever the one before it was like.
TEST(ModelFit, ChannelsDoNotMix) {
    const auto places = placesInCube(400);
    std::array<std::vector<float>, 3> lights;
    for (size_t i = 0; i < places.size(); ++i) {
        const glm::vec3 n = uniformSphereDirection(sequence2d(static_cast<uint32_t>(i), 2));
        lights[0].push_back(100 * std::max(n.y, 0.0f) + 1);
        lights[1].push_back(100 * std::max(-n.y, 0.0f) + 1);
        lights[2].push_back(40 + 10 * n.x);
    }
    ProbeLight gathered;
    gathered.radiance[0] = glm::vec3(30);
    const auto fittedAs = [&](std::array<size_t, 3> order) {
        std::vector<glm::vec3> lux(places.size());
        for (size_t i = 0; i < places.size(); ++i)
            lux[i] = {lights[order[0]][i], lights[order[1]][i], lights[order[2]][i]};
        std::vector<ProbeLight> probes(8, gathered);
        fitModel(places, lux, probes, cube);
        return probes;
    };
    // All channels alike: each begins with its own light's negative normals.
    std::array<std::vector<ProbeLight>, 3> alone;
    for (size_t l = 0; l < 3; ++l) alone[l] = fittedAs({l, l, l});
    for (const auto& order : {std::array<size_t, 3>{0, 1, 2}, {1, 0, 2}, {2, 0, 1}, {2, 1, 0}}) {
        const auto together = fittedAs(order);
        for (int channel = 0; channel < 3; ++channel)
            for (size_t p = 0; p < 8; ++p)
                for (size_t c = 0; c < sh_count; ++c) {
                    // Newton's last step gained less than 1e-6 of the sum of 8 probes: of one's, where it has the
                    // least weight, a tenth, sqrt(1e-6 * 8 / 0.1) = 0.9 %.
                    const size_t l = order[static_cast<size_t>(channel)];
                    EXPECT_NEAR(together[p].radiance[c][channel], alone[l][p].radiance[c].x,
                                0.01f * alone[l][p].radiance[0].x)
                        << l << " as channel " << channel << ": " << p << ", " << c;
                }
    }
}

// Places in a lattice whose longest axis is x, and the same with x and z exchanged.
TEST(ModelFit, AxesMayBeLongInAnyOrder) {
    constexpr glm::uvec3 lattice(5, 2, 3);
    constexpr uint32_t count = lattice.x * lattice.y * lattice.z;
    const auto fittedProbes = [&](bool exchanged) {
        const glm::uvec3 size = exchanged ? glm::uvec3(lattice.z, lattice.y, lattice.x) : lattice;
        const auto numberOf = [&](glm::uvec3 at) {
            if (exchanged) std::swap(at.x, at.z);
            return at.x + size.x * (at.y + size.y * at.z);
        };
        auto places = placesInCube(16 * count);
        std::vector<glm::vec3> lux;
        for (uint32_t i = 0; i < places.size(); ++i) {
            const glm::vec3 at = sequence3d(i, 3) * glm::vec3(lattice - 1u),
                            n = uniformSphereDirection(sequence2d(i, 2));
            const glm::uvec3 cell(at);
            const glm::vec3 in = at - glm::vec3(cell);
            for (uint32_t k = 0; k < 8; ++k) {
                const glm::uvec3 corner(k & 1, k >> 1 & 1, k >> 2);
                const glm::vec3 share = glm::mix(1.0f - in, in, glm::vec3(corner));
                places[i].near.number[k] = numberOf(cell + corner);
                places[i].near.share[k] = share.x * share.y * share.z;
            }
            lux.emplace_back((100 + 20 * at.x) * std::max(n.y, 0.0f) + at.z + 1);
        }
        std::vector<ProbeLight> probes(count, lamp(1, 20)), in_order;
        fitModel(places, lux, probes, size);
        for (uint32_t p = 0; p < count; ++p)
            in_order.push_back(
                probes[numberOf({p % lattice.x, p / lattice.x % lattice.y, p / (lattice.x * lattice.y)})]);
        return in_order;
    };
    const auto one = fittedProbes(false), other = fittedProbes(true);
    const float scale = one[0].radiance[0].x;
    EXPECT_GT(scale, 10);
    EXPECT_GT(one[count - 1].radiance[0].x, 1.3f * scale);  // it does grow along x
    // Sums in another order round otherwise, in floats of probes.
    for (uint32_t p = 0; p < count; ++p)
        for (size_t c = 0; c < sh_count; ++c)
            EXPECT_NEAR(one[p].radiance[c].x, other[p].radiance[c].x, 1e-5f * scale) << p << ", " << c;
}

// Dominated by its diagonal, with a known x; each block goes another way past its own.
TEST(EnvelopeMatrix, SolvesWhatItWasMultipliedWith) {
    constexpr size_t blocks = 7, n = blocks * EnvelopeMatrix::block;
    const std::vector<size_t> last{2, 1, 4, 3, 4, 6, 6};
    EnvelopeMatrix matrix(last);
    ASSERT_EQ(matrix.size(), n);
    std::vector<std::vector<double>> dense(n, std::vector<double>(n));
    for (size_t i = 0; i < n; ++i)
        for (size_t j = i; j < (last[i / EnvelopeMatrix::block] + 1) * EnvelopeMatrix::block; ++j) {
            const double entry = i == j ? 40 : std::sin(static_cast<double>(7 * i + 3 * j));
            matrix.at(i, j) = dense[i][j] = dense[j][i] = entry;
        }
    std::vector<double> x(n), product(n), expected(n);
    for (size_t i = 0; i < n; ++i) x[i] = std::cos(static_cast<double>(i));
    for (size_t i = 0; i < n; ++i)
        for (size_t j = 0; j < n; ++j) expected[i] += dense[i][j] * x[j];
    matrix.multiply(x, product);
    for (size_t i = 0; i < n; ++i) EXPECT_NEAR(product[i], expected[i], 1e-12);
    matrix.factor();
    matrix.solve(expected);
    for (size_t i = 0; i < n; ++i) EXPECT_NEAR(expected[i], x[i], 1e-12);
}

}  // namespace
}  // namespace dimmer::cook::test
