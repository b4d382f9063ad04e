// Loading and dropping a light set's records while the game runs.
#include <dimmer/cpu_runtime.h>
#include <dimmer/runtime.h>
#include <gmock/gmock.h>
#include <gpu/texel_blender.h>
#include <update/record_pool.h>

#include "gpu_fixture.h"
#include "pages.h"

namespace dimmer {
namespace {

using test::packOf;
using testing::HasSubstr;

TEST(RecordPool, HandsOutWhatIsFreeAndJoinsWhatComesBack) {
    RecordPool pool(100, 100);
    EXPECT_EQ(pool.allocate(30), 0u);
    EXPECT_EQ(pool.allocate(30), 30u);
    EXPECT_EQ(pool.allocate(40), 60u);
    EXPECT_FALSE(pool.allocate(1));
    pool.release(0, 30);
    pool.release(60, 40);
    EXPECT_FALSE(pool.allocate(50)) << "the free ranges do not touch";
    EXPECT_EQ(pool.largestFree(), 40u);
    pool.release(30, 30);
    EXPECT_EQ(pool.largestFree(), 100u);
    EXPECT_EQ(pool.allocate(100), 0u);
}

// No two ranges overlap, and all that came back can be had again, whatever the order.
TEST(RecordPool, RandomHistoriesNeverOverlap) {
    test::Random random(1);
    RecordPool pool(1000, 1000);
    std::vector<bool> taken(1000);
    std::vector<std::pair<uint64_t, uint64_t>> held;
    for (int step = 0; step < 5000; ++step) {
        if (test::pick(random, 0, 1) == 0 && !held.empty()) {
            const size_t i = test::pick(random, 0, static_cast<uint32_t>(held.size() - 1));
            std::swap(held[i], held.back());
            for (uint64_t r = held.back().first; r < held.back().first + held.back().second; ++r) taken[r] = false;
            pool.release(held.back().first, held.back().second);
            held.pop_back();
        } else if (const uint64_t count = test::pick(random, 1, 120); const auto first = pool.allocate(count)) {
            for (uint64_t r = *first; r < *first + count; ++r) {
                ASSERT_FALSE(taken[r]);
                taken[r] = true;
            }
            held.emplace_back(*first, count);
        }
    }
    for (const auto& [first, count] : held) pool.release(first, count);
    EXPECT_EQ(pool.largestFree(), 1000u);
}

// A device that reads half of the records as one buffer will do where no more are loaded at a time.
TEST(TexelLimits, RecordsThatAreNeverLoadedTogetherNeedNoRoomTogether) {
    const PackData data = test::randomPack(79);
    const DevicePlaces places = placesOf(data);
    const Planner planner(data);
    const uint64_t half = places.records * sizeof(TexelRecord) / 2;
    VkPhysicalDeviceLimits limits{};
    limits.maxTexelBufferElements = static_cast<uint32_t>(half / 16);
    EXPECT_TRUE(checkTexelLimits(limits, UINT64_MAX, places, planner, half / 16 * 16));
    for (const uint64_t bytes_max : {uint64_t{0}, half + 16, 3 * half}) {
        const auto refused = checkTexelLimits(limits, UINT64_MAX, places, planner, bytes_max);
        ASSERT_FALSE(refused);
        EXPECT_EQ(refused.error().code, ErrorCode::Unsupported);
        EXPECT_THAT(refused.error().message, HasSubstr("records_bytes_max"));
    }
}

// Fewer than the device has numbers for, whatever it has memory for.
TEST(TexelLimits, MoreReceiversThanBatchesCanNameAreRefused) {
    const PackData data = test::randomPack(79);
    DevicePlaces places = placesOf(data);
    const Planner planner(data);
    VkPhysicalDeviceLimits limits{};
    limits.maxTexelBufferElements = UINT32_MAX;
    places.receivers = (1u << 28) - 1;
    EXPECT_TRUE(checkTexelLimits(limits, UINT64_MAX, places, planner, 0));
    places.receivers = 1u << 28;
    const auto refused = checkTexelLimits(limits, UINT64_MAX, places, planner, 0);
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, ErrorCode::Unsupported);
    EXPECT_THAT(refused.error().message, HasSubstr("268435456 receivers; this runtime takes fewer than"));
}

// Some devices read texel buffers of any size and allocate less at once.
TEST(TexelLimits, RecordsLargerThanOneAllocationAreRefused) {
    const PackData data = test::randomPack(79);
    const DevicePlaces places = placesOf(data);
    const Planner planner(data);
    const uint64_t bytes = places.records * sizeof(TexelRecord);
    VkPhysicalDeviceLimits limits{};
    limits.maxTexelBufferElements = UINT32_MAX;
    EXPECT_TRUE(checkTexelLimits(limits, bytes, places, planner, 0));
    EXPECT_TRUE(checkTexelLimits(limits, bytes / 2, places, planner, bytes / 2));
    const auto refused = checkTexelLimits(limits, bytes - 1, places, planner, 0);
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, ErrorCode::Unsupported);
    EXPECT_THAT(refused.error().message, HasSubstr(fmt::format("{} bytes. Cook", bytes - 1)));
    EXPECT_THAT(refused.error().message, HasSubstr("records_bytes_max"));
}

