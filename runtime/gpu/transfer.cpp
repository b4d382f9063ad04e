#include <gpu/transfer.h>

#include <gpu/queue_turn.h>
#include <gpu/vk_result.h>
#include <gpu/vk_struct.h>

#include <algorithm>
#include <limits>

namespace dimmer {

Expected<CommandBuffer> createCommandBuffer(VkDevice device, uint32_t queue_family) {
    CommandBuffer result;
    auto pool_info = vkStruct<VkCommandPoolCreateInfo>(VK_STRUCTURE_TYPE_COMMAND_POOL_CREATE_INFO);
    pool_info.flags = VK_COMMAND_POOL_CREATE_RESET_COMMAND_BUFFER_BIT | VK_COMMAND_POOL_CREATE_TRANSIENT_BIT;
    pool_info.queueFamilyIndex = queue_family;
    VkCommandPool pool = VK_NULL_HANDLE;
    DIMMER_VK(vkCreateCommandPool, device, &pool_info, nullptr, &pool);
    result.pool = CommandPoolHandle(device, pool);

    auto info = vkStruct<VkCommandBufferAllocateInfo>(VK_STRUCTURE_TYPE_COMMAND_BUFFER_ALLOCATE_INFO);
    info.commandPool = pool;
    info.level = VK_COMMAND_BUFFER_LEVEL_PRIMARY;
    info.commandBufferCount = 1;
    DIMMER_VK(vkAllocateCommandBuffers, device, &info, &result.commands);
    return result;
}

Expected<Transfer> Transfer::create(const VulkanContext& vulkan, MemoryUse use) {
    Transfer transfer;
    transfer.vulkan_ = vulkan;
    const VkBufferUsageFlags usage =
        use == MemoryUse::Readback ? VK_BUFFER_USAGE_TRANSFER_DST_BIT : VK_BUFFER_USAGE_TRANSFER_SRC_BIT;
    auto staging = createBuffer(vulkan, staging_bytes, usage, use);
    if (!staging) return std::unexpected(std::move(staging.error()));
    transfer.staging_ = std::move(*staging);

    auto commands = createCommandBuffer(vulkan.device, vulkan.queue_family);
    if (!commands) return std::unexpected(std::move(commands.error()));
    transfer.pool_ = std::move(commands->pool);
    transfer.commands_ = commands->commands;

    const auto fence_info = vkStruct<VkFenceCreateInfo>(VK_STRUCTURE_TYPE_FENCE_CREATE_INFO);
    VkFence fence = VK_NULL_HANDLE;
    DIMMER_VK(vkCreateFence, vulkan.device, &fence_info, nullptr, &fence);
    transfer.fence_ = FenceHandle(vulkan.device, fence);
    return transfer;
}

Expected<void> Transfer::run(const std::function<void(VkCommandBuffer)>& record) {
    auto begin = vkStruct<VkCommandBufferBeginInfo>(VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO);
    begin.flags = VK_COMMAND_BUFFER_USAGE_ONE_TIME_SUBMIT_BIT;
    DIMMER_VK(vkBeginCommandBuffer, commands_, &begin);
    record(commands_);
    DIMMER_VK(vkEndCommandBuffer, commands_);

    auto submit = vkStruct<VkSubmitInfo>(VK_STRUCTURE_TYPE_SUBMIT_INFO);
    submit.commandBufferCount = 1;
    submit.pCommandBuffers = &commands_;
    const VkFence fence = fence_.get();
    DIMMER_VK(vkResetFences, vulkan_.device, 1, &fence);
    {
        const QueueTurn turn(vulkan_.queue_lock, vulkan_.queue);
        DIMMER_VK(vkQueueSubmit, vulkan_.queue, 1, &submit, fence);
    }
    const VkResult waited = vkWaitForFences(vulkan_.device, 1, &fence, VK_TRUE, std::numeric_limits<uint64_t>::max());
    // The device must be done with all of this in any case.
    if (waited == VK_SUCCESS) return {};
    const QueueTurn turn(vulkan_.queue_lock, vulkan_.queue);
    DIMMER_VK(vkQueueWaitIdle, vulkan_.queue);
    return {};
}

Expected<void> Transfer::send(VkBuffer target, std::span<const VkBufferCopy> regions) {
    return run([&](VkCommandBuffer commands) {
        vkCmdCopyBuffer(commands, staging_.buffer.get(), target, static_cast<uint32_t>(regions.size()), regions.data());
        auto barrier = vkStruct<VkMemoryBarrier>(VK_STRUCTURE_TYPE_MEMORY_BARRIER);
        barrier.srcAccessMask = VK_ACCESS_TRANSFER_WRITE_BIT;
        barrier.dstAccessMask = VK_ACCESS_SHADER_READ_BIT;
        vkCmdPipelineBarrier(commands, VK_PIPELINE_STAGE_TRANSFER_BIT, VK_PIPELINE_STAGE_ALL_COMMANDS_BIT, 0, 1,
                             &barrier, 0, nullptr, 0, nullptr);
    });
}

Expected<void> Transfer::upload(VkBuffer target, VkDeviceSize size_bytes,
                                const std::function<void(VkDeviceSize, std::span<std::byte>)>& fill,
                                VkDeviceSize target_offset) {
    for (VkDeviceSize offset = 0; offset < size_bytes; offset += staging_bytes) {
        const VkDeviceSize piece_bytes = std::min(staging_bytes, size_bytes - offset);
        fill(offset, std::span(staging_.mapped, piece_bytes));
        const VkBufferCopy region{.srcOffset = 0, .dstOffset = target_offset + offset, .size = piece_bytes};
        DIMMER_TRY(send(target, std::span(&region, 1)));
    }
    return {};
}

}  // namespace dimmer
