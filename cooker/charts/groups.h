// Sets that grow together, but for what must stay apart.
#pragma once

#include <cstddef>
#include <cstdint>
#include <numeric>
#include <set>
#include <utility>
#include <vector>

namespace dimmer::cook {

// A union-find over the numbers below a count. Not thread-safe.
class Groups {
   public:
    explicit Groups(size_t count) : parent_(count), apart_from_(count) {
        std::iota(parent_.begin(), parent_.end(), 0u);
    }

    // The number that stands for the group of `i`.
    uint32_t find(uint32_t i) {
        while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
        return i;
    }

    void keepApart(uint32_t a, uint32_t b) {
        a = find(a), b = find(b);
        apart_from_[a].insert(b);
        apart_from_[b].insert(a);
    }

    // Of two groups, by what stands for them.
    bool areApart(uint32_t a, uint32_t b) const { return apart_from_[a].contains(b); }

    // Two groups, by what stands for them, become one; what stands for it now, and what no longer does.
    std::pair<uint32_t, uint32_t> join(uint32_t a, uint32_t b) {
        // The lesser list goes into the longer one, so that few are moved often.
        if (apart_from_[a].size() < apart_from_[b].size()) std::swap(a, b);
        parent_[b] = a;
        for (const uint32_t other : apart_from_[b]) {
            apart_from_[other].erase(b);
            apart_from_[other].insert(a);
            apart_from_[a].insert(other);
        }
        apart_from_[b].clear();
        return {a, b};
    }

   private:
    std::vector<uint32_t> parent_;
    std::vector<std::set<uint32_t>> apart_from_;  // of what stands for a group: others that do
};

}  // namespace dimmer::cook
