#include <tools/copy_roof.h>

#include <gpu/vk_result.h>
#include <gpu/vk_struct.h>
#include <spirv/copy_roof_comp.h>
#include <spirv/copy_roof_comp_storage.h>

#include <algorithm>
#include <array>
#include <bit>
#include <limits>

namespace dimmer {
namespace {

constexpr uint64_t unit_bytes = 16;
constexpr uint32_t loads_max = 20;  // 16 contributions, the base, addresses, and room
constexpr uint32_t page_width = 2048;

struct Variant {
    uint32_t workgroup_size, lane_stores;
    bool one_stream;
};
constexpr std::array<Variant, 8> variants = {{{64, 1, false},
                                              {512, 1, false},
                                              {64, 4, false},
                                              {512, 4, false},
                                              {64, 1, true},
                                              {512, 1, true},
                                              {64, 4, true},
                                              {512, 4, true}}};
constexpr int choosing_rounds = 6;

struct Constants {
    uint32_t first, count, stride, page_width;
};

size_t pipelineOf(size_t variant, CopyTarget target, uint32_t loads) {
    return (variant * 2 + (target == CopyTarget::Pages)) * loads_max + loads - 1;
}

Expected<ImageViewHandle> createView(VkDevice device, VkImage image) {
    auto info = vkStruct<VkImageViewCreateInfo>(VK_STRUCTURE_TYPE_IMAGE_VIEW_CREATE_INFO);
    info.image = image;
    info.viewType = VK_IMAGE_VIEW_TYPE_2D_ARRAY;
    info.format = VK_FORMAT_R32_UINT;
    info.subresourceRange = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 1, 0, 1};
    VkImageView view = VK_NULL_HANDLE;
    DIMMER_VK(vkCreateImageView, device, &info, nullptr, &view);
    return ImageViewHandle(device, view);
}

}  // namespace

Expected<CopyRoof> CopyRoof::create(const VulkanContext& vulkan, uint64_t read_bytes_max, uint64_t written_bytes_max) {
    CopyRoof roof;
    roof.vulkan_ = vulkan;
    auto transfer = Transfer::create(vulkan, MemoryUse::Upload);
    if (!transfer) return std::unexpected(std::move(transfer.error()));
    roof.transfer_ = std::move(*transfer);
    auto timer = UpdateTimer::create(vulkan);
    if (!timer) return std::unexpected(std::move(timer.error()));
    if (!*timer) return fail(ErrorCode::Unsupported, "The Vulkan queue has no timestamps, so nothing can be timed.");
    roof.timer_ = std::move(**timer);

    // Streams of loads are padded to whole loads per store.
    auto source = createTable(vulkan, read_bytes_max + written_bytes_max + unit_bytes, VK_FORMAT_R32G32B32A32_UINT,
                              MemoryUse::Device);
    if (!source) return std::unexpected(std::move(source.error()));
    roof.source_ = std::move(*source);
    DIMMER_TRY(roof.transfer_->upload(
        roof.source_.buffer.buffer.get(), roof.source_.buffer.size_bytes,
        [](VkDeviceSize, std::span<std::byte> piece) { std::fill(piece.begin(), piece.end(), std::byte{7}); }));
    auto target = createBuffer(vulkan, std::max(written_bytes_max, unit_bytes), VK_BUFFER_USAGE_STORAGE_BUFFER_BIT,
                               MemoryUse::Device);
    if (!target) return std::unexpected(std::move(target.error()));
    roof.target_ = std::move(*target);
    DIMMER_TRY(roof.createPages(vulkan, written_bytes_max));
    DIMMER_TRY(roof.createKernel(vulkan));
    return roof;
}

Expected<void> CopyRoof::createPages(const VulkanContext& vulkan, uint64_t written_bytes_max) {
    const auto texels = static_cast<uint32_t>(written_bytes_max / 8 + 1);
    for (Image& page : pages_) {
        auto info = vkStruct<VkImageCreateInfo>(VK_STRUCTURE_TYPE_IMAGE_CREATE_INFO);
        info.imageType = VK_IMAGE_TYPE_2D;
        info.format = VK_FORMAT_R32_UINT;
        // More texels than fit an image are stored nowhere, which is no slower.
        info.extent = {page_width, std::min(texels / page_width + 1, 4096u), 1};
        info.mipLevels = info.arrayLayers = 1;
        info.samples = VK_SAMPLE_COUNT_1_BIT;
        info.usage = VK_IMAGE_USAGE_STORAGE_BIT;
        auto image = createImage(vulkan, info);
        if (!image) return std::unexpected(std::move(image.error()));
        page.image = std::move(*image);
        auto view = createView(vulkan.device, page.image.image.get());
        if (!view) return std::unexpected(std::move(view.error()));
        page.view = std::move(*view);
    }
    return transfer_->run([&](VkCommandBuffer commands) {
        for (const Image& page : pages_) {
            auto barrier = vkStruct<VkImageMemoryBarrier>(VK_STRUCTURE_TYPE_IMAGE_MEMORY_BARRIER);
            barrier.dstAccessMask = VK_ACCESS_SHADER_WRITE_BIT;
            barrier.newLayout = VK_IMAGE_LAYOUT_GENERAL;
            barrier.srcQueueFamilyIndex = barrier.dstQueueFamilyIndex = VK_QUEUE_FAMILY_IGNORED;
            barrier.image = page.image.image.get();
            barrier.subresourceRange = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 1, 0, 1};
            vkCmdPipelineBarrier(commands, VK_PIPELINE_STAGE_TOP_OF_PIPE_BIT, VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT, 0,
                                 0, nullptr, 0, nullptr, 1, &barrier);
        }
    });
}

