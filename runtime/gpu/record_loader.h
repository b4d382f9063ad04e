// Brings records to the device beside the game: a piece at a time, never waiting for the device.
#pragma once

#include <gpu/record_store.h>

#include <deque>

namespace dimmer {

class RecordLoader {
   public:
    // Holds no memory and no commands until there is something to load.
    RecordLoader(const VulkanContext& vulkan, VkQueue queue, uint32_t queue_family);
    ~RecordLoader();
    RecordLoader(const RecordLoader&) = delete;
    RecordLoader& operator=(const RecordLoader&) = delete;

    // The store has reserved the contribution's range.
    void add(uint32_t contribution, const RecordStore& store);
    // Forgets a contribution that is still to come; one in the middle of it included.
    void cancel(uint32_t contribution);
    // Sends the next piece, of at most so many bytes, unless the last one is still under way. Returns at once.
    Expected<void> step(const RecordStore& store, uint64_t bytes_max);
    bool pending(uint32_t contribution) const;  // constant time
    bool busy() const { return !waiting_.empty() || in_flight_; }
    LoadProgress progress() const { return {done_, total_}; }
    uint64_t deviceBytes() const { return staging_.size_bytes; }

   private:
    struct Load {
        uint32_t contribution;
        uint64_t next_byte;
    };
    Expected<void> create();
    Expected<bool> finished();  // the piece under way
    Expected<void> send(const RecordStore& store, Load& load, uint64_t bytes);
    void rest();

    VulkanContext vulkan_;
    VkQueue queue_;
    uint32_t queue_family_;
    GpuBuffer staging_;
    CommandBuffer commands_;
    FenceHandle fence_;
    std::deque<Load> waiting_;
    std::vector<bool> is_waiting_;  // by contribution
    bool in_flight_ = false;
    uint32_t piece_of_ = 0;  // the contribution that is under way
    uint64_t piece_ = 0;     // and its bytes
    uint64_t done_ = 0, total_ = 0;
};

}  // namespace dimmer
