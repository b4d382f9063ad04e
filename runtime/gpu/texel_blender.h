// The kernel shaders/blend_texels.comp with its buffers: executes work lists on lightmap pages.
#pragma once

#include <gpu/lightmap_pages.h>
#include <update/planner.h>

#include <array>

namespace dimmer {

class TexelBlender {
   public:
    // Uploads addresses, base and payload (blocking), and makes one pipeline per number of contributions that can be
    // on. Unsupported where the device's limits are too small for the pack.
    static Expected<TexelBlender> create(const VulkanContext& vulkan, const PackData& data, const Planner& planner,
                                         const LightmapPages& pages, Transfer& transfer);

    // Copies the work list to the device's view of it: the dispatches of the previous one must have completed.
    void write(const WorkList& work);
    // Records the dispatches, without barriers. Returns their number.
    uint32_t dispatch(VkCommandBuffer commands, const WorkList& work) const;

   private:
    Expected<void> createBuffers(const VulkanContext& vulkan, const PackData& data, const Planner& planner,
                                 Transfer& transfer);
    Expected<void> createLayouts(VkDevice device);
    Expected<void> createDescriptors(VkDevice device, const LightmapPages& pages);
    Expected<void> createPipelines(VkDevice device, uint32_t overlap_max);

    GpuBuffer addresses_, base_, payload_, items_, terms_;
    SetLayoutHandle set_layout_;
    PipelineLayoutHandle pipeline_layout_;
    DescriptorPoolHandle descriptor_pool_;
    VkDescriptorSet descriptors_ = VK_NULL_HANDLE;
    std::array<PipelineHandle, work_group_count> pipelines_;
    uint32_t groups_x_max_ = 0;
};

}  // namespace dimmer
