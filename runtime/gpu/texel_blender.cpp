#include <gpu/texel_blender.h>

#include <gpu/record_queue.h>

#include <fmt/format.h>
#include <gpu/table_upload.h>
#include <gpu/vk_result.h>
#include <gpu/vk_struct.h>
#include <pack/batches.h>
#include <spirv/blend_texels_comp.h>
#include <spirv/blend_texels_comp_storage.h>
#include <update/device_places.h>

#include <algorithm>

namespace dimmer {
namespace {

// To a texel of a table: two receivers' places; a work item. Two records, or a term: wide_format.
constexpr VkFormat places_format = VK_FORMAT_R8G8_UINT, item_format = VK_FORMAT_R32G32_UINT;
constexpr VkDeviceSize wide_bytes = 16;

constexpr uint32_t lanes_per_texel_item = 8, texel_items_per_workgroup = workgroup_size / lanes_per_texel_item;

// Of a TexelItem.
constexpr uint32_t item_index_bits = 26, item_count_bits = 12;

std::vector<Run> receiverRuns(const PackData& data, const DevicePlaces& places) {
    std::vector<Run> runs;
    for (const Cluster& cluster : data.clusters)
        runs.push_back(
            {firstReceiver(places.batches[cluster.first_batch]), cluster.first_receiver, cluster.receiver_count});
    return runs;
}

Specialisation specialisationOf(uint32_t group, const PackData& data) {
    return {group < unrolled_terms.size() ? unrolled_terms[group] : UINT32_MAX, workgroup_size,
            static_cast<uint32_t>(data.color_format), tileColumnBits(data.page_width)};
}

}  // namespace

Expected<void> checkTexelLimits(const VkPhysicalDeviceLimits& limits, uint64_t allocation_bytes_max,
                                const DevicePlaces& places, const Planner& planner, uint64_t records_bytes_max) {
    // Of the records, the store has no more than this on the device at a time.
    const uint64_t all_bytes = places.records * sizeof(TexelRecord);
    const uint64_t payload_bytes = records_bytes_max == 0 ? all_bytes : std::min(all_bytes, records_bytes_max);
    const uint64_t base_bytes = places.receivers * sizeof(TexelRecord);
    const uint64_t work_bytes = wide_bytes * std::max(planner.itemsMax(), planner.termsMax());
    // Each buffer has an allocation of its own.
    const uint64_t texels_max = limits.maxTexelBufferElements, storage_max = limits.maxStorageBufferRange;
    const uint64_t bytes_max = std::min(std::max(texels_max * wide_bytes, storage_max), allocation_bytes_max);
    constexpr uint32_t index_end = 1u << item_index_bits, count_end = 1u << item_count_bits;
    if (std::max(planner.itemsMax(), planner.termsMax()) >= index_end || planner.overlapMax() >= count_end ||
        places.receivers >= device_receivers_max)
        return fail(
            ErrorCode::Unsupported,
            fmt::format("The pack has {} batches, {} terms, up to {} at a receiver, and {} receivers; this runtime "
                        "takes fewer than {}, {}, {} and {}. Cook with fewer texels per metre or a higher activity "
                        "threshold.",
                        planner.itemsMax(), planner.termsMax(), planner.overlapMax(), places.receivers, index_end,
                        index_end, count_end, device_receivers_max));
    if (std::max({payload_bytes, base_bytes, work_bytes}) <= bytes_max) return {};
    return fail(
        ErrorCode::Unsupported,
        fmt::format("The pack's dynamic light ({} bytes of records, {} bytes of base, {} bytes of work list) "
                    "exceeds what this Vulkan device holds in an allocation ({} bytes) and reads as one buffer ({} "
                    "texels of 16 bytes, or a storage buffer of {} bytes): {} bytes. Cook with fewer texels per metre "
                    "or a higher activity threshold, or, where it is the records alone, load fewer at a time: start "
                    "without records, with a smaller records_bytes_max.",
                    payload_bytes, base_bytes, work_bytes, allocation_bytes_max, texels_max, storage_max, bytes_max));
}

Expected<TexelBlender> TexelBlender::create(const VulkanContext& vulkan, const PackData& data, const Planner& planner,
                                            std::span<const LightmapPages> page_sets, Transfer& transfer,
                                            const RuntimeOptions& options) {
    const VkPhysicalDeviceLimits limits = limitsOf(vulkan);
    const VkDeviceSize allocation_max = allocationBytesMax(vulkan.physical_device);
    DevicePlaces places = placesOf(data);
    DIMMER_TRY(checkTexelLimits(limits, allocation_max, places, planner, options.records_bytes_max));
    TexelBlender blender;
    blender.groups_x_max_ = limits.maxComputeWorkGroupCount[0];
    blender.per_combination_ = options.mode == UpdateMode::PerCombination;
    auto records = RecordStore::create(vulkan, data, options.records_bytes_max);
    if (!records) return std::unexpected(std::move(records.error()));
    blender.records_ = std::move(*records);
    DIMMER_TRY(blender.uploadRecords(data, transfer, options.load_records));
    DIMMER_TRY(blender.createTables(vulkan, data, std::move(places), transfer));
    for (uint32_t i = 0; i < options.frames_in_flight; ++i) DIMMER_TRY(blender.createWork(vulkan, planner));
    DIMMER_TRY(blender.createKernel(vulkan, data, planner, page_sets));
    return blender;
}

Expected<void> TexelBlender::createTables(const VulkanContext& vulkan, const PackData& data, DevicePlaces places,
                                          Transfer& transfer) {
    const auto receivers = receiverRuns(data, places);
    DIMMER_TRY(keep(uploadTable(vulkan, transfer, places.receivers * sizeof(TexelRecord), wide_format,
                                fillFrom(receivers, [&](uint32_t i) { return baseAt(data, i); })),
                    base_));
    places.bytes.resize((places.bytes.size() + 3) / 4 * 4);  // uploads are in words
    DIMMER_TRY(keep(uploadTable(vulkan, transfer, places.bytes, places_format), places_));
    return keep(uploadTable(vulkan, transfer, places.batches, wide_format), batches_);
}

// Of every contribution, or of those without a light set, which nothing can load later.
Expected<void> TexelBlender::uploadRecords(const PackData& data, Transfer& transfer, bool all) {
    RecordQueue queue(data.contributions.size());
    for (uint32_t k = 0; k < data.contributions.size(); ++k) {
        if (!all && data.contributions[k].light_set) continue;
        if (!records_.reserve(k)) {
            uint64_t bytes = 0;
            for (uint32_t c = 0; c < data.contributions.size(); ++c)
                if (all || !data.contributions[c].light_set) bytes += records_.byteCount(c);
            return fail(ErrorCode::OutOfMemory,
                        fmt::format("The records that are loaded at the start, {}, take {} bytes: create the runtime "
                                    "with a records_bytes_max of as many at least{}.",
                                    all ? "all of them" : "those of always-on light that doors let through", bytes,
                                    all ? ", or, where light sets are to come and go, start without records" : ""));
        }
        queue.add(RecordQueue::no_light_set, k, records_);
    }
    std::vector<VkBufferCopy> regions;
    std::vector<uint32_t> ended;
    while (!queue.empty()) {
        const uint64_t bytes =
            queue.fill(records_, std::span(transfer.staging().mapped, Transfer::staging_bytes), regions);
        DIMMER_TRY(transfer.send(records_.buffer(), regions));
        queue.advance(records_, bytes, ended);
    }
    return {};
}

Expected<void> TexelBlender::createWork(const VulkanContext& vulkan, const Planner& planner) {
    Work work;
    DIMMER_TRY(
        keep(createTable(vulkan, planner.itemsMax() * sizeof(TexelItem), item_format, MemoryUse::Upload), work.items));
    DIMMER_TRY(
        keep(createTable(vulkan, planner.termsMax() * sizeof(WorkTerm), wide_format, MemoryUse::Upload), work.terms));
    work_.push_back(std::move(work));
    return {};
}

Expected<void> TexelBlender::createKernel(const VulkanContext& vulkan, const PackData& data, const Planner& planner,
                                          std::span<const LightmapPages> page_sets) {
    std::vector<Specialisation> pipelines;
    // Groups that no cluster can fall into get no pipeline.
    for (uint32_t group = 0; group <= workGroupOf(planner.overlapMax()); ++group)
        pipelines.push_back(specialisationOf(group, data));
    std::vector<KernelBinding> bindings;
    for (const LightmapPages& pages : page_sets)
        for (const Work& work : work_)
            bindings.insert(bindings.end(), {
                                                KernelBinding::ofTable(places_),
                                                KernelBinding::ofTable(base_),
                                                KernelBinding::ofTable(records_.table()),
                                                KernelBinding::ofTable(work.items),
                                                KernelBinding::ofTable(work.terms),
                                                KernelBinding::ofTable(batches_),
                                                KernelBinding::ofImage(pages.irradianceStorageView()),
                                                KernelBinding::ofImage(pages.directionStorageView()),
                                            });
    auto kernel =
        Kernel::create(vulkan, {spirv::blend_texels_comp, spirv::blend_texels_comp_storage}, bindings,
                       sizeof(DispatchedItems), pipelines, static_cast<uint32_t>(page_sets.size() * work_.size()));
    if (!kernel) return std::unexpected(std::move(kernel.error()));
    kernel_ = std::move(*kernel);
    return {};
}

uint64_t TexelBlender::deviceBytes() const {
    uint64_t bytes = bytesOf({&places_, &base_, &batches_}) + records_.deviceBytes();
    for (const Work& work : work_) bytes += bytesOf({&work.items, &work.terms});
    return bytes;
}

void TexelBlender::write(const Planner& planner, uint32_t list) {
    const WorkList& work = planner.work();
    auto* items = reinterpret_cast<TexelItem*>(work_[list].items.buffer.mapped);
    for (const WorkItem& item : work.items)
        *items++ = {item.batch | item.term_count << item_index_bits,
                    item.first_term | item.term_count >> 6 << item_index_bits};
    auto* terms = reinterpret_cast<WorkTerm*>(work_[list].terms.buffer.mapped);
    for (const WorkTerm& term : work.terms)
        *terms++ = {records_.firstRecord(term.term), term.weight_r, term.weight_g, term.weight_b};
}

void TexelBlender::recordDispatch(VkCommandBuffer commands, uint32_t first_item, uint32_t item_count) const {
    kernel_.push(commands, DispatchedItems{first_item, item_count});
    dispatchRows(commands, (item_count + texel_items_per_workgroup - 1) / texel_items_per_workgroup, groups_x_max_);
}

uint32_t TexelBlender::dispatchGroup(VkCommandBuffer commands, const WorkList& work, const WorkGroup& group) const {
    if (!per_combination_) {
        recordDispatch(commands, group.first_item, group.item_count);
        return 1;
    }
    // The items of a cluster follow one another; those of clusters with nothing on may share their (empty) terms.
    uint32_t dispatches = 0;
    const uint32_t end = group.first_item + group.item_count;
    for (uint32_t first = group.first_item; first < end; ++dispatches) {
        uint32_t next = first + 1;
        while (next < end && work.items[next].first_term == work.items[first].first_term) ++next;
        recordDispatch(commands, first, next - first);
        first = next;
    }
    return dispatches;
}

uint32_t TexelBlender::dispatch(VkCommandBuffer commands, const Planner& planner, UpdateTarget target) const {
    const WorkList& work = planner.work();
    uint32_t dispatches = 0;
    for (uint32_t i = 0; i < work_group_count; ++i) {
        if (work.groups[i].item_count == 0) continue;
        kernel_.bind(commands, i, target.set * static_cast<uint32_t>(work_.size()) + target.list);
        dispatches += dispatchGroup(commands, work, work.groups[i]);
    }
    return dispatches;
}

}  // namespace dimmer
