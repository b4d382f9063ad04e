// The kernel shaders/blend_texels.comp with its buffers: executes work lists on lightmap pages.
#pragma once

#include <gpu/kernel.h>
#include <gpu/texel_executor.h>

#include <array>

namespace dimmer {

class TexelBlender : public TexelExecutor {
   public:
    // Uploads addresses, base and payload (blocking), and makes one pipeline per group of work that clusters can fall
    // into. Unsupported where the device's limits are too small for the pack.
    static Expected<TexelBlender> create(const VulkanContext& vulkan, const PackData& data, const Planner& planner,
                                         const LightmapPages& pages, Transfer& transfer, bool per_combination);

    void write(const Planner& planner) override;
    uint32_t dispatch(VkCommandBuffer commands, const Planner& planner) const override;
    uint64_t deviceBytes() const override;
    uint32_t pipelineCount() const override { return kernel_.pipelineCount(); }

   private:
    Expected<void> createTables(const VulkanContext& vulkan, const PackData& data, const Planner& planner,
                                Transfer& transfer);
    Expected<void> createKernel(VkDevice device, const Planner& planner, const LightmapPages& pages);
    void recordDispatch(VkCommandBuffer commands, uint32_t first_item, uint32_t item_count) const;
    uint32_t dispatchGroup(VkCommandBuffer commands, const WorkList& work, const WorkGroup& group) const;

    TexelBuffer addresses_, base_, payload_, work_, terms_, places_, first_records_;
    Kernel kernel_;
    uint32_t groups_x_max_ = 0;
    bool per_combination_ = false;  // a dispatch per cluster, as UBERBAKE's section 3.3 describes
};

}  // namespace dimmer
