// The C interface to the runtimes.
#include <c/handles.h>
#include <cpu/worker_pool.h>

#include <dimmer/door.h>
#include <fmt/format.h>

#include <algorithm>

namespace dimmer::c {

dimmer_result finish(const Expected<UpdateStats>& done, dimmer_update_stats* out) noexcept {
    if (!done) return report(done.error());
    if (out)
        *out = {.contributions_changed = done->contributions_changed,
                .clusters = done->clusters,
                .batches = done->batches,
                .dispatches = done->dispatches,
                .receivers = done->receivers,
                .bytes_read = done->bytes_read,
                .bytes_written = done->bytes_written,
                .host_us = done->host_us,
                .gpu_us = done->gpu_us,
                .clusters_put_off = done->clusters_put_off,
                .receivers_waiting = done->receivers_waiting,
                .probes_resampled = done->probes_resampled};
    return DIMMER_OK;
}

namespace {

dimmer_result copyPages(std::span<const uint32_t> irradiance, std::span<const uint32_t> direction,
                        uint32_t* irradiance_out, uint32_t* direction_out, size_t room) {
    if (room < irradiance.size())
        return report({ErrorCode::InvalidArgument,
                       fmt::format("the pages hold {} texels, there is room for {}", irradiance.size(), room)});
    std::ranges::copy(irradiance, irradiance_out);
    std::ranges::copy(direction, direction_out);
    return DIMMER_OK;
}

dimmer_result noSuchSet(const char* of_what, uint32_t set, uint32_t count) {
    return report(
        {ErrorCode::NotFound, fmt::format("there is no set of {} {}; sets are 0 to {}", of_what, set, count - 1)});
}

dimmer_images imagesOf(const LightmapImages& from) {
    return {.irradiance = from.irradiance,
            .irradiance_view = from.irradiance_view,
            .direction = from.direction,
            .direction_view = from.direction_view,
            .sampler = from.sampler,
            .width = from.width,
            .height = from.height,
            .layers = from.layers};
}

dimmer_result hasRoom(uint32_t moving_probes_max) {
    static_assert(DIMMER_MOVING_PROBES_MAX == moving_probes_limit);
    if (moving_probes_max <= moving_probes_limit) return DIMMER_OK;
    return report({ErrorCode::InvalidArgument,
                   fmt::format("moving_probes_max is {}; {} are the most", moving_probes_max, moving_probes_limit)});
}

}  // namespace
}  // namespace dimmer::c

using namespace dimmer;
using namespace dimmer::c;

dimmer_result dimmer_lights_create_cpu(const dimmer_pack* pack, uint32_t thread_count, uint32_t moving_probes_max,
                                       dimmer_lights** lights) {
    if (!given(pack, lights)) return DIMMER_INVALID_ARGUMENT;
    constexpr uint32_t threads_max = WorkerPool::threads_max;
    return guarded([&] {
        if (thread_count == 0 || thread_count > threads_max)
            return report({ErrorCode::InvalidArgument,
                           fmt::format("lights on the CPU run on 1 to {} threads, not {}", threads_max, thread_count)});
        if (const dimmer_result ok = hasRoom(moving_probes_max); ok != DIMMER_OK) return ok;
        *lights = new dimmer_lights{CpuRuntime(pack->pack, thread_count, moving_probes_max)};
        return DIMMER_OK;
    });
}

dimmer_result dimmer_lights_create_vulkan(const dimmer_pack* pack, const dimmer_vulkan* vulkan,
                                          const dimmer_vulkan_options* options, dimmer_lights** lights) {
    if (!given(pack, vulkan, lights)) return DIMMER_INVALID_ARGUMENT;
    return guarded([&] {
        const VulkanContext context{
            .instance = vulkan->instance,
            .physical_device = vulkan->physical_device,
            .device = vulkan->device,
            .queue = vulkan->queue,
            .queue_family = vulkan->queue_family,
            .compute_queue = vulkan->compute_queue,
            .compute_queue_family = vulkan->compute_queue_family,
            .get_instance_proc_addr = vulkan->get_instance_proc_addr,
            .pipeline_cache = vulkan->pipeline_cache,
            .queue_lock = {.lock = vulkan->lock_queue, .unlock = vulkan->unlock_queue, .user = vulkan->lock_user}};
        const dimmer_vulkan_options asked = options ? *options : dimmer_vulkan_options{};
        if (asked.buffering != DIMMER_IN_PLACE && asked.buffering != DIMMER_DOUBLE_BUFFERED)
            return report({ErrorCode::InvalidArgument,
                           fmt::format("{} is no dimmer_buffering; it is DIMMER_IN_PLACE or DIMMER_DOUBLE_BUFFERED",
                                       static_cast<int>(asked.buffering))});
        if (const dimmer_result ok = hasRoom(asked.moving_probes_max); ok != DIMMER_OK) return ok;
        auto created = Runtime::create(
            context, pack->pack,
            {.buffering = asked.buffering == DIMMER_DOUBLE_BUFFERED ? Buffering::Double : Buffering::InPlace,
             .frames_in_flight = asked.frames_in_flight == 0 ? 1 : asked.frames_in_flight,
             .records_bytes_max = asked.records_bytes_max,
             .load_records = asked.start_without_records == 0,
             .moving_probes_max = asked.moving_probes_max,
             .timestamps = asked.without_timestamps == 0});
        if (!created) return report(created.error());
        *lights = new dimmer_lights{std::move(*created)};
        return DIMMER_OK;
    });
}

