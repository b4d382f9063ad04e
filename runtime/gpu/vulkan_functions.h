// The Vulkan functions that the runtime calls, as pointers of its own. It must not call the loader's symbols: an engine
// may define variables of these names (volk does), and a linker takes them for the functions.
#pragma once

#include <dimmer/error.h>

#include <vulkan/vulkan.h>

#include <span>
#include <utility>

// X(name) for each function of the runtime, and of HeadlessDevice once it has an instance.
#define DIMMER_VULKAN_FUNCTIONS(X)              \
    X(vkAllocateCommandBuffers)                 \
    X(vkAllocateDescriptorSets)                 \
    X(vkAllocateMemory)                         \
    X(vkBeginCommandBuffer)                     \
    X(vkBindBufferMemory)                       \
    X(vkBindImageMemory)                        \
    X(vkCmdBindDescriptorSets)                  \
    X(vkCmdBindPipeline)                        \
    X(vkCmdCopyBuffer)                          \
    X(vkCmdCopyBufferToImage)                   \
    X(vkCmdCopyImageToBuffer)                   \
    X(vkCmdDispatch)                            \
    X(vkCmdPipelineBarrier)                     \
    X(vkCmdPushConstants)                       \
    X(vkCmdResetQueryPool)                      \
    X(vkCmdWriteTimestamp)                      \
    X(vkCreateBuffer)                           \
    X(vkCreateBufferView)                       \
    X(vkCreateCommandPool)                      \
    X(vkCreateComputePipelines)                 \
    X(vkCreateDescriptorPool)                   \
    X(vkCreateDescriptorSetLayout)              \
    X(vkCreateDevice)                           \
    X(vkCreateFence)                            \
    X(vkCreateImage)                            \
    X(vkCreateImageView)                        \
    X(vkCreatePipelineLayout)                   \
    X(vkCreateQueryPool)                        \
    X(vkCreateSampler)                          \
    X(vkCreateSemaphore)                        \
    X(vkCreateShaderModule)                     \
    X(vkDestroyBuffer)                          \
    X(vkDestroyBufferView)                      \
    X(vkDestroyCommandPool)                     \
    X(vkDestroyDescriptorPool)                  \
    X(vkDestroyDescriptorSetLayout)             \
    X(vkDestroyDevice)                          \
    X(vkDestroyFence)                           \
    X(vkDestroyImage)                           \
    X(vkDestroyImageView)                       \
    X(vkDestroyPipeline)                        \
    X(vkDestroyPipelineLayout)                  \
    X(vkDestroyQueryPool)                       \
    X(vkDestroySampler)                         \
    X(vkDestroySemaphore)                       \
    X(vkDestroyShaderModule)                    \
    X(vkEndCommandBuffer)                       \
    X(vkEnumeratePhysicalDevices)               \
    X(vkFreeMemory)                             \
    X(vkGetBufferMemoryRequirements)            \
    X(vkGetDeviceProcAddr)                      \
    X(vkGetDeviceQueue)                         \
    X(vkGetFenceStatus)                         \
    X(vkGetImageMemoryRequirements)             \
    X(vkGetPhysicalDeviceFeatures2)             \
    X(vkGetPhysicalDeviceFormatProperties)      \
    X(vkGetPhysicalDeviceImageFormatProperties) \
    X(vkGetPhysicalDeviceMemoryProperties)      \
    X(vkGetPhysicalDeviceProperties)            \
    X(vkGetPhysicalDeviceProperties2)           \
    X(vkGetPhysicalDeviceQueueFamilyProperties) \
    X(vkGetQueryPoolResults)                    \
    X(vkMapMemory)                              \
    X(vkQueueSubmit)                            \
    X(vkQueueWaitIdle)                          \
    X(vkResetFences)                            \
    X(vkUpdateDescriptorSets)                   \
    X(vkWaitForFences)                          \
    X(vkWaitSemaphores)

namespace dimmer {

// Within this namespace a call names these, where there are prototypes too. Null before the first VulkanFunctions.
#define DIMMER_DECLARE(name) extern PFN_##name name;
DIMMER_VULKAN_FUNCTIONS(DIMMER_DECLARE)
#undef DIMMER_DECLARE

// Vulkan's loader as this system has it installed, opened when first asked for and never closed; null where there is
// none. Nothing is linked with it, so that a server without it runs what needs no GPU. Thread-safe.
PFN_vkGetInstanceProcAddr installedLoader();
// The same of the first of these libraries that can be opened.
PFN_vkGetInstanceProcAddr loaderOf(std::span<const char* const> libraries);

// Whoever calls the functions, or owns handles, holds one of these meanwhile: they change only while there is none.
class VulkanFunctions {
   public:
    // `get_instance_proc_addr`: null for the installed loader's. Unsupported: there is none, it lacks a function for
    // this instance, or its functions are others than those in use. Thread-safe.
    static Expected<VulkanFunctions> load(PFN_vkGetInstanceProcAddr get_instance_proc_addr, VkInstance instance);

    VulkanFunctions() = default;  // holds nothing
    ~VulkanFunctions();
    VulkanFunctions(VulkanFunctions&& other) noexcept : held_(std::exchange(other.held_, false)) {}
    VulkanFunctions& operator=(VulkanFunctions&& other) noexcept {
        std::swap(held_, other.held_);
        return *this;
    }

   private:
    bool held_ = false;
};

}  // namespace dimmer
