// The light probes that shaders read: the pack's by their number, then those of moving models. A buffer per set of
// pages; blending and resampling write it.
#pragma once

#include <gpu/transfer.h>
#include <pack/pack_data.h>

#include <vector>

namespace dimmer {

class ProbeAtlas {
   public:
    // With the base in every set (blocking). Unsupported where the device's limits are too small.
    static Expected<ProbeAtlas> create(const VulkanContext& vulkan, const PackData& data, uint32_t moving_probes,
                                       uint32_t set_count, Transfer& transfer);

    VkBuffer buffer(uint32_t set) const { return sets_[set].buffer.get(); }
    uint32_t setCount() const { return static_cast<uint32_t>(sets_.size()); }
    uint64_t deviceBytes() const;

    // Around the dispatches that write a set, and between those where one reads what another wrote; `readers`: the
    // stages in which frames read probes.
    static void beginWrites(VkCommandBuffer commands, VkPipelineStageFlags readers);
    static void betweenWrites(VkCommandBuffer commands);
    static void endWrites(VkCommandBuffer commands, VkPipelineStageFlags readers);

    // Blocking.
    Expected<std::vector<uint32_t>> read(uint32_t set, Transfer& readback) const;

   private:
    std::vector<GpuBuffer> sets_;
};

}  // namespace dimmer
