// The queue families of a Vulkan device, and whether one will do for the runtime.
#pragma once

#include <dimmer/error.h>

#include <fmt/format.h>
#include <gpu/vulkan_functions.h>

#include <span>
#include <string_view>
#include <vector>

namespace dimmer {

inline std::vector<VkQueueFamilyProperties> queueFamilies(VkPhysicalDevice device) {
    uint32_t count = 0;
    vkGetPhysicalDeviceQueueFamilyProperties(device, &count, nullptr);
    std::vector<VkQueueFamilyProperties> families(count);
    vkGetPhysicalDeviceQueueFamilyProperties(device, &count, families.data());
    return families;
}

// `field`: of the VulkanContext, for the error.
inline Expected<void> checkQueueFamily(std::string_view field, uint32_t family,
                                       std::span<const VkQueueFamilyProperties> families) {
    if (family >= families.size())
        return fail(ErrorCode::InvalidArgument,
                    fmt::format("{} is {}, but the Vulkan device has {} queue families. Set it to the "
                                "family that the queue was taken from.",
                                field, family, families.size()));
    if (families[family].queueFlags & VK_QUEUE_COMPUTE_BIT) return {};
    return fail(ErrorCode::InvalidArgument,
                fmt::format("{} is {}, a queue family without compute. Take the queue from a family "
                            "with VK_QUEUE_COMPUTE_BIT.",
                            field, family));
}

}  // namespace dimmer
