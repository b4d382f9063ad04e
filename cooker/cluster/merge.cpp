#include <cluster/merge.h>

#include <pack/pack_data.h>
#include <update/device_places.h>

#include <algorithm>
#include <map>
#include <optional>
#include <set>
#include <unordered_map>

namespace dimmer::cook {
namespace {

size_t unionSize(std::span<const uint32_t> a, std::span<const uint32_t> b) {
    size_t i = 0, j = 0, common = 0;
    while (i < a.size() && j < b.size()) {
        const uint32_t lower = std::min(a[i], b[j]);
        common += a[i] == b[j];
        const bool in_a = a[i] == lower, in_b = b[j] == lower;
        i += in_a, j += in_b;
    }
    return a.size() + b.size() - common;
}

std::vector<uint32_t> unionOf(std::span<const uint32_t> a, std::span<const uint32_t> b) {
    std::vector<uint32_t> all;
    std::ranges::set_union(a, b, std::back_inserter(all));
    return all;
}

class Merger {
   public:
    Merger(std::vector<Group> groups, std::span<const uint64_t> tile_of_item, const GroupBytes& bytes,
           uint32_t contributions_max)
        : groups_(std::move(groups)),
          tile_of_item_(tile_of_item),
          bytes_(bytes),
          contributions_max_(contributions_max == 0 ? UINT32_MAX : contributions_max) {
        for (uint32_t g = 0; g < groups_.size(); ++g) {
            enter(g, groups_[g].items);
            waiting_.insert(waitingOf(g));
        }
    }

    std::vector<Group> run() {
        while (!waiting_.empty()) {
            const uint32_t g = waiting_.extract(waiting_.begin()).value().group;
            if (const auto other = best(g)) merge(g, *other);
        }
        return unique();
    }

   private:
    struct Waiting {
        size_t receivers;
        uint32_t first_item, group;
        auto operator<=>(const Waiting&) const = default;
    };

    Waiting waitingOf(uint32_t g) const { return {groups_[g].items.size(), groups_[g].items.front(), g}; }

    // Makes `g` known in the tiles of some of its items.
    void enter(uint32_t g, std::span<const uint32_t> items) {
        for (const uint32_t item : items)
            if (auto& near = in_tile_[tile_of_item_[item]]; near.empty() || near.back() != g) near.push_back(g);
    }

    // The group with which joining saves most.
    std::optional<uint32_t> best(uint32_t g) {
        const Group& group = groups_[g];
        const size_t receivers = group.items.size(), terms = group.contributions.size();
        // One more contribution at each of its receivers, or each of the other's, which are as many or more.
        if (receivers * bytes_.record > terms * bytes_.term + bytes_.batch) return std::nullopt;
        std::optional<uint32_t> found;
        int64_t most = 0;
        uint64_t last = ~uint64_t{0};
        for (const uint32_t item : group.items) {
            if (tile_of_item_[item] == last) continue;
            last = tile_of_item_[item];
            auto& near = in_tile_[last];
            std::erase_if(near, [&](uint32_t other) { return groups_[other].items.empty(); });
            for (const uint32_t other : near) {
                if (other == g || groups_[other].page != group.page) continue;
                const int64_t saved = savedBy(group, groups_[other]);
                if (saved > most || (saved == most && found && other < *found)) most = saved, found = other;
            }
        }
        return found;
    }

    int64_t savedBy(const Group& a, const Group& b) const {
        const size_t receivers = a.items.size() + b.items.size();
        const size_t contributions = unionSize(a.contributions, b.contributions);
        if (contributions > contributions_max_) return 0;
        return bytes_.of(a.items.size(), a.contributions.size()) + bytes_.of(b.items.size(), b.contributions.size()) -
               bytes_.of(receivers, contributions);
    }

    // The smaller one's items go to the larger one, whose own are not touched: it may have millions.
    void merge(uint32_t g, uint32_t other) {
        waiting_.erase(waitingOf(other));
        const auto [from, to] =
            groups_[g].items.size() > groups_[other].items.size() ? std::pair(other, g) : std::pair(g, other);
        Group& small = groups_[from];
        Group& large = groups_[to];
        large.contributions = unionOf(large.contributions, small.contributions);
        enter(to, small.items);
        large.items.insert(large.items.end(), small.items.begin(), small.items.end());
        small = {};
        waiting_.insert(waitingOf(to));
    }

    // Joined lists may be those of groups in other tiles.
    std::vector<Group> unique() {
        std::map<std::pair<std::vector<uint32_t>, uint32_t>, std::vector<uint32_t>> items_of;
        for (Group& group : groups_) {
            if (group.items.empty()) continue;
            auto& items = items_of[{std::move(group.contributions), group.page}];
            items.insert(items.end(), group.items.begin(), group.items.end());
        }
        std::vector<Group> found;
        for (auto& [list, items] : items_of) {
            std::ranges::sort(items);
            found.push_back({list.first, list.second, std::move(items)});
        }
        return found;
    }

    std::vector<Group> groups_;  // those that went to others are empty; items in any order
    std::span<const uint64_t> tile_of_item_;
    GroupBytes bytes_;
    size_t contributions_max_;
    std::unordered_map<uint64_t, std::vector<uint32_t>> in_tile_;
    std::set<Waiting> waiting_;  // the smallest first
};

}  // namespace

int64_t GroupBytes::of(size_t receivers, size_t contributions) const {
    const size_t records = (receivers + step - 1) / step * step * (contributions + 1);
    const size_t batches = (receivers + batch_receivers_max - 1) / batch_receivers_max;
    return static_cast<int64_t>(records * record + contributions * term + batches * batch);
}

const GroupBytes texel_group_bytes{.record = sizeof(TexelRecord),
                                   .step = paddedReceivers(1),
                                   .term = sizeof(WorkTerm),
                                   .batch = sizeof(TexelBatch) + sizeof(TexelItem)};
const GroupBytes probe_group_bytes{
    .record = sizeof(ProbeRecord), .step = 1, .term = sizeof(WorkTerm), .batch = sizeof(BatchPlace) + sizeof(WorkItem)};

std::vector<Group> mergeGroups(std::vector<Group> groups, std::span<const uint64_t> tile_of_item,
                               const GroupBytes& bytes, uint32_t contributions_max) {
    return Merger(std::move(groups), tile_of_item, bytes, contributions_max).run();
}

}  // namespace dimmer::cook
