// How long the light of a scene is followed.
#include <bake/gathered_level.h>
#include <bake/series.h>
#include <bake/test_scenes.h>

#include <algorithm>

namespace dimmer::cook::test {
namespace {

struct Ball {
    float reflectance, candela;
    double expectedLux(double area_m2) const {
        const double rho = static_cast<double>(reflectance);
        return 4 * pi_d * static_cast<double>(candela) / area_m2 * rho / (1 - rho);
    }
};

// Two hollow spheres that see nothing of each other, each lit from its centre: in one the light is soon gone, in the
// other it stays for long, at an eleventh of the brightness. Indirect = direct x rho / (1 - rho) in both.
TEST(Series, ADimWhiteRoomBesideABrightDarkOne) {
    Scene scene;
    const Ball balls[] = {{0.2f, 20000}, {0.9f, 50}};
    double area_m2 = 0;
    for (const Ball& ball : balls) {
        const auto number = static_cast<float>(&ball - balls);
        area_m2 = addSphere(scene, 2, 32, 16, addMaterial(scene, lambert(ball.reflectance)));
        SceneMesh& mesh = scene.meshes.back();
        for (glm::vec3& p : mesh.positions_m) p.x += 10 * number;
        addPointLight(scene, {10 * number, 0, 0}, ball.candela, BakeMode::Indirect);
    }
    BakedScene b(scene);
    b.bake({.series_rays = 128, .final_rays = 256, .tail_max = 0.01f});
    double sums[2] = {}, areas[2] = {};
    for (size_t i = 0; i < b.texels.size(); ++i) {
        const size_t ball = b.place(i).x > 5;
        const auto texel_m2 = static_cast<double>(b.texels.area_m2[i]);
        sums[ball] += texel_m2 * static_cast<double>(b.lux(i).y);
        areas[ball] += texel_m2;
    }
    for (size_t ball = 0; ball < 2; ++ball) {
        const double expected = balls[ball].expectedLux(area_m2);
        // In the mean over both, 1 % may be still to come: 2 % in one, if the other has all. And 1 % of rays and
        // facets.
        EXPECT_NEAR(sums[ball] / areas[ball], expected, 0.03 * expected) << ball;
        printf("%g of %g lux\n", sums[ball] / areas[ball], expected);
    }
}

// In a sphere lit from its centre, what arrives by bounces is direct x rho / (1 - rho), in each channel: blue goes on
// long after red is gone, and of walls that are nearly white a bounce takes a twentieth.
TEST(Series, EachChannelIsFollowedToItsEnd) {
    for (const glm::vec3 rho : {glm::vec3(0.3f, 0.4f, 0.85f), glm::vec3(0.95f)}) {
        const glm::vec3 candela(1000, 500, 150);
        Scene scene;
        Material coloured = lambert(1);
        coloured.base_color = rho;
        const double area_m2 = addSphere(scene, 2, 32, 16, addMaterial(scene, coloured));
        addPointLight(scene, {0, 0, 0}, 1, BakeMode::Indirect).intensity = candela;
        BakedScene b(scene);
        b.bake({.series_rays = 128, .final_rays = 256, .tail_max = 0.01f});
        glm::dvec3 sum(0);
        double area = 0;
        for (size_t i = 0; i < b.texels.size(); ++i) {
            sum += static_cast<double>(b.texels.area_m2[i]) * glm::dvec3(b.lux(i));
            area += static_cast<double>(b.texels.area_m2[i]);
        }
        for (int c = 0; c < 3; ++c) {
            const double expected = Ball{rho[c], candela[c]}.expectedLux(area_m2);
            // 1 % may be still to come, and 1 % of rays and facets.
            EXPECT_NEAR(sum[c] / area, expected, 0.02 * expected) << rho[c];
        }
    }
}

// A lamp behind a block that leaves slits of 10 cm: what leaves the walls beyond is mostly below the threshold, and
// there a few of them send what all of them would.
TEST(Series, FewReceiversSendTheFaintLightOfAll) {
    Scene scene;
    const uint32_t walls = addMaterial(scene, lambert(0.5f));
    addBox(scene, {4, 1, 1}, walls);
    addSolid(scene, "block", {0, 0, 0}, {0.5f, 0.9f, 0.9f}, walls);
    scene.light_sets = {{"lamp", 1}};
    addPointLight(scene, {3, 0.2f, 0.1f}, 100, BakeMode::Indirect).light_set = 0;
    GatheredLevel level(scene, 16);
    SilentProgress quiet;
    const Series all = expandSeries(level.gatherer, LightGrid(*level.b.rays), {.threshold = 0}, quiet);
    const Series some = expandSeries(level.gatherer, LightGrid(*level.b.rays), {.threshold = 0.01f}, quiet);
    const uint32_t lamp = 1;
    const auto exitance = [&](const SparseLight& radiance, size_t i) {
        const auto row = radiance.row(i);
        const auto found = std::ranges::find(row, lamp, term_of);
        return found == row.end() ? 0.0 : pi_d * static_cast<double>(luminance(found->value()));
    };
    const auto faint = static_cast<double>(some.reports[lamp].threshold_lux);
    double sums[2] = {}, variance = 0;
    size_t counts[2] = {};
    for (size_t i = 0; i < level.gatherer.receiverCount(); ++i) {
        const auto area_m2 = static_cast<double>(level.gatherer.areaM2(i));
        const double whole = exitance(all.radiance, i), sent = exitance(some.radiance, i);
        // Twice rounded by at most 1/128 of itself (TermLight).
        if (whole > 1.05 * faint) {
            EXPECT_NEAR(sent, whole, whole / 50) << i;
        }
        if (whole > 0.95 * faint) continue;
        if (sent > 0) {
            EXPECT_NEAR(sent, faint, faint / 50) << i;
        }
        sums[0] += area_m2 * whole;
        sums[1] += area_m2 * sent;
        counts[0] += whole > 0;
        counts[1] += sent > 0;
        variance += area_m2 * area_m2 * whole * (faint - whole);
    }
    printf("%zu of %zu receivers, %g of %g lm, +- %g\n", counts[1], counts[0], sums[1], sums[0], std::sqrt(variance));
    EXPECT_GT(counts[0], 1000u);
    EXPECT_LT(2 * counts[1], counts[0]);
    // Had each its own chance; taking turns they do better. And 1 % for what the series lets go and rounds.
    EXPECT_NEAR(sums[1], sums[0], 3 * std::sqrt(variance) + 0.01 * sums[0]);
}

// Always-on light is asked for everywhere; where there is none it costs no rays.
TEST(Series, ALevelWithoutAlwaysOnLightTracesNoMoreRays) {
    uint64_t rays[2];
    for (const bool in_set : {false, true}) {
        Scene scene;
        addBox(scene, {1, 1, 1}, addMaterial(scene, lambert(0.5f)));
        scene.light_sets = {{"lamps", 1}};
        PunctualLight& lamp = addPointLight(scene, {0.2f, 0.3f, 0.1f}, 100, BakeMode::Indirect);
        if (in_set) lamp.light_set = 0;
        BakedScene b(scene);
        b.bake({.final_rays = 2048, .noise_max = 0.05f});
        rays[in_set] = b.baked.rays;
    }
    // The same light by the same number of rays; the set's noise is its own.
    EXPECT_NEAR(static_cast<double>(rays[1]), static_cast<double>(rays[0]), 0.05 * static_cast<double>(rays[0]));
}

}  // namespace
}  // namespace dimmer::cook::test