Expected<void> CopyRoof::createKernel(const VulkanContext& vulkan) {
    const VkPhysicalDeviceLimits limits = limitsOf(vulkan);
    groups_x_max_ = limits.maxComputeWorkGroupCount[0];
    group_lanes_max_ = std::min(limits.maxComputeWorkGroupInvocations, limits.maxComputeWorkGroupSize[0]);
    std::vector<Specialisation> pipelines;
    for (const Variant& variant : variants)
        for (const bool to_pages : {false, true})
            for (uint32_t loads = 1; loads <= loads_max; ++loads)
                pipelines.push_back({std::min(variant.workgroup_size, group_lanes_max_), loads, variant.lane_stores,
                                     to_pages, variant.one_stream});
    const KernelBinding bindings[] = {KernelBinding::ofTable(source_), KernelBinding::ofBuffer(target_.buffer.get()),
                                      KernelBinding::ofImage(pages_[0].view.get()),
                                      KernelBinding::ofImage(pages_[1].view.get())};
    auto kernel = Kernel::create(vulkan, {spirv::copy_roof_comp, spirv::copy_roof_comp_storage}, bindings,
                                 sizeof(Constants), pipelines);
    if (!kernel) return std::unexpected(std::move(kernel.error()));
    kernel_ = std::move(*kernel);
    return {};
}

Expected<double> CopyRoof::runVariant(size_t variant, CopyTarget target, uint64_t read_bytes, uint64_t written_bytes) {
    const auto units = static_cast<uint32_t>(written_bytes / unit_bytes);
    const uint64_t loads = read_bytes / unit_bytes;
    if (units == 0 || loads == 0 || loads > uint64_t{loads_max} * units) return 0.0;
    // Some units load one more than the others, so that the sum is right.
    const auto fewer = std::clamp(static_cast<uint32_t>(loads / units), 1u, loads_max - 1);
    const auto with_more =
        static_cast<uint32_t>(std::clamp<int64_t>(static_cast<int64_t>(loads) - int64_t{fewer} * units, 0, units));
    const auto record = [&](VkCommandBuffer commands, uint32_t first, uint32_t count, uint32_t loads_each) {
        if (count == 0) return;
        const Variant& v = variants[variant];
        kernel_->bind(commands, pipelineOf(variant, target, loads_each));
        kernel_->push(commands, Constants{first, count, units, page_width});
        const uint32_t per_group = std::min(v.workgroup_size, group_lanes_max_) * v.lane_stores;
        const uint32_t groups = (count + per_group - 1) / per_group;
        const uint32_t columns = std::min(groups, groups_x_max_);
        vkCmdDispatch(commands, columns, (groups + columns - 1) / columns, 1);
    };
    DIMMER_TRY(transfer_->run([&](VkCommandBuffer commands) {
        // Copies overwrite what the one before wrote.
        auto barrier = vkStruct<VkMemoryBarrier>(VK_STRUCTURE_TYPE_MEMORY_BARRIER);
        barrier.srcAccessMask = barrier.dstAccessMask = VK_ACCESS_SHADER_WRITE_BIT;
        vkCmdPipelineBarrier(commands, VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT, VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT, 0, 1,
                             &barrier, 0, nullptr, 0, nullptr);
        timer_->reset(commands);
        timer_->begin(commands);
        record(commands, 0, with_more, fewer + 1);
        record(commands, with_more, units - with_more, fewer);
        timer_->end(commands);
    }));
    const auto us = timer_->read();
    if (!us) return std::unexpected(us.error());
    return us->value_or(0);
}

Expected<double> CopyRoof::run(CopyTarget target, uint64_t read_bytes, uint64_t written_bytes) {
    const std::pair key(target, std::bit_width(written_bytes));
    if (const auto known = best_.find(key); known != best_.end())
        return runVariant(known->second, target, read_bytes, written_bytes);
    double best_us = std::numeric_limits<double>::infinity();
    size_t best = 0;
    // In turns, as other programs take their share of a machine; the first round compiles.
    for (int round = 0; round < choosing_rounds; ++round)
        for (size_t variant = 0; variant < variants.size(); ++variant) {
            const auto us = runVariant(variant, target, read_bytes, written_bytes);
            if (!us) return us;
            if (round == 0 || *us >= best_us) continue;
            best_us = *us;
            best = variant;
        }
    best_[key] = best;
    return runVariant(best, target, read_bytes, written_bytes);
}

}  // namespace dimmer
