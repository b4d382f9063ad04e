#include <dimmer/runtime.h>

#include <fmt/format.h>
#include <gpu/lightmap_pages.h>
#include <gpu/probe_blender.h>
#include <gpu/probe_resampler.h>
#include <gpu/queue_family.h>
#include <gpu/record_loader.h>
#include <gpu/texel_blender.h>
#include <gpu/texel_executor.h>
#include <gpu/update_timer.h>
#include <gpu/vk_result.h>
#include <gpu/vk_struct.h>
#include <gpu/vulkan_functions.h>
#include <probes/model_slots.h>

#include <algorithm>
#include <chrono>
#include <limits>
#include <optional>

namespace dimmer {
namespace {

double microsecondsSince(std::chrono::steady_clock::time_point start) {
    return std::chrono::duration<double, std::micro>(std::chrono::steady_clock::now() - start).count();
}

Expected<void> checkHandles(const VulkanContext& vulkan) {
    if (vulkan.instance && vulkan.physical_device && vulkan.device && vulkan.queue) return {};
    return fail(ErrorCode::InvalidArgument,
                "The VulkanContext has a null handle; instance, physical device, device "
                "and queue are all needed.");
}

Expected<void> checkDevice(const VulkanContext& vulkan) {
    VkPhysicalDeviceProperties properties;
    vkGetPhysicalDeviceProperties(vulkan.physical_device, &properties);
    if (properties.apiVersion < VK_API_VERSION_1_2)
        return fail(
            ErrorCode::Unsupported,
            fmt::format("VulkanContext::physical_device is a device of Vulkan {}.{}, and the runtime needs 1.2. "
                        "Choose another one, or update its driver.",
                        VK_API_VERSION_MAJOR(properties.apiVersion), VK_API_VERSION_MINOR(properties.apiVersion)));
    const auto families = queueFamilies(vulkan.physical_device);
    DIMMER_TRY(checkQueueFamily("queue_family", vulkan.queue_family, families));
    if (!vulkan.compute_queue) return {};
    return checkQueueFamily("compute_queue_family", vulkan.compute_queue_family, families);
}

Expected<SemaphoreHandle> createTimeline(VkDevice device) {
    auto type = vkStruct<VkSemaphoreTypeCreateInfo>(VK_STRUCTURE_TYPE_SEMAPHORE_TYPE_CREATE_INFO);
    type.semaphoreType = VK_SEMAPHORE_TYPE_TIMELINE;
    const auto info = vkStruct<VkSemaphoreCreateInfo>(VK_STRUCTURE_TYPE_SEMAPHORE_CREATE_INFO, &type);
    VkSemaphore semaphore = VK_NULL_HANDLE;
    DIMMER_VK(vkCreateSemaphore, device, &info, nullptr, &semaphore);
    return SemaphoreHandle(device, semaphore);
}

constexpr uint32_t frames_max = 8;

Expected<void> checkOptions(const RuntimeOptions& options) {
    if (options.frames_in_flight >= 1 && options.frames_in_flight <= frames_max) return {};
    return fail(ErrorCode::InvalidArgument, fmt::format("RuntimeOptions::frames_in_flight is {}; it is 1 to {}.",
                                                        options.frames_in_flight, frames_max));
}

// What the other queue wrote, and the host has waited for, is available; a host wait does not make it visible here.
void seeOtherQueue(VkCommandBuffer commands) {
    constexpr VkPipelineStageFlags stages = VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT | VK_PIPELINE_STAGE_TRANSFER_BIT;
    memoryBarrier(commands, stages, VK_ACCESS_MEMORY_WRITE_BIT, stages,
                  VK_ACCESS_SHADER_READ_BIT | VK_ACCESS_TRANSFER_READ_BIT);
}

}  // namespace

// Per element, the contributions of that light set that are stored anywhere.
std::vector<std::vector<uint32_t>> contributionsOfSets(const PackData& data) {
    std::vector<std::vector<uint32_t>> found(data.elements.size());
    for (uint32_t k = 0; k < data.contributions.size(); ++k) {
        const Contribution& contribution = data.contributions[k];
        if (contribution.light_set && contribution.receivers > 0) found[*contribution.light_set].push_back(k);
    }
    return found;
}

// Everything on the device. Members are destroyed in reverse, after waiting for what submit() sent.
struct Runtime::Impl {
    VulkanFunctions functions;  // first: every other member calls them to its end
    VulkanContext vulkan;
    std::vector<LightmapPages> pages;  // one set, or two that take turns
    uint32_t probe_sets = 1;           // likewise
    uint32_t page_sets = 1;            // of both, as asked for
    // The sets of pages and of probes to sample, and those that the last plan writes. Probes are not limited, so they
    // change places with every update, pages when a state is complete.
    uint32_t front = 0, target = 0;
    uint32_t probe_front = 0, probe_target = 0;
    std::unique_ptr<TexelExecutor> executor;    // none when the pack has no receivers
    std::optional<ProbeBlender> probes;         // none when the pack has no probes that change
    std::optional<ProbeAtlas> atlas;            // none when there are no probes
    std::optional<GpuBuffer> grid_table;        // none when the pack has no global grid
    std::optional<ProbeResampler> resampler;    // none without room for moving models
    std::span<const ResampleItem> model_items;  // of the last plan
    bool texels_planned = false, probes_planned = false, models_planned = false;
    // Of the last update that record() found work for, unless submit() found some since: what discardRecorded() takes
    // back, and the sets that were to be sampled before.
    struct Recording {
        bool texels, probes, models;
        uint32_t target, probe_target, front, probe_front;
        uint32_t list;  // likewise, that the next update takes then
    };
    std::optional<Recording> recorded;
    // What an update that may be on its way has for itself, beside the work list of the same number.
    struct List {
        CommandBuffer own;       // for submit()
        uint64_t submitted = 0;  // the timeline's value when submit()'s update with it is done; 0: record() had it last
    };
    std::vector<List> lists;
    uint32_t list = 0;                                 // of the last update
    std::optional<RecordLoader> loader;                // none in modes that load nothing later
    std::vector<LightSet> loading;                     // sets whose records are on their way
    std::vector<RecordsState> records;                 // per element
    std::vector<std::vector<uint32_t>> contributions;  // likewise
    std::optional<UpdateTimer> timer;
    SemaphoreHandle timeline;
    uint64_t submitted = 0;  // the timeline's value when the last submission is done
    UpdateStats stats;       // of the last update
    bool timed = false;      // the last update wrote timestamps that were not read yet

