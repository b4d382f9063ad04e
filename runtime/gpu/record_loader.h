// Brings records to the device beside the game: a piece at a time, never waiting for the device.
#pragma once

#include <gpu/record_queue.h>

namespace dimmer {

class RecordLoader {
   public:
    // Of a pack with so many elements and contributions. Holds no device memory and no commands until there is
    // something to load, and takes no host memory later: what add() and cancel() are asked for they do.
    RecordLoader(const VulkanContext& vulkan, VkQueue queue, uint32_t queue_family, size_t elements,
                 size_t contributions);
    ~RecordLoader();
    RecordLoader(const RecordLoader&) = delete;
    RecordLoader& operator=(const RecordLoader&) = delete;

    // The store has reserved the contributions' ranges.
    void add(uint32_t light_set, std::span<const uint32_t> contributions, const RecordStore& store);
    // Forgets what is still to come of a light set.
    void cancel(uint32_t light_set, const RecordStore& store);
    // Sends the next piece, of at most so many bytes, unless the last one is still under way. Returns at once.
    Expected<void> step(const RecordStore& store, uint64_t bytes_max);
    bool pending(uint32_t light_set) const;  // constant time
    bool busy() const { return !pieces_.empty() || in_flight_; }
    LoadProgress progress() const { return {done_, total_}; }
    uint64_t deviceBytes() const { return staging_.size_bytes; }

   private:
    Expected<void> create();
    Expected<bool> finished();  // the piece under way
    Expected<void> send(const RecordStore& store);
    void rest();

    VulkanContext vulkan_;
    VkQueue queue_;
    uint32_t queue_family_;
    GpuBuffer staging_;
    CommandBuffer commands_;
    FenceHandle fence_;
    RecordQueue pieces_;
    std::vector<uint32_t> left_;  // per light set, its contributions that are not on the device as a whole
    bool in_flight_ = false;
    std::vector<VkBufferCopy> regions_;  // of the piece that is under way
    std::vector<uint32_t> ends_;         // the light sets of contributions that are whole with it
    uint64_t piece_ = 0;                 // its bytes
    uint64_t done_ = 0, total_ = 0;
};

}  // namespace dimmer
