// The Vulkan runtime, held against the CPU runtime and against itself.
#include <dimmer/cpu_runtime.h>
#include <dimmer/runtime.h>
#include <gmock/gmock.h>
#include <gpu/lightmap_pages.h>
#include <gpu/memory.h>
#include <gpu/queue_family.h>

#include "gpu_fixture.h"
#include "pages.h"

#include <limits>

namespace dimmer {
namespace {

using test::packOf;

class RuntimeTest : public test::GpuTest {
   protected:
    static void expectEqualPages(Runtime& gpu, const CpuRuntime& cpu) {
        const auto pages = gpu.readPages();
        ASSERT_TRUE(pages) << pages.error().message;
        ASSERT_TRUE(std::ranges::equal(pages->irradiance, cpu.irradiancePages()));
        ASSERT_TRUE(std::ranges::equal(pages->direction, cpu.directionPages()));
    }
    static void expectEqualCounts(const UpdateStats& a, const UpdateStats& b) {
        EXPECT_EQ(a.contributions_changed, b.contributions_changed);
        EXPECT_EQ(a.clusters, b.clusters);
        EXPECT_EQ(a.batches, b.batches);
        EXPECT_EQ(a.receivers, b.receivers);
        EXPECT_EQ(a.dispatches, b.dispatches);
        EXPECT_EQ(a.bytes_read, b.bytes_read);
        EXPECT_EQ(a.bytes_written, b.bytes_written);
    }
};

TEST_F(RuntimeTest, StartsWithTheBase) {
    const Pack pack = packOf(test::randomPack(1));
    Runtime runtime = runtimeOf(pack);
    expectEqualPages(runtime, CpuRuntime(pack));
    const LightmapImages images = runtime.images();
    EXPECT_EQ(images.layers, pack.pageCount());
    EXPECT_EQ(images.width, pack.pageWidth());
}

TEST_F(RuntimeTest, AgreesWithTheCpuBitForBitOverRandomHistories) {
    for (uint32_t seed = 1; seed <= 3; ++seed) {
        const Pack pack = packOf(test::randomPack(seed));
        Runtime gpu = runtimeOf(pack);
        CpuRuntime cpu(pack);
        test::Random random(seed);
        for (int step = 0; step < 15; ++step) {
            const auto gpu_stats = gpu.submit();
            ASSERT_TRUE(gpu_stats) << gpu_stats.error().message;
            expectEqualCounts(*gpu_stats, cpu.update());
            expectEqualPages(gpu, cpu);
            if (HasFailure()) FAIL() << "seed " << seed << " step " << step;
            const std::string state = test::randomState(pack.data(), random);
            ASSERT_TRUE(gpu.apply(state));
            ASSERT_TRUE(cpu.apply(state));
        }
    }
}

TEST_F(RuntimeTest, AnyHistoryEndsInTheStateOfAFreshRuntime) {
    const Pack pack = packOf(test::randomPack(7));
    Runtime wanderer = runtimeOf(pack);
    test::Random random(7);
    for (int step = 0; step < 30; ++step) {
        ASSERT_TRUE(wanderer.apply(test::randomState(pack.data(), random)));
        ASSERT_TRUE(wanderer.submit());  // without waiting: the next call has to
    }
    Runtime fresh = runtimeOf(pack);
    for (uint32_t i = 0; i < pack.elements().size(); ++i) {
        if (pack.elements()[i].kind == ElementKind::Door)
            ASSERT_TRUE(fresh.setDoor(Door{i}, wanderer.open(Door{i})));
        else
            ASSERT_TRUE(fresh.setWeight(LightSet{i}, wanderer.weight(LightSet{i})));
    }
    ASSERT_TRUE(fresh.submit());
    const auto a = wanderer.readPages(), b = fresh.readPages();
    ASSERT_TRUE(a && b);
    EXPECT_EQ(a->irradiance, b->irradiance);
    EXPECT_EQ(a->direction, b->direction);
}

// All 2^20 highlights, each with some ambient share, next to a base that has one as well.
TEST_F(RuntimeTest, AgreesWithTheCpuForEveryHighlight) {
    PackData data = test::emptyPack(1, 0);
    data.page_count = 16;
    data.page_width = data.page_height = 256;
    test::Random random(8);
    const test::ClusterPlan plans[] = {{{0}, 1u << 20}};
    test::fillPack(data, plans, random);
    for (uint32_t i = 0; i < data.payload.size(); ++i) data.payload[i].direction = i * 37 % 1024 | i << 10;
    const Pack pack = packOf(std::move(data));
    Runtime gpu = runtimeOf(pack);
    CpuRuntime cpu(pack);
    for (const char* state : {"set0=1", "set0=0.37/1.9/0.001"}) {
        ASSERT_TRUE(gpu.apply(state) && cpu.apply(state));
        ASSERT_TRUE(gpu.submit());
        cpu.update();
        expectEqualPages(gpu, cpu);
    }
}

TEST_F(RuntimeTest, AgreesWithTheCpuOnHostileRecords) {
    PackData data = test::randomPack(9);
    test::Random random(9);
    for (auto* records : {&data.base_pages, &data.payload})
        for (TexelRecord& record : *records)
            record = {static_cast<uint32_t>(random()), static_cast<uint32_t>(random())};
    data.elements[0].max_weight = 65536;
    const Pack pack = packOf(std::move(data));
    Runtime gpu = runtimeOf(pack);
    CpuRuntime cpu(pack);
    for (const char* state : {"set0=1", "set0=65536,door:door1=0.3", "all=0.0000001,door:door1=1,door:door0=1"}) {
        ASSERT_TRUE(gpu.apply(state) && cpu.apply(state));
        ASSERT_TRUE(gpu.submit());
        cpu.update();
        expectEqualPages(gpu, cpu);
    }
}

TEST_F(RuntimeTest, NothingChangedIsNoDispatchAndNoSubmission) {
    Runtime runtime = runtimeOf(packOf(test::randomPack(2)));
    ASSERT_GT(runtime.submit()->dispatches, 0u);
    const uint64_t value = runtime.semaphoreValue();
    const auto stats = runtime.submit();
    ASSERT_TRUE(stats);
    EXPECT_EQ(stats->dispatches, 0u);
    EXPECT_EQ(stats->bytes_read, 0u);
    EXPECT_EQ(runtime.semaphoreValue(), value);
    EXPECT_EQ(runtime.record(test::untouchedCommands())->dispatches, 0u);
    EXPECT_EQ(runtime.semaphoreValue(), value);
}

TEST_F(RuntimeTest, WhatWasPutOffIsCountedWhereNothingElseWas) {
    const Pack pack = packOf(test::randomPack(15));
    Runtime gpu = runtimeOf(pack);
    CpuRuntime cpu(pack);
    ASSERT_TRUE(gpu.submit());
    cpu.update();
    const UpdateLimits limits{.tolerance_quanta = std::numeric_limits<float>::max()};
    ASSERT_TRUE(gpu.setLimits(limits) && cpu.setLimits(limits));
    for (const bool records : {false, true}) {
        const char* state = records ? "set3=0.25" : "set3=0.5";
        ASSERT_TRUE(gpu.apply(state) && cpu.apply(state));
        const auto stats = records ? gpu.record(test::untouchedCommands()) : gpu.submit();
        ASSERT_TRUE(stats) << stats.error().message;
        const UpdateStats expected = cpu.update();
        expectEqualCounts(*stats, expected);
        EXPECT_EQ(stats->dispatches, 0u);
        EXPECT_GT(stats->clusters_put_off, 0u);
        EXPECT_EQ(stats->clusters_put_off, expected.clusters_put_off);
    }
}

// 32 pages of 64 MiB are all that the device takes as one image.
TEST(PageLimits, LargerImagesThanTheDeviceHasAreRefused) {
    VkImageFormatProperties limits{};
    limits.maxExtent = {4096, 4096, 1};
    limits.maxArrayLayers = 256;
    limits.maxResourceSize = VkDeviceSize{1} << 31;
    EXPECT_TRUE(checkPageLimits(limits, 4096, 4096, 32));
    const auto refused = checkPageLimits(limits, 4096, 4096, 33);
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, ErrorCode::Unsupported);
    EXPECT_THAT(refused.error().message, testing::HasSubstr("fewer texels per metre"));
    EXPECT_FALSE(checkPageLimits(limits, 4097, 1, 1));
}

TEST_F(RuntimeTest, MoreThanTheDeviceAllocatesAtATimeIsUnsupported) {
    VkPhysicalDeviceMaintenance3Properties allocations{};
    allocations.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_MAINTENANCE_3_PROPERTIES;
    VkPhysicalDeviceProperties2 properties{};
    properties.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_PROPERTIES_2;
    properties.pNext = &allocations;
    vkGetPhysicalDeviceProperties2(device().context().physical_device, &properties);
    const auto refused = createBuffer(device().context(), allocations.maxMemoryAllocationSize + 1,
                                      VK_BUFFER_USAGE_STORAGE_BUFFER_BIT, MemoryUse::Device);
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, ErrorCode::Unsupported);
    EXPECT_THAT(refused.error().message, testing::HasSubstr(std::to_string(allocations.maxMemoryAllocationSize)));
}

