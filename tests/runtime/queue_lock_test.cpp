// A queue that frames use while a level is created and updated; under validation, which sees two users at a time.
#include <dimmer/cpu_runtime.h>
#include <dimmer/runtime.h>
#include <gmock/gmock.h>

#include <gpu/vk_struct.h>

#include <atomic>
#include <mutex>
#include <thread>

#include "gpu_fixture.h"
#include "model_pack.h"
#include "pages.h"

namespace dimmer {
namespace {

using test::packOf;

// What a game has: a mutex for its queue.
struct LockedQueue {
    std::mutex mutex;
    VkQueue expected = VK_NULL_HANDLE;
    std::thread::id holder;
    uint32_t uses = 0, faults = 0;  // guarded by the mutex

    QueueLock lock() {
        return {.lock =
                    [](void* user, VkQueue queue) {
                        auto& self = *static_cast<LockedQueue*>(user);
                        self.mutex.lock();
                        self.faults += queue != self.expected || self.holder != std::thread::id();
                        self.holder = std::this_thread::get_id();
                        ++self.uses;
                    },
                .unlock =
                    [](void* user, VkQueue queue) {
                        auto& self = *static_cast<LockedQueue*>(user);
                        self.faults += queue != self.expected || self.holder != std::this_thread::get_id();
                        self.holder = {};
                        self.mutex.unlock();
                    },
                .user = this};
    }
};

class QueueLocks : public test::GpuTest {
   protected:
    QueueLocks() {
        vulkan_.queue_lock = queue_.lock();
        queue_.expected = vulkan_.queue;
    }
    uint32_t usesSince(uint32_t before) {
        const std::scoped_lock lock(queue_.mutex);
        return queue_.uses - before;
    }

    VulkanContext vulkan_ = device().context();
    LockedQueue queue_;
};

Pack packWithRecords() {
    return packOf(test::modelPack(85, 60, [](glm::vec3 p) { return glm::vec3(0.1f + 0.05f * p.x); }));
}

// Every submission takes the lock, and lets it go.
TEST_F(QueueLocks, EachUseOfTheQueueIsLocked) {
    const Pack pack = packWithRecords();
    auto gpu = Runtime::create(vulkan_, pack, {.load_records = false});
    ASSERT_TRUE(gpu) << gpu.error().message;
    uint32_t uses = usesSince(0);
    EXPECT_GT(uses, 0u);
    const auto set = findLightSet(pack, pack.elements()[0].name);
    ASSERT_TRUE(set);
    ASSERT_TRUE(gpu->loadRecords(*set));
    while (gpu->recordsState(*set) != RecordsState::Loaded) ASSERT_TRUE(gpu->continueLoading());
    EXPECT_GT(usesSince(uses), 0u);
    uses = usesSince(0);
    ASSERT_TRUE(gpu->setWeight(*set, 0.5f));
    ASSERT_TRUE(gpu->submit());
    EXPECT_EQ(usesSince(uses), 1u);
    ASSERT_TRUE(gpu->submit());
    EXPECT_EQ(usesSince(uses), 1u) << "nothing changed: no submission";
    ASSERT_TRUE(gpu->readPages());
    EXPECT_GT(usesSince(uses), 1u);
    EXPECT_EQ(queue_.faults, 0u);
    EXPECT_EQ(queue_.holder, std::thread::id());
}

TEST_F(QueueLocks, FramesGoOnWhileALevelIsCreated) {
    const Pack pack = packWithRecords();
    std::atomic<bool> done = false;
    std::atomic<uint32_t> frames = 0;
    std::thread renderer([&] {
        const auto frame = vkStruct<VkSubmitInfo>(VK_STRUCTURE_TYPE_SUBMIT_INFO);
        while (!done) {
            {
                const std::scoped_lock lock(queue_.mutex);
                EXPECT_EQ(vkQueueSubmit(vulkan_.queue, 1, &frame, VK_NULL_HANDLE), VK_SUCCESS);
            }
            ++frames;
            std::this_thread::yield();  // a mutex need not be fair
        }
    });
    for (int i = 0; i < 8 || frames < 8; ++i) {
        auto gpu = Runtime::create(vulkan_, pack);
        ASSERT_TRUE(gpu) << gpu.error().message;
        CpuRuntime cpu(pack);
        EXPECT_TRUE(gpu->apply("all=0.5") && cpu.apply("all=0.5"));
        EXPECT_TRUE(gpu->submit());
        cpu.update();
        const auto pages = gpu->readPages();
        ASSERT_TRUE(pages) << pages.error().message;
        EXPECT_TRUE(std::ranges::equal(pages->irradiance, cpu.irradiancePages()));
    }
    done = true;
    renderer.join();
    EXPECT_EQ(queue_.faults, 0u);
}

TEST_F(QueueLocks, HalfALockIsNone) {
    vulkan_.queue_lock.unlock = nullptr;
    const auto refused = Runtime::create(vulkan_, packWithRecords());
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, ErrorCode::InvalidArgument);
    EXPECT_THAT(refused.error().message, testing::HasSubstr("give both"));
}

// What C's int holds, and a cast may.
TEST_F(QueueLocks, OptionsThatDoNotExistAreRefused) {
    const Pack pack = packWithRecords();
    for (const RuntimeOptions& options :
         {RuntimeOptions{.mode = static_cast<UpdateMode>(4)}, RuntimeOptions{.buffering = static_cast<Buffering>(2)}}) {
        const auto refused = Runtime::create(vulkan_, pack, options);
        ASSERT_FALSE(refused);
        EXPECT_EQ(refused.error().code, ErrorCode::InvalidArgument);
    }
    auto gpu = Runtime::create(vulkan_, pack);
    ASSERT_TRUE(gpu);
    for (int i = 0; i < 2; ++i) {
        const auto recorded = gpu->record(VK_NULL_HANDLE);  // with work, and without
        ASSERT_FALSE(recorded);
        EXPECT_EQ(recorded.error().code, ErrorCode::InvalidArgument);
        ASSERT_TRUE(gpu->submit());
        ASSERT_TRUE(gpu->wait());
    }
}

}  // namespace
}  // namespace dimmer
