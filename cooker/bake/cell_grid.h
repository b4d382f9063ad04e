// Equal cells over the level's box, for what differs from place to place and is looked up by a point.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

namespace dimmer::cook {

class CellGrid {
   public:
    CellGrid() = default;
    CellGrid(glm::vec3 min_m, glm::vec3 max_m, float cell_min_m) : origin_(min_m) {
        const glm::vec3 extent = max_m - min_m;
        cell_m_ = std::max(cell_min_m, std::max(extent.x, std::max(extent.y, extent.z)) / cells_per_axis_max);
        size_ = glm::uvec3(glm::floor(extent / cell_m_)) + 1u;
    }

    size_t count() const { return size_t{size_.x} * size_.y * size_.z; }
    float cellSize() const { return cell_m_; }
    // Of the cell that holds a point; outside of the box, of the nearest one.
    glm::uvec3 coordinates(glm::vec3 point) const {
        return glm::clamp((point - origin_) / cell_m_, glm::vec3(0), glm::vec3(size_) - 0.5f);
    }
    uint32_t index(glm::uvec3 c) const { return (c.z * size_.y + c.y) * size_.x + c.x; }
    uint32_t at(glm::vec3 point) const { return index(coordinates(point)); }
    glm::vec3 centre(size_t cell) const {
        const glm::uvec3 c(cell % size_.x, cell / size_.x % size_.y, cell / size_.x / size_.y);
        return origin_ + (glm::vec3(c) + 0.5f) * cell_m_;
    }

    // Marks the cells that a ray passes and, around its end, those that the surface there lies in: generously, since
    // surfaces are what receives. `spread`: the way to the neighbouring rays, per metre from where they start.
    void mark(glm::vec3 from, glm::vec3 direction, float distance_m, float spread, std::vector<uint8_t>& marks) const {
        for (float m = 0; m < distance_m; m += step_share * cell_m_)
            markAround(from + direction * m, spread * m, marks);
        markAround(from + direction * distance_m, std::max(0.5f * cell_m_, spread * distance_m), marks);
    }

   private:
    void markAround(glm::vec3 point, float reach_m, std::vector<uint8_t>& marks) const {
        const glm::uvec3 low = coordinates(point - reach_m), high = coordinates(point + reach_m);
        for (uint32_t z = low.z; z <= high.z; ++z)
            for (uint32_t y = low.y; y <= high.y; ++y)
                for (uint32_t x = low.x; x <= high.x; ++x) marks[index({x, y, z})] = 1;
    }

    // Rays are followed in steps of this share of a cell: short enough not to cut more than corners.
    static constexpr float step_share = 0.5f;
    static constexpr float cells_per_axis_max = 48;

    glm::vec3 origin_{0};
    float cell_m_ = 1;
    glm::uvec3 size_{1};
};

}  // namespace dimmer::cook