    ~Impl() { (void)waitFor(submitted); }

    Expected<void> create(const PackData& data, const Planner& planner, const Planner* probe_planner,
                          const ModelSlots& models, const RuntimeOptions& options);
    Expected<void> createExecutors(const PackData& data, const Planner& planner, const RuntimeOptions& options,
                                   Transfer& transfer);
    Expected<void> createProbes(const PackData& data, const Planner* probe_planner, const ModelSlots& models,
                                uint32_t list_count, Transfer& transfer);
    Expected<void> createLists(uint32_t count);
    uint32_t dispatchProbes(VkCommandBuffer commands, const Planner* probe_planner, VkPipelineStageFlags readers);
    Expected<void> createPages(const PackData& data, uint32_t count, Transfer& transfer);
    VkQueue ownQueue() const { return vulkan.compute_queue ? vulkan.compute_queue : vulkan.queue; }
    uint32_t ownFamily() const { return vulkan.compute_queue ? vulkan.compute_queue_family : vulkan.queue_family; }
    Expected<void> waitFor(uint64_t value) const;
    Expected<void> takeList(bool for_recording);
    void recordUpdate(VkCommandBuffer commands, const Planner& planner, const Planner* probe_planner, bool drawing);
    Expected<void> submitUpdate(const Planner& planner, const Planner* probe_planner, const SubmitWait& wait);
};

Expected<void> Runtime::Impl::createExecutors(const PackData& data, const Planner& planner,
                                              const RuntimeOptions& options, Transfer& transfer) {
    if (data.payload.empty()) return {};
    auto made = createExecutor(vulkan, options, data, planner, pages, transfer);
    if (!made) return std::unexpected(std::move(made.error()));
    executor = std::move(*made);
    if (executor->records())
        loader.emplace(vulkan, ownQueue(), ownFamily(), data.elements.size(), data.contributions.size());
    return {};
}

template <class T>
Expected<void> keepIn(std::optional<T>& slot, Expected<T> made) {
    if (!made) return std::unexpected(std::move(made.error()));
    slot.emplace(std::move(*made));
    return {};
}

Expected<void> Runtime::Impl::createProbes(const PackData& data, const Planner* probe_planner, const ModelSlots& models,
                                           uint32_t list_count, Transfer& transfer) {
    if (data.probes.base.empty()) return {};
    DIMMER_TRY(keepIn(atlas, ProbeAtlas::create(vulkan, data, models.probesMax(), probe_sets, transfer)));
    if (probe_planner)
        DIMMER_TRY(keepIn(probes, ProbeBlender::create(vulkan, data, *probe_planner, *atlas, list_count, transfer)));
    if (data.probes.global.empty()) return {};
    DIMMER_TRY(keepIn(grid_table, uploadGridTable(vulkan, data.probes.global, transfer)));
    if (models.probesMax() == 0) return {};
    return keepIn(resampler,
                  ProbeResampler::create(vulkan, data, models, *atlas, list_count, grid_table->buffer.get(), transfer));
}

Expected<void> Runtime::Impl::createLists(uint32_t count) {
    lists.resize(count);
    for (List& made : lists) {
        auto commands = createCommandBuffer(vulkan.device, ownFamily());
        if (!commands) return std::unexpected(std::move(commands.error()));
        made.own = std::move(*commands);
    }
    return {};
}

Expected<void> Runtime::Impl::create(const PackData& data, const Planner& planner, const Planner* probe_planner,
                                     const ModelSlots& models, const RuntimeOptions& options) {
    auto transfer = Transfer::create(vulkan, MemoryUse::Upload);
    if (!transfer) return std::unexpected(std::move(transfer.error()));
    // What never changes needs no second set.
    const bool pages_change = !data.payload.empty(), probes_change = probe_planner || models.probesMax() > 0;
    const bool changes = pages_change || probes_change;
    const bool twice = options.buffering == Buffering::Double;
    probe_sets = twice && probes_change ? 2 : 1;
    DIMMER_TRY(createPages(data, twice && pages_change ? 2 : 1, *transfer));
    auto made_timeline = createTimeline(vulkan.device);
    if (!made_timeline) return std::unexpected(std::move(made_timeline.error()));
    timeline = std::move(*made_timeline);
    DIMMER_TRY(createProbes(data, probe_planner, models, options.frames_in_flight, *transfer));
    if (!changes) return {};

    DIMMER_TRY(createExecutors(data, planner, options, *transfer));
    if (options.timestamps) {
        auto made_timer = UpdateTimer::create(vulkan, options.frames_in_flight);
        if (!made_timer) return std::unexpected(std::move(made_timer.error()));
        timer = std::move(*made_timer);
    }
    return createLists(options.frames_in_flight);
}

Expected<void> Runtime::Impl::createPages(const PackData& data, uint32_t count, Transfer& transfer) {
    for (uint32_t i = 0; i < count; ++i) {
        auto made = LightmapPages::create(vulkan, data, transfer);
        if (!made) return std::unexpected(std::move(made.error()));
        pages.push_back(std::move(*made));
    }
    return {};
}

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
    DIMMER_VK(vkQueueSubmit, ownQueue(), 1, &info, VK_NULL_HANDLE);
    submitted = lists[list].submitted = value;
    return {};
}

