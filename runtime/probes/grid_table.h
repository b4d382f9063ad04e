// The global grid as shaders read it: DIMMER_GRID_WORDS in grid.glsl.
#pragma once

#include <pack/grid_data.h>

#include <array>
#include <cstdint>
#include <vector>

namespace dimmer {

using GridTableElement = std::array<uint32_t, 4>;

// Where what begins, then positions, tetrahedra with their visibility, and starts. The grid is not empty.
std::vector<GridTableElement> gridTable(const GlobalGrid& grid);
// 0 for an empty grid.
uint64_t gridTableBytes(const GlobalGrid& grid);

}  // namespace dimmer
