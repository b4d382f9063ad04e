// Cells of one size over the level's box, cells of twice that size, and so on, up to one that holds all of it.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

namespace dimmer::cook {

class CellLevels {
   public:
    CellLevels() = default;
    CellLevels(glm::vec3 min_m, glm::vec3 max_m, float cell_m) : origin_(min_m), end_(max_m) {
        const glm::vec3 extent = max_m - min_m;
        cell_m_ = std::max(cell_m, std::max(extent.x, std::max(extent.y, extent.z)) / per_axis_max);
        size_ = glm::uvec3(glm::floor(extent / cell_m_)) + 1u;
        first_ = {0};
        for (uint32_t level = 0; size(level) != glm::uvec3(1); ++level)
            first_.push_back(first_.back() + uint64_t{size(level).x} * size(level).y * size(level).z);
    }

    uint32_t count() const { return static_cast<uint32_t>(first_.size()); }
    float cellSize(uint32_t level) const { return std::ldexp(cell_m_, static_cast<int>(level)); }
    glm::uvec3 size(uint32_t level) const { return ((size_ - 1u) >> level) + 1u; }
    // Of the cell that holds a point; outside of the box, of the nearest one.
    glm::uvec3 coordinates(glm::vec3 point, uint32_t level) const {
        const glm::uvec3 finest = glm::clamp((point - origin_) / cell_m_, glm::vec3(0), glm::vec3(size_) - 0.5f);
        return glm::min(finest, size_ - 1u) >> level;
    }
    // Whether what lies within `reach_m` of a point is all more than a cell's width outside of the box.
    bool isOutside(glm::vec3 point, float reach_m = 0) const {
        const float way_m = reach_m + cell_m_;
        return glm::any(glm::lessThan(point + way_m, origin_)) || glm::any(glm::greaterThan(point - way_m, end_));
    }
    // No other cell's, of whatever level.
    uint64_t number(glm::uvec3 c, uint32_t level) const {
        const glm::uvec3 s = size(level);
        return first_[level] + (uint64_t{c.z} * s.y + c.y) * s.x + c.x;
    }

   private:
    static constexpr float per_axis_max = 1 << 20;  // as numbers are 64 bits

    glm::vec3 origin_{0}, end_{0};
    float cell_m_ = 1;
    glm::uvec3 size_{1};                 // of the smallest cells
    std::vector<uint64_t> first_ = {0};  // number of each level
};

}  // namespace dimmer::cook
