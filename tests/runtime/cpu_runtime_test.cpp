#include <cpu/worker_pool.h>
#include <dimmer/cpu_runtime.h>
#include <format/texel.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include "model_pack.h"
#include "pages.h"

#include <cstdlib>
#include <new>

namespace dimmer {
namespace {

using test::packOf;

std::vector<uint32_t> allTexels(const CpuRuntime& runtime) {
    std::vector<uint32_t> texels(runtime.irradiancePages().begin(), runtime.irradiancePages().end());
    texels.insert(texels.end(), runtime.directionPages().begin(), runtime.directionPages().end());
    return texels;
}

TEST(CpuRuntime, StartsWithTheBase) {
    const Pack pack = packOf(test::randomPack(1));
    const CpuRuntime runtime(pack);
    for (size_t i = 0; i < pack.data().base_pages.size(); ++i)
        ASSERT_EQ((TexelRecord{runtime.irradiancePages()[i], runtime.directionPages()[i]}), pack.data().base_pages[i]);
}

// One texel, one set: E = base + w E_set where every number is exact in the format.
TEST(CpuRuntime, AddsWhatTheWeightSays) {
    PackData data;
    data.page_count = data.page_width = data.page_height = 1;
    data.elements = {{"lamp", ElementKind::LightSet, 1}};
    data.contributions = {{0u, {}, {}, 0, 0}};
    test::Random random(1);
    const test::ClusterPlan plans[] = {{{0}, 1}};
    test::fillPack(data, plans, random);
    constexpr uint32_t none = 1023u | 512u << 10 | 512u << 20;
    data.base_pages[0] = {encodeR11G11B10(1, 2, 3), none};
    data.payload[0] = {encodeR11G11B10(4, 8, 16), none};

    CpuRuntime runtime(packOf(std::move(data)));
    auto expect = [&](float r, float g, float b) {
        EXPECT_EQ(decodeR11G11B10(runtime.irradiancePages()[0]), (std::array{r, g, b}));
        EXPECT_EQ(runtime.directionPages()[0], none);
    };
    runtime.update();
    expect(5, 10, 19);
    ASSERT_TRUE(runtime.apply("lamp=0.5"));
    runtime.update();
    expect(3, 6, 11);
    ASSERT_TRUE(runtime.apply("lamp=1/0.25/0"));
    runtime.update();
    expect(5, 4, 3);
    ASSERT_TRUE(runtime.apply("lamp=0"));
    runtime.update();
    expect(1, 2, 3);
}

TEST(CpuRuntime, NothingChangedIsNoDispatch) {
    CpuRuntime runtime(packOf(test::randomPack(2)));
    EXPECT_GT(runtime.update().dispatches, 0u);
    const UpdateStats stats = runtime.update();
    EXPECT_EQ(stats.dispatches, 0u);
    EXPECT_EQ(stats.batches, 0u);
    EXPECT_EQ(stats.bytes_written, 0u);
}

TEST(CpuRuntime, AnyHistoryEndsInTheStateOfAFreshRuntime) {
    for (uint32_t seed = 1; seed <= 5; ++seed) {
        const Pack pack = packOf(test::randomPack(seed));
        CpuRuntime wanderer(pack);
        test::Random random(seed);
        for (int step = 0; step < 40; ++step) {
            ASSERT_TRUE(wanderer.apply(test::randomState(pack.data(), random)));
            // Several changes may fall into one update.
            if (test::pick(random, 0, 3) > 0) wanderer.update();
        }
        wanderer.update();

        CpuRuntime fresh(pack);
        for (uint32_t i = 0; i < pack.elements().size(); ++i) {
            if (pack.elements()[i].kind == ElementKind::Door)
                ASSERT_TRUE(fresh.setDoor(Door{i}, wanderer.open(Door{i})));
            else
                ASSERT_TRUE(fresh.setWeight(LightSet{i}, wanderer.weight(LightSet{i})));
        }
        fresh.update();
        EXPECT_EQ(allTexels(wanderer), allTexels(fresh)) << "seed " << seed;
    }
}

TEST(CpuRuntime, EverythingOffBringsTheBaseBack) {
    const Pack pack = packOf(test::randomPack(3, {.doors = 0}));
    const CpuRuntime untouched(pack);
    CpuRuntime runtime(pack);
    runtime.update();
    EXPECT_NE(allTexels(runtime), allTexels(untouched));
    ASSERT_TRUE(runtime.apply("all=0"));
    runtime.update();
    EXPECT_EQ(allTexels(runtime), allTexels(untouched));
}

TEST(CpuRuntime, RefusedWeightsLeaveThePagesAlone) {
    CpuRuntime runtime(packOf(test::randomPack(4)));
    runtime.update();
    const auto before = allTexels(runtime);
    EXPECT_FALSE(runtime.setWeight(LightSet{0}, 1e9f));
    EXPECT_FALSE(runtime.apply("set0=0,set1=-1"));
    EXPECT_EQ(runtime.update().dispatches, 0u);
    EXPECT_EQ(allTexels(runtime), before);
}

TEST(CpuRuntime, HostileRecordsNeverPutInfinityOrNanIntoThePages) {
    PackData data = test::randomPack(5);
    test::Random random(5);
    for (auto* records : {&data.base_pages, &data.payload})
        for (TexelRecord& record : *records)
            record = {static_cast<uint32_t>(random()) | (test::pick(random, 0, 1) ? 0xf81f07c0u : 0u),
                      static_cast<uint32_t>(random())};
    data.elements[0].max_weight = 65536;
    CpuRuntime runtime(packOf(std::move(data)));
    auto expectFinite = [&] {
        for (uint32_t code : runtime.irradiancePages()) {
            ASSERT_NE(code & 0x7c0, 0x7c0u);
            ASSERT_NE(code >> 11 & 0x7c0, 0x7c0u);
            ASSERT_NE(code >> 22 & 0x3e0, 0x3e0u);
        }
    };
    expectFinite();
    runtime.update();
    expectFinite();
    ASSERT_TRUE(runtime.apply("set0=65536,set1=0.00001,door:door0=0.5"));
    runtime.update();
    expectFinite();
}

// For a process of its own.
void takeAllMemory() {
    constexpr rlimit no_more{0, 0};
    setrlimit(RLIMIT_AS, &no_more);
    for (size_t bytes = 1 << 20; bytes >= 8; bytes /= 2)
        while (::operator new(bytes, std::nothrow)) {
        }
}

// A pool where no memory is left, whose work the caller then does alone.
[[noreturn]] void workWithoutMemory() {
    takeAllMemory();
    uint32_t calls = 0;
    WorkerPool pool(8);
    pool.run([&](uint32_t) { ++calls; });
    std::_Exit(pool.threads() == 1 && calls == 1 ? 0 : 2);
}

TEST(WorkerPoolDeathTest, WithoutMemoryTheCallerWorksAlone) {
    EXPECT_EXIT(workWithoutMemory(), testing::ExitedWithCode(0), "");
}

std::vector<Model> addModels(LightState& lights) {
    std::vector<Model> models;
    for (int i = 0; i < 7; ++i) models.push_back(lights.addModel({}, {}).value());
    return models;
}

// In an order that leaves free ranges between others.
void removeAllButTheLast(LightState& lights, std::span<const Model> models) {
    for (const size_t i : {0, 2, 4, 5, 3, 1}) lights.removeModel(models[i]).value();
}

// Texels, probes and models, on threads: an update or a removal that takes memory would throw, and leave its work
// undone.
[[noreturn]] void updateWithoutMemory() {
    PackData data = test::modelPack(3, 100, [](glm::vec3) { return glm::vec3(0.1f); });
    test::addLightOnProbes(data, 0, encodeE5B9G9R9(1, 1, 1), [](glm::vec3) { return true; });
    const Pack pack = packOf(std::move(data));
    const Pack large = packOf(test::randomPack(3, {.clusters = 2000, .page_count = 4, .page_side = 512}));
    CpuRuntime grid(pack, 4, 64), wanted_grid(pack, 1, 64);  // room for 8 models of 8 probes
    CpuRuntime texels(large, 4), wanted_texels(large);
    const auto models = addModels(grid), wanted_models = addModels(wanted_grid);
    removeAllButTheLast(wanted_grid, wanted_models);
    wanted_grid.update();
    wanted_texels.update();
    takeAllMemory();
    const bool all_threads = texels.update().batches >= 4 * 256;  // fewer would be left to one
    removeAllButTheLast(grid, models);
    const bool resampled = grid.update().probes_resampled == 8;
    const bool same = std::ranges::equal(texels.irradiancePages(), wanted_texels.irradiancePages()) &&
                      std::ranges::equal(texels.directionPages(), wanted_texels.directionPages()) &&
                      std::ranges::equal(grid.irradiancePages(), wanted_grid.irradiancePages()) &&
                      std::ranges::equal(grid.probes(), wanted_grid.probes());
    std::_Exit(all_threads && resampled && same ? 0 : 2);
}

TEST(WorkerPoolDeathTest, WithoutMemoryUpdatesDoAllTheirWork) {
    EXPECT_EXIT(updateWithoutMemory(), testing::ExitedWithCode(0), "");
}

}  // namespace
}  // namespace dimmer
