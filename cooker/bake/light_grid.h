// Which punctual lights are worth a shadow ray from where.
#pragma once

#include <bake/cell_grid.h>
#include <bake/progress.h>
#include <trace/ray_scene.h>

#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

namespace dimmer::cook {

// Rays that each light sends out to find the cells that it reaches, evenly over the directions that it shines into: for
// a point light 0.055 rad apart. What shines through openings between them is looked for from the other end, from so
// many points all over the level's surfaces, in large levels one for a cell's: what both miss is lost, less than a
// 500,000th of lq_e2m3's light (docs/decisions.md).
inline constexpr uint32_t light_probe_rays = 4096, surface_points = 8192;

// A grid over the level; its cells list the lights that reach them, found by rays from the lights. Asked for
// everywhere: lights baked in full (BakeMode::Full), since what they light is seen itself, directional ones, and those
// far outside of the level, whose rays would miss it. What is said of a light depends on no other light.
class LightGrid {
   public:
    // With smaller cells light is lost through openings between a lamp's rays.
    static constexpr float cell_min_m = 2;

    // Disabled, every light reaches everything. `groups`: per light group, whether its lights are asked for; empty:
    // all. `progress`: a stage of it, where lights are looked for.
    explicit LightGrid(const RayScene& rays, bool enabled = true, std::span<const uint8_t> groups = {},
                       Progress* progress = nullptr);

    // visit(light) for those whose light may be found at `point`; always in the same order.
    void forEach(glm::vec3 point, auto&& visit) const {
        for (const uint32_t light : everywhere_) visit(light);
        for (const uint32_t light : listed(point)) visit(light);
    }
    // The lights whose rays came by the cell of a point, ascending.
    std::span<const uint32_t> listed(glm::vec3 point) const;
    // A number of the light's own, which other lights do not change.
    uint32_t identity(uint32_t light) const { return identity_[light]; }

   private:
    std::vector<uint32_t> reachedCells(const RayScene& rays, std::span<const glm::vec3> surface_points_m,
                                       uint32_t light) const;

    std::vector<uint32_t> identity_;  // per light
    std::vector<uint32_t> everywhere_;
    CellGrid grid_;
    std::vector<uint64_t> first_;  // per cell and one more, into lights_; empty: no light is listed anywhere
    std::vector<uint32_t> lights_;
};

}  // namespace dimmer::cook
