// Keeps meshes closed where some of their triangles were cut.
#pragma once

#include <scene/scene.h>

#include <span>

namespace dimmer::cook {

// The vertices of a mesh from `first_new` on are new.
struct CutMesh {
    uint32_t mesh;
    size_t first_new;
};

// Where a triangle ends at a new vertex and its neighbour has none, rasterisers leave single pixels of the two open.
// Splits every triangle of `meshes` at the new vertices of all of them that lie on its edges, and makes new vertices in
// one place one, bit for bit. Positions and texture coordinates are linear along an edge, and stay as they
// are; normals are interpolated. Deterministic. Cost for each edge: that of the new vertices in its box, and O(log n).
void splitSharedEdges(Scene& scene, std::span<const CutMesh> meshes);

}  // namespace dimmer::cook