Expected<Runtime> Runtime::create(const VulkanContext& vulkan, const Pack& pack, const RuntimeOptions& options) {
    DIMMER_TRY(checkHandles(vulkan));
    DIMMER_TRY(checkOptions(options));
    auto functions = VulkanFunctions::load(vulkan.get_instance_proc_addr, vulkan.instance);
    if (!functions) return std::unexpected(std::move(functions.error()));
    DIMMER_TRY(checkDevice(vulkan));
    auto impl = std::make_unique<Impl>();
    impl->functions = std::move(*functions);
    impl->vulkan = vulkan;
    impl->page_sets = options.buffering == Buffering::Double ? 2 : 1;
    impl->contributions = contributionsOfSets(pack.data());
    impl->loading.reserve(pack.elements().size());
    impl->records.assign(pack.elements().size(), options.load_records ? RecordsState::Loaded : RecordsState::Dropped);
    Runtime runtime(pack, std::move(impl), options.moving_probes_max);
    DIMMER_TRY(runtime.impl_->create(runtime.pack().data(), runtime.planner(),
                                     runtime.hasProbes() ? &runtime.probePlanner() : nullptr, runtime.models(),
                                     options));
    for (uint32_t i = 0; i < pack.elements().size() && !options.load_records; ++i)
        if (pack.elements()[i].kind == ElementKind::LightSet) runtime.hold(LightSet{i}, true);
    return runtime;
}

