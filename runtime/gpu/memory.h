// Buffers and images with memory of their own. Few and large, so no allocator stands between them and the driver.
#pragma once

#include <dimmer/runtime.h>
#include <gpu/vk_handle.h>

#include <span>

namespace dimmer {

struct GpuBuffer {
    MemoryHandle memory;  // before the buffer: freed after it
    BufferHandle buffer;
    std::byte* mapped = nullptr;  // host-visible buffers only; coherent, mapped until destruction
    VkDeviceSize size_bytes = 0;
};

struct GpuImage {
    MemoryHandle memory;
    ImageHandle image;
    VkDeviceSize size_bytes = 0;  // of its texels, of 4 bytes; alignment is not counted
};

enum class MemoryUse {
    Device,    // read and written by the GPU
    Upload,    // written by the host in order, read by the GPU
    Readback,  // written by the GPU, read by the host
};

VkPhysicalDeviceLimits limitsOf(const VulkanContext& vulkan);

// What the device allocates at a time. 0: its instance is for a Vulkan before 1.1, where nobody says.
VkDeviceSize allocationBytesMax(VkPhysicalDevice device);

// In the best type of memory for its use; where that is full, what the device alone uses goes to the next best, whose
// heap may be the host's. Both may be used on the context's queue and on its compute queue. Unsupported: larger than
// the device allocates at a time.
Expected<GpuBuffer> createBuffer(const VulkanContext& vulkan, VkDeviceSize size_bytes, VkBufferUsageFlags usage,
                                 MemoryUse memory);
Expected<GpuImage> createImage(const VulkanContext& vulkan, VkImageCreateInfo info);

}  // namespace dimmer
