// Clusters whose lists of contributions are nearly the same become one, where that takes less memory.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace dimmer::cook {

// Receivers of one page with the same contributions; both lists ascend.
struct Group {
    std::vector<uint32_t> contributions;
    uint32_t page = 0;
    std::vector<uint32_t> items;
};

// Device memory in bytes that depends on how receivers are grouped, the largest work list included.
struct GroupBytes {
    uint32_t record;  // of each contribution and of the base
    uint32_t step;    // groups have room for a multiple of so many receivers
    uint32_t term;    // of a contribution of a group
    uint32_t batch;   // of batch_receivers_max receivers of a group
    int64_t of(size_t receivers, size_t contributions) const;
};
extern const GroupBytes texel_group_bytes, probe_group_bytes;

// Where several sets' light ends, hardly two texels have the same list, and a cluster of three texels with 20
// contributions has a larger work list than records. Such a cluster joins one in its tiles when the records without
// light that this needs take less than what it saves: each receiver holds every contribution of the joined list. What
// is blended stays the same, bit for bit, as such records add 0.
//
// `tile_of_item`: where each item lies, any number. `contributions_max`: no joined list is longer; 0: no limit. Cost:
// each group that may gain is compared with all others in its tiles. Deterministic.
std::vector<Group> mergeGroups(std::vector<Group> groups, std::span<const uint64_t> tile_of_item,
                               const GroupBytes& bytes, uint32_t contributions_max);

}  // namespace dimmer::cook