Runtime::Runtime(const Pack& pack, std::unique_ptr<Impl> impl, uint32_t moving_probes_max)
    : LightState(pack, impl->page_sets, moving_probes_max), impl_(std::move(impl)) {}
Runtime::~Runtime() = default;
Runtime::Runtime(Runtime&&) noexcept = default;
Runtime& Runtime::operator=(Runtime&&) noexcept = default;

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
    Impl& impl = *impl_;
    impl.texels_planned = impl.probes_planned = impl.models_planned = false;
    planTexels(stats);
    planProbes(stats);
    if (!impl.texels_planned && !impl.probes_planned && !impl.models_planned) return false;
    impl.recorded.reset();
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
    auto start = std::chrono::steady_clock::now();
    UpdateStats planned;
    const bool works = planNext(planned);
    planned.host_us = microsecondsSince(start);
    if (!works) return planned;
    impl_->stats = planned;
    const uint32_t list_before = impl_->list;
    if (auto taken = impl_->takeList(true); !taken) {
        rollback();
        return std::unexpected(std::move(taken.error()));
    }
    start = std::chrono::steady_clock::now();
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
    for (uint32_t set = 0; set < impl_->page_sets; ++set) {
        planner(set).rollbackAll();
        if (hasProbes()) probePlanner(set).rollbackAll();
    }
    models().rollbackAll();
}

