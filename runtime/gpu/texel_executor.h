// What carries out a plan on the device.
#pragma once

#include <gpu/lightmap_pages.h>
#include <update/planner.h>

#include <memory>

namespace dimmer {

class TexelExecutor {
   public:
    virtual ~TexelExecutor() = default;

    // Copies the plan to the device's view of it: the dispatches of the previous one must have completed.
    virtual void write(const Planner& planner) = 0;
    // Records the dispatches, without barriers around them. Returns their number.
    virtual uint32_t dispatch(VkCommandBuffer commands, const Planner& planner) const = 0;

    virtual uint64_t deviceBytes() const = 0;
    virtual uint32_t pipelineCount() const = 0;
};

// Uploads what the mode needs (blocking). Unsupported where the device's limits are too small for the pack.
Expected<std::unique_ptr<TexelExecutor>> createExecutor(const VulkanContext& vulkan, UpdateMode mode,
                                                        const PackData& data, const Planner& planner,
                                                        const LightmapPages& pages, Transfer& transfer);

}  // namespace dimmer