// What is too much for a texel buffer may be a storage buffer.
TEST(TexelLimits, OfTheTwoWaysToReadATableOneIsEnough) {
    const PackData data = test::randomPack(79);
    const DevicePlaces places = placesOf(data);
    const Planner planner(data);
    const auto bytes = static_cast<uint32_t>(places.records * sizeof(TexelRecord));
    VkPhysicalDeviceLimits limits{};
    limits.maxTexelBufferElements = 65536 / 16;
    limits.maxStorageBufferRange = bytes;
    EXPECT_TRUE(checkTexelLimits(limits, UINT64_MAX, places, planner, 0));
    --limits.maxStorageBufferRange;
    const auto refused = checkTexelLimits(limits, UINT64_MAX, places, planner, 0);
    ASSERT_FALSE(refused);
    for (const std::string& figure : {fmt::format("{} bytes of records", bytes), std::string("4096 texels of 16 bytes"),
                                      fmt::format("a storage buffer of {} bytes", bytes - 1)})
        EXPECT_THAT(refused.error().message, HasSubstr(figure));
}

class GpuTables : public test::GpuTest {};

// Before any memory is taken; the layers would name a view of too many texels.
TEST_F(GpuTables, OfMoreThanTheDeviceReadsInEitherWayAreRefused) {
    VkPhysicalDeviceProperties properties;
    vkGetPhysicalDeviceProperties(device().context().physical_device, &properties);
    const uint64_t texels_max = properties.limits.maxTexelBufferElements;
    const uint64_t storage_max = properties.limits.maxStorageBufferRange;
    const std::pair<VkFormat, uint64_t> texel_bytes[] = {{VK_FORMAT_R8G8_UINT, 2},
                                                         {VK_FORMAT_R16_UINT, 2},
                                                         {VK_FORMAT_R32_UINT, 4},
                                                         {VK_FORMAT_R32G32_UINT, 8},
                                                         {VK_FORMAT_R32G32B32A32_UINT, 16}};
    for (const auto& [format, bytes] : texel_bytes) {
        EXPECT_TRUE(createTable(device().context(), 1000 * bytes, format, MemoryUse::Device));
        const uint64_t too_many = std::max(texels_max, storage_max / bytes) + 1;
        const auto refused = createTable(device().context(), too_many * bytes, format, MemoryUse::Device);
        ASSERT_FALSE(refused) << format;
        EXPECT_EQ(refused.error().code, ErrorCode::Unsupported);
        EXPECT_THAT(refused.error().message, HasSubstr(fmt::format("{} bytes exceeds", too_many * bytes)));
    }
}

class RecordsTest : public test::GpuTest {
   protected:
    static void expectEqualPages(Runtime& gpu, const CpuRuntime& cpu) {
        const auto pages = gpu.readPages();
        ASSERT_TRUE(pages) << pages.error().message;
        ASSERT_TRUE(std::ranges::equal(pages->irradiance, cpu.irradiancePages()));
        ASSERT_TRUE(std::ranges::equal(pages->direction, cpu.directionPages()));
    }
    // Until nothing is on its way; updates go on in between, as in a game.
    static void load(Runtime& gpu, uint64_t piece_bytes) {
        uint64_t done = 0;
        for (;;) {
            const auto progress = gpu.continueLoading(piece_bytes);
            ASSERT_TRUE(progress) << progress.error().message;
            EXPECT_GE(progress->done_bytes, done);
            EXPECT_LE(progress->done_bytes, progress->total_bytes);
            done = progress->done_bytes;
            if (progress->finished()) return;
            ASSERT_TRUE(gpu.submit());
        }
    }
};

