// Doors in levels that nobody here made, against the given truth and opened one by one.
#include <format/texel.h>
#include <pipeline/cooked_level.h>
#include <pipeline/truth_file.h>

#include <array>
#include <cmath>

namespace dimmer::cook::test {
namespace {

double luminanceOf(glm::dvec3 e) {
    return 0.2126 * e.x + 0.7152 * e.y + 0.0722 * e.z;
}

Profile coarse() {
    auto profile = loadProfile("desktop");
    EXPECT_TRUE(profile);
    profile->texels_per_metre = 0.5f;
    profile->global_grid = GridMode::Off;  // doors and lightmaps are looked at here
    profile->draft = {
        .samples_per_texel = 1, .series_rays = 8, .rays = 32, .emitter_samples = 1, .bounces = 8, .tolerance = 0.05f};
    return *profile;
}

// What opening the door does, at the points that it changes most: a baker that ignores doors scores 100 %.
TEST(DoorLevels, OpeningTheDoorOfTwoRoomsDoesWhatItShould) {
    if (!std::filesystem::exists(truth_folder)) GTEST_SKIP() << "the reference irradiance is not here";
    const auto scene = importLevel(levels_folder / "two_rooms.glb");
    ASSERT_TRUE(scene) << scene.error().message;
    const auto pack = cooked(*scene, "draft");
    ASSERT_TRUE(pack);
    const auto closed = readTruth("two_rooms.opening_0.closed"), open = readTruth("two_rooms.opening_0.open");
    const auto lux_closed = sampled(*pack, placesOf(closed), ""),
               lux_open = sampled(*pack, placesOf(open), "door:mid=1");
    std::vector<LightPair> pairs;
    for (size_t i = 0; i < open.size(); ++i)
        pairs.push_back({luminanceOf(lux_open[i] - lux_closed[i]), open[i].lux - closed[i].lux,
                         std::hypot(open[i].error_lux, closed[i].error_lux)});
    const EffectFigures f = effectError(pairs);
    printf(
        "two_rooms door mid at draft: error %.2f %% (%.2f %% before the reference's own noise), bias %+.2f %%, %zu\n",
        100 * f.error, 100 * f.measured_error, 100 * f.bias, f.points);
    EXPECT_GT(f.points, 100u);
    // What is asked of `final`, and half as much again for the noise of `draft`.
    EXPECT_LE(f.error, 0.15);
}

// Half open lies between closed and open, and 256 steps never turn back, but by the rounding of stored colours.
TEST(DoorLevels, LightMovesOneWayAsADoorOpens) {
    if (!std::filesystem::exists(levels_folder)) GTEST_SKIP() << "the levels are not here";
    const auto scene = importLevel(levels_folder / "two_rooms.glb");
    ASSERT_TRUE(scene) << scene.error().message;
    SilentProgress silent;
    CookStats stats;
    auto data = cookScene(*scene, coarse(), "draft", silent, stats);
    ASSERT_TRUE(data) << data.error().message;
    const auto pack = Pack::fromData(std::move(*data));
    ASSERT_TRUE(pack) << pack.error().message;
    CpuRuntime runtime(*pack);
    const auto lux = [&](int step) {
        EXPECT_TRUE(runtime.setDoor(*runtime.door("mid"), static_cast<float>(step) / 256));
        runtime.update();
        std::vector<std::array<float, 3>> out;
        for (const uint32_t code : runtime.irradiancePages()) out.push_back(decodeColor(pack->colorFormat(), code));
        return out;
    };
    const auto closed = lux(0), open = lux(256);
    auto before = closed;
    size_t moved = 0;
    for (int step = 1; step <= 256; ++step) {
        const auto now = lux(step);
        for (size_t i = 0; i < now.size(); ++i)
            for (size_t c = 0; c < 3; ++c) {
                // One step of the format is 2^-8 of the largest channel at most.
                const float quantum = std::max({now[i][0], now[i][1], now[i][2]}) / 256;
                const float way = open[i][c] >= closed[i][c] ? 1.0f : -1.0f;
                ASSERT_GE(way * (now[i][c] - before[i][c]), -quantum) << "texel " << i << " step " << step;
                ASSERT_LE(way * (now[i][c] - open[i][c]), quantum) << "texel " << i << " step " << step;
                moved += step == 256 && std::abs(open[i][c] - closed[i][c]) > 4 * quantum;
            }
        before = now;
    }
    EXPECT_GT(moved, 500u);
}

// Every door of every level, opened and closed again: each moves light, but those that the cook said move none, and
// closing brings back the very bytes.
TEST(DoorLevels, EveryDoorOpens) {
    if (!std::filesystem::exists(levels_folder)) GTEST_SKIP() << "the levels are not here";
    size_t doors = 0;
    for (const char* level : {"two_rooms", "lq_old_start", "lq_e2m2", "lq_e2m3"}) {
        auto scene = importLevel(levels_folder / (std::string(level) + ".glb"));
        ASSERT_TRUE(scene) << scene.error().message;
        SilentProgress silent;
        CookStats stats;
        auto data = cookScene(*scene, coarse(), "draft", silent, stats);
        ASSERT_TRUE(data) << data.error().message;
        const auto pack = Pack::fromData(std::move(*data));
        ASSERT_TRUE(pack) << pack.error().message;
        CpuRuntime runtime(*pack);
        runtime.update();
        const std::vector<uint32_t> closed(runtime.irradiancePages().begin(), runtime.irradiancePages().end());
        for (uint32_t e = 0; e < pack->elements().size(); ++e) {
            if (pack->elements()[e].kind != ElementKind::Door) continue;
            ++doors;
            const auto set = [&](float open) {
                EXPECT_TRUE(runtime.setDoor(Door{e}, open));
                return runtime.update().receivers;
            };
            const std::string& name = pack->elements()[e].name;
            const bool idle = std::ranges::any_of(stats.warnings, [&](const std::string& w) {
                return w.find("door '" + name + "' changes no light") != std::string::npos;
            });
            EXPECT_EQ(set(1) == 0, idle) << level << " " << name;
            EXPECT_EQ(std::ranges::equal(runtime.irradiancePages(), closed), idle) << level << " " << name;
            set(0);
            EXPECT_TRUE(std::ranges::equal(runtime.irradiancePages(), closed)) << level << " " << name;
        }
    }
    EXPECT_EQ(doors, 46u);  // 1 + 1 + 11 + 33
}

}  // namespace
}  // namespace dimmer::cook::test
