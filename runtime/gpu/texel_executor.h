// What carries out a plan on the device.
#pragma once

#include <gpu/lightmap_pages.h>
#include <update/planner.h>

#include <memory>
#include <span>

namespace dimmer {

class RecordStore;

// Where an update writes, and which of the work lists it is carried out by.
struct UpdateTarget {
    uint32_t set = 0;  // of pages, or of probes
    uint32_t list = 0;
};

class TexelExecutor {
   public:
    virtual ~TexelExecutor() = default;

    // Copies the plan to the device's view of it: the dispatches of the previous one in this list must have completed.
    virtual void write(const Planner& planner, uint32_t list) = 0;
    // Records the dispatches, without barriers around them. Returns their number.
    virtual uint32_t dispatch(VkCommandBuffer commands, const Planner& planner, UpdateTarget target) const = 0;

    virtual uint64_t deviceBytes() const = 0;
    virtual uint32_t pipelineCount() const = 0;
    // Whose ranges may be loaded and dropped; null in modes that keep records in an order of their own.
    virtual RecordStore* records() { return nullptr; }
};

// Uploads what the mode needs (blocking), to write any of the given sets of pages, by as many work lists as updates may
// be on their way. Unsupported where the device's limits are too small for the pack, and for several sets or lists in
// modes that are there to compare with.
Expected<std::unique_ptr<TexelExecutor>> createExecutor(const VulkanContext& vulkan, const RuntimeOptions& options,
                                                        const PackData& data, const Planner& planner,
                                                        std::span<const LightmapPages> page_sets, Transfer& transfer);

}  // namespace dimmer
