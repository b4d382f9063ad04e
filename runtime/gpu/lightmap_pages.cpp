#include <gpu/lightmap_pages.h>

#include <fmt/format.h>
#include <format/texel.h>
#include <gpu/queue_family.h>
#include <gpu/vk_result.h>
#include <gpu/vk_struct.h>

#include <algorithm>
#include <cstring>

namespace dimmer {
namespace {

constexpr VkFormat direction_format = VK_FORMAT_A2B10G10R10_UNORM_PACK32;
constexpr VkFormat storage_format = VK_FORMAT_R32_UINT;

// Storage through a view of another format than the image's, which itself need not support storage.
constexpr VkImageCreateFlags image_flags = VK_IMAGE_CREATE_MUTABLE_FORMAT_BIT | VK_IMAGE_CREATE_EXTENDED_USAGE_BIT;
constexpr VkImageUsageFlags image_usage = VK_IMAGE_USAGE_SAMPLED_BIT | VK_IMAGE_USAGE_STORAGE_BIT |
                                          VK_IMAGE_USAGE_TRANSFER_SRC_BIT | VK_IMAGE_USAGE_TRANSFER_DST_BIT;

struct NamedFormat {
    VkFormat format;
    const char* name;
};

NamedFormat irradianceFormat(ColorFormat format) {
    if (format == ColorFormat::E5B9G9R9) return {VK_FORMAT_E5B9G9R9_UFLOAT_PACK32, "E5B9G9R9_UFLOAT_PACK32"};
    return {VK_FORMAT_B10G11R11_UFLOAT_PACK32, "B10G11R11_UFLOAT_PACK32"};
}

VkFormatFeatureFlags imageFeatures(VkPhysicalDevice device, VkFormat format) {
    VkFormatProperties properties;
    vkGetPhysicalDeviceFormatProperties(device, format, &properties);
    return properties.optimalTilingFeatures;
}

Expected<void> checkSupport(const VulkanContext& vulkan, VkFormat format, const char* format_name, uint32_t width,
                            uint32_t height, uint32_t layers) {
    constexpr VkFormatFeatureFlags filtered =
        VK_FORMAT_FEATURE_SAMPLED_IMAGE_BIT | VK_FORMAT_FEATURE_SAMPLED_IMAGE_FILTER_LINEAR_BIT;
    if ((imageFeatures(vulkan.physical_device, format) & filtered) != filtered)
        return fail(ErrorCode::Unsupported, fmt::format("The Vulkan device does not filter {} images.", format_name));
    if (!(imageFeatures(vulkan.physical_device, storage_format) & VK_FORMAT_FEATURE_STORAGE_IMAGE_BIT))
        return fail(ErrorCode::Unsupported, "The Vulkan device has no R32_UINT storage images.");

    VkImageFormatProperties limits;
    const VkResult result = vkGetPhysicalDeviceImageFormatProperties(
        vulkan.physical_device, format, VK_IMAGE_TYPE_2D, VK_IMAGE_TILING_OPTIMAL, image_usage, image_flags, &limits);
    if (result == VK_ERROR_FORMAT_NOT_SUPPORTED)
        return fail(ErrorCode::Unsupported,
                    fmt::format("The Vulkan device cannot write {} images through R32_UINT views.", format_name));
    if (result != VK_SUCCESS) return vulkanError(result, "vkGetPhysicalDeviceImageFormatProperties");
    return checkPageLimits(limits, width, height, layers);
}

Expected<ImageViewHandle> createView(VkDevice device, VkImage image, VkFormat format, VkImageUsageFlags usage) {
    auto usage_info = vkStruct<VkImageViewUsageCreateInfo>(VK_STRUCTURE_TYPE_IMAGE_VIEW_USAGE_CREATE_INFO);
    usage_info.usage = usage;
    auto info = vkStruct<VkImageViewCreateInfo>(VK_STRUCTURE_TYPE_IMAGE_VIEW_CREATE_INFO, &usage_info);
    info.image = image;
    info.viewType = VK_IMAGE_VIEW_TYPE_2D_ARRAY;
    info.format = format;
    info.subresourceRange = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 1, 0, VK_REMAINING_ARRAY_LAYERS};
    VkImageView view = VK_NULL_HANDLE;
    DIMMER_VK(vkCreateImageView, device, &info, nullptr, &view);
    return ImageViewHandle(device, view);
}

VkPipelineStageFlags samplingStages(const VulkanContext& vulkan) {
    const bool draws = queueFamilies(vulkan.physical_device)[vulkan.queue_family].queueFlags & VK_QUEUE_GRAPHICS_BIT;
    return VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT | (draws ? VK_PIPELINE_STAGE_FRAGMENT_SHADER_BIT : 0);
}

}  // namespace

