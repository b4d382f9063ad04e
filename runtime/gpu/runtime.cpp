#include <dimmer/runtime.h>

#include <gpu/lightmap_pages.h>
#include <gpu/texel_blender.h>
#include <gpu/texel_executor.h>
#include <gpu/update_timer.h>
#include <gpu/vk_result.h>
#include <gpu/vk_struct.h>

#include <chrono>
#include <limits>
#include <optional>

namespace dimmer {
namespace {

double microsecondsSince(std::chrono::steady_clock::time_point start) {
    return std::chrono::duration<double, std::micro>(std::chrono::steady_clock::now() - start).count();
}

Expected<void> checkContext(const VulkanContext& vulkan) {
    if (vulkan.instance && vulkan.physical_device && vulkan.device && vulkan.queue) return {};
    return fail(ErrorCode::InvalidArgument,
                "The VulkanContext has a null handle; instance, physical device, device "
                "and queue are all needed.");
}

Expected<SemaphoreHandle> createTimeline(VkDevice device) {
    auto type = vkStruct<VkSemaphoreTypeCreateInfo>(VK_STRUCTURE_TYPE_SEMAPHORE_TYPE_CREATE_INFO);
    type.semaphoreType = VK_SEMAPHORE_TYPE_TIMELINE;
    const auto info = vkStruct<VkSemaphoreCreateInfo>(VK_STRUCTURE_TYPE_SEMAPHORE_CREATE_INFO, &type);
    VkSemaphore semaphore = VK_NULL_HANDLE;
    DIMMER_VK(vkCreateSemaphore, device, &info, nullptr, &semaphore);
    return SemaphoreHandle(device, semaphore);
}

}  // namespace

// Everything on the device. Members are destroyed in reverse, after waiting for what submit() sent.
struct Runtime::Impl {
    VulkanContext vulkan;
    LightmapPages pages;
    std::unique_ptr<TexelExecutor> executor;  // none when the pack has no receivers
    std::optional<UpdateTimer> timer;
    CommandBuffer own;
    SemaphoreHandle timeline;
    uint64_t submitted = 0;  // the timeline's value when the last submission is done
    UpdateStats stats;       // of the last update
    bool timed = false;      // the last update wrote timestamps that were not read yet

    ~Impl() { (void)waitForSubmitted(); }

