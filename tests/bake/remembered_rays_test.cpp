// Rays whose ends are remembered bring what they brought when they were traced, past doors' leaves too.
#include <bake/baked_scene.h>
#include <bake/final_gather.h>
#include <bake/gather.h>
#include <bake/test_scenes.h>

#include <numeric>

namespace dimmer::cook::test {
namespace {

// Two rooms of 2 m under one roof, parted by two doors that meet in the middle; or the same without the roof, below a
// bright sky.
Scene rooms(bool roof) {
    Scene scene;
    const uint32_t white = addMaterial(scene, lambert(0.6f));
    if (roof)
        addBox(scene, {2, 1, 1}, white);
    else
        addFloor(scene, 2, white, -1);
    scene.sky_radiance_cd_m2 = glm::vec3(roof ? 0 : 3);
    scene.doors = {{"left", false}, {"right", false}};
    addSolid(scene, "leaf", {0, 0, -0.5f}, {0.1f, 1, 0.5f}, white, 0);
    addSolid(scene, "leaf", {0, 0, 0.5f}, {0.1f, 1, 0.5f}, white, 1);
    scene.light_sets = {{"lamp", 1}};
    addPointLight(scene, {-1, 0, 0}, 100, BakeMode::Full).light_set = 0;
    return scene;
}

struct Gathering {
    explicit Gathering(const BakedScene& level)
        : emitters(*level.rays, meshGroups(level.scene)),
          paths(level.scene),
          gatherer(*level.rays, level.charts, level.texels, emitters, paths),
          // Something else from every receiver, in the lamp's free term and in all that is always on.
          outgoing(SparseLight::build(gatherer.receiverCount(), [&](size_t begin, size_t end, auto emit) {
              std::vector<TermLight> row;
              for (size_t i = begin; i < end; ++i) {
                  row.clear();
                  for (const uint32_t t : {0u, 1u})
                      row.emplace_back(t, glm::vec3(unitFloat(hash(static_cast<uint32_t>(i), t))),
                                       Rounding(i, Rounding::Of::Outgoing));
                  emit(std::span<const TermLight>(row));
              }
          })) {}

    // Per term, the irradiance at a receiver.
    std::vector<glm::vec3> at(size_t receiver, RowEnds* row) const {
        TermAccumulator<Gathered> sum(paths.termCount());
        GatherOptions options;
        options.emitter_samples = 0;
        options.row = row;
        std::vector<SamplePoint> points;
        gatherer.gather(gatherer.at(receiver, points), options, &outgoing, sum, nullptr);
        std::vector<glm::vec3> lux(paths.termCount(), glm::vec3(0));
        for (const uint32_t t : sum.touched()) lux[t] = sum[t].irradiance_lux;
        return lux;
    }

    EmitterSampler emitters;
    DoorPaths paths;
    Gatherer gatherer;
    SparseLight outgoing;
};

RowEnds unknownRow() {
    return {.ends = std::vector<uint32_t>(64, RayEnd::unknown), .through = {}};
}

TEST(RememberedRays, BringWhatTheyBroughtWhenTheyWereTraced) {
    for (const bool roof : {true, false}) {
        const BakedScene level(rooms(roof));
        const Gathering gathering(level);
        size_t through = 0, over_sky = 0;
        for (size_t i = 0; i < level.texels.size(); ++i) {
            RowEnds row = unknownRow();
            const auto traced = gathering.at(i, &row);
            EXPECT_EQ(traced, gathering.at(i, nullptr));
            for (const uint32_t end : row.ends) {
                EXPECT_LT(end, RayEnd::again) << "nothing here shines";
                through += end == RayEnd::through;
            }
            for (const PathEnd& p : row.through) over_sky += p.end == RayEnd::sky;
            RayEnds kept(1, static_cast<uint32_t>(gathering.gatherer.receiverCount()), gathering.paths.pathCount());
            kept.putBlock(0, {&row, 1});
            RowEnds known;
            kept.get(0, known);
            EXPECT_EQ(traced, gathering.at(i, &known)) << i;
        }
        EXPECT_GT(through, 1000u);
        EXPECT_EQ(over_sky > 0, !roof);
    }
}

// A term that needs more rays than were asked for when the row was made, with rays aimed at doors besides.
TEST(RememberedRays, GoOnWhereTheyEnd) {
    const BakedScene level(rooms(true));
    const Gathering gathering(level);
    std::vector<uint32_t> terms(gathering.paths.termCount());
    std::iota(terms.begin(), terms.end(), 0u);
    const std::vector<float> floors(terms.size(), 0.0f);
    FinalGather<Gathered> gather(gathering.gatherer);
    const auto lightAt = [&](size_t receiver, uint32_t rays, RowEnds* row) {
        FinalGatherOptions options;
        options.rays_max = rays;
        options.noise_max = 0;
        options.floor_lux = floors;
        std::vector<ReceiverLight> light;
        std::vector<SamplePoint> points;
        gather.gather(gathering.gatherer.at(receiver, points), terms, gathering.outgoing, options, light, row);
        std::vector<glm::vec3> lux;
        for (const ReceiverLight& l : light) lux.push_back(l.light.irradiance_lux);
        return lux;
    };
    size_t through = 0;
    for (size_t i = 0; i < level.texels.size(); i += 3) {
        RowEnds row;
        lightAt(i, 2 * rays_per_round, &row);
        ASSERT_EQ(row.ends.size(), 2 * rays_per_round);
        row.next = 0;  // as it comes from a store
        EXPECT_EQ(lightAt(i, 4 * rays_per_round, &row), lightAt(i, 4 * rays_per_round, nullptr)) << i;
        EXPECT_EQ(row.ends.size(), 4 * rays_per_round);
        row.next = 0;
        EXPECT_EQ(lightAt(i, 4 * rays_per_round, &row), lightAt(i, 4 * rays_per_round, nullptr)) << i;
        through += !row.through.empty();
        RowEnds few;
        few.kept_max = 3 * rays_per_round / 2;  // whole rounds are remembered
        EXPECT_EQ(lightAt(i, 4 * rays_per_round, &few), lightAt(i, 4 * rays_per_round, nullptr)) << i;
        EXPECT_EQ(few.ends.size(), rays_per_round);
    }
    EXPECT_GT(through, 50u);
}

// Told that rays end elsewhere, the gather believes it: they are not traced.
TEST(RememberedRays, AreNotTracedAgain) {
    const BakedScene level(rooms(true));
    const Gathering gathering(level);
    size_t asked = 0;
    for (size_t i = 0; i < level.texels.size(); i += 7) {
        RowEnds row = unknownRow();
        gathering.at(i, &row);
        row.next = 0;
        for (uint32_t& end : row.ends)
            if (end != RayEnd::through) end = RayEnd::nothing;
        for (PathEnd& p : row.through) p.end = RayEnd::sky;  // which is dark
        asked += !row.through.empty();
        for (const glm::vec3 lux : gathering.at(i, &row)) EXPECT_EQ(lux, glm::vec3(0));
    }
    EXPECT_GT(asked, 20u);
}

}  // namespace
}  // namespace dimmer::cook::test