Expected<UpdateStats> Runtime::submit(const SubmitWait& wait) {
    auto start = std::chrono::steady_clock::now();
    UpdateStats planned;
    const bool works = planNext(planned);
    planned.host_us = microsecondsSince(start);
    if (!works) return planned;
    impl_->stats = planned;

    auto sent = impl_->takeList(false);
    start = std::chrono::steady_clock::now();
    if (sent) sent = impl_->submitUpdate(planner(impl_->target), plannedProbes(), wait);
    if (!sent) {
        rollback();
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

Expected<void> Runtime::checkLoadable(LightSet set) const {
    DIMMER_TRY(checkSet(set));
    if (impl_->executor && !impl_->executor->records())
        return fail(ErrorCode::Unsupported, "Modes gather and scatter keep all records loaded.");
    return {};
}

Expected<void> Runtime::dropRecords(LightSet set) {
    DIMMER_TRY(checkLoadable(set));
    if (impl_->records[set.element] == RecordsState::Dropped) return {};
    hold(set, true);
    // A state that is half written must go on without these records.
    for (uint32_t i = 0; i < impl_->pages.size(); ++i) planner(i).startOver();
    impl_->records[set.element] = RecordsState::Dropped;
    std::erase_if(impl_->loading, [&](LightSet other) { return other.element == set.element; });
    if (!impl_->loader) return {};  // nothing is stored of any set
    RecordStore& store = *impl_->executor->records();
    impl_->loader->cancel(set.element, store);
    for (const uint32_t k : impl_->contributions[set.element]) store.release(k);
    return {};
}

Expected<void> Runtime::loadRecords(LightSet set) {
    DIMMER_TRY(checkLoadable(set));
    if (impl_->records[set.element] != RecordsState::Dropped) return {};
    if (impl_->loader) {
        const auto& contributions = impl_->contributions[set.element];
        RecordStore& store = *impl_->executor->records();
        if (!std::ranges::all_of(contributions, [&](uint32_t k) { return store.reserve(k); })) {
            for (const uint32_t k : contributions) store.release(k);
            return fail(ErrorCode::OutOfMemory,
                        fmt::format("Light set \"{}\": there is no room for the {} bytes of its records: {} bytes are "
                                    "free, at most {} of them in a row. Drop a light set, or create the runtime with "
                                    "more records_bytes_max.",
                                    pack().elements()[set.element].name, recordBytes(set), store.freeBytes(),
                                    store.largestFreeBytes()));
        }
        impl_->loader->add(set.element, contributions, store);
    }
    impl_->records[set.element] = RecordsState::Loading;
    impl_->loading.push_back(set);
    return {};
}

uint64_t Runtime::recordBytes(LightSet set) const {
    if (!impl_->loader || !checkSet(set)) return 0;
    uint64_t bytes = 0;
    for (const uint32_t k : impl_->contributions[set.element]) bytes += impl_->executor->records()->byteCount(k);
    return bytes;
}

uint64_t Runtime::freeRecordBytes() const {
    return impl_->loader ? impl_->executor->records()->freeBytes() : 0;
}

RecordsState Runtime::recordsState(LightSet set) const {
    return checkSet(set) ? impl_->records[set.element] : RecordsState::Dropped;
}

// Sets of which nothing is on its way any more.
void Runtime::finishLoading() {
    std::erase_if(impl_->loading, [&](LightSet set) {
        if (impl_->loader && impl_->loader->pending(set.element)) return false;
        impl_->records[set.element] = RecordsState::Loaded;
        hold(set, false);
        return true;
    });
}

Expected<LoadProgress> Runtime::continueLoading(uint64_t bytes_max) {
    if (!impl_->loader) {  // nothing is stored of any set
        finishLoading();
        return LoadProgress{};
    }
    DIMMER_TRY(impl_->loader->step(*impl_->executor->records(), bytes_max));
    finishLoading();
    return impl_->loader->progress();
}

LightmapImages Runtime::images(uint32_t page_set) const {
    return impl_->pages[std::min<size_t>(page_set, impl_->pages.size() - 1)].images();
}
uint32_t Runtime::pageSet() const {
    return impl_->front;
}

uint32_t Runtime::setCount() const {
    return impl_->page_sets;
}

uint32_t Runtime::probeSet() const {
    return impl_->probe_front;
}

VkBuffer Runtime::probes(uint32_t probe_set) const {
    if (!impl_->atlas) return VK_NULL_HANDLE;
    return impl_->atlas->buffer(std::min(probe_set, impl_->probe_sets - 1));
}

VkBuffer Runtime::gridTable() const {
    return impl_->grid_table ? impl_->grid_table->buffer.get() : VK_NULL_HANDLE;
}

DeviceFootprint Runtime::footprint() const {
    DeviceFootprint footprint;
    for (const LightmapPages& pages : impl_->pages) footprint.bytes += pages.deviceBytes();
    if (impl_->executor) {
        footprint.bytes += impl_->executor->deviceBytes();
        if (impl_->loader) footprint.bytes += impl_->loader->deviceBytes();
        footprint.pipelines = impl_->executor->pipelineCount();
    }
    if (impl_->probes) {
        footprint.bytes += impl_->probes->deviceBytes();
        footprint.pipelines += impl_->probes->pipelineCount();
    }
    if (impl_->atlas) footprint.bytes += impl_->atlas->deviceBytes();
    if (impl_->grid_table) footprint.bytes += impl_->grid_table->size_bytes;
    if (impl_->resampler) {
        footprint.bytes += impl_->resampler->deviceBytes();
        footprint.pipelines += impl_->resampler->pipelineCount();
    }
    return footprint;
}

Expected<Runtime::Pages> Runtime::readPages() {
    DIMMER_TRY(impl_->waitFor(impl_->submitted));  // perhaps on another queue
    auto transfer = Transfer::create(impl_->vulkan, MemoryUse::Readback);
    if (!transfer) return std::unexpected(std::move(transfer.error()));
    auto pages = impl_->pages[impl_->front].read(*transfer);
    if (!pages || !impl_->atlas) return pages;
    auto probes = impl_->atlas->read(impl_->probe_front, *transfer);
    if (!probes) return std::unexpected(std::move(probes.error()));
    pages->probes = std::move(*probes);
    return pages;
}

}  // namespace dimmer