Expected<void> checkPageLimits(const VkImageFormatProperties& limits, uint32_t width, uint32_t height,
                               uint32_t layers) {
    if (width > limits.maxExtent.width || height > limits.maxExtent.height || layers > limits.maxArrayLayers)
        return fail(
            ErrorCode::Unsupported,
            fmt::format("The pack's {} pages of {} x {} texels exceed the Vulkan device's {} layers of {} x {}. "
                        "Cook with smaller pages.",
                        layers, width, height, limits.maxArrayLayers, limits.maxExtent.width, limits.maxExtent.height));
    const uint64_t bytes = sizeof(uint32_t) * width * height * layers;
    if (bytes <= limits.maxResourceSize) return {};
    return fail(ErrorCode::Unsupported,
                fmt::format("The pack's {} pages of {} x {} texels are images of {} bytes; the Vulkan device's are at "
                            "most {} bytes. Cook with fewer texels per metre.",
                            layers, width, height, bytes, limits.maxResourceSize));
}

Expected<LightmapPages> LightmapPages::create(const VulkanContext& vulkan, const PackData& data, Transfer& transfer) {
    LightmapPages pages;
    pages.width_ = data.page_width;
    pages.height_ = data.page_height;
    pages.layers_ = data.page_count;
    pages.sampling_stages_ = samplingStages(vulkan);
    const NamedFormat irradiance_format = irradianceFormat(data.color_format);
    DIMMER_TRY(checkSupport(vulkan, irradiance_format.format, irradiance_format.name, pages.width_, pages.height_,
                            pages.layers_));
    DIMMER_TRY(
        checkSupport(vulkan, direction_format, "A2B10G10R10_UNORM_PACK32", pages.width_, pages.height_, pages.layers_));

    auto irradiance = pages.createArray(vulkan, irradiance_format.format);
    if (!irradiance) return std::unexpected(std::move(irradiance.error()));
    pages.irradiance_ = std::move(*irradiance);
    auto direction = pages.createArray(vulkan, direction_format);
    if (!direction) return std::unexpected(std::move(direction.error()));
    pages.direction_ = std::move(*direction);
    DIMMER_TRY(pages.createSampler(vulkan));
    DIMMER_TRY(pages.fill(data, transfer));
    return pages;
}

Expected<LightmapPages::PageArray> LightmapPages::createArray(const VulkanContext& vulkan, VkFormat format) const {
    const VkFormat view_formats[] = {format, storage_format};
    auto formats = vkStruct<VkImageFormatListCreateInfo>(VK_STRUCTURE_TYPE_IMAGE_FORMAT_LIST_CREATE_INFO);
    formats.viewFormatCount = 2;
    formats.pViewFormats = view_formats;
    auto info = vkStruct<VkImageCreateInfo>(VK_STRUCTURE_TYPE_IMAGE_CREATE_INFO, &formats);
    info.flags = image_flags;
    info.imageType = VK_IMAGE_TYPE_2D;
    info.format = format;
    info.extent = {width_, height_, 1};
    info.mipLevels = 1;
    info.arrayLayers = layers_;
    info.samples = VK_SAMPLE_COUNT_1_BIT;
    info.tiling = VK_IMAGE_TILING_OPTIMAL;
    info.usage = image_usage;
    info.initialLayout = VK_IMAGE_LAYOUT_UNDEFINED;

    PageArray array;
    auto image = createImage(vulkan, info);
    if (!image) return std::unexpected(std::move(image.error()));
    array.image = std::move(*image);
    auto sampled_view = createView(vulkan.device, array.image.image.get(), format, VK_IMAGE_USAGE_SAMPLED_BIT);
    if (!sampled_view) return std::unexpected(std::move(sampled_view.error()));
    array.sampled_view = std::move(*sampled_view);
    auto storage_view = createView(vulkan.device, array.image.image.get(), storage_format, VK_IMAGE_USAGE_STORAGE_BIT);
    if (!storage_view) return std::unexpected(std::move(storage_view.error()));
    array.storage_view = std::move(*storage_view);
    return array;
}

