// Emissive surfaces as lights of the baker, against form factors.
#include <bake/baked_scene.h>
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

Deviation underAPanel(uint32_t points, const BakeSettings& settings) {
    Scene scene;
    addFloor(scene, 2, addMaterial(scene, lambert(0)));
    addQuad(scene, "panel", {0, 1, 0}, {0.25f, 0, 0}, {0, 0, 0.25f}, addMaterial(scene, emissive(glm::vec3(100))));
    BakedScene b(scene, 4, points);
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
    EXPECT_EQ(count, 256);
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

}  // namespace
}  // namespace dimmer::cook::test
