#include <gpu/record_queue.h>

namespace dimmer {

void RecordQueue::add(uint32_t light_set, uint32_t contribution, const RecordStore& store) {
    if (store.byteCount(contribution) > 0) waiting_.push_back({light_set, contribution, 0});
}

uint64_t RecordQueue::remove(uint32_t light_set, const RecordStore& store) {
    uint64_t bytes = 0;
    std::erase_if(waiting_, [&](const Load& load) {
        if (load.light_set != light_set) return false;
        bytes += store.byteCount(load.contribution) - load.next_byte;
        return true;
    });
    return bytes;
}

uint64_t RecordQueue::fill(const RecordStore& store, std::span<std::byte> staging,
                           std::vector<VkBufferCopy>& regions) const {
    uint64_t used = 0;
    regions.clear();
    for (const Load& load : waiting_) {
        if (used == staging.size()) break;
        const uint64_t bytes = std::min(store.byteCount(load.contribution) - load.next_byte, staging.size() - used);
        store.fill(load.contribution, load.next_byte, staging.subspan(used, bytes));
        regions.push_back(
            {.srcOffset = used, .dstOffset = store.firstByte(load.contribution) + load.next_byte, .size = bytes});
        used += bytes;
    }
    return used;
}

void RecordQueue::advance(const RecordStore& store, uint64_t bytes, std::vector<uint32_t>& ended) {
    auto next = waiting_.begin();
    for (; next != waiting_.end(); ++next) {
        const uint64_t left = store.byteCount(next->contribution) - next->next_byte;
        if (bytes < left) {
            next->next_byte += bytes;
            break;
        }
        bytes -= left;
        ended.push_back(next->light_set);
    }
    waiting_.erase(waiting_.begin(), next);
}

}  // namespace dimmer
