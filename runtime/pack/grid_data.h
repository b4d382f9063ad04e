// Where a pack's light probes are: the tetrahedra of the global grid and the boxes of local ones. Arrays of 4-byte
// fields, for std430 buffers as they are.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace dimmer {

inline constexpr uint32_t no_tetrahedron = UINT32_MAX;

struct ProbePosition {
    float x_m = 0, y_m = 0, z_m = 0;  // world space
    bool operator==(const ProbePosition&) const = default;
};
static_assert(sizeof(ProbePosition) == 12);

struct Tetrahedron {
    std::array<uint32_t, 4> probes = {};
    // neighbours[i] lies across the face opposite probes[i]; no_tetrahedron: that face is the grid's hull.
    std::array<uint32_t, 4> neighbours = {no_tetrahedron, no_tetrahedron, no_tetrahedron, no_tetrahedron};
    bool operator==(const Tetrahedron&) const = default;
};
static_assert(sizeof(Tetrahedron) == 32);

// What each of a tetrahedron's probes sees of it: a signed number at the four corners, linear between them, so that the
// border between lit and hidden is a plane, as walls are. seen[v][i]: of probe v, at the corner of probe i, in 1/127.
// Visibility = clamp(visibility_slope * value, 0, 1).
struct TetrahedronVisibility {
    std::array<std::array<int8_t, 4>, 4> seen = {};
    bool operator==(const TetrahedronVisibility&) const = default;
};
static_assert(sizeof(TetrahedronVisibility) == 16);

// The box that the global grid fills, cut into cells; cell (i, j, k) is number i + counts[0] * (j + counts[1] * k). The
// box is the grid's hull, so the hull's nearest point to a place outside is that place clamped to the box.
struct StartGrid {
    std::array<float, 3> min_m = {}, max_m = {};
    std::array<uint32_t, 3> counts = {};
};
static_assert(sizeof(StartGrid) == 36);

inline constexpr size_t grid_box_corners = 8;

// Probes over the level, joined by tetrahedra. Its probes come first in ProbeData's numbering; the last
// grid_box_corners of them are the corners of the box that it fills.
struct GlobalGrid {
    std::vector<ProbePosition> positions;  // by the probe's number
    std::vector<uint8_t> levels;           // per probe: of refinement, 0 the coarsest; for tools
    std::vector<Tetrahedron> tetrahedra;
    std::vector<TetrahedronVisibility> visibility;  // per tetrahedron; empty: every probe sees everything
    StartGrid start;
    std::vector<uint32_t> starts;  // per cell: the tetrahedron that its centre lies in
    bool empty() const { return tetrahedra.empty(); }
};

// Probes in an oriented box around a model: probe (i, j, k), number first_probe + i + counts[0] * (j + counts[1] * k),
// stands at origin + i * step[0] + j * step[1] + k * step[2].
struct LocalGrid {
    std::string node;  // of the level
    uint32_t first_probe = 0;
    std::array<uint32_t, 3> counts = {};
    std::array<float, 3> origin_m = {};  // world space
    std::array<std::array<float, 3>, 3> step_m = {};
    uint64_t probeCount() const { return uint64_t{counts[0]} * counts[1] * counts[2]; }
};
inline constexpr uint32_t local_grid_side_max = 64;  // probes along an axis

}  // namespace dimmer
