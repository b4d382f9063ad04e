// Charts over surfaces that curve gently: terrain, vaults, columns.
#pragma once

#include <charts/planar.h>

#include <span>
#include <vector>

namespace dimmer::cook {

// Joins charts across smooth edges where they take fewer texels of the page as one, or little more, seen along their
// mean normal: those over facets of a curve would be mostly padding. No wall, and nothing that hides another part, is
// within the filter's reach in one. Deterministic. Cost: near O(n log n), times the faces within two texels of each.
std::vector<ProjectedChart> joinCurved(std::span<const PlanarFace> faces, const std::vector<ProjectedChart>& planar,
                                       uint32_t side_max_texels, const Standing& standing);

}  // namespace dimmer::cook
