// A compute shader with its bindings and one pipeline per set of specialisation constants.
#pragma once

#include <gpu/memory.h>

#include <span>
#include <vector>

namespace dimmer {

// What a shader's binding refers to; its number is its place in the list.
struct KernelBinding {
    enum class Kind { TexelBuffer, StorageBuffer, StorageImage };
    Kind kind = Kind::TexelBuffer;
    VkBufferView texels = VK_NULL_HANDLE;
    VkBuffer buffer = VK_NULL_HANDLE;
    VkImageView image = VK_NULL_HANDLE;  // in VK_IMAGE_LAYOUT_GENERAL while the kernel runs

    static KernelBinding ofTexels(VkBufferView view) { return {.kind = Kind::TexelBuffer, .texels = view}; }
    static KernelBinding ofBuffer(VkBuffer buffer) { return {.kind = Kind::StorageBuffer, .buffer = buffer}; }
    static KernelBinding ofImage(VkImageView view) { return {.kind = Kind::StorageImage, .image = view}; }
};

// The values of constant ids 0, 1, ...; 32 bits each.
using Specialisation = std::vector<uint32_t>;

class Kernel {
   public:
    // `bindings`: one list after another of as many, where there are several sets to choose from.
    static Expected<Kernel> create(const VulkanContext& vulkan, std::span<const uint32_t> spirv,
                                   std::span<const KernelBinding> bindings, uint32_t push_constant_bytes,
                                   std::span<const Specialisation> pipelines, uint32_t set_count = 1);

    void bind(VkCommandBuffer commands, size_t pipeline, uint32_t set = 0) const;
    uint32_t pipelineCount() const { return static_cast<uint32_t>(pipelines_.size()); }
    template <class Constants>
    void push(VkCommandBuffer commands, const Constants& constants) const {
        vkCmdPushConstants(commands, pipeline_layout_.get(), VK_SHADER_STAGE_COMPUTE_BIT, 0, sizeof(constants),
                           &constants);
    }

   private:
    Expected<void> createLayouts(VkDevice device, std::span<const KernelBinding> bindings,
                                 uint32_t push_constant_bytes);
    Expected<void> createDescriptors(VkDevice device, std::span<const KernelBinding> bindings, uint32_t set_count);
    Expected<VkDescriptorSet> createSet(VkDevice device, std::span<const KernelBinding> bindings) const;
    Expected<void> createPipelines(const VulkanContext& vulkan, std::span<const uint32_t> spirv,
                                   std::span<const Specialisation> specialisations);

    SetLayoutHandle set_layout_;
    PipelineLayoutHandle pipeline_layout_;
    DescriptorPoolHandle descriptor_pool_;
    std::vector<VkDescriptorSet> descriptors_;
    std::vector<PipelineHandle> pipelines_;
};

// A buffer and the view through which shaders read it as texels.
struct TexelBuffer {
    GpuBuffer buffer;
    BufferViewHandle view;
};
// Of at least one texel: what nothing reads still needs a view to bind. Unsupported where they are more than the device
// reads as one buffer.
Expected<TexelBuffer> createTexelBuffer(const VulkanContext& vulkan, VkDeviceSize size_bytes, VkFormat format,
                                        MemoryUse use);

}  // namespace dimmer
