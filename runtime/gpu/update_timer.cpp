#include <gpu/update_timer.h>

#include <gpu/memory.h>
#include <gpu/queue_family.h>
#include <gpu/vk_result.h>
#include <gpu/vk_struct.h>

#include <algorithm>
#include <vector>

namespace dimmer {

Expected<std::optional<UpdateTimer>> UpdateTimer::create(const VulkanContext& vulkan, uint32_t updates) {
    const auto families = queueFamilies(vulkan.physical_device);
    uint32_t bits = families[vulkan.queue_family].timestampValidBits;
    if (vulkan.compute_queue) bits = std::min(bits, families[vulkan.compute_queue_family].timestampValidBits);
    if (bits == 0) return std::nullopt;

    const VkPhysicalDeviceLimits limits = limitsOf(vulkan);
    UpdateTimer timer;
    timer.device_ = vulkan.device;
    timer.valid_mask_ = bits >= 64 ? ~uint64_t{0} : (uint64_t{1} << bits) - 1;
    timer.us_per_tick_ = static_cast<double>(limits.timestampPeriod) * 1e-3;  // it is in nanoseconds
    auto info = vkStruct<VkQueryPoolCreateInfo>(VK_STRUCTURE_TYPE_QUERY_POOL_CREATE_INFO);
    info.queryType = VK_QUERY_TYPE_TIMESTAMP;
    info.queryCount = 2 * updates;
    VkQueryPool pool = VK_NULL_HANDLE;
    DIMMER_VK(vkCreateQueryPool, vulkan.device, &info, nullptr, &pool);
    timer.queries_ = QueryPoolHandle(vulkan.device, pool);
    return timer;
}

void UpdateTimer::reset(VkCommandBuffer commands, uint32_t update) const {
    vkCmdResetQueryPool(commands, queries_.get(), 2 * update, 2);
}

// Both at the compute stage: the first once earlier work of that stage is done, the second once the update is.
void UpdateTimer::begin(VkCommandBuffer commands, uint32_t update) const {
    vkCmdWriteTimestamp(commands, VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT, queries_.get(), 2 * update);
}

void UpdateTimer::end(VkCommandBuffer commands, uint32_t update) const {
    vkCmdWriteTimestamp(commands, VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT, queries_.get(), 2 * update + 1);
}

Expected<std::optional<double>> UpdateTimer::read(uint32_t update) const {
    uint64_t ticks[2] = {};
    const VkResult result = vkGetQueryPoolResults(device_, queries_.get(), 2 * update, 2, sizeof(ticks), ticks,
                                                  sizeof(ticks[0]), VK_QUERY_RESULT_64_BIT);
    if (result == VK_NOT_READY) return std::nullopt;
    if (result < 0) return vulkanError(result, "vkGetQueryPoolResults");
    return static_cast<double>((ticks[1] - ticks[0]) & valid_mask_) * us_per_tick_;
}

}  // namespace dimmer
