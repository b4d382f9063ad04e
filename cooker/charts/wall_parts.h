// Parts a chart where walls stand on it.
#pragma once

#include <charts/polygon.h>
#include <charts/standing_walls.h>

#include <cstdint>
#include <vector>

namespace dimmer::cook {

// A convex piece of a face in its chart's plane.
struct Piece {
    uint32_t face;
    Polygon corners;
};

// What walls leave beside one another of a chart's pieces: one list for each part; one part where no wall is long
// enough. A wall counts when it is a few texels long, all its stretches between doorways together, and a row of
// stretches that goes round when all of it is. Cuts go right through; what slanted ones part where no wall
// stands on them is put together again. Deterministic; thread-safe.
std::vector<std::vector<Piece>> partsBeside(const WallLines& walls, std::vector<Piece> pieces, float texels_per_metre);

}  // namespace dimmer::cook