    Expected<void> create(const PackData& data, const Planner& planner, const RuntimeOptions& options);
    Expected<void> waitForSubmitted() const;
    void recordUpdate(VkCommandBuffer commands, const Planner& planner);
    Expected<void> submitUpdate(const Planner& planner);
};

Expected<void> Runtime::Impl::create(const PackData& data, const Planner& planner, const RuntimeOptions& options) {
    auto transfer = Transfer::create(vulkan, MemoryUse::Upload);
    if (!transfer) return std::unexpected(std::move(transfer.error()));
    auto made_pages = LightmapPages::create(vulkan, data, *transfer);
    if (!made_pages) return std::unexpected(std::move(made_pages.error()));
    pages = std::move(*made_pages);
    auto made_timeline = createTimeline(vulkan.device);
    if (!made_timeline) return std::unexpected(std::move(made_timeline.error()));
    timeline = std::move(*made_timeline);
    if (data.payload.empty()) return {};  // nothing can ever change

    auto made_executor = createExecutor(vulkan, options.mode, data, planner, pages, *transfer);
    if (!made_executor) return std::unexpected(std::move(made_executor.error()));
    executor = std::move(*made_executor);
    if (options.timestamps) {
        auto made_timer = UpdateTimer::create(vulkan);
        if (!made_timer) return std::unexpected(std::move(made_timer.error()));
        timer = std::move(*made_timer);
    }
    auto made_commands = createCommandBuffer(vulkan);
    if (!made_commands) return std::unexpected(std::move(made_commands.error()));
    own = std::move(*made_commands);
    return {};
}

Expected<void> Runtime::Impl::waitForSubmitted() const {
    if (submitted == 0) return {};
    const VkSemaphore semaphore = timeline.get();
    auto info = vkStruct<VkSemaphoreWaitInfo>(VK_STRUCTURE_TYPE_SEMAPHORE_WAIT_INFO);
    info.semaphoreCount = 1;
    info.pSemaphores = &semaphore;
    info.pValues = &submitted;
    DIMMER_VK(vkWaitSemaphores, vulkan.device, &info, std::numeric_limits<uint64_t>::max());
    return {};
}

void Runtime::Impl::recordUpdate(VkCommandBuffer commands, const Planner& planner) {
    executor->write(planner);
    if (timer) timer->reset(commands);
    pages.beginWrites(commands);
    if (timer) timer->begin(commands);
    stats.dispatches = executor->dispatch(commands, planner);
    if (timer) timer->end(commands);
    pages.endWrites(commands);
    timed = timer.has_value();
}

Expected<void> Runtime::Impl::submitUpdate(const Planner& planner) {
    auto begin = vkStruct<VkCommandBufferBeginInfo>(VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO);
    begin.flags = VK_COMMAND_BUFFER_USAGE_ONE_TIME_SUBMIT_BIT;
    DIMMER_VK(vkBeginCommandBuffer, own.commands, &begin);
    recordUpdate(own.commands, planner);
    DIMMER_VK(vkEndCommandBuffer, own.commands);

    const VkSemaphore semaphore = timeline.get();
    const uint64_t value = submitted + 1;
    auto values = vkStruct<VkTimelineSemaphoreSubmitInfo>(VK_STRUCTURE_TYPE_TIMELINE_SEMAPHORE_SUBMIT_INFO);
    values.signalSemaphoreValueCount = 1;
    values.pSignalSemaphoreValues = &value;
    auto info = vkStruct<VkSubmitInfo>(VK_STRUCTURE_TYPE_SUBMIT_INFO, &values);
    info.commandBufferCount = 1;
    info.pCommandBuffers = &own.commands;
    info.signalSemaphoreCount = 1;
    info.pSignalSemaphores = &semaphore;
    DIMMER_VK(vkQueueSubmit, vulkan.queue, 1, &info, VK_NULL_HANDLE);
    submitted = value;
    return {};
}

Expected<Runtime> Runtime::create(const VulkanContext& vulkan, const Pack& pack, const RuntimeOptions& options) {
    DIMMER_TRY(checkContext(vulkan));
    auto impl = std::make_unique<Impl>();
    impl->vulkan = vulkan;
    Runtime runtime(pack, std::move(impl));
    DIMMER_TRY(runtime.impl_->create(pack.data(), runtime.planner(), options));
    return runtime;
}

Runtime::Runtime(const Pack& pack, std::unique_ptr<Impl> impl) : LightState(pack), impl_(std::move(impl)) {}
Runtime::~Runtime() = default;
Runtime::Runtime(Runtime&&) noexcept = default;
Runtime& Runtime::operator=(Runtime&&) noexcept = default;

Expected<UpdateStats> Runtime::record(VkCommandBuffer commands) {
    const auto start = std::chrono::steady_clock::now();
    const bool any = planner().plan();
    impl_->stats = planner().stats();
    impl_->timed = false;
    if (any) {
        // An update that submit() sent may still be reading the work list.
        if (auto done = impl_->waitForSubmitted(); !done) {
            planner().rollback();
            return std::unexpected(std::move(done.error()));
        }
        impl_->recordUpdate(commands, planner());
    }
    impl_->stats.host_us = microsecondsSince(start);
    return impl_->stats;
}

Expected<UpdateStats> Runtime::submit() {
    auto start = std::chrono::steady_clock::now();
    const bool any = planner().plan();
    impl_->stats = planner().stats();
    impl_->timed = false;
    impl_->stats.host_us = microsecondsSince(start);
    if (!any) return impl_->stats;

    auto sent = impl_->waitForSubmitted();
    start = std::chrono::steady_clock::now();
    if (sent) sent = impl_->submitUpdate(planner());
    if (!sent) {
        planner().rollback();
        impl_->timed = false;
        return std::unexpected(std::move(sent.error()));
    }
    impl_->stats.host_us += microsecondsSince(start);
    return impl_->stats;
}

VkSemaphore Runtime::semaphore() const {
    return impl_->timeline.get();
}
uint64_t Runtime::semaphoreValue() const {
    return impl_->submitted;
}

Expected<UpdateStats> Runtime::wait() {
    DIMMER_TRY(impl_->waitForSubmitted());
    if (impl_->timed) {
        const auto gpu_us = impl_->timer->read();
        if (!gpu_us) return std::unexpected(gpu_us.error());
        if (*gpu_us) {
            impl_->stats.gpu_us = **gpu_us;
            impl_->timed = false;
        }
    }
    return impl_->stats;
}

LightmapImages Runtime::images() const {
    return impl_->pages.images();
}

DeviceFootprint Runtime::footprint() const {
    DeviceFootprint footprint{.bytes = impl_->pages.deviceBytes(), .pipelines = 0};
    if (impl_->executor) {
        footprint.bytes += impl_->executor->deviceBytes();
        footprint.pipelines = impl_->executor->pipelineCount();
    }
    return footprint;
}

Expected<Runtime::Pages> Runtime::readPages() {
    auto transfer = Transfer::create(impl_->vulkan, MemoryUse::Readback);
    if (!transfer) return std::unexpected(std::move(transfer.error()));
    return impl_->pages.read(*transfer);
}

}  // namespace dimmer