TEST_F(RuntimeTest, WaitTellsTheTimeOnTheGpu) {
    Runtime runtime = runtimeOf(packOf(test::randomPack(2)));
    ASSERT_TRUE(runtime.submit());
    const auto stats = runtime.wait();
    ASSERT_TRUE(stats);
    EXPECT_GT(stats->gpu_us, 0);
    uint64_t done = 0;
    vkGetSemaphoreCounterValue(device().context().device, runtime.semaphore(), &done);
    EXPECT_EQ(done, runtime.semaphoreValue());

    Runtime untimed = runtimeOf(packOf(test::randomPack(2)), {.timestamps = false});
    ASSERT_TRUE(untimed.submit());
    EXPECT_EQ(untimed.wait()->gpu_us, 0);
}

TEST_F(RuntimeTest, RecordsIntoTheCallersCommandBuffer) {
    const VulkanContext vulkan = device().context();
    const VkCommandPoolCreateInfo pool_info{VK_STRUCTURE_TYPE_COMMAND_POOL_CREATE_INFO, nullptr,
                                            VK_COMMAND_POOL_CREATE_RESET_COMMAND_BUFFER_BIT, vulkan.queue_family};
    VkCommandPool pool = VK_NULL_HANDLE;
    ASSERT_EQ(vkCreateCommandPool(vulkan.device, &pool_info, nullptr, &pool), VK_SUCCESS);
    const VkCommandBufferAllocateInfo allocate{VK_STRUCTURE_TYPE_COMMAND_BUFFER_ALLOCATE_INFO, nullptr, pool,
                                               VK_COMMAND_BUFFER_LEVEL_PRIMARY, 1};
    VkCommandBuffer commands = VK_NULL_HANDLE;
    ASSERT_EQ(vkAllocateCommandBuffers(vulkan.device, &allocate, &commands), VK_SUCCESS);

    const Pack pack = packOf(test::randomPack(3));
    Runtime gpu = runtimeOf(pack);
    CpuRuntime cpu(pack);
    const VkCommandBufferBeginInfo begin{VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO, nullptr,
                                         VK_COMMAND_BUFFER_USAGE_ONE_TIME_SUBMIT_BIT, nullptr};
    VkSubmitInfo submit{};
    submit.sType = VK_STRUCTURE_TYPE_SUBMIT_INFO;
    submit.commandBufferCount = 1;
    submit.pCommandBuffers = &commands;
    for (const char* state : {"set1=0.5", "set2=0,door:door0=1", "all=0"}) {
        ASSERT_TRUE(gpu.apply(state) && cpu.apply(state));
        ASSERT_EQ(vkBeginCommandBuffer(commands, &begin), VK_SUCCESS);
        const auto stats = gpu.record(commands);
        ASSERT_TRUE(stats);
        EXPECT_GT(stats->dispatches, 0u);
        ASSERT_EQ(vkEndCommandBuffer(commands), VK_SUCCESS);
        ASSERT_EQ(vkQueueSubmit(vulkan.queue, 1, &submit, VK_NULL_HANDLE), VK_SUCCESS);
        ASSERT_EQ(vkQueueWaitIdle(vulkan.queue), VK_SUCCESS);
        EXPECT_GT(gpu.wait()->gpu_us, 0);
        cpu.update();
        expectEqualPages(gpu, cpu);
    }
    vkDestroyCommandPool(vulkan.device, pool, nullptr);
}

