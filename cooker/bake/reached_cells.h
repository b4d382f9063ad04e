// The cells that one light's rays come by.
#pragma once

#include <bake/cell_levels.h>

#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

namespace dimmer::cook {

// A light is listed in so many cells at most: where it reaches more, in larger ones.
inline constexpr size_t cells_of_light_max = 1 << 14;

// Small cells near the light; further off, where its rays lie apart anyway, cells of twice the size for each doubling
// of the distance. What that takes grows with the level's size by its logarithm.
class ReachedCells {
   public:
    // `far_m`: no ray goes further from `from`. `spread`: the way to the neighbouring rays, per metre.
    ReachedCells(const CellLevels& levels, glm::vec3 from, float far_m, float spread);

    // The size of cells that rays mark at a distance.
    uint32_t levelAt(float distance_m) const;
    // Marks the cells that a ray passes and, around its end, those that the surface there lies in: generously, since
    // surfaces are what receives.
    void mark(glm::vec3 from, glm::vec3 direction, float distance_m);
    // Whether the cell of a point is marked, whose distance is about that of the level.
    bool holds(glm::vec3 point, uint32_t level) const;
    // The cells' numbers; of eight that make up a larger one, that one's. To be called once.
    std::vector<uint64_t> numbers();

   private:
    // Cells of one level that the light may reach.
    struct Window {
        glm::uvec3 low{0}, high{0};
        std::vector<uint8_t> marks;
        bool contains(glm::uvec3 c) const { return c == glm::clamp(c, low, high); }
        size_t index(glm::uvec3 c) const {
            const glm::uvec3 at = c - low, size = high - low + 1u;
            return (size_t{at.z} * size.y + at.y) * size.x + at.x;
        }
    };
    void markAround(glm::vec3 point, float reach_m, uint32_t level);
    void join(uint32_t level, bool full_only);
    size_t count() const;

    const CellLevels& levels_;
    float spread_;
    std::vector<Window> windows_;  // per level
};

}  // namespace dimmer::cook
