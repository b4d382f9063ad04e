// Blocking copies between the host and the device, in pieces through a staging buffer. For loading and for tools.
#pragma once

#include <gpu/memory.h>

#include <functional>

namespace dimmer {

class Transfer {
   public:
    // Large enough that a piece's fixed cost (a submission and its fence, tens of microseconds) vanishes beside its
    // copy, small enough to be nothing beside a level.
    static constexpr VkDeviceSize staging_bytes = 8 << 20;

    static Expected<Transfer> create(const VulkanContext& vulkan, MemoryUse use);

    // Records commands, submits them and blocks until they are done.
    Expected<void> run(const std::function<void(VkCommandBuffer)>& record);
    // Fills `target` from `target_offset` on; fill(offset, piece) writes the piece that begins `offset` bytes further.
    // Pieces are multiples of 8 bytes when size_bytes is.
    Expected<void> upload(VkBuffer target, VkDeviceSize size_bytes,
                          const std::function<void(VkDeviceSize offset, std::span<std::byte> piece)>& fill,
                          VkDeviceSize target_offset = 0);

    // Copies parts of staging() to `target` and blocks until they are there, for whatever later submissions read.
    Expected<void> send(VkBuffer target, std::span<const VkBufferCopy> regions);

    const GpuBuffer& staging() const { return staging_; }

   private:
    VulkanContext vulkan_;
    GpuBuffer staging_;
    CommandPoolHandle pool_;
    FenceHandle fence_;
    VkCommandBuffer commands_ = VK_NULL_HANDLE;
};

// A command pool whose buffers are reset one by one, and one buffer of it.
struct CommandBuffer {
    CommandPoolHandle pool;
    VkCommandBuffer commands = VK_NULL_HANDLE;
};
Expected<CommandBuffer> createCommandBuffer(VkDevice device, uint32_t queue_family);

}  // namespace dimmer
