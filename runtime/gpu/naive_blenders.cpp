#include <gpu/naive_blenders.h>

#include <fmt/format.h>
#include <gpu/table_upload.h>
#include <gpu/vk_result.h>
#include <gpu/vk_struct.h>
#include <spirv/gather_texels_comp.h>
#include <spirv/gather_texels_comp_storage.h>
#include <spirv/scatter_texels_comp.h>
#include <spirv/scatter_texels_comp_storage.h>

#include <cstring>

namespace dimmer {
namespace {

constexpr VkFormat word_format = VK_FORMAT_R32_UINT, record_format = VK_FORMAT_R32G32_UINT,
                   index_format = VK_FORMAT_R16_UINT;

std::vector<TexelRecord> baseRecords(const PackData& data) {
    std::vector<TexelRecord> records;
    records.reserve(data.addresses.size());
    for (uint32_t i = 0; i < data.addresses.size(); ++i) records.push_back(baseAt(data, i));
    return records;
}

// visit(receiver, term, record) for every record: clusters in order, receivers in order, terms in order.
template <class Visit>
void forEachRecord(const PackData& data, Visit&& visit) {
    for (const Cluster& c : data.clusters)
        for (uint32_t i = 0; i < c.receiver_count; ++i)
            for (uint32_t t = c.first_term; t < c.first_term + c.term_count; ++t)
                visit(c.first_receiver + i, data.terms[t], data.terms[t].first_record + i);
}

// What one pass of the scatter wrote, the next one reads and writes.
void passBarrier(VkCommandBuffer commands) {
    auto barrier = vkStruct<VkMemoryBarrier>(VK_STRUCTURE_TYPE_MEMORY_BARRIER);
    barrier.srcAccessMask = VK_ACCESS_SHADER_WRITE_BIT;
    barrier.dstAccessMask = VK_ACCESS_SHADER_READ_BIT | VK_ACCESS_SHADER_WRITE_BIT;
    vkCmdPipelineBarrier(commands, VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT, VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT, 0, 1,
                         &barrier, 0, nullptr, 0, nullptr);
}

}  // namespace

Expected<GatherBlender> GatherBlender::create(const VulkanContext& vulkan, const PackData& data,
                                              const LightmapPages& pages, Transfer& transfer) {
    if (data.contributions.size() > UINT16_MAX)
        return fail(ErrorCode::Unsupported, fmt::format("Mode gather takes at most {} contributions; the pack has {}.",
                                                        UINT16_MAX, data.contributions.size()));
    std::vector<TexelRecord> records;
    std::vector<uint16_t> contributions;
    std::vector<uint32_t> first_record(data.addresses.size() + 1, 0);
    forEachRecord(data, [&](uint32_t receiver, const ClusterTerm& term, uint32_t record) {
        records.push_back(canonical(data.color_format, data.payload[record]));
        contributions.push_back(static_cast<uint16_t>(term.contribution));
        first_record[receiver + 1] = static_cast<uint32_t>(records.size());
    });
    // Receivers of clusters without contributions have empty lists.
    for (size_t i = 1; i < first_record.size(); ++i) first_record[i] = std::max(first_record[i], first_record[i - 1]);
    // Uploads are in words.
    if (contributions.size() % 2) contributions.push_back(0);

    GatherBlender blender;
    blender.receivers_ = static_cast<uint32_t>(data.addresses.size());
    blender.groups_x_max_ = limitsOf(vulkan).maxComputeWorkGroupCount[0];
    DIMMER_TRY(keep(uploadTable(vulkan, transfer, data.addresses, word_format), blender.addresses_));
    DIMMER_TRY(keep(uploadTable(vulkan, transfer, baseRecords(data), record_format), blender.base_));
    DIMMER_TRY(keep(uploadTable(vulkan, transfer, records, record_format), blender.payload_));
    DIMMER_TRY(keep(uploadTable(vulkan, transfer, contributions, index_format), blender.contributions_));
    DIMMER_TRY(keep(uploadTable(vulkan, transfer, first_record, word_format), blender.first_record_));
    DIMMER_TRY(keep(createTable(vulkan, data.contributions.size() * sizeof(WorkTerm), wide_format, MemoryUse::Upload),
                    blender.weights_));
    const KernelBinding bindings[] = {
        KernelBinding::ofTable(blender.addresses_),
        KernelBinding::ofTable(blender.base_),
        KernelBinding::ofTable(blender.payload_),
        KernelBinding::ofTable(blender.contributions_),
        KernelBinding::ofTable(blender.first_record_),
        KernelBinding::ofTable(blender.weights_),
        KernelBinding::ofImage(pages.irradianceStorageView()),
        KernelBinding::ofImage(pages.directionStorageView()),
    };
    const Specialisation pipelines[] = {{static_cast<uint32_t>(data.color_format)}};
    blender.weight_scale_ = weightScale(data.color_format);
    auto kernel = Kernel::create(vulkan, {spirv::gather_texels_comp, spirv::gather_texels_comp_storage}, bindings,
                                 sizeof(uint32_t), pipelines);
    if (!kernel) return std::unexpected(std::move(kernel.error()));
    blender.kernel_ = std::move(*kernel);
    return blender;
}

void GatherBlender::write(const Planner& planner, uint32_t) {
    auto* weights = reinterpret_cast<WorkTerm*>(weights_.buffer.mapped);
    for (uint32_t k = 0; k < planner.contributionCount(); ++k) {
        const Weight& w = planner.plannedWeight(k);
        weights[k] = {isOn(w), w.r * weight_scale_, w.g * weight_scale_, w.b * weight_scale_};
    }
}

uint32_t GatherBlender::dispatch(VkCommandBuffer commands, const Planner&, UpdateTarget) const {
    kernel_.bind(commands, 0);
    kernel_.push(commands, receivers_);
    dispatchRows(commands, (receivers_ + workgroup_size - 1) / workgroup_size, groups_x_max_);
    return 1;
}

uint64_t GatherBlender::deviceBytes() const {
    return bytesOf({&addresses_, &base_, &payload_, &contributions_, &first_record_, &weights_});
}

Expected<ScatterBlender> ScatterBlender::create(const VulkanContext& vulkan, const PackData& data,
                                                const LightmapPages& pages, Transfer& transfer) {
    constexpr uint64_t scratch_bytes = 32;
    const VkPhysicalDeviceLimits limits = limitsOf(vulkan);
    const uint64_t sums_bytes = data.addresses.size() * scratch_bytes;
    if (sums_bytes > limits.maxStorageBufferRange)
        return fail(ErrorCode::Unsupported, fmt::format("Mode scatter needs a storage buffer of {} bytes; the Vulkan "
                                                        "device binds {}.",
                                                        sums_bytes, limits.maxStorageBufferRange));
    std::vector<uint32_t> receivers(data.payload.size());
    forEachRecord(data, [&](uint32_t receiver, const ClusterTerm&, uint32_t record) { receivers[record] = receiver; });
    std::vector<TexelRecord> records;
    records.reserve(data.payload.size());
    for (const TexelRecord& record : data.payload) records.push_back(canonical(data.color_format, record));

    ScatterBlender blender;
    blender.receivers_ = static_cast<uint32_t>(data.addresses.size());
    blender.groups_x_max_ = limits.maxComputeWorkGroupCount[0];
    uint32_t first = 0;
    for (const Contribution& c : data.contributions) {
        blender.parts_.push_back({first, c.receivers});
        first += c.receivers;
    }
    DIMMER_TRY(keep(uploadTable(vulkan, transfer, data.addresses, word_format), blender.addresses_));
    DIMMER_TRY(keep(uploadTable(vulkan, transfer, baseRecords(data), record_format), blender.base_));
    DIMMER_TRY(keep(uploadTable(vulkan, transfer, records, record_format), blender.payload_));
    DIMMER_TRY(keep(uploadTable(vulkan, transfer, receivers, word_format), blender.receivers_of_records_));
    auto sums = createBuffer(vulkan, sums_bytes, VK_BUFFER_USAGE_STORAGE_BUFFER_BIT, MemoryUse::Device);
    if (!sums) return std::unexpected(std::move(sums.error()));
    blender.sums_ = std::move(*sums);
    const KernelBinding bindings[] = {
        KernelBinding::ofTable(blender.addresses_),
        KernelBinding::ofTable(blender.base_),
        KernelBinding::ofTable(blender.payload_),
        KernelBinding::ofTable(blender.receivers_of_records_),
        KernelBinding::ofBuffer(blender.sums_.buffer.get()),
        KernelBinding::ofImage(pages.irradianceStorageView()),
        KernelBinding::ofImage(pages.directionStorageView()),
    };
    const auto format = static_cast<uint32_t>(data.color_format);
    blender.weight_scale_ = weightScale(data.color_format);
    const Specialisation passes[] = {{0, format}, {1, format}, {2, format}};
    auto kernel = Kernel::create(vulkan, {spirv::scatter_texels_comp, spirv::scatter_texels_comp_storage}, bindings,
                                 5 * sizeof(uint32_t), passes);
    if (!kernel) return std::unexpected(std::move(kernel.error()));
    blender.kernel_ = std::move(*kernel);
    return blender;
}

uint64_t ScatterBlender::deviceBytes() const {
    return bytesOf({&addresses_, &base_, &payload_, &receivers_of_records_}) + sums_.size_bytes;
}

uint32_t ScatterBlender::dispatch(VkCommandBuffer commands, const Planner& planner, UpdateTarget) const {
    struct Constants {
        uint32_t count, first_record;
        float r, g, b;
    };
    uint32_t dispatches = 0;
    const auto pass = [&](uint32_t kind, const Constants& constants) {
        if (constants.count == 0) return;
        kernel_.bind(commands, kind);
        kernel_.push(commands, constants);
        dispatchRows(commands, (constants.count + workgroup_size - 1) / workgroup_size, groups_x_max_);
        passBarrier(commands);
        ++dispatches;
    };
    // The update before may still be writing sums.
    passBarrier(commands);
    pass(0, {receivers_, 0, 0, 0, 0});
    for (uint32_t k = 0; k < parts_.size(); ++k) {
        const Weight& w = planner.plannedWeight(k);
        if (w == Weight(0)) continue;
        pass(1,
             {parts_[k].count, parts_[k].first_record, w.r * weight_scale_, w.g * weight_scale_, w.b * weight_scale_});
    }
    pass(2, {receivers_, 0, 0, 0, 0});
    return dispatches;
}

}  // namespace dimmer
