// What thresholds are shares of, where light is spread over many magnitudes.
#include <bake/baked_scene.h>
#include <bake/reference.h>
#include <bake/spread.h>
#include <bake/test_scenes.h>
#include <pipeline/reference_state.h>

namespace dimmer::cook::test {
namespace {

TEST(Spread, SumsWhatLiesFarAboveTheMedian) {
    Spread even, odd, dark;
    for (int i = 0; i < 90; ++i) even.add(3), odd.add(3), dark.add(0);
    for (int i = 0; i < 10; ++i) even.add(50), odd.add(4000), dark.add(1);
    EXPECT_EQ(even.sumAbove(20), 0);
    EXPECT_EQ(odd.sumAbove(20), 10 * (4000 - 20 * 3));
    EXPECT_EQ(dark.sumAbove(20), 0) << "of a median of 0 everything is far above";
    EXPECT_EQ(Spread().sumAbove(20), 0);
    even += odd;
    EXPECT_EQ(even.sumAbove(20), 10 * (4000 - 20 * 3));
}

// A room of 8 x 3 x 8 m under a lamp, a closed box that shines: the surfaces of its inside are none, or there.
float thresholdUnder(bool double_sided) {
    Scene scene;
    addBox(scene, {4, 1.5f, 4}, addMaterial(scene, lambert(0.6f)));
    Material glow = emissive(glm::vec3(2000), 0.6f);
    glow.double_sided = double_sided;
    scene.light_sets.push_back({"lamp", 1});
    const size_t first = scene.meshes.size();
    addSolid(scene, "casing", {0, 1.2f, 0}, {0.5f, 0.05f, 0.25f}, addMaterial(scene, glow));
    for (size_t i = first; i < scene.meshes.size(); ++i) scene.meshes[i].light_set = 0;
    BakedScene level(scene);
    level.bake({.series_rays = 64, .final_rays = 64});
    return level.baked.reports[1].threshold_lux;
}

// Inside, each of the casing's walls sees nothing but 2000 cd/m2: pi * 2000 * 0.6 / 0.4 lux of bounces where the room
// has some ten. A fiftieth of the receivers, they made the mean ten times the room's, and what is faint in it black.
// Counted for 20 medians at most, they add 0.4 of one; the room's own light, which is the same, differs by noise.
TEST(Activity, TheInsideOfACasingIsNoMeasureOfALamp) {
    const float open = thresholdUnder(false), closed = thresholdUnder(true);
    printf("thresholds: %.4g lux, and %.4g with an inside\n", static_cast<double>(open), static_cast<double>(closed));
    EXPECT_GT(closed, 0.7f * open);
    EXPECT_LT(closed, 2 * open);
}

// A corridor of 16 m behind a door that fills it, and a wall that shines at its mouth: at the far end there is little
// of what the door lets in beside what is there at the door, and nothing else.
TEST(Activity, AlwaysOnLightThroughADoorIsKeptWhereItIsDark) {
    Scene scene;
    const uint32_t white = addMaterial(scene, lambert(0.4f));
    addBox(scene, {8, 1.25f, 2}, white);
    addQuad(scene, "panel", {-7.99f, 0, 0}, {0, 1.25f, 0}, {0, 0, 2}, addMaterial(scene, emissive(glm::vec3(1000))));
    scene.doors = {{"door", false}};
    addSolid(scene, "leaf", {-7, 0, 0}, {0.05f, 1.25f, 2}, white, 0);
    BakedScene level(scene);
    BakeSettings settings{.series_rays = 64, .final_rays = 256};
    settings.threshold = 0.03f;
    level.bake(settings);
    const auto inState = [&](size_t receiver) {
        double lux = 0;
        for (const ReceiverLight& l : level.baked.light.row(receiver))
            if (level.baked.terms[l.term].doors_closed.empty()) lux += static_cast<double>(l.light.irradiance_lux.y);
        return lux;
    };
    const Scene open = sceneInState(scene, ReferenceState{.set_weights = {}, .door_open = {true}});
    const RayScene rays(open);
    const ReferenceTracer tracer(rays, {.seed = 3, .set_weights = {}});
    size_t far = 0, black = 0;
    double baked = 0, reference = 0;
    for (size_t i = 0; i < level.texels.size(); ++i) {
        if (level.meshOf(i) != "wall" || level.place(i).x < 4) continue;
        black += inState(i) == 0;
        if (far++ % 16 > 0) continue;
        baked += inState(i);
        reference += static_cast<double>(tracer.irradiance({level.place(i), level.normal(i)}, 512).irradiance_lux.y);
    }
    printf("%zu of %zu texels are black; %.1f lux in the mean, and %.1f are right\n", black, far,
           16 * baked / static_cast<double>(far), 16 * reference / static_cast<double>(far));
    ASSERT_GT(far, 500u);
    EXPECT_LE(black, far / 100);
    EXPECT_NEAR(baked / reference, 1, 0.06);  // noise of 60 points of 512 paths, and of one point for a texel
}

}  // namespace
}  // namespace dimmer::cook::test
