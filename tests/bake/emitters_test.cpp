// Emissive surfaces as lights of the baker, against form factors.
#include <bake/baked_scene.h>
#include <bake/emitters.h>
#include <bake/reference.h>
#include <bake/sampling.h>
#include <bake/test_scenes.h>

namespace dimmer::cook::test {
namespace {

// Share of the hemisphere over a floor's point that a square of `half` metres to each side fills, `height` above and
// centred over (0, 0): four rectangles with a corner over the point, those beyond the square's border negative.
double squareAbove(double x, double z, double half, double height) {
    double sum = 0;
    for (const double a : {half - x, half + x})
        for (const double b : {half - z, half + z})
            sum += std::copysign(1.0, a) * std::copysign(1.0, b) * cornerFormFactor(std::abs(a), std::abs(b), height);
    return sum;
}

struct Deviation {
    double mean = 0;  // of found / expected - 1
    double lean = 0;  // the same, counted negative on the -X side: of light that is shifted along X
    double each = 0;  // without sign
};

Deviation underAPanel(uint32_t points, const BakeSettings& settings, float texels_per_metre = 4) {
    Scene scene;
    addFloor(scene, 2, addMaterial(scene, lambert(0)));
    addQuad(scene, "panel", {0, 1, 0}, {0.25f, 0, 0}, {0, 0, 0.25f}, addMaterial(scene, emissive(glm::vec3(100))));
    BakedScene b(scene, texels_per_metre, points);
    b.bake(settings);
    Deviation sum;
    int count = 0;
    for (size_t i = 0; i < b.texels.size(); ++i) {
        if (b.meshOf(i) != "floor") continue;
        const double expected =
            b.mean(i, [](glm::dvec3 p) { return 100 * pi_d * squareAbove(p.x, p.z, 0.25, 1 - p.y); });
        const double d = static_cast<double>(b.lux(i).y) / expected - 1;
        sum.mean += d;
        sum.lean += d * std::copysign(1.0, static_cast<double>(b.place(i).x));
        sum.each += std::abs(d);
        ++count;
    }
    EXPECT_EQ(count, std::pow(4 * texels_per_metre, 2));
    return {sum.mean / count, sum.lean / count, sum.each / count};
}

// Samples by area and by hit together, in the measure of either; 256 texels with 0.25 % of noise each leave 0.02 %.
TEST(BakeEmitters, APanelIsItsFormFactor) {
    const Deviation d = underAPanel(8, {.final_rays = 2048, .emitter_samples = 16});
    EXPECT_NEAR(d.mean, 0, 0.001);
    EXPECT_LT(d.each, 0.005);
}

// With fewer samples per round than points, rounds must take turns at them: always the first four of eight would shift
// the light by 1.5 %. The noise of 1.2 % leaves 0.08 %.
TEST(BakeEmitters, AllPointsOfATexelCount) {
    const Deviation d = underAPanel(8, {.final_rays = 2048, .emitter_samples = 4});
    EXPECT_NEAR(d.lean, 0, 0.0035);
    EXPECT_LT(d.each, 0.02);
}

// No more samples than points, and a texel as large as the panel is high above it: each point must meet each part of
// the panel, or each half of the panel lights its own points alone.
TEST(BakeEmitters, AllPointsMeetAllParts) {
    for (const uint32_t points : {4u, 8u, 16u}) {
        const Deviation d = underAPanel(points, {.final_rays = 16384, .emitter_samples = 4}, 1);
        EXPECT_LT(d.each, 0.01) << points;
    }
}

// Light that falls from a small thing high above a dark floor of 2 x 2 m; mean of |found / expected - 1|.
double deviationBelow(Scene scene, auto&& expected_lux) {
    addFloor(scene, 1, addMaterial(scene, lambert(0)));
    BakedScene b(scene);
    b.bake({.final_rays = 4096, .emitter_samples = 16});
    double sum = 0;
    int count = 0;
    for (size_t i = 0; i < b.texels.size(); ++i) {
        if (b.meshOf(i) != "floor") continue;
        sum += std::abs(static_cast<double>(b.lux(i).y) / b.mean(i, expected_lux) - 1);
        ++count;
    }
    return sum / count;
}

// E = pi L (r / d)^2 cos: what it fills of the hemisphere is its disc, wherever it is all above the horizon. 2,208
// triangles, of which each has less than a thousandth of the light; rays that happen upon it are 14 % off.
TEST(BakeEmitters, ABulbOfManyTrianglesIsASphere) {
    Scene scene;
    constexpr double radius = 0.1, height = 1;
    addSphere(scene, radius, 48, 24, addMaterial(scene, emissive(glm::vec3(100))));
    SceneMesh& bulb = scene.meshes.back();
    for (glm::uvec3& t : bulb.triangles) std::swap(t.y, t.z);
    for (glm::vec3& n : bulb.normals) n = -n;
    for (glm::vec3& p : bulb.positions_m) p.y += static_cast<float>(height);
    const double each = deviationBelow(scene, [](glm::dvec3 p) {
        const double d = glm::length(p - glm::dvec3(0, height, 0));
        return 100 * pi_d * radius * radius * height / (d * d * d);
    });
    // 0.6 % by which its silhouette differs from a circle, and the noise of points all over a sphere: each gives
    // max(0, cos), 1.3 times its mean off; of 2,048 that leaves 2.9 %, 2.3 % in the mean.
    EXPECT_LT(each, 0.03);
}

// Kept for 60 x 60 x 60 m, chances of a thousand emitters would take a gigabyte for each set.
TEST(Emitters, WhatIsNotKeptIsFoundAgainAlike) {
    Scene scene;
    addFloor(scene, 8, addMaterial(scene, lambert(0.5f)));
    scene.light_sets = {{"a", 1}, {"b", 1}};
    for (uint32_t set = 0; set < 2; ++set) {
        addSphere(scene, 0.5, 24, 12, addMaterial(scene, emissive(glm::vec3(100))));
        SceneMesh& bulb = scene.meshes.back();
        bulb.light_set = set;
        for (glm::uvec3& t : bulb.triangles) std::swap(t.y, t.z);
        for (glm::vec3& p : bulb.positions_m) p += glm::vec3(4 * static_cast<float>(set), 3, 0);
    }
    const RayScene rays(scene);
    constexpr size_t few = 5000;
    const EmitterSampler all(rays, meshGroups(scene)), some(rays, meshGroups(scene), few);
    EXPECT_GT(all.keptChoices(), 10 * few);
    EXPECT_LE(all.keptChoices(), kept_choices_max);
    EXPECT_LE(some.keptChoices(), few);
    for (uint32_t i = 0; i < 3000; ++i) {
        const glm::vec2 u = sequence2d(i, 5);
        const glm::vec3 place(16 * u.x - 8, 0.001f, 16 * u.y - 8);
        const uint32_t cell = all.cellAt(place);
        const auto kept = all.groups(cell), found = some.groups(cell);
        ASSERT_EQ(kept.size(), found.size());
        for (size_t g = 0; g < kept.size(); ++g) {
            const float choice = unitFloat(hash(i, 1));
            const EmitterSample a = all.sample(kept[g], place, choice, u), b = some.sample(found[g], place, choice, u);
            ASSERT_EQ(a.triangle, b.triangle);
            ASSERT_EQ(a.pdf, b.pdf);
            if (!(a.pdf > 0)) continue;
            const Emitter& e = *all.emitterOf(a.triangle);
            ASSERT_EQ(all.pdf(cell, e, a.distance_m, 0.5f),
                      some.pdf(cell, *some.emitterOf(a.triangle), a.distance_m, 0.5f));
        }
    }
}

// Two bulbs of 2,208 triangles, one set: 4 m below the one, the other, 30 m off, has a 430th of its light, and half of
// each looks away. When chances were by power alone, a quarter of the samples met what shines there.
TEST(Emitters, OfThousandsThoseThatShineHereAreChosen) {
    Scene scene;
    constexpr double radius = 0.1, height = 4, apart = 30;
    addFloor(scene, 31, addMaterial(scene, lambert(0)));
    const uint32_t glow = addMaterial(scene, emissive(glm::vec3(100)));
    for (const float x : {0.0f, static_cast<float>(apart)}) {
        addSphere(scene, radius, 48, 24, glow);
        SceneMesh& bulb = scene.meshes.back();
        for (glm::uvec3& t : bulb.triangles) std::swap(t.y, t.z);
        for (glm::vec3& p : bulb.positions_m) p += glm::vec3(x, height, 0);
    }
    const RayScene rays(scene);
    const EmitterSampler emitters(rays, meshGroups(scene));
    ASSERT_GT(emitters.emitters().size(), 4000u);
    const glm::vec3 place(0.1f, 0.001f, 0.1f);
    const uint32_t cell = emitters.cellAt(place);
    ASSERT_EQ(emitters.groups(cell).size(), 1u);
    constexpr uint32_t samples = 20000;
    uint32_t met = 0;
    double sum = 0, squares = 0;
    for (uint32_t i = 0; i < samples; ++i) {
        const float choice = (static_cast<float>(i) + 0.5f) / samples;
        const EmitterSample s = emitters.sample(emitters.groups(cell)[0], place, choice, sequence2d(i, 7));
        if (!(s.pdf > 0)) continue;
        const Emitter* e = emitters.emitterOf(s.triangle);
        ASSERT_NE(e, nullptr);
        const float cos_emitter = -glm::dot(s.direction, e->normal);
        // As rays that hit it weigh themselves.
        ASSERT_NEAR(emitters.pdf(cell, *e, s.distance_m, cos_emitter), s.pdf, 1e-4f * s.pdf);
        met += glm::distance(s.direction, glm::normalize(glm::vec3(0, height, 0) - place)) < 0.2f;
        const double lux = static_cast<double>(s.radiance_cd_m2.y * std::max(0.0f, s.direction.y) / s.pdf);
        sum += lux, squares += lux * lux;
    }
    EXPECT_GT(met, 0.7 * samples);
    double expected = 0;
    for (const double x : {0.0, apart}) {
        const double d = glm::length(glm::dvec3(x, height, 0) - glm::dvec3(place));
        expected += 100 * pi_d * radius * radius * (height - 0.001) / (d * d * d);
    }
    const double mean = sum / samples, error = std::sqrt((squares / samples - mean * mean) / samples);
    EXPECT_NEAR(mean, expected, 4 * error + 0.006 * expected);  // its silhouette is no circle by 0.6 %
}

// A lamp's glowing disc over a yard: a millionth of the hemisphere, and all the light that there is.
TEST(BakeEmitters, ASmallThingFarAwayIsNotLeftToChance) {
    Scene scene;
    constexpr double half = 0.02, height = 20;
    const uint32_t glow = addMaterial(scene, emissive(glm::vec3(1e6f)));
    addQuad(scene, "disc", {0, height, 0}, {half, 0, 0}, {0, 0, half}, glow);
    const double each = deviationBelow(scene, [](glm::dvec3 p) {
        const double d = glm::length(p - glm::dvec3(0, height, 0));
        return 1e6 * 4 * half * half * std::pow(height, 2) / std::pow(d, 4);
    });
    EXPECT_LT(each, 0.001);  // seen as a point: the square of its size over its distance, 1e-6
}

// 5 cm of light 10 cm over a floor: all that the ceiling has comes off a texel or two, which must not be left to the
// few samples of one round (with them up to 60 % off). The reference's own noise is below 1 %; what the ceiling's
// texels average to, 2 %.
TEST(BakeEmitters, AGlowBesideAFloorLightsTheCeilingAsItShould) {
    for (const glm::vec2 at : {glm::vec2(0.08f, 0.04f), glm::vec2(0.05f, 0.1f), glm::vec2(0.11f, 0.02f)}) {
        Scene scene;
        addFloor(scene, 2, addMaterial(scene, lambert(0.5f)));
        const uint32_t black = addMaterial(scene, lambert(0));
        addQuad(scene, "ceiling", {0, 2, 0}, {2, 0, 0}, {0, 0, 2}, black);
        addQuad(scene, "glow", {at.x, 0.1f, at.y}, {0.025f, 0, 0}, {0, 0, 0.025f},
                addMaterial(scene, emissive(glm::vec3(40000))));
        BakedScene b(scene, 4, 8);
        b.bake({.series_rays = 64, .final_rays = 1024, .emitter_samples = 4});
        const ReferenceTracer tracer(*b.rays, {});
        double found = 0, expected = 0;
        for (size_t i = 0; i < b.texels.size(); i += 5) {
            if (b.meshOf(i) != "ceiling") continue;
            found += static_cast<double>(b.lux(i).y);
            expected += static_cast<double>(tracer.irradiance({b.place(i), b.normal(i)}, 16384).irradiance_lux.y);
        }
        EXPECT_NEAR(found, expected, 0.12 * expected) << at.x;
    }
}

// 3 mm before a panel, 54 m off: shadow rays that ended a share of the way before it passed the cover. The small panel
// beside it, of the same group, is what makes them ask for the group there: 1000 cd/m2 x 0.01 m2 / (54 m)^2 = 0.0034
// lux.
TEST(Emitters, ThinCoversFarAwayHideThem) {
    constexpr float away_m = 54;
    for (const bool covered : {true, false}) {
        Scene scene;
        const uint32_t black = addMaterial(scene, lambert(0));
        addQuad(scene, "wall", {0, 0, 0}, {0.5f, 0, 0}, {0, 0.5f, 0}, black);
        addQuad(scene, "panel", {0, 0, away_m}, {0, 0.5f, 0}, {0.5f, 0, 0},
                addMaterial(scene, emissive(glm::vec3(1e5f))));
        addQuad(scene, "small", {2, 0, away_m}, {0, 0.05f, 0}, {0.05f, 0, 0},
                addMaterial(scene, emissive(glm::vec3(1e3f))));
        if (covered) addQuad(scene, "cover", {0, 0, away_m - 0.003f}, {0, 0.6f, 0}, {0.6f, 0, 0}, black);
        BakedScene b(scene);
        b.bake({.final_rays = 256, .emitter_samples = 4});
        const ReferenceTracer tracer(*b.rays, {});
        const double open_lux = 1e5 / (double{away_m} * away_m);
        for (size_t i = 0; i < b.texels.size(); ++i) {
            if (b.meshOf(i) != "wall") continue;
            const double baked = static_cast<double>(b.lux(i).y);
            const double traced =
                static_cast<double>(tracer.irradiance({b.place(i), b.normal(i)}, 4096).irradiance_lux.y);
            // Covered: the small panel's, of which few rays find much each. Open: 5 % for a wall's and a panel's width.
            for (const double lux : {baked, traced})
                if (covered)
                    EXPECT_LT(lux, 0.1);
                else
                    EXPECT_NEAR(lux, open_lux, 0.05 * open_lux);
        }
    }
}

}  // namespace
}  // namespace dimmer::cook::test
