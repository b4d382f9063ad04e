// How fast followed light comes to its end.
#include <bake/baked_scene.h>
#include <bake/convergence.h>
#include <bake/door_pairs.h>
#include <bake/emitters.h>
#include <bake/test_scenes.h>

#include <cmath>

namespace dimmer::cook::test {
namespace {

// Of x = 1 + eigenvalue * x, what is left of the error after n rounds is T_n(eigenvalue / albedo) / T_n(1 / albedo),
// T_n being Chebyshev's polynomial: no other combination of n bounces leaves less over the whole range.
TEST(Acceleration, ErrorsAreChebyshevs) {
    const glm::vec3 albedo(0.3f, 0.7f, 0.95f);
    const auto polynomial = [](uint32_t n, double x) {
        return std::abs(x) <= 1 ? std::cos(n * std::acos(x))
                                : std::copysign(std::cosh(n * std::acosh(std::abs(x))), n % 2 == 0 ? 1 : x);
    };
    for (int c = 0; c < 3; ++c) {
        const double rho = static_cast<double>(albedo[c]);
        for (const double share : {-1.0, -0.4, 0.0, 0.5, 0.9, 1.0, 1.04}) {
            Acceleration acceleration(albedo);
            const double eigenvalue = share * rho, end = 1 / (1 - eigenvalue);
            double before = 0, x = 0;
            for (uint32_t n = 1; n <= 12; ++n) {
                const double weight = static_cast<double>(acceleration.nextWeight()[c]);
                before = std::exchange(x, before + weight * (1 + eigenvalue * x - before));
                const double expected = polynomial(n, share) / polynomial(n, 1 / rho);
                // Weights are floats, and errors of one round stay in the next ones.
                EXPECT_NEAR((end - x) / end, expected, 1e-5) << rho << " " << share << " round " << n;
            }
        }
        EXPECT_NEAR(static_cast<double>(Acceleration(albedo).ratio()[c]), rho / (1 + std::sqrt(1 - rho * rho)), 1e-6);
    }
}

// Two walls that see nothing but one another, each over six of ten rays: of light that goes to and fro, 0.6 times the
// geometric mean of their albedos is left by a bounce.
TEST(LongRunAlbedo, OfTwoWallsFacingEachOther) {
    Scene scene;
    Material red = lambert(1);
    red.base_color = {0.9f, 0.5f, 0};
    addQuad(scene, "a", {0, 0, 0}, {2, 0, 0}, {0, 2, 0}, addMaterial(scene, lambert(0.4f)));
    addQuad(scene, "b", {0, 0, 1}, {2, 0, 0}, {0, 2, 0}, addMaterial(scene, red));
    const BakedScene b(scene);
    const DoorPaths paths(scene, doorsInSight(*b.rays));
    const EmitterSampler emitters(*b.rays, meshGroups(scene));
    const Gatherer gatherer(*b.rays, b.charts, b.texels, emitters, paths);
    std::vector<uint32_t> walls[2];
    for (uint32_t i = 0; i < b.texels.size(); ++i) walls[b.meshOf(i) == "b"].push_back(i);
    Links::Builder builder(b.texels.size());
    std::vector<Link> row;
    for (uint32_t i = 0; i < b.texels.size(); ++i) {
        const std::vector<uint32_t>& across = walls[b.meshOf(i) != "b"];
        row.clear();
        for (uint32_t ray = 0; ray < 6; ++ray) row.push_back({across[hash(i, ray) % across.size()], free_path});
        builder.put(i, row);
    }
    const glm::vec3 albedo = longRunAlbedo(gatherer, builder.finish(), 10);
    // Exact: all walks between two walls lose alike.
    EXPECT_NEAR(albedo.x, 0.6 * std::sqrt(0.4 * 0.9), 1e-4);
    EXPECT_NEAR(albedo.y, 0.6 * std::sqrt(0.4 * 0.5), 1e-4);
    EXPECT_EQ(albedo.z, 0);
}

TEST(LongRunAlbedo, OfNothingIsNone) {
    Scene scene;
    addQuad(scene, "a", {0, 0, 0}, {2, 0, 0}, {0, 2, 0}, addMaterial(scene, lambert(0.4f)));
    const BakedScene b(scene);
    const DoorPaths paths(scene, doorsInSight(*b.rays));
    const EmitterSampler emitters(*b.rays, meshGroups(scene));
    const Gatherer gatherer(*b.rays, b.charts, b.texels, emitters, paths);
    Links::Builder builder(b.texels.size());
    EXPECT_EQ(longRunAlbedo(gatherer, builder.finish(), 10), glm::vec3(0));
}

// In a closed sphere of albedo 0.8 a bounce leaves 0.8, an accelerated one 0.8 / 1.6 in the long run: for a thousandth
// of the light some 10 rounds in place of 31.
TEST(Acceleration, SavesRounds) {
    Scene scene;
    const double area_m2 = addSphere(scene, 2, 32, 16, addMaterial(scene, lambert(0.8f)));
    addPointLight(scene, {0, 0, 0}, 1000, BakeMode::Indirect);
    BakedScene b(scene);
    b.bake({.series_rays = 128, .final_rays = 256, .tail_max = 0.001f});
    EXPECT_LE(b.baked.bounces, 14u);
    double sum = 0, area = 0;
    for (size_t i = 0; i < b.texels.size(); ++i) {
        sum += static_cast<double>(b.texels.area_m2[i]) * static_cast<double>(b.lux(i).y);
        area += static_cast<double>(b.texels.area_m2[i]);
    }
    const double expected = 4 * pi_d * 1000 / area_m2 * 0.8 / 0.2;
    EXPECT_NEAR(sum / area, expected, 0.01 * expected);  // of rays and facets
}

}  // namespace
}  // namespace dimmer::cook::test
