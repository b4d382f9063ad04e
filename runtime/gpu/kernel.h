// A compute shader with its bindings and one pipeline per set of specialisation constants.
#pragma once

#include <gpu/memory.h>

#include <span>
#include <vector>

namespace dimmer {

// A buffer that kernels read by the number of an element, and the view through which they read it as texels: null where
// it has more elements than the device reads so.
struct GpuTable {
    GpuBuffer buffer;
    BufferViewHandle view;
};
// Of at least one element: what nothing reads still needs something to bind. Unsupported where the device reads so many
// neither as a texel buffer nor as a storage buffer.
Expected<GpuTable> createTable(const VulkanContext& vulkan, VkDeviceSize size_bytes, VkFormat format, MemoryUse use);

// A kernel's SPIR-V, by how it reads its tables (shaders/table.glsl).
struct KernelCode {
    std::span<const uint32_t> texel_tables, storage_tables = {};
};

// What a shader's binding refers to; its number is its place in the list.
struct KernelBinding {
    enum class Kind { TexelBuffer, StorageBuffer, StorageImage };
    Kind kind = Kind::TexelBuffer;
    VkBufferView texels = VK_NULL_HANDLE;
    VkBuffer buffer = VK_NULL_HANDLE;
    VkImageView image = VK_NULL_HANDLE;  // in VK_IMAGE_LAYOUT_GENERAL while the kernel runs
    VkDeviceSize table_bytes = 0;

    static KernelBinding ofTable(const GpuTable& table) {
        return {
            .texels = table.view.get(), .buffer = table.buffer.buffer.get(), .table_bytes = table.buffer.size_bytes};
    }
    static KernelBinding ofBuffer(VkBuffer buffer) { return {.kind = Kind::StorageBuffer, .buffer = buffer}; }
    static KernelBinding ofImage(VkImageView view) { return {.kind = Kind::StorageImage, .image = view}; }
};

// The values of constant ids 0, 1, ...; 32 bits each.
using Specialisation = std::vector<uint32_t>;

class Kernel {
   public:
    // `bindings`: one list after another of as many, where there are several sets to choose from. Where a table has no
    // view, all are bound as storage buffers; Unsupported where the device does not bind so large or so many.
    static Expected<Kernel> create(const VulkanContext& vulkan, const KernelCode& code,
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

}  // namespace dimmer