TEST_F(RuntimeTest, OneSetToggledRunsExactlyTheBatchesThatHoldIt) {
    const Pack pack = packOf(test::randomPack(4, {.sets = 12, .doors = 0}));
    Runtime runtime = runtimeOf(pack);
    ASSERT_TRUE(runtime.submit());
    for (uint32_t set = 0; set < 12; ++set) {
        uint32_t holding = 0;
        for (const Cluster& c : pack.data().clusters)
            for (uint32_t t = c.first_term; t < c.first_term + c.term_count; ++t)
                if (pack.data().terms[t].contribution == set) holding += (c.receiver_count + 63) / 64;
        ASSERT_TRUE(runtime.setWeight(LightSet{set}, 0));
        EXPECT_EQ(runtime.submit()->batches, holding);
        ASSERT_TRUE(runtime.setWeight(LightSet{set}, 1));
        EXPECT_EQ(runtime.submit()->batches, holding);
    }
}

// More workgroups than one side of a dispatch may have on common devices (65535, of 8 items each): the grid is cut into
// rows.
TEST_F(RuntimeTest, MoreWorkgroupsThanOneSideOfADispatch) {
    PackData data = test::emptyPack(2, 0);
    data.page_count = 1;
    data.page_width = data.page_height = 1024;
    test::Random random(10);
    // Clusters of one receiver each.
    std::vector<test::ClusterPlan> plans(530000, {{0}, 1});
    plans.resize(600000, {{0, 1}, 1});
    test::fillPack(data, plans, random);
    const Pack pack = packOf(std::move(data));
    Runtime gpu = runtimeOf(pack);
    CpuRuntime cpu(pack);
    const auto stats = gpu.submit();
    ASSERT_TRUE(stats);
    EXPECT_EQ(stats->batches, 600000u);
    EXPECT_EQ(stats->dispatches, 2u);
    cpu.update();
    expectEqualPages(gpu, cpu);
}

