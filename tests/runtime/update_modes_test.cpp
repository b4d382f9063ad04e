// Every way of updating pages gives the same bits.
#include <dimmer/cpu_runtime.h>
#include <dimmer/runtime.h>

#include "gpu_fixture.h"
#include "random_pack.h"

namespace dimmer {
namespace {

class UpdateModes : public test::GpuTest, public testing::WithParamInterface<UpdateMode> {
   protected:
    static Runtime runtimeOf(const Pack& pack) {
        auto runtime = Runtime::create(device().context(), pack, {.mode = GetParam()});
        if (!runtime) throw std::runtime_error(runtime.error().message);
        return std::move(*runtime);
    }
    static void expectEqualPages(Runtime& gpu, const CpuRuntime& cpu) {
        const auto pages = gpu.readPages();
        ASSERT_TRUE(pages) << pages.error().message;
        ASSERT_TRUE(std::ranges::equal(pages->irradiance, cpu.irradiancePages()));
        ASSERT_TRUE(std::ranges::equal(pages->direction, cpu.directionPages()));
    }
    static void followARandomHistory(ColorFormat format);
    static Pack packOf(PackData data) {
        auto pack = Pack::fromData(std::move(data));
        if (!pack) throw std::runtime_error(pack.error().message);
        return *pack;
    }
};

void UpdateModes::followARandomHistory(ColorFormat format) {
    // Overlaps up to 20: every kernel, the loop included; clusters of odd sizes.
    const Pack pack = packOf(test::randomPack(
        20, {.sets = 18, .doors = 2, .clusters = 60, .overlap_max = 20, .page_side = 80, .color_format = format}));
    Runtime gpu = runtimeOf(pack);
    CpuRuntime cpu(pack);
    test::Random random(20);
    for (int step = 0; step < 12; ++step) {
        const auto stats = gpu.submit();
        ASSERT_TRUE(stats) << stats.error().message;
        const UpdateStats expected = cpu.update();
        EXPECT_EQ(stats->clusters, expected.clusters);
        EXPECT_EQ(stats->bytes_read, expected.bytes_read);
        expectEqualPages(gpu, cpu);
        if (HasFailure()) FAIL() << "step " << step;
        const std::string state = test::randomState(pack.data(), random);
        ASSERT_TRUE(gpu.apply(state) && cpu.apply(state));
    }
}

TEST_P(UpdateModes, GpuPagesAreThoseOfTheCpuOverRandomHistories) {
    followARandomHistory(ColorFormat::R11G11B10F);
}

TEST_P(UpdateModes, GpuPagesOfSharedExponentsAreThoseOfTheCpu) {
    followARandomHistory(ColorFormat::E5B9G9R9);
}

TEST_P(UpdateModes, GpuPagesHoldTheBaseAgainWhenAllIsOff) {
    PackData data = test::randomPack(21, {.doors = 0});
    // Black with a direction of its own: encoding would lose it.
    for (size_t i = 0; i < data.base_pages.size(); i += 3) data.base_pages[i].irradiance = 0;
    const Pack pack = packOf(std::move(data));
    Runtime gpu = runtimeOf(pack);
    ASSERT_TRUE(gpu.submit());
    ASSERT_TRUE(gpu.apply("all=0"));
    ASSERT_TRUE(gpu.submit());
    expectEqualPages(gpu, CpuRuntime(pack));
}

// Two doors all but closed: their product times the format's own scale is no float but 0, the light is on all the same.
TEST_P(UpdateModes, GpuPagesAreThoseOfTheCpuForWeightsThatVanish) {
    PackData data = test::emptyPack(1, 2);
    data.color_format = ColorFormat::E5B9G9R9;
    data.page_count = 1;
    data.page_width = data.page_height = 16;
    data.contributions.assign(1, {});
    data.contributions[0].doors_open = {1, 2};
    test::Random random(23);
    const test::ClusterPlan plans[] = {{{0}, 40}};
    test::fillPack(data, plans, random);
    // Black with a direction of its own, which encoding loses: so it is seen whether it was encoded.
    for (TexelRecord& base : data.base_pages) base = {0, 0x06496309};
    const Pack pack = packOf(std::move(data));
    Runtime gpu = runtimeOf(pack);
    CpuRuntime cpu(pack);
    for (const char* state : {"door:door0=1e-21,door:door1=1e-21", "door:door0=1e-30,door:door1=1e-30"}) {
        ASSERT_TRUE(gpu.apply(state) && cpu.apply(state)) << state;
        ASSERT_TRUE(gpu.submit());
        cpu.update();
        expectEqualPages(gpu, cpu);
    }
}

std::string nameOf(const testing::TestParamInfo<UpdateMode>& mode) {
    constexpr std::array names = {"WorkList", "PerCombination", "Gather", "Scatter"};
    return names[static_cast<size_t>(mode.param)];
}

INSTANTIATE_TEST_SUITE_P(All, UpdateModes,
                         testing::Values(UpdateMode::WorkList, UpdateMode::PerCombination, UpdateMode::Gather,
                                         UpdateMode::Scatter),
                         nameOf);

TEST_P(UpdateModes, GpuDispatchesAreAsManyAsTheModeSays) {
    const Pack pack = packOf(test::randomPack(22, {.sets = 6, .doors = 0, .clusters = 30, .overlap_max = 5}));
    Runtime gpu = runtimeOf(pack);
    const auto stats = gpu.submit();
    ASSERT_TRUE(stats);
    uint32_t sets_held = 0;
    for (const Contribution& c : pack.contributions()) sets_held += c.receivers > 0;
    switch (GetParam()) {
        case UpdateMode::WorkList:
            EXPECT_EQ(stats->dispatches, 5u);  // overlaps 1..5 occur
            break;
        case UpdateMode::PerCombination:
            EXPECT_EQ(stats->dispatches, 30u);
            break;
        case UpdateMode::Gather:
            EXPECT_EQ(stats->dispatches, 1u);
            break;
        case UpdateMode::Scatter:
            EXPECT_EQ(stats->dispatches, sets_held + 2);
            break;
    }
}

}  // namespace
}  // namespace dimmer
