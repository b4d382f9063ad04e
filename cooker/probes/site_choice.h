// Places where probes may stand, block by block.
#pragma once

#include <bake/bake.h>
#include <probes/air_box.h>

#include <glm/glm.hpp>
#include <span>
#include <vector>

namespace dimmer::cook {

struct SiteChoice {
    Box air;  // probes/air_box.h: no place is outside of it
    // All over the level; at its surfaces; around each lamp; the free ones of the corners of the grid's box. A block
    // depends on geometry, its own lamp, how many there are and the settings alone.
    std::vector<SiteBlock> blocks;
    std::vector<bool> corner_free;  // which of the box's 8 corners the last block has
    size_t probes_max = 0;          // as the settings and the level's size have it
    double free_volume_m3 = 0;

    // Of all blocks, in siteOrder().
    std::vector<glm::vec3> places() const;
};

// In which order the rows of all blocks are looked at: as many of the first ones as one likes are spread as all are.
// The last block's, corners of the box, come last.
struct SiteRow {
    size_t block, row;
};
std::vector<SiteRow> siteOrder(std::span<const SiteBlock> blocks);

// `store`: may be null. ErrorCode::BadInput: nothing is free.
Expected<SiteChoice> chooseSites(const RayScene& rays, const GridSettings& settings, GroupStore* store);

}  // namespace dimmer::cook