TEST_F(RuntimeTest, ALevelWithoutDynamicLightHasItsPagesAndNoWork) {
    PackData data = test::emptyPack(2, 1);
    data.page_count = 1;
    data.page_width = 5;
    data.page_height = 3;
    test::Random random(11);
    test::fillPack(data, {}, random);
    const Pack pack = packOf(std::move(data));
    Runtime gpu = runtimeOf(pack);
    ASSERT_TRUE(gpu.apply("all=0,door:door0=1"));
    EXPECT_EQ(gpu.submit()->dispatches, 0u);
    EXPECT_TRUE(gpu.wait());
    expectEqualPages(gpu, CpuRuntime(pack));
}

// A page of more than one staging buffer, with a last piece that is not whole.
TEST_F(RuntimeTest, UploadsAndReadsLargePagesInPieces) {
    PackData data = test::emptyPack(1, 0);
    data.page_count = 2;
    data.page_width = 2048;
    data.page_height = 1027;
    test::Random random(12);
    const test::ClusterPlan plans[] = {{{0}, 2100000}};
    test::fillPack(data, plans, random);
    const Pack pack = packOf(std::move(data));
    Runtime gpu = runtimeOf(pack);
    CpuRuntime cpu(pack);
    ASSERT_TRUE(gpu.submit());
    cpu.update();
    expectEqualPages(gpu, cpu);
}

