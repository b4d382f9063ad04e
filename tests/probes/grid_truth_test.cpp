// Light in the open, from a cooked pack's probes, against an independent path tracer. Skipped where its files are
// absent.
#include <bake/sampling.h>
#include <pipeline/cooked_level.h>
#include <pipeline/truth_file.h>

#include <algorithm>
#include <map>

namespace dimmer::cook::test {
namespace {

ErrorFigures gridErrorAgainst(const Pack& pack, const std::string& state, const std::vector<TruthPoint>& truth,
                              double floor_lux) {
    CpuRuntime runtime(pack);
    EXPECT_TRUE(runtime.apply(state));
    runtime.update();
    const LightPages pages{{}, {}, {runtime.probes().begin(), runtime.probes().end()}};
    const auto light = sampleGrid(pack, pages, placesOf(truth));
    std::vector<LightPair> pairs;
    for (size_t i = 0; i < truth.size(); ++i) {
        const auto& e = *light[i];
        pairs.push_back({0.2126 * static_cast<double>(e[0]) + 0.7152 * static_cast<double>(e[1]) +
                             0.0722 * static_cast<double>(e[2]),
                         truth[i].lux, truth[i].error_lux});
    }
    return lightError(pairs, floor_lux);
}

// With at most one probe per cubic metre. The goal here is a mean of 8 % and a 95th percentile of 25 %, which draft
// meets in most variants of the placement but not in all (docs/measurements.md); the bounds are what is asked of levels
// that nobody here made.
TEST(GridTruth, TwoRooms) {
    if (!std::filesystem::exists(truth_folder)) GTEST_SKIP() << "the reference irradiance is not here";
    const auto scene = importLevel(levels_folder / "two_rooms.glb");
    ASSERT_TRUE(scene) << scene.error().message;
    const double floor_lux = truthFloor(readTruth("two_rooms.free.all_on"));
    constexpr std::pair<const char*, const char*> states[] = {
        {"all_on", ""}, {"all_off", "all=0"}, {"only_first", "all=0,desk=1"}, {"door_0", "door:mid=1"}};
    // Where 58 probes end up is chaotic: five placements. All must do, but for one figure: with one lamp what a single
    // point behind a wall finds is the mean of the state (26 % in two of these), and there the middle one must.
    std::map<std::string, std::vector<double>> means, p95s;
    for (const float spacing_m : {0.26f, 0.28f, 0.3f, 0.32f, 0.34f}) {
        SilentProgress progress;
        CookStats stats;
        auto profile = *loadProfile("desktop");
        profile.global_grid = GridMode::On;  // nothing moves there
        profile.global_min_spacing_m = spacing_m;
        profile.probes_per_m3 = 1;
        auto data = cookScene(*scene, profile, "draft", progress, stats);
        ASSERT_TRUE(data) << data.error().message;
        const auto pack = Pack::fromData(std::move(*data));
        ASSERT_TRUE(pack) << pack.error().message;
        EXPECT_LE(static_cast<double>(pack->data().probes.base.size()), stats.free_volume_m3);
        for (const auto& [name, state] : states) {
            const auto truth = readTruth(std::string("two_rooms.free.") + name);
            const ErrorFigures f = gridErrorAgainst(*pack, state, truth, floor_lux);
            printf("two_rooms %s in the open, at draft: mean %.2f %%, p95 %.2f %%, bias %+.2f %%\n", name, 100 * f.mean,
                   100 * f.p95, 100 * f.bias);
            EXPECT_EQ(f.points, truth.size());
            means[name].push_back(f.mean);
            p95s[name].push_back(f.p95);
        }
    }
    const auto middle = [](std::vector<double> of) {
        std::ranges::nth_element(of, of.begin() + 2);
        return of[2];
    };
    // The goals for our own levels are 8 and 25 %, at final.
    EXPECT_LE(middle(means["only_first"]), 0.10);
    for (const auto& [name, state] : states) {
        if (name != std::string("only_first")) {
            EXPECT_LE(std::ranges::max(means[name]), 0.10) << name;
        }
        EXPECT_LE(std::ranges::max(p95s[name]), 0.33) << name;
    }
}

// As shipped: so small a level has more probes, and no luck with their places.
TEST(GridTruth, TwoRoomsAsShipped) {
    if (!std::filesystem::exists(truth_folder)) GTEST_SKIP() << "the reference irradiance is not here";
    const auto scene = importLevel(levels_folder / "two_rooms.glb");
    ASSERT_TRUE(scene) << scene.error().message;
    SilentProgress progress;
    CookStats stats;
    auto profile = *loadProfile("desktop");
    profile.global_grid = GridMode::On;
    auto data = cookScene(*scene, profile, "draft", progress, stats);
    ASSERT_TRUE(data) << data.error().message;
    const auto pack = Pack::fromData(std::move(*data));
    ASSERT_TRUE(pack) << pack.error().message;
    const double floor_lux = truthFloor(readTruth("two_rooms.free.all_on"));
    for (const auto& [name, state] :
         {std::pair("all_on", ""), {"only_first", "all=0,desk=1"}, {"door_0", "door:mid=1"}}) {
        const auto truth = readTruth(std::string("two_rooms.free.") + name);
        const ErrorFigures f = gridErrorAgainst(*pack, state, truth, floor_lux);
        EXPECT_LE(f.mean, 0.08) << name;  // the goals
        EXPECT_LE(f.p95, 0.25) << name;
    }
}

}  // namespace
}  // namespace dimmer::cook::test
