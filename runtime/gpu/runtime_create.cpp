// From a pack and a device to a runtime.
#include <gpu/runtime_impl.h>

#include <fmt/format.h>
#include <gpu/queue_family.h>
#include <gpu/vk_result.h>
#include <gpu/vk_struct.h>

namespace dimmer {
namespace {

Expected<void> checkHandles(const VulkanContext& vulkan) {
    const char* missing = !vulkan.instance          ? "instance"
                          : !vulkan.physical_device ? "physical_device"
                          : !vulkan.device          ? "device"
                          : !vulkan.queue           ? "queue"
                                                    : nullptr;
    if (missing)
        return fail(ErrorCode::InvalidArgument,
                    fmt::format("The Vulkan device is given with a null {}; instance, physical_device, device and "
                                "queue are all needed.",
                                missing));
    if (!vulkan.queue_lock.lock != !vulkan.queue_lock.unlock)
        return fail(ErrorCode::InvalidArgument,
                    "The queue has a function to lock it or to unlock it alone: give both.");
    return {};
}

Expected<void> checkDevice(const VulkanContext& vulkan) {
    VkPhysicalDeviceProperties properties;
    vkGetPhysicalDeviceProperties(vulkan.physical_device, &properties);
    if (properties.apiVersion < VK_API_VERSION_1_2)
        return fail(
            ErrorCode::Unsupported,
            fmt::format("physical_device is a device of Vulkan {}.{}, and the runtime needs 1.2. "
                        "Choose another one, or update its driver.",
                        VK_API_VERSION_MAJOR(properties.apiVersion), VK_API_VERSION_MINOR(properties.apiVersion)));
    // The loader has such functions for an instance of any version, the device only for one of 1.2.
    if (!vkGetDeviceProcAddr(vulkan.device, "vkWaitSemaphores"))
        return fail(ErrorCode::Unsupported,
                    "The instance is one of Vulkan 1.0 or 1.1, and the runtime needs 1.2. Create the instance for "
                    "Vulkan 1.2 (VkApplicationInfo::apiVersion).");
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
    if (options.frames_in_flight < 1 || options.frames_in_flight > frames_max)
        return fail(ErrorCode::InvalidArgument,
                    fmt::format("frames_in_flight is {}; it is 1 to {}.", options.frames_in_flight, frames_max));
    if (options.mode > UpdateMode::Scatter)
        return fail(ErrorCode::InvalidArgument, fmt::format("{} is no UpdateMode.", static_cast<int>(options.mode)));
    if (options.buffering > Buffering::Double)
        return fail(ErrorCode::InvalidArgument,
                    fmt::format("{} is no Buffering.", static_cast<int>(options.buffering)));
    if (options.moving_probes_max > moving_probes_limit)
        return fail(ErrorCode::InvalidArgument, fmt::format("moving_probes_max is {}; {} are the most.",
                                                            options.moving_probes_max, moving_probes_limit));
    return {};
}

// Per element, the contributions of that light set that are stored anywhere.
std::vector<std::vector<uint32_t>> contributionsOfSets(const PackData& data) {
    std::vector<std::vector<uint32_t>> found(data.elements.size());
    for (uint32_t k = 0; k < data.contributions.size(); ++k) {
        const Contribution& contribution = data.contributions[k];
        if (contribution.light_set && contribution.receivers > 0) found[*contribution.light_set].push_back(k);
    }
    return found;
}

template <class T>
Expected<void> keepIn(std::optional<T>& slot, Expected<T> made) {
    if (!made) return std::unexpected(std::move(made.error()));
    slot.emplace(std::move(*made));
    return {};
}

}  // namespace

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

}  // namespace dimmer