// lavapipe binds 128 MiB as one storage buffer; records past that are read through texel buffers. 16 sets of 1.1 M
// receivers: 141 MB of records.
TEST_F(RuntimeTest, RecordsPast128MiB) {
    PackData data = test::emptyPack(16, 0);
    data.page_count = 1;
    data.page_width = 2048;
    data.page_height = 560;
    test::ClusterPlan plan;
    for (uint32_t k = 0; k < 16; ++k) plan.contributions.push_back(k);
    plan.receivers = 1100000;
    test::Random random(13);
    test::fillPack(data, std::span(&plan, 1), random);
    ASSERT_GT(data.payload.size() * sizeof(TexelRecord), 128u << 20);
    const Pack pack = packOf(std::move(data));
    Runtime gpu = runtimeOf(pack);
    CpuRuntime cpu(pack);
    for (const char* state : {"all=1", "all=0,set15=1"}) {
        ASSERT_TRUE(gpu.apply(state) && cpu.apply(state));
        ASSERT_TRUE(gpu.submit());
        cpu.update();
        expectEqualPages(gpu, cpu);
    }
}

TEST_F(RuntimeTest, ANullContextIsRefused) {
    const auto refused = Runtime::create({}, packOf(test::randomPack(1)));
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, ErrorCode::InvalidArgument);
}

TEST_F(RuntimeTest, AQueueFamilyThatTheDeviceDoesNotHaveIsRefused) {
    const Pack pack = packOf(test::randomPack(1));
    const auto expectRefused = [&](const VulkanContext& vulkan, const char* field) {
        const auto refused = Runtime::create(vulkan, pack);
        ASSERT_FALSE(refused);
        EXPECT_EQ(refused.error().code, ErrorCode::InvalidArgument);
        EXPECT_THAT(refused.error().message, testing::HasSubstr(field));
    };
    VulkanContext vulkan = device().context();
    vulkan.queue_family = 1000;
    expectRefused(vulkan, "queue_family is 1000");
    vulkan = device().context();
    vulkan.compute_queue_family = 1000;
    EXPECT_TRUE(Runtime::create(vulkan, pack)) << "without a queue its family says nothing";
    vulkan.compute_queue = vulkan.queue;
    expectRefused(vulkan, "compute_queue_family is 1000");
}

TEST(QueueFamilies, OneWithoutComputeIsRefused) {
    VkQueueFamilyProperties families[2]{};
    families[0].queueFlags = VK_QUEUE_GRAPHICS_BIT | VK_QUEUE_TRANSFER_BIT;
    families[1].queueFlags = VK_QUEUE_COMPUTE_BIT;
    EXPECT_TRUE(checkQueueFamily("queue_family", 1, families));
    EXPECT_FALSE(checkQueueFamily("queue_family", 2, families));
    const auto refused = checkQueueFamily("queue_family", 0, families);
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, ErrorCode::InvalidArgument);
    EXPECT_THAT(refused.error().message, testing::HasSubstr("VK_QUEUE_COMPUTE_BIT"));
}

TEST_F(RuntimeTest, OutlivesItsPackAndMayBeMovedAndDroppedMidFlight) {
    std::optional<Pack> pack = packOf(test::randomPack(14));
    Runtime first = runtimeOf(*pack);
    CpuRuntime cpu(*pack);
    pack.reset();
    ASSERT_TRUE(first.submit());
    Runtime second = std::move(first);
    ASSERT_TRUE(second.apply("set0=0.25") && cpu.apply("set0=0.25"));
    ASSERT_TRUE(second.submit());
    cpu.update();
    expectEqualPages(second, cpu);
    ASSERT_TRUE(second.apply("all=0"));
    ASSERT_TRUE(second.submit());
    second = runtimeOf(second.pack());  // drops the one in flight
    ASSERT_TRUE(second.submit());
}

}  // namespace
}  // namespace dimmer
