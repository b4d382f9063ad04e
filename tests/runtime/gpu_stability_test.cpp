// The stability tests on the device: fewer steps, the same promises.
#include <dimmer/cpu_runtime.h>
#include <dimmer/runtime.h>
#include <pipeline/budget.h>

#include "gpu_fixture.h"
#include "pages.h"

#include <cstdlib>

namespace dimmer {
namespace {

using test::packOf;

using GpuStability = test::GpuTest;

// A million with DIMMER_TOGGLES=1000000, which takes minutes; the CPU runtime's test always runs them.
TEST_F(GpuStability, RandomTogglesEndInTheStateOfAFreshRuntime) {
    const char* asked = std::getenv("DIMMER_TOGGLES");
    const auto toggles = asked ? static_cast<uint32_t>(std::atol(asked)) : 3000u;
    for (const ColorFormat format : {ColorFormat::R11G11B10F, ColorFormat::E5B9G9R9}) {
        const Pack pack = packOf(
            test::randomPack(41, {.sets = 24, .doors = 4, .clusters = 60, .page_side = 80, .color_format = format}));
        Runtime runtime = runtimeOf(pack, {.timestamps = false});
        test::Random random(41);
        test::toggleAtRandom(runtime, random, toggles, [&] { ASSERT_TRUE(runtime.submit()); });
        Runtime fresh = runtimeOf(pack);
        test::copyState(runtime, fresh);
        ASSERT_TRUE(fresh.submit());
        CpuRuntime cpu(pack);
        test::copyState(runtime, cpu);
        cpu.update();
        const auto a = runtime.readPages(), b = fresh.readPages();
        ASSERT_TRUE(a && b);
        EXPECT_EQ(a->irradiance, b->irradiance);
        EXPECT_EQ(a->direction, b->direction);
        EXPECT_TRUE(std::ranges::equal(a->irradiance, cpu.irradiancePages()));
        EXPECT_TRUE(std::ranges::equal(a->direction, cpu.directionPages()));
    }
}

TEST_F(GpuStability, DeviceMemoryIsTheSumThatInspectStates) {
    for (uint32_t seed : {42u, 43u}) {
        const PackData data = test::randomPack(seed, {.sets = seed - 40, .doors = 1, .clusters = seed});
        const DeviceFootprint footprint = runtimeOf(packOf(data)).footprint();
        EXPECT_EQ(footprint.bytes, cook::costOf(data).device());
        EXPECT_GT(footprint.pipelines, 0u);
    }
}

// No light set and no door: the pages, and nothing else.
TEST_F(GpuStability, ALevelPaysForWhatItHas) {
    PackData data = test::emptyPack(0, 0);
    data.page_count = 2;
    data.page_width = data.page_height = 16;
    test::Random random(44);
    test::fillPack(data, {}, random);
    Runtime runtime = runtimeOf(packOf(data));
    const DeviceFootprint footprint = runtime.footprint();
    EXPECT_EQ(footprint.pipelines, 0u);
    EXPECT_EQ(footprint.bytes, 2u * 16 * 16 * 8);
    EXPECT_EQ(footprint.bytes, cook::costOf(data).device());
    const auto stats = runtime.submit();
    ASSERT_TRUE(stats);
    EXPECT_EQ(stats->dispatches, 0u);
    EXPECT_EQ(runtime.semaphoreValue(), 0u);
}

}  // namespace
}  // namespace dimmer
