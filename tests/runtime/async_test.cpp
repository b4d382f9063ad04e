// Two sets of pages, limits on the device, and a queue of the runtime's own; all under synchronisation validation.
// lavapipe has one queue: the path of the own queue runs, but nothing here proves what crosses queues.
#include <dimmer/cpu_runtime.h>
#include <dimmer/runtime.h>

#include <format/texel.h>
#include <gpu/transfer.h>

#include "gpu_fixture.h"
#include "pages.h"

namespace dimmer {
namespace {

using test::packOf;

class AsyncTest : public test::GpuTest {
   protected:
    static Runtime runtimeOn(const VulkanContext& vulkan, const Pack& pack, const RuntimeOptions& options = {}) {
        auto runtime = Runtime::create(vulkan, pack, options);
        if (!runtime) throw std::runtime_error(runtime.error().message);
        return std::move(*runtime);
    }
    static void showWholeStates(uint32_t budget_step);
    static void expectEqualPages(Runtime& gpu, const CpuRuntime& cpu) {
        const auto pages = gpu.readPages();
        ASSERT_TRUE(pages) << pages.error().message;
        ASSERT_TRUE(std::ranges::equal(pages->irradiance, cpu.irradiancePages()));
        ASSERT_TRUE(std::ranges::equal(pages->direction, cpu.directionPages()));
    }
    // Light as a runtime shows it that was created for this state.
    static void expectFreshPages(Runtime& gpu) {
        Runtime fresh = runtimeOf(gpu.pack());
        test::copyState(gpu, fresh);
        ASSERT_TRUE(fresh.submit());
        const auto pages = gpu.readPages(), expected = fresh.readPages();
        ASSERT_TRUE(pages && expected);
        EXPECT_TRUE(pages->irradiance == expected->irradiance);
        EXPECT_TRUE(pages->direction == expected->direction);
        EXPECT_TRUE(pages->probes == expected->probes);
    }
    static void recordInto(VkCommandBuffer commands, Runtime& gpu) {
        VkCommandBufferBeginInfo begin{VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO, nullptr, 0, nullptr};
        ASSERT_EQ(vkBeginCommandBuffer(commands, &begin), VK_SUCCESS);
        ASSERT_GT(gpu.record(commands)->dispatches, 0u);
        ASSERT_EQ(vkEndCommandBuffer(commands), VK_SUCCESS);
    }
    // An update in commands that never run.
    static void recordInVain(Runtime& gpu) {
        auto commands = createCommandBuffer(device().context().device, device().context().queue_family);
        ASSERT_TRUE(commands);
        recordInto(commands->commands, gpu);
    }
    static void recordAndRun(Runtime& gpu) {
        const VulkanContext vulkan = device().context();
        auto commands = createCommandBuffer(vulkan.device, vulkan.queue_family);
        ASSERT_TRUE(commands);
        recordInto(commands->commands, gpu);
        VkSubmitInfo submit{};
        submit.sType = VK_STRUCTURE_TYPE_SUBMIT_INFO;
        submit.commandBufferCount = 1;
        submit.pCommandBuffers = &commands->commands;
        ASSERT_EQ(vkQueueSubmit(vulkan.queue, 1, &submit, VK_NULL_HANDLE), VK_SUCCESS);
        ASSERT_EQ(vkQueueWaitIdle(vulkan.queue), VK_SUCCESS);
    }
    // Updates until limits leave nothing for later.
    static void submitAll(Runtime& gpu) {
        for (;;) {
            const auto sent = gpu.submit();
            ASSERT_TRUE(sent) << sent.error().message;
            if (sent->receivers_waiting == 0) return;
        }
    }
};

// A budget, and a tolerance that is so small that nothing which shows is put off.
const UpdateLimits waiting_limits[] = {{.receivers_max = 300}, {.tolerance_quanta = 1e-9f}};

TEST_F(AsyncTest, TwoSetsOfPagesTakeTurnsAndBothCatchUp) {
    const Pack pack = packOf(test::randomPack(61));
    for (const UpdateMode mode : {UpdateMode::WorkList, UpdateMode::PerCombination}) {
        Runtime gpu = runtimeOf(pack, {.mode = mode, .buffering = Buffering::Double});
        CpuRuntime cpu(pack);
        test::Random random(61);
        uint32_t shown = gpu.pageSet();
        for (int step = 0; step < 20; ++step) {
            ASSERT_TRUE(gpu.submit());
            EXPECT_NE(gpu.pageSet(), shown);
            shown = gpu.pageSet();
            cpu.update();
            expectEqualPages(gpu, cpu);
            // One element at a time: the other set of pages lacks the change before as well.
            test::setElement(gpu, static_cast<uint32_t>(step % 12), static_cast<float>(step + 1) / 32);
            test::setElement(cpu, static_cast<uint32_t>(step % 12), static_cast<float>(step + 1) / 32);
        }
    }
}

TEST_F(AsyncTest, ASecondSetOfPagesKeepsTheOldLightMeanwhile) {
    const Pack pack = packOf(test::randomPack(62, {.doors = 0}));
    Runtime gpu = runtimeOf(pack, {.buffering = Buffering::Double});
    ASSERT_TRUE(gpu.submit());
    const LightmapImages old = gpu.images();
    ASSERT_TRUE(gpu.apply("all=0"));
    ASSERT_TRUE(gpu.submit());
    EXPECT_NE(gpu.images().irradiance, old.irradiance);
    EXPECT_EQ(gpu.images(gpu.pageSet() ^ 1).irradiance, old.irradiance);
    const uint64_t value = gpu.semaphoreValue();
    ASSERT_TRUE(gpu.submit());
    EXPECT_EQ(gpu.semaphoreValue(), value) << "nothing changed, though the other set of pages is a step behind";
    // Back to a state that the other set holds already: it is shown without any work.
    ASSERT_TRUE(gpu.apply("all=1"));
    EXPECT_EQ(gpu.submit()->dispatches, 0u);
    EXPECT_EQ(gpu.semaphoreValue(), value);
    EXPECT_EQ(gpu.images().irradiance, old.irradiance);
    CpuRuntime cpu(pack);
    cpu.update();
    expectEqualPages(gpu, cpu);
}

// A weight of 1 is 100 steps of the format, by which the tolerance counts. What is shown goes on being shown while it
// is within the tolerance: the other pages, as old as the last but one state, may be within it too, and no better.
TEST_F(AsyncTest, WithinTheToleranceTheSamePagesAreShown) {
    PackData data = test::emptyPack(1, 0);
    data.page_count = 1;
    data.page_width = data.page_height = 8;
    test::Random random(77);
    const test::ClusterPlan plans[] = {{{0}, 64}};
    test::fillPack(data, plans, random);
    constexpr uint32_t none = 1023u | 512u << 10 | 512u << 20;
    // Of a base of 1 the step is 1/64 in red and green, and 1/32 in blue.
    for (TexelRecord& record : data.base_pages) record = {encodeR11G11B10(1, 1, 1), none};
    for (TexelRecord& record : data.payload) record = {encodeR11G11B10(100 / 64.0f, 100 / 64.0f, 100 / 64.0f), none};
    const Pack pack = packOf(std::move(data));
    Runtime gpu = runtimeOf(pack, {.buffering = Buffering::Double});
    ASSERT_TRUE(gpu.setLimits({.tolerance_quanta = 4}));
    struct Step {
        float weight;
        bool shows;  // further than 4 steps from what was shown last
    };
    constexpr Step steps[] = {
        {.50f, true},   {.53f, false},  {.531f, false}, {.532f, false}, {.47f, false}, {.545f, true}, {.515f, false},
        {.520f, false}, {.519f, false}, {.521f, false}, {.50f, true},   {.53f, false}, {.545f, true},
    };
    CpuRuntime shown(pack);
    for (const Step& step : steps) {
        SCOPED_TRACE(step.weight);
        const uint32_t before = gpu.pageSet();
        ASSERT_TRUE(gpu.setWeight(LightSet{0}, step.weight));
        const auto sent = gpu.submit();
        ASSERT_TRUE(sent);
        EXPECT_EQ(gpu.pageSet() != before, step.shows);
        if (!step.shows) {
            EXPECT_EQ(sent->clusters_put_off, 1u);
        }
        for (int idle = 0; idle < 3; ++idle) {
            EXPECT_EQ(gpu.submit()->dispatches, 0u);
            EXPECT_EQ(gpu.pageSet() != before, step.shows);
        }
        if (step.shows) {
            ASSERT_TRUE(shown.setWeight(LightSet{0}, step.weight));
        }
        shown.update();
        expectEqualPages(gpu, shown);
    }
    ASSERT_TRUE(gpu.setWeight(LightSet{0}, .53f) && gpu.setLimits({}));
    ASSERT_TRUE(gpu.submit());
    expectFreshPages(gpu);
}

TEST_F(AsyncTest, ModesThatWriteEverythingHaveOneSetOfPages) {
    for (const UpdateMode mode : {UpdateMode::Gather, UpdateMode::Scatter}) {
        const auto refused = Runtime::create(device().context(), packOf(test::randomPack(1)),
                                             {.mode = mode, .buffering = Buffering::Double});
        ASSERT_FALSE(refused);
        EXPECT_EQ(refused.error().code, ErrorCode::Unsupported);
    }
}

TEST_F(AsyncTest, ABudgetConvergesInPlace) {
    const Pack pack = packOf(test::randomPack(63));
    Runtime gpu = runtimeOf(pack);
    CpuRuntime cpu(pack);
    ASSERT_TRUE(gpu.setLimits({.receivers_max = 500}) && cpu.setLimits({.receivers_max = 500}));
    test::Random random(63);
    for (int round = 0; round < 3; ++round) {
        for (;;) {
            const auto stats = gpu.submit();
            ASSERT_TRUE(stats);
            cpu.update();
            expectEqualPages(gpu, cpu);  // at every step: both leave the same for later
            if (stats->batches == 0) break;
            EXPECT_LE(stats->receivers, 500u);
        }
        CpuRuntime fresh(pack);
        test::copyState(gpu, fresh);
        fresh.update();
        expectEqualPages(gpu, fresh);
        const std::string state = test::randomState(pack.data(), random);
        ASSERT_TRUE(gpu.apply(state) && cpu.apply(state));
    }
}

// With two sets of pages a state is shown when all of it is there, even while the next one comes in: whether the budget
// stays or goes with each frame.
void AsyncTest::showWholeStates(uint32_t budget_step) {
    const Pack pack = packOf(test::randomPack(64, {.doors = 0}));
    ASSERT_GT(pack.contributions()[3].receivers, 600u) << "a budget must be less than what changes in every frame";
    Runtime gpu = runtimeOf(pack, {.buffering = Buffering::Double});
    uint32_t shown = gpu.pageSet(), states = 0;
    CpuRuntime begun(pack);  // what is being written: the state at its first update
    for (uint32_t frame = 0; frame < 120; ++frame) {
        ASSERT_TRUE(gpu.setLimits({.receivers_max = 500 + frame % 3 * budget_step}));
        ASSERT_TRUE(gpu.setWeight(LightSet{3}, static_cast<float>(frame) / 128));
        const bool begins = frame == 0 || gpu.pageSet() != shown;
        if (begins) {
            shown = gpu.pageSet();
            test::copyState(gpu, begun);
        }
        ASSERT_TRUE(gpu.submit());
        if (gpu.pageSet() != shown) {
            begun.update();
            expectEqualPages(gpu, begun);
            ++states;
        }
    }
    EXPECT_GT(states, 5u);
}

TEST_F(AsyncTest, ABudgetWithTwoSetsOfPagesShowsWholeStates) {
    showWholeStates(0);
}

TEST_F(AsyncTest, ABudgetThatGoesWithTheFrameShowsWholeStates) {
    showWholeStates(40);
}

// A lamp that is lit and put out again before its pages are complete.
TEST_F(AsyncTest, AStateThatIsCalledBackIsNeverShown) {
    const Pack pack = packOf(test::randomPack(64));
    Runtime gpu = runtimeOf(pack, {.buffering = Buffering::Double});
    submitAll(gpu);
    const auto before = gpu.readPages();
    ASSERT_TRUE(before && gpu.setLimits({.receivers_max = 300}));
    ASSERT_TRUE(gpu.apply("all=0.25"));
    ASSERT_GT(gpu.submit()->receivers_waiting, 0u);
    ASSERT_TRUE(gpu.apply("all=1"));
    submitAll(gpu);
    EXPECT_TRUE(gpu.readPages()->irradiance == before->irradiance);
    ASSERT_TRUE(gpu.apply("all=0.5"));
    const uint32_t shown = gpu.pageSet();
    for (int update = 0; update < 1000 && gpu.pageSet() == shown; ++update) {
        ASSERT_TRUE(gpu.readPages()->irradiance == before->irradiance);
        ASSERT_TRUE(gpu.submit());
    }
    ASSERT_NE(gpu.pageSet(), shown);
    expectFreshPages(gpu);
}

// Light probes are not limited: each update brings them, while the pages' state is still coming in.
TEST_F(AsyncTest, ABudgetOfTexelsLeavesProbesUpToDate) {
    test::Random random(66);
    PackData data = test::randomPack(66);
    test::addRandomProbes(data, random);
    const Pack pack = packOf(std::move(data));
    for (const Buffering buffering : {Buffering::InPlace, Buffering::Double}) {
        Runtime gpu = runtimeOf(pack, {.buffering = buffering});
        CpuRuntime cpu(pack);
        ASSERT_TRUE(gpu.setLimits({.receivers_max = 200}));
        for (int frame = 0; frame < 12; ++frame) {
            const std::string state = test::randomState(pack.data(), random);
            ASSERT_TRUE(gpu.apply(state) && cpu.apply(state));
            ASSERT_TRUE(gpu.submit());
            cpu.update();
            const auto pages = gpu.readPages();
            ASSERT_TRUE(pages);
            ASSERT_TRUE(std::ranges::equal(pages->probes, cpu.probes())) << "frame " << frame;
        }
    }
}

// The records of a set are gone, or the limits are, while a state of it is half written on the pages that are not
// shown.
TEST_F(AsyncTest, AHalfWrittenStateGoesOnWithoutWhatWasDropped) {
    const Pack pack = packOf(test::randomPack(67, {.doors = 0}));
    Runtime gpu = runtimeOf(pack, {.buffering = Buffering::Double});
    ASSERT_TRUE(gpu.setLimits({.receivers_max = 300}));
    ASSERT_GT(gpu.submit()->receivers_waiting, 0u);
    ASSERT_TRUE(gpu.dropRecords(LightSet{0}));
    const uint32_t shown = gpu.pageSet();
    while (gpu.pageSet() == shown) ASSERT_TRUE(gpu.submit());
    CpuRuntime cpu(pack);
    ASSERT_TRUE(cpu.apply("set0=0"));
    cpu.update();
    expectEqualPages(gpu, cpu);
}

TEST_F(AsyncTest, WithoutLimitsTheNextUpdateIsExact) {
    const Pack pack = packOf(test::randomPack(68));
    for (const Buffering buffering : {Buffering::InPlace, Buffering::Double}) {
        Runtime gpu = runtimeOf(pack, {.buffering = buffering});
        ASSERT_TRUE(gpu.setLimits({.receivers_max = 300}));
        ASSERT_GT(gpu.submit()->receivers_waiting, 0u);
        ASSERT_TRUE(gpu.apply("all=0.25") && gpu.setLimits({}));
        EXPECT_EQ(gpu.submit()->receivers_waiting, 0u);
        CpuRuntime cpu(pack);
        ASSERT_TRUE(cpu.apply("all=0.25"));
        cpu.update();
        expectEqualPages(gpu, cpu);
        // The same limits again are no change: nothing runs, and the pages stay where they are.
        const uint32_t shown = gpu.pageSet();
        for (int i = 0; i < 3; ++i) {
            ASSERT_TRUE(gpu.setLimits({}) && gpu.submit());
            EXPECT_EQ(gpu.pageSet(), shown);
        }
    }
}

// No texel changes: the second set would be memory that nothing writes.
TEST_F(AsyncTest, PagesAreThereOnceWhereOnlyProbesChange) {
    test::Random random(70);
    PackData data = test::randomPack(70);
    data.clusters.clear(), data.terms.clear(), data.batches.clear(), data.addresses.clear(), data.payload.clear();
    for (Contribution& contribution : data.contributions) contribution.receivers = 0;
    test::addRandomProbes(data, random);
    const Pack pack = packOf(std::move(data));
    Runtime gpu = runtimeOf(pack, {.buffering = Buffering::Double});
    CpuRuntime cpu(pack);
    EXPECT_EQ(gpu.images(0).irradiance, gpu.images(1).irradiance);
    EXPECT_NE(gpu.probes(0), gpu.probes(1));
    for (int round = 0; round < 8; ++round) {
        const std::string state = test::randomState(pack.data(), random);
        ASSERT_TRUE(gpu.apply(state) && cpu.apply(state));
        ASSERT_TRUE(gpu.submit());
        cpu.update();
        expectEqualPages(gpu, cpu);
        EXPECT_TRUE(std::ranges::equal(gpu.readPages()->probes, cpu.probes()));
    }
}

TEST_F(AsyncTest, ARecordingThatNeverRunsIsMadeUpFor) {
    test::Random random(69);
    PackData data = test::randomPack(69);
    test::addRandomProbes(data, random);
    const Pack pack = packOf(std::move(data));
    for (const Buffering buffering : {Buffering::InPlace, Buffering::Double})
        for (const UpdateLimits& limits : {UpdateLimits{}, waiting_limits[0], waiting_limits[1]}) {
            Runtime gpu = runtimeOf(pack, {.buffering = buffering});
            CpuRuntime cpu(pack);
            ASSERT_TRUE(gpu.setLimits(limits));
            submitAll(gpu);
            cpu.update();
            const uint32_t shown = gpu.pageSet();
            for (int round = 0; round < 3; ++round) {
                const std::string state = test::randomState(pack.data(), random);
                ASSERT_TRUE(gpu.apply(state) && cpu.apply(state));
                recordInVain(gpu);
                gpu.discardRecorded();
                gpu.discardRecorded();  // once is enough
            }
            EXPECT_EQ(gpu.pageSet(), shown);
            submitAll(gpu);
            gpu.discardRecorded();  // what was sent stays
            cpu.update();
            expectEqualPages(gpu, cpu);
            EXPECT_TRUE(std::ranges::equal(gpu.readPages()->probes, cpu.probes()));
        }
}

// The frames after it found nothing to do, by either way, before it turned out that it never runs.
TEST_F(AsyncTest, ARecordingThatNeverRunsIsMadeUpForAfterIdleUpdates) {
    test::Random random(72);
    PackData data = test::randomPack(72);
    test::addRandomProbes(data, random);
    const Pack pack = packOf(std::move(data));
    for (const Buffering buffering : {Buffering::InPlace, Buffering::Double}) {
        Runtime gpu = runtimeOf(pack, {.buffering = buffering});
        ASSERT_TRUE(gpu.submit());
        ASSERT_TRUE(gpu.apply("all=0.5"));
        const uint32_t shown = gpu.pageSet(), probes_shown = gpu.probeSet();
        recordInVain(gpu);
        EXPECT_EQ(gpu.record(test::untouchedCommands())->dispatches, 0u);
        EXPECT_EQ(gpu.submit()->dispatches, 0u);
        gpu.discardRecorded();
        EXPECT_EQ(gpu.pageSet(), shown);
        EXPECT_EQ(gpu.probeSet(), probes_shown);
        EXPECT_GT(gpu.submit()->dispatches, 0u);
        expectFreshPages(gpu);
    }
}

// The idle update was a way back to the state that the other set of pages still holds.
TEST_F(AsyncTest, ARecordingThatNeverRunsIsMadeUpForAfterSetsChangedPlaces) {
    const Pack pack = packOf(test::randomPack(73, {.doors = 0}));
    Runtime gpu = runtimeOf(pack, {.buffering = Buffering::Double});
    ASSERT_TRUE(gpu.submit());
    const uint32_t shown = gpu.pageSet();
    ASSERT_TRUE(gpu.apply("all=0.5"));
    recordInVain(gpu);
    ASSERT_TRUE(gpu.apply("all=1"));
    ASSERT_EQ(gpu.record(test::untouchedCommands())->dispatches, 0u);
    ASSERT_EQ(gpu.pageSet(), shown);
    gpu.discardRecorded();
    ASSERT_TRUE(gpu.apply("all=0.5"));
    EXPECT_GT(gpu.submit()->dispatches, 0u) << "no pages hold this state";
    expectFreshPages(gpu);
}

// It was only the idle frame that was given up.
TEST_F(AsyncTest, TakingBackWhatDidRunLeavesThePagesExact) {
    const Pack pack = packOf(test::randomPack(74, {.doors = 0}));
    for (const Buffering buffering : {Buffering::InPlace, Buffering::Double}) {
        Runtime gpu = runtimeOf(pack, {.buffering = buffering});
        ASSERT_TRUE(gpu.submit() && gpu.wait());
        ASSERT_TRUE(gpu.apply("all=0.5"));
        recordAndRun(gpu);
        EXPECT_EQ(gpu.record(test::untouchedCommands())->dispatches, 0u);
        gpu.discardRecorded();
        ASSERT_TRUE(gpu.apply("all=1"));
        ASSERT_TRUE(gpu.submit());
        expectFreshPages(gpu);
    }
}

// Both sets of pages hold the light whose records go, before the recording that never runs or after it.
TEST_F(AsyncTest, ARecordingThatNeverRunsBringsNothingBackThatWasDropped) {
    const Pack pack = packOf(test::randomPack(71, {.doors = 0}));
    CpuRuntime cpu(pack);
    ASSERT_TRUE(cpu.apply("all=0.25,set2=0"));
    cpu.update();
    for (const UpdateLimits& limits : waiting_limits)
        for (const bool before : {true, false}) {
            Runtime gpu = runtimeOf(pack, {.buffering = Buffering::Double});
            ASSERT_TRUE(gpu.setLimits(limits));
            for (const char* state : {"all=1", "all=0.5"}) {
                ASSERT_TRUE(gpu.apply(state));
                submitAll(gpu);
            }
            if (before) {
                ASSERT_TRUE(gpu.dropRecords(LightSet{2}));
            }
            ASSERT_TRUE(gpu.apply("all=0.25"));
            recordInVain(gpu);
            if (!before) {
                ASSERT_TRUE(gpu.dropRecords(LightSet{2}));
            }
            gpu.discardRecorded();
            submitAll(gpu);
            expectEqualPages(gpu, cpu);
        }
}

// As a game does that says every frame what it does not need: it began the state that was half written anew each time.
TEST_F(AsyncTest, DroppingWhatIsDroppedBeginsNothingAnew) {
    Runtime gpu = runtimeOf(packOf(test::randomPack(71)), {.buffering = Buffering::Double});
    ASSERT_TRUE(gpu.dropRecords(LightSet{2}));
    submitAll(gpu);
    ASSERT_TRUE(gpu.setLimits({.receivers_max = 300}));
    ASSERT_TRUE(gpu.apply("all=0.5"));
    ASSERT_GT(gpu.submit()->receivers_waiting, 0u);
    const uint32_t shown = gpu.pageSet();
    for (int frame = 0; frame < 1000 && gpu.pageSet() == shown; ++frame) {
        ASSERT_TRUE(gpu.dropRecords(LightSet{2}));
        ASSERT_TRUE(gpu.setWeight(LightSet{1}, frame % 2 ? 0.25f : 0.75f));
        ASSERT_TRUE(gpu.submit());
    }
    EXPECT_NE(gpu.pageSet(), shown);
}

TEST_F(AsyncTest, FiguresOfAnUpdateOutliveIdleOnes) {
    Runtime gpu = runtimeOf(packOf(test::randomPack(70)));
    const auto sent = gpu.submit();
    ASSERT_TRUE(sent);
    EXPECT_EQ(gpu.submit()->receivers, 0u);
    const auto figures = gpu.wait();
    ASSERT_TRUE(figures);
    EXPECT_EQ(figures->receivers, sent->receivers);
    EXPECT_GT(figures->gpu_us, 0);
}

TEST_F(AsyncTest, TheOwnQueueWaitsForAndSignalsSemaphores) {
    VulkanContext vulkan = device().context();
    vulkan.compute_queue = vulkan.queue;
    vulkan.compute_queue_family = vulkan.queue_family;
    const Pack pack = packOf(test::randomPack(65));
    Runtime gpu = runtimeOn(vulkan, pack, {.buffering = Buffering::Double});
    CpuRuntime cpu(pack);

    VkSemaphoreTypeCreateInfo type{VK_STRUCTURE_TYPE_SEMAPHORE_TYPE_CREATE_INFO, nullptr, VK_SEMAPHORE_TYPE_TIMELINE,
                                   0};
    const VkSemaphoreCreateInfo info{VK_STRUCTURE_TYPE_SEMAPHORE_CREATE_INFO, &type, 0};
    VkSemaphore frames = VK_NULL_HANDLE;
    ASSERT_EQ(vkCreateSemaphore(vulkan.device, &info, nullptr, &frames), VK_SUCCESS);
    for (uint64_t frame = 1; frame <= 4; ++frame) {
        test::setElement(gpu, 0, static_cast<float>(frame) / 8);
        test::setElement(cpu, 0, static_cast<float>(frame) / 8);
        const uint64_t before = gpu.semaphoreValue();
        ASSERT_TRUE(gpu.submit({frames, frame}));
        EXPECT_EQ(gpu.semaphoreValue(), before + 1);
        const VkSemaphore written = gpu.semaphore();
        const uint64_t next = before + 1;
        const VkSemaphoreWaitInfo wait{
            VK_STRUCTURE_TYPE_SEMAPHORE_WAIT_INFO, nullptr, 0, 1, &written, &next,
        };
        constexpr uint64_t wait_ns = 200'000'000;  // an update that waits for nothing takes milliseconds
        EXPECT_EQ(vkWaitSemaphores(vulkan.device, &wait, wait_ns), VK_TIMEOUT)
            << "the frame has not finished, so nothing may have been written";
        const VkSemaphoreSignalInfo signal{VK_STRUCTURE_TYPE_SEMAPHORE_SIGNAL_INFO, nullptr, frames, frame};
        ASSERT_EQ(vkSignalSemaphore(vulkan.device, &signal), VK_SUCCESS);
        EXPECT_TRUE(gpu.wait());
        cpu.update();
        expectEqualPages(gpu, cpu);
    }
    vkDestroySemaphore(vulkan.device, frames, nullptr);
}

// Where the device has a second queue, everything once more on it; elsewhere the one queue does.
TEST_F(AsyncTest, WorksOnADeviceThatWasAskedForASecondQueue) {
    auto own = HeadlessDevice::create({.validation = true, .compute_queue = true});
    ASSERT_TRUE(own) << own.error().message;
    const Pack pack = packOf(test::randomPack(66));
    {
        Runtime gpu = runtimeOn(own->context(), pack, {.buffering = Buffering::Double});
        CpuRuntime cpu(pack);
        for (const char* state : {"set0=0.5", "all=0,set3=1", "door:door1=0.5"}) {
            ASSERT_TRUE(gpu.apply(state) && cpu.apply(state));
            ASSERT_TRUE(gpu.submit());
            cpu.update();
            expectEqualPages(gpu, cpu);
        }
    }
    EXPECT_EQ(own->validationMessages(), std::vector<std::string>());
}

}  // namespace
}  // namespace dimmer