Expected<void> LightmapPages::createSampler(const VulkanContext& vulkan) {
    auto info = vkStruct<VkSamplerCreateInfo>(VK_STRUCTURE_TYPE_SAMPLER_CREATE_INFO);
    info.magFilter = VK_FILTER_LINEAR;
    info.minFilter = VK_FILTER_LINEAR;
    info.mipmapMode = VK_SAMPLER_MIPMAP_MODE_NEAREST;
    info.addressModeU = info.addressModeV = info.addressModeW = VK_SAMPLER_ADDRESS_MODE_CLAMP_TO_EDGE;
    VkSampler sampler = VK_NULL_HANDLE;
    DIMMER_VK(vkCreateSampler, vulkan.device, &info, nullptr, &sampler);
    sampler_ = SamplerHandle(vulkan.device, sampler);
    return {};
}

LightmapImages LightmapPages::images() const {
    return {irradiance_.image.image.get(),
            irradiance_.sampled_view.get(),
            direction_.image.image.get(),
            direction_.sampled_view.get(),
            sampler_.get(),
            width_,
            height_,
            layers_};
}

LightmapPages::State LightmapPages::sampled(bool drawing) const {
    constexpr VkPipelineStageFlags compute = VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT;
    const VkPipelineStageFlags stages = drawing ? sampling_stages_ : compute;
    return {VK_IMAGE_LAYOUT_SHADER_READ_ONLY_OPTIMAL, stages, VK_ACCESS_SHADER_READ_BIT};
}

void LightmapPages::transition(VkCommandBuffer commands, const State& from, const State& to) const {
    VkImageMemoryBarrier barriers[2];
    for (int i = 0; i < 2; ++i) {
        auto& barrier = barriers[i];
        barrier = vkStruct<VkImageMemoryBarrier>(VK_STRUCTURE_TYPE_IMAGE_MEMORY_BARRIER);
        barrier.srcAccessMask = from.access;
        barrier.dstAccessMask = to.access;
        barrier.oldLayout = from.layout;
        barrier.newLayout = to.layout;
        barrier.srcQueueFamilyIndex = barrier.dstQueueFamilyIndex = VK_QUEUE_FAMILY_IGNORED;
        barrier.image = (i == 0 ? irradiance_ : direction_).image.image.get();
        barrier.subresourceRange = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 1, 0, VK_REMAINING_ARRAY_LAYERS};
    }
    vkCmdPipelineBarrier(commands, from.stages, to.stages, 0, 0, nullptr, 0, nullptr, 2, barriers);
}

namespace {
constexpr VkPipelineStageFlags compute_stage = VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT;
}

void LightmapPages::beginWrites(VkCommandBuffer commands, bool drawing) const {
    transition(commands, sampled(drawing), {VK_IMAGE_LAYOUT_GENERAL, compute_stage, VK_ACCESS_SHADER_WRITE_BIT});
}

void LightmapPages::endWrites(VkCommandBuffer commands, bool drawing) const {
    transition(commands, {VK_IMAGE_LAYOUT_GENERAL, compute_stage, VK_ACCESS_SHADER_WRITE_BIT}, sampled(drawing));
}

