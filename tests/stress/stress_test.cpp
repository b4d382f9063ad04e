// The stress run, a short one: every runtime ends where a fresh blend is, after anything that a game may do.
#include <stress/stress.h>

#include <gtest/gtest.h>
#include <stress/script.h>
#include <synth/synth.h>

#include <set>

namespace dimmer::cook::test {
namespace {

Pack smallPack() {
    auto data = synthesise({.level = *productionLevel("safehouse"), .scale = 1.0 / 64, .clusters = 60, .probes = true});
    if (!data) throw std::runtime_error(data.error().message);
    return *Pack::fromData(std::move(*data));
}

void expectExact(const StressReport& report, uint64_t checks) {
    EXPECT_EQ(report.checks, checks);
    EXPECT_GT(report.events, report.frames / 2);
    for (const StressTally& t : report.executors) {
        EXPECT_GT(t.words, 0u) << t.name;
        EXPECT_EQ(t.words_different, 0u) << t.name;
        EXPECT_EQ(t.not_numbers, 0u) << t.name;
    }
    EXPECT_EQ(report.device_start_bytes, report.device_end_bytes);
}

TEST(Stress, CpuRuntimesNeverDrift) {
    SilentProgress silent;
    const auto report = stress(smallPack(), nullptr, {.frames = 600, .seconds_max = 0, .check_every = 200}, silent);
    ASSERT_TRUE(report) << report.error().message;
    EXPECT_EQ(report->executors.size(), 2u);
    expectExact(*report, 3);
}

// Never more frames than asked for, and a check behind the last one.
TEST(Stress, PlaysAsManyFramesAsAskedFor) {
    struct Case {
        uint64_t frames, checks;  // one check behind every 20 frames and the one that settles
    };
    SilentProgress silent;
    for (const auto& [frames, checks] : {Case{1, 1}, {5, 1}, {21, 1}, {22, 2}, {50, 3}}) {
        const auto report =
            stress(smallPack(), nullptr, {.frames = frames, .seconds_max = 0, .check_every = 20}, silent);
        ASSERT_TRUE(report) << report.error().message;
        EXPECT_EQ(report->frames, frames);
        EXPECT_EQ(report->checks, checks) << frames;
        EXPECT_TRUE(report->exact());
    }
}

TEST(StressGpu, NoRuntimeEverDrifts) {
    if (const auto any = HeadlessDevice::create(); !any) GTEST_SKIP() << "no Vulkan device: " << any.error().message;
    const auto device = HeadlessDevice::create({.validation = true});
    ASSERT_TRUE(device) << device.error().message;  // a device without the validation layer is not enough
    SilentProgress silent;
    const auto report = stress(smallPack(), &*device, {.frames = 600, .seconds_max = 0, .check_every = 200}, silent);
    ASSERT_TRUE(report) << report.error().message;
    EXPECT_EQ(report->executors.size(), 7u);
    expectExact(*report, 3);
    for (const std::string& message : device->validationMessages()) ADD_FAILURE() << message;
}

// Every kind of change comes, those of one seed are always the same, and their sum is what the script says it is.
TEST(Stress, TheScriptDoesEverything) {
    const Pack pack = smallPack();
    StressScript script(pack, 5), again(pack, 5), other(pack, 6);
    std::set<size_t> kinds;
    bool differs = false;
    std::vector<Weight> weights = script.state().weights;
    for (int frame = 0; frame < 4000; ++frame) {
        const auto& events = script.next();
        const auto& same = again.next();
        ASSERT_EQ(events.size(), same.size());
        differs = differs || other.next().size() != events.size();
        for (size_t i = 0; i < events.size(); ++i) {
            kinds.insert(events[i].index());
            ASSERT_EQ(events[i].index(), same[i].index());
            if (const auto* e = std::get_if<SetWeightEvent>(&events[i])) {
                weights[e->set.element] = e->weight;
                EXPECT_EQ(e->weight, std::get<SetWeightEvent>(same[i]).weight);
            } else if (const auto* d = std::get_if<SetDoorEvent>(&events[i])) {
                weights[d->door.element] = d->open;
            } else if (const auto* dropped = std::get_if<DropEvent>(&events[i])) {
                weights[dropped->set.element] = 0;
            }
        }
    }
    EXPECT_EQ(kinds.size(), std::variant_size_v<StressEvent>);
    EXPECT_TRUE(differs);
    EXPECT_EQ(weights, script.state().weights);
}

}  // namespace
}  // namespace dimmer::cook::test
