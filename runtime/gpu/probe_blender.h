// The kernel shaders/blend_probes.comp with its buffers: executes work lists on light probes.
#pragma once

#include <gpu/kernel.h>
#include <gpu/transfer.h>
#include <update/planner.h>

namespace dimmer {

class ProbeBlender {
   public:
    // Uploads records and the base (blocking), to write `set_count` sets of probes. Unsupported where the device's
    // limits are too small for the pack.
    static Expected<ProbeBlender> create(const VulkanContext& vulkan, const PackData& data, const Planner& planner,
                                         uint32_t set_count, Transfer& transfer);

    // As TexelExecutor's; the dispatches are recorded between barriers, for readers at `stages`.
    void write(const Planner& planner, uint32_t set);
    uint32_t dispatch(VkCommandBuffer commands, const Planner& planner, uint32_t set,
                      VkPipelineStageFlags stages) const;

    VkBuffer probes(uint32_t set) const { return sets_[set].probes.buffer.get(); }
    uint64_t deviceBytes() const;
    uint32_t pipelineCount() const { return kernel_.pipelineCount(); }
    // Blocking.
    Expected<std::vector<uint32_t>> read(uint32_t set, Transfer& readback) const;

   private:
    struct Set {
        TexelBuffer items, terms;
        GpuBuffer probes;
    };
    Expected<void> createTables(const VulkanContext& vulkan, const PackData& data, Transfer& transfer);
    Expected<void> createSet(const VulkanContext& vulkan, const PackData& data, const Planner& planner,
                             Transfer& transfer);
    Expected<void> createKernel(VkDevice device, ColorFormat format, const Planner& planner);

    const ProbeData* data_ = nullptr;
    TexelBuffer places_, numbers_, records_16_, records_8_, records_4_;
    std::vector<Set> sets_;
    Kernel kernel_;
    uint32_t groups_x_max_ = 0;
};

}  // namespace dimmer
