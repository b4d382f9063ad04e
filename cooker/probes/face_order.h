// The order of a grid's probes and tetrahedra.
#pragma once

#include <pack/grid_data.h>

#include <cstdint>
#include <vector>

namespace dimmer::cook {

// Each tetrahedron shares a face with an earlier one, mostly the one before it, and has its other probes at the same
// corners, so that a pack tells it by one probe (StoredTetrahedron); probes are numbered as they come up, but for the
// box's corners, which stay the last. What is next to each other then looks alike, to zstd and to caches. The grid is
// the same otherwise. Returns the old number of each probe. Linear; deterministic.
std::vector<uint32_t> orderByFaces(GlobalGrid& grid);

}  // namespace dimmer::cook
