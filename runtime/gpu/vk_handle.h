// Owners of Vulkan objects: destroyed with their scope, moved, never copied.
#pragma once

#include <gpu/vulkan_functions.h>

#include <utility>

namespace dimmer {

// A child of a device; `destroy` is a vkDestroy* or vkFreeMemory, or points to the pointer to one.
template <class T, auto* destroy>
class DeviceHandle {
   public:
    DeviceHandle() = default;
    DeviceHandle(VkDevice device, T handle) : device_(device), handle_(handle) {}
    ~DeviceHandle() { reset(); }
    DeviceHandle(DeviceHandle&& other) noexcept
        : device_(other.device_), handle_(std::exchange(other.handle_, VK_NULL_HANDLE)) {}
    DeviceHandle& operator=(DeviceHandle&& other) noexcept {
        if (this == &other) return *this;
        reset();
        device_ = other.device_;
        handle_ = std::exchange(other.handle_, VK_NULL_HANDLE);
        return *this;
    }

    T get() const { return handle_; }
    explicit operator bool() const { return handle_ != VK_NULL_HANDLE; }

   private:
    void reset() {
        if (handle_ != VK_NULL_HANDLE) (*destroy)(device_, handle_, nullptr);
        handle_ = VK_NULL_HANDLE;
    }
    VkDevice device_ = VK_NULL_HANDLE;
    T handle_ = VK_NULL_HANDLE;
};

using BufferHandle = DeviceHandle<VkBuffer, &vkDestroyBuffer>;
using BufferViewHandle = DeviceHandle<VkBufferView, &vkDestroyBufferView>;
using ImageHandle = DeviceHandle<VkImage, &vkDestroyImage>;
using ImageViewHandle = DeviceHandle<VkImageView, &vkDestroyImageView>;
using MemoryHandle = DeviceHandle<VkDeviceMemory, &vkFreeMemory>;
using SamplerHandle = DeviceHandle<VkSampler, &vkDestroySampler>;
using ShaderModuleHandle = DeviceHandle<VkShaderModule, &vkDestroyShaderModule>;
using SetLayoutHandle = DeviceHandle<VkDescriptorSetLayout, &vkDestroyDescriptorSetLayout>;
using DescriptorPoolHandle = DeviceHandle<VkDescriptorPool, &vkDestroyDescriptorPool>;
using PipelineLayoutHandle = DeviceHandle<VkPipelineLayout, &vkDestroyPipelineLayout>;
using PipelineHandle = DeviceHandle<VkPipeline, &vkDestroyPipeline>;
using CommandPoolHandle = DeviceHandle<VkCommandPool, &vkDestroyCommandPool>;
using FenceHandle = DeviceHandle<VkFence, &vkDestroyFence>;
using SemaphoreHandle = DeviceHandle<VkSemaphore, &vkDestroySemaphore>;
using QueryPoolHandle = DeviceHandle<VkQueryPool, &vkDestroyQueryPool>;

}  // namespace dimmer
