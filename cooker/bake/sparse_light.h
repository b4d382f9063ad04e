// Light per receiver and light group, stored only where there is some.
#pragma once

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

namespace dimmer::cook {

// Light group 0 is all always-on light; group 1 + s is light set s.
inline constexpr uint32_t always_group = 0;

struct GroupLight {
    uint32_t group = 0;
    glm::vec3 value{0};  // irradiance in lux, or radiance in cd/m2, by context
};

// Compressed rows: row i holds the groups that reach receiver i, ascending.
template <class Entry>
class Sparse {
   public:
    std::span<const Entry> row(size_t i) const { return {entries_.data() + first_[i], first_[i + 1] - first_[i]}; }
    size_t rows() const { return first_.size() - 1; }
    size_t entryCount() const { return entries_.size(); }
    size_t bytes() const { return first_.size() * sizeof(uint64_t) + entries_.size() * sizeof(Entry); }

    // `fill(begin, end, emit)` calls emit(entries) once for every row of its range, in order. Ranges run in parallel;
    // the result does not depend on how.
    template <class Fill>
    static Sparse build(size_t rows, Fill&& fill) {
        constexpr size_t block = 256;
        const size_t blocks = (rows + block - 1) / block;
        std::vector<std::vector<Entry>> parts(blocks);
        Sparse out;
        out.first_.assign(rows + 1, 0);
        tbb::parallel_for(size_t{0}, blocks, [&](size_t b) {
            const size_t begin = b * block, end = std::min(rows, begin + block);
            size_t row = begin;
            fill(begin, end, [&](std::span<const Entry> entries) {
                parts[b].insert(parts[b].end(), entries.begin(), entries.end());
                out.first_[++row] = entries.size();
            });
            parts[b].shrink_to_fit();
        });
        for (size_t i = 0; i < rows; ++i) out.first_[i + 1] += out.first_[i];
        out.entries_.reserve(out.first_[rows]);
        for (auto& part : parts) {
            out.entries_.insert(out.entries_.end(), part.begin(), part.end());
            part = {};
        }
        return out;
    }

   private:
    std::vector<uint64_t> first_ = {0};
    std::vector<Entry> entries_;
};

using SparseLight = Sparse<GroupLight>;

// One worker's dense scratch over groups, emptied in time proportional to what was touched.
template <class Value>
class GroupAccumulator {
   public:
    explicit GroupAccumulator(uint32_t groups) : values_(groups), used_(groups) {}

    Value& operator[](uint32_t group) {
        if (!used_[group]) {
            used_[group] = 1;
            touched_.push_back(group);
        }
        return values_[group];
    }
    // Groups touched since the last clear, ascending.
    std::span<const uint32_t> touched() {
        std::ranges::sort(touched_);
        return touched_;
    }
    void clear() {
        for (uint32_t g : touched_) {
            values_[g] = Value{};
            used_[g] = 0;
        }
        touched_.clear();
    }

   private:
    std::vector<Value> values_;
    std::vector<uint8_t> used_;
    std::vector<uint32_t> touched_;
};

}  // namespace dimmer::cook
