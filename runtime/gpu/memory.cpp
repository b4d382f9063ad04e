#include <gpu/memory.h>

#include <fmt/format.h>
#include <gpu/vk_result.h>
#include <gpu/vk_struct.h>

#include <algorithm>
#include <array>
#include <vector>

namespace dimmer {
namespace {

// What is best first, then what will do.
std::array<VkMemoryPropertyFlags, 2> wanted(MemoryUse use) {
    constexpr VkMemoryPropertyFlags host = VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT | VK_MEMORY_PROPERTY_HOST_COHERENT_BIT;
    switch (use) {
        case MemoryUse::Device:
            return {VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT, 0};
        case MemoryUse::Readback:
            return {host | VK_MEMORY_PROPERTY_HOST_CACHED_BIT, host};
        case MemoryUse::Upload:
            break;
    }
    return {host, host};
}

// Those that will do, the best first.
std::vector<uint32_t> memoryTypes(const VkPhysicalDeviceMemoryProperties& properties, uint32_t allowed_types,
                                  MemoryUse use) {
    std::vector<uint32_t> types;
    for (const VkMemoryPropertyFlags flags : wanted(use))
        for (uint32_t i = 0; i < properties.memoryTypeCount; ++i)
            if ((allowed_types >> i & 1) && (properties.memoryTypes[i].propertyFlags & flags) == flags &&
                std::ranges::find(types, i) == types.end())
                types.push_back(i);
    return types;
}

Expected<MemoryHandle> allocate(const VulkanContext& vulkan, const VkMemoryRequirements& requirements, MemoryUse use) {
    const VkDeviceSize bytes_max = allocationBytesMax(vulkan.physical_device);
    if (requirements.size > bytes_max)
        return fail(ErrorCode::Unsupported,
                    fmt::format("A buffer or image of the runtime's needs {} bytes of memory, and the Vulkan device "
                                "allocates {} bytes at most. Cook with fewer texels per metre or wider light grids, or "
                                "ask for fewer moving probes.",
                                requirements.size, bytes_max));
    VkPhysicalDeviceMemoryProperties properties;
    vkGetPhysicalDeviceMemoryProperties(vulkan.physical_device, &properties);
    const std::vector<uint32_t> types = memoryTypes(properties, requirements.memoryTypeBits, use);
    if (types.empty())
        return fail(ErrorCode::Unsupported, "The Vulkan device has no memory type of the kind that is needed.");

    auto info = vkStruct<VkMemoryAllocateInfo>(VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO);
    info.allocationSize = requirements.size;
    VkDeviceMemory memory = VK_NULL_HANDLE;
    VkResult result = VK_ERROR_OUT_OF_DEVICE_MEMORY;
    for (const uint32_t type : types) {
        info.memoryTypeIndex = type;
        result = vkAllocateMemory(vulkan.device, &info, nullptr, &memory);
        // A small heap of the device's may be full, and its types come first.
        if (result != VK_ERROR_OUT_OF_DEVICE_MEMORY || use != MemoryUse::Device) break;
    }
    if (result < 0) return vulkanError(result, "vkAllocateMemory");
    return MemoryHandle(vulkan.device, memory);
}

// Two families may use what both are named for; exclusive ownership would need transfers at every update.
template <class Info>
void share(const VulkanContext& vulkan, std::array<uint32_t, 2>& families, Info& info) {
    families = {vulkan.queue_family, vulkan.compute_queue_family};
    if (!vulkan.compute_queue || families[0] == families[1]) return;
    info.sharingMode = VK_SHARING_MODE_CONCURRENT;
    info.queueFamilyIndexCount = static_cast<uint32_t>(families.size());
    info.pQueueFamilyIndices = families.data();
}

}  // namespace

VkPhysicalDeviceLimits limitsOf(const VulkanContext& vulkan) {
    VkPhysicalDeviceProperties properties;
    vkGetPhysicalDeviceProperties(vulkan.physical_device, &properties);
    return properties.limits;
}

VkDeviceSize allocationBytesMax(VkPhysicalDevice device) {
    auto allocations =
        vkStruct<VkPhysicalDeviceMaintenance3Properties>(VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_MAINTENANCE_3_PROPERTIES);
    auto properties =
        vkStruct<VkPhysicalDeviceProperties2>(VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_PROPERTIES_2, &allocations);
    vkGetPhysicalDeviceProperties2(device, &properties);
    return allocations.maxMemoryAllocationSize;
}

Expected<GpuBuffer> createBuffer(const VulkanContext& vulkan, VkDeviceSize size_bytes, VkBufferUsageFlags usage,
                                 MemoryUse use) {
    GpuBuffer result;
    result.size_bytes = size_bytes;
    auto info = vkStruct<VkBufferCreateInfo>(VK_STRUCTURE_TYPE_BUFFER_CREATE_INFO);
    info.size = size_bytes;
    info.usage = usage;
    std::array<uint32_t, 2> families;
    share(vulkan, families, info);
    VkBuffer buffer = VK_NULL_HANDLE;
    DIMMER_VK(vkCreateBuffer, vulkan.device, &info, nullptr, &buffer);
    result.buffer = BufferHandle(vulkan.device, buffer);

    VkMemoryRequirements requirements;
    vkGetBufferMemoryRequirements(vulkan.device, buffer, &requirements);
    auto memory = allocate(vulkan, requirements, use);
    if (!memory) return std::unexpected(std::move(memory.error()));
    result.memory = std::move(*memory);
    DIMMER_VK(vkBindBufferMemory, vulkan.device, buffer, result.memory.get(), 0);
    if (use != MemoryUse::Device) {
        void* mapped = nullptr;
        DIMMER_VK(vkMapMemory, vulkan.device, result.memory.get(), 0, VK_WHOLE_SIZE, 0, &mapped);
        result.mapped = static_cast<std::byte*>(mapped);
    }
    return result;
}

Expected<GpuImage> createImage(const VulkanContext& vulkan, VkImageCreateInfo info) {
    GpuImage result;
    std::array<uint32_t, 2> families;
    share(vulkan, families, info);
    result.size_bytes = VkDeviceSize{4} * info.extent.width * info.extent.height * info.arrayLayers;
    VkImage image = VK_NULL_HANDLE;
    DIMMER_VK(vkCreateImage, vulkan.device, &info, nullptr, &image);
    result.image = ImageHandle(vulkan.device, image);

    VkMemoryRequirements requirements;
    vkGetImageMemoryRequirements(vulkan.device, image, &requirements);
    auto memory = allocate(vulkan, requirements, MemoryUse::Device);
    if (!memory) return std::unexpected(std::move(memory.error()));
    result.memory = std::move(*memory);
    DIMMER_VK(vkBindImageMemory, vulkan.device, image, result.memory.get(), 0);
    return result;
}

}  // namespace dimmer
