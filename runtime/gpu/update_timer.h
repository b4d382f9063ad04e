// GPU time of updates, by two timestamps each.
#pragma once

#include <dimmer/runtime.h>
#include <gpu/vk_handle.h>

#include <optional>

namespace dimmer {

class UpdateTimer {
   public:
    // For so many updates at a time. Empty where the queue family has no timestamps.
    static Expected<std::optional<UpdateTimer>> create(const VulkanContext& vulkan, uint32_t updates = 1);

    void reset(VkCommandBuffer commands, uint32_t update = 0) const;  // outside a render pass, before begin()
    void begin(VkCommandBuffer commands, uint32_t update = 0) const;
    void end(VkCommandBuffer commands, uint32_t update = 0) const;
    // Microseconds between begin() and end() on the GPU's clock; empty between reset() and end(). Before the device has
    // come to reset(), what was there before it.
    Expected<std::optional<double>> read(uint32_t update = 0) const;

   private:
    VkDevice device_ = VK_NULL_HANDLE;
    QueryPoolHandle queries_;
    uint64_t valid_mask_ = 0;
    double us_per_tick_ = 0;
};

}  // namespace dimmer
