#include <gpu/memory.h>

#include <fmt/format.h>
#include <gpu/vk_result.h>
#include <gpu/vk_struct.h>

#include <array>
#include <optional>

namespace dimmer {
namespace {

std::optional<uint32_t> findMemoryType(const VkPhysicalDeviceMemoryProperties& properties, uint32_t allowed_types,
                                       VkMemoryPropertyFlags flags) {
    for (uint32_t i = 0; i < properties.memoryTypeCount; ++i)
        if ((allowed_types >> i & 1) && (properties.memoryTypes[i].propertyFlags & flags) == flags) return i;
    return std::nullopt;
}

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
    std::optional<uint32_t> type;
    for (VkMemoryPropertyFlags flags : wanted(use))
        if (!type) type = findMemoryType(properties, requirements.memoryTypeBits, flags);
    if (!type) return fail(ErrorCode::Unsupported, "The Vulkan device has no memory type of the kind that is needed.");

    auto info = vkStruct<VkMemoryAllocateInfo>(VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO);
    info.allocationSize = requirements.size;
    info.memoryTypeIndex = *type;
    VkDeviceMemory memory = VK_NULL_HANDLE;
    DIMMER_VK(vkAllocateMemory, vulkan.device, &info, nullptr, &memory);
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
