// Light at points, from probes whose light is known.
#include <dimmer/probe_grid.h>
#include <format/probe.h>
#include <gtest/gtest.h>
#include <probes/resample.h>
#include <probes/spherical_harmonics.h>
#include <probes/tetrahedra.h>
#include <probes/tetrahedron_walk.h>
#include <runtime/random_pack.h>

#include <cmath>
#include <numbers>

namespace dimmer::test {
namespace {

using Vec3 = std::array<float, 3>;
constexpr float pi = std::numbers::pi_v<float>;

Vec3 randomDirection3(Random& random) {
    const float z = uniform(random, -1, 1), angle = uniform(random, 0, 2 * pi), r = std::sqrt(1 - z * z);
    return {r * std::cos(angle), r * std::sin(angle), z};
}

// Products of two harmonics over a fine grid of directions: they are orthonormal.
TEST(SphericalHarmonics, AreOrthonormal) {
    std::array<std::array<double, 9>, 9> sums = {};
    constexpr int rows = 400, columns = 800;
    for (int i = 0; i < rows; ++i)
        for (int j = 0; j < columns; ++j) {
            const double z = 2 * (i + 0.5) / rows - 1, angle = 2 * std::numbers::pi * (j + 0.5) / columns;
            const double r = std::sqrt(1 - z * z), solid_angle = 4 * std::numbers::pi / (rows * columns);
            const auto y = sphericalHarmonics({static_cast<float>(r * std::cos(angle)),
                                               static_cast<float>(r * std::sin(angle)), static_cast<float>(z)});
            for (size_t a = 0; a < 9; ++a)
                for (size_t b = 0; b < 9; ++b) sums[a][b] += double{y[a]} * double{y[b]} * solid_angle;
        }
    // The midpoint rule errs by h^2 / 24 (f'(1) - f'(-1)), 2 pi around: of Y_20^2, with h = 2 / 400, 3e-5.
    for (size_t a = 0; a < 9; ++a)
        for (size_t b = 0; b < 9; ++b) EXPECT_NEAR(sums[a][b], a == b ? 1 : 0, 1e-4);
}

// L even over all directions: E = pi L on every normal.
TEST(Irradiance, OfEvenRadianceIsPiTimesIt) {
    Radiance radiance;
    radiance.coefficients[0] = {2 * std::sqrt(4 * pi), 3 * std::sqrt(4 * pi), 0};
    Random random(1);
    for (int i = 0; i < 50; ++i) {
        const auto e = irradiance(radiance, randomDirection3(random));
        EXPECT_NEAR(e[0], 2 * pi, 1e-5);
        EXPECT_NEAR(e[1], 3 * pi, 1e-5);
        EXPECT_EQ(e[2], 0);
    }
}

// L(d) = (1 + d.a)^2 has no bands above 2, so irradiance from them is exact: integrate it by brute force.
TEST(Irradiance, OfQuadraticRadianceIsExact) {
    const Vec3 a = {0.3f, -0.5f, 0.4f};
    constexpr int rows = 400, columns = 800;
    Radiance radiance;
    const std::array<Vec3, 3> normals = {{{0, 1, 0}, {0.6f, 0, 0.8f}, {-0.48f, -0.6f, -0.64f}}};
    std::array<double, 3> exact = {};
    for (int i = 0; i < rows; ++i)
        for (int j = 0; j < columns; ++j) {
            const double z = 2 * (i + 0.5) / rows - 1, angle = 2 * std::numbers::pi * (j + 0.5) / columns;
            const double r = std::sqrt(1 - z * z);
            const Vec3 d = {static_cast<float>(r * std::cos(angle)), static_cast<float>(r * std::sin(angle)),
                            static_cast<float>(z)};
            const float dot = d[0] * a[0] + d[1] * a[1] + d[2] * a[2];
            const float l = (1 + dot) * (1 + dot) * 4 * pi / (rows * columns);
            const auto y = sphericalHarmonics(d);
            for (size_t k = 0; k < 9; ++k) radiance.coefficients[k][0] += l * y[k];
            for (size_t n = 0; n < 3; ++n)
                exact[n] += l * std::max(0.0f, d[0] * normals[n][0] + d[1] * normals[n][1] + d[2] * normals[n][2]);
        }
    // 320,000 additions in 32-bit floats.
    for (size_t n = 0; n < 3; ++n) EXPECT_NEAR(irradiance(radiance, normals[n])[0], exact[n], 2e-3 * exact[n]);
}

// Probes with light from above alone, brighter with x; positions on a jittered lattice.
struct Grid {
    PackData data;
    std::vector<uint32_t> words;
};

constexpr uint32_t side = 6;

// Even light of 1 + x from everywhere: what interpolation must reproduce exactly, but for the 9 bits of the format.
Grid gradientGrid() {
    Random random(2);
    Grid g;
    g.data = emptyPack(1, 0);
    g.data.contributions.clear();
    g.data.color_format = ColorFormat::E5B9G9R9;
    g.data.exposure = 1.0f / 4;
    g.data.page_count = g.data.page_width = g.data.page_height = 1;
    g.data.base_pages.resize(1);
    std::vector<glm::vec3> points;
    for (uint32_t i = 0; i < side * side * side; ++i)
        points.push_back(glm::vec3(i % side, i / side % side, i / side / side) +
                         0.2f * glm::vec3(uniform(random, -1, 1), uniform(random, -1, 1), uniform(random, -1, 1)));
    GlobalGrid& grid = g.data.probes.global;
    grid = cook::tetrahedralise(points, {glm::vec3(0), glm::vec3(side - 1)}).value();
    for (const ProbePosition& p : grid.positions) {
        const float l00 = (1 + p.x_m + 2) * std::sqrt(4 * pi) * g.data.exposure;  // 2: positive at the box's corners
        const ProbeRecord probe{.light = encodeE5B9G9R9(l00, 0, 0), .bands = {}};
        g.data.probes.base.push_back(probe);
        g.words.push_back(probe.light);
        g.words.insert(g.words.end(), 6, 0);
    }
    return g;
}

TEST(GridSampler, ReproducesALinearGradient) {
    const Grid g = gradientGrid();
    const auto pack = Pack::fromData(g.data);
    ASSERT_TRUE(pack) << pack.error().message;
    const GridSampler sampler(*pack, g.words);
    Random random(3);
    GridHint hint;
    for (int i = 0; i < 1000; ++i) {
        const Vec3 p = {uniform(random, 0, side - 1), uniform(random, 0, side - 1), uniform(random, 0, side - 1)};
        const float expected = (1 + p[0] + 2) * pi;
        // Each probe is rounded to 9 bits, at worst 1/512 of it; the walk's tolerance is far below that.
        EXPECT_NEAR(sampler.sample(p, randomDirection3(random), i % 2 ? &hint : nullptr)[0], expected, expected / 500);
    }
}

// Outside the box: the light of its nearest point.
TEST(GridSampler, OutsideTakesTheNearestPointOfTheBox) {
    const Grid g = gradientGrid();
    const auto pack = Pack::fromData(g.data);
    ASSERT_TRUE(pack);
    const GridSampler sampler(*pack, g.words);
    const StartGrid& box = g.data.probes.global.start;
    EXPECT_EQ(sampler.sample({100, 2, 2}, {0, 1, 0}), sampler.sample({box.max_m[0], 2, 2}, {0, 1, 0}));
    EXPECT_EQ(sampler.sample({-7, 2, 90}, {0, 1, 0}), sampler.sample({box.min_m[0], 2, box.max_m[2]}, {0, 1, 0}));
}

// Those of another pack: black rather than what stands behind them in memory.
TEST(GridSampler, ProbesThatAreNotThereAreBlack) {
    const Grid g = gradientGrid();
    const auto pack = Pack::fromData(g.data);
    ASSERT_TRUE(pack);
    const auto count = static_cast<uint32_t>(g.data.probes.base.size());
    const auto all = std::span<const uint32_t>(g.words), fewer = all.first(all.size() - 1);
    EXPECT_GT(GridSampler(*pack, all).sample({2, 2, 2}, {0, 1, 0})[0], 1);
    EXPECT_EQ(GridSampler(*pack, fewer).sample({2, 2, 2}, {0, 1, 0})[0], 0);
    EXPECT_EQ(GridSampler(*pack, {}).radiance({2, 2, 2}).coefficients[0][0], 0);
    const auto lux = [&](std::span<const uint32_t> words, const ModelSlot& slot) {
        return GridSampler(*pack, words).sample(slot, {2, 2, 2}, {0, 1, 0})[0];
    };
    const ModelSlot last{count - 8, {2, 2, 2}, {}};
    EXPECT_GT(lux(all, last), 1);
    EXPECT_EQ(lux(fewer, last), 0);
    EXPECT_EQ(lux(all, {count - 7, {2, 2, 2}, {}}), 0);
    EXPECT_EQ(lux(all, {UINT32_MAX, {2, 2, 2}, {}}), 0);
    EXPECT_EQ(lux(all, {0, {1u << 31, 1u << 31, 4}, {}}), 0);  // as many as make 0 of 64 bits
    EXPECT_EQ(lux(all, {}), 0);
}

// A plane through a tetrahedron hides a probe's light from what lies beyond it, and the rest make up for it.
TEST(GridSampler, WhatAProbeDoesNotSeeItDoesNotLight) {
    Grid g = gradientGrid();
    GlobalGrid& grid = g.data.probes.global;
    grid.visibility.assign(grid.tetrahedra.size(), {});
    GridPlace place;
    place.tetrahedron = 5;
    auto& seen = grid.visibility[5].seen;
    for (auto& probe : seen) probe = {127, 127, 127, 127};
    place.barycentric = {0.1f, 0.2f, 0.3f, 0.4f};
    EXPECT_EQ(probeWeights(grid, place), place.barycentric);
    // Probe 1 sees up to where 127 b1 - 127 b3 = 0: not this place, where b3 is larger.
    seen[1] = {0, 127, 0, -127};
    auto weights = probeWeights(grid, place);
    EXPECT_EQ(weights[1], 0);
    EXPECT_NEAR(weights[0], 0.1 / 0.8, 1e-6);
    EXPECT_NEAR(weights[2], 0.3 / 0.8, 1e-6);
    EXPECT_NEAR(weights[3], 0.4 / 0.8, 1e-6);
    // On its own side, further than 1 / visibility_slope from the plane, all of it.
    place.barycentric = {0.1f, 0.4f, 0.3f, 0.2f};
    EXPECT_NEAR(probeWeights(grid, place)[1], 0.4, 1e-6);
    // Seen by none, and hidden alike from all: plain barycentric.
    for (auto& probe : seen) probe = {-127, -127, -127, -127};
    for (size_t v = 0; v < 4; ++v) EXPECT_NEAR(probeWeights(grid, place)[v], place.barycentric[v], 1e-6);
    // On the floor: hidden by a rounding from two probes above it, by the floor's thickness from the others.
    seen[0] = seen[1] = {-1, -1, -1, -1};
    seen[2] = seen[3] = {-20, -20, -20, -20};
    weights = probeWeights(grid, place);
    EXPECT_NEAR(weights[0], 0.1 / 0.5, 1e-6);
    EXPECT_NEAR(weights[1], 0.4 / 0.5, 1e-6);
    EXPECT_EQ(weights[2], 0);
    EXPECT_EQ(weights[3], 0);
    // Of one without a share nothing is asked.
    place.barycentric = {0, 0, 0.3f, 0.7f};
    weights = probeWeights(grid, place);
    EXPECT_NEAR(weights[2], 0.3, 1e-6);
    EXPECT_NEAR(weights[3], 0.7, 1e-6);
}

// What a shader resamples is what radiance() says, within the steps of the format: a 9-bit mantissa, and half of
// 1/127 of the bound on each coefficient; where the two walks end in neighbours, by 1e-4 of a weight more.
TEST(Resample, IsRadianceEncoded) {
    Random random(4);
    Grid g = gradientGrid();
    GlobalGrid& grid = g.data.probes.global;
    for (size_t i = 0; i < grid.positions.size(); ++i)
        for (uint32_t& word : std::span(g.words).subspan(7 * i + 1, 6))
            word = static_cast<uint32_t>(random()) & 0x7f7f7f7fu;  // 0..127, even where no light could be so
    const auto pack = Pack::fromData(g.data);
    ASSERT_TRUE(pack);
    const GridSampler sampler(*pack, g.words);
    uint32_t hint = no_tetrahedron;
    for (int i = 0; i < 500; ++i) {
        const Vec3 p = {uniform(random, 0, side - 1), uniform(random, 0, side - 1), uniform(random, 0, side - 1)};
        const auto exact = sampler.radiance(p);
        const ProbeRecord probe = resampleProbe(g.data, g.words, p, hint);
        const float l00 = decodeE5B9G9R9(probe.light)[0] / g.data.exposure, l = exact.coefficients[0][0];
        EXPECT_NEAR(l00, l, l / 512);
        const auto codes = std::bit_cast<std::array<int8_t, 24>>(probe.bands);
        for (size_t k = 1; k < 9; ++k) {
            const float bound = k < 4 ? std::sqrt(3.0f) : std::sqrt(5.0f);
            EXPECT_NEAR(static_cast<float>(codes[3 * (k - 1)]) / 127 * bound, exact.coefficients[k][0] / l,
                        0.53f / 127 * bound);
        }
    }
}

}  // namespace
}  // namespace dimmer::test