void dimmer_lights_destroy(dimmer_lights* lights) {
    delete lights;
}

dimmer_result dimmer_lights_set_weight(dimmer_lights* lights, uint32_t light_set, float weight) {
    return dimmer_lights_set_weight_rgb(lights, light_set, weight, weight, weight);
}

dimmer_result dimmer_lights_set_weight_rgb(dimmer_lights* lights, uint32_t light_set, float r, float g, float b) {
    if (!given(lights)) return DIMMER_INVALID_ARGUMENT;
    return guarded([&] { return finish(lights->state().setWeight(LightSet{light_set}, {r, g, b})); });
}

dimmer_result dimmer_lights_set_door(dimmer_lights* lights, uint32_t door, float open) {
    if (!given(lights)) return DIMMER_INVALID_ARGUMENT;
    return guarded([&] { return finish(lights->state().setDoor(Door{door}, open)); });
}

float dimmer_hinged_door_weight(float angle_rad, float angle_max_rad) {
    return hingedDoorWeight(angle_rad, angle_max_rad);
}

float dimmer_sliding_door_weight(float travel_m, float width_m) {
    return slidingDoorWeight(travel_m, width_m);
}

dimmer_result dimmer_lights_apply(dimmer_lights* lights, const char* state) {
    if (!given(lights, state)) return DIMMER_INVALID_ARGUMENT;
    return guarded([&] { return finish(lights->state().apply(state)); });
}

dimmer_result dimmer_lights_set_limits(dimmer_lights* lights, uint32_t receivers_max, float tolerance_quanta) {
    if (!given(lights)) return DIMMER_INVALID_ARGUMENT;
    return guarded([&] {
        return finish(
            lights->state().setLimits({.receivers_max = receivers_max, .tolerance_quanta = tolerance_quanta}));
    });
}

dimmer_result dimmer_lights_get_weight(const dimmer_lights* lights, uint32_t element, float rgb[3]) {
    if (!given(lights, rgb)) return DIMMER_INVALID_ARGUMENT;
    return guarded([&] {
        const LightState& state = lights->state();
        const auto elements = state.pack().elements();
        if (element >= elements.size())
            return report({ErrorCode::NotFound,
                           fmt::format("there is no element {}; the pack has {}", element, elements.size())});
        const Weight weight = elements[element].kind == ElementKind::Door ? Weight(state.open(Door{element}))
                                                                          : state.weight(LightSet{element});
        rgb[0] = weight.r;
        rgb[1] = weight.g;
        rgb[2] = weight.b;
        return DIMMER_OK;
    });
}

dimmer_result dimmer_lights_update(dimmer_lights* lights, dimmer_update_stats* stats) {
    if (!given(lights)) return DIMMER_INVALID_ARGUMENT;
    return guarded([&] {
        auto* runtime = runtimeAs<CpuRuntime>(lights);
        return runtime ? finish(runtime->update(), stats) : DIMMER_UNSUPPORTED;
    });
}

dimmer_result dimmer_lights_read_pages(dimmer_lights* lights, uint32_t* irradiance, uint32_t* direction,
                                       size_t texel_count) {
    if (!given(lights, irradiance, direction)) return DIMMER_INVALID_ARGUMENT;
    return guarded([&] {
        if (const auto* cpu = std::get_if<CpuRuntime>(&lights->runtime))
            return copyPages(cpu->irradiancePages(), cpu->directionPages(), irradiance, direction, texel_count);
        const auto pages = std::get<Runtime>(lights->runtime).readPages();
        if (!pages) return report(pages.error());
        return copyPages(pages->irradiance, pages->direction, irradiance, direction, texel_count);
    });
}

dimmer_result dimmer_lights_get_pages(const dimmer_lights* lights, const uint32_t** irradiance,
                                      const uint32_t** direction, size_t* texel_count) {
    if (!given(lights, irradiance, direction, texel_count)) return DIMMER_INVALID_ARGUMENT;
    return guarded([&] {
        const auto* runtime = runtimeAs<CpuRuntime>(lights);
        if (!runtime) return DIMMER_UNSUPPORTED;
        *irradiance = runtime->irradiancePages().data();
        *direction = runtime->directionPages().data();
        *texel_count = runtime->irradiancePages().size();
        return DIMMER_OK;
    });
}

