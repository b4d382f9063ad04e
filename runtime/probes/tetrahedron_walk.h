// From a point to the probes of the global grid that light it. Every number is a 32-bit float and every operation +, -
// or *, in the order written, so that a shader can give the same bits.
#pragma once

#include <pack/grid_data.h>

#include <array>
#include <cstdint>

namespace dimmer {

// A walk from a hint takes at most this many steps before it starts anew at the start grid, and at most so many there:
// models move a little at a time, and a start cell holds few tetrahedra. No table can make a walk longer.
inline constexpr uint32_t hinted_steps_max = 32, walk_steps_max = 1024;
// A barycentric coordinate above -this counts as inside. Rounding errs by some 1e-6 in tetrahedra that are not slivers;
// weights jump by at most this share where two tetrahedra disagree, but for what their tables say is seen: those of
// neighbours need not agree at a face, and near doors light jumps there by up to a tenth.
inline constexpr float inside_tolerance = 1e-4f;
// Six times the volume of a tetrahedron, in m3, that has none; what stands in for 1 / it.
inline constexpr float flat_volume = 1e-30f, flat_inverse = 1e8f;
// So near to a face, neighbours are compared: of those that take a point in, the one that it is deepest in gives the
// light. Round an edge there are many, and a few steps need not find it: there, a walk ignores its hint.
inline constexpr uint32_t settle_steps_max = 4;
// Visible light fades in over 1 / this of the field's range, on the visible side: a plane through the open air shows
// no edge, and nothing shines past it.
inline constexpr float visibility_slope = 8;
// With less than this in sight a point counts as seen by none.
inline constexpr float visible_weight_min = 1e-5f;
// There, probes count that are hidden by less than this more than the least hidden one is, in visibility: on a floor
// those above it are hidden by rounding, those below by the floor.
inline constexpr float least_hidden_span = 0.25f;

struct GridPlace {
    uint32_t tetrahedron = 0;
    std::array<float, 4> barycentric = {};  // of its probes: 0..1, sum 1
};

// `hint`: a tetrahedron that is likely near, or no_tetrahedron. A point outside the grid's box gets the place of the
// box's nearest point, one that is not a number some place. The grid is not empty. Thread-safe. `steps_max`: of the
// walk from the start grid; only who makes that grid has a reason for more.
GridPlace locate(const GlobalGrid& grid, std::array<float, 3> point_m, uint32_t hint = no_tetrahedron,
                 uint32_t steps_max = walk_steps_max);

// The shares of the four probes in the light at a place: barycentric among those that see it, or where none does
// among the least hidden. Each 0..1, sum 1.
std::array<float, 4> probeWeights(const GlobalGrid& grid, const GridPlace& place);

}  // namespace dimmer
