#include <gpu/record_loader.h>

#include <gpu/queue_turn.h>
#include <gpu/vk_result.h>
#include <gpu/vk_struct.h>

#include <algorithm>
#include <limits>

namespace dimmer {
namespace {

constexpr VkDeviceSize staging_bytes = 4 << 20;

}  // namespace

RecordLoader::RecordLoader(const VulkanContext& vulkan, VkQueue queue, uint32_t queue_family, size_t elements,
                           size_t contributions)
    : vulkan_(vulkan), queue_(queue), queue_family_(queue_family), pieces_(contributions), left_(elements) {
    regions_.reserve(contributions);
    ends_.reserve(contributions);
}

RecordLoader::~RecordLoader() {
    if (!in_flight_) return;
    const VkFence fence = fence_.get();
    vkWaitForFences(vulkan_.device, 1, &fence, VK_TRUE, std::numeric_limits<uint64_t>::max());
}

void RecordLoader::add(uint32_t light_set, std::span<const uint32_t> contributions, const RecordStore& store) {
    if (!busy()) done_ = total_ = 0;
    for (const uint32_t contribution : contributions) {
        if (store.byteCount(contribution) == 0) continue;
        total_ += store.byteCount(contribution);
        ++left_[light_set];
        pieces_.add(light_set, contribution, store);
    }
}

void RecordLoader::cancel(uint32_t light_set, const RecordStore& store) {
    if (!pending(light_set)) return;
    total_ -= pieces_.remove(light_set, store);
    // Contributions that end with the piece under way are counted when it has arrived.
    left_[light_set] = static_cast<uint32_t>(std::ranges::count(ends_, light_set));
}

bool RecordLoader::pending(uint32_t light_set) const {
    return left_[light_set] > 0;
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
    for (const uint32_t light_set : ends_) --left_[light_set];
    ends_.clear();
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
    if (pieces_.empty()) {
        rest();
        return {};
    }
    if (!staging_.buffer) DIMMER_TRY(create());
    // In pairs of records, as the store lays them out.
    const uint64_t asked = bytes_max == 0 ? staging_bytes : bytes_max;
    const uint64_t room = std::min(staging_bytes, std::max<uint64_t>(asked / 16 * 16, 16));
    piece_ = pieces_.fill(store, std::span(staging_.mapped, room), regions_);
    DIMMER_TRY(send(store));
    pieces_.advance(store, piece_, ends_);
    return {};
}

Expected<void> RecordLoader::send(const RecordStore& store) {
    auto begin = vkStruct<VkCommandBufferBeginInfo>(VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO);
    begin.flags = VK_COMMAND_BUFFER_USAGE_ONE_TIME_SUBMIT_BIT;
    DIMMER_VK(vkBeginCommandBuffer, commands_.commands, &begin);
    constexpr VkPipelineStageFlags compute = VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT,
                                   copy = VK_PIPELINE_STAGE_TRANSFER_BIT;
    memoryBarrier(commands_.commands, compute | copy, VK_ACCESS_TRANSFER_WRITE_BIT, copy, VK_ACCESS_TRANSFER_WRITE_BIT);
    vkCmdCopyBuffer(commands_.commands, staging_.buffer.get(), store.buffer(), static_cast<uint32_t>(regions_.size()),
                    regions_.data());
    memoryBarrier(commands_.commands, copy, VK_ACCESS_TRANSFER_WRITE_BIT, compute, VK_ACCESS_SHADER_READ_BIT);
    DIMMER_VK(vkEndCommandBuffer, commands_.commands);
    auto submit = vkStruct<VkSubmitInfo>(VK_STRUCTURE_TYPE_SUBMIT_INFO);
    submit.commandBufferCount = 1;
    submit.pCommandBuffers = &commands_.commands;
    const QueueTurn turn(vulkan_.queue_lock, queue_);
    DIMMER_VK(vkQueueSubmit, queue_, 1, &submit, fence_.get());
    in_flight_ = true;
    return {};
}

}  // namespace dimmer
