// VkResult as our errors.
#pragma once

#include <dimmer/error.h>

#include <vulkan/vulkan.h>
#include <string_view>

namespace dimmer {

// `call`: the Vulkan function that returned `result`, a failure.
std::unexpected<Error> vulkanError(VkResult result, std::string_view call);

}  // namespace dimmer

// Returns from the enclosing function when a Vulkan call fails. (A macro: only a macro can return.)
#define DIMMER_VK(function, ...)                                               \
    do {                                                                       \
        if (const VkResult vk_result_ = function(__VA_ARGS__); vk_result_ < 0) \
            return ::dimmer::vulkanError(vk_result_, #function);               \
    } while (false)

// Returns from the enclosing function when an Expected<void> holds an error.
#define DIMMER_TRY(expression)                                                                            \
    do {                                                                                                  \
        if (auto outcome_ = (expression); !outcome_) return std::unexpected(std::move(outcome_.error())); \
    } while (false)
