// Vulkan's input structures, zeroed but for their type.
#pragma once

#include <vulkan/vulkan.h>

namespace dimmer {

template <class T>
T vkStruct(VkStructureType type, const void* next = nullptr) {
    T value{};
    value.sType = type;
    value.pNext = const_cast<void*>(next);  // some structures chain const, some not; Vulkan's inputs are not written
    return value;
}

}  // namespace dimmer
