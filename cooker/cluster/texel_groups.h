// Which texels form a cluster.
#pragma once

#include <charts/texels.h>
#include <cluster/merge.h>

#include <functional>
#include <map>

namespace dimmer::cook {

// A texel of a page, whether baked or a copy.
struct ShownTexel {
    uint64_t order;  // page, tile row, tile column, then inside the tile
    uint32_t address;
    uint32_t source;  // receiver whose light it shows
};

// In the order that clusters keep.
std::vector<ShownTexel> listTexels(const Texels& texels);

// Items (texels or probes, in the order that clusters keep) by the contributions that their light has, and by page.
class Grouping {
   public:
    // `contributions` ascend; items without any are in no group.
    void add(uint32_t item, uint32_t page, std::vector<uint32_t> contributions) {
        if (!contributions.empty()) members_[{std::move(contributions), page}].push_back(item);
    }
    std::vector<Group> groups() && {
        std::vector<Group> all;
        for (auto& [list, items] : members_) all.push_back({list.first, list.second, std::move(items)});
        return all;
    }

   private:
    std::map<std::pair<std::vector<uint32_t>, uint32_t>, std::vector<uint32_t>> members_;  // -> items
};

// Groups of indices of `texels`, those that join others joined. `listOf(receiver)`: its contributions, ascending; other
// numbers that ascend alike give the same groups. `overlap_max`: of the profile.
std::vector<Group> groupTexels(std::span<const ShownTexel> texels,
                               const std::function<std::vector<uint32_t>(uint32_t receiver)>& listOf,
                               uint32_t overlap_max);

}  // namespace dimmer::cook
