// Ranges of one buffer, handed out and taken back; neither allocates.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

namespace dimmer {

class RecordPool {
   public:
    RecordPool() = default;
    // `ranges_max`: how many are handed out at a time, at most. Between them lie one more that are free, and while one
    // comes back it is another.
    RecordPool(uint64_t size, size_t ranges_max) {
        free_.reserve(ranges_max + 2);
        if (size > 0) free_.push_back({0, size});
    }

    // The first free range that is long enough; empty when there is none.
    std::optional<uint64_t> allocate(uint64_t count) {
        for (size_t i = 0; i < free_.size(); ++i) {
            if (free_[i].count < count) continue;
            const uint64_t first = free_[i].first;
            free_[i].first += count;
            free_[i].count -= count;
            if (free_[i].count == 0) free_.erase(free_.begin() + static_cast<std::ptrdiff_t>(i));
            return first;
        }
        return std::nullopt;
    }

    // What allocate() gave, with the same count; joins its neighbours.
    void release(uint64_t first, uint64_t count) {
        if (count == 0) return;
        size_t i = 0;
        while (i < free_.size() && free_[i].first < first) ++i;
        free_.insert(free_.begin() + static_cast<std::ptrdiff_t>(i), {first, count});
        join(i);
        if (i > 0) join(i - 1);
    }

    uint64_t largestFree() const {
        uint64_t largest = 0;
        for (const Range& range : free_)
            if (range.count > largest) largest = range.count;
        return largest;
    }

   private:
    struct Range {
        uint64_t first, count;
    };
    void join(size_t i) {
        if (i + 1 >= free_.size() || free_[i].first + free_[i].count != free_[i + 1].first) return;
        free_[i].count += free_[i + 1].count;
        free_.erase(free_.begin() + static_cast<std::ptrdiff_t>(i) + 1);
    }
    std::vector<Range> free_;  // ascending, never adjacent
};

}  // namespace dimmer
