#include <gpu/probe_atlas.h>

#include <fmt/format.h>
#include <format/probe.h>
#include <gpu/table_upload.h>
#include <gpu/vk_result.h>
#include <gpu/vk_struct.h>

#include <cstring>

namespace dimmer {
namespace {

constexpr VkPipelineStageFlags compute = VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT;

}  // namespace

Expected<ProbeAtlas> ProbeAtlas::create(const VulkanContext& vulkan, const PackData& data, uint32_t moving_probes,
                                        uint32_t set_count, Transfer& transfer) {
    const VkPhysicalDeviceLimits limits = limitsOf(vulkan);
    const auto base_count = static_cast<uint32_t>(data.probes.base.size());
    const uint64_t bytes = (uint64_t{base_count} + moving_probes) * sizeof(ProbeRecord);
    if (bytes > limits.maxStorageBufferRange)
        return fail(ErrorCode::Unsupported,
                    fmt::format("{} light probes and {} of moving models are more than this Vulkan device reads as one "
                                "buffer of {} bytes. Cook with wider grids, or ask for fewer moving probes.",
                                base_count, moving_probes, limits.maxStorageBufferRange));
    ProbeAtlas atlas;
    const std::vector<Run> all = {{0, 0, static_cast<uint32_t>(words_per_probe * base_count)}};
    for (uint32_t i = 0; i < set_count; ++i) {
        auto made = createBuffer(
            vulkan, bytes,
            VK_BUFFER_USAGE_STORAGE_BUFFER_BIT | VK_BUFFER_USAGE_TRANSFER_DST_BIT | VK_BUFFER_USAGE_TRANSFER_SRC_BIT,
            MemoryUse::Device);
        if (!made) return std::unexpected(std::move(made.error()));
        // What belongs to no model yet is black.
        DIMMER_TRY(transfer.upload(made->buffer.get(), bytes, fillFrom(all, [&](uint32_t word) {
                                       const size_t number = word / words_per_probe, part = word % words_per_probe;
                                       const ProbeRecord record =
                                           canonicalProbe(data.color_format, data.probes.base[number]);
                                       return part == 0 ? record.light : record.bands[part - 1];
                                   })));
        atlas.sets_.push_back(std::move(*made));
    }
    return atlas;
}

uint64_t ProbeAtlas::deviceBytes() const {
    uint64_t bytes = 0;
    for (const GpuBuffer& set : sets_) bytes += set.size_bytes;
    return bytes;
}

void ProbeAtlas::beginWrites(VkCommandBuffer commands, VkPipelineStageFlags readers) {
    memoryBarrier(commands, readers | compute, VK_ACCESS_SHADER_WRITE_BIT, compute,
                  VK_ACCESS_SHADER_READ_BIT | VK_ACCESS_SHADER_WRITE_BIT);
}

void ProbeAtlas::betweenWrites(VkCommandBuffer commands) {
    memoryBarrier(commands, compute, VK_ACCESS_SHADER_WRITE_BIT, compute, VK_ACCESS_SHADER_READ_BIT);
}

void ProbeAtlas::endWrites(VkCommandBuffer commands, VkPipelineStageFlags readers) {
    memoryBarrier(commands, compute, VK_ACCESS_SHADER_WRITE_BIT, readers | VK_PIPELINE_STAGE_TRANSFER_BIT,
                  VK_ACCESS_SHADER_READ_BIT | VK_ACCESS_TRANSFER_READ_BIT);
}

Expected<std::vector<uint32_t>> ProbeAtlas::read(uint32_t set, Transfer& readback) const {
    const VkDeviceSize bytes = sets_[set].size_bytes;
    std::vector<uint32_t> words(bytes / sizeof(uint32_t));
    for (VkDeviceSize offset = 0; offset < bytes; offset += Transfer::staging_bytes) {
        const VkBufferCopy region{
            .srcOffset = offset, .dstOffset = 0, .size = std::min(Transfer::staging_bytes, bytes - offset)};
        DIMMER_TRY(readback.run([&](VkCommandBuffer commands) {
            // Perhaps written on another queue: the host has waited, which makes nothing visible here.
            memoryBarrier(commands, compute, VK_ACCESS_MEMORY_WRITE_BIT, VK_PIPELINE_STAGE_TRANSFER_BIT,
                          VK_ACCESS_TRANSFER_READ_BIT);
            vkCmdCopyBuffer(commands, buffer(set), readback.staging().buffer.get(), 1, &region);
            memoryBarrier(commands, VK_PIPELINE_STAGE_TRANSFER_BIT, VK_ACCESS_TRANSFER_WRITE_BIT,
                          VK_PIPELINE_STAGE_HOST_BIT, VK_ACCESS_HOST_READ_BIT);
        }));
        std::memcpy(reinterpret_cast<std::byte*>(words.data()) + offset, readback.staging().mapped, region.size);
    }
    return words;
}

}  // namespace dimmer
