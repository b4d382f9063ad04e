#include <gpu/probe_resampler.h>

#include <fmt/format.h>
#include <gpu/table_upload.h>
#include <gpu/vk_result.h>
#include <probes/grid_table.h>
#include <spirv/resample_probes_comp.h>
#include <spirv/resample_probes_comp_storage.h>

#include <cstring>

namespace dimmer {
namespace {

struct ResampledItems {
    uint32_t item_count, first_moving;
};

}  // namespace

Expected<GpuBuffer> uploadGridTable(const VulkanContext& vulkan, const GlobalGrid& grid, Transfer& transfer) {
    const VkPhysicalDeviceLimits limits = limitsOf(vulkan);
    const uint64_t bytes = gridTableBytes(grid);
    if (bytes > limits.maxStorageBufferRange)
        return fail(
            ErrorCode::Unsupported,
            fmt::format("The global light grid's {} tetrahedra take {} bytes, more than the {} that this Vulkan "
                        "device reads as one buffer. Cook with a wider grid.",
                        grid.tetrahedra.size(), bytes, limits.maxStorageBufferRange));
    auto buffer = createBuffer(vulkan, bytes, VK_BUFFER_USAGE_STORAGE_BUFFER_BIT | VK_BUFFER_USAGE_TRANSFER_DST_BIT,
                               MemoryUse::Device);
    if (!buffer) return buffer;
    const auto table = gridTable(grid);
    const auto words = std::as_bytes(std::span(table));
    DIMMER_TRY(transfer.upload(buffer->buffer.get(), bytes, [&](VkDeviceSize offset, std::span<std::byte> piece) {
        std::ranges::copy(words.subspan(offset, piece.size()), piece.begin());
    }));
    return buffer;
}

Expected<ProbeResampler> ProbeResampler::create(const VulkanContext& vulkan, const PackData& data,
                                                const ModelSlots& models, const ProbeAtlas& atlas, uint32_t lists,
                                                VkBuffer grid_table, Transfer& transfer) {
    const VkPhysicalDeviceLimits limits = limitsOf(vulkan);
    ProbeResampler resampler;
    resampler.first_moving_ = static_cast<uint32_t>(data.probes.base.size());
    resampler.groups_x_max_ = limits.maxComputeWorkGroupCount[0];
    auto hints = createBuffer(vulkan, models.probesMax() * sizeof(uint32_t),
                              VK_BUFFER_USAGE_STORAGE_BUFFER_BIT | VK_BUFFER_USAGE_TRANSFER_DST_BIT, MemoryUse::Device);
    if (!hints) return std::unexpected(std::move(hints.error()));
    resampler.hints_ = std::move(*hints);
    DIMMER_TRY(transfer.upload(resampler.hints_.buffer.get(), resampler.hints_.size_bytes,
                               [](VkDeviceSize, std::span<std::byte> piece) {
                                   std::ranges::fill(piece, std::byte{0xff});  // no_tetrahedron
                               }));
    for (uint32_t i = 0; i < lists; ++i) {
        auto items = createTable(vulkan, models.itemsMax() * sizeof(ResampleItem), VK_FORMAT_R32G32B32A32_UINT,
                                 MemoryUse::Upload);
        if (!items) return std::unexpected(std::move(items.error()));
        resampler.work_.push_back({std::move(*items), 0});
    }
    std::vector<KernelBinding> bindings;
    for (uint32_t set = 0; set < atlas.setCount(); ++set)
        for (const Work& work : resampler.work_)
            bindings.insert(bindings.end(), {KernelBinding::ofTable(work.items), KernelBinding::ofBuffer(grid_table),
                                             KernelBinding::ofBuffer(atlas.buffer(set)),
                                             KernelBinding::ofBuffer(resampler.hints_.buffer.get())});
    const Specialisation pipelines[] = {{static_cast<uint32_t>(data.color_format)}};
    auto kernel = Kernel::create(vulkan, {spirv::resample_probes_comp, spirv::resample_probes_comp_storage}, bindings,
                                 sizeof(ResampledItems), pipelines, atlas.setCount() * lists);
    if (!kernel) return std::unexpected(std::move(kernel.error()));
    resampler.kernel_ = std::move(*kernel);
    return resampler;
}

void ProbeResampler::write(std::span<const ResampleItem> items, uint32_t list) {
    std::memcpy(work_[list].items.buffer.mapped, items.data(), items.size_bytes());
    work_[list].item_count = static_cast<uint32_t>(items.size());
}

void ProbeResampler::dispatch(VkCommandBuffer commands, UpdateTarget target) const {
    const uint32_t items = work_[target.list].item_count;
    kernel_.bind(commands, 0, target.set * static_cast<uint32_t>(work_.size()) + target.list);
    kernel_.push(commands, ResampledItems{items, first_moving_});
    dispatchRows(commands, items, groups_x_max_);
}

uint64_t ProbeResampler::deviceBytes() const {
    uint64_t bytes = hints_.size_bytes;
    for (const Work& work : work_) bytes += bytesOf({&work.items});
    return bytes;
}

}  // namespace dimmer
