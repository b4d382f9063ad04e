// Delaunay tetrahedra over the probes of the global grid (TetGen, Si 2015).
#pragma once

#include <dimmer/error.h>
#include <pack/grid_data.h>

#include <glm/glm.hpp>

#include <span>

namespace dimmer::cook {

inline glm::vec3 vec(const ProbePosition& p) {
    return {p.x_m, p.y_m, p.z_m};
}

struct Box {
    glm::vec3 min_m{0}, max_m{0};
};

// The corners of a box around `level` and all points are probes too, the last 8 of the grid's positions: every place in
// it lies in some tetrahedron, whatever the points are (none, one, on a line or in a plane). A point within a
// millimetre of an earlier one keeps its position and joins no tetrahedron. Levels are 0 and visibility is empty.
// Refused: coordinates that are not finite or beyond 1000 km. The same points give the same grid.
Expected<GlobalGrid> tetrahedralise(std::span<const glm::vec3> points, const Box& level);

}  // namespace dimmer::cook