TEST_F(RecordsTest, ADroppedSetIsOffAndSaysSo) {
    const Pack pack = packOf(test::randomPack(71));
    Runtime gpu = runtimeOf(pack);
    CpuRuntime cpu(pack);
    ASSERT_TRUE(gpu.submit());
    ASSERT_TRUE(gpu.dropRecords(LightSet{2}));
    EXPECT_EQ(gpu.recordsState(LightSet{2}), RecordsState::Dropped);
    EXPECT_EQ(gpu.weight(LightSet{2}), Weight(0));
    ASSERT_TRUE(gpu.submit());
    ASSERT_TRUE(cpu.setWeight(LightSet{2}, 0));
    cpu.update();
    expectEqualPages(gpu, cpu);

    const auto refused = gpu.setWeight(LightSet{2}, 0.5f);
    ASSERT_FALSE(refused);
    EXPECT_THAT(refused.error().message, HasSubstr("\"set2\""));
    EXPECT_FALSE(gpu.apply("set1=0.5,set2=0.5"));
    EXPECT_EQ(gpu.weight(LightSet{1}), Weight(1)) << "a refused state changes nothing";
    EXPECT_TRUE(gpu.setWeight(LightSet{2}, 0));
    EXPECT_TRUE(gpu.apply("all=0.75"));
    EXPECT_EQ(gpu.weight(LightSet{2}), Weight(0));
    EXPECT_EQ(gpu.weight(LightSet{3}), Weight(0.75f));
    ASSERT_TRUE(gpu.submit());
    ASSERT_TRUE(cpu.apply("all=0.75,set2=0"));
    cpu.update();
    expectEqualPages(gpu, cpu);
}

TEST_F(RecordsTest, LoadedAgainInPiecesASetShinesAsBefore) {
    const Pack pack = packOf(test::randomPack(72));
    Runtime gpu = runtimeOf(pack);
    CpuRuntime cpu(pack);
    ASSERT_TRUE(gpu.dropRecords(LightSet{2}));
    ASSERT_TRUE(gpu.dropRecords(LightSet{5}));
    ASSERT_TRUE(gpu.submit());
    // In the other order.
    for (const uint32_t set : {5u, 2u}) {
        ASSERT_TRUE(gpu.loadRecords(LightSet{set}));
        EXPECT_EQ(gpu.recordsState(LightSet{set}), RecordsState::Loading);
        EXPECT_FALSE(gpu.setWeight(LightSet{set}, 1));
    }
    load(gpu, 1000);
    for (const uint32_t set : {2u, 5u}) {
        EXPECT_EQ(gpu.recordsState(LightSet{set}), RecordsState::Loaded);
        EXPECT_EQ(gpu.weight(LightSet{set}), Weight(0));
        ASSERT_TRUE(gpu.setWeight(LightSet{set}, 1));
    }
    ASSERT_TRUE(gpu.submit());
    cpu.update();
    expectEqualPages(gpu, cpu);
}

// With room for all, no history of dropping and loading may end without room.
TEST_F(RecordsTest, WithRoomForAllEveryOrderFits) {
    const Pack pack = packOf(test::randomPack(75, {.sets = 12, .doors = 1, .clusters = 60}));
    Runtime gpu = runtimeOf(pack);
    CpuRuntime cpu(pack);
    test::Random random(75);
    std::array<bool, 12> loaded;
    loaded.fill(true);
    for (int i = 0; i < 400; ++i) {
        const uint32_t set = test::pick(random, 0, 11);
        const auto done = loaded[set] ? gpu.dropRecords(LightSet{set}) : gpu.loadRecords(LightSet{set});
        ASSERT_TRUE(done) << "after " << i << ": " << done.error().message;
        load(gpu, 4 << 20);
        loaded[set] = !loaded[set];
        const float weight = loaded[set] ? 0.5f : 0.0f;
        ASSERT_TRUE(gpu.setWeight(LightSet{set}, weight));
        ASSERT_TRUE(cpu.setWeight(LightSet{set}, weight));
        ASSERT_TRUE(gpu.submit());
    }
    cpu.update();
    expectEqualPages(gpu, cpu);
}

// Room for a part of the sets: they take turns, and the pages are right in every state.
TEST_F(RecordsTest, SetsTakeTurnsInLessMemory) {
    const Pack pack = packOf(test::randomPack(73, {.sets = 8, .doors = 1, .clusters = 30}));
    uint64_t largest = 0, always = 0;
    for (uint32_t set = 0; set < 8; ++set) {
        uint64_t records = 0;
        for (const Contribution& c : pack.contributions())
            if (c.light_set == set) records += c.receivers;
        largest = std::max(largest, records);
    }
    for (const Contribution& c : pack.contributions())
        if (!c.light_set) always += c.receivers;
    // Two of the largest, what is never dropped, and gaps of a record per cluster.
    const uint64_t room = (2 * largest + always + 3 * 30 * 4) * sizeof(TexelRecord);
    ASSERT_LT(room, pack.data().payload.size() * sizeof(TexelRecord)) << "everything fits: nothing is tested";
    Runtime gpu = runtimeOf(pack, {.records_bytes_max = room, .load_records = false});
    CpuRuntime cpu(pack);
    ASSERT_TRUE(cpu.apply("all=0"));
    EXPECT_FALSE(gpu.setWeight(LightSet{0}, 1));
    test::Random random(73);
    uint32_t refused = 0;
    for (int step = 0; step < 40; ++step) {
        const LightSet set{test::pick(random, 0, 7)};
        if (gpu.recordsState(set) == RecordsState::Loaded) {
            ASSERT_TRUE(gpu.dropRecords(set));
            ASSERT_TRUE(cpu.setWeight(set, 0));
        } else if (const auto begun = gpu.loadRecords(set); begun) {
            load(gpu, 4096);
            ASSERT_TRUE(gpu.setWeight(set, 0.5f) && cpu.setWeight(set, 0.5f));
        } else {
            EXPECT_EQ(begun.error().code, ErrorCode::OutOfMemory);
            EXPECT_EQ(gpu.recordsState(set), RecordsState::Dropped);
            ++refused;
        }
        const float open = test::uniform(random, 0, 1);
        ASSERT_TRUE(gpu.setDoor(Door{8}, open) && cpu.setDoor(Door{8}, open));
        ASSERT_TRUE(gpu.submit());
        cpu.update();
        expectEqualPages(gpu, cpu);
    }
    EXPECT_GT(refused, 0u) << "there was always room";
}

