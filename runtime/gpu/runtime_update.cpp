// Planning, recording and sending updates.
#include <gpu/runtime_impl.h>

#include <gpu/queue_turn.h>
#include <gpu/vk_result.h>
#include <gpu/vk_struct.h>

#include <chrono>
#include <limits>
#include <utility>

namespace dimmer {
namespace {

double microsecondsSince(std::chrono::steady_clock::time_point start) {
    return std::chrono::duration<double, std::micro>(std::chrono::steady_clock::now() - start).count();
}

// What the other queue wrote, and the host has waited for, is available; a host wait does not make it visible here.
void seeOtherQueue(VkCommandBuffer commands) {
    constexpr VkPipelineStageFlags stages = VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT | VK_PIPELINE_STAGE_TRANSFER_BIT;
    memoryBarrier(commands, stages, VK_ACCESS_MEMORY_WRITE_BIT, stages,
                  VK_ACCESS_SHADER_READ_BIT | VK_ACCESS_TRANSFER_READ_BIT);
}

}  // namespace

Expected<void> Runtime::Impl::waitFor(uint64_t value) const {
    if (value == 0) return {};
    const VkSemaphore semaphore = timeline.get();
    auto info = vkStruct<VkSemaphoreWaitInfo>(VK_STRUCTURE_TYPE_SEMAPHORE_WAIT_INFO);
    info.semaphoreCount = 1;
    info.pSemaphores = &semaphore;
    info.pValues = &value;
    DIMMER_VK(vkWaitSemaphores, vulkan.device, &info, std::numeric_limits<uint64_t>::max());
    return {};
}

// The next update's, once submit()'s update that had it before is done. What the other queue does, a recording cannot
// be ordered behind but by waiting.
Expected<void> Runtime::Impl::takeList(bool for_recording) {
    const uint32_t next = (list + 1) % static_cast<uint32_t>(lists.size());
    DIMMER_TRY(waitFor(for_recording && ownQueue() != vulkan.queue ? submitted : lists[next].submitted));
    list = next;
    lists[list].submitted = 0;
    return {};
}

void Runtime::Impl::recordUpdate(VkCommandBuffer commands, const Planner& planner, const Planner* probe_planner,
                                 bool drawing) {
    if (ownQueue() != vulkan.queue) seeOtherQueue(commands);
    if (texels_planned) executor->write(planner, list);
    if (probes_planned) probes->write(*probe_planner, list);
    if (models_planned) resampler->write(model_items, list);
    if (timer) timer->reset(commands, list);
    if (texels_planned) pages[target].beginWrites(commands, drawing);
    if (timer) timer->begin(commands, list);
    if (texels_planned) stats.dispatches += executor->dispatch(commands, planner, {target, list});
    if (probes_planned || models_planned)
        stats.dispatches += dispatchProbes(commands, probe_planner, pages[target].readers(drawing));
    if (timer) timer->end(commands, list);
    if (texels_planned) pages[target].endWrites(commands, drawing);
    timed = timer.has_value();
}

uint32_t Runtime::Impl::dispatchProbes(VkCommandBuffer commands, const Planner* probe_planner,
                                       VkPipelineStageFlags readers) {
    uint32_t dispatches = 0;
    ProbeAtlas::beginWrites(commands, readers);
    if (probes_planned) dispatches += probes->dispatch(commands, *probe_planner, {probe_target, list});
    if (models_planned) {
        ProbeAtlas::betweenWrites(commands);
        resampler->dispatch(commands, {probe_target, list});
        ++dispatches;
    }
    ProbeAtlas::endWrites(commands, readers);
    return dispatches;
}

Expected<void> Runtime::Impl::submitUpdate(const Planner& planner, const Planner* probe_planner,
                                           const SubmitWait& wait) {
    auto begin = vkStruct<VkCommandBufferBeginInfo>(VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO);
    begin.flags = VK_COMMAND_BUFFER_USAGE_ONE_TIME_SUBMIT_BIT;
    const VkCommandBuffer commands = lists[list].own.commands;
    DIMMER_VK(vkBeginCommandBuffer, commands, &begin);
    recordUpdate(commands, planner, probe_planner, ownQueue() == vulkan.queue);
    DIMMER_VK(vkEndCommandBuffer, commands);

    const VkSemaphore semaphore = timeline.get();
    const uint64_t value = submitted + 1;
    auto values = vkStruct<VkTimelineSemaphoreSubmitInfo>(VK_STRUCTURE_TYPE_TIMELINE_SEMAPHORE_SUBMIT_INFO);
    values.signalSemaphoreValueCount = 1;
    values.pSignalSemaphoreValues = &value;
    values.waitSemaphoreValueCount = wait.semaphore ? 1 : 0;
    values.pWaitSemaphoreValues = &wait.value;
    auto info = vkStruct<VkSubmitInfo>(VK_STRUCTURE_TYPE_SUBMIT_INFO, &values);
    info.commandBufferCount = 1;
    info.pCommandBuffers = &commands;
    info.signalSemaphoreCount = 1;
    info.pSignalSemaphores = &semaphore;
    const VkPipelineStageFlags stages = VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT;
    info.waitSemaphoreCount = wait.semaphore ? 1 : 0;
    info.pWaitSemaphores = &wait.semaphore;
    info.pWaitDstStageMask = &stages;
    const QueueTurn turn(vulkan.queue_lock, ownQueue());
    DIMMER_VK(vkQueueSubmit, ownQueue(), 1, &info, VK_NULL_HANDLE);
    submitted = lists[list].submitted = value;
    return {};
}

// Plans the next update of the pages that are to be written.
void Runtime::planTexels(UpdateStats& stats) {
    Impl& impl = *impl_;
    const bool in_place = impl.pages.size() == 1;
    impl.target = in_place ? 0 : impl.front ^ 1;
    Planner& next = planner(impl.target);
    if (!in_place && planner(impl.front).upToDate()) {
        next.startOver();  // a state that was called back while half of it was written is never shown
        stats = planner(impl.front).stats();  // what is put off
        return;
    }
    if (!in_place && next.mayGoOn()) {
        impl.texels_planned = next.planWaiting();  // of one state to its end: pages are shown when they are complete
    } else {
        impl.texels_planned = next.plan();
        // The other pages may hold the state already, when it is one of before.
        if (!impl.texels_planned) impl.front = impl.target;
    }
    stats = next.stats();
}

// The same of light probes and those of models.
void Runtime::planProbes(UpdateStats& stats) {
    Impl& impl = *impl_;
    const bool in_place = impl.probe_sets == 1;
    const auto upToDate = [&](uint32_t set) {
        return (!hasProbes() || probePlanner(set).upToDate()) && !models().dirty(set);
    };
    if (!in_place && upToDate(impl.probe_front)) return;
    impl.probe_target = in_place ? 0 : impl.probe_front ^ 1;
    impl.probes_planned = hasProbes() && probePlanner(impl.probe_target).plan();
    if (impl.probes_planned) {
        models().touch(impl.probe_target, probePlanner(impl.probe_target).work().items);
        addProbes(probePlanner(impl.probe_target).stats(), stats);
    }
    impl.models_planned = models().dirty(impl.probe_target);
    if (impl.models_planned) {
        impl.model_items = models().take(impl.probe_target);
        countResampled(impl.model_items, stats);
    }
    if (!impl.probes_planned && !impl.models_planned) impl.probe_front = impl.probe_target;
}

// What the next update will do. False: there is nothing to execute, and the last update's figures stand; `stats` may
// still say what was put off.
bool Runtime::planNext(UpdateStats& stats) {
    const auto start = std::chrono::steady_clock::now();
    Impl& impl = *impl_;
    impl.texels_planned = impl.probes_planned = impl.models_planned = false;
    planTexels(stats);
    planProbes(stats);
    stats.host_us = microsecondsSince(start);
    if (!impl.texels_planned && !impl.probes_planned && !impl.models_planned) return false;
    impl.recorded.reset();
    impl.stats = stats;
    impl.timed = false;
    return true;
}

// What was planned cannot be carried out.
void Runtime::rollback() {
    if (impl_->texels_planned) planner(impl_->target).rollback();
    if (impl_->probes_planned) probePlanner(impl_->probe_target).rollback();
    if (impl_->models_planned) models().rollback(impl_->probe_target);
    impl_->stats = {};
    impl_->timed = false;
}

const Planner* Runtime::plannedProbes() const {
    return impl_->probes_planned ? &probePlanner(impl_->probe_target) : nullptr;
}

// What was planned has been sent or recorded.
void Runtime::finish() {
    if (impl_->texels_planned && !planner(impl_->target).waiting()) impl_->front = impl_->target;
    if (impl_->probes_planned || impl_->models_planned) impl_->probe_front = impl_->probe_target;
}

Expected<UpdateStats> Runtime::record(VkCommandBuffer commands) {
    if (!commands) return fail(ErrorCode::InvalidArgument, "record() needs a command buffer, and got a null handle.");
    UpdateStats planned;
    if (!planNext(planned)) return planned;
    const uint32_t list_before = impl_->list;
    if (auto taken = impl_->takeList(true); !taken) {
        rollback();
        return std::unexpected(std::move(taken.error()));
    }
    const auto start = std::chrono::steady_clock::now();
    impl_->recordUpdate(commands, planner(impl_->target), plannedProbes(), true);
    impl_->recorded = Impl::Recording{.texels = impl_->texels_planned,
                                      .probes = impl_->probes_planned,
                                      .models = impl_->models_planned,
                                      .target = impl_->target,
                                      .probe_target = impl_->probe_target,
                                      .front = impl_->front,
                                      .probe_front = impl_->probe_front,
                                      .list = list_before};
    finish();
    impl_->stats.host_us = planned.host_us + microsecondsSince(start);
    return impl_->stats;
}

bool Runtime::discardRecorded() {
    Impl& impl = *impl_;
    const auto recorded = std::exchange(impl.recorded, std::nullopt);
    if (!recorded) return false;
    // Calls that found nothing to do have come in between: the plan is theirs.
    impl.texels_planned = recorded->texels;
    impl.probes_planned = recorded->probes;
    impl.models_planned = recorded->models;
    impl.target = recorded->target;
    impl.probe_target = recorded->probe_target;
    rollback();
    if (recorded->texels) impl.front = recorded->front;
    if (recorded->probes || recorded->models) impl.probe_front = recorded->probe_front;
    impl.list = recorded->list;
    return true;
}

void Runtime::invalidate() {
    impl_->recorded.reset();
    impl_->stats = {};
    impl_->timed = false;
    for (uint32_t set = 0; set < impl_->page_sets; ++set) {
        if (impl_->executor) planner(set).rollbackAll();
        if (impl_->probes) probePlanner(set).rollbackAll();
    }
    models().rollbackAll();
}

Expected<UpdateStats> Runtime::submit(const SubmitWait& wait) {
    UpdateStats planned;
    if (!planNext(planned)) return planned;
    const uint32_t list_before = impl_->list;
    auto sent = impl_->takeList(false);
    const auto start = std::chrono::steady_clock::now();
    if (sent) sent = impl_->submitUpdate(planner(impl_->target), plannedProbes(), wait);
    if (!sent) {
        rollback();
        impl_->list = list_before;
        return std::unexpected(std::move(sent.error()));
    }
    finish();
    impl_->stats.host_us = planned.host_us + microsecondsSince(start);
    return impl_->stats;
}

VkSemaphore Runtime::semaphore() const {
    return impl_->timeline.get();
}
uint64_t Runtime::semaphoreValue() const {
    return impl_->submitted;
}

Expected<UpdateStats> Runtime::wait() {
    DIMMER_TRY(impl_->waitFor(impl_->submitted));
    if (impl_->timed) {
        const auto gpu_us = impl_->timer->read(impl_->list);
        if (!gpu_us) return std::unexpected(gpu_us.error());
        if (*gpu_us) {
            impl_->stats.gpu_us = **gpu_us;
            impl_->timed = false;
        }
    }
    return impl_->stats;
}

}  // namespace dimmer