dimmer_result dimmer_lights_record(dimmer_lights* lights, VkCommandBuffer commands, dimmer_update_stats* stats) {
    if (!given(lights, commands)) return DIMMER_INVALID_ARGUMENT;
    return guarded([&] {
        auto* runtime = runtimeAs<Runtime>(lights);
        return runtime ? finish(runtime->record(commands), stats) : DIMMER_UNSUPPORTED;
    });
}

dimmer_result dimmer_lights_discard_recorded(dimmer_lights* lights) {
    if (!given(lights)) return DIMMER_INVALID_ARGUMENT;
    return guarded([&] {
        auto* runtime = runtimeAs<Runtime>(lights);
        if (!runtime) return DIMMER_UNSUPPORTED;
        if (runtime->discardRecorded()) return DIMMER_OK;
        return report({ErrorCode::NotFound, "there is no recording that could be taken back"});
    });
}

dimmer_result dimmer_lights_invalidate(dimmer_lights* lights) {
    if (!given(lights)) return DIMMER_INVALID_ARGUMENT;
    return guarded([&] {
        auto* runtime = runtimeAs<Runtime>(lights);
        if (!runtime) return DIMMER_UNSUPPORTED;
        runtime->invalidate();
        return DIMMER_OK;
    });
}

dimmer_result dimmer_lights_submit(dimmer_lights* lights, dimmer_update_stats* stats) {
    return dimmer_lights_submit_after(lights, VK_NULL_HANDLE, 0, stats);
}

dimmer_result dimmer_lights_submit_after(dimmer_lights* lights, VkSemaphore semaphore, uint64_t value,
                                         dimmer_update_stats* stats) {
    if (!given(lights)) return DIMMER_INVALID_ARGUMENT;
    return guarded([&] {
        auto* runtime = runtimeAs<Runtime>(lights);
        return runtime ? finish(runtime->submit({semaphore, value}), stats) : DIMMER_UNSUPPORTED;
    });
}

dimmer_result dimmer_lights_wait(dimmer_lights* lights, dimmer_update_stats* stats) {
    if (!given(lights)) return DIMMER_INVALID_ARGUMENT;
    return guarded([&] {
        auto* runtime = runtimeAs<Runtime>(lights);
        return runtime ? finish(runtime->wait(), stats) : DIMMER_UNSUPPORTED;
    });
}

dimmer_result dimmer_lights_get_semaphore(const dimmer_lights* lights, VkSemaphore* semaphore, uint64_t* value) {
    if (!given(lights, semaphore, value)) return DIMMER_INVALID_ARGUMENT;
    return guarded([&] {
        const auto* runtime = runtimeAs<Runtime>(lights);
        if (!runtime) return DIMMER_UNSUPPORTED;
        *semaphore = runtime->semaphore();
        *value = runtime->semaphoreValue();
        return DIMMER_OK;
    });
}

dimmer_result dimmer_lights_get_images(const dimmer_lights* lights, dimmer_images* images) {
    if (!given(lights, images)) return DIMMER_INVALID_ARGUMENT;
    return guarded([&] {
        const auto* runtime = runtimeAs<Runtime>(lights);
        if (!runtime) return DIMMER_UNSUPPORTED;
        *images = imagesOf(runtime->images());
        return DIMMER_OK;
    });
}

dimmer_result dimmer_lights_get_sets(const dimmer_lights* lights, uint32_t* page_set, uint32_t* probe_set) {
    if (!given(lights, page_set, probe_set)) return DIMMER_INVALID_ARGUMENT;
    return guarded([&] {
        const auto* runtime = runtimeAs<Runtime>(lights);
        if (!runtime) return DIMMER_UNSUPPORTED;
        *page_set = runtime->pageSet();
        *probe_set = runtime->probeSet();
        return DIMMER_OK;
    });
}

dimmer_result dimmer_lights_get_images_of_set(const dimmer_lights* lights, uint32_t page_set, dimmer_images* images) {
    if (!given(lights, images)) return DIMMER_INVALID_ARGUMENT;
    return guarded([&] {
        const auto* runtime = runtimeAs<Runtime>(lights);
        if (!runtime) return DIMMER_UNSUPPORTED;
        if (page_set >= runtime->setCount()) return noSuchSet("pages", page_set, runtime->setCount());
        *images = imagesOf(runtime->images(page_set));
        return DIMMER_OK;
    });
}

dimmer_result dimmer_lights_get_probes_of_set(const dimmer_lights* lights, uint32_t probe_set, VkBuffer* probes) {
    if (!given(lights, probes)) return DIMMER_INVALID_ARGUMENT;
    return guarded([&] {
        const auto* runtime = runtimeAs<Runtime>(lights);
        if (!runtime) return DIMMER_UNSUPPORTED;
        if (probe_set >= runtime->setCount()) return noSuchSet("probes", probe_set, runtime->setCount());
        *probes = runtime->probes(probe_set);
        return DIMMER_OK;
    });
}
