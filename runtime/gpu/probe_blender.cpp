#include <gpu/probe_blender.h>

#include <format/probe.h>
#include <gpu/table_upload.h>
#include <gpu/vk_result.h>
#include <spirv/blend_probes_comp.h>
#include <spirv/blend_probes_comp_storage.h>

#include <cstring>

namespace dimmer {
namespace {

constexpr uint32_t lanes_per_probe_item = 16, probe_items_per_workgroup = workgroup_size / lanes_per_probe_item;

// What the device reads as record i: the base of every receiver first, then the contributions.
ProbeRecord recordAt(const PackData& data, uint32_t i) {
    const auto receivers = static_cast<uint32_t>(data.probes.numbers.size());
    return canonicalProbe(data.color_format, i < receivers ? data.probes.base[data.probes.numbers[i]]
                                                           : data.probes.payload[i - receivers]);
}

// `count` words of each record, from `first` on, as a stream of their own.
template <size_t first, size_t count>
Expected<GpuTable> uploadStream(const VulkanContext& vulkan, Transfer& transfer, const PackData& data,
                                VkFormat format) {
    const std::vector<Run> all = {
        {0, 0, static_cast<uint32_t>(data.probes.numbers.size() + data.probes.payload.size())}};
    using Words = std::array<uint32_t, count>;
    return uploadTable(vulkan, transfer, all[0].count * sizeof(Words), format, fillFrom(all, [&](uint32_t i) {
                           const ProbeRecord record = recordAt(data, i);
                           Words words;
                           std::memcpy(&words, reinterpret_cast<const uint32_t*>(&record) + first, sizeof(words));
                           return words;
                       }));
}

}  // namespace

Expected<ProbeBlender> ProbeBlender::create(const VulkanContext& vulkan, const PackData& data, const Planner& planner,
                                            const ProbeAtlas& atlas, uint32_t lists, Transfer& transfer) {
    ProbeBlender blender;
    blender.data_ = &data.probes;
    blender.groups_x_max_ = limitsOf(vulkan).maxComputeWorkGroupCount[0];
    DIMMER_TRY(blender.createTables(vulkan, data, transfer));
    for (uint32_t i = 0; i < lists; ++i) DIMMER_TRY(blender.createWork(vulkan, planner));
    DIMMER_TRY(blender.createKernel(vulkan, data.color_format, planner, atlas));
    return blender;
}

Expected<void> ProbeBlender::createTables(const VulkanContext& vulkan, const PackData& data, Transfer& transfer) {
    std::vector<BatchPlace> places;
    for (const Cluster& cluster : data.probes.clusters)
        for (uint32_t b = cluster.first_batch; b < cluster.first_batch + cluster.batch_count; ++b) {
            const Batch& batch = data.probes.batches[b];
            places.push_back(
                {batch.first_receiver, batch.receiver_count, batch.first_receiver - cluster.first_receiver, 0});
        }
    DIMMER_TRY(keep(uploadTable(vulkan, transfer, places, wide_format), places_));
    DIMMER_TRY(keep(uploadTable(vulkan, transfer, data.probes.numbers, VK_FORMAT_R32_UINT), numbers_));
    DIMMER_TRY(keep(uploadStream<0, 4>(vulkan, transfer, data, wide_format), records_16_));
    DIMMER_TRY(keep(uploadStream<4, 2>(vulkan, transfer, data, VK_FORMAT_R32G32_UINT), records_8_));
    return keep(uploadStream<6, 1>(vulkan, transfer, data, VK_FORMAT_R32_UINT), records_4_);
}

Expected<void> ProbeBlender::createWork(const VulkanContext& vulkan, const Planner& planner) {
    Work work;
    DIMMER_TRY(
        keep(createTable(vulkan, planner.itemsMax() * sizeof(WorkItem), wide_format, MemoryUse::Upload), work.items));
    DIMMER_TRY(
        keep(createTable(vulkan, planner.termsMax() * sizeof(WorkTerm), wide_format, MemoryUse::Upload), work.terms));
    work_.push_back(std::move(work));
    return {};
}

Expected<void> ProbeBlender::createKernel(const VulkanContext& vulkan, ColorFormat format, const Planner& planner,
                                          const ProbeAtlas& atlas) {
    std::vector<Specialisation> pipelines;
    for (uint32_t group = 0; group <= workGroupOf(planner.overlapMax()); ++group)
        pipelines.push_back({group < unrolled_terms.size() ? unrolled_terms[group] : UINT32_MAX, workgroup_size,
                             static_cast<uint32_t>(format)});
    std::vector<KernelBinding> bindings;
    for (uint32_t set = 0; set < atlas.setCount(); ++set)
        for (const Work& work : work_) {
            const GpuTable* const tables[] = {&places_,    &numbers_,   &records_16_, &records_8_,
                                              &records_4_, &work.items, &work.terms};
            for (const GpuTable* table : tables) bindings.push_back(KernelBinding::ofTable(*table));
            bindings.push_back(KernelBinding::ofBuffer(atlas.buffer(set)));
        }
    auto kernel =
        Kernel::create(vulkan, {spirv::blend_probes_comp, spirv::blend_probes_comp_storage}, bindings,
                       sizeof(DispatchedItems), pipelines, atlas.setCount() * static_cast<uint32_t>(work_.size()));
    if (!kernel) return std::unexpected(std::move(kernel.error()));
    kernel_ = std::move(*kernel);
    return {};
}

void ProbeBlender::write(const Planner& planner, uint32_t list) {
    const WorkList& work = planner.work();
    std::memcpy(work_[list].items.buffer.mapped, work.items.data(), work.items.size_bytes());
    auto* terms = reinterpret_cast<WorkTerm*>(work_[list].terms.buffer.mapped);
    const auto receivers = static_cast<uint32_t>(data_->numbers.size());
    for (const WorkTerm& term : work.terms)
        *terms++ = {receivers + data_->terms[term.term].first_record, term.weight_r, term.weight_g, term.weight_b};
}

uint32_t ProbeBlender::dispatch(VkCommandBuffer commands, const Planner& planner, UpdateTarget target) const {
    uint32_t dispatches = 0;
    for (uint32_t i = 0; i < work_group_count; ++i) {
        const WorkGroup& group = planner.work().groups[i];
        if (group.item_count == 0) continue;
        kernel_.bind(commands, i, target.set * static_cast<uint32_t>(work_.size()) + target.list);
        kernel_.push(commands, DispatchedItems{group.first_item, group.item_count});
        dispatchRows(commands, (group.item_count + probe_items_per_workgroup - 1) / probe_items_per_workgroup,
                     groups_x_max_);
        ++dispatches;
    }
    return dispatches;
}

uint64_t ProbeBlender::deviceBytes() const {
    uint64_t bytes = bytesOf({&places_, &numbers_, &records_16_, &records_8_, &records_4_});
    for (const Work& work : work_) bytes += bytesOf({&work.items, &work.terms});
    return bytes;
}

}  // namespace dimmer
