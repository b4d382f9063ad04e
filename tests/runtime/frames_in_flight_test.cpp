// Several updates on their way at a time, and commands that nobody knows the fate of; under synchronisation validation.
#include <dimmer/cpu_runtime.h>
#include <dimmer/runtime.h>
#include <gmock/gmock.h>

#include <gpu/transfer.h>
#include <gpu/vk_struct.h>
#include <update/device_places.h>

#include "gpu_fixture.h"
#include "model_pack.h"
#include "pages.h"

namespace dimmer {
namespace {

using test::packOf;

// A frame of a game: commands and the fence that says when they are done.
struct Frame {
    CommandBuffer commands;
    FenceHandle fence;
};

class FramesInFlight : public test::GpuTest {
   protected:
    static Frame makeFrame() {
        const VulkanContext vulkan = device().context();
        auto commands = createCommandBuffer(vulkan.device, vulkan.queue_family);
        EXPECT_TRUE(commands);
        auto info = vkStruct<VkFenceCreateInfo>(VK_STRUCTURE_TYPE_FENCE_CREATE_INFO);
        info.flags = VK_FENCE_CREATE_SIGNALED_BIT;
        VkFence fence = VK_NULL_HANDLE;
        EXPECT_EQ(vkCreateFence(vulkan.device, &info, nullptr, &fence), VK_SUCCESS);
        return {std::move(*commands), FenceHandle(vulkan.device, fence)};
    }
    static void waitFor(const Frame& frame) {
        const VkFence fence = frame.fence.get();
        ASSERT_EQ(vkWaitForFences(device().context().device, 1, &fence, VK_TRUE, UINT64_MAX), VK_SUCCESS);
    }
    static void recordInto(const Frame& frame, Runtime& gpu) {
        const auto begin = vkStruct<VkCommandBufferBeginInfo>(VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO);
        ASSERT_EQ(vkBeginCommandBuffer(frame.commands.commands, &begin), VK_SUCCESS);
        const auto recorded = gpu.record(frame.commands.commands);
        ASSERT_TRUE(recorded) << recorded.error().message;
        ASSERT_EQ(vkEndCommandBuffer(frame.commands.commands), VK_SUCCESS);
    }
    static void run(const Frame& frame) {
        const VkFence fence = frame.fence.get();
        ASSERT_EQ(vkResetFences(device().context().device, 1, &fence), VK_SUCCESS);
        auto submit = vkStruct<VkSubmitInfo>(VK_STRUCTURE_TYPE_SUBMIT_INFO);
        submit.commandBufferCount = 1;
        submit.pCommandBuffers = &frame.commands.commands;
        ASSERT_EQ(vkQueueSubmit(device().context().queue, 1, &submit, fence), VK_SUCCESS);
    }
    // Of texels and probes, the models' too.
    static void expectLightOf(Runtime& gpu, const CpuRuntime& cpu) {
        const auto pages = gpu.readPages();
        ASSERT_TRUE(pages) << pages.error().message;
        EXPECT_TRUE(std::ranges::equal(pages->irradiance, cpu.irradiancePages()));
        EXPECT_TRUE(std::ranges::equal(pages->direction, cpu.directionPages()));
        EXPECT_TRUE(std::ranges::equal(pages->probes, cpu.probes()));
    }
};

// Texels, probes that change, and a global grid for a model.
Pack packWithAll(uint64_t seed) {
    PackData data = test::modelPack(seed, 60, [](glm::vec3 p) { return glm::vec3(0.1f + 0.05f * p.x); });
    test::addLightOnProbes(data, 0, encodeE5B9G9R9(1, 1, 1), [](glm::vec3) { return true; });
    return packOf(std::move(data));
}

// As games do it: a frame begins when the one before the last `count` is done, and not when the last one is.
TEST_F(FramesInFlight, RecordWaitsForNoFrameButTheOneThatItTakesTheWorkListOf) {
    for (const Buffering buffering : {Buffering::InPlace, Buffering::Double})
        for (const uint32_t count : {1u, 2u, 3u}) {
            SCOPED_TRACE(count);
            for (const Pack& pack : {packOf(test::randomPack(81)), packWithAll(81)}) {
                Runtime gpu =
                    runtimeOf(pack, {.buffering = buffering, .frames_in_flight = count, .moving_probes_max = 8});
                CpuRuntime cpu(pack, 1, 8);
                std::optional<Model> model, cpu_model;
                if (const auto added = gpu.addModel({}, {})) {
                    model = *added;
                    cpu_model = *cpu.addModel({}, {});
                }
                std::vector<Frame> frames;
                for (uint32_t i = 0; i < count; ++i) frames.push_back(makeFrame());
                const auto elements = static_cast<uint32_t>(pack.elements().size());
                for (uint32_t i = 0; i < 60; ++i) {
                    const Frame& frame = frames[i % count];
                    waitFor(frame);
                    if (i % 7 != 3) {  // a frame in which nothing happens
                        const float weight = static_cast<float>(i % 13 + 1) / 16;
                        test::setElement(gpu, i % elements, weight);
                        test::setElement(cpu, i % elements, weight);
                    }
                    Transform moved;
                    moved.rows[0][3] = static_cast<float>(i % 5) * 0.2f;
                    if (model) {
                        ASSERT_TRUE(gpu.moveModel(*model, moved) && cpu.moveModel(*cpu_model, moved));
                    }
                    recordInto(frame, gpu);
                    run(frame);
                    cpu.update();
                }
                for (const Frame& frame : frames) waitFor(frame);
                expectLightOf(gpu, cpu);
            }
        }
}

// While the first waits for a semaphore, the second is sent; were there one work list, the call would wait for ever.
TEST_F(FramesInFlight, SubmitBlocksOnlyForTheUpdateThatHasItsWorkList) {
    const VulkanContext vulkan = device().context();
    const Pack pack = packOf(test::randomPack(82));
    Runtime gpu = runtimeOf(pack, {.frames_in_flight = 2});
    CpuRuntime cpu(pack);
    auto type = vkStruct<VkSemaphoreTypeCreateInfo>(VK_STRUCTURE_TYPE_SEMAPHORE_TYPE_CREATE_INFO);
    type.semaphoreType = VK_SEMAPHORE_TYPE_TIMELINE;
    const auto info = vkStruct<VkSemaphoreCreateInfo>(VK_STRUCTURE_TYPE_SEMAPHORE_CREATE_INFO, &type);
    VkSemaphore semaphore = VK_NULL_HANDLE;
    ASSERT_EQ(vkCreateSemaphore(vulkan.device, &info, nullptr, &semaphore), VK_SUCCESS);
    const SemaphoreHandle gate(vulkan.device, semaphore);
    ASSERT_TRUE(gpu.submit({semaphore, 1}));
    ASSERT_TRUE(gpu.apply("set0=0.5,set1=0.25"));
    ASSERT_TRUE(gpu.submit());
    uint64_t done = 9;
    ASSERT_EQ(vkGetSemaphoreCounterValue(vulkan.device, gpu.semaphore(), &done), VK_SUCCESS);
    EXPECT_EQ(done, 0u) << "nothing has run yet";
    EXPECT_EQ(gpu.semaphoreValue(), 2u);
    auto signal = vkStruct<VkSemaphoreSignalInfo>(VK_STRUCTURE_TYPE_SEMAPHORE_SIGNAL_INFO);
    signal.semaphore = semaphore;
    signal.value = 1;
    ASSERT_EQ(vkSignalSemaphore(vulkan.device, &signal), VK_SUCCESS);
    ASSERT_TRUE(gpu.apply("set2=0"));
    ASSERT_TRUE(gpu.submit());
    ASSERT_TRUE(cpu.apply("set0=0.5,set1=0.25,set2=0"));
    cpu.update();
    expectLightOf(gpu, cpu);
}

// Two frames are given up: the last one can be taken back, and nothing but invalidate() makes up for the other.
TEST_F(FramesInFlight, InvalidateMakesUpForRecordingsThatAreLost) {
    for (const Buffering buffering : {Buffering::InPlace, Buffering::Double}) {
        const Pack pack = packWithAll(83);
        Runtime gpu = runtimeOf(pack, {.buffering = buffering, .frames_in_flight = 2, .moving_probes_max = 8});
        CpuRuntime cpu(pack, 1, 8);
        ASSERT_TRUE(gpu.addModel({}, {}) && cpu.addModel({}, {}));
        EXPECT_FALSE(gpu.discardRecorded()) << "nothing was recorded";
        const Frame first = makeFrame(), second = makeFrame();
        recordInto(first, gpu);
        ASSERT_TRUE(gpu.apply("all=0.25"));
        recordInto(second, gpu);
        EXPECT_TRUE(gpu.discardRecorded());
        EXPECT_FALSE(gpu.discardRecorded()) << "the one before is out of reach";
        ASSERT_TRUE(gpu.apply("all=1"));  // as the first, which never ran, is thought to have left it
        ASSERT_TRUE(gpu.submit());
        gpu.invalidate();
        for (int i = 0; i < 2; ++i) {  // both sets of pages, where there are two
            const auto sent = gpu.submit();
            ASSERT_TRUE(sent) << sent.error().message;
            EXPECT_EQ(sent->dispatches > 0, i == 0) << "the other set is written when something changes";
            cpu.update();
            expectLightOf(gpu, cpu);
        }
        ASSERT_TRUE(gpu.apply("all=0.5") && cpu.apply("all=0.5"));
        ASSERT_TRUE(gpu.submit());
        cpu.update();
        expectLightOf(gpu, cpu);
    }
}

TEST_F(FramesInFlight, AsManyAsMakeSense) {
    const Pack pack = packOf(test::randomPack(84));
    for (const uint32_t count : {0u, 9u}) {
        const auto refused = Runtime::create(device().context(), pack, {.frames_in_flight = count});
        ASSERT_FALSE(refused);
        EXPECT_EQ(refused.error().code, ErrorCode::InvalidArgument);
        EXPECT_THAT(refused.error().message, testing::HasSubstr("1 to 8"));
    }
    const auto refused =
        Runtime::create(device().context(), pack, {.mode = UpdateMode::Scatter, .frames_in_flight = 2});
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, ErrorCode::Unsupported);
    const uint64_t one = runtimeOf(pack).footprint().bytes,
                   two = runtimeOf(pack, {.frames_in_flight = 2}).footprint().bytes;
    const PackData& data = pack.data();
    EXPECT_EQ(two - one, data.batches.size() * sizeof(TexelItem) + data.terms.size() * sizeof(WorkTerm));
}

// A game's cache of pipelines is used, and stays the game's.
TEST_F(FramesInFlight, PipelinesAreMadeWithTheGamesCache) {
    VulkanContext vulkan = device().context();
    const auto info = vkStruct<VkPipelineCacheCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_CACHE_CREATE_INFO);
    ASSERT_EQ(vkCreatePipelineCache(vulkan.device, &info, nullptr, &vulkan.pipeline_cache), VK_SUCCESS);
    const Pack pack = packWithAll(85);
    for (int i = 0; i < 2; ++i) {
        auto gpu = Runtime::create(vulkan, pack);
        ASSERT_TRUE(gpu) << gpu.error().message;
        CpuRuntime cpu(pack);
        ASSERT_TRUE(gpu->submit());
        cpu.update();
        expectLightOf(*gpu, cpu);
    }
    vkDestroyPipelineCache(vulkan.device, vulkan.pipeline_cache, nullptr);
}

}  // namespace
}  // namespace dimmer