TEST_F(RecordsTest, TooLittleMemoryForEverythingIsSaid) {
    const auto refused = Runtime::create(device().context(), packOf(test::randomPack(74)), {.records_bytes_max = 1000});
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, ErrorCode::OutOfMemory);
}

TEST_F(RecordsTest, ModesWithAnOrderOfTheirOwnRefuse) {
    Runtime gpu = runtimeOf(packOf(test::randomPack(75)), {.mode = UpdateMode::Gather});
    EXPECT_EQ(gpu.dropRecords(LightSet{0}).error().code, ErrorCode::Unsupported);
    EXPECT_EQ(gpu.loadRecords(LightSet{0}).error().code, ErrorCode::Unsupported);
    EXPECT_FALSE(gpu.dropRecords(LightSet{99}));
}

TEST_F(RecordsTest, StagingMemoryIsHeldOnlyWhileLoading) {
    Runtime gpu = runtimeOf(packOf(test::randomPack(76)));
    const uint64_t before = gpu.footprint().bytes;
    ASSERT_TRUE(gpu.dropRecords(LightSet{1}));
    ASSERT_TRUE(gpu.loadRecords(LightSet{1}));
    ASSERT_TRUE(gpu.continueLoading(64));
    EXPECT_GT(gpu.footprint().bytes, before);
    load(gpu, 1 << 20);
    EXPECT_EQ(gpu.footprint().bytes, before);
}

TEST_F(RecordsTest, APieceHoldsManySmallContributions) {
    Runtime gpu = runtimeOf(packOf(test::randomPack(78)), {.load_records = false});
    for (uint32_t set = 0; set < 9; ++set) ASSERT_TRUE(gpu.loadRecords(LightSet{set}));
    const auto begun = gpu.continueLoading(1 << 20);
    ASSERT_TRUE(begun);
    ASSERT_LT(begun->total_bytes, 1u << 20);
    ASSERT_EQ(vkDeviceWaitIdle(device().context().device), VK_SUCCESS);
    const auto progress = gpu.continueLoading(1 << 20);
    ASSERT_TRUE(progress);
    EXPECT_EQ(progress->done_bytes, progress->total_bytes);
    for (uint32_t set = 0; set < 9; ++set) EXPECT_EQ(gpu.recordsState(LightSet{set}), RecordsState::Loaded);
}

TEST_F(RecordsTest, MayBeDestroyedAndDroppedInTheMiddleOfLoading) {
    Runtime gpu = runtimeOf(packOf(test::randomPack(77)), {.load_records = false});
    for (uint32_t set = 0; set < 9; ++set) ASSERT_TRUE(gpu.loadRecords(LightSet{set}));
    ASSERT_TRUE(gpu.continueLoading(256));
    ASSERT_TRUE(gpu.dropRecords(LightSet{0}));
    ASSERT_TRUE(gpu.dropRecords(LightSet{4}));
    ASSERT_TRUE(gpu.loadRecords(LightSet{0}));
    load(gpu, 2048);
    EXPECT_EQ(gpu.recordsState(LightSet{0}), RecordsState::Loaded);
    EXPECT_EQ(gpu.recordsState(LightSet{4}), RecordsState::Dropped);
    ASSERT_TRUE(gpu.apply("all=1"));
    ASSERT_TRUE(gpu.submit());
    CpuRuntime cpu(gpu.pack());
    ASSERT_TRUE(cpu.apply("set4=0"));
    cpu.update();
    expectEqualPages(gpu, cpu);
    ASSERT_TRUE(gpu.loadRecords(LightSet{4}));
    ASSERT_TRUE(gpu.continueLoading(256));  // and out of scope
}

}  // namespace
}  // namespace dimmer
