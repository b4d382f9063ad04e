// What the probes of a tetrahedron see of it.
#pragma once

#include <pack/grid_data.h>
#include <probes/tetrahedra.h>
#include <trace/triangle_cells.h>

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <span>

namespace dimmer::cook {

constexpr uint32_t visibility_points = 32;

// Rays go from `points` points all over the tetrahedron, and from as many `places` in it (barycentric) at most, to each
// probe; of the planes of the surfaces that stop them, the one that parts seen from hidden best is stored. Points in
// geometry or outside of the level do not count. A hidden point taken for seen counts more than the other way round, as
// light through a wall shows more than one probe less, but a point that one probe alone sees is not left to none, and
// one that none sees belongs to those on its side of what hides it. Doors' leaves stop rays where they stand closed.
// `air`: where somebody may ask for light (probes/air_box.h); points besides count little. `free`: probes that do not
// stand in the open see nothing. `cells`: of the same level, for speed; null: rays alone are asked.
TetrahedronVisibility findVisibility(const RayScene& rays, const Box& air, const std::array<glm::vec3, 4>& corners,
                                     const std::array<bool, 4>& free, std::span<const std::array<float, 4>> places = {},
                                     const TriangleCells* cells = nullptr, uint32_t points = visibility_points);

}  // namespace dimmer::cook
