// The kernel shaders/blend_texels.comp with its buffers: executes work lists on lightmap pages.
#pragma once

#include <gpu/record_store.h>
#include <gpu/texel_executor.h>
#include <update/device_places.h>

#include <array>

namespace dimmer {

// Whether the device holds, in allocations of that size, and reads what a TexelBlender keeps there, with
// RuntimeOptions::records_bytes_max: Unsupported, with the mend, where it does not.
Expected<void> checkTexelLimits(const VkPhysicalDeviceLimits& limits, uint64_t allocation_bytes_max,
                                const DevicePlaces& places, const Planner& planner, uint64_t records_bytes_max);

class TexelBlender : public TexelExecutor {
   public:
    // Uploads places, base and payload (blocking), and makes one pipeline per group of work that clusters can fall
    // into. Unsupported where the device's limits are too small for the pack.
    static Expected<TexelBlender> create(const VulkanContext& vulkan, const PackData& data, const Planner& planner,
                                         std::span<const LightmapPages> page_sets, Transfer& transfer,
                                         const RuntimeOptions& options);

    void write(const Planner& planner, uint32_t list) override;
    uint32_t dispatch(VkCommandBuffer commands, const Planner& planner, UpdateTarget target) const override;
    uint64_t deviceBytes() const override;
    uint32_t pipelineCount() const override { return kernel_.pipelineCount(); }
    RecordStore* records() override { return &records_; }

   private:
    // Written anew by the host for every update that takes it.
    struct Work {
        GpuTable items, terms;
    };

    Expected<void> createTables(const VulkanContext& vulkan, const PackData& data, DevicePlaces places,
                                Transfer& transfer);
    Expected<void> uploadRecords(const PackData& data, Transfer& transfer, bool all);
    Expected<void> createWork(const VulkanContext& vulkan, const Planner& planner);
    Expected<void> createKernel(const VulkanContext& vulkan, const PackData& data, const Planner& planner,
                                std::span<const LightmapPages> page_sets);
    void recordDispatch(VkCommandBuffer commands, uint32_t first_item, uint32_t item_count) const;
    uint32_t dispatchGroup(VkCommandBuffer commands, const WorkList& work, const WorkGroup& group) const;

    GpuTable places_, base_, batches_;
    RecordStore records_;
    std::vector<Work> work_;  // as many as updates may be on their way
    Kernel kernel_;
    uint32_t groups_x_max_ = 0;
    bool per_combination_ = false;  // a dispatch per cluster, as UBERBAKE's section 3.3 describes
};

}  // namespace dimmer
