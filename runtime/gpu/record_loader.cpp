#include <gpu/record_loader.h>

#include <gpu/vk_result.h>
#include <gpu/vk_struct.h>

#include <limits>

namespace dimmer {
namespace {

constexpr VkDeviceSize staging_bytes = 4 << 20;

}  // namespace

RecordLoader::RecordLoader(const VulkanContext& vulkan, VkQueue queue, uint32_t queue_family)
    : vulkan_(vulkan), queue_(queue), queue_family_(queue_family) {}

RecordLoader::~RecordLoader() {
    if (!in_flight_) return;
    const VkFence fence = fence_.get();
    vkWaitForFences(vulkan_.device, 1, &fence, VK_TRUE, std::numeric_limits<uint64_t>::max());
}

void RecordLoader::add(uint32_t contribution, const RecordStore& store) {
    if (!busy()) done_ = total_ = 0;
    if (store.byteCount(contribution) == 0) return;
    total_ += store.byteCount(contribution);
    waiting_.push_back({contribution, 0});
    if (is_waiting_.size() <= contribution) is_waiting_.resize(contribution + 1);
    is_waiting_[contribution] = true;
}

void RecordLoader::cancel(uint32_t contribution) {
    if (contribution >= is_waiting_.size() || !is_waiting_[contribution]) return;
    is_waiting_[contribution] = false;
    std::erase_if(waiting_, [&](const Load& load) { return load.contribution == contribution; });
}

bool RecordLoader::pending(uint32_t contribution) const {
    return (in_flight_ && piece_of_ == contribution) ||
           (contribution < is_waiting_.size() && is_waiting_[contribution]);
}

Expected<void> RecordLoader::create() {
    auto staging = createBuffer(vulkan_, staging_bytes, VK_BUFFER_USAGE_TRANSFER_SRC_BIT, MemoryUse::Upload);
    if (!staging) return std::unexpected(std::move(staging.error()));
    auto commands = createCommandBuffer(vulkan_.device, queue_family_);
    if (!commands) return std::unexpected(std::move(commands.error()));
    const auto info = vkStruct<VkFenceCreateInfo>(VK_STRUCTURE_TYPE_FENCE_CREATE_INFO);
    VkFence fence = VK_NULL_HANDLE;
    DIMMER_VK(vkCreateFence, vulkan_.device, &info, nullptr, &fence);
    fence_ = FenceHandle(vulkan_.device, fence);
    staging_ = std::move(*staging);
    commands_ = std::move(*commands);
    return {};
}

Expected<bool> RecordLoader::finished() {
    if (!in_flight_) return true;
    const VkResult status = vkGetFenceStatus(vulkan_.device, fence_.get());
    if (status == VK_NOT_READY) return false;
    if (status < 0) return vulkanError(status, "vkGetFenceStatus");
    const VkFence fence = fence_.get();
    DIMMER_VK(vkResetFences, vulkan_.device, 1, &fence);
    in_flight_ = false;
    done_ += std::exchange(piece_, 0);
    return true;
}

void RecordLoader::rest() {
    staging_ = {};
    commands_ = {};
    fence_ = {};
    done_ = total_;
}

Expected<void> RecordLoader::step(const RecordStore& store, uint64_t bytes_max) {
    const auto free = finished();
    if (!free) return std::unexpected(free.error());
    if (!*free) return {};
    if (waiting_.empty()) {
        rest();
        return {};
    }
    if (!staging_.buffer) DIMMER_TRY(create());
    Load& load = waiting_.front();
    const uint64_t left = store.byteCount(load.contribution) - load.next_byte;
    // In pairs of records, as the store lays them out.
    const uint64_t bytes = std::min({left, staging_bytes, std::max<uint64_t>(bytes_max / 16 * 16, 16)});
    DIMMER_TRY(send(store, load, bytes));
    load.next_byte += bytes;
    piece_of_ = load.contribution;
    piece_ = bytes;
    if (bytes < left) return {};
    is_waiting_[load.contribution] = false;
    waiting_.pop_front();
    return {};
}

Expected<void> RecordLoader::send(const RecordStore& store, Load& load, uint64_t bytes) {
    store.fill(load.contribution, load.next_byte, std::span(staging_.mapped, bytes));
    auto begin = vkStruct<VkCommandBufferBeginInfo>(VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO);
    begin.flags = VK_COMMAND_BUFFER_USAGE_ONE_TIME_SUBMIT_BIT;
    DIMMER_VK(vkBeginCommandBuffer, commands_.commands, &begin);
    constexpr VkPipelineStageFlags compute = VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT,
                                   copy = VK_PIPELINE_STAGE_TRANSFER_BIT;
    memoryBarrier(commands_.commands, compute | copy, VK_ACCESS_TRANSFER_WRITE_BIT, copy, VK_ACCESS_TRANSFER_WRITE_BIT);
    const VkBufferCopy region{
        .srcOffset = 0, .dstOffset = store.firstByte(load.contribution) + load.next_byte, .size = bytes};
    vkCmdCopyBuffer(commands_.commands, staging_.buffer.get(), store.buffer(), 1, &region);
    memoryBarrier(commands_.commands, copy, VK_ACCESS_TRANSFER_WRITE_BIT, compute, VK_ACCESS_SHADER_READ_BIT);
    DIMMER_VK(vkEndCommandBuffer, commands_.commands);
    auto submit = vkStruct<VkSubmitInfo>(VK_STRUCTURE_TYPE_SUBMIT_INFO);
    submit.commandBufferCount = 1;
    submit.pCommandBuffers = &commands_.commands;
    DIMMER_VK(vkQueueSubmit, queue_, 1, &submit, fence_.get());
    in_flight_ = true;
    return {};
}

}  // namespace dimmer
