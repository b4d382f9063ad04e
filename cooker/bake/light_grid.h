// Which punctual lights are worth a shadow ray from where.
#pragma once

#include <bake/cell_levels.h>
#include <bake/progress.h>
#include <trace/ray_scene.h>

#include <cstdint>
#include <glm/glm.hpp>
#include <memory>
#include <span>
#include <vector>

namespace dimmer::cook {

// Rays that each light sends out to find the cells that it reaches, evenly over the directions that it shines into: for
// a point light 0.055 rad apart. What shines through openings between them is looked for from the other end, from so
// many points all over the level's surfaces, in large levels one for a cell's: what both miss is lost, less than a
// 500,000th of lq_e2m3's light (docs/decisions.md).
inline constexpr uint32_t light_probe_rays = 4096, surface_points = 8192;

// Cells over the level, of a size that does not depend on the level's, list the lights that reach them, found by rays
// from the lights (bake/reached_cells.h). Asked for everywhere: lights baked in full (BakeMode::Full), since what they
// light is seen itself, directional ones, and those far outside of the level, whose rays would miss it. What is said of
// a light depends on no other light.
class LightGrid {
   public:
    // With smaller cells light is lost through openings between a lamp's rays.
    static constexpr float cell_m = 2;

    // Disabled, every light reaches everything. `groups`: per light group, whether its lights are asked for; empty:
    // all. `progress`: a stage of it, where lights are looked for.
    explicit LightGrid(const RayScene& rays, bool enabled = true, std::span<const uint8_t> groups = {},
                       Progress* progress = nullptr);
    // The same cells, of which only the lights of these groups are told. `groups`: some of those asked for, or empty.
    LightGrid ofGroups(std::span<const uint8_t> groups) const;

    // visit(light) for those whose light may be found at `point`; always in the same order.
    void forEach(glm::vec3 point, auto&& visit) const {
        for (const uint32_t light : everywhere_) visit(light);
        for (const uint32_t light : listed(point)) visit(light);
    }
    // The lights whose rays came by the cell of a point, ascending; of one outside of the level, where nothing but its
    // outer walls is in the way, all.
    std::vector<uint32_t> listed(glm::vec3 point) const;
    // A number of the light's own, which other lights do not change.
    uint32_t identity(uint32_t light) const { return identity_[light]; }
    // The lengths of all cells' lists.
    size_t entryCount() const { return cells_->lights.size(); }

   private:
    // What lights reach.
    struct Cells {
        CellLevels levels;
        std::vector<uint32_t> all;      // lights that are listed somewhere
        std::vector<uint64_t> numbers;  // of those that any light reaches, ascending
        std::vector<uint64_t> first;    // per such cell and one more, into `lights`
        std::vector<uint32_t> lights;
    };
    static void fill(Cells& cells, std::span<const uint32_t> lights, std::span<const std::vector<uint64_t>> reached);
    bool tells(uint32_t light) const { return told_.empty() || told_[group_[light]]; }

    std::vector<uint32_t> identity_, group_;  // per light
    std::vector<uint32_t> everywhere_;
    std::vector<uint8_t> told_;  // per light group; empty: all
    std::shared_ptr<const Cells> cells_;
};

}  // namespace dimmer::cook
