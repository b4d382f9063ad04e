// Rays towards doors: a density that is one, no bias, less noise.
#include <bake/baked_scene.h>
#include <bake/door_guides.h>
#include <bake/final_gather.h>
#include <bake/sampling.h>
#include <bake/test_scenes.h>

#include <algorithm>

namespace dimmer::cook::test {
namespace {

// A solid between two corners.
void addBlock(Scene& scene, const char* node, glm::vec3 low, glm::vec3 high, uint32_t material,
              std::optional<uint32_t> door = {}) {
    addSolid(scene, node, 0.5f * (low + high), 0.5f * (high - low), material, door);
}

// Two rooms of 8 m x 10 m, a doorway of 0.8 m x 2 m between them, a lamp on the -X side that shines through it onto the
// floor beyond.
Scene doorway() {
    Scene scene;
    const uint32_t white = addMaterial(scene, lambert(0.5f));
    addBox(scene, {8, 1.5f, 5}, white);
    addBlock(scene, "wall_left", {-0.1f, -1.5f, -5}, {0.1f, 1.5f, -0.4f}, white);
    addBlock(scene, "wall_right", {-0.1f, -1.5f, 0.4f}, {0.1f, 1.5f, 5}, white);
    addBlock(scene, "lintel", {-0.1f, 0.5f, -0.4f}, {0.1f, 1.5f, 0.4f}, white);
    scene.doors = {{"door", false}};
    addBlock(scene, "leaf", {-0.03f, -1.5f, -0.4f}, {0.03f, 0.5f, 0.4f}, white, 0);
    scene.light_sets = {{"lamp", 1}};
    addPointLight(scene, {-1.5f, 0.8f, 0.2f}, 100, BakeMode::Indirect).light_set = 0;
    return scene;
}

// The mean of 1 / pdf over samples is the solid angle that the boxes fill: each direction once, whatever the mixture.
// Against counting uniform directions that enter a box.
TEST(DoorGuides, DensityIsThatOfTheSamples) {
    const std::vector<GuideBox> boxes = {
        {{1, -1, -0.5f}, {1.1f, 1, 0.5f}, 0}, {{1.5f, -1, -1}, {3, -0.9f, 0}, 2}, {{-1, -1, 1}, {0.5f, 0.5f, 1.1f}, 1}};
    const Guide guide(boxes, {0.2f, -0.3f, 0.1f}, {0, 1, 0});
    ASSERT_FALSE(guide.empty());
    constexpr uint32_t n = 1 << 18;
    double inverse = 0, inside = 0;
    for (uint32_t i = 0; i < n; ++i) {
        const float density = guide.pdf(guide.sample(unitFloat(hash(i, 5)), sequence2d(i, 3)));
        ASSERT_GT(density, 0) << i;
        inverse += 1 / static_cast<double>(density) / n;
        const glm::vec3 any = uniformSphereDirection(sequence2d(i, 9));
        inside += (guide.pdf(any) > 0) * 4 * std::numbers::pi / n;
    }
    // The count's own error: sqrt(p (1 - p) / n) of 4 pi is below 0.1 % of it for p above 0.1, less with this sequence.
    EXPECT_NEAR(inverse / inside, 1, 0.005);
}

// The same terms at the same receivers, gathered with rays at the door and without, over many seeds.
TEST(DoorGuides, AreUnbiasedAndLessNoisyAtEqualRays) {
    BakedScene b(doorway());
    const DoorPaths paths(b.scene);
    const EmitterSampler emitters(*b.rays, meshGroups(b.scene));
    const Gatherer gatherer(*b.rays, b.charts, b.texels, emitters, paths);
    SilentProgress silent;
    const Series series = expandSeries(gatherer, {.series_rays = 128, .final_rays = 0, .threshold = 0}, silent);
    const uint32_t through = paths.term(1, paths.with(free_path, 1));
    const std::vector<float> floors(paths.termCount());

    constexpr uint32_t seeds = 96, aimed_rounds = 8;
    // 36 rays a round with those at the door, 32 without.
    static_assert(aimed_rounds * (rays_per_round + aimed_rays) == 9 * rays_per_round);
    FinalGather<Gathered> gather(gatherer);
    double total[2] = {}, variance[2] = {}, relative[2] = {}, log_gain = 0, bias_variance = 0;
    size_t receivers = 0;
    for (size_t i = 0; i < b.texels.size(); i += 11) {
        if (b.place(i).x < 0.15f || b.meshOf(i) != "wall") continue;
        // Receivers that see the door: the opening's middle is in sight.
        if (!(glm::dot(glm::vec3(0, -0.5f, 0) - b.place(i), b.normal(i)) > 0.1f)) continue;
        ++receivers;
        double here[2];
        for (const bool aim : {false, true}) {
            double sum = 0, squares = 0;
            for (uint32_t seed = 0; seed < seeds; ++seed) {
                std::vector<ReceiverLight> row;
                gather.gather(gatherer.at(i), {&through, 1}, series.radiance,
                              {.rays_max = (aim ? aimed_rounds : 9) * rays_per_round,
                               .emitter_samples = 0,
                               .seed = 1000 + seed,
                               .aim_at_doors = aim,
                               .floor_lux = floors},
                              row);
                const auto lux = static_cast<double>(luminance(row[0].light.irradiance_lux));
                sum += lux / seeds;
                squares += lux * lux / seeds;
            }
            total[aim] += sum;
            here[aim] = squares - sum * sum;
            variance[aim] += here[aim];
            relative[aim] += here[aim] / (sum * sum);
            bias_variance += here[aim] / seeds;
        }
        log_gain += std::log(here[0] / here[1]);
    }
    ASSERT_GT(receivers, 100u);
    const auto n = static_cast<double>(receivers);
    printf(
        "%zu receivers: %.4g lux without aim, %.4g with; variance lower by %.1f (sum), %.1f (relative), %.1f (mean)\n",
        receivers, total[0] / n, total[1] / n, variance[0] / variance[1], relative[0] / relative[1],
        std::exp(log_gain / n));
    EXPECT_NEAR(total[1], total[0], 4 * std::sqrt(bias_variance));
    // 4 standard errors are themselves below half a percent of the light, so that a lost path would show.
    EXPECT_LT(4 * std::sqrt(bias_variance), 0.005 * total[0]);
    // Over receivers; by sums the few around the patch count most, which every ray finds (docs/measurements.md).
    EXPECT_GE(std::exp(log_gain / n), 5);
}

}  // namespace
}  // namespace dimmer::cook::test
