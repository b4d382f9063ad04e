// Doors in the bake: terms of light groups over open and closed doors, against scenes that leave the doors out.
#include <bake/baked_scene.h>
#include <bake/reference.h>
#include <bake/test_scenes.h>
#include <pipeline/reference_state.h>
#include <scene/open_pose.h>

#include <cmath>

namespace dimmer::cook::test {
namespace {

// The light of a state: terms weighted by what they need. Bit d of `open`: door d; bit s of `sets`: set s.
glm::dvec3 inState(const BakedScene& b, size_t receiver, uint32_t open, uint32_t sets) {
    glm::dvec3 sum(0);
    for (const ReceiverLight& l : b.baked.light.row(receiver)) {
        const Term& t = b.baked.terms[l.term];
        bool on = t.group == always_group || (sets >> (t.group - 1) & 1);
        for (uint32_t d : t.doors_open) on &= open >> d & 1;
        for (uint32_t d : t.doors_closed) on &= !(open >> d & 1);
        if (on) sum += glm::dvec3(l.light.irradiance_lux);
    }
    return sum;
}

// Sums of baked light and reference over every `step`-th texel of the walls, in one state.
struct Compared {
    double baked = 0, reference = 0, noise = 0;  // lux; standard error of the sum
    double absolute = 0;                         // sum of |baked - reference|
};
Compared compare(const BakedScene& b, const Scene& level, uint32_t open, uint32_t sets, size_t points, uint32_t paths,
                 auto&& at) {
    ReferenceState state{{}, {}};
    for (uint32_t d = 0; d < level.doors.size(); ++d) state.door_open.push_back(open >> d & 1);
    const Scene stands = sceneInState(level, state);
    const RayScene rays(stands);
    ReferenceOptions options{.seed = 7, .set_weights = {}};
    for (uint32_t s = 0; s < level.light_sets.size(); ++s) options.set_weights.emplace_back(sets >> s & 1);
    const ReferenceTracer tracer(rays, options);
    std::vector<size_t> walls;
    for (size_t i = 0; i < b.texels.size(); ++i)
        if (b.meshOf(i) == "wall" && at(b.place(i))) walls.push_back(i);
    Compared out;
    double variance = 0;
    for (size_t k = 0; k < points; ++k) {
        const size_t i = walls[k * walls.size() / points];
        // Averaged over the texel's own points, as the bake is.
        double reference = 0;
        const uint32_t n = b.texels.sampleCount(i);
        for (uint32_t p = 0; p < n; ++p) {
            const auto v = tracer.irradiance({b.position(i, p), b.normal(i)}, paths / n);
            reference += static_cast<double>(v.irradiance_lux.y) / n;
            variance += std::pow(static_cast<double>(v.standard_error_lux.y) / n, 2);
        }
        const double baked = inState(b, i, open, sets).y;
        out.baked += baked;
        out.reference += reference;
        out.absolute += std::abs(baked - reference);
    }
    out.noise = std::sqrt(variance);
    return out;
}

constexpr auto everywhere = [](glm::vec3) { return true; };

BakeSettings exact() {
    return {.series_rays = 512, .final_rays = 1024, .emitter_samples = 8, .tail_max = 1e-4f, .threshold = 0};
}

// Every one of the 32 states of three doors and two sets, every term kept, against the path tracer in a scene where
// open doors are gone.
TEST(Doors, EveryStateIsExactWithAllTermsKept) {
    Scene scene = corridorWithDoors();
    scene.combinations = {{{true, 0}, {true, 1}, {true, 2}}};
    BakedScene b(scene);
    b.bake(exact());
    double worst = 0, absolute = 0;
    for (uint32_t open = 0; open < 8; ++open)
        for (uint32_t sets = 0; sets < 4; ++sets) {
            const Compared c = compare(b, scene, open, sets, 40, 768, everywhere);
            // Four standard deviations of the reference's noise, and 2 % for the texels' size and the baker's own.
            EXPECT_LE(std::abs(c.baked - c.reference), 4 * c.noise + 0.02 * c.reference) << open << " " << sets;
            worst = std::max(worst, std::abs(c.baked / c.reference - 1));
            absolute += c.absolute / c.reference / 32;
        }
    printf("32 states: worst sum off by %.2f %%, mean absolute difference %.2f %%\n", 100 * worst, 100 * absolute);
}

// Without combinations, with all doors closed and with any one open, the light of a state is all there.
TEST(Doors, OneOpenDoorIsExactWhereTheOthersAreClosed) {
    const Scene scene = corridorWithDoors();
    BakedScene b(scene);
    b.bake(exact());
    for (uint32_t open : {0u, 1u, 2u, 4u})
        for (uint32_t sets : {0u, 3u}) {
            const Compared c = compare(b, scene, open, sets, 40, 768, everywhere);
            // As in EveryStateIsExactWithAllTermsKept. Without what asks how a second door stands it is 6 to 13 % off.
            EXPECT_LE(std::abs(c.baked - c.reference), 4 * c.noise + 0.02 * c.reference) << open << " " << sets;
            printf("doors %u, sets %u: off by %.2f %%\n", open, sets, 100 * (c.baked / c.reference - 1));
        }
}

// A leaf against another one's back is hidden until that opens, and then it is what there is to see.
TEST(Doors, ALeafBehindALeafReflectsOnceTheFirstIsOpen) {
    Scene scene;
    const uint32_t white = addMaterial(scene, lambert(0.6f));
    addBox(scene, {2, 1, 1}, white);
    scene.doors = {{"front", false}, {"back", false}};
    for (uint32_t d = 0; d < 2; ++d)
        addSolid(scene, "leaf", {0.25f + 0.5f * static_cast<float>(d), 0, 0}, {0.25f, 1, 1}, white, d);
    scene.light_sets = {{"lamp", 1}};
    addPointLight(scene, {-1, 0.2f, 0.1f}, 100, BakeMode::Indirect).light_set = 0;
    BakedScene b(scene);
    b.bake(exact());
    const auto before_both = [](glm::vec3 p) { return p.x < -0.05f; };
    for (uint32_t open : {0u, 1u}) {
        const Compared c = compare(b, scene, open, 1, 40, 2048, before_both);
        EXPECT_NEAR(c.baked / c.reference, 1, 0.02 + 4 * c.noise / c.reference) << open;
        printf("door %u: off by %.2f %%\n", open, 100 * (c.baked / c.reference - 1));
    }
}

// One leaf that closes a corridor at x = -1 and, open, stands across it at x = 1: light reaches the middle alone.
Scene slidingDoor() {
    Scene scene;
    const uint32_t white = addMaterial(scene, lambert(0.6f)), leaf = addMaterial(scene, lambert(0.8f));
    addBox(scene, {3, 1, 1}, white);
    scene.doors = {{"slides", true}};
    addSolid(scene, "leaf", {-1, 0, 0}, {0.1f, 1, 1}, leaf, 0);
    for (SceneMesh& mesh : scene.meshes)
        if (mesh.door) mesh.open_from_closed[3] = {2, 0, 0, 1};
    scene.light_sets = {{"lamp", 1}};
    addPointLight(scene, {-2.2f, 0.2f, 0.1f}, 100, BakeMode::Indirect).light_set = 0;
    return scene;
}

TEST(Doors, AnOpenPoseBlocksAndReflects) {
    const Scene closed = slidingDoor();
    Scene both = closed;
    addOpenLeaves(both);
    BakedScene b(both);
    b.bake(exact());
    const auto room = [](float from, float to) { return [=](glm::vec3 p) { return p.x > from && p.x < to; }; };
    const auto left = room(-3, -1.15f), middle = room(-0.85f, 0.85f), right = room(1.15f, 3);
    for (uint32_t open : {0u, 1u}) {
        const Compared near = compare(b, closed, open, 1, 40, 4096, left);
        EXPECT_NEAR(near.baked / near.reference, 1, 0.02 + 4 * near.noise / near.reference) << open;
        // What an open door leaves of the room behind it: nothing at all, as the leaf stands across it.
        EXPECT_EQ(compare(b, closed, open, 1, 40, 8, right).baked, 0) << open;
    }
    const Compared lit = compare(b, closed, 1, 1, 40, 4096, middle), dark = compare(b, closed, 0, 1, 40, 8, middle);
    EXPECT_NEAR(lit.baked / lit.reference, 1, 0.02 + 4 * lit.noise / lit.reference);
    EXPECT_GT(lit.baked, 0);
    EXPECT_EQ(dark.baked, 0);
}

// A wall that a closed leaf covers is lit once the door is open.
TEST(Doors, WhatAnOpeningUncoversIsLit) {
    Scene scene;
    const uint32_t white = addMaterial(scene, lambert(0.6f));
    addBox(scene, {2, 1, 1}, white);
    scene.doors = {{"plug", false}};
    addSolid(scene, "leaf", {1.5f, 0, 0}, {0.5f, 1, 1}, white, 0);
    scene.light_sets = {{"lamp", 1}};
    addPointLight(scene, {-1, 0.2f, 0.1f}, 100, BakeMode::Full).light_set = 0;
    BakedScene b(scene);
    b.bake(exact());
    const auto covered = [](glm::vec3 p) { return p.x > 1.05f; };
    const Compared open = compare(b, scene, 1, 1, 40, 2048, covered), closed = compare(b, scene, 0, 1, 40, 8, covered);
    EXPECT_NEAR(open.baked / open.reference, 1, 0.02 + 4 * open.noise / open.reference);
    EXPECT_EQ(closed.baked, 0);
}

// Naming a pair splits the light of one open door into more and fainter terms, each with a threshold of its own. Where
// the first of them has records, nothing of the others is lost: it is as bright there as in a bake that keeps them all.
TEST(Doors, FaintTermsOfANamedPairCountForTheOneThatAsksForLess) {
    Scene scene = corridorWithDoors();
    scene.combinations = {{{true, 0}, {true, 1}}, {{true, 1}, {true, 2}}};
    BakedScene kept(scene), cut(scene);
    BakeSettings settings{.series_rays = 128, .final_rays = 128, .emitter_samples = 2, .threshold = 0.3f};
    cut.bake(settings);
    settings.threshold = 0;
    kept.bake(settings);
    constexpr uint32_t set = 1;
    const auto ofFirstDoor = [](const BakedScene& b, size_t texel, bool alone) {
        double lux = 0;
        for (const ReceiverLight& l : b.baked.light.row(texel)) {
            const Term& t = b.baked.terms[l.term];
            if (t.group == set && t.doors_open == std::vector{0u} && (t.doors_closed.empty() || !alone))
                lux += static_cast<double>(l.light.irradiance_lux.y);
        }
        return lux;
    };
    double all = 0, named = 0, parts = 0;
    for (size_t i = 0; i < cut.texels.size(); ++i) {
        if (ofFirstDoor(cut, i, true) == 0) continue;
        all += ofFirstDoor(kept, i, false);
        named += ofFirstDoor(cut, i, false);
        for (const ReceiverLight& l : kept.baked.light.row(i)) {
            const Term& t = kept.baked.terms[l.term];
            const auto row = cut.baked.light.row(i);
            const bool lost = std::ranges::find(row, l.term, &ReceiverLight::term) == row.end();
            if (lost && t.group == set && t.doors_open == std::vector{0u})
                parts += static_cast<double>(l.light.irradiance_lux.y);
        }
    }
    printf("%.4f of the light is there, %.4f of it faint terms'\n", named / all, parts / all);
    // The rays are the same; the series lets go what lies below a tenth of 1 % of the thresholds' bases.
    EXPECT_NEAR(named / all, 1, 0.005);
    EXPECT_GT(parts / all, 0.02);  // there is something to lose
}

// A bright room, and one of the same size behind a doorway that the lamps of both sets light by a little of their
// bounces.
Scene brightAndDark() {
    Scene scene;
    const uint32_t white = addMaterial(scene, lambert(0.6f));
    addBox(scene, {4, 1.25f, 2}, white);
    const auto block = [&](glm::vec3 low, glm::vec3 high, std::optional<uint32_t> door = {}) {
        addSolid(scene, door ? "leaf" : "partition", 0.5f * (low + high), 0.5f * (high - low), white, door);
    };
    block({-0.1f, -1.25f, -2}, {0.1f, 1.25f, -0.25f});
    block({-0.1f, -1.25f, 0.25f}, {0.1f, 1.25f, 2});
    block({-0.1f, -0.65f, -0.25f}, {0.1f, 1.25f, 0.25f});
    scene.doors = {{"door", false}};
    block({-0.05f, -1.25f, -0.25f}, {0.05f, -0.65f, 0.25f}, 0);
    scene.light_sets = {{"near", 1}, {"far", 1}};
    addPointLight(scene, {-1.5f, 0.6f, 1.2f}, 100, BakeMode::Indirect).light_set = 0;
    addPointLight(scene, {-3.5f, 0.4f, -1.5f}, 100, BakeMode::Indirect).light_set = 1;
    return scene;
}

// What the thresholds leave of the light that a door lets into a dark room, each light set alone: against the path
// tracer. Records that end at the set's own threshold lose much more of it.
TEST(Doors, FaintLightThroughADoorIsKeptWhereItIsAllThereIs) {
    const Scene scene = brightAndDark();
    const auto dark = [](glm::vec3 p) { return p.x > 0.15f; };
    BakedScene kept(scene), cut(scene);
    BakeSettings settings{.series_rays = 64, .final_rays = 256, .emitter_samples = 0};
    kept.bake(settings);
    settings.door_share = 1;
    cut.bake(settings);
    const auto flux = [&](const BakedScene& b, uint32_t set) {
        double sum = 0;
        for (size_t i = 0; i < b.texels.size(); ++i)
            if (dark(b.place(i))) sum += inState(b, i, 1, set).y * static_cast<double>(b.texels.area_m2[i]);
        return sum;
    };
    for (const uint32_t set : {1u, 2u}) {
        const Compared c = compare(kept, scene, 1, set, 120, 2048, dark);
        const double error = c.baked / c.reference - 1, noise = c.noise / c.reference,
                     lost = 1 - flux(cut, set) / flux(kept, set);
        printf("set %u: sum off by %+.2f %% +- %.2f %%; ending with the set loses %.1f %%\n", set, 100 * error,
               100 * noise, 100 * lost);
        // 3 % for what lies below the thresholds, 2 % for the texels' size and the baker's own noise.
        EXPECT_NEAR(error, 0, 0.05 + 4 * noise) << set;
        EXPECT_GT(lost, 0.15) << set;
    }
    for (size_t t = 0; t < kept.baked.terms.size(); ++t) {
        if (kept.baked.terms[t].free()) continue;
        const float least = kept.baked.reports[t].threshold_lux, most = cut.baked.reports[t].threshold_lux;
        EXPECT_LE(least, most) << t;
        EXPECT_GE(least, 0.199f * most) << t;
    }
}

// Faint light that changes slowly is active in one piece: no texel without it among four that have it, none with it
// among four that do not. By each texel's own few rays alone 4 % are one or the other.
TEST(Doors, FaintLightIsActiveInOnePiece) {
    const Scene scene = brightAndDark();
    BakedScene b(scene);
    b.bake({.series_rays = 32, .final_rays = 32, .emitter_samples = 0});
    size_t with = 0, odd = 0;
    for (uint32_t t = 0; t < b.baked.terms.size(); ++t) {
        if (b.baked.terms[t].doors_open.empty()) continue;
        const auto has = [&](size_t i) {
            return std::ranges::find(b.baked.light.row(i), t, &ReceiverLight::term) != b.baked.light.row(i).end();
        };
        for (size_t i = 0; i < b.texels.size(); ++i) {
            size_t neighbours = 0, having = 0;
            for (const auto& [dx, dy] : {std::pair(-1, 0), {1, 0}, {0, -1}, {0, 1}})
                if (const uint32_t n = neighbourInChart(b.charts, b.texels, i, dx, dy); n != no_index)
                    ++neighbours, having += has(n);
            with += has(i);
            odd += neighbours == 4 && (has(i) ? having == 0 : having == 4);
        }
    }
    printf("%zu of %zu texels are odd\n", odd, with);
    ASSERT_GT(with, 1000u);
    EXPECT_LE(odd, with / 200);
}

}  // namespace
}  // namespace dimmer::cook::test
