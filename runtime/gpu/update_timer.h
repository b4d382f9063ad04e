// GPU time of one update, by two timestamps.
#pragma once

#include <dimmer/runtime.h>
#include <gpu/vk_handle.h>

#include <optional>

namespace dimmer {

class UpdateTimer {
   public:
    // Empty where the queue family has no timestamps.
    static Expected<std::optional<UpdateTimer>> create(const VulkanContext& vulkan);

    void reset(VkCommandBuffer commands) const;  // outside a render pass, before begin()
    void begin(VkCommandBuffer commands) const;
    void end(VkCommandBuffer commands) const;
    // Microseconds between begin() and end() on the GPU's clock; empty while they have not been executed.
    Expected<std::optional<double>> read() const;

   private:
    VkDevice device_ = VK_NULL_HANDLE;
    QueryPoolHandle queries_;
    uint64_t valid_mask_ = 0;
    double us_per_tick_ = 0;
};

}  // namespace dimmer
