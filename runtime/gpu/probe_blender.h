// The kernel shaders/blend_probes.comp with its buffers: executes work lists on light probes.
#pragma once

#include <gpu/kernel.h>
#include <gpu/probe_atlas.h>
#include <gpu/texel_executor.h>
#include <update/planner.h>

namespace dimmer {

class ProbeBlender {
   public:
    // Uploads records (blocking), to write the atlas's sets, by so many work lists. Unsupported where the device's
    // limits are too small for the pack.
    static Expected<ProbeBlender> create(const VulkanContext& vulkan, const PackData& data, const Planner& planner,
                                         const ProbeAtlas& atlas, uint32_t lists, Transfer& transfer);

    // As TexelExecutor's, without barriers.
    void write(const Planner& planner, uint32_t list);
    uint32_t dispatch(VkCommandBuffer commands, const Planner& planner, UpdateTarget target) const;
    uint64_t deviceBytes() const;
    uint32_t pipelineCount() const { return kernel_.pipelineCount(); }

   private:
    struct Work {
        GpuTable items, terms;
    };
    Expected<void> createTables(const VulkanContext& vulkan, const PackData& data, Transfer& transfer);
    Expected<void> createWork(const VulkanContext& vulkan, const Planner& planner);
    Expected<void> createKernel(const VulkanContext& vulkan, ColorFormat format, const Planner& planner,
                                const ProbeAtlas& atlas);

    const ProbeData* data_ = nullptr;
    GpuTable places_, numbers_, records_16_, records_8_, records_4_;
    std::vector<Work> work_;
    Kernel kernel_;
    uint32_t groups_x_max_ = 0;
};

}  // namespace dimmer
