// Vulkan's input structures, zeroed but for their type, and what is short to say with them.
#pragma once

#include <gpu/vulkan_functions.h>

namespace dimmer {

template <class T>
T vkStruct(VkStructureType type, const void* next = nullptr) {
    T value{};
    value.sType = type;
    value.pNext = const_cast<void*>(next);  // some structures chain const, some not; Vulkan's inputs are not written
    return value;
}

// What `written` names at stage `from` is done, and seen, before `to` touches memory as `used` says.
inline void memoryBarrier(VkCommandBuffer commands, VkPipelineStageFlags from, VkAccessFlags written,
                          VkPipelineStageFlags to, VkAccessFlags used) {
    auto info = vkStruct<VkMemoryBarrier>(VK_STRUCTURE_TYPE_MEMORY_BARRIER);
    info.srcAccessMask = written;
    info.dstAccessMask = used;
    vkCmdPipelineBarrier(commands, from, to, 0, 1, &info, 0, nullptr, 0, nullptr);
}

}  // namespace dimmer
