// Two storage buffers and push constants for a pipeline that draws from them.
#pragma once

#include <dimmer/runtime.h>
#include <gpu/vk_handle.h>

#include <array>

namespace dimmer::sample {

class StorageBindings {
   public:
    // Bindings 0 and 1 of set 0, seen by `stages`, as are the push constants. The buffers must outlive it.
    static Expected<StorageBindings> create(VkDevice device, const std::array<VkBuffer, 2>& buffers,
                                            VkShaderStageFlags stages, uint32_t constants_bytes);

    VkPipelineLayout layout() const { return layout_.get(); }
    // Before draws of a pipeline with that layout; `constants` has as many bytes as create() was told.
    void bind(VkCommandBuffer commands, const void* constants) const;

   private:
    SetLayoutHandle set_layout_;
    DescriptorPoolHandle pool_;
    VkDescriptorSet set_ = VK_NULL_HANDLE;
    PipelineLayoutHandle layout_;
    VkShaderStageFlags stages_ = 0;
    uint32_t constants_bytes_ = 0;
};

}  // namespace dimmer::sample
