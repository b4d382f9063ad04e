// Rays towards doors: a density that is one, no bias, less noise.
#include <bake/baked_scene.h>
#include <bake/door_guides.h>
#include <bake/final_gather.h>
#include <bake/sampling.h>
#include <bake/test_scenes.h>

#include <algorithm>
#include <glm/gtc/matrix_transform.hpp>

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

// Against counting uniform directions that enter a box.
void expectDensityOfSamples(const Guide& guide) {
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

// The mean of 1 / pdf over samples is the solid angle that the boxes fill: each direction once, whatever the mixture,
// how it is turned and how many boxes are leaves'.
TEST(DoorGuides, DensityIsThatOfTheSamples) {
    const std::vector<GuideBox> boxes = {
        {{1, -1, -0.5f}, {1.1f, 1, 0.5f}, 0}, {{1.5f, -1, -1}, {3, -0.9f, 0}, 2}, {{-1, -1, 1}, {0.5f, 0.5f, 1.1f}, 1}};
    for (const uint32_t leaves : {1u, 2u})
        for (const float degrees : {0.0f, 35.0f}) {
            const glm::mat3 turned(glm::rotate(glm::mat4(1), glm::radians(degrees), {0, 0.6f, 0.8f}));
            const Guide guide({turned, leaves, boxes}, turned * glm::vec3(0.2f, -0.3f, 0.1f),
                              turned * glm::vec3(0, 1, 0));
            ASSERT_FALSE(guide.empty());
            expectDensityOfSamples(guide);
        }
}

// The same terms at the same receivers, gathered with rays at the door and without, over many seeds.
// `turned`: the scene, from where doorway() has it. `gain_min`: of the variance, in the mean over receivers.
void expectLessNoise(const Scene& scene, const glm::mat3& turned, double gain_min) {
    BakedScene b(scene);
    const DoorPaths paths(b.scene);
    const EmitterSampler emitters(*b.rays, meshGroups(b.scene));
    const Gatherer gatherer(*b.rays, b.charts, b.texels, emitters, paths);
    SilentProgress silent;
    const Series series =
        expandSeries(gatherer, LightGrid(*b.rays), {.series_rays = 128, .final_rays = 0, .threshold = 0}, silent);
    const uint32_t through = paths.term(1, paths.with(free_path, 1));
    const std::vector<float> floors(paths.termCount());

    constexpr uint32_t seeds = 96, aimed_rounds = 8;
    // 36 rays a round with those at the door, 32 without.
    static_assert(aimed_rounds * (rays_per_round + aimed_rays) == 9 * rays_per_round);
    FinalGather<Gathered> gather(gatherer);
    double total[2] = {}, variance[2] = {}, relative[2] = {}, log_gain = 0, bias_variance = 0;
    size_t receivers = 0;
    for (size_t i = 0; i < b.texels.size(); i += 11) {
        const glm::vec3 place = glm::transpose(turned) * b.place(i), normal = glm::transpose(turned) * b.normal(i);
        if (place.x < 0.15f || b.meshOf(i) != "wall") continue;
        // Receivers that see the door: the opening's middle is in sight.
        if (!(glm::dot(glm::vec3(0, -0.5f, 0) - place, normal) > 0.1f)) continue;
        ++receivers;
        double here[2];
        for (const bool aim : {false, true}) {
            double sum = 0, squares = 0;
            for (uint32_t seed = 0; seed < seeds; ++seed) {
                std::vector<ReceiverLight> row;
                std::vector<SamplePoint> points;
                gather.gather(gatherer.at(i, points), {&through, 1}, series.radiance,
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
    EXPECT_GE(std::exp(log_gain / n), gain_min);
}

TEST(DoorGuides, AreUnbiasedAndLessNoisyAtEqualRays) {
    expectLessNoise(doorway(), glm::mat3(1), 5);
}

// In a building that stands askew a box along the world's axes would be mostly wall.
TEST(DoorGuides, AreAsGoodWhereADoorStandsAskew) {
    Scene scene = doorway();
    const glm::mat3 turned(glm::rotate(glm::mat4(1), glm::radians(40.0f), {0, 1, 0}));
    for (SceneMesh& mesh : scene.meshes) {
        for (glm::vec3& p : mesh.positions_m) p = turned * p;
        for (glm::vec3& n : mesh.normals) n = turned * n;
    }
    for (PunctualLight& light : scene.lights) light.position_m = turned * light.position_m;
    expectLessNoise(scene, turned, 5);
}

// A leaf of the same name hangs in another wall, and takes its share of the rays; a box around both would hold the
// receivers, and no ray would be aimed at all.
TEST(DoorGuides, LookAtEachPlaceOfADoor) {
    Scene scene = doorway();
    addBlock(scene, "leaf", {7, -1.5f, 4.9f}, {7.8f, 0.5f, 4.96f}, 0, 0);
    expectLessNoise(scene, glm::mat3(1), 3);
}

// A black room of 2 m x 2 m x 2 m whose ceiling has a hatch of 0.8 m x 1 m. Above it the sky, or a panel that hides it.
constexpr float hatch_x_m = 0.4f, hatch_z_m = 0.5f;
Scene hatch(bool panel) {
    Scene scene;
    const uint32_t black = addMaterial(scene, lambert(0));
    addFloor(scene, 1, black, -1);
    for (const float side : {-1.0f, 1.0f}) {
        addQuad(scene, "wall", {side, 0, 0}, {0, 0, side}, {0, 1, 0}, black);
        addQuad(scene, "wall", {0, 0, side}, {-side, 0, 0}, {0, 1, 0}, black);
        const float half_x = (1 - hatch_x_m) / 2, half_z = (1 - hatch_z_m) / 2;
        addQuad(scene, "ceiling", {side * (1 - half_x), 1, 0}, {half_x, 0, 0}, {0, 0, 1}, black);
        addQuad(scene, "ceiling", {0, 1, side * (1 - half_z)}, {hatch_x_m, 0, 0}, {0, 0, half_z}, black);
    }
    scene.doors = {{"hatch", false}};
    addQuad(scene, "leaf", {0, 1, 0}, {hatch_x_m, 0, 0}, {0, 0, hatch_z_m}, black).door = 0;
    scene.light_sets = {{"panel", 1}};
    if (panel) {
        const uint32_t glow = addMaterial(scene, emissive(glm::vec3(1)));
        addQuad(scene, "panel", {0, 1.001f, 0}, {1, 0, 0}, {0, 0, 1}, glow).light_set = 0;
    } else {
        scene.sky_radiance_cd_m2 = glm::vec3(1);
    }
    return scene;
}

// Rays that look for doors alone, beside few others: what comes straight through the hatch has a closed form, whether
// rays find it alone (the sky) or together with samples of the emitter.
TEST(DoorRays, FindWhatAnOpeningShowsWithLessNoise) {
    for (const bool panel : {false, true}) {
        BakedScene b(hatch(panel), 12);
        const DoorPaths paths(b.scene);
        const EmitterSampler emitters(*b.rays, meshGroups(b.scene));
        const Gatherer gatherer(*b.rays, b.charts, b.texels, emitters, paths);
        const uint32_t through = paths.term(panel ? 1 : always_group, paths.with(free_path, 1));
        double mean[2] = {}, variance[2] = {};
        size_t count = 0;
        for (size_t i = 0; i < b.texels.size(); ++i) {
            if (b.meshOf(i) != "floor") continue;
            // Four corners of the hatch, of which the point lies below the middle or beside it.
            const double expected = pi_d * b.mean(i, [](glm::dvec3 p) {
                double sum = 0;
                for (const double sx : {-1.0, 1.0})
                    for (const double sz : {-1.0, 1.0}) {
                        const double x = static_cast<double>(hatch_x_m) + sx * p.x,
                                     z = static_cast<double>(hatch_z_m) + sz * p.z;
                        sum += (x * z > 0 ? 1 : -1) * cornerFormFactor(std::abs(x), std::abs(z), 2);
                    }
                return sum;
            });
            ++count;
            for (const uint32_t seed : {1u, 2u, 3u, 4u, 5u, 6u, 7u, 8u})
                for (const bool more : {false, true}) {
                    TermAccumulator<Gathered> sum(paths.termCount());
                    std::vector<SamplePoint> points;
                    gatherer.gather(gatherer.at(i, points),
                                    {.rays = 16,
                                     .emitter_samples = panel ? 1u : 0u,
                                     .seed = seed,
                                     .door_rays = more ? 48u : 0u,
                                     .wanted_in_group = {}},
                                    nullptr, sum, nullptr);
                    const double ratio = static_cast<double>(sum[through].irradiance_lux.x) / expected;
                    mean[more] += ratio;
                    variance[more] += (ratio - 1) * (ratio - 1);
                }
        }
        const double n = 8 * static_cast<double>(count);
        printf("%s: %zu texels, mean %.4f and with door rays %.4f, variance %.4f and %.4f\n", panel ? "panel" : "sky",
               count, mean[0] / n, mean[1] / n, variance[0] / n, variance[1] / n);
        ASSERT_GT(count, 400u);
        for (const bool more : {false, true})
            EXPECT_NEAR(mean[more] / n, 1, 4 * std::sqrt(variance[more]) / n) << panel << more;
        // Four times the rays: a quarter at random. Samples of the panel, of which there are no more, share its work.
        EXPECT_LT(variance[1], (panel ? 0.7 : 0.4) * variance[0]) << panel;
    }
}

}  // namespace
}  // namespace dimmer::cook::test
