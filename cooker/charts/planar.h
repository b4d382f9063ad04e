// Groups faces into planar charts.
#pragma once

#include <charts/box_tree.h>
#include <charts/unwrap.h>

#include <array>
#include <functional>
#include <span>
#include <vector>

namespace dimmer::cook {

// What parts two places of a plane is looked for at these heights above it: a wall stands at both, furniture against a
// wall, a skirting board or a window's frame do not reach the second. Doors' leaves hang a little above the floor.
// (Walls that are cut at stand lower where there is less room: standing_walls.cpp.)
inline constexpr float wall_probe_low_m = 0.01f, leaf_probe_low_m = 0.05f, wall_probe_high_m = 0.8f;

struct PlanarFace {
    std::array<glm::vec3, 3> corners_m;  // counter-clockwise seen from the lit side
    glm::vec3 normal;
    float texels_per_metre;
    uint32_t group;                             // faces of different groups never share a chart
    uint32_t region = 0;                        // nor do faces of different regions
    std::array<glm::vec3, 3> corner_normals{};  // that it is shaded with; where two faces agree, one surface curves
};

struct ProjectedChart {
    glm::vec3 u_axis, v_axis;  // unit; u x v = normal
    glm::vec2 min_m, size_m;   // of the chart's rectangle, along the axes
    float texels_per_metre;
    std::vector<uint32_t> faces;  // indices into the input, ascending
    bool curved = false;          // seen along u x v, which is the mean normal then (curved.h)
};

// Doors move, so their leaves share no chart with the level, nor closed ones with open ones.
inline uint32_t chartGroup(const SceneMesh& mesh) {
    return mesh.door ? 2 * *mesh.door + mesh.is_open_leaf + 1 : 0;
}

struct Axes;

// What stands on a level's planes; asked on all threads.
struct Standing {
    // Something opaque is on the straight line between two points. Empty: nothing is.
    std::function<bool(glm::vec3, glm::vec3)> blocked;
    // Triangles, among them all opaque ones that touch a box: where there are none, `blocked` is not asked. Empty:
    // there may be some anywhere.
    std::function<std::vector<std::array<glm::vec3, 3>>(const BoxTree::Box&)> triangles;
    // A point lies within what is solid, of which a wall that parts charts in its middle leaves half to each. Empty:
    // none does.
    std::function<bool(glm::vec3, const Axes&)> inside = {};
};

// As planarCharts() tells planes apart.
bool inOnePlane(const PlanarFace& a, const PlanarFace& b);

// Deterministic. Cost: near O(n log n) where the boxes of faces in one plane overlap few others; where something stands
// on them, times those within two texels of it.
std::vector<ProjectedChart> planarCharts(std::span<const PlanarFace> faces, uint32_t side_max_texels,
                                         const Standing& standing = {});

}  // namespace dimmer::cook
