// The reference path tracer and whole cooks against an independent path tracer, on levels that nobody here made.
// Skipped where its files are absent. The table for all levels: scripts/bench bake.
#include <bake/sampling.h>
#include <pipeline/cooked_level.h>
#include <pipeline/reference_state.h>
#include <pipeline/truth_file.h>

#include <cmath>

namespace dimmer::cook::test {
namespace {

std::vector<double> luminances(const std::vector<glm::dvec3>& light) {
    std::vector<double> out;
    for (const glm::dvec3& e : light) out.push_back(0.2126 * e.x + 0.7152 * e.y + 0.0722 * e.z);
    return out;
}

// Chi-square per point over `step`-th points of a truth file.
void expectReferenceAgrees(const std::string& level, const std::string& kind_and_state, const std::string& state_text,
                           uint32_t paths, size_t step) {
    const auto truth = readTruth(level + "." + kind_and_state);
    const auto scene = importLevel(levels_folder / (level + ".glb"));
    ASSERT_TRUE(scene) << scene.error().message;
    const auto state = readReferenceState(*scene, state_text);
    ASSERT_TRUE(state) << state.error().message;
    const Scene as_it_stands = sceneInState(*scene, *state);
    const RayScene rays(as_it_stands);
    const ReferenceTracer tracer(rays, state->options(1));
    std::vector<TruthPoint> used;
    std::vector<ReferencePoint> points;
    for (size_t i = 0; i < truth.size(); i += step) {
        used.push_back(truth[i]);
        points.push_back({truth[i].place.position_m, truth[i].place.normal});
    }
    std::vector<ReferenceEstimate> estimates(points.size());
    SilentProgress progress;
    refineAll(tracer, points, {.paths_min = paths, .paths_max = paths}, estimates, progress);
    double chi2 = 0, n = 0, difference = 0, variance = 0;
    for (size_t i = 0; i < used.size(); ++i) {
        const ReferenceValue v = estimates[i].value();
        const double d = static_cast<double>(luminance(v.irradiance_lux)) - used[i].lux;
        const double s2 = std::pow(static_cast<double>(v.luminance_error_lux), 2) + std::pow(used[i].error_lux, 2);
        difference += d;
        variance += s2;
        if (s2 > 0)
            chi2 += d * d / s2, ++n;
        else
            EXPECT_EQ(d, 0) << i;
    }
    if (n == 0) return;  // black in this state, and found so
    printf("%s %s: chi2/n %.3f over %.0f points\n", level.c_str(), kind_and_state.c_str(), chi2 / n, n);
    // Four standard deviations of chi-square, and 0.1 for paths whose light has a heavier tail than a normal one.
    EXPECT_LE(chi2 / n, 1.1 + 4 * std::sqrt(2 / n)) << level << " " << kind_and_state;
    EXPECT_LE(std::abs(difference), 4 * std::sqrt(variance)) << level << " " << kind_and_state;
}

TEST(Truth, ReferenceAgreesInTwoRooms) {
    if (!std::filesystem::exists(truth_folder)) GTEST_SKIP() << "the reference irradiance is not here";
    for (const char* kind : {"surface", "free"})
        for (const auto& [name, state] :
             {std::pair("all_on", ""), {"all_off", "all=0"}, {"only_first", "lamp=0"}, {"door_0", "door:mid=1"}})
            expectReferenceAgrees("two_rooms", std::string(kind) + "." + name, state, 2048, 2);
}

TEST(Truth, ReferenceAgreesInOldStart) {
    if (!std::filesystem::exists(truth_folder)) GTEST_SKIP() << "the reference irradiance is not here";
    for (const auto& [name, state] : {std::pair("all_on", ""), {"all_off", "all=0"}, {"door_0", "door:door1=1"}})
        expectReferenceAgrees("lq_old_start", std::string("surface.") + name, state, 512, 4);
}

class TruthTwoRooms : public testing::Test {
   protected:
    void SetUp() override {
        if (!std::filesystem::exists(truth_folder)) GTEST_SKIP() << "the reference irradiance is not here";
        const auto scene = importLevel(levels_folder / "two_rooms.glb");
        ASSERT_TRUE(scene) << scene.error().message;
        pack_ = cooked(*scene, "draft");
        ASSERT_TRUE(pack_);
    }
    std::vector<double> light(const std::string& state) const {
        return luminances(sampled(*pack_, placesOf(readTruth("two_rooms.surface.all_on")), state));
    }
    std::optional<Pack> pack_;
};

TEST_F(TruthTwoRooms, DraftMeanErrorIsAtMostFivePerCent) {
    const double floor_lux = truthFloor(readTruth("two_rooms.surface.all_on"));
    for (const auto& [name, state] : {std::pair("all_on", ""), {"all_off", "all=0"}, {"only_first", "all=0,desk=1"}}) {
        const auto truth = readTruth(std::string("two_rooms.surface.") + name);
        const auto values = light(state);
        std::vector<LightPair> pairs;
        for (size_t i = 0; i < truth.size(); ++i) pairs.push_back({values[i], truth[i].lux, truth[i].error_lux});
        const ErrorFigures f = lightError(pairs, floor_lux);
        printf("two_rooms %s at draft: mean %.2f %%, p95 %.2f %%, bias %+.2f %%\n", name, 100 * f.mean, 100 * f.p95,
               100 * f.bias);
        EXPECT_EQ(f.points, truth.size());
        EXPECT_LE(f.mean, 0.05) << name;  // the goal is 10 %; found are 2.6 at most (docs/measurements.md)
    }
}

TEST_F(TruthTwoRooms, DraftSetsDoWhatTheyShould) {
    const auto all = readTruth("two_rooms.surface.all_on"), desk = readTruth("two_rooms.surface.only_first");
    const auto off = readTruth("two_rooms.surface.all_off");
    const auto lux_all = light(""), lux_desk = light("all=0,desk=1"), lux_off = light("all=0");
    std::vector<LightPair> desk_pairs, lamp_pairs;
    for (size_t i = 0; i < all.size(); ++i) {
        desk_pairs.push_back(
            {lux_desk[i] - lux_off[i], desk[i].lux - off[i].lux, std::hypot(desk[i].error_lux, off[i].error_lux)});
        lamp_pairs.push_back(
            {lux_all[i] - lux_desk[i], all[i].lux - desk[i].lux, std::hypot(all[i].error_lux, desk[i].error_lux)});
    }
    for (const auto& [name, pairs] : {std::pair("desk", &desk_pairs), {"lamp", &lamp_pairs}}) {
        const EffectFigures f = effectError(*pairs);
        printf("two_rooms %s at draft: error %.2f %%, bias %+.2f %%, %zu points\n", name, 100 * f.error, 100 * f.bias,
               f.points);
        EXPECT_GT(f.points, 50u) << name;
        EXPECT_LE(f.error, 0.06) << name;  // the goal is 15 %; found are 3 at most
    }
}

TEST(Truth, OldStartCooksAndReadsSanely) {
    if (!std::filesystem::exists(truth_folder)) GTEST_SKIP() << "the reference irradiance is not here";
    const auto scene = importLevel(levels_folder / "lq_old_start.glb");
    ASSERT_TRUE(scene) << scene.error().message;
    const auto pack = cooked(*scene, "draft");
    ASSERT_TRUE(pack);
    const auto truth = readTruth("lq_old_start.surface.all_on");
    const auto values = luminances(sampled(*pack, placesOf(truth), ""));
    std::vector<LightPair> pairs;
    for (size_t i = 0; i < truth.size(); ++i) pairs.push_back({values[i], truth[i].lux, truth[i].error_lux});
    const ErrorFigures f = lightError(pairs, truthFloor(truth));
    printf("lq_old_start all_on at draft: mean %.2f %%, p95 %.2f %%, bias %+.2f %%\n", 100 * f.mean, 100 * f.p95,
           100 * f.bias);
    // Found are 1.4 and 0.03 % (docs/measurements.md): twice the mean, and a bias above the truth's noise, is a defect.
    EXPECT_LE(f.mean, 0.03);
    EXPECT_LE(std::abs(f.bias), 0.01);
}

}  // namespace
}  // namespace dimmer::cook::test
