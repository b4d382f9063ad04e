// Contributions whose records go to the device one after the other, many small ones to a piece.
#pragma once

#include <gpu/record_store.h>

#include <vector>

namespace dimmer {

class RecordQueue {
   public:
    static constexpr uint32_t no_light_set = ~0u;  // of contributions of the base and of doors

    // Allocates for so many contributions that wait at a time; nothing else does.
    explicit RecordQueue(size_t contributions_max) { waiting_.reserve(contributions_max); }

    // The store has reserved the contribution's range.
    void add(uint32_t light_set, uint32_t contribution, const RecordStore& store);
    // Forgets what is still to come of a light set, the rest of a contribution in its middle included. Returns its
    // bytes.
    uint64_t remove(uint32_t light_set, const RecordStore& store);
    bool empty() const { return waiting_.empty(); }

    // Writes what comes next into `staging`, to its end or the queue's; `regions` says where each part belongs in the
    // store's buffer, a part for each contribution at most. Returns the bytes written.
    uint64_t fill(const RecordStore& store, std::span<std::byte> staging, std::vector<VkBufferCopy>& regions) const;
    // So many bytes of what fill() wrote are sent. Appends the light set of each contribution that has nothing left.
    void advance(const RecordStore& store, uint64_t bytes, std::vector<uint32_t>& ended);

   private:
    struct Load {
        uint32_t light_set, contribution;
        uint64_t next_byte;
    };
    std::vector<Load> waiting_;  // the next one first
};

}  // namespace dimmer
