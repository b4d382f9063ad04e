// Lightmap UVs that a level brings.
#pragma once

#include <scene/scene.h>

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace dimmer::cook {

// Scales SceneMesh::uv1 so that its texels are square in the mean (pages may be none), and empties it where it is no
// unwrap (inside 0..1 but for rounding, which it clamps; every triangle with area, no two on one spot, few stretched)
// and says why in uv1_fault. Only of meshes that get a lightmap; the density is that of meshes that state none.
void dropInvalidUnwraps(Scene& scene, float texels_per_metre);

// What a unit of the unwrap is in space, at a triangle with area in both: along the way in which it is the longest, and
// across, where it is the shortest.
struct UnwrapScale {
    double long_m, short_m;
    glm::dvec2 short_way;  // a unit vector of the unwrap
};
UnwrapScale unwrapScale(const std::array<glm::vec2, 3>& uv, const std::array<glm::vec3, 3>& positions_m);

// Whether a piece of that size (in units of the unwrap) is no wider in space than a texel, which is what it is given.
bool isNarrow(const UnwrapScale& scale, glm::vec2 piece, float texels_per_metre);

// The given triangles (of SceneMesh::triangles) by the pieces of the unwrap that they lie in, which share no corner:
// indices into `triangles`, ascending, the piece with the first triangle first.
std::vector<std::vector<uint32_t>> unwrapPieces(const SceneMesh& mesh, std::span<const uint32_t> triangles);

// By pieces, their triangles on a page, in texels.
using PlacedPieces = std::vector<std::vector<std::array<glm::vec2, 3>>>;

// Whether bilinear filtering would show more than a hundredth of the pieces' texels mixed with others' light. `size`:
// of the rectangle that they lie in.
bool piecesBleed(const PlacedPieces& pieces, glm::uvec2 size);

}  // namespace dimmer::cook
