// The global grid's tables on the device, and the kernel shaders/resample_probes.comp that takes the probes of moving
// models from it.
#pragma once

#include <gpu/kernel.h>
#include <gpu/probe_atlas.h>
#include <gpu/texel_executor.h>
#include <probes/model_slots.h>

#include <span>

namespace dimmer {

// Unsupported where the device's limits are too small for it.
Expected<GpuBuffer> uploadGridTable(const VulkanContext& vulkan, const GlobalGrid& grid, Transfer& transfer);

class ProbeResampler {
   public:
    static Expected<ProbeResampler> create(const VulkanContext& vulkan, const PackData& data, const ModelSlots& models,
                                           const ProbeAtlas& atlas, uint32_t lists, VkBuffer grid_table,
                                           Transfer& transfer);

    void write(std::span<const ResampleItem> items, uint32_t list);
    // One dispatch for what was written.
    void dispatch(VkCommandBuffer commands, UpdateTarget target) const;
    uint64_t deviceBytes() const;
    uint32_t pipelineCount() const { return kernel_.pipelineCount(); }

   private:
    struct Work {
        GpuTable items;
        uint32_t item_count = 0;
    };
    std::vector<Work> work_;
    GpuBuffer hints_;
    Kernel kernel_;
    uint32_t first_moving_ = 0, groups_x_max_ = 0;
};

}  // namespace dimmer
