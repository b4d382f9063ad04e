// The two naive ways of updating pages that UBERBAKE's section 3.3 rules out: kept to measure against and to check
// with.
#pragma once

#include <gpu/kernel.h>
#include <gpu/texel_executor.h>

namespace dimmer {

// Variable-length lists per texel; shaders/gather_texels.comp.
class GatherBlender : public TexelExecutor {
   public:
    static Expected<GatherBlender> create(const VulkanContext& vulkan, const PackData& data, const LightmapPages& pages,
                                          Transfer& transfer);
    void write(const Planner& planner, uint32_t list) override;
    uint32_t dispatch(VkCommandBuffer commands, const Planner& planner, UpdateTarget target) const override;
    uint64_t deviceBytes() const override;
    uint32_t pipelineCount() const override { return kernel_.pipelineCount(); }

   private:
    GpuTable addresses_, base_, payload_, contributions_, first_record_, weights_;
    Kernel kernel_;
    uint32_t receivers_ = 0, groups_x_max_ = 0;
    float weight_scale_ = 1;
};

// One pass per contribution over 32-bit sums; shaders/scatter_texels.comp.
class ScatterBlender : public TexelExecutor {
   public:
    static Expected<ScatterBlender> create(const VulkanContext& vulkan, const PackData& data,
                                           const LightmapPages& pages, Transfer& transfer);
    void write(const Planner&, uint32_t) override {}  // weights are push constants
    uint32_t dispatch(VkCommandBuffer commands, const Planner& planner, UpdateTarget target) const override;
    uint64_t deviceBytes() const override;
    uint32_t pipelineCount() const override { return kernel_.pipelineCount(); }

   private:
    struct Part {
        uint32_t first_record, count;
    };
    GpuTable addresses_, base_, payload_, receivers_of_records_;
    GpuBuffer sums_;
    Kernel kernel_;
    std::vector<Part> parts_;  // per contribution
    uint32_t receivers_ = 0, groups_x_max_ = 0;
    float weight_scale_ = 1;
};

}  // namespace dimmer