Expected<void> LightmapPages::forEachPiece(
    const std::function<Expected<void>(const VkBufferImageCopy&, size_t, size_t)>& copy) const {
    // A row is at most page_side_max * 4 bytes = 16 KiB, so a piece holds many.
    const auto rows_max = static_cast<uint32_t>(Transfer::staging_bytes / (width_ * sizeof(uint32_t)));
    for (uint32_t layer = 0; layer < layers_; ++layer) {
        for (uint32_t y = 0; y < height_; y += rows_max) {
            VkBufferImageCopy region{};
            region.imageSubresource = {VK_IMAGE_ASPECT_COLOR_BIT, 0, layer, 1};
            region.imageOffset = {0, static_cast<int32_t>(y), 0};
            region.imageExtent = {width_, std::min(rows_max, height_ - y), 1};
            const size_t first_texel = (size_t{layer} * height_ + y) * width_;
            DIMMER_TRY(copy(region, first_texel, size_t{region.imageExtent.height} * width_));
        }
    }
    return {};
}

Expected<void> LightmapPages::fill(const PackData& data, Transfer& transfer) {
    const State undefined{VK_IMAGE_LAYOUT_UNDEFINED, VK_PIPELINE_STAGE_TOP_OF_PIPE_BIT, 0};
    const State target{VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL, VK_PIPELINE_STAGE_TRANSFER_BIT,
                       VK_ACCESS_TRANSFER_WRITE_BIT};
    DIMMER_TRY(transfer.run([&](VkCommandBuffer commands) { transition(commands, undefined, target); }));
    auto* staging = reinterpret_cast<uint32_t*>(transfer.staging().mapped);
    for (const bool irradiance : {true, false}) {
        const VkImage image = (irradiance ? irradiance_ : direction_).image.image.get();
        DIMMER_TRY(forEachPiece([&](const VkBufferImageCopy& region, size_t first, size_t count) {
            for (size_t i = 0; i < count; ++i) {
                const TexelRecord& record = data.base_pages[first + i];
                staging[i] = irradiance ? canonical(data.color_format, record).irradiance : record.direction;
            }
            return transfer.run([&](VkCommandBuffer commands) {
                vkCmdCopyBufferToImage(commands, transfer.staging().buffer.get(), image,
                                       VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL, 1, &region);
            });
        }));
    }
    return transfer.run([&](VkCommandBuffer commands) { transition(commands, target, sampled()); });
}

// Each piece leaves the pages in the layout that shaders expect, whatever fails.
Expected<void> LightmapPages::readArray(Transfer& transfer, VkImage image, std::vector<uint32_t>& texels) const {
    const State source{VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL, VK_PIPELINE_STAGE_TRANSFER_BIT,
                       VK_ACCESS_TRANSFER_READ_BIT};
    texels.resize(size_t{layers_} * height_ * width_);
    return forEachPiece([&](const VkBufferImageCopy& region, size_t first, size_t count) -> Expected<void> {
        DIMMER_TRY(transfer.run([&](VkCommandBuffer commands) {
            transition(commands, sampled(), source);
            vkCmdCopyImageToBuffer(commands, image, VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL,
                                   transfer.staging().buffer.get(), 1, &region);
            auto barrier = vkStruct<VkMemoryBarrier>(VK_STRUCTURE_TYPE_MEMORY_BARRIER);
            barrier.srcAccessMask = VK_ACCESS_TRANSFER_WRITE_BIT;
            barrier.dstAccessMask = VK_ACCESS_HOST_READ_BIT;
            vkCmdPipelineBarrier(commands, VK_PIPELINE_STAGE_TRANSFER_BIT, VK_PIPELINE_STAGE_HOST_BIT, 0, 1, &barrier,
                                 0, nullptr, 0, nullptr);
            transition(commands, source, sampled());
        }));
        std::memcpy(&texels[first], transfer.staging().mapped, count * sizeof(uint32_t));
        return {};
    });
}

Expected<Runtime::Pages> LightmapPages::read(Transfer& transfer) const {
    Runtime::Pages pages;
    DIMMER_TRY(readArray(transfer, irradiance_.image.image.get(), pages.irradiance));
    DIMMER_TRY(readArray(transfer, direction_.image.image.get(), pages.direction));
    return pages;
}

}  // namespace dimmer
