// Lightmap UVs that a level brings.
#pragma once

#include <scene/scene.h>

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace dimmer::cook {

// Empties SceneMesh::uv1 where it is no unwrap (inside 0..1 but for rounding, which it clamps; every triangle with
// area, no two on one spot) and says why in uv1_fault. Only of meshes that get a lightmap.
void dropInvalidUnwraps(Scene& scene);

// The given triangles (of SceneMesh::triangles) by the pieces of the unwrap that they lie in, which share no corner:
// indices into `triangles`, ascending, the piece with the first triangle first.
std::vector<std::vector<uint32_t>> unwrapPieces(const SceneMesh& mesh, std::span<const uint32_t> triangles);

// By pieces, their triangles on a page, in texels.
using PlacedPieces = std::vector<std::vector<std::array<glm::vec2, 3>>>;

// Whether bilinear filtering would show more than a hundredth of the pieces' texels mixed with others' light. `size`:
// of the rectangle that they lie in.
bool piecesBleed(const PlacedPieces& pieces, glm::uvec2 size);

}  // namespace dimmer::cook
